//! Why a status is sent, for people.
//!
//! Reasons become words only when events are watched. They say which axis, switch, value or signal
//! it was, and name in brackets the profile value that would have avoided it.

use vimc4_device::Grouped;
use vimc4_plant::Unit;

use crate::language::{Axis, COMMAND_MAX, Kind, Misfit, Side, Value, why_refused};
use crate::model::{AfterStatus, ResolutionUnit};
use crate::state::State;
use crate::why::{Stop, Why};

impl State {
    /// A reason in words, and what the controller waits for now: a lower-case fragment. `raw` are
    /// the bytes of the command that is refused, if it is one.
    pub(crate) fn in_words(&self, why: Why, raw: &[u8]) -> String {
        format!("{}{}", self.reason(why, raw), self.waits_for())
    }

    fn reason(&self, why: Why, raw: &[u8]) -> String {
        let model = &self.model;
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
                Stop::Command => "refused since !ST".to_owned(),
                Stop::External => "refused since the external stop".to_owned(),
                Stop::Limit(axis, side) => {
                    format!("refused since limit switch {}", self.switch_in_words(axis, side))
                }
                Stop::Fault(status) => format!("refused since fault {}", status.name()),
                Stop::SoftFrame => "refused since the end of a range or of the window".to_owned(),
                Stop::Message => "refused since a message interrupt".to_owned(),
            },
            Why::InterfaceOpen => "refused while the trackball is open".to_owned(),
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
            Why::Limit { axis, side, at, by_hand } => {
                let pressed = if by_hand { " pressed" } else { "" };
                let (name, at) = (self.switch_in_words(axis, side), Grouped(at));
                format!("limit switch {name}{pressed} at step {at}")
            }
            Why::Border(axis, side) => self.border_in_words(axis, side),
            Why::ExternalStop => "stopped by STOP, the external stop".to_owned(),
            Why::Message(number) => format!("stopped by message interrupt {number}"),
            Why::Fault(status) => format!("fault {} is set: {}", status.name(), status.meaning()),
        }
    }

    fn switch_in_words(&self, axis: Axis, side: Side) -> String {
        format!("{}{}", self.axis_name(axis), if side == Side::Negative { '-' } else { '+' })
    }

    fn misfit_in_words(&self, misfit: Misfit) -> String {
        let (Value { axis, of, kind, value, limit }, compared) = match misfit {
            Misfit::NotFitted(axis) => {
                return format!("this machine has no {} axis", self.axis_name(axis));
            }
            Misfit::TooLow(value) => (value, "at least"),
            Misfit::TooHigh(value) => (value, "at most"),
        };
        let model = &self.model;
        let in_micrometres = model.language.resolution_unit == ResolutionUnit::Micrometres;
        let (what, unit, profile) = match (kind, of, misfit) {
            (Kind::Resolution, Unit::Linear, _) if in_micrometres => ("resolution", "µm", ""),
            (Kind::Resolution, ..) => ("resolution", kind.unit(of), ""),
            (Kind::Acceleration, Unit::Linear, Misfit::TooHigh(_)) => {
                ("acceleration", kind.unit(of), " (acceleration_max)")
            }
            (Kind::Acceleration, ..) => ("acceleration", kind.unit(of), ""),
            (_, Unit::Linear, Misfit::TooHigh(_)) => ("speed", kind.unit(of), " (speed_max)"),
            (_, Unit::Rotary, Misfit::TooHigh(_)) => ("speed", kind.unit(of), " (turn_max)"),
            (..) => ("speed", kind.unit(of), ""),
        };
        let (name, limit) = (self.axis_name(axis), Grouped(limit.into()));
        // A unit such as 0.1°/s cannot directly follow a number.
        let unit = match unit.starts_with(|first: char| first.is_ascii_digit()) {
            true => format!("({unit})"),
            false => unit.to_owned(),
        };
        format!("{what} {value} {unit}: {name} takes {compared} {limit}{profile}")
    }

    fn border_in_words(&self, axis: Axis, side: Side) -> String {
        let settings = &self.settings;
        let (index, name) = (axis.index(), self.axis_name(axis));
        let here = self.position[index];
        let window = settings.window.filter(|_| index < 2);
        let is_end = |low: i64, high: i64| match side {
            Side::Negative => here <= low,
            Side::Positive => here >= high,
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

    /// What an idle controller waits for, as the end of a sentence.
    fn waits_for(&self) -> &'static str {
        if self.ball.open.is_some() {
            return "; the trackball is open until !CI";
        }
        match (self.stopped, self.model.quirks.after_status) {
            (None, _) => "",
            (Some(Stop::Command), _) => "; commands wait for !GO",
            (Some(_), AfterStatus::Refuse) => "; commands are refused until !GO",
            (Some(_), _) => "; commands wait for !GO, IN begins anew",
        }
    }
}
