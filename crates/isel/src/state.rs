//! Everything that decides what a controller will do.

use std::collections::VecDeque;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::{Point, Segment, Time};
use vimc4_isel_wire::{AxisSet, BitTest, Direction, LineBuffer, Op, Plane, PortTest};
use vimc4_motion::{Path, Ramp};
use vimc4_plant::{Machine, Plant};

use crate::flash::Flash;
use crate::model::Model;
use crate::ports::{Output, Outputs};
use crate::settings::Settings;
use crate::why::{By, Opened};

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
    pub(crate) flash: Flash,
    pub(crate) powered: bool,
    /// The safety relay holds the power stage; only ON brings it back.
    pub(crate) relay: bool,
    pub(crate) baud: u32,
    pub(crate) receiver: Receiver,
    pub(crate) axes: AxisSet,
    /// The step counters, 24-bit two's complement.
    pub(crate) position: Point,
    pub(crate) referenced: AxisSet,
    /// The virtual zeros.
    pub(crate) zero: Point,
    /// Reference speeds in Hz.
    pub(crate) speeds: [u32; 4],
    pub(crate) ramp: Ramp,
    pub(crate) plane: Plane,
    pub(crate) direction: Direction,
    pub(crate) three_d: bool,
    pub(crate) test_mode: bool,
    pub(crate) device: u8,
    pub(crate) settings: Settings,
    pub(crate) outputs: Outputs,
    /// The axes whose limit switch error is latched.
    pub(crate) latched: AxisSet,
    /// The axes that have left their limit switch by `F` and were not referenced since.
    pub(crate) freed: AxisSet,
    /// What is left of a motion that was stopped in DNC mode.
    pub(crate) remainder: Option<Plan>,
    pub(crate) storing: bool,
    pub(crate) activity: Activity,
    pub(crate) run: Option<Run>,
}

/// The line, seen from inside.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Receiver {
    /// Bytes that wait while a command executes.
    pub(crate) waiting: VecDeque<u8>,
    /// The line that is being received.
    pub(crate) line: LineBuffer,
}

/// What the controller is doing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Activity {
    /// It waits for a command, or runs a program whose next line is due.
    Idle,
    /// A motion runs.
    Moving(Box<Moving>),
    /// A reference run, or an axis that leaves its switch.
    Referencing(Box<Referencing>),
    /// Nothing moves until a time.
    Waiting {
        /// What it waits for.
        what: Wait,
        /// Until when; `None` for as long as no input changes.
        until: Option<Time>,
    },
    /// The self-test has ended in its echo.
    Echo,
}

/// What the controller can wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Wait {
    /// The reset to be over.
    Boot,
    /// The controller to be ready after it was switched on.
    PowerUp,
    /// The flash memory to be erased by command.
    Erase,
    /// The flash memory to be erased by the panel.
    PanelErase,
    /// The delay of a program's line to be over.
    Delay,
    /// The least time of a program's line to be over.
    Line,
    /// A port of a program's conditional branch to change.
    Port,
    /// A character for a program's line.
    Character,
    /// Nothing: a line of a program branches to itself.
    Forever,
}

/// Who wants to know how a motion ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Job {
    /// The host: it gets an answer.
    Command(Op),
    /// The host, which had its answer before the motion began: at most an error is told it.
    Answered(Op),
    /// The program: it goes on.
    Program,
    /// The self-test: it goes on.
    SelfTest,
}

/// Motions that are still to come, one after the other, each with its own ramp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    /// Path and speed in Hz.
    pub(crate) parts: VecDeque<(Path, u32)>,
    /// The condition that ends them early.
    pub(crate) until: Option<PortCondition>,
}

/// A condition on a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum PortCondition {
    /// Of the command `Z`.
    Mask(PortTest),
    /// Of the program's command `6`.
    Bit(BitTest),
}

/// A running motion: a segment and its start, never a position and a last update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Moving {
    pub(crate) job: Job,
    pub(crate) segment: Segment,
    pub(crate) began: Time,
    /// The step at which the carriage runs onto a limit switch, and the axis.
    pub(crate) hit: Option<(u64, usize)>,
    /// The speed of the segment, for what is left of it.
    pub(crate) speed: u32,
    /// What comes after this segment.
    pub(crate) plan: Plan,
    /// What happens at the end of the segment instead of going on.
    pub(crate) ending: Ending,
}

/// What happens at the end of a segment, the softest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Ending {
    /// The next one begins, or the command is done.
    Complete,
    /// The motion was stopped: what is left is kept.
    Stop(By),
    /// The condition of the motion was met: what is left is forgotten.
    Event,
    /// The motion was broken off: what is left is forgotten.
    Break,
    /// The cover was opened: what is left is forgotten.
    Cover(Opened),
}

impl Ending {
    /// Whether it overrules another one. Of two that are alike, who came first has done it.
    pub(crate) fn is_harder_than(self, other: Ending) -> bool {
        let hardness = |ending| match ending {
            Ending::Complete => 0,
            Ending::Stop(_) => 1,
            Ending::Event => 2,
            Ending::Break => 3,
            Ending::Cover(_) => 4,
        };
        hardness(self) > hardness(other)
    }
}

/// Axes that look for their reference points, or one that leaves its switch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Referencing {
    pub(crate) job: Job,
    /// Whether this is a reference run; otherwise an axis just leaves its switch.
    pub(crate) whole: bool,
    /// The axes still to come after the present one, in order.
    pub(crate) next: VecDeque<u8>,
    pub(crate) axis: usize,
    pub(crate) phase: Phase,
    pub(crate) segment: Segment,
    pub(crate) began: Time,
    /// The step at which the phase ends, if the way leads there.
    pub(crate) goal: Option<u64>,
    /// The step at which the carriage runs onto the wrong switch.
    pub(crate) wrong: Option<u64>,
}

/// The phases of a reference run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// Towards the switch at the reference speed.
    Approach,
    /// Out of the switch at the start-stop frequency.
    StepOut,
    /// The free steps, at the reference speed.
    Free,
}

/// A running or stopped program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Run {
    /// Whether `S` began it or went on with it: then the host is told how it ends.
    pub(crate) by_command: bool,
    /// The line that is executed, or comes next.
    pub(crate) line: u32,
    /// When the present line began.
    pub(crate) began: Time,
    /// The open loops, outermost first.
    pub(crate) loops: Vec<OpenLoop>,
    /// The condition for the next motion.
    pub(crate) until: Option<BitTest>,
    /// What is left of a motion that was stopped.
    pub(crate) remainder: Option<Plan>,
    /// STOP was pressed or 253 received: the program halts before its next line.
    pub(crate) stopping: Option<By>,
    /// The program has halted and waits for START or `S`.
    pub(crate) paused: bool,
}

/// A loop whose block is being repeated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct OpenLoop {
    /// The line of the loop command.
    pub(crate) line: u32,
    /// How many more times the block runs.
    pub(crate) left: u32,
}

impl State {
    /// A controller that has just been switched on.
    pub(crate) fn new(model: Arc<Model>, machine: Arc<Machine>, flash: Flash) -> State {
        let settings = Settings::factory(&model, &machine);
        let mut state = State {
            version: VERSION,
            now: Time::ZERO,
            plant: Plant::new(machine),
            flash,
            powered: true,
            relay: true,
            baud: model.line.baud,
            receiver: Receiver::default(),
            axes: AxisSet::NONE,
            position: Point::default(),
            referenced: AxisSet::NONE,
            zero: Point::default(),
            speeds: settings.reference_speeds,
            ramp: Ramp { start_stop: settings.start_stop, acceleration: settings.acceleration },
            plane: Plane::Xy,
            direction: Direction::Clockwise,
            three_d: false,
            test_mode: false,
            device: 0,
            settings,
            outputs: Outputs::default(),
            latched: AxisSet::NONE,
            freed: AxisSet::NONE,
            remainder: None,
            storing: false,
            activity: Activity::Idle,
            run: None,
            model,
        };
        state.reset();
        state
    }

    /// The settings in the flash memory: until `IW` writes others, those of the delivery.
    pub(crate) fn kept_settings(&self) -> Settings {
        match &self.flash.settings {
            Some(kept) => Settings::clone(kept),
            None => Settings::factory(&self.model, self.plant.machine()),
        }
    }

    /// Everything as after power-on, except what the flash memory, the plant and the safety
    /// relay keep (99 2.2.21).
    pub(crate) fn reset(&mut self) {
        self.settings = self.kept_settings();
        self.baud = if self.settings.baud_9600 { 9_600 } else { self.model.line.baud };
        self.receiver = Receiver::default();
        self.axes = AxisSet::NONE;
        self.position = Point::default();
        self.referenced = AxisSet::NONE;
        self.test_mode = false;
        self.device = 0;
        self.storing = false;
        self.run = None;
        self.initialise();
        self.outputs = Outputs::default();
        self.outputs.set(Output::STAGE, self.relay);
        self.outputs.set(Output::SOFTWARE_OK, true);
        self.activity = match self.model.timing.boot_ms {
            0 => Activity::Idle,
            ms => {
                let until = self.now.after_nanos(ms.saturating_mul(1_000_000));
                Activity::Waiting { what: Wait::Boot, until: Some(until) }
            }
        };
    }

    /// What setting the axes does to everything but the axes: the values of every command that
    /// holds until further notice go back to their defaults. Positions and reference points
    /// are kept.
    pub(crate) fn initialise(&mut self) {
        self.three_d = false;
        self.plane = Plane::Xy;
        self.direction = Direction::Clockwise;
        self.speeds = self.settings.reference_speeds;
        self.ramp =
            Ramp { start_stop: self.settings.start_stop, acceleration: self.settings.acceleration };
        self.zero = Point::default();
        self.latched = AxisSet::NONE;
        self.freed = AxisSet::NONE;
        self.remainder = None;
    }

    /// The motors have current: the power stages are enabled and can be on.
    pub(crate) fn motors_on(&self) -> bool {
        self.can_power_motors() && self.outputs.get(Output::STAGE)
    }

    /// The power stages can be switched on: there is power, the safety relay holds, and supply
    /// and temperature are good.
    pub(crate) fn can_power_motors(&self) -> bool {
        let panel = self.plant.panel();
        self.powered && self.relay && panel.power_ok && !panel.overtemperature
    }

    /// The outputs as they are driven: a power stage that is off is not shown on.
    pub(crate) fn driven(&self) -> Outputs {
        let mut driven = self.outputs;
        driven.set(Output::STAGE, self.motors_on());
        driven
    }

    /// The cover forbids motion: open with the key on automatic.
    pub(crate) fn cover_forbids(&self) -> bool {
        let panel = self.plant.panel();
        !panel.cover_closed && panel.automatic
    }

    /// A program runs and is not halted.
    pub(crate) fn is_running(&self) -> bool {
        self.run.as_ref().is_some_and(|run| !run.paused)
    }

    /// +1 or -1: the direction of the carriage for a positive step of the counter.
    pub(crate) fn carriage_sign(&self, axis: usize) -> i64 {
        let inverted = self.plant.machine().axis(axis).inverted;
        if inverted == self.settings.directions.has(axis) { 1 } else { -1 }
    }
}
