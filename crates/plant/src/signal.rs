//! The names of the things that can be set from outside.

use vimc4_device::{Signal, SignalId, SignalKind};

use crate::End;

const AXIS_NAMES: [&str; 4] = ["x", "y", "z", "a"];

/// A thing of the outside world that the plant simulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlantSignal {
    /// The START button.
    Start,
    /// The STOP button.
    Stop,
    /// The ON button of the power stage.
    On,
    /// The button that asks for the cover to be released.
    CoverButton,
    /// The emergency stop; it latches until it is released.
    EmergencyStop,
    /// The key switch: 0 test, 1 automatic.
    Key,
    /// The cover: 0 open, 1 closed.
    Cover,
    /// Overtemperature of the power stages.
    Overtemperature,
    /// The supply voltage of the power stages is good.
    PowerOk,
    /// The tool length probe.
    Probe,
    /// A limit switch held active by hand, wherever the carriage is: axis and end.
    Limit(usize, End),
    /// A user input by number, from 0.
    Input(u8),
}

impl PlantSignal {
    /// Every signal but the user inputs, whose number depends on the controller.
    pub const FIXED: [PlantSignal; 18] = [
        PlantSignal::Start,
        PlantSignal::Stop,
        PlantSignal::On,
        PlantSignal::CoverButton,
        PlantSignal::EmergencyStop,
        PlantSignal::Key,
        PlantSignal::Cover,
        PlantSignal::Overtemperature,
        PlantSignal::PowerOk,
        PlantSignal::Probe,
        PlantSignal::Limit(0, End::Negative),
        PlantSignal::Limit(0, End::Positive),
        PlantSignal::Limit(1, End::Negative),
        PlantSignal::Limit(1, End::Positive),
        PlantSignal::Limit(2, End::Negative),
        PlantSignal::Limit(2, End::Positive),
        PlantSignal::Limit(3, End::Negative),
        PlantSignal::Limit(3, End::Positive),
    ];

    const FIRST_INPUT: u16 = 64;

    /// Its number.
    #[must_use]
    pub fn id(self) -> SignalId {
        match self {
            PlantSignal::Input(number) => SignalId(Self::FIRST_INPUT + u16::from(number)),
            fixed => {
                let index = Self::FIXED.iter().position(|&s| s == fixed).unwrap_or(0);
                SignalId(index as u16)
            }
        }
    }

    /// The signal with a number.
    #[must_use]
    pub fn from_id(id: SignalId) -> Option<PlantSignal> {
        match id.0.checked_sub(Self::FIRST_INPUT) {
            Some(number) => u8::try_from(number).ok().filter(|n| *n < 64).map(PlantSignal::Input),
            None => Self::FIXED.get(usize::from(id.0)).copied(),
        }
    }

    /// The signal as a person sees it. A user input is called by `input_name`.
    #[must_use]
    pub fn describe(self, input_name: &str) -> Signal {
        let button = (SignalKind::Button, None);
        let input = (SignalKind::Input, None);
        let switch = |a: &str, b: &str| (SignalKind::Switch, Some([a.to_owned(), b.to_owned()]));
        let (name, (kind, positions), about) = match self {
            PlantSignal::Start => ("start".into(), button, "START button".into()),
            PlantSignal::Stop => ("stop".into(), button, "STOP button".into()),
            PlantSignal::On => ("on".into(), button, "ON button of the power stage".into()),
            PlantSignal::CoverButton => {
                ("cover-button".into(), button, "button that asks to open the cover".into())
            }
            PlantSignal::EmergencyStop => {
                ("estop".into(), button, "emergency stop, latches until released".into())
            }
            PlantSignal::Key => ("key".into(), switch("test", "auto"), "key switch".into()),
            PlantSignal::Cover => ("cover".into(), switch("open", "closed"), "cover".into()),
            PlantSignal::Overtemperature => {
                ("overtemperature".into(), input, "the power stages are too hot".into())
            }
            PlantSignal::PowerOk => {
                ("power-ok".into(), input, "the motor supply voltage is good".into())
            }
            PlantSignal::Probe => ("probe".into(), input, "tool length probe".into()),
            PlantSignal::Limit(axis, end) => {
                let axis = AXIS_NAMES.get(axis).copied().unwrap_or("?");
                let (sign, word) = match end {
                    End::Negative => ('-', "negative"),
                    End::Positive => ('+', "positive"),
                };
                (
                    format!("limit {axis}{sign}"),
                    input,
                    format!("{word} limit switch of {}, held by hand", axis.to_uppercase()),
                )
            }
            PlantSignal::Input(number) => {
                (format!("input {input_name}"), input, format!("user input {}", number + 1))
            }
        };
        Signal { id: self.id(), name, kind, positions, about }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_signals_are_one_to_one() {
        let inputs = (0..64).map(PlantSignal::Input);
        for signal in PlantSignal::FIXED.into_iter().chain(inputs) {
            assert_eq!(PlantSignal::from_id(signal.id()), Some(signal));
        }
        assert_eq!(PlantSignal::from_id(SignalId(63)), None);
        assert_eq!(PlantSignal::from_id(SignalId(u16::MAX)), None);
    }
}
