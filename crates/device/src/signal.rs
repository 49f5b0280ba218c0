//! The settable things around a device.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// The number of a signal, valid for the device that listed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SignalId(pub u16);

/// What kind of thing a signal is, and so which values it takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SignalKind {
    /// 1 while pressed.
    Button,
    /// A switch with two named positions, see [`Signal::positions`].
    Switch,
    /// A digital input, 0 or 1.
    Input,
    /// A value in the given range.
    Analogue {
        /// Smallest value.
        low: i32,
        /// Largest value.
        high: i32,
    },
}

/// A thing of the outside world that a test or a person can set, with everything that a tool needs
/// to show, check and complete its name and values.
///
/// ```
/// use vimc4_device::{Signal, SignalId};
///
/// let estop = Signal::button(SignalId(4), "estop", "emergency stop").latching();
/// assert!(estop.latches);
/// let cover = Signal::switch(SignalId(6), "cover", ["open", "closed"], "cover");
/// assert_eq!((cover.value_of("closed"), cover.value_of("0")), (Some(1), Some(0)));
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Signal {
    /// Its number.
    pub id: SignalId,
    /// Its name as people type it, lower case: `start`, `cover`, `input 0.3`.
    pub name: String,
    /// Button, switch, input or analogue.
    pub kind: SignalKind,
    /// For a switch, the names of the values 0 and 1, as in `["open", "closed"]`.
    pub positions: Option<[String; 2]>,
    /// For a button, whether it stays pressed until it is released, as an emergency stop does.
    pub latches: bool,
    /// The port bits by which the device reads it, if any: port and bit, the usual one first.
    pub bits: Vec<(u16, u8)>,
    /// For a user input, the terminal it is wired to, as profiles name it: `in1`.
    pub terminal: Option<String>,
    /// What it does, in a few words.
    pub about: String,
}

impl Signal {
    fn new(
        id: SignalId,
        name: impl Into<String>,
        kind: SignalKind,
        about: impl Into<String>,
    ) -> Signal {
        Signal {
            id,
            name: name.into(),
            kind,
            positions: None,
            latches: false,
            bits: Vec::new(),
            terminal: None,
            about: about.into(),
        }
    }

    /// A button.
    #[must_use]
    pub fn button(id: SignalId, name: impl Into<String>, about: impl Into<String>) -> Signal {
        Signal::new(id, name, SignalKind::Button, about)
    }

    /// A switch; `positions` are the names of its values 0 and 1.
    #[must_use]
    pub fn switch(
        id: SignalId,
        name: impl Into<String>,
        positions: [&str; 2],
        about: impl Into<String>,
    ) -> Signal {
        let positions = Some(positions.map(str::to_owned));
        Signal { positions, ..Signal::new(id, name, SignalKind::Switch, about) }
    }

    /// A digital input.
    #[must_use]
    pub fn input(id: SignalId, name: impl Into<String>, about: impl Into<String>) -> Signal {
        Signal::new(id, name, SignalKind::Input, about)
    }

    /// A value within these limits.
    #[must_use]
    pub fn analogue(
        id: SignalId,
        name: impl Into<String>,
        (low, high): (i32, i32),
        about: impl Into<String>,
    ) -> Signal {
        Signal::new(id, name, SignalKind::Analogue { low, high }, about)
    }

    /// The same button, which stays pressed until it is released.
    #[must_use]
    pub fn latching(self) -> Signal {
        Signal { latches: true, ..self }
    }

    /// The same signal, read by these port bits.
    #[must_use]
    pub fn read_by(self, bits: impl IntoIterator<Item = (u16, u8)>) -> Signal {
        Signal { bits: bits.into_iter().collect(), ..self }
    }

    /// The same input as a user input, wired to this terminal.
    #[must_use]
    pub fn wired_to(self, terminal: impl Into<String>) -> Signal {
        Signal { terminal: Some(terminal.into()), ..self }
    }

    /// Whether it can be pressed, held and released: a button, or an input that is held active by
    /// hand.
    #[must_use]
    pub fn can_be_pressed(&self) -> bool {
        matches!(self.kind, SignalKind::Button | SignalKind::Input)
    }

    /// The values that it takes.
    #[must_use]
    pub fn values(&self) -> RangeInclusive<i32> {
        match self.kind {
            SignalKind::Analogue { low, high } => low..=high,
            SignalKind::Button | SignalKind::Switch | SignalKind::Input => 0..=1,
        }
    }

    /// The values that it takes, for people, with a word between the last two of them: `0 or 1`,
    /// `open or closed`, `a number from -9 to 9`.
    #[must_use]
    pub fn values_in_words(&self) -> String {
        match (&self.kind, &self.positions) {
            (_, Some([first, second])) => format!("{first} or {second}"),
            (SignalKind::Analogue { low, high }, _) => format!("a number from {low} to {high}"),
            _ => "0 or 1".to_owned(),
        }
    }

    /// The value of a switch in the position of that name.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<i32> {
        let mut positions = (0..).zip(self.positions.iter().flatten());
        positions.find(|(_, position)| *position == name).map(|(value, _)| value)
    }

    /// The value that a word stands for: the name of a position, or a number that it takes.
    #[must_use]
    pub fn value_of(&self, word: &str) -> Option<i32> {
        let number = || word.parse().ok().filter(|value| self.values().contains(value));
        self.position(word).or_else(number)
    }
}
