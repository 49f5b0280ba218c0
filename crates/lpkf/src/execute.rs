//! What each command does, and how it is answered.

use std::collections::VecDeque;

use bytes::Bytes;
use vimc4_device::{AXES, Event, Kinds, Point, Warning};
use vimc4_plant::Unit;

use crate::Controller;
use crate::language::{Axis, AxisKind, AxisLimits, Command, Limits};
use crate::model::{CommandSet, DecimalSpeed, InitReply, Model, ResolutionUnit, StatusDigits};
use crate::state::{Activity, Buffer, Job, Pause, Stage, Stop};
use crate::text::Line;
use crate::why::Why;

const NANOS_PER_MS: u64 = 1_000_000;
/// A turn in millionths of a degree.
const TURN: i64 = 360_000_000;
/// The highest acceleration of a rotary axis in the manual, mrad/s².
const TURN_ACCELERATION_MAX: u32 = 800_000;

impl Controller {
    /// Begins a command whose turn has come.
    pub(crate) fn execute(&mut self, command: Command) {
        let mnemonic = command.form().mnemonic;
        if command.depends_on_machine()
            && let Err(misfit) = command.check(&self.limits())
        {
            return self.answer_failed(mnemonic, Why::Misfit(misfit));
        }
        if matches!(command, Command::Continue | Command::GoBack | Command::RepeatBroken) {
            return self.resume(command);
        }
        match self.stages(&command) {
            Ok(stages) if stages.is_empty() => self.executed(command),
            Ok(stages) => self.begin(command, stages),
            Err(why) => self.answer_failed(mnemonic, why),
        }
    }

    /// A command has been executed.
    pub(crate) fn executed(&mut self, command: Command) {
        self.answer_done(&command);
        // What goes on with another command is not what `!RP` means, and after `IN` there is none.
        if !matches!(
            command,
            Command::Continue | Command::GoBack | Command::RepeatBroken | Command::Initialize
        ) {
            self.state.last = Some(command);
        }
    }

    /// Lets a command do these things, one after the other.
    pub(crate) fn begin(&mut self, command: Command, stages: VecDeque<Stage>) {
        self.state.job = Some(Job {
            command,
            start: self.state.position,
            stages,
            stage: None,
            activity: Activity::Between,
            silent: false,
            found: [0; AXES],
        });
    }

    /// What a command does over time. What it does at once is done here.
    pub(crate) fn stages(&mut self, command: &Command) -> Result<VecDeque<Stage>, Why> {
        if command.moves()
            && let Some(status) = self.standing_fault()
        {
            return Err(Why::Fault(status));
        }
        let here = self.state.position;
        let at = |axis: Axis, place: i64| {
            let mut to = here;
            to[axis.index()] = place;
            to
        };
        let mut stages = VecDeque::new();
        match command {
            Command::PlotAbsolute(places) => {
                for place in places {
                    stages.push_back(Stage::To(flat(here, place.map(i64::from))));
                }
            }
            Command::PlotRelative(ways) => {
                let mut place = [here[0], here[1]];
                for way in ways {
                    place = [place[0] + i64::from(way[0]), place[1] + i64::from(way[1])];
                    stages.push_back(Stage::To(flat(here, place)));
                }
            }
            Command::ArcAbsolute { centre, angle } => {
                stages.push_back(Stage::Arc(centre.map(i64::from), *angle));
            }
            Command::ArcRelative { centre: [x, y], angle } => {
                let centre = [here[0] + i64::from(*x), here[1] + i64::from(*y)];
                stages.push_back(Stage::Arc(centre, *angle));
            }
            Command::Circle(radius) => {
                let (x, y) = (here[0], here[1]);
                let rim = flat(here, [x + i64::from(radius.unsigned_abs()), y]);
                stages.extend([Stage::To(rim), Stage::Arc([x, y], TURN), Stage::To(here)]);
            }
            Command::EdgeAbsolute(corner) => stages = edge(here, corner.map(i64::from)),
            Command::EdgeRelative([x, y]) => {
                stages = edge(here, [here[0] + i64::from(*x), here[1] + i64::from(*y)]);
            }
            Command::SpaceAbsolute(place) => {
                let place = place.map(i64::from);
                let axes = |axis| place.get(axis).copied().unwrap_or(here[axis]);
                stages.push_back(Stage::To(self.where_fitted(axes)));
            }
            Command::SpaceRelative(way) => {
                let way = way.map(i64::from);
                let axes = |axis: usize| here[axis] + way.get(axis).copied().unwrap_or(0);
                stages.push_back(Stage::To(self.where_fitted(axes)));
            }
            Command::FollowVectors { axes, vectors } => {
                stages.push_back(Stage::Vectors(*axes, vectors.clone()));
            }
            Command::MoveAllAbsolute(places) => {
                let places = places.map(i64::from);
                stages.push_back(Stage::To(self.where_fitted(|axis| places[axis])));
            }
            Command::MoveAllRelative(ways) => {
                let ways = ways.map(i64::from);
                stages.push_back(Stage::To(self.where_fitted(|axis| here[axis] + ways[axis])));
            }
            Command::MoveZAbsolute(to) => {
                stages.push_back(Stage::To(at(Axis::Z0, i64::from(*to))));
            }
            Command::MoveZRelative(by) => {
                stages.push_back(Stage::To(at(Axis::Z0, here[2] + i64::from(*by))));
            }
            Command::MoveAxisAbsolute { axis, to } => {
                stages.push_back(Stage::To(at(*axis, i64::from(*to))));
            }
            Command::MoveAxisRelative { axis, by } => {
                let place = here[axis.index()] + i64::from(*by);
                stages.push_back(Stage::To(at(*axis, place)));
            }
            Command::PenDown | Command::PenUp => {
                let down = *command == Command::PenDown;
                if down != self.state.head_down {
                    let [before_down, after_down, before_up, after_up] =
                        self.state.settings.head_times();
                    let (before, after) =
                        if down { (before_down, after_down) } else { (before_up, after_up) };
                    stages.push_back(wait(Pause::Head, before));
                    stages.push_back(Stage::Head(down));
                    stages.push_back(wait(Pause::Head, after));
                }
            }
            Command::Wait(ms) => stages.push_back(wait(Pause::Once, *ms)),
            Command::Reference(axis) => stages = self.state.reference_stages(*axis)?,
            Command::Initialize => {
                self.initialise();
                stages = self.state.homing_stages();
                if !stages.is_empty()
                    && let Some(status) = self.standing_fault()
                {
                    return Err(Why::Fault(status));
                }
            }
            Command::HardClipLimits(axis) => stages = self.hard_clip_stages(*axis),
            command => self.apply(command)?,
        }
        // Everything rests for the settling time after each move.
        let settling = self.state.settings.settling;
        if settling > 0 && command.moves() {
            let moves = std::mem::take(&mut stages).into_iter();
            stages = moves.flat_map(|stage| settled(stage, settling)).collect();
        }
        Ok(stages)
    }

    /// A place that differs from the present one only where an axis is fitted.
    fn where_fitted(&self, place: impl Fn(usize) -> i64) -> Point {
        let mut to = self.state.position;
        for axis in self.state.fitted() {
            to[axis.index()] = place(axis.index());
        }
        to
    }

    /// Commands that take no time.
    pub(crate) fn apply(&mut self, command: &Command) -> Result<(), Why> {
        let settings = &mut self.state.settings;
        let of = |axis: &Option<Axis>| match axis {
            Some(axis) => axis.index()..axis.index() + 1,
            None => 0..AXES,
        };
        match command {
            Command::Window([[ax, ay], [bx, by]]) => {
                let low = [ax.min(bx), ay.min(by)].map(|place| i64::from(*place));
                let high = [ax.max(bx), ay.max(by)].map(|place| i64::from(*place));
                settings.window = Some([low, high]);
            }
            Command::Range { axis, min, max } => {
                let (min, max) = (i64::from(*min), i64::from(*max));
                settings.ranges[axis.index()] = Some((min.min(max), min.max(max)));
            }
            Command::PenSpeed(speed) => {
                let metres = self.state.model.quirks.decimal_speed == DecimalSpeed::Metres;
                settings.speed_down = speed.speed(metres).unsigned_abs();
                settings.speed_set_last = settings.speed_down;
            }
            Command::TravelSpeed(speed) => {
                settings.speed_up = speed.unsigned_abs();
                settings.speed_set_last = settings.speed_up;
            }
            Command::ZSpeed(speed) => settings.axis_speed[2] = speed.unsigned_abs(),
            Command::AxisSpeed { axis, speed } => {
                settings.axis_speed[axis.index()] = speed.unsigned_abs();
            }
            Command::Acceleration { axis, acceleration } => {
                settings.acceleration[of(axis)].fill(acceleration.unsigned_abs());
            }
            Command::Resolution { axis, resolution } => {
                let micrometres =
                    self.state.model.language.resolution_unit == ResolutionUnit::Micrometres;
                let machine = self.state.plant.machine();
                for axis in of(axis) {
                    let linear = machine.axis(axis).unit == Unit::Linear;
                    // Millionths of a µm are the thousandths of a nm that are kept.
                    settings.resolution[axis] = match linear && micrometres {
                        true => resolution.millionths(),
                        false => resolution.thousandths(),
                    };
                }
            }
            Command::SetMode(mode) => settings.mode = *mode,
            Command::DrillingTimes(times) => settings.drill_times = *times,
            Command::MillingTimes(times) => settings.mill_times = *times,
            Command::SettlingTime(ms) => settings.settling = *ms,
            Command::Echo(on) => settings.echo = *on,
            Command::ExternalStop(on) => settings.external_stop = *on,
            Command::Spindle(on) => self.switch_spindle(*on),
            Command::FullCurrent => self.halve_current(false),
            Command::HalfCurrent => self.halve_current(true),
            Command::WritePort { port, data } => self.write_port(*port, *data)?,
            Command::ReadPort(port) => {
                let value = self.read_module(*port)?;
                let mut line = Line::new(b'R');
                line.number(i64::from(value), 4);
                self.send_line(command, line);
            }
            Command::OutputStatus => {
                let texts = &self.state.model.texts;
                let mut line = Line::new(b'S');
                if self.state.model.language.status_texts == StatusDigits::Hexadecimal {
                    line.hexadecimal(texts.version.into());
                    for number in [texts.date, texts.identity] {
                        line.push(b',');
                        line.hexadecimal(number);
                    }
                } else {
                    line.number(i64::from(texts.version), 3);
                    line.push(b',');
                    line.numbers(&[i64::from(texts.date), i64::from(texts.identity)]);
                }
                self.send_line(command, line);
            }
            Command::NominalPosition(axis) => {
                let places = self.places(&self.state.position).len();
                if let Some(axis) = axis.filter(|axis| axis.index() >= places) {
                    return Err(Why::NoPosition(axis));
                }
                let line = self.position_line(b'P', &self.state.position, *axis);
                self.send_line(command, line);
            }
            Command::ActualPosition { axis, triggered } => {
                let point = match triggered {
                    true => self.state.triggered.ok_or(Why::NoTrigger)?,
                    false => self.state.actual(),
                };
                let line = self.position_line(b'A', &point, *axis);
                self.send_line(command, line);
            }
            Command::OpenInterface(use_of) => self.open_interface(*use_of)?,
            Command::CloseInterface => self.close_interface(),
            // The reader has opened the channel already.
            _ => {}
        }
        Ok(())
    }

    /// `IN`. What waits behind it is for the controller as it is afterwards.
    fn initialise(&mut self) {
        let outputs = self.outputs();
        self.state.initialise();
        self.outputs_changed(&outputs);
    }

    /// A command that bypasses the buffer.
    pub(crate) fn execute_directly(&mut self, command: Command) {
        match command {
            Command::ClearBuffer => {
                self.state.buffer = Buffer::default();
            }
            Command::GoOn => {
                self.state.stopped = None;
                self.state.stop_requested = false;
                self.state.broken = None;
            }
            Command::Stop => self.state.stop_requested = true,
            Command::Repeat => {
                // It is done when the repetition is, which comes before what waits.
                if let Some(last) = self.state.last.clone() {
                    return self.put_again(last);
                }
            }
            _ => {}
        }
        if self.state.stop_requested && self.state.job.is_none() {
            self.state.stop_requested = false;
            self.state.stopped.get_or_insert(Stop::Command);
        }
        self.answer_done(&command);
    }

    /// What values must keep within.
    fn limits(&self) -> Limits {
        let limits = &self.state.model.limits;
        let axes = Axis::ALL.map(|axis| {
            let rotary = self.is_rotary(axis);
            let (kind, speed, acceleration) = match rotary {
                true => (AxisKind::Rotation, limits.turn_max, TURN_ACCELERATION_MAX),
                false => (AxisKind::Translation, limits.speed_max, limits.acceleration_max),
            };
            self.state.is_fitted(axis).then_some(AxisLimits {
                kind,
                max_speed: speed as i32,
                max_acceleration: acceleration as i32,
            })
        });
        let Model { language, quirks, .. } = &*self.state.model;
        Limits {
            axes,
            metres: quirks.decimal_speed == DecimalSpeed::Metres,
            micrometres: language.resolution_unit == ResolutionUnit::Micrometres,
        }
    }

    // --- answers ---

    /// A command has been completed.
    pub(crate) fn answer_done(&mut self, command: &Command) {
        let mnemonic = command.form().mnemonic;
        match command {
            Command::Initialize => {
                let bytes: &[u8] = match self.state.model.quirks.init_reply {
                    InitReply::Z => b"Z",
                    InitReply::C => b"C\r",
                };
                self.answer(mnemonic, Bytes::from_static(bytes));
            }
            Command::OpenChannel(_) => {}
            _ if self.state.settings.echo => self.answer(mnemonic, Bytes::from_static(b"C\r")),
            _ => {}
        }
    }

    /// A command has failed.
    pub(crate) fn answer_failed(&mut self, mnemonic: &'static str, why: Why) {
        self.answer_refused(mnemonic, why, b"");
    }

    /// A command with these bytes is refused. A status that this model has no number for is not
    /// sent.
    pub(crate) fn answer_refused(&mut self, mnemonic: &'static str, why: Why, raw: &[u8]) {
        let decimal = self.state.model.quirks.status_digits == StatusDigits::Decimal;
        let dialect = self.state.model.command_set.dialect();
        match self.status_of(why).written(dialect, decimal) {
            Some(text) => {
                let bytes = Bytes::from(text + "\r");
                if self.wants(Kinds::ANSWER) {
                    let why = Some(self.in_words(why, raw).into());
                    self.emit(Event::Answer {
                        mnemonic: mnemonic.into(),
                        bytes: bytes.clone(),
                        why,
                    });
                }
                self.send(bytes);
            }
            None if self.wants(Kinds::WARNING) => {
                let what = self.in_words(why, raw).into();
                self.emit(Event::Warning(Warning::NoEffect { what }));
            }
            None => {}
        }
    }

    /// Something has happened that no command asked for.
    pub(crate) fn report(&mut self, why: Why) {
        self.answer_failed("", why);
    }

    /// A line of data.
    pub(crate) fn send_line(&mut self, command: &Command, line: Line) {
        self.answer(command.form().mnemonic, line.finish());
    }

    fn answer(&mut self, mnemonic: &'static str, bytes: Bytes) {
        if self.wants(Kinds::ANSWER) {
            self.emit(Event::Answer { mnemonic: mnemonic.into(), bytes: bytes.clone(), why: None });
        }
        self.send(bytes);
    }

    /// A letter and the place of one axis, or those of all that this model has.
    fn position_line(&self, letter: u8, point: &Point, axis: Option<Axis>) -> Line {
        let mut line = Line::new(letter);
        match axis {
            Some(axis) => line.number(point[axis.index()], 1),
            None => line.numbers(self.places(point)),
        }
        line
    }

    /// The places of all axes that this model has, whether fitted or not.
    pub(crate) fn places<'p>(&self, point: &'p Point) -> &'p [i64] {
        match self.state.model.command_set {
            CommandSet::Smcu => &point[..3],
            CommandSet::MotionSystem => point,
        }
    }
}

/// The four ways around a rectangle between a place and the corner opposite, along X first.
fn edge(here: Point, [x, y]: [i64; 2]) -> VecDeque<Stage> {
    let corners = [[x, here[1]], [x, y], [here[0], y], [here[0], here[1]]];
    corners.map(|corner| Stage::To(flat(here, corner))).into()
}

/// X and Y of a place.
fn flat(mut point: Point, [x, y]: [i64; 2]) -> Point {
    (point[0], point[1]) = (x, y);
    point
}

pub(crate) fn wait(pause: Pause, ms: u32) -> Stage {
    Stage::Wait(pause, u64::from(ms) * NANOS_PER_MS)
}

fn settled(stage: Stage, settling: u32) -> Vec<Stage> {
    match stage {
        Stage::To(_) | Stage::Arc(..) | Stage::Vectors(..) => {
            vec![stage, wait(Pause::Settling, settling)]
        }
        other => vec![other],
    }
}
