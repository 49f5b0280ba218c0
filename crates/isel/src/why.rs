//! Why an answer is an error.
//!
//! The controller decides with typed reasons, which cost nothing; `words` turns them into text when
//! events are watched.

use serde::{Deserialize, Serialize};
use vimc4_isel_wire::{AxisSet, Fault, Reply};
use vimc4_plant::End;

use crate::axes::AXES;
use crate::model::Unreferenced;

/// Why a command is refused, or ended before its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Why {
    /// `1`, `3`, `5`, `7`, `8`, `D`: the line is not a command.
    Line(Fault),
    /// `5`: the line is longer than any command.
    TooLong,
    /// `4`.
    NoAxes,
    /// `5`: the model's profile does not have this diagnosis.
    NoDiagnosis([u8; 2]),
    /// `3`: a circle or a helix in a plane of which these axes are not configured.
    Plane(AxisSet),
    /// `3`: a circle or a helix is to be stored that has no plane.
    NoPlane,
    /// `D`: an axis moves at speed 0.
    AtRest,
    /// `9`: the motors have no current.
    Stages(Off),
    /// `9`: the spindle is to be switched on, and the stages are off.
    Spindle,
    /// `9`: the stages are to be switched on, and the cover is open.
    StagesBehindCover,
    /// `9`: the emergency stop input of `IN`.
    EmergencyInput,
    /// `H`.
    Cover(Opened),
    /// `2`: an axis has run onto a limit switch before, and that error is kept.
    Latched(AxisSet),
    /// `2`: an axis stands on a limit switch; and whether it would move off it.
    OnSwitch { axis: u8, end: End, away: bool },
    /// `2`: axes ran onto their limit switches with the same step, or one was pressed by hand. With
    /// the step counters at that moment.
    Switch { hit: [Option<(End, i64)>; AXES], by_hand: bool },
    /// `2`: an axis met the wrong switch in its reference run, or on its way off another.
    WrongSwitch { axis: u8, end: Option<End>, referencing: bool },
    /// `2`: a reference run was aborted.
    ReferenceBroken(Breaker),
    /// `2` or `R`: an absolute move of axes without reference point.
    NoReference(AxisSet, Unreferenced),
    /// `R`: these axes have left their limit switches by `F`.
    Freed(AxisSet),
    /// `G`: there is a program already.
    ProgramStored,
    /// `G`: there is nothing to go on with, and no program to run.
    NothingToStart,
    /// `G`: a program jumps to a line that does not exist.
    Jump {
        /// The line, from 0.
        to: i64,
        /// What would have been right with the other base of conditional branches.
        other_base: bool,
    },
    /// `G`: loops are nested too deep.
    LoopDepth,
    /// `6`: the program would take this many bytes with this line.
    MemoryFull(u32),
    /// `F`.
    Stopped(By),
}

/// What stops a motion so that it can be continued.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum By {
    /// The byte 253 from the line.
    Line,
    /// The STOP button, when it was pressed.
    Button,
    /// The STOP button, because it is held.
    ButtonHeld,
}

/// What aborts a motion, a reference run or a program, leaving nothing to continue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Breaker {
    /// The byte 255 from the line.
    Line,
    /// The abort input of `IA`.
    Input,
    /// What stops other motions for a while, and this one for good.
    Stop(By),
}

/// The role of the cover.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Opened {
    /// It is open.
    Already,
    /// It was opened.
    Now,
    /// The key was turned while it was open.
    Key,
    /// The cover input of `IH`.
    Input,
}

/// Why the motors have no current.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Off {
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The supply is bad.
    Supply,
    /// The stages are too hot.
    Heat,
    /// The safety relay is open.
    Relay,
    /// They are switched off.
    Switched,
}

/// [`Opened::Already`] in words.
pub(crate) const COVER_OPEN: &str = "the cover is open with the key on automatic";

impl Why {
    /// What is answered.
    pub(crate) fn reply(self) -> Reply {
        match self {
            Why::Line(fault) => fault.reply(),
            Why::TooLong | Why::NoDiagnosis(_) => Reply::Syntax,
            Why::NoAxes => Reply::NoAxes,
            Why::Plane(_) | Why::NoPlane => Reply::Axis,
            Why::AtRest => Reply::Speed,
            Why::Stages(_) | Why::Spindle | Why::StagesBehindCover | Why::EmergencyInput => {
                Reply::Plant
            }
            Why::Cover(_) => Reply::Cover,
            Why::Latched(_)
            | Why::OnSwitch { .. }
            | Why::Switch { .. }
            | Why::WrongSwitch { .. }
            | Why::ReferenceBroken(_)
            | Why::NoReference(_, Unreferenced::LimitSwitch) => Reply::LimitSwitch,
            Why::NoReference(_, Unreferenced::R) | Why::Freed(_) => Reply::Reference,
            Why::ProgramStored | Why::NothingToStart | Why::Jump { .. } | Why::LoopDepth => {
                Reply::DataField
            }
            Why::MemoryFull(_) => Reply::MemoryFull,
            Why::Stopped(_) => Reply::Stopped,
        }
    }
}

impl Off {
    /// This text.
    pub(crate) fn in_words(self) -> &'static str {
        match self {
            Off::EmergencyStop => "the emergency stop is pressed",
            Off::Supply => "the motor supply is off",
            Off::Heat => "the power stages are too hot",
            Off::Relay => "the stages are off since an emergency stop: press ON",
            Off::Switched => "the stages are off: press ON",
        }
    }
}

impl From<Fault> for Why {
    fn from(fault: Fault) -> Why {
        Why::Line(fault)
    }
}
