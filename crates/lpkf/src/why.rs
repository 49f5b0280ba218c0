//! Why a status is sent.
//!
//! The controller decides with typed reasons, which cost nothing; they become words only where
//! somebody watches. The words say which axis, switch, value or signal it was, and name in brackets
//! the value of the profile with which it would have been otherwise.

use serde::{Deserialize, Serialize};
use vimc4_device::Grouped;
use vimc4_plant::End;

use crate::Controller;
use crate::language::{
    Axis, AxisKind, COMMAND_MAX, Kind, Misfit, Side, Status, Value, why_refused,
};
use crate::model::{AfterStatus, CommandSet, ResolutionUnit};
use crate::state::Stop;

/// Why a command fails, or a status is sent that no command asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Why {
    /// The bytes are no command, or not one that could be for any machine.
    Text(Status),
    /// A command has more bytes than any.
    TooLong,
    /// The machine does not have the axis, or the axis does not allow the value.
    Misfit(Misfit),
    /// So many bytes found no room in the command buffer.
    BufferFull(usize),
    /// Commands are refused since something has stopped the controller.
    After(Stop),
    /// Commands are refused while the trackball is open.
    InterfaceOpen,
    /// Positions of an axis are asked for that this model does not have.
    NoPosition(Axis),
    /// Positions at a trigger are asked for, and there was none.
    NoTrigger,
    /// The machine has nothing to look for the reference point of this axis with.
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
    /// An axis ran onto a limit switch, or somebody pressed one.
    Limit { axis: Axis, end: End, at: i64, by_hand: bool },
    /// An axis came to the end of its range, of the window or of its counter.
    Border(Axis, End),
    /// The external stop was pressed.
    ExternalStop,
    /// A message interrupt came.
    Message(u8),
    /// A fault was set from outside.
    Fault(Status),
}

impl Controller {
    /// The status that a reason has on this model.
    pub(crate) fn status_of(&self, why: Why) -> Status {
        let is_smcu = self.state.model.command_set == CommandSet::Smcu;
        match why {
            Why::Text(status) | Why::Fault(status) => status,
            Why::TooLong => Status::ReceiverOverflow,
            Why::BufferFull(_) if is_smcu => Status::ReceiverOverflow,
            Why::BufferFull(_) => Status::CommandBufferFull,
            Why::Misfit(misfit) => misfit.status(),
            Why::After(Stop::External | Stop::Command) => Status::WrongAfterStop,
            Why::After(Stop::Limit) => Status::WrongAfterLimit,
            Why::After(Stop::SoftFrame) => Status::WrongAfterSoftFrame,
            Why::After(Stop::Message) => Status::WrongAfterMessage,
            Why::InterfaceOpen => Status::WrongAfterOpenInterface,
            Why::NoPosition(_) => Status::NoSuchAxis,
            Why::NoTrigger => Status::NoCounterAxis,
            Why::NoReference(_) => Status::ReferenceNotAllowed,
            Why::NoPort { .. } => Status::NoSuchIoModule,
            Why::NoTrackball => Status::NoSuchInterface,
            Why::TooFar => Status::WorkAreaLeft,
            Why::VectorSpeed { speed, .. } if speed > 0 => Status::SpeedTooHigh,
            Why::VectorSpeed { .. } | Why::VectorsStandStill => Status::SpeedTooLow,
            Why::Limit { .. } if is_smcu => Status::LimitSwitch,
            Why::Limit { axis, end, .. } => Status::limit_switch(axis, self.side(axis, end)),
            Why::Border(..) if is_smcu => Status::WorkAreaLeft,
            Why::Border(axis, End::Negative) => Status::range_left(axis, Side::Negative),
            Why::Border(axis, End::Positive) => Status::range_left(axis, Side::Positive),
            Why::ExternalStop => Status::FastStop,
            Why::Message(0) => Status::MessageInterrupt0,
            Why::Message(_) => Status::MessageInterrupt1,
        }
    }

    /// A reason in words, and what the controller waits for now: a lower-case fragment. `raw` are
    /// the bytes of the command that is refused, if it is one.
    pub(crate) fn in_words(&self, why: Why, raw: &[u8]) -> String {
        format!("{}{}", self.reason(why, raw), self.waits_for())
    }

    fn reason(&self, why: Why, raw: &[u8]) -> String {
        let model = &self.state.model;
        match why {
            Why::Text(status) => why_refused(raw, model.grammar(), status),
            Why::TooLong => {
                format!("a command of more than {} characters", Grouped(COMMAND_MAX as i64))
            }
            Why::Misfit(misfit) => self.misfit_in_words(misfit),
            Why::BufferFull(size) => format!(
                "no room for {size} characters more in the command buffer of {} (buffer.bytes)",
                Grouped(model.buffer.bytes as i64)
            ),
            Why::After(stop) => match stop {
                Stop::Command => "refused since !ST",
                Stop::External => "refused since the external stop",
                Stop::Limit => "refused since a limit switch or a fault",
                Stop::SoftFrame => "refused since the end of a range or of the window",
                Stop::Message => "refused since a message interrupt",
            }
            .to_owned(),
            Why::InterfaceOpen => "refused while the trackball is open".to_owned(),
            Why::NoPosition(axis) => {
                format!("this model has no positions of {}", self.axis_name(axis))
            }
            Why::NoTrigger => "no trigger has taken positions since power-on or IN".to_owned(),
            Why::NoReference(axis) => {
                format!("the machine has no reference switch of {}", self.axis_name(axis))
            }
            Why::NoPort { port, write: true } => format!("no port {port} to write (io.write)"),
            Why::NoPort { port, write: false } => format!("no port {port} to read (io.read)"),
            Why::NoTrackball => "no trackball is connected (interface.trackball)".to_owned(),
            Why::TooFar => "a curve leads beyond the counters, which have 32 bits".to_owned(),
            Why::VectorSpeed { vector, speed } => {
                let most = Grouped(model.limits.speed_max.into());
                format!(
                    "vector {vector} ends at {} µm/s: 0 to {most} µm/s are right",
                    Grouped(speed)
                )
            }
            Why::VectorsStandStill => "a vector begins and ends at a standstill".to_owned(),
            Why::Limit { axis, end, at, by_hand } => {
                let pressed = if by_hand { " pressed" } else { "" };
                let sign = if self.side(axis, end) == Side::Negative { '-' } else { '+' };
                let (name, at) = (self.axis_name(axis), Grouped(at));
                format!("limit switch {name}{sign}{pressed} at step {at}")
            }
            Why::Border(axis, end) => self.border_in_words(axis, end),
            Why::ExternalStop => "stopped by STOP, the external stop".to_owned(),
            Why::Message(number) => format!("stopped by message interrupt {number}"),
            Why::Fault(status) => format!("fault {} is set: {}", status.name(), status.meaning()),
        }
    }

    fn misfit_in_words(&self, misfit: Misfit) -> String {
        let (Value { axis, of, kind, value, limit }, compared) = match misfit {
            Misfit::NotFitted(axis) => {
                return format!("this machine has no {} axis", self.axis_name(axis));
            }
            Misfit::TooLow(value) => (value, "at least"),
            Misfit::TooHigh(value) => (value, "at most"),
        };
        let model = &self.state.model;
        let in_micrometres = model.language.resolution_unit == ResolutionUnit::Micrometres;
        let (what, unit, profile) = match (kind, of, misfit) {
            (Kind::Resolution, AxisKind::Translation, _) if in_micrometres => {
                ("resolution", "µm", "")
            }
            (Kind::Resolution, ..) => ("resolution", kind.unit(of), ""),
            (Kind::Acceleration, AxisKind::Translation, Misfit::TooHigh(_)) => {
                ("acceleration", kind.unit(of), " (acceleration_max)")
            }
            (Kind::Acceleration, ..) => ("acceleration", kind.unit(of), ""),
            (_, AxisKind::Translation, Misfit::TooHigh(_)) => {
                ("speed", kind.unit(of), " (speed_max)")
            }
            (_, AxisKind::Rotation, Misfit::TooHigh(_)) => ("speed", kind.unit(of), " (turn_max)"),
            (..) => ("speed", kind.unit(of), ""),
        };
        let (name, limit) = (self.axis_name(axis), Grouped(limit.into()));
        // A unit such as 0.1°/s is no word behind a number.
        let unit = match unit.starts_with(|first: char| first.is_ascii_digit()) {
            true => format!("({unit})"),
            false => unit.to_owned(),
        };
        format!("{what} {value} {unit}: {name} takes {compared} {limit}{profile}")
    }

    fn border_in_words(&self, axis: Axis, end: End) -> String {
        let settings = &self.state.settings;
        let (index, name) = (axis.index(), self.axis_name(axis));
        let here = self.state.position[index];
        let window = settings.window.filter(|_| index < 2);
        let is_end = |low: i64, high: i64| match end {
            End::Negative => here <= low,
            End::Positive => here >= high,
        };
        let border = match (window, settings.ranges[index]) {
            _ if is_end(i32::MIN.into(), i32::MAX.into()) => {
                return format!("{name} came to the end of its counter, {}", Grouped(here));
            }
            (Some([low, high]), _) if is_end(low[index], high[index]) => {
                ("the window", low[index], high[index])
            }
            (_, Some((low, high))) => ("its range", low, high),
            (Some([low, high]), None) => ("the window", low[index], high[index]),
            (None, None) => ("its counter", i32::MIN.into(), i32::MAX.into()),
        };
        let (what, low, high) = (border.0, Grouped(border.1), Grouped(border.2));
        format!("{name} came to the end of {what}, {low} to {high}, at step {}", Grouped(here))
    }

    /// What a controller that executes nothing waits for, as the end of a sentence.
    fn waits_for(&self) -> &'static str {
        if self.state.ball.open.is_some() {
            return "; the trackball is open until !CI";
        }
        match (self.state.stopped, self.state.model.quirks.after_status) {
            (None, _) => "",
            (Some(Stop::Command), _) => "; commands wait for !GO",
            (Some(_), AfterStatus::Refuse) => "; commands are refused until !GO",
            (Some(_), _) => "; commands wait for !GO, IN begins anew",
        }
    }
}
