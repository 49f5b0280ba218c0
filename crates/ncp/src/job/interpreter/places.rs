//! Where the words of a line lead, and whether that is permitted.

use vimc4_isel_wire::AxisSet;
use vimc4_plant::Up;

use super::sink::Sink;
use super::state::{Interpreter, Refusal, sum, without};
use crate::geometry::{MOST_STEPS, Steps};
use crate::job::place::Place;
use crate::job::problem::Problem;
use crate::language::{Frame, Span, Value, Words};

impl Interpreter<'_> {
    /// The words of axes that the machine has, by axis.
    pub(super) fn named(&self, words: &Words) -> Result<[Option<Value>; 4], Refusal> {
        for (axis, word) in words.iter().enumerate() {
            if let Some(word) = word.filter(|_| !self.target.axes.has(axis)) {
                return Err((word.span, Problem::NoSuchAxis(axis)));
            }
        }
        Ok(std::array::from_fn(|axis| words[axis].map(|word| word.value)))
    }

    /// The place that words give; an axis without a word stays where it is.
    pub(super) fn place_of(&self, frame: Frame, words: &Words) -> Result<Place, Refusal> {
        let named = self.named(words)?;
        let turning = self.state.cylinder.map(|cylinder| cylinder.turning);
        if let Some((axis, word)) = turning.and_then(|axis| Some((axis, words[axis]?))) {
            return Err((word.span, Problem::Follows(axis)));
        }
        let from = match frame {
            Frame::Absolute => &self.state.zero,
            Frame::Relative => &self.state.place,
        };
        let mut place = self.state.place;
        for axis in 0..4 {
            if let Some(value) = named[axis] {
                place[axis] = sum(from[axis], value);
            }
        }
        Ok(place)
    }

    pub(super) fn zero_at(&mut self, named: &[Option<Value>; 4]) {
        let state = &mut self.state;
        for (zero, value) in state.zero.iter_mut().zip(named) {
            *zero = value.unwrap_or(*zero);
        }
        let known = (0..)
            .zip(named)
            .fold(0, |bits, (axis, value)| bits | u8::from(value.is_some()) << axis);
        let known = AxisSet::from_bits(known).unwrap_or(AxisSet::ALL);
        state.zero_unsure = without(state.zero_unsure, known);
    }

    /// Whether a place may be reached. An axis that stays where it is may always.
    pub(super) fn check(&self, place: &Place, counters: &Steps, span: Span) -> Result<(), Refusal> {
        let state = &self.state;
        let real = state.cylinder.map(|cylinder| (cylinder, cylinder.unrolled(place)));
        for axis in 0..4 {
            let at = match &real {
                // The surface of a cylinder has no ends.
                Some((cylinder, _)) if cylinder.linear == axis => continue,
                Some((_, real)) => real[axis],
                None => place[axis],
            };
            let counter = counters[axis];
            if counter == state.counters[axis] && at == state.place[axis] {
                continue;
            }
            if let Some((lowest, highest)) = state.limits[axis]
                && !(lowest..=highest).contains(&at)
            {
                return Err((span, Problem::BeyondLimit { axis, at, lowest, highest }));
            }
            if !(-MOST_STEPS - 1..=MOST_STEPS).contains(&counter) {
                return Err((span, Problem::BeyondCounter { axis, at: counter }));
            }
            if state.referenced.has(axis) {
                let (lowest, highest) = self.target.travel[axis];
                let beyond = lowest.filter(|lowest| counter < *lowest);
                let beyond = beyond.or(highest.filter(|highest| counter > *highest));
                if let Some(end) = beyond {
                    let end = Value::thousandths(libm::round(
                        end as f64 * self.target.scales[axis].step(),
                    ) as i64);
                    return Err((span, Problem::BeyondTravel { axis, at, end }));
                }
            }
        }
        Ok(())
    }

    /// The sign of what leads away from the work-piece.
    pub(super) fn up(&self) -> i64 {
        if self.target.setup.up == Up::Positive { 1 } else { -1 }
    }

    /// Reports, after a hole, that the tool moves across without having been lifted: once at the
    /// surface, and below it as long as the tool stays there, on level and slanting ways alike.
    /// From the surface a way upwards leaves the work-piece at once.
    pub(super) fn warn_of_surface(
        &mut self,
        from: &Place,
        to: &Place,
        round: bool,
        sink: &mut Sink<'_>,
    ) {
        const Z: usize = 2;
        let up = self.up();
        let state = &mut self.state;
        let Some(depth) = state.in_work else { return };
        let rise = up * to[Z].in_thousandths().saturating_sub(from[Z].in_thousandths());
        let left = Value::thousandths(depth.in_thousandths().saturating_sub(rise));
        let across = round || to[..Z] != from[..Z];
        if across && depth > Value::ZERO {
            sink.say(Problem::InsideWork(depth.max(left)));
        } else if across && rise <= 0 && !std::mem::replace(&mut state.told_of_holes.surface, true)
        {
            sink.say(Problem::AtSurface);
        }
        // A tool that goes down from the surface is meant to cut.
        let stays = depth > Value::ZERO && left >= Value::ZERO;
        state.in_work = (stays || !across && rise == 0).then_some(left);
    }
}
