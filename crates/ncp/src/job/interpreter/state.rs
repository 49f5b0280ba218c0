//! The state between two lines of a job.

use std::collections::BTreeMap;

use vimc4_isel_wire::{AxisSet, Plane};

use crate::geometry::Steps;
use crate::job::drill::Definition;
use crate::job::place::{Cylinder, Place, counters};
use crate::job::problem::{Accessories, Problem};
use crate::job::target::{Direction, Target};
use crate::job::zero::Zero;
use crate::language::{Rate, Span, Units, Value};

/// How a job is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Takes the present point as reference point, where a job begins without a reference run.
    pub no_reference: bool,
    /// The values of DRILLDEF but P are mm.
    pub drill_in_mm: bool,
    /// Changes of the tool are left out, with a warning for each.
    pub leave_out_tools: bool,
}

/// The state, and how a line changes it.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::job) struct Interpreter<'t> {
    pub(super) target: &'t Target,
    pub(super) options: Options,
    pub(super) state: State,
}

/// The state between two lines.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct State {
    pub(super) place: Place,
    pub(super) counters: Steps,
    pub(super) zero: Place,
    pub(super) registers: [Zero; 8],
    pub(super) normal: Value,
    pub(super) rapid: Value,
    /// The same where only turning axes move.
    pub(super) turning: [Value; 2],
    pub(super) units: Units,
    /// The line that is carried out.
    pub(super) line: u32,
    /// What is switched although nothing is connected to it, and where first.
    pub(super) unconnected: Accessories,
    pub(super) first_unconnected: Option<(u32, Span)>,
    /// The bits without a wire that have been reported, of each port of the controller.
    pub(super) told_of_wires: BTreeMap<(Direction, u16), u8>,
    /// What has been reported about the spindle.
    pub(super) told_of_spindle: [bool; 3],
    /// How far below the reference plane the last hole has left the tool, 0 at the plane itself, if
    /// it was not lifted above the work and has not been since.
    pub(super) in_work: Option<Value>,
    pub(super) told_of_holes: ToldOfHoles,
    /// The axes for which WPZERO or the operator has made an unreferenced place the zero, and in
    /// which line.
    pub(super) zero_unsure: AxisSet,
    pub(super) zero_line: u32,
    /// What has been reported about the normal, the rapid and the drilling speed since they were
    /// set.
    pub(super) told: [Told; 3],
    pub(super) plane: Plane,
    pub(super) limits: [Option<(Value, Value)>; 4],
    pub(super) cylinder: Option<Cylinder>,
    pub(super) drill: Definition,
    pub(super) mark: Mark,
    /// Whether something has moved, or been referenced.
    pub(super) begun: bool,
    pub(super) referenced: AxisSet,
    /// Axes that are assumed, without a reference run, to have stood at 0.
    pub(super) assumed: AxisSet,
    /// Axes that have been reported as not referenced.
    pub(super) told_unreferenced: [bool; 4],
    pub(super) ended: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Told {
    pub(super) raised: bool,
    pub(super) capped: bool,
}

/// What has been reported about the present definition of holes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ToldOfHoles {
    pub(super) surface: bool,
    pub(super) depth: bool,
    pub(super) steps: bool,
    pub(super) other_steps: bool,
    pub(super) lift: bool,
}

/// Where the file mark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// Not seen, nor any command.
    Awaited,
    /// Not seen, but commands.
    Missing,
    Seen,
}

/// Which speed a movement has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pace {
    Normal,
    Rapid,
    Drill,
}

impl From<Rate> for Pace {
    fn from(rate: Rate) -> Pace {
        match rate {
            Rate::Normal => Pace::Normal,
            Rate::Rapid => Pace::Rapid,
        }
    }
}

/// A reason not to carry a line out, and its place.
pub(super) type Refusal = (Span, Problem);

impl<'t> Interpreter<'t> {
    /// The state before the first line.
    pub(in crate::job) fn new(target: &'t Target, options: Options) -> Interpreter<'t> {
        let setup = &target.setup;
        let state = State {
            place: Place::default(),
            counters: Steps::default(),
            zero: target.zero.0.map(Option::unwrap_or_default),
            registers: target.registers,
            normal: Value::whole(setup.velocity.into()),
            rapid: Value::whole(setup.rapid_velocity.into()),
            turning: [setup.velocity, setup.rapid_velocity].map(|speed| Value::whole(speed.into())),
            units: Units::Metric,
            line: 0,
            unconnected: Accessories::default(),
            first_unconnected: None,
            told_of_wires: BTreeMap::new(),
            told_of_spindle: [false; 3],
            in_work: None,
            told_of_holes: ToldOfHoles::default(),
            zero_unsure: AxisSet::NONE,
            zero_line: 0,
            told: [Told::default(); 3],
            plane: Plane::Xy,
            limits: [None; 4],
            cylinder: None,
            drill: Definition::default(),
            mark: Mark::Awaited,
            begun: false,
            referenced: AxisSet::NONE,
            assumed: AxisSet::NONE,
            told_unreferenced: [false; 4],
            ended: false,
        };
        Interpreter { target, options, state }
    }

    /// The target that it runs on.
    pub(in crate::job) fn target(&self) -> &'t Target {
        self.target
    }

    /// Whether PROGEND was read.
    pub(in crate::job) fn has_ended(&self) -> bool {
        self.state.ended
    }

    /// Whether lines go to the same places as in another: the zero, what may become the zero, the plane
    /// and the cylinder are the same.
    pub(in crate::job) fn has_frame_of(&self, other: &Interpreter<'_>) -> bool {
        let frame = |state: &State| (state.zero, state.registers, state.plane, state.cylinder);
        frame(&self.state) == frame(&other.state)
    }

    /// The axes that are assumed to have stood at 0.
    pub(in crate::job) fn assumed(&self) -> AxisSet {
        self.state.assumed
    }

    /// Where the counters are.
    pub(in crate::job) fn counters(&self) -> Steps {
        self.state.counters
    }

    /// In which unit lengths are read.
    pub(in crate::job) fn units(&self) -> Units {
        self.state.units
    }

    /// Reads lengths in this unit from now on.
    pub(in crate::job) fn set_units(&mut self, units: Units) {
        self.state.units = units;
    }

    /// Whether there were lines but no PROGEND. Only the end of the file shows that.
    pub(in crate::job) fn lacks_end(&self) -> bool {
        self.state.mark != Mark::Awaited && !self.state.ended
    }

    /// Whether the file had no mark. Only the end of the file shows that.
    pub(in crate::job) fn lacks_mark(&self) -> bool {
        self.state.mark != Mark::Seen
    }

    /// What was switched although nothing is connected, and where first. Only the end of a job
    /// shows all of it.
    pub(in crate::job) fn unconnected(&self) -> Option<(u32, Span, Problem)> {
        let (line, span) = self.state.first_unconnected?;
        Some((line, span, Problem::NotConnected(self.state.unconnected)))
    }

    /// Makes the present place the work-piece zero, as the operator says at WPTEACH.
    pub(in crate::job) fn take_zero(&mut self) {
        let state = &mut self.state;
        state.zero = state.place;
        // Before the first movement the present place is the reference point, if the options allow
        // it.
        state.zero_unsure = match state.begun {
            true => without(self.target.referable, state.referenced),
            false => AxisSet::NONE,
        };
        state.zero_line = state.line;
    }

    /// The same at a place that was found before; on axes that it does not name, at the present one.
    pub(in crate::job) fn find_zero(&mut self, found: Zero) {
        let state = &mut self.state;
        for (axis, found) in state.place.iter_mut().zip(found.0) {
            *axis = found.unwrap_or(*axis);
        }
        state.counters = counters(&state.place, self.target, state.cylinder.as_ref());
        self.take_zero();
    }
}

/// One value and another.
pub(super) fn sum(a: Value, b: Value) -> Value {
    Value::thousandths(a.in_thousandths().saturating_add(b.in_thousandths()))
}

/// The axes of one set that are not in another.
pub(super) fn without(axes: AxisSet, others: AxisSet) -> AxisSet {
    AxisSet::from_bits(axes.bits() & !others.bits()).unwrap_or(AxisSet::NONE)
}
