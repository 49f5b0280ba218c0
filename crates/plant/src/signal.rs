//! The names of the things that can be set from outside.

use vimc4_device::{AXES, Signal, SignalId};

use crate::End;

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
    /// The signals of the operating panel and of the power stages.
    pub const PANEL: [PlantSignal; 10] = [
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
    ];

    const FIRST_LIMIT: u16 = Self::PANEL.len() as u16;
    const FIRST_INPUT: u16 = 64;

    /// How many user inputs there can be.
    pub const INPUTS: u8 = 64;

    /// Its number. Those from 128 on are never given to a signal of the plant.
    #[must_use]
    pub fn id(self) -> SignalId {
        SignalId(match self {
            PlantSignal::Input(number) => Self::FIRST_INPUT + u16::from(number),
            PlantSignal::Limit(axis, end) => {
                Self::FIRST_LIMIT + 2 * axis as u16 + u16::from(end == End::Positive)
            }
            panel => Self::PANEL.iter().position(|&s| s == panel).unwrap_or(0) as u16,
        })
    }

    /// The signal with a number.
    #[must_use]
    pub fn from_id(id: SignalId) -> Option<PlantSignal> {
        if let Some(number) = id.0.checked_sub(Self::FIRST_INPUT) {
            let number = u8::try_from(number).ok().filter(|number| *number < Self::INPUTS);
            return number.map(PlantSignal::Input);
        }
        match id.0.checked_sub(Self::FIRST_LIMIT) {
            Some(number) => {
                let end = if number % 2 == 1 { End::Positive } else { End::Negative };
                let axis = usize::from(number / 2);
                (axis < AXES).then_some(PlantSignal::Limit(axis, end))
            }
            None => Self::PANEL.get(usize::from(id.0)).copied(),
        }
    }

    /// The signal as people see it. `place` is the controller's name for the user input or, in
    /// small letters, for the axis that it belongs to.
    #[must_use]
    pub fn describe(self, place: &str) -> Signal {
        let button = |name: &str, about: &str| Signal::button(self.id(), name, about);
        let input = |name: &str, about: &str| Signal::input(self.id(), name, about);
        let switch =
            |name: &str, positions, about: &str| Signal::switch(self.id(), name, positions, about);
        match self {
            PlantSignal::Start => button("start", "START button"),
            PlantSignal::Stop => button("stop", "STOP button"),
            PlantSignal::On => button("on", "ON button of the power stage"),
            PlantSignal::CoverButton => {
                button("cover-button", "button that asks to open the cover")
            }
            PlantSignal::EmergencyStop => {
                button("estop", "emergency stop, latches until released").latching()
            }
            PlantSignal::Key => switch("key", ["test", "auto"], "key switch"),
            PlantSignal::Cover => switch("cover", ["open", "closed"], "cover"),
            PlantSignal::Overtemperature => {
                input("overtemperature", "the power stages are too hot")
            }
            PlantSignal::PowerOk => input("power-ok", "the motor supply voltage is good"),
            PlantSignal::Probe => input("probe", "tool length probe"),
            PlantSignal::Limit(_, end) => {
                let (sign, word) = match end {
                    End::Negative => ('-', "negative"),
                    End::Positive => ('+', "positive"),
                };
                let axis = place.to_uppercase();
                let about = format!("{word} limit switch of {axis}, held by hand");
                input(&format!("limit {place}{sign}"), &about)
            }
            PlantSignal::Input(number) => {
                let number = number + 1;
                input(&format!("input {place}"), &format!("user input {number}"))
                    .wired_to(format!("in{number}"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_signals_are_one_to_one() {
        let ends = [End::Negative, End::Positive];
        let limits = (0..AXES).flat_map(|axis| ends.map(|end| PlantSignal::Limit(axis, end)));
        let inputs = (0..PlantSignal::INPUTS).map(PlantSignal::Input);
        for signal in PlantSignal::PANEL.into_iter().chain(limits).chain(inputs) {
            assert_eq!(PlantSignal::from_id(signal.id()), Some(signal));
            assert!(signal.id() < SignalId(128));
        }
        for none in [22, 63, 128, u16::MAX] {
            assert_eq!(PlantSignal::from_id(SignalId(none)), None);
        }
    }
}
