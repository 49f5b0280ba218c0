//! The families of controllers.

use std::fmt;

use vimc4_device::{Effects, Model as _, Travel};

use crate::list::{Family, by};

impl Family {
    /// Its name as people type it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        by!(self, M => <M as vimc4_device::Model>::FAMILY)
    }

    /// Its name as its maker writes it.
    #[must_use]
    pub const fn maker(self) -> &'static str {
        by!(self, M => <M as vimc4_device::Model>::MAKER)
    }

    /// The names of its built-in models.
    #[must_use]
    pub fn models(self) -> Vec<&'static str> {
        by!(self, M => M::names())
    }

    /// The command sets that its profiles can name.
    pub(crate) const fn command_sets(self) -> &'static [&'static str] {
        by!(self, M => <M as vimc4_device::Model>::COMMAND_SETS)
    }

    /// Every value that each quirk of its profiles can have, as TOML writes it.
    pub(crate) const fn quirks(self) -> &'static [(&'static str, &'static [&'static str])] {
        by!(self, M => <M as vimc4_device::Model>::QUIRKS)
    }

    /// What sending these bytes to a controller that has just been switched on may do.
    #[must_use]
    pub fn effects_of(self, sent: &[u8]) -> Effects {
        by!(self, M => M::effects_of(sent))
    }

    /// What setting the signal of that name may do.
    #[must_use]
    pub fn effects_of_signal(self, name: &str) -> Effects {
        by!(self, M => M::effects_of_signal(name))
    }

    /// What a command does that lasts.
    #[must_use]
    pub fn travel_of(self, command: &[u8]) -> Travel {
        by!(self, M => M::travel_of(command))
    }

    /// What kind of answer it is: `0`, `C`, `E0D`, as the tables of the commands name them.
    #[must_use]
    pub fn kind_of(self, answer: &[u8]) -> Option<String> {
        by!(self, M => M::kind_of(answer))
    }

    /// Whether a command that has answered this has nothing more to answer.
    #[must_use]
    pub fn completes(self, answer: &[u8]) -> bool {
        by!(self, M => M::completes(answer))
    }

    /// What is wrong, if the answer says that something is: `5: unknown or malformed command`.
    #[must_use]
    pub fn refusal(self, answer: &[u8]) -> Option<String> {
        by!(self, M => M::refusal(answer))
    }

    /// Whether the counters may have been set to 0 where this was answered.
    #[must_use]
    pub fn resets_counters(self, answer: &[u8]) -> bool {
        by!(self, M => M::resets_counters(answer))
    }

    /// Whether the counters may say something else than where the axes are, where this was answered:
    /// steps may have been lost, or the axes had no reference point.
    #[must_use]
    pub fn distrusts_counters(self, answer: &[u8]) -> bool {
        by!(self, M => M::distrusts_counters(answer))
    }

    /// Whether a controller that has moved its axes answers so only where it has forgotten, without
    /// power or in an emergency stop, what it was told before.
    #[must_use]
    pub fn has_forgotten(self, answer: &[u8]) -> bool {
        by!(self, M => M::has_forgotten(answer))
    }

    /// Whether only controllers of this family answer so.
    pub(crate) fn is_own_answer(self, answer: &[u8]) -> bool {
        by!(self, M => M::is_own_answer(answer))
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.maker())
    }
}
