//! The buttons and inputs that help texts name.

use vimc4_device::{Names, Signal, SignalKind};

/// The buttons, or the inputs of a device that has no buttons.
pub(crate) fn buttons(names: &Names) -> Vec<&Signal> {
    let of = |kind| names.signals().iter().filter(|signal| signal.kind == kind).collect::<Vec<_>>();
    let buttons = of(SignalKind::Button);
    if buttons.is_empty() { of(SignalKind::Input) } else { buttons }
}

/// Their names, one after the other.
pub(crate) fn button_names(names: &Names) -> String {
    let names: Vec<_> = buttons(names).into_iter().map(|button| button.name.as_str()).collect();
    names.join(", ")
}

/// A bit of an input port that can be set: of a user input, if there is one.
pub(crate) fn input_example(names: &Names) -> Option<String> {
    let readable = || names.signals().iter().filter(|signal| !signal.bits.is_empty());
    let input = readable().find(|signal| signal.terminal.is_some());
    let (port, bit) = input.or_else(|| readable().next())?.bits.first()?;
    Some(format!("{port}.{bit}"))
}
