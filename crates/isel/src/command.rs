//! Executing direct commands.

use bytes::Bytes;
use vimc4_device::{Event, Kinds, Warning};
use vimc4_isel_wire::{Addressed, AxisSet, Command, Init, Mode, Op, Reply, parse};

use crate::Controller;
use crate::model::{ControlReply, LowerCase};
use crate::ports::Output;
use crate::settings::Settings;
use crate::state::{Activity, Job, Wait};
use crate::why::Why;

impl Controller {
    /// Executes a line from the serial line.
    pub(crate) fn execute_line(&mut self, text: &[u8]) {
        if self.state.storing {
            self.store_line(text);
            return;
        }
        let dialect = self.state.model.command_set.dialect();
        let capital = self.capital(text);
        let line = capital.as_deref().unwrap_or(text);
        match parse(line, dialect, Mode::Direct, self.state.device) {
            Ok(Addressed::OtherDevice) => self.pass_over(text),
            Err(fault) => {
                self.announce("?", text);
                self.refuse_line("?", fault.into(), line, Mode::Direct);
            }
            Ok(Addressed::Frame(frame)) => {
                let op = frame.op();
                self.announce(frame.spec().mnemonic, text);
                match self.admit(&frame) {
                    Ok(command) if capital.is_some() => {
                        self.done(Mode::Direct, op);
                        self.perform(op, command, Job::Answered(op));
                    }
                    Ok(command) => self.perform(op, command, Job::Command(op)),
                    Err(why) => {
                        self.refuse_line(frame.spec().mnemonic, why, line, Mode::Direct);
                    }
                }
            }
        }
    }

    /// Answers a line that is longer than any command.
    pub(crate) fn refuse_long_line(&mut self) {
        self.announce("?", b"");
        if self.state.storing {
            self.invalidate_program();
        }
        self.refuse_line("?", Why::TooLong, b"", Mode::Direct);
    }

    /// Executes a command. A motion does what it does as `job`.
    fn perform(&mut self, op: Op, command: Command, job: Job) {
        let done = match command {
            Command::RelativeMove(_)
            | Command::AbsoluteMove(_)
            | Command::Circle(_)
            | Command::Helix(..)
            | Command::MoveUntil { .. } => {
                self.forget_stopped_motion();
                let plan = self.plan_of(&command);
                return self.begin_plan(job, plan);
            }
            Command::Reference(axes) => {
                self.forget_stopped_motion();
                return self.begin_reference(job, axes);
            }
            Command::Free(axes) => {
                self.forget_stopped_motion();
                return self.begin_free(job, axes);
            }
            Command::Start => return self.start_command(job),
            Command::SelfTest => {
                self.forget_stopped_motion();
                return self.begin_self_test();
            }
            Command::Position => self.position_report(),
            Command::ReadPort(port) => self.hex_report(self.read_port(port)),
            Command::Diagnosis(code) => match self.diagnosis_report(code) {
                Some(report) => report,
                None => return self.refuse(Mode::Direct, op, Why::NoDiagnosis(code)),
            },
            Command::Status => self.status_report(),
            Command::LimitStatus => self.limit_report(),
            Command::Version => self.version_report(),
            Command::UserInfo => self.user_report(),
            Command::SetAxes(axes) => {
                // The A axis is always configured apart, and adds to what is there (99 2.2.1).
                let kept = if axes == AxisSet::A { self.state.axes } else { AxisSet::NONE };
                self.state.axes = kept.union(axes);
                self.state.initialise();
                self.state.run = None;
                Reply::Done.into()
            }
            Command::DeviceNumber(number) => {
                self.state.device = number;
                Reply::Done.into()
            }
            Command::Store => {
                self.begin_storing();
                Reply::Done.into()
            }
            Command::Erase => {
                let erase = self.state.model.timing.erase_ms.saturating_mul(1_000_000);
                let until = self.state.now.after_nanos(erase);
                self.state.run = None;
                self.state.activity = Activity::Waiting { what: Wait::Erase, until: Some(until) };
                return;
            }
            Command::Init(init) => {
                self.initialise_parameter(init);
                Reply::Done.into()
            }
            other => {
                if matches!(other, Command::SimulateReference(_)) {
                    self.forget_stopped_motion();
                }
                self.apply(&other);
                Reply::Done.into()
            }
        };
        self.answer_bytes(Mode::Direct, op, done.0);
    }

    /// Executes what takes no time and is the same in a program as on the line.
    pub(crate) fn apply(&mut self, command: &Command) {
        match *command {
            Command::WritePort { port, value } => self.write_port(port, value),
            Command::SetPort(test) => self.set_port(test),
            Command::ReferenceSpeeds(speeds) => {
                for axis in self.state.axes.iter() {
                    if let Some(speed) = speeds.of(axis, self.state.axes) {
                        self.state.speeds[axis] = speed;
                    }
                }
            }
            Command::Plane(plane) => self.state.plane = plane,
            Command::Direction(direction) => self.state.direction = direction,
            Command::Interpolation3d(on) => self.state.three_d = on,
            Command::TestMode(on) => self.state.test_mode = on,
            Command::StartStop(hertz) => self.state.ramp.start_stop = hertz,
            Command::Acceleration(rate) => self.state.ramp.acceleration = rate,
            Command::Brake(on) => self.drive(|outputs| outputs.set(Output::BRAKE, on)),
            Command::Zero(axes) => {
                for axis in axes.iter() {
                    self.state.zero[axis] = self.state.position[axis];
                }
            }
            Command::SimulateReference(axes) => self.simulate_reference(axes),
            _ => {}
        }
    }

    /// The current point of an axis becomes its reference point.
    pub(crate) fn set_reference_point(&mut self, axis: usize) {
        self.state.position[axis] = 0;
        self.state.zero[axis] = 0;
        let axis = AxisSet::from_bits(1 << axis).unwrap_or(AxisSet::NONE);
        self.state.referenced = self.state.referenced.union(axis);
        self.state.latched = self.state.latched.without(axis);
        self.state.freed = self.state.freed.without(axis);
    }

    /// The axes no longer know where they are.
    pub(crate) fn unreference(&mut self, axes: AxisSet) {
        self.state.referenced = self.state.referenced.without(axes);
    }

    /// Any new motion drops what is left of an older one.
    pub(crate) fn forget_stopped_motion(&mut self) {
        self.state.remainder = None;
        self.state.run = None;
    }

    fn initialise_parameter(&mut self, init: Init) {
        let settings = &mut self.state.settings;
        match init {
            Init::Directions(axes) => settings.directions = axes,
            Init::References(axes) => settings.references = axes,
            Init::RotaryL(axes) | Init::AxisTypes(axes) => settings.rotary = axes,
            Init::HardwareStatus(status) => {
                self.drive(|outputs| outputs.set(Output::COVER_ENABLE, status & 1 == 1));
            }
            Init::DefaultSpeeds(speeds) => {
                settings.reference_speeds = speeds;
                self.state.speeds = speeds;
            }
            Init::FreeSteps(steps) => settings.free_steps = steps,
            Init::DefaultAcceleration(rate) => {
                settings.acceleration = rate;
                self.state.ramp.acceleration = rate;
            }
            Init::DefaultStartStop(hertz) => {
                settings.start_stop = hertz;
                self.state.ramp.start_stop = hertz;
            }
            Init::IoOnly(on) => {
                settings.io_only = on;
                if on {
                    self.warn_no_effect("IO1 is kept, but every command still works");
                }
            }
            Init::Limits(limits) => settings.limits = limits,
            Init::SwapLimits(axes) => settings.swapped = axes,
            Init::Abort(test) => settings.abort = test,
            Init::ErrorSignal(test) => settings.error_signal = test,
            Init::Cover(test) => settings.cover = test,
            Init::Emergency(test) => settings.emergency = test,
            Init::Baud9600(on) => settings.baud_9600 = on,
            Init::UserInfo(text) => settings.user_info = text,
            Init::Load => {
                let kept = self.state.kept_settings();
                self.adopt(kept);
            }
            Init::Factory => {
                let factory = Settings::factory(&self.state.model, self.state.plant.machine());
                self.adopt(factory);
            }
            Init::Write => {
                self.state.flash.settings = Some(self.state.settings.clone().into());
                self.replace_flash_image();
                self.flash_changed("settings");
            }
        }
    }

    /// Settings that are loaded act at once, like settings that are made one by one.
    fn adopt(&mut self, settings: Settings) {
        self.state.speeds = settings.reference_speeds;
        self.state.ramp.start_stop = settings.start_stop;
        self.state.ramp.acceleration = settings.acceleration;
        self.state.settings = settings;
    }

    /// A line with a capital letter, where its small one is told apart, see [`LowerCase`].
    pub(crate) fn capital(&self, text: &[u8]) -> Option<Vec<u8>> {
        let told_apart = self.state.model.quirks.lower_case != LowerCase::After;
        capital_letter(text).filter(|_| told_apart)
    }

    // --- answers ---

    /// A line was for another controller.
    fn pass_over(&mut self, text: &[u8]) {
        if self.wants(Kinds::COMMAND) {
            let number = text.iter().skip(1).find(|byte| **byte != b' ');
            let number = char::from(number.copied().unwrap_or(b'?'));
            let why = format!("for controller {number}, this one is {}", self.state.device);
            let bytes = Bytes::copy_from_slice(text);
            self.emit(Event::Ignored { bytes, why: why.into() });
        }
    }

    pub(crate) fn announce(&mut self, mnemonic: &'static str, text: &[u8]) {
        if self.wants(Kinds::COMMAND) {
            self.emit(Event::Command {
                mnemonic: mnemonic.into(),
                bytes: Bytes::copy_from_slice(text),
            });
        }
    }

    /// `0`: a command has been executed.
    pub(crate) fn done(&mut self, mode: Mode, op: Op) {
        self.answer_bytes(mode, op, Answer::from(Reply::Done).0);
    }

    pub(crate) fn answer_bytes(&mut self, mode: Mode, op: Op, bytes: Bytes) {
        if self.wants(Kinds::ANSWER) {
            let mnemonic = self.mnemonic(mode, op);
            self.emit(Event::Answer { mnemonic: mnemonic.into(), bytes: bytes.clone(), why: None });
        }
        self.send(bytes);
    }

    /// A command is refused, or ends before its time.
    pub(crate) fn refuse(&mut self, mode: Mode, op: Op, why: Why) {
        let Answer(bytes) = why.reply().into();
        self.answer_why(bytes, |c| (c.mnemonic(mode, op), c.in_words(why, None)));
    }

    /// The same because of what a line says.
    pub(crate) fn refuse_line(
        &mut self,
        mnemonic: &'static str,
        why: Why,
        line: &[u8],
        mode: Mode,
    ) {
        let Answer(bytes) = why.reply().into();
        self.answer_why(bytes, |c| (mnemonic, c.in_words(why, Some((line, mode)))));
    }

    /// An answer with its mnemonic and its reason, which is put into words only if somebody wants
    /// to have them.
    pub(crate) fn answer_why(
        &mut self,
        bytes: Bytes,
        why: impl FnOnce(&Self) -> (&'static str, String),
    ) {
        if self.wants(Kinds::ANSWER) {
            let (mnemonic, why) = why(self);
            let why = Some(why.into());
            self.emit(Event::Answer { mnemonic: mnemonic.into(), bytes: bytes.clone(), why });
        }
        self.send(bytes);
    }

    /// The answer of this model to a control byte that ends no command.
    pub(crate) fn answer_control(&mut self, control: &'static str, reply: ControlReply) {
        if reply == ControlReply::Done {
            let Answer(bytes) = Reply::Done.into();
            if self.wants(Kinds::ANSWER) {
                self.emit(Event::Answer {
                    mnemonic: control.into(),
                    bytes: bytes.clone(),
                    why: None,
                });
            }
            self.send(bytes);
        }
    }

    pub(crate) fn flash_changed(&mut self, what: &'static str) {
        if self.wants(Kinds::FLASH) {
            self.emit(Event::Flash { what: what.into() });
        }
    }

    pub(crate) fn warn_no_effect(&mut self, what: &'static str) {
        if self.wants(Kinds::WARNING) {
            self.emit(Event::Warning(Warning::NoEffect { what: what.into() }));
        }
    }
}

/// A motion whose letter is a small one, with a capital in its place: the third token of its line,
/// after `@` and the number of the controller.
fn capital_letter(text: &[u8]) -> Option<Vec<u8>> {
    let mut tokens = text.iter().enumerate().filter(|(_, byte)| **byte != b' ');
    let (place, letter) = tokens.nth(2)?;
    if !matches!(letter, b'a' | b'm' | b'r' | b's') {
        return None;
    }
    let mut capital = text.to_vec();
    capital.get_mut(place)?.make_ascii_uppercase();
    Some(capital)
}

/// The bytes of an answer.
pub(crate) struct Answer(pub(crate) Bytes);

impl From<Reply> for Answer {
    fn from(reply: Reply) -> Answer {
        const CODES: &[u8] = b"0123456789DFGHR";
        let place = CODES.iter().position(|&code| code == reply.code()).unwrap_or(0);
        Answer(Bytes::from_static(&CODES[place..=place]))
    }
}

impl From<Vec<u8>> for Answer {
    fn from(bytes: Vec<u8>) -> Answer {
        Answer(bytes.into())
    }
}
