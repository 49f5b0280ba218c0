//! The actions of a job, one after the other, before they are cut into commands.

use vimc4_isel_wire::AxisSet;

use super::drill::{Leg, Legs};
use crate::geometry::{CurveParameters, Scale, StraightParameters};
use crate::language::Value;

/// One thing that a line asks for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    /// Reference runs of these groups of axes, one after the other; then 3D interpolation again.
    Reference(Vec<AxisSet>),
    /// A straight movement.
    Straight(StraightParameters),
    /// An arc or a helix.
    Curve(Box<CurveParameters>),
    /// A hole.
    Drill(Box<Hole>),
    /// A pause of this many µs.
    Dwell(u64),
    /// An output changes.
    Output(OutputChange),
    /// A wait until an input has a level.
    Await(InputTest),
    /// A wait until the operator continues.
    Ask(Question),
    /// The ramps of what follows, in Hz/ms.
    Acceleration(u32),
}

/// A change of an output port of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OutputChange {
    /// The port.
    pub port: u16,
    /// The bit, 0 to 7; the whole port if there is none.
    pub bit: Option<u8>,
    /// 0 or 1 for a bit, otherwise 0 to 255.
    pub value: u8,
}

/// What is waited for at an input port of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct InputTest {
    /// The port.
    pub port: u16,
    /// The bit, 0 to 7; the whole port if there is none.
    pub bit: Option<u8>,
    /// 0 or 1 for a bit, otherwise 0 to 255.
    pub value: u8,
}

impl InputTest {
    /// Whether this is what the port must read.
    #[must_use]
    pub fn is_met_by(&self, read: u8) -> bool {
        match self.bit {
            Some(bit) => read >> bit & 1 == self.value,
            None => read == self.value,
        }
    }
}

/// What the operator is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Question {
    /// To continue: HALT.
    Halt,
    /// To put in the tool with this number: GETTOOL.
    Tool(u32),
    /// To find the work-piece zero: WPTEACH.
    Teach,
}

/// A hole to be drilled: its legs, and what they mean in steps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hole {
    /// The way.
    pub(super) legs: Legs,
    /// To where the hole is.
    pub(super) across: StraightParameters,
    /// Where the counter of Z is.
    pub(super) z: i64,
    /// The place of the reference plane.
    pub(super) plane: Value,
    /// 1 if greater coordinates of Z are up, otherwise −1.
    pub(super) up: i64,
    /// The scale of Z.
    pub(super) scale: Scale,
    /// How fast Z goes down the hole, and elsewhere, in Hz.
    pub(super) feed: u32,
    pub(super) rapid: u32,
}

/// What drilling a hole asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stroke {
    Straight(StraightParameters),
    Dwell(u64),
}

impl Hole {
    /// The next stroke; `None` when the drill is out of the hole.
    pub(super) fn next(&mut self) -> Option<Stroke> {
        let (height, speed, is_rapid) = match self.legs.next()? {
            Leg::Across => return Some(Stroke::Straight(self.across)),
            Leg::Dwell(time) => return Some(Stroke::Dwell(micros(time))),
            Leg::Rapid(height) => (height, self.rapid, true),
            Leg::Feed(height) => (height, self.feed, false),
        };
        let way = self.move_to(height);
        let by = [0, 0, way, 0];
        let a_speed = speed;
        Some(Stroke::Straight(StraightParameters { by, speed, a_speed, is_rapid, apart: 1 }))
    }

    /// The steps to a height above the reference plane; counts them as made.
    fn move_to(&mut self, height: Value) -> i64 {
        let place = place_at(self.plane, self.up, height);
        let z = self.scale.round(place);
        let way = z - self.z;
        self.z = z;
        way
    }
}

/// The place of Z at a height above the reference plane.
pub(super) fn place_at(plane: Value, up: i64, height: Value) -> Value {
    Value::thousandths(plane.in_thousandths().saturating_add(up * height.in_thousandths()))
}

/// A time in µs, which is how files give ms in thousandths.
pub(super) fn micros(time: Value) -> u64 {
    u64::try_from(time.in_thousandths()).unwrap_or(0)
}
