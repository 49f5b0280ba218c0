//! Options of a command that are built only when the command is used.

use clap::{ArgMatches, Args, Command, Error, FromArgMatches};

use crate::typed_options::TypedOptions;

/// The options of a subcommand. Those of the others are not built, which would take most of the
/// program's start. With them come the names of those that were typed.
pub(crate) struct Deferred<A>(pub(crate) A, pub(crate) TypedOptions);

fn augmented<A: Args>(command: Command) -> Command {
    // What a command is about stands where it is named, and its own text does not take that place.
    let about = command.get_about().cloned().unwrap_or_default();
    A::augment_args(command).about(about)
}

impl<A: Args> Args for Deferred<A> {
    fn augment_args(command: Command) -> Command {
        command.defer(augmented::<A>)
    }

    fn augment_args_for_update(command: Command) -> Command {
        command.defer(augmented::<A>)
    }
}

impl<A: FromArgMatches> FromArgMatches for Deferred<A> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Deferred<A>, Error> {
        A::from_arg_matches(matches).map(|options| Deferred(options, TypedOptions::of(matches)))
    }

    fn from_arg_matches_mut(matches: &mut ArgMatches) -> Result<Deferred<A>, Error> {
        let typed = TypedOptions::of(matches);
        A::from_arg_matches_mut(matches).map(|options| Deferred(options, typed))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        self.0.update_from_arg_matches(matches)
    }
}
