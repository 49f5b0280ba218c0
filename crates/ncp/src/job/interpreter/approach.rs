//! The way to where a job is resumed in the middle.

use vimc4_isel_wire::{AxisSet, Plane};
use vimc4_plant::Up;

use super::sink::Sink;
use super::state::{Interpreter, Pace};
use crate::geometry::{Steps, StraightParameters};
use crate::job::action::Action;
use crate::job::place::Place;
use crate::job::target::a_apart;
use crate::language::{Span, Value};

/// The axis that is lifted first and lowered last.
const Z: usize = 2;

/// The settings at a line of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// Where the tool is, in machine coordinates.
    pub place: [Value; 4],
    /// The counters there.
    pub counters: Steps,
    /// The work-piece zero.
    pub zero: [Value; 4],
    /// The plane of arcs.
    pub plane: Plane,
    /// The normal speed.
    pub normal: Value,
    /// The rapid speed.
    pub rapid: Value,
}

/// The legs of the way: up, across, and down.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::job) struct Approach {
    pub(in crate::job) up: Vec<Action>,
    pub(in crate::job) down: Vec<Action>,
}

impl Interpreter<'_> {
    /// Whether something has moved, or been referenced.
    pub(in crate::job) fn has_begun(&self) -> bool {
        self.state.begun
    }

    /// What comes before the first movement by default.
    pub(in crate::job) fn beginning(&mut self) -> Vec<Action> {
        let mut actions = Vec::new();
        let report: &mut dyn FnMut(_, _) = &mut |_, _| {};
        self.begin(&mut Sink { span: Span::default(), actions: &mut actions, report });
        actions
    }

    /// What holds.
    pub(in crate::job) fn standing(&self) -> Standing {
        let state = &self.state;
        let place = state.cylinder.map_or(state.place, |cylinder| cylinder.unrolled(&state.place));
        Standing {
            place,
            counters: state.counters,
            zero: state.zero,
            plane: state.plane,
            normal: state.normal,
            rapid: state.rapid,
        }
    }

    /// Which of two counters of Z is further away from the work-piece.
    pub(in crate::job) fn higher(&self, one: i64, other: i64) -> i64 {
        match self.target.setup.up {
            Up::Positive => one.max(other),
            Up::Negative => one.min(other),
        }
    }

    /// The reference runs that a job has made up to here.
    pub(in crate::job) fn runs(&self) -> (AxisSet, Action) {
        let axes = self.state.referenced;
        (axes, Action::Reference(a_apart(axes).collect()))
    }

    /// The way from these counters to where the tool is: Z goes to its highest first, the others
    /// across, both at the rapid speed; then Z down at the normal speed.
    pub(in crate::job) fn approach(&mut self, here: Steps, highest: i64) -> Approach {
        let end = self.standing();
        let before = self.state.clone();
        self.state.cylinder = None;
        self.state.place = self.place_at(&here);
        self.state.counters = here;
        let mut way = Approach::default();
        let mut above = here;
        above[Z] = highest;
        let mut across = end.counters;
        across[Z] = highest;
        let legs = [
            (above, self.place_at(&above), Pace::Rapid),
            (across, self.place_at(&across), Pace::Rapid),
            (end.counters, end.place, Pace::Normal),
        ];
        for (counters, place, pace) in legs {
            let leg = self.leg(&place, &counters, pace);
            let part = if pace == Pace::Rapid { &mut way.up } else { &mut way.down };
            part.extend(leg.map(Action::Straight));
        }
        self.state = before;
        way
    }

    /// A straight way to a place, if it is one.
    fn leg(&mut self, to: &Place, counters: &Steps, pace: Pace) -> Option<StraightParameters> {
        let mut actions = Vec::new();
        // Remarks about speeds come where the job asks for them.
        let report: &mut dyn FnMut(_, _) = &mut |_, _| {};
        let mut sink = Sink { span: Span::default(), actions: &mut actions, report };
        let parameters = self.parameters(to, counters, pace, &mut sink);
        (self.state.place, self.state.counters) = (*to, *counters);
        (parameters.by != Steps::default()).then_some(parameters)
    }

    /// The place of counters, to a thousandth.
    fn place_at(&self, counters: &Steps) -> Place {
        std::array::from_fn(|axis| {
            let exact = counters[axis] as f64 * self.target.scales[axis].step();
            Value::thousandths(libm::round(exact) as i64)
        })
    }
}
