//! A picture of a device for people.

use serde::{Deserialize, Serialize};

use crate::Time;

/// What a person would ask a device for, without knowing the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The time of the picture.
    pub at: Time,
    /// The model's name.
    pub model: String,
    /// Whether it has power.
    pub powered: bool,
    /// What it does, in a few words: `idle`, `relative move`, `reference run`.
    pub activity: String,
    /// The axes, configured or not.
    pub axes: Vec<AxisView>,
    /// Start-stop frequency in Hz.
    pub start_stop: u32,
    /// Acceleration in Hz/ms.
    pub acceleration: u32,
    /// What it will do by itself and when, soonest first.
    pub timers: Vec<TimerView>,
    /// The stored program, if there is one.
    pub program: Option<ProgramView>,
    /// The ports.
    pub ports: Vec<PortView>,
    /// Other settings, name and value.
    pub settings: Vec<(String, String)>,
}

/// One axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisView {
    /// `X`, `Y`, `Z` or `A`.
    pub name: String,
    /// Whether the host has configured it.
    pub configured: bool,
    /// The step counter.
    pub position: i64,
    /// Where the carriage really is, steps of the machine.
    pub carriage: i64,
    /// Whether its reference point is known.
    pub referenced: bool,
    /// Its virtual zero, steps.
    pub zero: i64,
    /// Its share of the present step frequency, µHz, with the sign of its direction.
    pub speed: i64,
}

/// One thing that will happen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimerView {
    /// What.
    pub cause: String,
    /// When.
    pub due: Time,
}

/// The stored program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgramView {
    /// `valid`, `incomplete`, `invalid`, `running`, `paused`.
    pub status: String,
    /// Its lines as they were stored.
    pub lines: Vec<String>,
    /// The line that is being executed, from 0.
    pub marker: Option<u32>,
    /// The open loops, outermost first.
    pub loops: Vec<LoopView>,
}

/// One open loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopView {
    /// The line of the loop command, from 0.
    pub line: u32,
    /// How many more times the block will run.
    pub left: u32,
}

/// One port.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PortView {
    /// Its number.
    pub port: u16,
    /// Whether the host reads it (otherwise it writes it).
    pub input: bool,
    /// Its value.
    pub value: u8,
}
