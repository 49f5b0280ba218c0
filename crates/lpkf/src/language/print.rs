//! The printer: the exact inverse of reading.

use std::fmt::Write as _;

use super::command::{Axis, Command, Mode, Trackball, Turn, Vector};
use super::number::Number;

impl Command {
    /// Appends the bytes that mean this command, with its end.
    ///
    /// What is printed reads as an equal command on a model that has it. Numbers are separated by
    /// commas and have no signs but minus; the end is a `;`.
    pub fn print(&self, out: &mut Vec<u8>) {
        let mut printer = Printer { text: self.form().letters().to_owned(), fields: 0 };
        printer.command(self);
        printer.text.push(';');
        out.append(&mut printer.text.into_bytes());
    }
}

/// Appends parameters and puts commas between them.
struct Printer {
    text: String,
    fields: usize,
}

impl Printer {
    fn command(&mut self, command: &Command) -> &mut Self {
        match command {
            Command::ArcAbsolute { centre, angle } | Command::ArcRelative { centre, angle } => {
                self.wholes(centre).number(Number { millionths: *angle })
            }
            Command::Window(corners) => self.wholes(corners.as_flattened()),
            Command::HardClipLimits(axis) | Command::Reference(axis) => self.axis(*axis),
            Command::PlotAbsolute(pairs) | Command::PlotRelative(pairs) => {
                self.wholes(pairs.as_flattened())
            }
            Command::EdgeAbsolute(place) | Command::EdgeRelative(place) => self.wholes(place),
            Command::SpaceAbsolute(place) | Command::SpaceRelative(place) => self.wholes(place),
            Command::PenSpeed(speed) => self.number(*speed),
            Command::Acceleration { axis, acceleration } => self.whole(*acceleration).axis(*axis),
            Command::Resolution { axis, resolution } => self.number(*resolution).axis(*axis),
            Command::CloseChannel(channel) | Command::OpenChannel(channel) => {
                self.wholes(channel.as_slice())
            }
            Command::SetMode(mode) => self.whole(*mode == Mode::Milling),
            Command::Echo(on) | Command::ExternalStop(on) | Command::Spindle(on) => self.whole(*on),
            Command::MoveAllAbsolute(positions) | Command::MoveAllRelative(positions) => {
                self.wholes(positions)
            }
            Command::ActualPosition { axis, triggered } => {
                self.whole(axis_or_all(*axis) + if *triggered { 0 } else { 100 })
            }
            Command::OpenInterface(trackball) => self.whole(match trackball {
                Trackball::MoveAndReport => 1,
                Trackball::Move => 2,
                Trackball::Report => 3,
            }),
            Command::NominalPosition(axis) => self.whole(axis_or_all(*axis)),
            Command::FollowVectors { axes, vectors } => {
                self.wholes(&axes.map(|axis| axis as i32)).vectors(vectors)
            }
            Command::ReadPort(port) => self.whole(*port),
            Command::Range { axis, min, max } => self.wholes(&[*min, *max]).axis(Some(*axis)),
            Command::DrillingTimes(times) | Command::MillingTimes(times) => self.wholes(times),
            Command::SettlingTime(time) | Command::Wait(time) => self.whole(*time),
            Command::TravelSpeed(value)
            | Command::ZSpeed(value)
            | Command::Circle(value)
            | Command::MoveZAbsolute(value)
            | Command::MoveZRelative(value) => self.whole(*value),
            Command::AxisSpeed { axis, speed: value }
            | Command::MoveAxisAbsolute { axis, to: value }
            | Command::MoveAxisRelative { axis, by: value } => self.whole(*value).axis(Some(*axis)),
            Command::WritePort { port, data } => self.whole(*port).whole(*data),
            Command::Initialize
            | Command::OutputStatus
            | Command::PenDown
            | Command::PenUp
            | Command::CloseInterface
            | Command::Continue
            | Command::FullCurrent
            | Command::HalfCurrent
            | Command::GoBack
            | Command::RepeatBroken
            | Command::ClearBuffer
            | Command::GoOn
            | Command::Repeat
            | Command::Stop => self,
        }
    }

    /// Where the next parameter begins.
    fn field(&mut self) -> &mut String {
        if self.fields > 0 {
            self.text.push(',');
        }
        self.fields += 1;
        &mut self.text
    }

    fn whole(&mut self, number: impl Into<i64>) -> &mut Self {
        // Writing to a string cannot fail.
        let _ = write!(self.field(), "{}", number.into());
        self
    }

    fn wholes<N: Into<i64> + Copy>(&mut self, numbers: &[N]) -> &mut Self {
        numbers.iter().fold(self, |printer, &number| printer.whole(number))
    }

    fn axis(&mut self, axis: Option<Axis>) -> &mut Self {
        self.wholes(axis.map(|axis| axis as u8).as_slice())
    }

    fn number(&mut self, number: Number) -> &mut Self {
        let _ = write!(self.field(), "{number}");
        self
    }

    fn vectors(&mut self, vectors: &[Vector]) -> &mut Self {
        vectors.iter().for_each(|vector| self.vector(vector));
        self.text.push('\r');
        self
    }

    /// A record on a line of its own: zeros can be left out, but a record must not be empty.
    fn vector(&mut self, vector: &Vector) {
        let turn = match vector.turn {
            Turn::Clockwise => -1,
            Turn::Straight => 0,
            Turn::Counterclockwise => 1,
        };
        let ([x, y], [i, j]) = (vector.end, vector.centre);
        let _ = write!(self.text, "\rX{x}Y{y}");
        for (letter, value) in [('I', i), ('J', j), ('F', vector.speed_change), ('O', turn)] {
            if value != 0 {
                let _ = write!(self.text, "{letter}{value}");
            }
        }
    }
}

/// The number of an axis where 0 stands for all.
fn axis_or_all(axis: Option<Axis>) -> i32 {
    axis.map_or(0, |axis| i32::from(axis as u8) + 1)
}
