//! What is kept of a run: its motions, and what happened on the way.

use vimc4_device::{Course, Event, Kinds, Loss, Motion, StopCause, Warning};
use vimc4_motion::{AXES, Point, Segment, Time};

use crate::frame::added;
use crate::leg::{self, Leg, Over, Purpose};

/// What a mark says, the most telling last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MarkKind {
    /// The first motion begins.
    Start,
    /// The last motion ends. Its sign is smaller than that of the start, and so seen in front of it.
    End,
    /// A tool is changed.
    Tool,
    /// The controller was put into another state, and goes on from here.
    Back,
    /// Nothing went wrong, but something was lost or assumed.
    Warning,
    /// An error answer, or a loss.
    Error,
    /// A motion ended before its time.
    Stop,
    /// A limit switch ended a motion.
    Limit,
}

impl MarkKind {
    /// Whether something has gone otherwise than it was wanted.
    fn is_trouble(self) -> bool {
        matches!(self, MarkKind::Error | MarkKind::Stop | MarkKind::Limit)
    }
}

/// Something worth seeing, and where it was.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// What it is.
    pub kind: MarkKind,
    /// When it was.
    pub at: Time,
    /// Where the axes were, in steps, as in [`Plot::legs`].
    pub place: Point,
    /// More about it, for people.
    pub text: String,
}

impl Mark {
    /// Says more about it.
    fn add(&mut self, text: &str) {
        if !self.text.contains(text) {
            let between = if self.text.is_empty() { "" } else { "; " };
            self.text = format!("{}{between}{text}", self.text);
        }
    }
}

/// More marks than this are counted but not drawn.
const MOST_MARKS: usize = 1_000;

/// With more motions than this, short ones are taken together.
const MOST_LEGS: usize = 250_000;

/// Collects what a controller does, to be drawn.
///
/// Places are those of the carriages in steps, counted from the reference point; before the first
/// reference run, and without one, as the controller counts. When a counter is set the carriage stays
/// where it is, and so does the path.
#[derive(Clone, Debug)]
pub struct Plot {
    legs: Vec<Leg>,
    /// How many motions there were.
    motions: u64,
    marks: Vec<Mark>,
    left_out: usize,
    running: Option<Running>,
    /// What the end of the arc that begins next misses.
    misses: Option<String>,
    /// How much longer the controller has lived than its own time says, in nanoseconds, because it was put
    /// back.
    ahead: u64,
    purpose: Purpose,
    /// Where the counters were when the last motion ended.
    counters: Option<Point>,
    /// Carriage minus counter.
    shift: Point,
    /// Whether the axis has made a reference run since the last motion that was none.
    referencing: [bool; AXES],
    /// The carriage at the reference point, once there was one.
    zero: [Option<i64>; AXES],
    /// How many steps short motions that were taken together go astray at the most.
    reach: i64,
    most_legs: usize,
}

#[derive(Clone, Debug)]
struct Running {
    began: Time,
    from: Point,
    origin: Point,
    segment: Box<Segment>,
    over: Over,
    /// How far the carriages run on when it ends.
    overrun: Point,
    /// What its end misses.
    misses: Option<String>,
}

/// Another state that a controller was put into.
#[derive(Clone, Debug)]
pub struct Back<'b> {
    /// The time of the controller in it.
    pub now: Time,
    /// The counters.
    pub counters: Point,
    /// Carriage minus counter, by as much more than when the first motion began.
    pub shift: Point,
    /// The motion that is under way, and when that began.
    pub running: Option<(Time, &'b Segment)>,
    /// Who did it, or what else there is to say.
    pub text: String,
}

impl Default for Plot {
    fn default() -> Plot {
        Plot::new()
    }
}

impl Plot {
    /// The kinds of events that it looks at.
    pub const KINDS: Kinds =
        Kinds::MOTION.and(Kinds::ANSWER).and(Kinds::COURSE).and(Kinds::WARNING);

    /// Nothing has happened yet.
    #[must_use]
    pub fn new() -> Plot {
        Plot {
            legs: Vec::new(),
            motions: 0,
            marks: Vec::new(),
            left_out: 0,
            running: None,
            misses: None,
            ahead: 0,
            purpose: Purpose::default(),
            counters: None,
            shift: [0; AXES],
            referencing: [false; AXES],
            zero: [None; AXES],
            reach: 0,
            most_legs: MOST_LEGS,
        }
    }

    /// Sets with how many motions short ones are taken together; 250,000 otherwise.
    #[must_use]
    pub fn keeping(self, most: usize) -> Plot {
        Plot { most_legs: most.max(16), ..self }
    }

    /// Motions that begin from now on are for this.
    pub fn purpose(&mut self, purpose: Purpose) {
        self.purpose = purpose;
    }

    /// Something has happened.
    pub fn see(&mut self, at: Time, event: &Event) {
        let at = self.drawn(at);
        match event {
            Event::Motion(Motion::Begins { origin, segment }) => {
                self.end(at, None);
                self.counters_are(origin, self.purpose != Purpose::Reference);
                let from = added(origin, &self.shift);
                if self.legs.is_empty() && self.running.is_none() {
                    self.mark(MarkKind::Start, at, from, String::new());
                }
                let (origin, segment) = (*origin, segment.clone());
                let (over, overrun, misses) = (Over::default(), [0; AXES], self.misses.take());
                let began = at;
                self.running =
                    Some(Running { began, from, origin, segment, over, overrun, misses });
            }
            Event::Motion(Motion::Changes { segment }) => {
                if let Some(running) = &mut self.running {
                    running.segment = running.over.rest(segment);
                }
            }
            Event::Motion(Motion::Ends { steps }) => self.end(at, Some(*steps)),
            Event::Course(Course::Stops { cause, .. }) => {
                let (kind, text) = match cause {
                    StopCause::LimitSwitch | StopCause::LimitByHand | StopCause::WrongSwitch => {
                        (MarkKind::Limit, String::new())
                    }
                    cause => (MarkKind::Stop, cause.to_string()),
                };
                self.mark(kind, at, self.place(at), text);
            }
            Event::Answer { bytes, why: Some(why), .. } => {
                // How a line ends says nothing.
                let answer = bytes.trim_ascii_end().escape_ascii().to_string();
                let answer: String = answer.chars().take(12).collect();
                self.explain(MarkKind::Error, at, format!("{answer}: {why}"));
            }
            Event::CutShort { why, .. } => self.explain(MarkKind::Error, at, why.to_string()),
            Event::Warning(warning) => self.warned(at, warning),
            _ => {}
        }
    }

    /// At this time the controller was put into another state. What was drawn stays, and what comes is
    /// drawn behind it: times go on, though those of the controller may have gone back.
    pub fn put_back(&mut self, at: Time, back: Back<'_>) {
        let at = self.drawn(at);
        self.end(at, None);
        let Back { now, counters, shift, running, text } = back;
        self.ahead = at.nanos_since(now);
        let at = self.drawn(now);
        (self.counters, self.shift) = (Some(counters), shift);
        self.referencing = [false; AXES];
        self.mark(MarkKind::Back, at, self.place(at), text);
        let Some((began, segment)) = running else { return };
        let nanos = now.nanos_since(began);
        let over = Over { steps: segment.profile.steps_at(nanos), nanos };
        let (from, segment) = (added(&counters, &shift), over.rest(segment));
        let (origin, overrun, misses) = (counters, [0; AXES], None);
        self.running = Some(Running { began: at, from, origin, segment, over, overrun, misses });
    }

    /// When something is drawn that happens at a time of the controller.
    fn drawn(&self, at: Time) -> Time {
        at.after_nanos(self.ahead)
    }

    /// A tool is changed where the axes are.
    pub fn tool(&mut self, at: Time, text: impl Into<String>) {
        let at = self.drawn(at);
        let place = self.place(at);
        self.mark(MarkKind::Tool, at, place, text.into());
    }

    /// The run is over: what moves has moved up to now, and the counters are these.
    pub fn stop(&mut self, now: Time, counters: &Point) {
        self.end(self.drawn(now), None);
        if !self.legs.is_empty() {
            self.counters_are(counters, true);
        }
    }

    /// The motions, in order. Places are in steps, before the [origin](Plot::origin) is taken off.
    #[must_use]
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// How many motions there were, with those that were taken together.
    #[must_use]
    pub fn motions(&self) -> u64 {
        self.motions
    }

    /// The place that counts as zero: the reference point of axes that have made a reference run.
    #[must_use]
    pub fn origin(&self) -> Point {
        self.zero.map(Option::unwrap_or_default)
    }

    /// Whether places on an axis count from its reference point.
    #[must_use]
    pub fn is_referenced(&self, axis: usize) -> bool {
        self.zero.get(axis).is_some_and(Option::is_some)
    }

    /// The marks in order, with the end of the last motion.
    #[must_use]
    pub fn marks(&self) -> Vec<Mark> {
        let last = self.legs.last().map(|leg| Mark {
            kind: MarkKind::End,
            at: leg.ends,
            place: leg.to(),
            text: String::new(),
        });
        self.marks.iter().cloned().chain(last).collect()
    }

    /// How many marks were too many to be kept.
    #[must_use]
    pub fn marks_left_out(&self) -> usize {
        self.left_out
    }

    /// How many steps the path that is kept is beside the real one at the most: 0, unless there were
    /// so many motions that short ones were taken together.
    #[must_use]
    pub fn astray(&self) -> i64 {
        self.reach
    }

    /// The counters are these, and the carriages stand where they stood. When all reference runs are
    /// over, the counters of their axes count from the reference point.
    fn counters_are(&mut self, counters: &Point, are_over: bool) {
        if let Some(last) = self.counters {
            for axis in 0..AXES {
                self.shift[axis] += last[axis] - counters[axis];
                if are_over && std::mem::take(&mut self.referencing[axis]) {
                    self.zero[axis].get_or_insert(self.shift[axis]);
                }
            }
        }
        self.counters = Some(*counters);
    }

    /// Where the carriages are.
    fn place(&self, at: Time) -> Point {
        match &self.running {
            Some(running) => {
                let nanos = at.nanos_since(running.began);
                let made = running.over.steps_at(&running.segment, nanos);
                added(&running.from, &running.segment.path.at(made))
            }
            None => added(&self.counters.unwrap_or_default(), &self.shift),
        }
    }

    fn end(&mut self, at: Time, steps: Option<u64>) {
        let Some(Running { began, from, origin, segment, over, overrun, misses }) =
            self.running.take()
        else {
            return;
        };
        let seen = steps.map(|steps| steps.saturating_sub(over.steps));
        let made = seen.unwrap_or_else(|| over.steps_at(&segment, at.nanos_since(began)));
        let made = made.min(segment.path.length());
        let moved = segment.path.at(made);
        self.counters = Some(added(&origin, &moved));
        let is_reference = self.purpose == Purpose::Reference;
        for axis in (0..AXES).filter(|axis| is_reference && moved[*axis] != 0) {
            self.referencing[axis] = true;
        }
        if steps.is_some() && !is_reference && made < segment.path.length() {
            let place = added(&from, &moved);
            match self.marks.last_mut().filter(|last| last.kind.is_trouble() && last.at >= began) {
                // What has stopped it is known, and where and when it came to rest counts.
                Some(last) => {
                    (last.kind, last.at, last.place) = (last.kind.max(MarkKind::Stop), at, place);
                }
                None => self.mark(MarkKind::Stop, at, place, String::new()),
            }
        }
        if let Some(misses) = misses.filter(|_| made == segment.path.length()) {
            self.mark(MarkKind::Warning, at, added(&from, &moved), misses);
        }
        if made > 0 {
            self.motions += 1;
            let course = leg::Course::Made(segment);
            let purpose = self.purpose;
            self.legs.push(Leg { began, ends: at, from, course, made, over, purpose });
            // The controller does not know of this way, which takes none of its time.
            let made = overrun.iter().map(|steps| steps.unsigned_abs()).max().unwrap_or(0);
            if made > 0 {
                let (from, course) = (added(&from, &moved), leg::Course::Together(overrun));
                let (over, purpose) = (Over::default(), Purpose::Rapid);
                self.legs.push(Leg { began: at, ends: at, from, course, made, over, purpose });
            }
            if self.legs.len() >= self.most_legs {
                self.thin();
            }
        }
    }

    /// Takes neighbours together, further and further apart, until half of them are gone.
    fn thin(&mut self) {
        while self.legs.len() > self.most_legs / 2 && self.reach < 1 << 40 {
            self.reach = (self.reach * 2).max(1);
            let mut thinned: Vec<Leg> = Vec::with_capacity(self.legs.len());
            for leg in self.legs.drain(..) {
                match thinned.last_mut() {
                    Some(last) if last.takes(&leg, self.reach) => last.take(&leg),
                    _ => thinned.push(leg),
                }
            }
            self.legs = thinned;
        }
    }

    /// Marks something. What goes wrong at one instant is one thing, and its most telling kind counts.
    fn mark(&mut self, kind: MarkKind, at: Time, place: Point, text: String) {
        let is_full = self.marks.len() >= MOST_MARKS;
        let same = self.marks.last_mut().filter(|last| last.at == at);
        match same.filter(|last| kind.is_trouble() && last.kind.is_trouble()) {
            Some(last) => {
                last.kind = last.kind.max(kind);
                last.add(&text);
            }
            None if is_full => self.left_out += 1,
            None => self.marks.push(Mark { kind, at, place, text }),
        }
    }

    /// Why something went wrong: that belongs to what is marked here already, or is a mark of this kind.
    fn explain(&mut self, kind: MarkKind, at: Time, why: String) {
        let place = self.place(at);
        match self.marks.last_mut().filter(|last| last.place == place) {
            Some(last) if last.kind > MarkKind::Error && last.kind.is_trouble() => last.add(&why),
            _ => self.mark(kind, at, place, why),
        }
    }

    fn warned(&mut self, at: Time, warning: &Warning) {
        match warning {
            Warning::StepsLost { axis, steps, how, .. } => {
                let place = self.place(at);
                self.mark(MarkKind::Error, at, place, warning.to_string());
                if let (Loss::Overran, Some(running)) = (how, &mut self.running)
                    && let Some(overrun) = running.overrun.get_mut(usize::from(*axis))
                {
                    *overrun += steps;
                }
                if let Some(shift) = self.shift.get_mut(usize::from(*axis)) {
                    *shift += steps;
                }
            }
            Warning::ProgramError { .. } => {
                self.explain(MarkKind::Error, at, warning.to_string());
            }
            Warning::FalseReference { .. } | Warning::CounterWrapped { .. } => {
                self.explain(MarkKind::Warning, at, warning.to_string());
            }
            // It is told before the arc begins.
            Warning::OffCircle { .. } => self.misses = Some(warning.to_string()),
            _ => {}
        }
    }
}
