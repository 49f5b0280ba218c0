//! Everything that decides what a controller will do.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::{AXES, Point, Segment, Time};
use vimc4_motion::{Path, Stretch};
use vimc4_plant::{End, Machine, Plant};

use crate::channel::Unit;
use crate::interface::Ball;
use crate::language::{Axis, Command, Reader, Status, Vector};
use crate::model::{InitEcho, Model};
use crate::settings::Settings;
use crate::why::Why;

/// The version of the state's layout, for states that are kept.
pub(crate) const VERSION: u32 = 1;

/// The whole state of a controller and its machine. Two equal states that get the same inputs
/// do the same; nothing is left out of the comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(crate) version: u32,
    pub(crate) now: Time,
    pub(crate) model: Arc<Model>,
    pub(crate) plant: Plant,
    pub(crate) powered: bool,
    /// What the line has brought of a command that is not complete.
    pub(crate) reader: Reader,
    pub(crate) buffer: Buffer,
    pub(crate) settings: Settings,
    /// The counters: where the axes should be.
    pub(crate) position: Point,
    /// Where the carriages stand when the counters are 0.
    pub(crate) origin: Point,
    pub(crate) referenced: [bool; AXES],
    pub(crate) head_down: bool,
    pub(crate) spindle: bool,
    pub(crate) half_current: bool,
    /// What was written to each port.
    pub(crate) ports: BTreeMap<u8, u8>,
    /// The command that executes.
    pub(crate) job: Option<Job>,
    /// The command that was executed last.
    pub(crate) last: Option<Command>,
    /// `!ST` has come: no other command begins when the present one has ended.
    pub(crate) stop_requested: bool,
    /// Nothing is executed until `!GO`, and why.
    pub(crate) stopped: Option<Stop>,
    /// The command that was broken off.
    pub(crate) broken: Option<Broken>,
    /// Faults that are set from outside, by code.
    pub(crate) faults: BTreeSet<u8>,
    /// The measured positions at the last trigger.
    pub(crate) triggered: Option<Point>,
    pub(crate) unit: Unit,
    pub(crate) ball: Ball,
}

/// Commands that wait, as they came.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Buffer {
    pub(crate) waiting: VecDeque<Entry>,
    /// How many bytes they have.
    pub(crate) bytes: usize,
    /// Commands are being lost, which has been said.
    pub(crate) overrun: bool,
}

/// One thing that waits for its turn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Entry {
    /// A command, or why it is none.
    Command {
        /// As it was written.
        raw: Bytes,
        /// What it means.
        command: Result<Command, Status>,
    },
    /// Bytes for the unit on the second channel.
    Through(Vec<u8>),
}

impl Buffer {
    /// How many commands wait.
    pub(crate) fn commands(&self) -> usize {
        self.waiting.iter().filter(|entry| matches!(entry, Entry::Command { .. })).count()
    }
}

impl Entry {
    /// How many bytes of the buffer it takes.
    pub(crate) fn size(&self) -> usize {
        match self {
            Entry::Command { raw, .. } => raw.len(),
            Entry::Through(bytes) => bytes.len(),
        }
    }
}

/// Why nothing is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Stop {
    /// `!ST`: commands go on waiting.
    Command,
    /// The external stop.
    External,
    /// A limit switch, or something at the power stages.
    Limit,
    /// The border of the window or of a range.
    SoftFrame,
    /// A message interrupt.
    Message,
}

/// A command that executes: what it is still to do, and what it does now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Job {
    pub(crate) command: Command,
    /// Where the counters were when it began.
    pub(crate) start: Point,
    pub(crate) stages: VecDeque<Stage>,
    /// The stage that it is at.
    pub(crate) stage: Option<Stage>,
    pub(crate) activity: Activity,
    /// Nobody asked for it by a command: it is not answered.
    pub(crate) silent: bool,
    /// What `OH` has found so far, by axis.
    pub(crate) found: [i64; AXES],
}

/// A command that was broken off, with what was left of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Broken {
    pub(crate) command: Command,
    /// Where the counters were when it began.
    pub(crate) start: Point,
    /// Where they were when it was broken off.
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
    /// Along what is left of a motion that was broken off, at this speed and acceleration.
    Rest(Vec<Link>, u64, u64),
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
    /// Here is the reference point of an axis.
    Zero(Axis),
    /// Here is the end of an axis: `OH` has found it.
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

/// A part of a path, and how long it is in the world, in stretches of even pace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Link {
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
    pub(crate) links: Vec<Link>,
    pub(crate) pace: (u64, u64),
    /// The step after which something happens before the end of the path, and what.
    pub(crate) event: Option<(u64, Meeting)>,
    /// The motion stops at a border that it would have left.
    pub(crate) border: Option<(Axis, End)>,
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

impl State {
    /// A controller that has just been switched on.
    pub(crate) fn new(model: Arc<Model>, machine: Arc<Machine>) -> State {
        let plant = Plant::new(machine);
        let mut state = State {
            version: VERSION,
            now: Time::ZERO,
            powered: true,
            reader: State::unread(&model),
            buffer: Buffer::default(),
            settings: Settings::new(&model, plant.machine()),
            position: [0; AXES],
            origin: plant.carriage(),
            referenced: [false; AXES],
            head_down: false,
            spindle: false,
            half_current: false,
            ports: BTreeMap::new(),
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
        };
        state.home();
        state
    }

    /// A line on which nothing has arrived yet.
    pub(crate) fn unread(model: &Model) -> Reader {
        Reader::new(model.grammar())
    }

    /// The power is back: everything begins anew but the carriages, which are where they are.
    pub(crate) fn switched_on(&mut self) {
        self.reader = State::unread(&self.model);
        self.buffer = Buffer::default();
        self.initialise();
        self.settings.echo = self.model.defaults.echo;
        self.position = [0; AXES];
        self.referenced = [false; AXES];
        self.origin = self.plant.carriage();
        self.home();
    }

    /// A machine that homes by itself makes a reference run that no command asked for.
    fn home(&mut self) {
        let stages = self.homing_stages();
        if !stages.is_empty() {
            self.job = Some(Job {
                command: Command::Initialize,
                start: self.position,
                stages,
                stage: None,
                activity: Activity::Between,
                silent: true,
                found: [0; AXES],
            });
        }
    }

    /// Everything as after power-on (`IN`), except where the axes are and what the line brings:
    /// what has come behind `IN` waits for its turn.
    pub(crate) fn initialise(&mut self) {
        self.settings = Settings::new(&self.model, self.plant.machine());
        self.settings.echo = self.model.quirks.init_echo == InitEcho::On;
        self.head_down = false;
        self.spindle = false;
        self.half_current = false;
        self.ports.clear();
        self.last = None;
        self.stop_requested = false;
        self.stopped = None;
        self.broken = None;
        self.triggered = None;
        self.unit = Unit { fault: self.unit.fault, ..Unit::default() };
        self.ball = Ball { axis: self.ball.axis, ..Ball::default() };
    }

    /// Whether an axis is there: the controller can drive it and the machine has it.
    pub(crate) fn is_fitted(&self, axis: Axis) -> bool {
        axis.index() < self.model.axes && self.plant.machine().fits(axis.index())
    }

    /// The axes that are there.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = Axis> + '_ {
        Axis::ALL.into_iter().filter(|axis| self.is_fitted(*axis))
    }

    /// +1 or -1: the direction of the carriage for a positive step of the counter.
    pub(crate) fn carriage_sign(&self, axis: usize) -> i64 {
        if self.plant.machine().axis(axis).inverted { -1 } else { 1 }
    }

    /// Where the axes really are, as a measuring system counts it: without the steps that were
    /// lost.
    pub(crate) fn actual(&self) -> Point {
        let carriage = self.plant.carriage();
        std::array::from_fn(|axis| self.carriage_sign(axis) * (carriage[axis] - self.origin[axis]))
    }
}
