//! The families of controllers.

use std::fmt;

/// Controllers that speak one language. What differs within a family is a value in a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// isel: commands that begin with `@`, and a memory for a program.
    Isel,
    /// LPKF: a stream of HPGL commands.
    Lpkf,
}

impl Family {
    /// All of them.
    pub const ALL: [Family; 2] = [Family::Isel, Family::Lpkf];

    /// Its name as people type it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Family::Isel => "isel",
            Family::Lpkf => "lpkf",
        }
    }

    /// Its name as its maker writes it.
    #[must_use]
    pub const fn maker(self) -> &'static str {
        match self {
            Family::Isel => "isel",
            Family::Lpkf => "LPKF",
        }
    }

    /// The names of its built-in models.
    #[must_use]
    pub fn models(self) -> Vec<&'static str> {
        match self {
            Family::Isel => vimc4_isel::Model::names(),
            Family::Lpkf => vimc4_lpkf::Model::names(),
        }
    }

    /// The command sets that its profiles can name.
    pub(crate) const fn command_sets(self) -> &'static [&'static str] {
        match self {
            Family::Isel => &["imc4", "imc4-m", "imc-xx", "c142"],
            Family::Lpkf => &["smcu", "motionsystem"],
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.maker())
    }
}
