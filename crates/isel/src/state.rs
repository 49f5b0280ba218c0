//! Everything that decides what a controller will do.

use std::collections::VecDeque;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::{Activity as Doing, CommandNumber, Point, Time};
use vimc4_isel_wire::{AxisSet, BitTest, Context, Direction, LineBuffer, Plane};
use vimc4_motion::{Ramp, Running};
use vimc4_plant::{Machine, Plant, Slide, Way};

use crate::activity::{Activity, Plan, Wait};
use crate::flash::Flash;
use crate::model::{AfterFree, AxisCodes, Model, StopButton};
use crate::settings::Settings;
use crate::why::{By, Off};
use crate::wiring::{Output, Outputs};

/// The whole state of a controller and its machine. Two equal states with the same inputs behave
/// the same; nothing is left out of the comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
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
    /// The last command that was taken from the line.
    pub(crate) last_command: Option<CommandNumber>,
    /// The command that is executed or caused the present activity; `None` if a button or a reset
    /// began or continued it.
    pub(crate) command: Option<CommandNumber>,
}

/// The serial line as the controller sees it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Receiver {
    /// Bytes that wait while a command executes.
    pub(crate) waiting: VecDeque<u8>,
    /// The line that is being received.
    pub(crate) line: LineBuffer,
}

/// A running or stopped program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Run {
    /// Whether `S` began or continued it: then the host is told how it ends.
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

    /// The same with what another has in its flash memory, as if the chip had been changed: settings in
    /// it count when it is switched on the next time.
    #[must_use]
    pub fn with_memory_of(&self, other: &State) -> State {
        State { flash: other.flash.clone(), run: None, storing: false, ..self.clone() }
    }

    /// A controller that has just been switched on.
    pub(crate) fn new(model: Arc<Model>, machine: Arc<Machine>, flash: Flash) -> State {
        let settings = Settings::factory(&model, &machine);
        let mut state = State {
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
            last_command: None,
            command: None,
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
        self.axes = match self.model.quirks.axis_codes {
            AxisCodes::Keep => AxisSet::of(0),
            _ => AxisSet::NONE,
        };
        self.position = Point::default();
        self.referenced = AxisSet::NONE;
        self.test_mode = false;
        self.device = 0;
        self.storing = false;
        self.run = None;
        self.command = None;
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

    /// How a line is read now.
    pub(crate) fn context(&self, line: Option<u32>) -> Context<'_> {
        self.model.context(self.axes, line)
    }

    // --- the axes ---

    /// +1 or -1: the direction of the carriage for a positive step of the counter.
    pub(crate) fn carriage_sign(&self, axis: usize) -> i64 {
        let inverted = self.plant.machine().axis(axis).inverted;
        if inverted == self.settings.directions.has(axis) { 1 } else { -1 }
    }

    /// The same for all axes.
    pub(crate) fn carriage_signs(&self) -> Point {
        std::array::from_fn(|axis| self.carriage_sign(axis))
    }

    /// The running segment.
    pub(crate) fn running(&self) -> Option<Running<'_>> {
        let (segment, began) = match &self.activity {
            Activity::Moving(moving) => (&moving.segment, moving.began),
            Activity::Referencing(run) => (&run.segment, run.began),
            _ => return None,
        };
        Some(Running { segment, began })
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

    /// The axes no longer know where they are.
    pub(crate) fn unreference(&mut self, axes: AxisSet) {
        self.referenced = self.referenced.without(axes);
    }

    // --- the panel and the power stages ---

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

    /// Why the motors have no current now.
    pub(crate) fn why_off(&self) -> Off {
        let panel = self.plant.panel();
        match self.relay {
            _ if panel.emergency_stop => Off::EmergencyStop,
            _ if !panel.power_ok => Off::Supply,
            _ if panel.overtemperature => Off::Heat,
            false => Off::Relay,
            true => Off::Switched,
        }
    }

    /// The cover forbids motion: open with the key on automatic.
    pub(crate) fn cover_forbids(&self) -> bool {
        let panel = self.plant.panel();
        !panel.cover_closed && panel.automatic
    }

    /// STOP is held, and no move makes a step as long as it is.
    pub(crate) fn is_stop_held(&self) -> bool {
        self.model.quirks.stop_button == StopButton::Held && self.plant.panel().stop
    }

    // --- the present activity ---

    /// What the controller is doing, or why it refuses moves.
    pub(crate) fn shown_activity(&self) -> Doing {
        match self.doing() {
            Doing::Idle if !self.latched.is_empty() => Doing::LimitError,
            Doing::Idle if self.waits_for_reference() => Doing::NeedsReference,
            Doing::Idle if !self.motors_on() || self.cover_forbids() => Doing::CannotMove,
            doing => doing,
        }
    }

    /// Whether an axis that has left its limit switch must make a reference run before any other
    /// motion (12 2.2.9).
    pub(crate) fn waits_for_reference(&self) -> bool {
        let needed = self.model.quirks.after_free == AfterFree::Reference;
        needed && !self.test_mode && !self.freed.is_empty()
    }

    /// What the controller is doing.
    pub(crate) fn doing(&self) -> Doing {
        if !self.powered {
            return Doing::Off;
        }
        match &self.activity {
            Activity::Moving(moving) => moving.job.moving(),
            Activity::Referencing(run) => run.doing(),
            Activity::Waiting { what, .. } => match what {
                Wait::Boot | Wait::PowerUp => Doing::StartingUp,
                Wait::Erase | Wait::PanelErase => Doing::Erasing,
                Wait::Delay => Doing::ProgramDelay,
                Wait::Line => Doing::ProgramLine,
                Wait::Port => Doing::ProgramWaitsForPort,
                Wait::Character => Doing::ProgramWaitsForCharacter,
                Wait::Forever => Doing::ProgramHaltedOnItself,
            },
            Activity::Echo => Doing::Echo,
            Activity::Idle if self.storing => Doing::Storing,
            Activity::Idle if self.run.is_some() => Doing::ProgramStopped,
            Activity::Idle => Doing::Idle,
        }
    }

    /// A program runs and is not halted.
    pub(crate) fn is_running(&self) -> bool {
        self.run.as_ref().is_some_and(|run| !run.paused)
    }

    /// Nothing executes and no program runs.
    pub(crate) fn is_at_rest(&self) -> bool {
        matches!(self.activity, Activity::Idle) && !self.is_running()
    }

    /// Nothing happens by itself.
    pub(crate) fn is_idle(&self) -> bool {
        let rests = matches!(self.activity, Activity::Idle | Activity::Echo);
        rests && !self.is_running() && !self.has_waiting() && !self.plant.bounces()
    }

    /// Whether something in the receive buffer is due.
    pub(crate) fn has_waiting(&self) -> bool {
        let takes = || self.is_at_rest() || matches!(self.activity, Activity::Echo);
        !self.receiver.waiting.is_empty() && takes()
    }

    /// When the next contact changes that bounces.
    pub(crate) fn contact_due(&self) -> Option<Time> {
        if !self.plant.has_faults() {
            return None;
        }
        let due = self.plant.next_contact(self.running(), &self.carriage_signs(), self.now)?;
        Some(due.max(self.now))
    }

    /// The same, if that is not after `at`, and not after the end of what is under way.
    pub(crate) fn contact_due_by(&self, at: Time) -> Option<Time> {
        let due = self.contact_due().filter(|due| *due <= at)?;
        self.deadline().is_none_or(|end| due <= end).then_some(due)
    }

    /// When a carriage changes a limit switch next.
    pub(crate) fn switch_due(&self) -> Option<Time> {
        self.plant.switch_due(self.running())
    }

    /// The same, if that is not after `at`, and nothing else is due before it.
    pub(crate) fn switch_due_by(&self, at: Time) -> Option<Time> {
        let due = self.switch_due().filter(|due| *due <= at)?;
        let others = self.deadline().into_iter().chain(self.contact_due());
        others.into_iter().all(|other| due <= other).then_some(due)
    }

    /// When the present activity ends. Only one runs at a time.
    pub(crate) fn deadline(&self) -> Option<Time> {
        let due = match &self.activity {
            Activity::Idle | Activity::Echo => return None,
            Activity::Moving(moving) => moving.due(),
            Activity::Referencing(run) => run.due(),
            Activity::Waiting { until, .. } => (*until)?,
        };
        (due != Time::NEVER).then_some(due)
    }

    /// The same, if it is not after `at`. What begins at an instant does not end at it, so that
    /// case is not computed.
    pub(crate) fn due_by(&self, at: Time) -> Option<Time> {
        match &self.activity {
            Activity::Idle | Activity::Echo => None,
            Activity::Moving(moving) if at <= moving.began => None,
            Activity::Waiting { until: Some(until), .. } if *until > at => None,
            _ => self.deadline().filter(|due| *due <= at),
        }
    }

    /// When the next cause is due.
    pub(crate) fn wake(&self) -> Option<Time> {
        if self.has_waiting() {
            return Some(self.now);
        }
        [self.deadline(), self.contact_due(), self.switch_due()].into_iter().flatten().min()
    }

    /// A new motion drops the remainder of an older one.
    pub(crate) fn forget_stopped_motion(&mut self) {
        self.remainder = None;
        self.run = None;
    }

    /// A command has been taken from the line: what happens now belongs to it.
    pub(crate) fn number_command(&mut self) {
        let next = self.last_command.map_or(CommandNumber::FIRST, CommandNumber::next);
        self.last_command = Some(next);
        self.command = self.last_command;
    }

    /// If no activity is left, what happens next belongs to no command.
    pub(crate) fn command_ended(&mut self) {
        if self.is_at_rest() || matches!(self.activity, Activity::Echo) {
            self.command = None;
        }
    }
}
