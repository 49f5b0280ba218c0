//! What a device offers for orders.

use super::table::Verb;
use crate::{Names, Signal, SignalKind};

/// The orders that a device with these names can take.
impl Names {
    /// Whether the device has what the verb is about: no erasing where the panel cannot erase, no
    /// switches where there are none.
    #[must_use]
    pub fn has(&self, verb: Verb) -> bool {
        let any = |fits: fn(&Signal) -> bool| self.signals().iter().any(fits);
        match verb {
            Verb::Press | Verb::Hold | Verb::Release => any(Signal::can_be_pressed),
            Verb::Turn => any(|signal| signal.positions.is_some()),
            Verb::Input => any(|signal| !signal.bits.is_empty()),
            Verb::Set | Verb::Signals => !self.signals().is_empty(),
            Verb::Erase => self.can_erase(),
            _ => true,
        }
    }

    /// The buttons, or the inputs of a device that has no buttons.
    pub(super) fn buttons(&self) -> Vec<&Signal> {
        let of =
            |kind| self.signals().iter().filter(|signal| signal.kind == kind).collect::<Vec<_>>();
        let buttons = of(SignalKind::Button);
        if buttons.is_empty() { of(SignalKind::Input) } else { buttons }
    }

    /// Their names, one after the other.
    pub(super) fn button_names(&self) -> String {
        let names: Vec<_> = self.buttons().into_iter().map(|button| button.name.as_str()).collect();
        names.join(", ")
    }

    /// A bit of an input port that can be set: of a user input, if there is one.
    pub(super) fn input_example(&self) -> Option<String> {
        let readable = || self.signals().iter().filter(|signal| !signal.bits.is_empty());
        let input = readable().find(|signal| signal.terminal.is_some());
        let (port, bit) = input.or_else(|| readable().next())?.bits.first()?;
        Some(format!("{port}.{bit}"))
    }
}
