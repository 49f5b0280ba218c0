//! The options that somebody typed: each of them must have an effect.

use std::collections::BTreeSet;

use clap::ArgMatches;
use clap::parser::ValueSource;

use crate::failure::Failure;

/// The names of the options on the command line, without the dashes. Defaults are not among them.
#[derive(Clone, Debug, Default)]
pub(crate) struct TypedOptions(BTreeSet<String>);

impl TypedOptions {
    pub(crate) fn of(matches: &ArgMatches) -> TypedOptions {
        let is_typed = |id: &str| {
            matches.try_contains_id(id).is_ok()
                && matches.value_source(id) == Some(ValueSource::CommandLine)
        };
        let ids = matches.ids().map(clap::Id::as_str).filter(|id| is_typed(id));
        TypedOptions(ids.map(|id| id.replace('_', "-")).collect())
    }

    /// Refuses those of these options that were typed, because nothing would come of them.
    ///
    /// # Errors
    ///
    /// If one of them was typed.
    pub(crate) fn refuse(&self, options: &[&str], where_: &str) -> Result<(), Failure> {
        let typed: Vec<_> = options.iter().filter(|option| self.0.contains(**option)).collect();
        let named: Vec<_> = typed.iter().map(|option| format!("--{option}")).collect();
        match named.as_slice() {
            [] => Ok(()),
            [one] => Err(Failure::usage(format!("{one} has no effect {where_}; leave it out"))),
            [all @ .., last] => Err(Failure::usage(format!(
                "{} and {last} have no effect {where_}; leave them out",
                all.join(", ")
            ))),
        }
    }

    /// The same where this is so.
    ///
    /// # Errors
    ///
    /// If it is so and one of them was typed.
    pub(crate) fn refuse_if(
        &self,
        is_so: bool,
        options: &[&str],
        where_: &str,
    ) -> Result<(), Failure> {
        if is_so { self.refuse(options, where_) } else { Ok(()) }
    }
}
