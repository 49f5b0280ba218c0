//! Holes.

use super::sink::Sink;
use super::state::{Interpreter, Pace, Refusal, Told};
use crate::job::action::{Action, Hole, place_at};
use crate::job::drill::{Cycle, Definition};
use crate::job::place::counters;
use crate::job::problem::Problem;
use crate::language::{DrillWords, Frame, Span, Value, Word, Words};

impl Interpreter<'_> {
    pub(super) fn drill_definition(
        &mut self,
        words: &DrillWords,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let factor = if self.options.drill_in_mm { 1_000 } else { 1 };
        let length = |word: Option<Word>, old: Value| {
            let value = word.map(|word| word.value.in_thousandths().saturating_mul(factor));
            value.map_or(old, Value::thousandths)
        };
        let old = self.state.drill;
        let cycle = match words.cycle.map(|word| word.value.in_thousandths()) {
            None => old.cycle,
            Some(2_000) => Cycle::Peck,
            Some(3_000) => Cycle::ChipBreak,
            // The reader lets nothing else through.
            Some(_) => Cycle::Simple,
        };
        if words.speed.is_some() {
            self.state.told[Pace::Drill as usize] = Told::default();
        }
        if let Some(word) = words.depth.filter(|_| factor == 1)
            && (Value::whole(1)..=Value::whole(99)).contains(&word.value)
        {
            sink.say_at(word.span, Problem::MillimetresMeant(word.value));
        }
        let told = &mut self.state.told_of_holes;
        told.surface &= words.safety.or(words.plane).is_none();
        told.depth &= words.depth.is_none();
        told.steps &= words.cycle.or(words.first).or(words.other).is_none();
        told.other_steps &= words.cycle.or(words.first).or(words.other).is_none();
        told.lift &= words.lift.or(words.depth).is_none();
        self.state.drill = Definition {
            cycle,
            plane: words.plane.map_or(old.plane, |word| word.value),
            depth: length(words.depth, old.depth),
            dwell: words.dwell.map_or(old.dwell, |word| word.value),
            speed: words.speed.map_or(old.speed, |word| word.value),
            first: length(words.first, old.first),
            other: length(words.other, old.other),
            decrease: length(words.decrease, old.decrease),
            retreat: length(words.retreat, old.retreat),
            lift: length(words.lift, old.lift),
            safety: length(words.safety, old.safety),
        };
        // A mistake that no other line can mend is reported where it stands, even without a hole.
        let definition = self.state.drill;
        if let Some(word) = words.depth.filter(|_| definition.depth < Value::ZERO) {
            self.state.told_of_holes.depth = true;
            sink.say_at(word.span, Problem::NoDepth);
        }
        for (name, word) in [('F', words.first), ('O', words.other), ('R', words.retreat)] {
            if let Some(word) = word.filter(|word| word.value < Value::ZERO) {
                // The steps do not matter then.
                self.state.told_of_holes.steps |= name != 'R';
                return Err((word.span, Problem::NegativeLength(name, word.value)));
            }
        }
        let knows_bottom = words.depth.is_some() || definition.lift < Value::ZERO;
        match words.lift.filter(|_| knows_bottom) {
            Some(word) => self.judge_lift(word.span),
            None => Ok(()),
        }
    }

    /// Refuses, once, a lift that does not lift.
    fn judge_lift(&mut self, span: Span) -> Result<(), Refusal> {
        let definition = self.state.drill;
        let told = &mut self.state.told_of_holes.lift;
        match definition.lifts_into_work() && !std::mem::replace(told, true) {
            true => Err((span, Problem::LiftBelowPlane(definition.lift))),
            false => Ok(()),
        }
    }

    pub(super) fn drill(&mut self, words: &Words, sink: &mut Sink<'_>) -> Result<(), Refusal> {
        const Z: usize = 2;
        let definition = self.state.drill;
        if !self.target.axes.has(Z) {
            return Err((sink.span, Problem::NoSuchAxis(Z)));
        }
        if self.state.cylinder.is_some_and(|cylinder| cylinder.linear == Z) {
            return Err((sink.span, Problem::OnCylinder(Z)));
        }
        let mut to = self.place_of(Frame::Absolute, words)?;
        self.begin(sink);
        let told = &mut self.state.told_of_holes;
        for (problem, applies, told) in [
            (Problem::NoDepth, definition.depth <= Value::ZERO, &mut told.depth),
            (Problem::NoDrillSteps, definition.lacks_steps(), &mut told.steps),
            (Problem::NoOtherSteps, definition.lacks_other_steps(), &mut told.other_steps),
        ] {
            if applies && !std::mem::replace(told, true) {
                sink.say(problem);
            }
        }
        let up = self.up();
        let plane = place_at(self.state.zero[Z], up, definition.plane);
        // It goes across at the higher of S and where it is.
        let here = self.state.place[Z].in_thousandths().saturating_sub(plane.in_thousandths());
        let height = Value::thousandths(up * here);
        // All of the cycle is checked before anything of it is done.
        let (low, high) = definition.extent();
        let mut checked = self.judge_lift(sink.span);
        for height in [low, high] {
            to[Z] = place_at(plane, up, height);
            let counters = counters(&to, self.target, self.state.cylinder.as_ref());
            checked = checked.and_then(|()| self.check(&to, &counters, sink.span));
        }
        let over = height.max(definition.safety);
        to[Z] = place_at(plane, up, over);
        let from = self.state.place;
        let mut above = from;
        above[Z] = to[Z];
        self.warn_of_surface(&from, &above, false, sink);
        if over < Value::ZERO && to[..Z] != above[..Z] {
            sink.say(Problem::InsideWork(Value::thousandths(-over.in_thousandths())));
        } else {
            self.warn_of_surface(&above, &to, false, sink);
        }
        to[Z] = place_at(plane, up, definition.safety);
        let z = self.state.counters[Z];
        self.warn_of_unreferenced(&to, sink);
        let end = counters(&to, self.target, self.state.cylinder.as_ref());
        let mut over = end;
        over[Z] = z;
        let mut over_place = to;
        over_place[Z] = self.state.place[Z];
        let across = self.parameters(&over_place, &over, Pace::Rapid, sink);
        let scale = self.target.scales[Z];
        let frequency = |velocity: Value| velocity.in_thousandths() as f64 / scale.step();
        let hole = Hole {
            legs: definition.legs(Value::thousandths(libm::ceil(scale.step()) as i64), height),
            across,
            z,
            plane,
            up,
            scale,
            feed: self.fit(frequency(definition.speed), Pace::Drill, sink),
            rapid: self.fit(frequency(self.state.rapid), Pace::Rapid, sink),
        };
        (self.state.place, self.state.counters) = (to, end);
        let inside = -definition.safety.in_thousandths();
        let in_work = inside >= 0 && definition.depth > Value::ZERO;
        self.state.in_work = in_work.then(|| Value::thousandths(inside));
        checked?;
        if !definition.lifts_into_work() {
            sink.push(Action::Drill(Box::new(hole)));
        }
        Ok(())
    }
}
