//! Direct commands that move nothing.

use std::borrow::Cow;

use bytes::Bytes;
use vimc4_device::{Event, Kinds};
use vimc4_isel_wire::{AxisSet, Command, Init, Mode, Op, Reply};

use crate::activity::{Activity, Wait};
use crate::firmware::Firmware;
use crate::model::{CapitalD, LoneEnd, LowerCase};
use crate::settings::Settings;
use crate::why::Why;
use crate::wiring::Output;

impl Firmware {
    /// Executes a command that moves nothing, and answers it.
    pub(crate) fn perform(&mut self, op: Op, command: Command) {
        let done = match command {
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
                // The A axis is always configured separately, in addition to the others (99 2.2.1).
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
                    self.drop_stopped();
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

    fn initialise_parameter(&mut self, init: Init) {
        let limits = self.limits();
        self.set_parameter(init);
        self.tell_limits(&limits, &self.limits());
    }

    fn set_parameter(&mut self, init: Init) {
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

    /// Loaded settings act at once, like settings that are made one by one.
    fn adopt(&mut self, settings: Settings) {
        self.state.speeds = settings.reference_speeds;
        self.state.ramp.start_stop = settings.start_stop;
        self.state.ramp.acceleration = settings.acceleration;
        self.state.settings = settings;
    }

    /// A line with a capital letter, where the small letter means something else, see
    /// [`LowerCase`].
    pub(crate) fn capital(&self, text: &[u8]) -> Option<Vec<u8>> {
        let told_apart = self.state.model.quirks.lower_case != LowerCase::After;
        if told_apart { capital_letter(text) } else { None }
    }

    /// A line with the small letter that its `D` stands for, where it stands for one, see
    /// [`CapitalD`].
    pub(crate) fn small_d<'a>(&self, text: &'a [u8]) -> Cow<'a, [u8]> {
        let stands_for_d = self.state.model.quirks.capital_d == CapitalD::Speeds;
        match letter(text).filter(|(_, letter)| stands_for_d && *letter == b'D') {
            Some((place, _)) => [&text[..place], b"d", &text[place + 1..]].concat().into(),
            None => text.into(),
        }
    }

    /// Whether a line is the end of a data field that is not being stored, and no error on this model.
    pub(crate) fn is_lone_end(&self, text: &[u8]) -> bool {
        let quirk = self.state.model.quirks.lone_end;
        quirk != LoneEnd::Syntax && !self.state.storing && text.trim_ascii() == b"9"
    }

    /// The end of a data field that is not being stored.
    pub(crate) fn lone_end(&mut self, text: &[u8]) {
        if self.state.model.quirks.lone_end == LoneEnd::Done {
            self.note_command(self.mnemonic(Mode::Stored, Op::End), text);
            self.done(Mode::Stored, Op::End);
        } else if self.wants(Kinds::COMMAND) {
            let bytes = Bytes::copy_from_slice(text);
            let why = "no data field is being stored (lone_end)".into();
            self.emit(Event::Ignored { bytes, why });
        }
    }
}

/// The letter of a command and its place: the third token of its line, after `@` and the number of the
/// controller.
fn letter(text: &[u8]) -> Option<(usize, u8)> {
    let mut tokens = text.iter().copied().enumerate().filter(|(_, byte)| *byte != b' ');
    tokens.nth(2)
}

/// A motion with a small letter, rewritten with the capital.
fn capital_letter(text: &[u8]) -> Option<Vec<u8>> {
    let (place, letter) = letter(text)?;
    if !matches!(letter, b'a' | b'm' | b'r' | b's') {
        return None;
    }
    let mut capital = text.to_vec();
    capital.get_mut(place)?.make_ascii_uppercase();
    Some(capital)
}
