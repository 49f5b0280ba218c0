//! Why a status is sent.
//!
//! The controller decides with typed reasons, which cost nothing; `words` puts them into words for
//! people.

use serde::{Deserialize, Serialize};
use vimc4_device::StopCause;

use crate::language::{Axis, Dialect, Misfit, Side, Status};

/// Why nothing is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Stop {
    /// `!ST`: commands keep waiting.
    Command,
    /// The external stop.
    External,
    /// A limit switch.
    Limit(Axis, Side),
    /// Something at the power stages.
    Fault(Status),
    /// The border of the window or of a range.
    SoftFrame,
    /// A message interrupt.
    Message,
}

/// Why a command fails, or a status is sent that no command asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Why {
    /// The bytes are not a command, or not one for any machine.
    Text(Status),
    /// A command has more bytes than any.
    TooLong,
    /// The machine does not have the axis, or the axis does not allow the value.
    Misfit(Misfit),
    /// This many bytes did not fit into the command buffer.
    BufferFull(usize),
    /// Commands are refused since something has stopped the controller.
    After(Stop),
    /// Commands are refused while the trackball is open.
    InterfaceOpen,
    /// Positions at a trigger are asked for, and there was none.
    NoTrigger,
    /// The machine has no reference switch for this axis.
    NoReference(Axis),
    /// There is no such port to read, or to write.
    NoPort { port: u8, write: bool },
    /// There is no trackball.
    NoTrackball,
    /// An arc or a vector leads beyond the counters.
    TooFar,
    /// The changes of speed of a following vector, counted from 1, lead to this speed, µm/s.
    VectorSpeed { vector: u32, speed: i64 },
    /// The last following vectors begin and end at a standstill.
    VectorsStandStill,
    /// An axis ran onto a limit switch, or one was pressed by hand.
    Limit { axis: Axis, side: Side, at: i64, by_hand: bool },
    /// An axis reached the end of its range, of the window or of its counter.
    Border(Axis, Side),
    /// The external stop was pressed.
    ExternalStop,
    /// A message interrupt came.
    Message(u8),
    /// A fault was set from outside.
    Fault(Status),
}

impl Why {
    /// What stops a command, if this does.
    pub(crate) fn cause(self) -> StopCause {
        match self {
            Why::ExternalStop => StopCause::StopButton,
            Why::Message(_) => StopCause::Message,
            Why::Limit { by_hand: true, .. } => StopCause::LimitByHand,
            Why::Limit { .. } => StopCause::LimitSwitch,
            Why::Border(..) => StopCause::Border,
            _ => StopCause::Failure,
        }
    }

    /// The status that it has on a model with this command set.
    pub(crate) fn status(self, dialect: Dialect) -> Status {
        let is_smcu = dialect == Dialect::Smcu;
        match self {
            Why::Text(status) | Why::Fault(status) => status,
            Why::TooLong => Status::ReceiverOverflow,
            Why::BufferFull(_) if is_smcu => Status::ReceiverOverflow,
            Why::BufferFull(_) => Status::CommandBufferFull,
            Why::Misfit(misfit) => misfit.status(),
            Why::After(Stop::External | Stop::Command) => Status::WrongAfterStop,
            Why::After(Stop::Limit(..) | Stop::Fault(_)) => Status::WrongAfterLimit,
            Why::After(Stop::SoftFrame) => Status::WrongAfterSoftFrame,
            Why::After(Stop::Message) => Status::WrongAfterMessage,
            Why::InterfaceOpen => Status::WrongAfterOpenInterface,
            Why::NoTrigger => Status::NoCounterAxis,
            Why::NoReference(_) => Status::ReferenceNotAllowed,
            Why::NoPort { .. } => Status::NoSuchIoModule,
            Why::NoTrackball => Status::NoSuchInterface,
            Why::TooFar => Status::WorkAreaLeft,
            Why::VectorSpeed { speed, .. } if speed > 0 => Status::SpeedTooHigh,
            Why::VectorSpeed { .. } | Why::VectorsStandStill => Status::SpeedTooLow,
            Why::Limit { .. } if is_smcu => Status::LimitSwitch,
            Why::Limit { axis, side, .. } => Status::limit_switch(axis, side),
            Why::Border(..) if is_smcu => Status::WorkAreaLeft,
            Why::Border(axis, side) => Status::range_left(axis, side),
            Why::ExternalStop => Status::FastStop,
            Why::Message(0) => Status::MessageInterrupt0,
            Why::Message(_) => Status::MessageInterrupt1,
        }
    }
}
