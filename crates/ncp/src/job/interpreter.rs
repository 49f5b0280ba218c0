//! What the lines of a job ask for.
//!
//! The interpreter knows what holds: where the tool is, exactly; the work-piece zero; speeds,
//! plane, drilling cycle. It checks every command before anything of it is done. What a line asks
//! for comes out as [`Action`]s, which are cheap to make and need not be carried out: who only
//! checks a job drops them.

use vimc4_isel_wire::{AxisSet, Dialect, Plane};
use vimc4_motion::Turn;
use vimc4_plant::{Output, Up};

use super::action::{Action, Hole, InputTest, OutputChange, Question, micros, place_at};
use super::drill::{Cycle, Definition};
use super::place::{Cylinder, Place, Way, counters};
use super::problem::Problem;
use super::target::Target;
use crate::geometry::{
    Circle, Curve, CurveParameters, Fitted, MOST_STEPS, NoCircle, Steps, StraightParameters,
};
use crate::language::{
    Command, DrillWords, Frame, Groups, Line, Placed, PortBit, Rate, Span, SpindleWords, Value,
    Word, Words,
};

/// How a job is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Takes the present point as reference point, where a job begins without a reference run.
    pub no_reference: bool,
    /// The values of DRILLDEF but P are mm.
    pub drill_in_mm: bool,
}

/// What holds, and what a line makes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpreter<'t> {
    target: &'t Target,
    options: Options,
    state: State,
}

/// What holds between two lines.
#[derive(Clone, Debug, PartialEq)]
struct State {
    place: Place,
    counters: Steps,
    zero: Place,
    registers: [Option<[Option<Value>; 4]>; 8],
    normal: Value,
    rapid: Value,
    /// What was said of the normal, the rapid and the drilling speed since they were set.
    told: [Told; 3],
    plane: Plane,
    limits: [Option<(Value, Value)>; 4],
    cylinder: Option<Cylinder>,
    drill: Definition,
    mark: Mark,
    /// Whether something has moved, or been referenced.
    begun: bool,
    referenced: AxisSet,
    ended: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Told {
    raised: bool,
    capped: bool,
}

/// Where the file mark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mark {
    /// Not seen, nor any command.
    Awaited,
    /// Not seen, but commands.
    Missing,
    Seen,
}

/// Which speed a movement has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pace {
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

/// Takes what is to be said about a part of the line.
pub type Report<'r> = &'r mut dyn FnMut(Span, Problem);

/// A reason not to carry a line out, and where it stands.
type Refusal = (Span, Problem);

impl<'t> Interpreter<'t> {
    /// What holds before the first line.
    #[must_use]
    pub fn new(target: &'t Target, options: Options) -> Interpreter<'t> {
        let setup = &target.setup;
        let state = State {
            place: Place::default(),
            counters: Steps::default(),
            zero: Place::default(),
            registers: [None; 8],
            normal: Value::whole(setup.velocity.into()),
            rapid: Value::whole(setup.rapid_velocity.into()),
            told: [Told::default(); 3],
            plane: Plane::Xy,
            limits: [None; 4],
            cylinder: None,
            drill: Definition::default(),
            mark: Mark::Awaited,
            begun: false,
            referenced: AxisSet::NONE,
            ended: false,
        };
        Interpreter { target, options, state }
    }

    /// Whether PROGEND was read.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.state.ended
    }

    /// Where the counters are.
    #[must_use]
    pub fn counters(&self) -> Steps {
        self.state.counters
    }

    /// Whether the file had no mark. Only its end shows.
    #[must_use]
    pub fn lacks_mark(&self) -> bool {
        self.state.mark != Mark::Seen
    }

    /// Makes the present place the work-piece zero, as the operator says at WPTEACH.
    pub fn take_zero(&mut self) {
        self.state.zero = self.state.place;
    }

    /// Carries a line out: what it asks for goes into `actions`, what is to be said about it to
    /// `report`. Says whether it can be carried out; if not, nothing of it is in `actions`.
    pub fn line(
        &mut self,
        line: &Line<'_>,
        number: u32,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> bool {
        let Some(Placed { value: command, span }) = line.command else { return true };
        if self.state.ended {
            return true;
        }
        self.mark(&command, span, number, report);
        let before = actions.len();
        match self.command(&command, span, actions, report) {
            Ok(()) => true,
            Err((span, problem)) => {
                report(span, problem);
                actions.truncate(before);
                false
            }
        }
    }

    /// The mark stands before everything else.
    fn mark(&mut self, command: &Command, span: Span, number: u32, report: Report<'_>) {
        match (command, self.state.mark) {
            (Command::Mark, Mark::Awaited) if number > 1 => report(span, Problem::MarkNotFirst),
            (Command::Mark, Mark::Missing) => report(span, Problem::MarkLate),
            _ => {}
        }
        self.state.mark = match (command, self.state.mark) {
            (Command::Mark, _) | (_, Mark::Seen) => Mark::Seen,
            _ => Mark::Missing,
        };
    }

    fn command(
        &mut self,
        command: &Command,
        span: Span,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> Result<(), Refusal> {
        let state = &mut self.state;
        match *command {
            Command::Mark | Command::Type => {}
            Command::Reference(groups) => self.reference(&groups, span, actions, report)?,
            Command::Limit(limits) => self.limit(&limits)?,
            Command::Velocity(word) => {
                state.normal = word.value;
                state.told[Pace::Normal as usize] = Told::default();
            }
            Command::RapidVelocity(word) => {
                state.rapid = word.value;
                state.told[Pace::Rapid as usize] = Told::default();
            }
            Command::Move(frame, rate, words) => {
                let to = self.place_of(frame, &words)?;
                self.begin(span, actions, report);
                let parameters = self.straight(to, rate.into(), span, report)?;
                if parameters.by != Steps::default() {
                    actions.push(Action::Straight(parameters));
                }
            }
            Command::Plane(plane) => state.plane = plane,
            Command::Arc { frame, turn, helix, centre, to } => {
                let to = ArcWords { frame, turn, helix, centre, to };
                self.arc(&to, span, actions, report)?;
            }
            Command::Wait(word) => push_dwell(word, actions),
            Command::ZeroHere => state.zero = state.place,
            Command::ZeroAt(words) => self.zero_at(&self.named(&words)?),
            Command::ZeroClear => state.zero = Place::default(),
            Command::Store(number, words) => {
                let named = self.named(&words)?;
                if let Some(register) = register(&mut self.state, number) {
                    let stored = register.get_or_insert([None; 4]);
                    for (stored, value) in stored.iter_mut().zip(named) {
                        *stored = value.or(*stored);
                    }
                }
            }
            Command::Recall(number) => match register(state, number).and_then(|stored| *stored) {
                Some(named) => self.zero_at(&named),
                None => report(span, Problem::EmptyRegister(number)),
            },
            Command::Teach => {
                self.begin(span, actions, report);
                actions.push(Action::Ask(Question::Teach));
            }
            Command::SetPort(number, value) => {
                let port = self.output_port(number, span)?;
                actions.push(Action::Output(OutputChange { port, bit: None, value }));
            }
            Command::SetBit(PortBit { port, bit }, on) => {
                let port = self.output_port(port, span)?;
                let bit = Some(bit.saturating_sub(1));
                actions.push(Action::Output(OutputChange { port, bit, value: on.into() }));
            }
            Command::WaitBit(PortBit { port, bit }, on) => {
                let port = self.input_port(port, span)?;
                let bit = Some(bit.saturating_sub(1));
                actions.push(Action::Await(InputTest { port, bit, value: on.into() }));
            }
            Command::WaitPort(number, value) => {
                let port = self.input_port(number, span)?;
                actions.push(Action::Await(InputTest { port, bit: None, value }));
            }
            Command::Path | Command::PathEnd => report(span, Problem::PathIgnored),
            Command::Tool(number) => actions.push(Action::Ask(Question::Tool(number))),
            Command::DrillDefinition(words) => self.drill_definition(&words, report),
            Command::Drill(words) => self.drill(&words, span, actions, report)?,
            Command::Cylinder(turning, radius, linear) => self.cylinder(turning, radius, linear)?,
            Command::Halt => actions.push(Action::Ask(Question::Halt)),
            Command::Acceleration(words) => self.acceleration(&words, span, actions, report)?,
            Command::Spindle(words) => self.spindle(&words, span, actions, report)?,
            Command::Coolant(on) => self.coolant(on, span, actions, report)?,
            Command::ToolDefinition | Command::ToolInit => report(span, Problem::ToolIgnored),
            Command::End => state.ended = true,
        }
        Ok(())
    }

    // --- places ---

    /// The words of axes that the machine has, by axis.
    fn named(&self, words: &Words) -> Result<[Option<Value>; 4], Refusal> {
        for (axis, word) in words.iter().enumerate() {
            if let Some(word) = word.filter(|_| !self.target.axes.has(axis)) {
                return Err((word.span, Problem::NoSuchAxis(axis)));
            }
        }
        Ok(std::array::from_fn(|axis| words[axis].map(|word| word.value)))
    }

    /// The place that words give; an axis without a word stays where it is.
    fn place_of(&self, frame: Frame, words: &Words) -> Result<Place, Refusal> {
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

    fn zero_at(&mut self, named: &[Option<Value>; 4]) {
        for (zero, value) in self.state.zero.iter_mut().zip(named) {
            *zero = value.unwrap_or(*zero);
        }
    }

    /// Whether a place may be come to. An axis that stays where it is may.
    fn check(&self, place: &Place, counters: &Steps, span: Span) -> Result<(), Refusal> {
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

    // --- reference ---

    /// All axes are referenced before the first movement.
    fn begin(&mut self, span: Span, actions: &mut Vec<Action>, report: Report<'_>) {
        if self.state.begun {
            return;
        }
        self.state.begun = true;
        // Where the present point is the reference point, the axes stand at it too.
        self.at_reference(self.target.referable);
        if !self.options.no_reference {
            report(span, Problem::ReferenceFirst);
            actions.push(Action::Reference(groups_of(self.target.referable)));
        }
    }

    fn reference(
        &mut self,
        groups: &Groups,
        span: Span,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> Result<(), Refusal> {
        let mut runs = Vec::new();
        for group in groups.iter().filter(|group| **group != 0) {
            if let Some(axis) =
                (0..6).find(|&axis| group >> axis & 1 != 0 && !self.target.axes.has(axis))
            {
                return Err((span, Problem::NoSuchAxis(axis)));
            }
            let axes = AxisSet::from_bits(*group).unwrap_or(AxisSet::NONE);
            for axis in axes.iter().filter(|&axis| !self.target.referable.has(axis)) {
                report(span, Problem::NoReferenceSwitch(axis));
            }
            runs.extend(groups_of(axes));
        }
        self.state.begun = true;
        runs.iter().for_each(|axes| self.at_reference(*axes));
        actions.push(Action::Reference(runs));
        Ok(())
    }

    /// Axes stand at their reference points. The work-piece zero stays where it is.
    fn at_reference(&mut self, axes: AxisSet) {
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

    // --- movements ---

    /// A straight movement to a place, checked.
    fn straight(
        &mut self,
        to: Place,
        pace: Pace,
        span: Span,
        report: Report<'_>,
    ) -> Result<StraightParameters, Refusal> {
        self.warn_of_unreferenced(&to, span, report);
        let cylinder = self.state.cylinder;
        let counters = counters(&to, self.target, cylinder.as_ref());
        let checked = self.check(&to, &counters, span);
        let parameters = self.parameters(&to, &counters, pace, span, report);
        // What follows is read as if it had gone there, so that one error is told once.
        (self.state.place, self.state.counters) = (to, counters);
        checked.map(|()| parameters)
    }

    /// Steps and speeds of a straight movement from where the tool is.
    fn parameters(
        &mut self,
        to: &Place,
        counters: &Steps,
        pace: Pace,
        span: Span,
        report: Report<'_>,
    ) -> StraightParameters {
        let state = &self.state;
        let by: Steps = std::array::from_fn(|axis| counters[axis] - state.counters[axis]);
        let lowest = self.target.speeds().lowest;
        if by == Steps::default() {
            return StraightParameters { by, speed: lowest, a_speed: lowest };
        }
        let way = Way::between(&state.place, to, self.target, state.cylinder.as_ref());
        let (linear, turning) = way.frequencies(self.velocity(pace));
        // Beside other axes A moves a step or two at a time, as fast as it can be told.
        let (speed, a_speed) = match (by[..3] != [0; 3], by[3] != 0) {
            (true, false) => (self.fit(linear, pace, span, report), lowest),
            (false, _) => (lowest, self.fit(turning, pace, span, report)),
            (true, true) => {
                let (a_speed, _) = self.target.speeds().fit(turning);
                (self.fit(linear, pace, span, report), a_speed)
            }
        };
        StraightParameters { by, speed, a_speed }
    }

    fn velocity(&self, pace: Pace) -> Value {
        match pace {
            Pace::Normal => self.state.normal,
            Pace::Rapid => self.state.rapid,
            Pace::Drill => self.state.drill.speed,
        }
    }

    /// The speed that the controller is given for a frequency in Hz.
    fn fit(&mut self, frequency: f64, pace: Pace, span: Span, report: Report<'_>) -> u32 {
        let (given, fitted) = self.target.speeds().fit(frequency);
        self.tell(fitted, frequency, pace, span, report);
        given
    }

    /// Says once for a speed that it cannot be kept.
    fn tell(&mut self, fitted: Fitted, asked: f64, pace: Pace, span: Span, report: Report<'_>) {
        let speeds = self.target.speeds();
        let told = &mut self.state.told[pace as usize];
        let asked = libm::round(asked) as u64;
        match fitted {
            Fitted::Capped if !told.capped => {
                told.capped = true;
                report(span, Problem::SpeedCapped { asked, given: speeds.highest });
            }
            Fitted::Raised if !told.raised => {
                told.raised = true;
                report(span, Problem::SpeedRaised { asked, given: speeds.lowest });
            }
            _ => {}
        }
    }

    /// Some axes were referenced, and this one was not.
    fn warn_of_unreferenced(&mut self, to: &Place, span: Span, report: Report<'_>) {
        let state = &mut self.state;
        if state.referenced.is_empty() {
            return;
        }
        for axis in self.target.referable.iter() {
            if !state.referenced.has(axis) && to[axis] != state.place[axis] {
                report(span, Problem::NotReferenced(axis));
            }
        }
    }

    fn arc(
        &mut self,
        words: &ArcWords,
        span: Span,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> Result<(), Refusal> {
        let plane = self.state.plane;
        let (first, second) = plane.axes();
        let third = plane.third();
        let in_use = |axis| axis == first || axis == second || words.helix && axis == third;
        let mut to = words.to;
        for (axis, word) in to.iter_mut().enumerate().filter(|(axis, _)| !in_use(*axis)) {
            if let Some(word) = word.take() {
                report(word.span, Problem::OutsidePlane(axis));
            }
        }
        for axis in (0..3).filter(|&axis| in_use(axis)) {
            // A helix without a third word needs no third axis.
            if !self.target.axes.has(axis) && (axis != third || to[third].is_some()) {
                return Err((span, Problem::NoSuchAxis(axis)));
            }
            if self.state.cylinder.is_some_and(|cylinder| cylinder.linear == axis) {
                return Err((span, Problem::OnCylinder(axis)));
            }
        }
        let to_place = self.place_of(words.frame, &to)?;
        self.begin(span, actions, report);
        let from = self.state.place;
        let centre = self.centre(words, (first, second));
        let end = (to[first].is_some() || to[second].is_some())
            .then(|| [to_place[first], to_place[second]]);
        let scales = [self.target.scales[first], self.target.scales[second]];
        let start = [from[first], from[second]];
        self.warn_of_unreferenced(&to_place, span, report);
        let circle = Circle::new(plane, words.turn, centre, start, end, scales).map_err(|no| {
            let problem = match no {
                NoCircle::NoRadius => Problem::NoRadius,
                NoCircle::Apart { start, end } => Problem::UnevenRadius { start, end },
            };
            (span, problem)
        });
        let counters = counters(&to_place, self.target, self.state.cylinder.as_ref());
        let checked = circle.and_then(|circle| {
            self.check(&to_place, &counters, span)?;
            self.check_extent(&circle, &to_place, span)?;
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
        self.warn_of_curve_speed(&parameters, span, report);
        actions.push(Action::Curve(Box::new(parameters)));
        Ok(())
    }

    /// The centre that I and J give. Absolute ones that are missing are where the tool is.
    fn centre(&self, words: &ArcWords, (first, second): (usize, usize)) -> [Value; 2] {
        let Interpreter { state: State { place, zero, .. }, .. } = self;
        let of = |axis: usize, word: Option<Word>| match (words.frame, word) {
            (Frame::Absolute, Some(word)) => sum(zero[axis], word.value),
            (Frame::Relative, Some(word)) => sum(place[axis], word.value),
            (_, None) => place[axis],
        };
        [of(first, words.centre[0]), of(second, words.centre[1])]
    }

    /// Whether all of an arc may be come to.
    fn check_extent(&self, circle: &Circle, to: &Place, span: Span) -> Result<(), Refusal> {
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
    fn warn_of_curve_speed(
        &mut self,
        parameters: &CurveParameters,
        span: Span,
        report: Report<'_>,
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
            self.tell(fitted, asked, Pace::Normal, span, report);
        }
    }

    // --- drilling ---

    fn drill_definition(&mut self, words: &DrillWords, report: Report<'_>) {
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
            report(word.span, Problem::MillimetresMeant(word.value));
        }
        self.state.drill = Definition {
            cycle,
            plane: words.plane.map_or(old.plane, |word| word.value),
            depth: length(words.depth, old.depth),
            dwell: words.dwell.map_or(old.dwell, |word| word.value),
            speed: length(words.speed, old.speed),
            first: length(words.first, old.first),
            other: length(words.other, old.other),
            decrease: length(words.decrease, old.decrease),
            retreat: length(words.retreat, old.retreat),
            lift: length(words.lift, old.lift),
            safety: length(words.safety, old.safety),
        };
    }

    fn drill(
        &mut self,
        words: &Words,
        span: Span,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> Result<(), Refusal> {
        const Z: usize = 2;
        let definition = self.state.drill;
        if !self.target.axes.has(Z) {
            return Err((span, Problem::NoSuchAxis(Z)));
        }
        if self.state.cylinder.is_some_and(|cylinder| cylinder.linear == Z) {
            return Err((span, Problem::OnCylinder(Z)));
        }
        let mut to = self.place_of(Frame::Absolute, words)?;
        self.begin(span, actions, report);
        for (problem, applies) in [
            (Problem::NoDepth, definition.depth <= Value::ZERO),
            (Problem::NoDrillSteps, definition.lacks_steps()),
        ] {
            if applies {
                report(span, problem);
            }
        }
        let up = if self.target.setup.up == Up::Positive { 1 } else { -1 };
        let plane = place_at(self.state.zero[Z], up, definition.plane);
        // All of the cycle is checked before anything of it is done.
        let (low, high) = definition.extent();
        let mut checked = Ok(());
        for height in [low, high] {
            to[Z] = place_at(plane, up, height);
            let counters = counters(&to, self.target, self.state.cylinder.as_ref());
            checked = checked.and_then(|()| self.check(&to, &counters, span));
        }
        to[Z] = place_at(plane, up, definition.safety);
        let z = self.state.counters[Z];
        self.warn_of_unreferenced(&to, span, report);
        let end = counters(&to, self.target, self.state.cylinder.as_ref());
        let mut over = end;
        over[Z] = z;
        let mut over_place = to;
        over_place[Z] = self.state.place[Z];
        let across = self.parameters(&over_place, &over, Pace::Rapid, span, report);
        let scale = self.target.scales[Z];
        let frequency = |velocity: Value| velocity.in_thousandths() as f64 / scale.step();
        let hole = Hole {
            legs: definition.legs(Value::thousandths(libm::ceil(scale.step()) as i64)),
            across,
            z,
            plane,
            up,
            scale,
            feed: self.fit(frequency(definition.speed), Pace::Drill, span, report),
            rapid: self.fit(frequency(self.state.rapid), Pace::Rapid, span, report),
        };
        (self.state.place, self.state.counters) = (to, end);
        checked?;
        actions.push(Action::Drill(Box::new(hole)));
        Ok(())
    }

    // --- settings ---

    fn limit(&mut self, limits: &[Option<(Word, Word)>; 6]) -> Result<(), Refusal> {
        let lowest: Words = std::array::from_fn(|axis| limits[axis].map(|(lowest, _)| lowest));
        self.named(&lowest)?;
        for (limit, words) in self.state.limits.iter_mut().zip(limits) {
            if let Some((lowest, highest)) = words {
                *limit = Some((lowest.value, highest.value));
            }
        }
        Ok(())
    }

    fn cylinder(
        &mut self,
        turning: Placed<usize>,
        radius: Word,
        linear: Option<Placed<usize>>,
    ) -> Result<(), Refusal> {
        let Placed { value: axis, span } = turning;
        if !self.target.axes.has(axis) {
            return Err((span, Problem::NoSuchAxis(axis)));
        }
        if !self.target.rotary.has(axis) {
            return Err((span, Problem::NotRotary(axis)));
        }
        let replaced = match linear.filter(|_| radius.value > Value::ZERO) {
            Some(Placed { value, span }) if !self.target.axes.has(value) => {
                return Err((span, Problem::NoSuchAxis(value)));
            }
            Some(Placed { value, span }) if self.target.rotary.has(value) => {
                return Err((span, Problem::NotLinear(value)));
            }
            replaced => replaced.map(|linear| linear.value),
        };
        // The axes are where the cylinder before it has left them.
        if let Some(cylinder) = self.state.cylinder.take() {
            self.state.place = cylinder.unrolled(&self.state.place);
        }
        self.state.cylinder = replaced.map(|linear| Cylinder {
            turning: axis,
            linear,
            radius: radius.value,
            from: self.state.place[linear],
        });
        Ok(())
    }

    fn acceleration(
        &mut self,
        words: &Words,
        span: Span,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> Result<(), Refusal> {
        self.named(words)?;
        let least = words.iter().flatten().map(|word| word.value).min();
        let Some(least) = least else { return Ok(()) };
        if self.target.controller.dialect != Dialect::ImcXx {
            report(span, Problem::AccelerationFixed);
            return Ok(());
        }
        let share =
            least.in_thousandths().unsigned_abs() * u64::from(self.target.setup.acceleration);
        let rounded = u32::try_from((share + 50_000) / 100_000).unwrap_or(u32::MAX);
        actions.push(Action::Acceleration(rounded.clamp(1, 4_000)));
        Ok(())
    }

    // --- ports ---

    fn output_port(&self, number: u8, span: Span) -> Result<u16, Refusal> {
        let unmapped = Problem::PortUnmapped { input: false, number };
        let port = self.target.setup.ports.output(number).ok_or((span, unmapped))?;
        self.writable(port, span)
    }

    fn writable(&self, port: u16, span: Span) -> Result<u16, Refusal> {
        match self.target.controller.outputs.contains(&port) {
            true => Ok(port),
            false => Err((span, Problem::NoSuchPort { input: false, port })),
        }
    }

    fn input_port(&self, number: u8, span: Span) -> Result<u16, Refusal> {
        let unmapped = Problem::PortUnmapped { input: true, number };
        let port = self.target.setup.ports.input(number).ok_or((span, unmapped))?;
        match self.target.controller.inputs.contains(&port) {
            true => Ok(port),
            false => Err((span, Problem::NoSuchPort { input: true, port })),
        }
    }

    fn switch(
        &self,
        output: Output,
        on: bool,
        span: Span,
        actions: &mut Vec<Action>,
    ) -> Result<(), Refusal> {
        let port = self.writable(output.port, span)?;
        actions.push(Action::Output(OutputChange { port, bit: output.bit, value: on.into() }));
        Ok(())
    }

    fn spindle(
        &mut self,
        words: &SpindleWords,
        span: Span,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> Result<(), Refusal> {
        let Some(spindle) = self.target.setup.spindle else {
            report(span, Problem::NoSpindle);
            return Ok(());
        };
        if let (Some(turn), false) = (words.turn, words.off) {
            let reverse = turn.value == Turn::Counterclockwise;
            match spindle.counterclockwise {
                Some(output) => self.switch(output, reverse, turn.span, actions)?,
                // It always turns the one way.
                None if reverse => report(turn.span, Problem::NoSpindleDirection),
                None => {}
            }
        }
        if let (Some(rpm), false) = (words.rpm, words.off) {
            match spindle.analogue {
                None => report(rpm.span, Problem::NoSpindleSpeed),
                Some(analogue) => {
                    let port = self.writable(analogue.port, rpm.span)?;
                    let full = Value::whole(analogue.full_rpm.into());
                    if rpm.value > full {
                        report(rpm.span, Problem::SpindleCapped(analogue.full_rpm));
                    }
                    let share = rpm.value.clamp(Value::ZERO, full).as_f64() / full.as_f64();
                    let value = libm::round(share * 255.0) as u8;
                    actions.push(Action::Output(OutputChange { port, bit: None, value }));
                }
            }
        }
        self.switch(spindle.on, !words.off, span, actions)?;
        words.time.into_iter().for_each(|time| push_dwell(time, actions));
        Ok(())
    }

    fn coolant(
        &mut self,
        on: bool,
        span: Span,
        actions: &mut Vec<Action>,
        report: Report<'_>,
    ) -> Result<(), Refusal> {
        match self.target.setup.coolant {
            Some(output) => self.switch(output, on, span, actions),
            None => {
                report(span, Problem::NoCoolant);
                Ok(())
            }
        }
    }
}

/// The words of an arc.
struct ArcWords {
    frame: Frame,
    turn: Turn,
    helix: bool,
    centre: [Option<Word>; 2],
    to: Words,
}

fn sum(a: Value, b: Value) -> Value {
    Value::thousandths(a.in_thousandths().saturating_add(b.in_thousandths()))
}

fn push_dwell(word: Word, actions: &mut Vec<Action>) {
    if word.value > Value::ZERO {
        actions.push(Action::Dwell(micros(word.value)));
    }
}

fn register(state: &mut State, number: u8) -> Option<&mut Option<[Option<Value>; 4]>> {
    state.registers.get_mut(usize::from(number).checked_sub(1)?)
}

/// The reference runs that find these axes: the controller takes Z, Y, X in this order, and A
/// must go alone.
fn groups_of(axes: AxisSet) -> Vec<AxisSet> {
    let linear = AxisSet::from_bits(axes.bits() & 0b0111).unwrap_or(AxisSet::NONE);
    let turning = if axes.has(3) { AxisSet::A } else { AxisSet::NONE };
    [linear, turning].into_iter().filter(|axes| !axes.is_empty()).collect()
}
