//! Arcs and helices.

use vimc4_isel_wire::{Dialect, Plane};
use vimc4_motion::Turn;

use super::sink::Sink;
use super::state::{Interpreter, Pace, Refusal, State, sum};
use crate::geometry::{Circle, Curve, CurveParameters, NoCircle, Scale, Steps, StraightParameters};
use crate::job::action::Action;
use crate::job::place::{Place, counters};
use crate::job::problem::{Problem, Why};
use crate::language::{Frame, LETTERS, Span, Value, Word, Words};

impl Interpreter<'_> {
    pub(super) fn arc(&mut self, words: &ArcWords, sink: &mut Sink<'_>) -> Result<(), Refusal> {
        let plane = self.state.plane;
        let (first, second) = plane.axes();
        let third = plane.third();
        let to = self.words_in_use(words, sink)?;
        let to_place = self.place_of(words.frame, &to)?;
        let centre_words = words.centre_of(plane, sink)?;
        self.begin(sink);
        let from = self.state.place;
        self.warn_of_surface(&from, &to_place, true, sink);
        let centre = self.centre(words.frame, centre_words, (first, second));
        let end = (to[first].is_some() || to[second].is_some())
            .then(|| [to_place[first], to_place[second]]);
        let scales = [self.target.scales[first], self.target.scales[second]];
        let start = [from[first], from[second]];
        self.warn_of_unreferenced(&to_place, sink);
        let unit = self.state.units.resolution();
        let circle = Circle::new(unit, plane, words.turn, centre, start, end, scales);
        if self.is_less_than_a_step(&circle, centre, start, end, scales) {
            let way = self.straight(to_place, Pace::Normal, sink)?;
            if way.by != Steps::default() {
                sink.push(Action::Straight(way));
            }
            return Ok(());
        }
        let circle = circle.map_err(|no| {
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
        let rise =
            (words.helix && from[third] != to_place[third]).then(|| (from[third], to_place[third]));
        if words.sweep.is_none() && checked.is_ok_and(|circle| circle.is_nearly_whole()) {
            sink.say(Problem::NearlyWhole);
        }
        let parameters = checked.map(|circle| CurveParameters {
            circle,
            scales: self.target.scales,
            from: self.state.counters,
            to: counters,
            rise,
            velocity: self.state.normal.in_thousandths() as f64,
            speeds: self.target.speeds(),
            has_helix: self.target.controller.dialect == Dialect::ImcXx,
        });
        let turns = match (parameters, words.sweep) {
            (Ok(parameters), Some(sweep)) => self.turns(&parameters, sweep, sink),
            _ => Ok(Turns::None),
        };
        (self.state.place, self.state.counters) = (to_place, counters);
        let mut parameters = parameters?;
        match turns? {
            Turns::None => {}
            Turns::Backwards(way) => {
                sink.push(Action::Straight(way));
                return Ok(());
            }
            Turns::Whole(circle, number) => {
                parameters = self.whole_turns(parameters, circle, number, sink);
            }
        }
        self.warn_of_curve_speed(&parameters, sink);
        sink.push(Action::Curve(Box::new(parameters)));
        Ok(())
    }

    /// The words of the axes that an arc moves. It leaves out the others.
    fn words_in_use(&self, words: &ArcWords, sink: &mut Sink<'_>) -> Result<Words, Refusal> {
        let (first, second) = self.state.plane.axes();
        let third = self.state.plane.third();
        let in_use = |axis| axis == first || axis == second || words.helix && axis == third;
        let mut to = words.to;
        let asked = self.place_of(words.frame, &words.to).ok();
        for (axis, word) in to.iter_mut().enumerate().filter(|(axis, _)| !in_use(*axis)) {
            let Some(word) = word.take() else { continue };
            let at = asked.and_then(|asked| asked.get(axis).copied());
            let elsewhere = at.filter(|at| self.state.place.get(axis) != Some(at));
            let helix = (axis == third).then(|| words.as_helix());
            sink.say_at(
                word.span,
                match elsewhere {
                    Some(at) => Problem::OffPlane { axis, at, helix },
                    None => Problem::OutsidePlane { word: LETTERS[axis], helix },
                },
            );
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
        Ok(to)
    }

    /// Whether an arc is so small that a step is longer than its radius. A centre that is the
    /// start is a mistake.
    fn is_less_than_a_step(
        &self,
        circle: &Result<Circle, NoCircle>,
        centre: [Value; 2],
        start: [Value; 2],
        end: Option<[Value; 2]>,
        scales: [Scale; 2],
    ) -> bool {
        // The ends of any arc may be two steps apart.
        let room = 2.5 * scales[0].step().min(scales[1].step());
        let near = |end: [Value; 2]| {
            let [x, y] = [0, 1].map(|axis: usize| {
                end[axis].in_thousandths().saturating_sub(centre[axis].in_thousandths()) as f64
            });
            libm::sqrt(x * x + y * y) <= room
        };
        *circle == Err(NoCircle::NoRadius) && centre != start && end.is_none_or(near)
    }

    /// How many extra whole turns a helix makes, according to W.
    fn turns(
        &mut self,
        parameters: &CurveParameters,
        sweep: Word,
        sink: &mut Sink<'_>,
    ) -> Result<Turns, Refusal> {
        const DEGREES: f64 = 360.0;
        let said = sweep.value.as_f64();
        let own = parameters.circle.sweep().to_degrees();
        let turns = libm::round((said - own) / DEGREES);
        let is = own + turns * DEGREES;
        // CAM programs write whole degrees.
        if (said - is).abs() > 2.0 {
            let is = Value::thousandths(libm::round(own * 1_000.0) as i64);
            sink.say_at(sweep.span, Problem::SweepDiffers { said: sweep.value, is });
            return Ok(Turns::None);
        }
        if turns < 0.0 {
            // Rounding puts the end behind the start: there is hardly any way.
            let (first, second) = parameters.circle.plane().axes();
            let third = parameters.circle.plane().third();
            let mut to = self.state.place;
            to[first] = parameters.circle.end()[0];
            to[second] = parameters.circle.end()[1];
            to[third] = parameters.rise.map_or(to[third], |(_, to)| to);
            let counters = counters(&to, self.target, self.state.cylinder.as_ref());
            return Ok(Turns::Backwards(self.parameters(&to, &counters, Pace::Normal, sink)));
        }
        if turns < 1.0 {
            return Ok(Turns::None);
        }
        let whole = parameters.circle.whole();
        let place = self.state.place;
        self.check_extent(&whole, &place, sink.span)?;
        Ok(Turns::Whole(whole, turns as u32))
    }

    /// Makes whole turns, and returns what is left of the helix.
    fn whole_turns(
        &mut self,
        mut rest: CurveParameters,
        whole: Circle,
        number: u32,
        sink: &mut Sink<'_>,
    ) -> CurveParameters {
        let third = whole.plane().third();
        let total = f64::from(number) * whole.sweep() + rest.circle.sweep();
        let ends = rest.rise;
        let mut at = rest;
        for turn in 1..=number {
            let part = f64::from(turn) * whole.sweep() / total;
            let mut curve = CurveParameters { circle: whole, to: at.from, ..at };
            if let (Some((from, to)), Some((low, _))) = (ends, at.rise) {
                let way = to.in_thousandths() - from.in_thousandths();
                let made = libm::round(way as f64 * part) as i64;
                let high = Value::thousandths(from.in_thousandths() + made);
                curve.rise = Some((low, high));
                curve.to[third] = self.target.scales[third].round(high);
                at.rise = Some((high, to));
                at.from = curve.to;
            }
            self.warn_of_curve_speed(&curve, sink);
            sink.push(Action::Curve(Box::new(curve)));
        }
        (rest.from, rest.rise) = (at.from, at.rise);
        rest
    }

    /// The centre that I and J give. Absolute ones that are missing are where the tool is.
    pub(super) fn centre(
        &self,
        frame: Frame,
        words: [Option<Word>; 2],
        (first, second): (usize, usize),
    ) -> [Value; 2] {
        let Interpreter { state: State { place, zero, .. }, .. } = self;
        let of = |axis: usize, word: Option<Word>| match (frame, word) {
            (Frame::Absolute, Some(word)) => sum(zero[axis], word.value),
            (Frame::Relative, Some(word)) => sum(place[axis], word.value),
            (_, None) => place[axis],
        };
        [of(first, words[0]), of(second, words[1])]
    }

    /// Whether all of an arc may be reached.
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

    /// Reports if the speed of an arc cannot be kept. The needed speed lies between bounds that are
    /// quickly known; only cases that could be out of range are computed exactly.
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
        if !Curve::is_one_circle(parameters) {
            let curve = Curve::new(*parameters);
            self.warn_of_delay(curve.delay(), Why::Curve(curve.reason()), sink);
        }
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
    pub(super) centre: [Option<Word>; 3],
    pub(super) sweep: Option<Word>,
    pub(super) to: Words,
}

impl ArcWords {
    /// The command that moves the third axis too.
    fn as_helix(&self) -> &'static str {
        match (self.turn, self.frame) {
            (Turn::Clockwise, Frame::Absolute) => "CWHLXABS",
            (Turn::Clockwise, Frame::Relative) => "CWHLXREL",
            (Turn::Counterclockwise, Frame::Absolute) => "CCWHLXABS",
            (Turn::Counterclockwise, Frame::Relative) => "CCWHLXREL",
        }
    }

    /// The words for the centre on the first and the second axis of a plane. According to the
    /// manual these are I and J; where there is a K, each letter belongs to its own axis.
    fn centre_of(&self, plane: Plane, sink: &mut Sink<'_>) -> Result<[Option<Word>; 2], Refusal> {
        let [i, j, k] = self.centre;
        let (Some(z), Plane::Xz | Plane::Yz) = (k, plane) else {
            if let Some(word) = k {
                sink.say_at(word.span, Problem::OutsidePlane { word: 'K', helix: None });
            }
            return Ok([i, j]);
        };
        match (plane, i, j) {
            (Plane::Xz, _, Some(_)) => Err((z.span, Problem::TwoCentres)),
            (Plane::Yz, Some(word), _) => {
                sink.say_at(word.span, Problem::OutsidePlane { word: 'I', helix: None });
                Ok([j, k])
            }
            (Plane::Xz, ..) => Ok([i, k]),
            _ => Ok([j, k]),
        }
    }
}

/// What W adds to a helix.
enum Turns {
    /// Nothing.
    None,
    /// This many whole turns before it.
    Whole(Circle, u32),
    /// It is not an arc, but hardly any way.
    Backwards(StraightParameters),
}
