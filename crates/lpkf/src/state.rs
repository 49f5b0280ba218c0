//! Everything that decides what a controller will do.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::{AXES, CommandNumber, Point, Segment, Time};
use vimc4_motion::{Path, Running, Stretch};
use vimc4_plant::{End, Machine, Plant, Slide, Unit as AxisUnit, Way};

use crate::buffer::Buffer;
use crate::channel::Unit;
use crate::language::{Axis, Command, Dialect, Reader, Side, Status, Vector};
use crate::model::{InitEcho, Model};
use crate::ports::Outputs;
use crate::settings::Settings;
use crate::trackball::Ball;
use crate::why::{Stop, Why};

/// The whole state of a controller and its machine. Two equal states with the same inputs behave
/// the same; nothing is left out of the comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(crate) now: Time,
    pub(crate) model: Arc<Model>,
    pub(crate) plant: Plant,
    pub(crate) powered: bool,
    /// The received part of an incomplete command.
    pub(crate) reader: Reader,
    pub(crate) buffer: Buffer,
    /// The number of the command that was taken from the line last.
    pub(crate) number: Option<CommandNumber>,
    pub(crate) settings: Settings,
    /// The counters: where the axes should be.
    pub(crate) position: Point,
    /// Where the carriages stand when the counters are 0.
    pub(crate) origin: Point,
    pub(crate) referenced: [bool; AXES],
    pub(crate) outputs: Outputs,
    /// The command that executes.
    pub(crate) job: Option<Task>,
    /// The command that was executed last.
    pub(crate) last: Option<Command>,
    /// `!ST` has come: no other command begins when the present one has ended.
    pub(crate) stop_requested: bool,
    /// Nothing is executed until `!GO`, and why.
    pub(crate) stopped: Option<Stop>,
    /// The aborted command.
    pub(crate) broken: Option<Broken>,
    /// Faults that are set from outside, by code.
    pub(crate) faults: BTreeSet<u8>,
    /// The measured positions at the last trigger.
    pub(crate) triggered: Option<Point>,
    pub(crate) unit: Unit,
    pub(crate) ball: Ball,
}

/// A command that executes: what it is still to do, and what it does now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Task {
    pub(crate) command: Command,
    /// Where the counters were when it began.
    pub(crate) start: Point,
    pub(crate) stages: VecDeque<Stage>,
    /// The stage that it is at.
    pub(crate) stage: Option<Stage>,
    pub(crate) activity: Activity,
    /// The number of the command; none if no command asked for it, so that it is not answered.
    pub(crate) number: Option<CommandNumber>,
    /// What `OH` has found so far, by axis.
    pub(crate) found: [i64; AXES],
}

/// An aborted command, with what was left of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Broken {
    pub(crate) command: Command,
    /// Where the counters were when it began.
    pub(crate) start: Point,
    /// Where they were when it was aborted.
    pub(crate) end: Point,
    pub(crate) stages: VecDeque<Stage>,
}

/// One part of what a command does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Stage {
    /// Straight to a place.
    To(Point),
    /// Round a centre (X and Y, absolute, steps) by millionths of a degree.
    Arc([i64; 2], i64),
    /// Along vectors on two axes without a halt.
    Vectors([Axis; 2], Vec<Vector>),
    /// Along the rest of an aborted motion, at this speed and acceleration.
    Rest(Vec<ChainLink>, u64, u64),
    /// Nothing, for this many ns.
    Wait(Pause, u64),
    /// The head goes down or up.
    Head(bool),
    /// An axis drives onto a limit switch, at steps a second.
    Onto(Axis, End, u32),
    /// An axis drives off a limit switch, at steps a second.
    Off(Axis, End, u32),
    /// An axis goes by a few steps at steps a second.
    Free(Axis, i64, u32),
    /// Sets the reference point of an axis here.
    Zero(Axis),
    /// Sets the end of an axis here: `OH` has found it.
    Found(Axis),
    /// An axis goes back to 0 at the speed that was set last.
    Return(Axis),
    /// What `OH` has found is sent.
    HardClipLimits(Option<Axis>),
}

/// Why nothing happens for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Pause {
    /// Before or after the head goes down or up.
    Head,
    /// After a move.
    Settling,
    /// `!TW`.
    Once,
}

/// A part of a path, and its real length, in stretches of even pace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ChainLink {
    pub(crate) path: Path,
    pub(crate) stretches: Vec<Stretch>,
}

/// What a command does now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Activity {
    /// It is about to begin its next stage.
    Between,
    /// It moves.
    Moving(Box<Moving>),
    /// It waits.
    Waiting(Pause, Time),
}

/// A running motion: a segment and its start, never a position and a last update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Moving {
    pub(crate) segment: Segment,
    pub(crate) began: Time,
    /// The parts of the path, for what is left of it, and speed and acceleration for that.
    pub(crate) links: Vec<ChainLink>,
    pub(crate) pace: (u64, u64),
    /// The step after which something happens before the end of the path, and what.
    pub(crate) event: Option<(u64, Meeting)>,
    /// The motion stops at a border that it would have left.
    pub(crate) border: Option<(Axis, Side)>,
    /// It brakes, and why.
    pub(crate) braking: Option<(Stop, Why)>,
}

/// What a motion can meet on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Meeting {
    /// A limit switch that it must not.
    Limit(Axis, End),
    /// The edge of the switch that it looks for.
    Edge,
}

/// What an axis is driven for: to be on a limit switch, or off it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sought {
    pub(crate) axis: Axis,
    pub(crate) end: End,
    pub(crate) onto: bool,
}

impl Task {
    /// What it looks for at present.
    pub(crate) fn sought(&self) -> Option<Sought> {
        match self.stage {
            Some(Stage::Onto(axis, end, _)) => Some(Sought { axis, end, onto: true }),
            Some(Stage::Off(axis, end, _)) => Some(Sought { axis, end, onto: false }),
            _ => None,
        }
    }

    /// A command that is about to do these things, one after the other.
    pub(crate) fn new(
        command: Command,
        number: Option<CommandNumber>,
        start: Point,
        stages: VecDeque<Stage>,
    ) -> Task {
        let (stage, activity, found) = (None, Activity::Between, [0; AXES]);
        Task { command, start, stages, stage, activity, number, found }
    }
}

impl Moving {
    /// When it ends, by itself or because of what it meets.
    pub(crate) fn due(&self) -> Time {
        let profile = &self.segment.profile;
        let nanos = match self.event {
            Some((step, _)) if step <= profile.steps() => profile.time_of(step),
            _ => profile.duration(),
        };
        self.began.after_nanos(nanos)
    }

    /// How many steps have been made at `now`.
    pub(crate) fn steps_at(&self, now: Time) -> u64 {
        self.segment.profile.steps_at(now.nanos_since(self.began))
    }
}

impl State {
    /// The names of its model and its machine.
    #[must_use]
    pub fn profile_names(&self) -> (&str, &str) {
        (&self.model.name, &self.plant.machine().name)
    }

    /// The same with the model and the machine of another.
    #[must_use]
    pub fn with_profiles_of(&self, other: &State) -> State {
        let plant = self.plant.on_machine_of(&other.plant);
        State { model: Arc::clone(&other.model), plant, ..self.clone() }
    }

    /// The same: there is no memory that keeps anything.
    #[must_use]
    pub fn with_memory_of(&self, _: &State) -> State {
        self.clone()
    }

    /// A controller that has just been switched on, and has not begun anything yet.
    pub(crate) fn new(model: Arc<Model>, machine: Arc<Machine>) -> State {
        let plant = Plant::new(machine);
        State {
            now: Time::ZERO,
            powered: true,
            reader: Reader::new(model.grammar()),
            buffer: Buffer::default(),
            number: None,
            settings: Settings::new(&model, plant.machine()),
            position: [0; AXES],
            origin: plant.carriage(),
            referenced: [false; AXES],
            outputs: Outputs::default(),
            job: None,
            last: None,
            stop_requested: false,
            stopped: None,
            broken: None,
            faults: BTreeSet::new(),
            triggered: None,
            unit: Unit::default(),
            ball: Ball::default(),
            plant,
            model,
        }
    }

    /// The power is back: everything begins anew but the carriages, which are where they are.
    pub(crate) fn switched_on(&mut self) {
        self.reader = Reader::new(self.model.grammar());
        self.buffer = Buffer::default();
        self.initialise();
        self.settings.echo = self.model.defaults.echo;
        self.position = [0; AXES];
        self.referenced = [false; AXES];
        self.origin = self.plant.carriage();
    }

    /// Everything as after power-on (`IN`), except the positions and the input of the line: what
    /// came after `IN` waits for its turn.
    pub(crate) fn initialise(&mut self) {
        self.settings = Settings::new(&self.model, self.plant.machine());
        self.settings.echo = self.model.quirks.init_echo == InitEcho::On;
        self.outputs = Outputs::default();
        self.last = None;
        self.stop_requested = false;
        self.stopped = None;
        self.broken = None;
        self.triggered = None;
        self.unit.reset();
        self.ball.close();
    }

    // --- the executing command ---

    /// When what the command does now ends by itself.
    pub(crate) fn job_due(&self) -> Option<Time> {
        match &self.job.as_ref()?.activity {
            Activity::Between => Some(self.now),
            Activity::Moving(moving) => Some(moving.due()),
            Activity::Waiting(_, until) => Some(*until),
        }
    }

    /// What the command does from now on.
    pub(crate) fn set_activity(&mut self, activity: Activity) {
        if let Some(job) = &mut self.job {
            job.activity = activity;
        }
    }

    /// The running motion.
    pub(crate) fn moving(&self) -> Option<&Moving> {
        match &self.job.as_ref()?.activity {
            Activity::Moving(moving) => Some(moving),
            Activity::Between | Activity::Waiting(..) => None,
        }
    }

    /// The running segment.
    pub(crate) fn running(&self) -> Option<Running<'_>> {
        self.moving().map(|moving| Running { segment: &moving.segment, began: moving.began })
    }

    // --- axes ---

    /// Whether it is an SMCU, not a MotionSystem.
    pub(crate) fn is_smcu(&self) -> bool {
        self.model.command_set == Dialect::Smcu
    }

    /// What an axis is called: the one Z of an SMCU has no number.
    pub(crate) fn axis_name(&self, axis: Axis) -> &'static str {
        match axis {
            Axis::Z0 if self.is_smcu() => "Z",
            axis => axis.name(),
        }
    }

    /// Whether an axis is there: the controller can drive it and the machine has it.
    pub(crate) fn is_fitted(&self, axis: Axis) -> bool {
        axis.index() < self.model.axes && self.plant.machine().fits(axis.index())
    }

    /// The axes that exist.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = Axis> + '_ {
        Axis::ALL.into_iter().filter(|axis| self.is_fitted(*axis))
    }

    /// Whether an axis turns.
    pub(crate) fn is_rotary(&self, axis: Axis) -> bool {
        self.plant.machine().axis(axis.index()).unit == AxisUnit::Rotary
    }

    /// +1 or -1: the direction of the carriage for a positive step of the counter.
    pub(crate) fn carriage_sign(&self, axis: usize) -> i64 {
        if self.plant.machine().axis(axis).inverted { -1 } else { 1 }
    }

    /// The same for all axes.
    pub(crate) fn carriage_signs(&self) -> Point {
        std::array::from_fn(|axis| self.carriage_sign(axis))
    }

    /// Where the carriage of an axis is at a time, in motion or not.
    pub(crate) fn carriage_at(&self, axis: usize, at: Time) -> i64 {
        self.slide_at(axis, at).place()
    }

    /// An axis at a time, in motion or not.
    pub(crate) fn slide_at(&self, axis: usize, at: Time) -> Slide {
        match self.running() {
            None => self.plant.slide(axis),
            Some(running) => {
                let way = Way { path: &running.segment.path, signs: &self.carriage_signs() };
                self.plant.slide_after(axis, &way, running.steps_at(at))
            }
        }
    }

    /// Which end of the counter's range an end of the carriage's travel is.
    pub(crate) fn side(&self, axis: Axis, end: End) -> Side {
        match (end, self.carriage_sign(axis.index())) {
            (End::Negative, 1) | (End::Positive, -1) => Side::Negative,
            _ => Side::Positive,
        }
    }

    // --- places ---

    /// The position, as the status wants it, of an axis that runs onto a limit switch or whose
    /// switch is pressed by hand.
    pub(crate) fn on_limit(&self, axis: Axis, end: End, by_hand: bool) -> Why {
        let at = self.position[axis.index()];
        Why::Limit { axis, side: self.side(axis, end), at, by_hand }
    }

    /// Where the axes are now, as a measuring system sees it: without the lost steps.
    pub(crate) fn actual_now(&self) -> Point {
        std::array::from_fn(|axis| {
            self.carriage_sign(axis) * (self.carriage_at(axis, self.now) - self.origin[axis])
        })
    }

    /// The place of the axis that the trackball moves is sent.
    pub(crate) fn report_ball(&mut self) -> Bytes {
        let place = self.actual_now().get(usize::from(self.ball.axis)).copied();
        self.ball.report_place(place.unwrap_or(0), self.now)
    }

    // --- faults ---

    /// The fault because of which nothing can move, if there is one.
    pub(crate) fn standing_fault(&self) -> Option<Status> {
        let mut faults = self.faults.iter().filter_map(|code| Status::from_code(*code));
        faults.find(|status| status.forbids_motion())
    }
}
