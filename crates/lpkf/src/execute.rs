//! What each command does.

use std::borrow::Cow;
use std::collections::VecDeque;

use vimc4_device::{AXES, Point};
use vimc4_plant::Unit;

use crate::buffer::Buffer;
use crate::language::{Axis, AxisLimits, Command, Kind, Limits, Status, TURN, Trackball};
use crate::model::{DecimalSpeed, Model, ResolutionUnit, StatusDigits};
use crate::state::{Pause, Stage, State};
use crate::text::AnswerLine;
use crate::why::Why;

const NANOS_PER_MS: u64 = 1_000_000;
/// The effects of a command besides changing the state.
#[derive(Default)]
pub(crate) struct Effect {
    /// It has no effect, and why.
    pub(crate) warning: Option<Cow<'static, str>>,
    /// The line of data in its answer.
    pub(crate) line: Option<AnswerLine>,
    /// Its stages, one after the other. The command is done when they are.
    pub(crate) stages: VecDeque<Stage>,
}

impl Effect {
    fn says(line: AnswerLine) -> Effect {
        Effect { line: Some(line), ..Effect::default() }
    }
}

impl State {
    /// Executes a command, as far as that takes no time.
    pub(crate) fn execute(&mut self, command: &Command) -> Result<Effect, Why> {
        if command.depends_on_machine() {
            command.check(&self.limits()).map_err(Why::Misfit)?;
        }
        if command.moves()
            && let Some(status) = self.standing_fault()
        {
            return Err(Why::Fault(status));
        }
        let here = self.position;
        let mut stages = VecDeque::new();
        match command {
            Command::PlotAbsolute(places) => {
                let places = places.iter().map(|place| flat(here, place.map(i64::from)));
                stages.extend(places.map(Stage::To));
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
            Command::FollowVectors { axes, vectors } => {
                stages.push_back(Stage::Vectors(*axes, vectors.clone()));
            }
            Command::PenDown => stages = self.head_stages(true),
            Command::PenUp => stages = self.head_stages(false),
            Command::Wait(ms) => stages.push_back(wait(Pause::Once, *ms)),
            Command::Reference(axis) => stages = self.reference_stages(*axis)?,
            Command::Initialize => {
                self.initialise();
                stages = self.homing_stages();
                if !stages.is_empty()
                    && let Some(status) = self.standing_fault()
                {
                    return Err(Why::Fault(status));
                }
            }
            Command::HardClipLimits(axis) => stages = self.hard_clip_stages(*axis),
            command => match self.target(command) {
                Some(to) => stages.push_back(Stage::To(to)),
                None => return self.apply(command),
            },
        }
        // Everything rests for the settling time after each move.
        let settling = self.settings.settling;
        if settling > 0 && command.moves() {
            let moves = std::mem::take(&mut stages).into_iter();
            stages = moves.flat_map(|stage| settled(stage, settling)).collect();
        }
        Ok(Effect { stages, ..Effect::default() })
    }

    /// Where a command moves all axes at once, or a single one.
    fn target(&self, command: &Command) -> Option<Point> {
        let here = self.position;
        let space = |place: &[i32; 3], from: Point| {
            let place = |axis: usize| place.get(axis).map(|place| from[axis] + i64::from(*place));
            self.where_fitted(|axis| place(axis).unwrap_or(here[axis]))
        };
        let all = |places: &[i32; AXES], from: Point| {
            self.where_fitted(|axis| from[axis] + i64::from(places[axis]))
        };
        let one = |axis: Axis, place: i32, from: Point| {
            let mut to = here;
            to[axis.index()] = from[axis.index()] + i64::from(place);
            to
        };
        Some(match command {
            Command::SpaceAbsolute(place) => space(place, Point::default()),
            Command::SpaceRelative(way) => space(way, here),
            Command::MoveAllAbsolute(places) => all(places, Point::default()),
            Command::MoveAllRelative(ways) => all(ways, here),
            Command::MoveZAbsolute(to) => one(Axis::Z0, *to, Point::default()),
            Command::MoveZRelative(by) => one(Axis::Z0, *by, here),
            Command::MoveAxisAbsolute { axis, to } => one(*axis, *to, Point::default()),
            Command::MoveAxisRelative { axis, by } => one(*axis, *by, here),
            _ => return None,
        })
    }

    /// Lowers or lifts the head, unless it is there already.
    fn head_stages(&self, down: bool) -> VecDeque<Stage> {
        if down == self.outputs.head_down {
            return VecDeque::new();
        }
        let [before_down, after_down, before_up, after_up] = self.settings.head_times();
        let (before, after) = if down { (before_down, after_down) } else { (before_up, after_up) };
        [wait(Pause::Head, before), Stage::Head(down), wait(Pause::Head, after)].into()
    }

    /// A target that differs from the present position only on fitted axes.
    fn where_fitted(&self, place: impl Fn(usize) -> i64) -> Point {
        let mut to = self.position;
        for axis in self.fitted() {
            to[axis.index()] = place(axis.index());
        }
        to
    }

    /// Commands that take no time.
    fn apply(&mut self, command: &Command) -> Result<Effect, Why> {
        let settings = &mut self.settings;
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
                let metres = self.model.quirks.decimal_speed == DecimalSpeed::Metres;
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
                    self.model.language.resolution_unit == ResolutionUnit::Micrometres;
                let machine = self.plant.machine();
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
            Command::Spindle(on) => self.outputs.spindle = *on,
            Command::FullCurrent => self.outputs.half_current = false,
            Command::HalfCurrent => self.outputs.half_current = true,
            Command::WritePort { port, data } => return self.write_port(*port, *data),
            Command::ReadPort(port) => return self.read_port(*port),
            Command::OutputStatus => return Ok(Effect::says(self.status_line())),
            Command::NominalPosition(axis) => {
                return Ok(Effect::says(self.position_line(b'P', &self.position, *axis)));
            }
            Command::ActualPosition { axis, triggered } => {
                let point = match triggered {
                    true => self.triggered.ok_or(Why::NoTrigger)?,
                    false => self.actual_now(),
                };
                return Ok(Effect::says(self.position_line(b'A', &point, *axis)));
            }
            Command::OpenInterface(use_of) => return self.open_trackball(*use_of),
            Command::CloseInterface => self.ball.close(),
            // The reader has opened the channel already.
            _ => {}
        }
        Ok(Effect::default())
    }

    /// `!WR`. A port has eight bits.
    fn write_port(&mut self, port: u8, data: u16) -> Result<Effect, Why> {
        if !self.model.io.write.contains(&port) {
            return self.no_module(port, true);
        }
        self.outputs.written.insert(port, data as u8);
        Ok(Effect::default())
    }

    /// `!RD`.
    fn read_port(&self, port: u8) -> Result<Effect, Why> {
        let known = self.model.io.read.contains(&port);
        let effect = if known { Effect::default() } else { self.no_module(port, false)? };
        let mut line = AnswerLine::new(b'R');
        line.number(self.model.io.read_port(&self.plant, u16::from(port)).into(), 4);
        Ok(Effect { line: Some(line), ..effect })
    }

    /// `OS`.
    fn status_line(&self) -> AnswerLine {
        let texts = &self.model.texts;
        let mut line = AnswerLine::new(b'S');
        if self.model.language.status_texts == StatusDigits::Hexadecimal {
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
        line
    }

    /// An SMCU has no status for a module that is not there. What it reads there is 0.
    fn no_module(&self, port: u8, write: bool) -> Result<Effect, Why> {
        if !self.is_smcu() {
            return Err(Why::NoPort { port, write });
        }
        let warning = Some(format!("port {port}: no such module").into());
        Ok(Effect { warning, ..Effect::default() })
    }

    /// `!OI`.
    fn open_trackball(&mut self, use_of: Trackball) -> Result<Effect, Why> {
        if !self.model.interface.trackball {
            if !self.is_smcu() {
                return Err(Why::NoTrackball);
            }
            // An SMCU has no status for it, as for a module that is not there.
            let warning = Some("no trackball is connected".into());
            return Ok(Effect { warning, ..Effect::default() });
        }
        if self.faults.contains(&Status::JoystickNotConnected.code()) {
            return Err(Why::Fault(Status::JoystickNotConnected));
        }
        self.ball.open(use_of, self.now);
        Ok(Effect::default())
    }

    /// Executes a command that bypasses the buffer. Returns the one that it repeats, if it does.
    pub(crate) fn execute_directly(&mut self, command: &Command) -> Option<Command> {
        match command {
            Command::ClearBuffer => self.buffer = Buffer::default(),
            Command::GoOn => {
                self.stopped = None;
                self.stop_requested = false;
                self.broken = None;
            }
            Command::Stop => self.stop_requested = true,
            Command::Repeat => return self.last.clone(),
            _ => {}
        }
        None
    }

    /// A letter and the place of one axis, or those of all that this model has.
    fn position_line(&self, letter: u8, point: &Point, axis: Option<Axis>) -> AnswerLine {
        let mut line = AnswerLine::new(letter);
        match axis {
            Some(axis) => line.number(point[axis.index()], 1),
            None => line.numbers(&point[..self.places()]),
        }
        line
    }

    /// How many axes this model has positions of, whether they are fitted or not.
    fn places(&self) -> usize {
        if self.is_smcu() { 3 } else { AXES }
    }

    /// What values must keep within.
    fn limits(&self) -> Limits {
        let limits = &self.model.limits;
        let axes = Axis::ALL.map(|axis| {
            let kind = self.plant.machine().axis(axis.index()).unit;
            let (_, turns) = Kind::Acceleration.limits(Unit::Rotary);
            let (max_speed, max_acceleration) = match kind {
                Unit::Linear => (limits.speed_max as i32, limits.acceleration_max as i32),
                Unit::Rotary => (limits.turn_max as i32, turns.unwrap_or(i32::MAX)),
            };
            self.is_fitted(axis).then_some(AxisLimits { kind, max_speed, max_acceleration })
        });
        let Model { language, quirks, .. } = &*self.model;
        Limits {
            axes,
            metres: quirks.decimal_speed == DecimalSpeed::Metres,
            micrometres: language.resolution_unit == ResolutionUnit::Micrometres,
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

fn wait(pause: Pause, ms: u32) -> Stage {
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
