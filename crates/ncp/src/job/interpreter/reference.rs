//! Reference runs, and axes that were not referenced.

use vimc4_isel_wire::AxisSet;

use super::sink::Sink;
use super::state::{Interpreter, Refusal, without};
use crate::job::action::Action;
use crate::job::place::Place;
use crate::job::problem::Problem;
use crate::job::target::a_apart;
use crate::language::{Groups, Value};

impl Interpreter<'_> {
    /// All axes are referenced before the first movement.
    pub(super) fn begin(&mut self, sink: &mut Sink<'_>) {
        if self.state.begun {
            return;
        }
        self.state.begun = true;
        // Where the present point is the reference point, the axes stand at it too.
        self.at_reference(self.target.referable);
        if self.options.no_reference {
            self.state.assumed = self.target.referable;
        } else {
            sink.say(Problem::ReferenceFirst);
            // The controller itself takes Z, Y, X in this order.
            sink.push(Action::Reference(a_apart(self.target.referable).collect()));
        }
    }

    pub(super) fn reference(
        &mut self,
        groups: &Groups,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let mut runs = Vec::new();
        for group in groups.iter().filter(|group| **group != 0) {
            if let Some(axis) =
                (0..6).find(|&axis| group >> axis & 1 != 0 && !self.target.axes.has(axis))
            {
                return Err((sink.span, Problem::NoSuchAxis(axis)));
            }
            let axes = AxisSet::from_bits(*group).unwrap_or(AxisSet::NONE);
            for axis in axes.iter().filter(|&axis| !self.target.referable.has(axis)) {
                sink.say(Problem::NoReferenceSwitch(axis));
            }
            runs.extend(a_apart(axes));
        }
        let axes = runs.iter().fold(AxisSet::NONE, |all, axes| all.union(*axes));
        let state = &mut self.state;
        state.begun = true;
        state.assumed = without(state.assumed, axes);
        let sure = without(state.zero_unsure, axes);
        let moved = without(state.zero_unsure, sure);
        if !moved.is_empty() {
            sink.say(Problem::ZeroBeforeReference { axes: moved, line: state.zero_line });
        }
        state.zero_unsure = sure;
        runs.iter().for_each(|axes| self.at_reference(*axes));
        sink.push(Action::Reference(runs));
        Ok(())
    }

    /// Axes stand at their reference points. The work-piece zero stays where it is.
    pub(super) fn at_reference(&mut self, axes: AxisSet) {
        let state = &mut self.state;
        state.referenced = state.referenced.union(axes);
        for axis in axes.iter() {
            if let Some(cylinder) = &mut state.cylinder {
                // A cylinder begins anew where its turning axis does.
                if cylinder.turning == axis {
                    state.place[cylinder.linear] = cylinder.from;
                }
                if cylinder.linear == axis {
                    let surface =
                        state.place[axis].in_thousandths() - cylinder.from.in_thousandths();
                    cylinder.from = Value::ZERO;
                    state.place[axis] = Value::thousandths(surface);
                    state.counters[axis] = 0;
                    continue;
                }
            }
            state.place[axis] = Value::ZERO;
            state.counters[axis] = 0;
        }
    }

    /// Reports once for an axis that others were referenced and it was not.
    pub(super) fn warn_of_unreferenced(&mut self, to: &Place, sink: &mut Sink<'_>) {
        let state = &mut self.state;
        if state.referenced.is_empty() {
            return;
        }
        for axis in self.target.referable.iter() {
            let told = state.referenced.has(axis) || state.told_unreferenced[axis];
            if !told && to[axis] != state.place[axis] {
                state.told_unreferenced[axis] = true;
                sink.say(Problem::NotReferenced(axis));
            }
        }
    }
}
