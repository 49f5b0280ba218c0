//! What deeds are to a device.

use std::error::Error;
use std::fmt;

use bytes::Bytes;

use super::Deed;
use crate::{OwnedInput, Signal, SignalKind};

impl Deed {
    /// What it is to a device with these signals: the inputs that it gets, all at the same instant.
    /// Putting a device into a state is not an input.
    ///
    /// # Errors
    ///
    /// If there is no such signal, or it takes no such value.
    pub fn inputs(&self, signals: &[Signal]) -> Result<Vec<OwnedInput>, DeedError> {
        let set = |signal: &Signal, value| OwnedInput::Signal(signal.id, value);
        let checked = |name: &str, value| Ok(set(settable(signals, name, value)?, value));
        let button = |name: &str| find(signals, "button", name, Signal::can_be_pressed);
        Ok(match self {
            Deed::Byte(byte) => vec![OwnedInput::Bytes(Bytes::copy_from_slice(&[*byte]))],
            Deed::Press(name) => {
                let button = button(name)?;
                let values: &[i32] = if button.latches { &[1] } else { &[1, 0] };
                values.iter().map(|value| set(button, *value)).collect()
            }
            Deed::Hold(name) => vec![set(button(name)?, 1)],
            Deed::Release(name) => vec![set(button(name)?, 0)],
            Deed::Turn(name, position) => {
                // One that has no positions takes other values.
                let named = signals.iter().find(|signal| signal.name == *name);
                if let Some(signal) = named.filter(|signal| signal.positions.is_none()) {
                    let possible = format!("{}, as a number", signal.values_in_words());
                    let (name, value) = (name.clone(), position.clone());
                    return Err(DeedError::NoValue { name, value, possible });
                }
                let switch = find(signals, "switch", name, |signal| signal.positions.is_some())?;
                let value = switch.position(position);
                vec![set(switch, value.ok_or_else(|| no_value(switch, position))?)]
            }
            Deed::Input { port, bit, level } => {
                let of_bit = |signal: &&Signal| signal.bits.contains(&(*port, *bit));
                let signal = signals.iter().find(of_bit).ok_or_else(|| DeedError::NoInput {
                    port: *port,
                    bit: *bit,
                    known: names(signals, |signal| signal.terminal.is_some()),
                })?;
                vec![set(signal, i32::from(*level))]
            }
            Deed::Set(name, value) => vec![checked(name, *value)?],
            Deed::Several { signals, .. } => {
                let each = signals.iter().map(|(name, value)| checked(name, *value));
                each.collect::<Result<_, _>>()?
            }
            Deed::Power(on) => vec![OwnedInput::Power(*on)],
            Deed::Fault(faulting) => vec![OwnedInput::Fault((**faulting).clone())],
            Deed::Restore => Vec::new(),
        })
    }
}

/// The signal of this name, if it takes this value. This is where names and values are checked, whoever
/// gives them.
///
/// # Errors
///
/// If there is no such signal, or it takes no such value.
pub fn settable<'s>(
    signals: &'s [Signal],
    name: &str,
    value: i32,
) -> Result<&'s Signal, DeedError> {
    let signal = find(signals, "signal", name, |_| true)?;
    match signal.values().contains(&value) {
        true => Ok(signal),
        false => Err(no_value(signal, &value.to_string())),
    }
}

/// Why a deed cannot be done to a device.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DeedError {
    /// It has no such signal.
    NoSignal {
        /// What kind of thing was asked for, such as `button`.
        wanted: &'static str,
        /// The name.
        name: String,
        /// The names that are much like it.
        like: Vec<String>,
        /// All names that would be right.
        known: Vec<String>,
    },
    /// The name is that of a terminal, and the signal that is wired to it has another.
    Terminal {
        /// The terminal.
        terminal: String,
        /// The signal.
        name: String,
    },
    /// The signal does not take this value.
    NoValue {
        /// The signal.
        name: String,
        /// What it was to be.
        value: String,
        /// What would be right, for people.
        possible: String,
    },
    /// No signal is read by this bit alone.
    NoInput {
        /// The port.
        port: u16,
        /// The bit.
        bit: u8,
        /// The user inputs there are.
        known: Vec<String>,
    },
}

impl fmt::Display for DeedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DeedError::NoSignal { wanted, name, like, .. } if !like.is_empty() => {
                write!(f, "there is no {wanted} `{name}`; did you mean {}?", like.join(" or "))
            }
            DeedError::NoSignal { wanted, name, known, .. } => {
                let verb = if known.len() == 1 { "is" } else { "are" };
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                write!(f, "there is no {wanted} `{name}`; there {verb} {known}")
            }
            DeedError::Terminal { terminal, name } => {
                write!(f, "{terminal} is called {name}, as in `{name} 1`")
            }
            DeedError::NoValue { name, value, possible } => {
                write!(f, "`{name}` cannot be `{value}`; it can be {possible}")
            }
            DeedError::NoInput { port, bit, known } if known.is_empty() => {
                write!(f, "nothing outside drives bit {bit} of port {port}; there are no inputs")
            }
            DeedError::NoInput { port, bit, known } => {
                let known = known.join(", ");
                write!(f, "nothing outside drives bit {bit} of port {port}; the inputs are {known}")
            }
        }
    }
}

impl Error for DeedError {}

/// The signal of that name among those that fit.
fn find<'s>(
    signals: &'s [Signal],
    wanted: &'static str,
    name: &str,
    fits: impl Fn(&Signal) -> bool,
) -> Result<&'s Signal, DeedError> {
    if let Some(signal) = signals.iter().find(|signal| signal.name == name && fits(signal)) {
        return Ok(signal);
    }
    if let Some(wired) = signals.iter().find(|signal| signal.terminal.as_deref() == Some(name)) {
        return Err(DeedError::Terminal { terminal: name.to_owned(), name: wired.name.clone() });
    }
    // Any input can be pressed, but the buttons are what is looked for.
    let listed =
        |signal: &Signal| fits(signal) && (wanted == "signal" || signal.kind != SignalKind::Input);
    let like = names(signals, |signal| fits(signal) && is_like(name, &signal.name));
    Err(DeedError::NoSignal { wanted, name: name.to_owned(), like, known: names(signals, listed) })
}

fn names(signals: &[Signal], fits: impl Fn(&Signal) -> bool) -> Vec<String> {
    signals.iter().filter(|signal| fits(signal)).map(|signal| signal.name.clone()).collect()
}

fn no_value(signal: &Signal, value: &str) -> DeedError {
    DeedError::NoValue {
        name: signal.name.clone(),
        value: value.to_owned(),
        possible: signal.values_in_words(),
    }
}

/// Whether a name may have been meant as another: most of the letters are the same.
#[must_use]
pub fn is_like(name: &str, known: &str) -> bool {
    let part = name.len() > 2 && (known.contains(name) || name.contains(known));
    part || distance(name, known) <= known.len() / 3
}

/// How many letters are to be put in, left out, exchanged or swapped with the next to make one
/// word of the other.
fn distance(one: &str, other: &str) -> usize {
    let (one, other): (Vec<char>, Vec<char>) = (one.chars().collect(), other.chars().collect());
    let mut before: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in one.iter().enumerate() {
        let mut next = vec![i + 1];
        for (j, b) in other.iter().enumerate() {
            let mut least = (row[j] + usize::from(a != b)).min(row[j + 1] + 1).min(next[j] + 1);
            if i > 0 && j > 0 && *a == other[j - 1] && one[i - 1] == *b {
                least = least.min(before[j - 1] + 1);
            }
            next.push(least);
        }
        before = std::mem::replace(&mut row, next);
    }
    row.last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::distance;

    #[test]
    fn a_slip_of_the_finger_is_one_mistake() {
        for (one, other, mistakes) in [
            ("", "stop", 4),
            ("stop", "stop", 0),
            ("stpo", "stop", 1),
            ("sotp", "stop", 1),
            ("stp", "stop", 1),
            ("stoop", "stop", 1),
            ("step", "stop", 1),
            ("pots", "stop", 3),
        ] {
            assert_eq!((distance(one, other), distance(other, one)), (mistakes, mistakes), "{one}");
        }
    }
}
