//! The families of controllers.

use std::fmt;

use vimc4_device::{Effects, Model as _, Travel};

use crate::list::{Family, by};

impl Family {
    /// Its name as typed.
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

    /// The names of the axes of its models.
    pub(crate) const fn axes(self) -> &'static [&'static [&'static str]] {
        by!(self, M => <M as vimc4_device::Model>::AXES)
    }

    /// Every value that each quirk of its profiles can have, as TOML writes it.
    pub(crate) const fn quirks(self) -> &'static [(&'static str, &'static [&'static str])] {
        by!(self, M => <M as vimc4_device::Model>::QUIRKS)
    }

    /// The possible effects of sending these bytes to a controller that has just been switched on.
    #[must_use]
    pub fn effects_of(self, sent: &[u8]) -> Effects {
        by!(self, M => M::effects_of(sent))
    }

    /// The possible effects of setting the signal of that name.
    #[must_use]
    pub fn effects_of_signal(self, name: &str) -> Effects {
        by!(self, M => M::effects_of_signal(name))
    }

    /// The lasting effect of a command.
    #[must_use]
    pub fn travel_of(self, command: &[u8]) -> Travel {
        by!(self, M => M::travel_of(command))
    }

    /// The kind of an answer, as the command tables name it: `0`, `C`, `E0D`.
    #[must_use]
    pub fn kind_of(self, answer: &[u8]) -> Option<String> {
        by!(self, M => M::kind_of(answer))
    }

    /// Whether this answer is the last one to its command.
    #[must_use]
    pub fn completes(self, answer: &[u8]) -> bool {
        by!(self, M => M::completes(answer))
    }

    /// The error, if the answer is one: `5: unknown or malformed command`.
    #[must_use]
    pub fn refusal(self, answer: &[u8]) -> Option<String> {
        by!(self, M => M::refusal(answer))
    }

    /// Whether the counters may have been set to 0 when this was answered.
    #[must_use]
    pub fn resets_counters(self, answer: &[u8]) -> bool {
        by!(self, M => M::resets_counters(answer))
    }

    /// Whether the counters may no longer match the axes when this was answered: steps may have
    /// been lost, or the axes had no reference point.
    #[must_use]
    pub fn distrusts_counters(self, answer: &[u8]) -> bool {
        by!(self, M => M::distrusts_counters(answer))
    }

    /// Whether a controller that has moved its axes gives this answer only after it has lost its
    /// settings, through loss of power or an emergency stop.
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
