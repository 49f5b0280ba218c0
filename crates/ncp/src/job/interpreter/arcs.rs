//! Arcs and helices.

use vimc4_isel_wire::Dialect;
use vimc4_motion::Turn;

use super::sink::Sink;
use super::{Interpreter, Pace, Refusal, State, sum};
use crate::geometry::{Circle, Curve, CurveParameters, NoCircle};
use crate::job::action::Action;
use crate::job::place::{Place, counters};
use crate::job::problem::Problem;
use crate::language::{Frame, Span, Value, Word, Words};

impl Interpreter<'_> {
    pub(super) fn arc(&mut self, words: &ArcWords, sink: &mut Sink<'_>) -> Result<(), Refusal> {
        let plane = self.state.plane;
        let (first, second) = plane.axes();
        let third = plane.third();
        let in_use = |axis| axis == first || axis == second || words.helix && axis == third;
        let mut to = words.to;
        for (axis, word) in to.iter_mut().enumerate().filter(|(axis, _)| !in_use(*axis)) {
            if let Some(word) = word.take() {
                sink.say_at(word.span, Problem::OutsidePlane(axis));
            }
        }
        for axis in (0..3).filter(|&axis| in_use(axis)) {
            // A helix without a third word needs no third axis.
            if !self.target.axes.has(axis) && (axis != third || to[third].is_some()) {
                return Err((sink.span, Problem::NoSuchAxis(axis)));
            }
            if self.state.cylinder.is_some_and(|cylinder| cylinder.linear == axis) {
                return Err((sink.span, Problem::OnCylinder(axis)));
            }
        }
        let to_place = self.place_of(words.frame, &to)?;
        self.begin(sink);
        let from = self.state.place;
        let centre = self.centre(words, (first, second));
        let end = (to[first].is_some() || to[second].is_some())
            .then(|| [to_place[first], to_place[second]]);
        let scales = [self.target.scales[first], self.target.scales[second]];
        let start = [from[first], from[second]];
        self.warn_of_unreferenced(&to_place, sink);
        let circle = Circle::new(plane, words.turn, centre, start, end, scales).map_err(|no| {
            let problem = match no {
                NoCircle::NoRadius => Problem::NoRadius,
                NoCircle::Apart { start, end } => Problem::UnevenRadius { start, end },
            };
            (sink.span, problem)
        });
        let counters = counters(&to_place, self.target, self.state.cylinder.as_ref());
        let checked = circle.and_then(|circle| {
            self.check(&to_place, &counters, sink.span)?;
            self.check_extent(&circle, &to_place, sink.span)?;
            Ok(circle)
        });
        let parameters = checked.map(|circle| CurveParameters {
            circle,
            scales: self.target.scales,
            from: self.state.counters,
            to: counters,
            rise: (words.helix && from[third] != to_place[third])
                .then(|| (from[third], to_place[third])),
            velocity: self.state.normal.in_thousandths() as f64,
            speeds: self.target.speeds(),
            has_helix: self.target.controller.dialect == Dialect::ImcXx,
        });
        (self.state.place, self.state.counters) = (to_place, counters);
        let parameters = parameters?;
        self.warn_of_curve_speed(&parameters, sink);
        sink.push(Action::Curve(Box::new(parameters)));
        Ok(())
    }

    /// The centre that I and J give. Absolute ones that are missing are where the tool is.
    pub(super) fn centre(&self, words: &ArcWords, (first, second): (usize, usize)) -> [Value; 2] {
        let Interpreter { state: State { place, zero, .. }, .. } = self;
        let of = |axis: usize, word: Option<Word>| match (words.frame, word) {
            (Frame::Absolute, Some(word)) => sum(zero[axis], word.value),
            (Frame::Relative, Some(word)) => sum(place[axis], word.value),
            (_, None) => place[axis],
        };
        [of(first, words.centre[0]), of(second, words.centre[1])]
    }

    /// Whether all of an arc may be come to.
    pub(super) fn check_extent(
        &self,
        circle: &Circle,
        to: &Place,
        span: Span,
    ) -> Result<(), Refusal> {
        let (first, second) = circle.plane().axes();
        let extent = circle.extent();
        for end in [|(low, _): (f64, f64)| low, |(_, high): (f64, f64)| high] {
            let mut place = *to;
            for (axis, range) in [first, second].into_iter().zip(extent) {
                place[axis] = Value::thousandths(libm::round(end(range)) as i64);
            }
            let counters = counters(&place, self.target, self.state.cylinder.as_ref());
            self.check(&place, &counters, span)?;
        }
        Ok(())
    }

    /// Says if the speed of an arc cannot be kept. What it needs lies between bounds that are
    /// quickly known; only what could be out of range is looked at closely.
    pub(super) fn warn_of_curve_speed(
        &mut self,
        parameters: &CurveParameters,
        sink: &mut Sink<'_>,
    ) {
        let plane = parameters.circle.plane();
        let (first, second) = plane.axes();
        let axes = [first, second, if parameters.rise.is_some() { plane.third() } else { first }];
        let steps = axes.map(|axis| self.target.scales[axis].step());
        let finest = steps.into_iter().fold(f64::INFINITY, f64::min);
        let coarsest = steps.into_iter().fold(0.0, f64::max);
        let speeds = self.target.speeds();
        // A step of each axis of the plane is at most √2 steps of the way, a part of a chord at
        // least 1/√3 of it.
        let highest = parameters.velocity / finest * 1.415 + 1.0;
        let lowest = parameters.velocity / coarsest * 0.577 - 1.0;
        if highest > f64::from(speeds.highest) || lowest < f64::from(speeds.lowest) {
            let fitted = Curve::new(*parameters).fitted();
            let asked = parameters.velocity / finest;
            self.tell(fitted, asked, Pace::Normal, sink);
        }
    }
}

/// The words of an arc.
pub(super) struct ArcWords {
    pub(super) frame: Frame,
    pub(super) turn: Turn,
    pub(super) helix: bool,
    pub(super) centre: [Option<Word>; 2],
    pub(super) to: Words,
}
