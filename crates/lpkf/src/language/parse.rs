//! From the bytes of one command to its meaning.
//!
//! The order of the checks is fixed; the first that fails says which status is answered:
//!
//! 1. Letters for which the model has no form: unknown command.
//! 2. Too few parameters for any form on any model: where X and Y come in pairs, an odd number is a
//!    single coordinate; everything else is a missing parameter.
//! 3. Otherwise the form is the one with the most parameters that are all there; surplus ones
//!    mean nothing (assumed). If the model lacks it: unknown command.
//! 4. An odd number of coordinates where pairs are repeated: a single coordinate.
//! 5. Values that fit no machine, in the order in which they are written: an axis that can never
//!    exist; the address of a port beyond 255, and a trackball that is to do anything but 1 to 3;
//!    an arc of more than a turn. For the address and the trackball the SMCU has no status of its
//!    own, for the arc nobody has: they answer that a parameter is missing (assumed).
//! 6. The records of `!PH`: one with too much in it, then none, which is a missing parameter,
//!    then too many.
//!
//! `!VA v,n` is `!VZ v,n` (assumed: the manual describes the latter where the letters of the former
//! would stand).
//!
//! What depends on the machine comes after all that: [`Command::check`].

use super::command::{Axis, Command, Mode, Trackball, Turn, Vector};
use super::dialect::Dialect;
use super::grammar::Grammar;
use super::number::{Number, numbers};
use super::status::Status;
use super::table::{Count, Form, Op, forms_of};

/// The most records a `!PH` can have.
pub const VECTORS_MAX: usize = 65;

/// The bytes a command is written with, without the number that may follow them.
#[must_use]
pub fn letters(raw: &[u8]) -> &[u8] {
    let rest = raw.strip_prefix(b"!").unwrap_or(raw);
    let count = rest.iter().take(2).take_while(|byte| byte.is_ascii_uppercase()).count();
    &raw[..raw.len() - rest.len() + count]
}

/// What one command means to a model, or the status that refuses it.
///
/// `raw` begins with its letters; an end such as `;` may follow, but no other command.
///
/// # Errors
///
/// The status of the first check that fails, in the order this module describes.
pub fn parse(raw: &[u8], grammar: impl Into<Grammar>) -> Result<Command, Status> {
    let grammar = grammar.into();
    let letters = letters(raw);
    let rest = &raw[letters.len()..];
    let forms = forms_for(letters, grammar.dialect);
    if !forms.clone().any(|form| grammar.knows(form)) {
        return Err(Status::UnknownCommand);
    }
    let (head, records) = match letters {
        b"!PH" => records(rest),
        _ => (rest, &[][..]),
    };
    // Only moves along many places have more parameters than this.
    let mut few = [Number::from(0); FEW];
    let mut count = 0;
    let mut rest = numbers(head);
    for (place, number) in few.iter_mut().zip(&mut rest) {
        *place = number;
        count += 1;
    }
    let many: Vec<Number>;
    let values = match rest.next() {
        None => &few[..count],
        Some(next) => {
            many = few.into_iter().chain([next]).chain(rest).collect();
            &many
        }
    };
    let form = forms
        .clone()
        .filter(|form| form.least() <= values.len())
        .max_by_key(|form| form.least())
        .ok_or_else(|| incomplete(forms, values.len()))?;
    if !grammar.knows(form) {
        return Err(Status::UnknownCommand);
    }
    if form.count == Count::Repeated && !values.len().is_multiple_of(form.least()) {
        return Err(Status::SingleCoordinate);
    }
    Values { values, model: grammar.dialect, at: 0 }.command(form.op, records)
}

/// The forms of the command that these letters are to a model.
pub(super) fn forms_for(
    letters: &[u8],
    dialect: Dialect,
) -> impl Iterator<Item = &'static Form> + Clone {
    forms_of(match (letters, dialect) {
        (b"!VA", Dialect::MotionSystem) => b"!VZ",
        (letters, _) => letters,
    })
}

/// A turn in millionths of a degree.
pub(crate) const TURN: i64 = 360_000_000;

/// This many parameters are read without an allocation.
const FEW: usize = 8;

/// The status when there are too few parameters for any of the forms.
fn incomplete(mut forms: impl Iterator<Item = &'static Form>, count: usize) -> Status {
    let in_pairs = forms.any(|form| {
        matches!(
            form.op,
            Op::ArcAbsolute
                | Op::ArcRelative
                | Op::EdgeAbsolute
                | Op::EdgeRelative
                | Op::Window
                | Op::PlotAbsolute
                | Op::PlotRelative
        )
    });
    if in_pairs && count % 2 == 1 { Status::SingleCoordinate } else { Status::MissingParameter }
}

/// The axes of `!PH`, and what follows them: its records begin with a CR or a letter.
pub(super) fn records(rest: &[u8]) -> (&[u8], &[u8]) {
    let begins = |byte: &u8| *byte == b'\r' || byte.is_ascii_uppercase();
    rest.split_at(rest.iter().position(begins).unwrap_or(rest.len()))
}

/// The parameters of a command, taken one after the other.
struct Values<'a> {
    values: &'a [Number],
    model: Dialect,
    at: usize,
}

impl Values<'_> {
    /// Fields are read in the order in which the values are sent.
    fn command(mut self, op: Op, records: &[u8]) -> Result<Command, Status> {
        Ok(match op {
            Op::ArcAbsolute => Command::ArcAbsolute { centre: self.pair()?, angle: self.angle()? },
            Op::ArcRelative => Command::ArcRelative { centre: self.pair()?, angle: self.angle()? },
            Op::Circle => Command::Circle(self.whole()?),
            Op::EdgeAbsolute => Command::EdgeAbsolute(self.pair()?),
            Op::EdgeRelative => Command::EdgeRelative(self.pair()?),
            Op::Initialize => Command::Initialize,
            Op::Window => Command::Window([self.pair()?, self.pair()?]),
            Op::HardClipLimits => Command::HardClipLimits(None),
            Op::HardClipLimitsOf => Command::HardClipLimits(Some(self.axis()?)),
            Op::OutputStatus => Command::OutputStatus,
            Op::PlotAbsolute => Command::PlotAbsolute(self.pairs()),
            Op::PenDown => Command::PenDown,
            Op::PlotRelative => Command::PlotRelative(self.pairs()),
            Op::PenUp => Command::PenUp,
            Op::PenSpeed => Command::PenSpeed(self.number()?),
            Op::AccelerationOf => {
                Command::Acceleration { acceleration: self.whole()?, axis: Some(self.axis()?) }
            }
            Op::Acceleration => Command::Acceleration { axis: None, acceleration: self.whole()? },
            Op::CloseChannel => Command::CloseChannel(None),
            Op::CloseChannelOf => Command::CloseChannel(Some(self.whole()?)),
            Op::CloseInterface => Command::CloseInterface,
            Op::SetMode => {
                Command::SetMode(if self.switch()? { Mode::Milling } else { Mode::Drilling })
            }
            Op::Continue => Command::Continue,
            Op::Echo => Command::Echo(self.switch()?),
            Op::ExternalStop => Command::ExternalStop(self.switch()?),
            Op::Spindle => Command::Spindle(self.switch()?),
            Op::FullCurrent => Command::FullCurrent,
            Op::GoBack => Command::GoBack,
            Op::HalfCurrent => Command::HalfCurrent,
            Op::Reference => Command::Reference(None),
            Op::ReferenceOf => Command::Reference(Some(self.axis()?)),
            Op::MoveAllAbsolute => Command::MoveAllAbsolute(self.all_axes()?),
            Op::MoveAllRelative => Command::MoveAllRelative(self.all_axes()?),
            Op::ActualPosition => self.actual_position()?,
            Op::OpenChannel => Command::OpenChannel(None),
            Op::OpenChannelOf => Command::OpenChannel(Some(self.whole()?)),
            Op::OpenInterface => Command::OpenInterface(self.trackball()?),
            Op::NominalPosition => Command::NominalPosition(axis_or_all(self.whole()?)?),
            Op::FollowVectors => self.follow_vectors(records)?,
            Op::ReadPort => Command::ReadPort(self.port()?),
            Op::RepeatBroken => Command::RepeatBroken,
            Op::ResolutionOf => {
                Command::Resolution { resolution: self.number()?, axis: Some(self.axis()?) }
            }
            Op::Resolution => Command::Resolution { axis: None, resolution: self.number()? },
            Op::Range => {
                Command::Range { min: self.whole()?, max: self.whole()?, axis: self.axis()? }
            }
            Op::DrillingTimes => Command::DrillingTimes(self.times()?),
            Op::MillingTimes => Command::MillingTimes(self.times()?),
            Op::SettlingTime => Command::SettlingTime(self.time()?),
            Op::Wait => Command::Wait(self.time()?),
            Op::AxisSpeed => Command::AxisSpeed { speed: self.whole()?, axis: self.axis()? },
            Op::TravelSpeed => Command::TravelSpeed(self.whole()?),
            Op::ZSpeed => Command::ZSpeed(self.whole()?),
            Op::WritePort => Command::WritePort { port: self.port()?, data: self.word()? },
            Op::MoveAxisAbsolute => {
                Command::MoveAxisAbsolute { to: self.whole()?, axis: self.axis()? }
            }
            Op::MoveZAbsolute => Command::MoveZAbsolute(self.whole()?),
            Op::MoveAxisRelative => {
                Command::MoveAxisRelative { by: self.whole()?, axis: self.axis()? }
            }
            Op::MoveZRelative => Command::MoveZRelative(self.whole()?),
            Op::ClearBuffer => Command::ClearBuffer,
            Op::GoOn => Command::GoOn,
            Op::Repeat => Command::Repeat,
            Op::Stop => Command::Stop,
            Op::SpaceAbsolute => Command::SpaceAbsolute(self.space()?),
            Op::SpaceRelative => Command::SpaceRelative(self.space()?),
        })
    }

    fn number(&mut self) -> Result<Number, Status> {
        let number = self.values.get(self.at).copied().ok_or(Status::MissingParameter)?;
        self.at += 1;
        Ok(number)
    }

    fn whole(&mut self) -> Result<i32, Status> {
        self.number().map(Number::whole)
    }

    /// At most a turn, either way.
    fn angle(&mut self) -> Result<i64, Status> {
        let angle = self.number()?.millionths;
        if angle.saturating_abs() > TURN { Err(Status::MissingParameter) } else { Ok(angle) }
    }

    fn space(&mut self) -> Result<[i32; 3], Status> {
        Ok([self.whole()?, self.whole()?, self.whole()?])
    }

    fn pair(&mut self) -> Result<[i32; 2], Status> {
        Ok([self.whole()?, self.whole()?])
    }

    fn pairs(&self) -> Vec<[i32; 2]> {
        let whole = |pair: &[Number]| [pair[0].whole(), pair[1].whole()];
        self.values.chunks_exact(2).map(whole).collect()
    }

    fn all_axes(&mut self) -> Result<[i32; 6], Status> {
        let mut positions = [0; 6];
        for position in &mut positions {
            *position = self.whole()?;
        }
        Ok(positions)
    }

    fn time(&mut self) -> Result<u32, Status> {
        Ok(u32::try_from(self.whole()?).unwrap_or(0))
    }

    fn times(&mut self) -> Result<[u32; 4], Status> {
        Ok([self.time()?, self.time()?, self.time()?, self.time()?])
    }

    fn switch(&mut self) -> Result<bool, Status> {
        Ok(self.whole()? != 0)
    }

    fn axis(&mut self) -> Result<Axis, Status> {
        let number = self.whole()?;
        usize::try_from(number).ok().and_then(Axis::from_index).ok_or(Status::NoSuchAxis)
    }

    fn actual_position(&mut self) -> Result<Command, Status> {
        const UNTRIGGERED: i32 = 100;
        let number = self.whole()?;
        let triggered = number < UNTRIGGERED;
        let number = if triggered { number } else { number - UNTRIGGERED };
        Ok(Command::ActualPosition { axis: axis_or_all(number)?, triggered })
    }

    fn trackball(&mut self) -> Result<Trackball, Status> {
        match self.whole()? {
            1 => Ok(Trackball::MoveAndReport),
            2 => Ok(Trackball::Move),
            3 => Ok(Trackball::Report),
            _ => Err(self.or_missing(Status::NoSuchInterface)),
        }
    }

    fn port(&mut self) -> Result<u8, Status> {
        u8::try_from(self.whole()?).map_err(|_| self.or_missing(Status::NoSuchIoModule))
    }

    fn word(&mut self) -> Result<u16, Status> {
        let [.., high, low] = self.whole()?.to_be_bytes();
        Ok(u16::from_be_bytes([high, low]))
    }

    /// This status, or the one sent in its place by a model that lacks it.
    fn or_missing(&self, status: Status) -> Status {
        if status.known_to(self.model) { status } else { Status::MissingParameter }
    }

    fn follow_vectors(&mut self, records: &[u8]) -> Result<Command, Status> {
        let axes = [self.axis()?, self.axis()?];
        // Assumed: a plane needs two axes.
        if axes[0] == axes[1] {
            return Err(Status::NoSuchAxis);
        }
        let vectors = vectors(records)?;
        match vectors.len() {
            0 => Err(Status::MissingParameter),
            1..=VECTORS_MAX => Ok(Command::FollowVectors { axes, vectors }),
            _ => Err(Status::VectorBufferFull),
        }
    }
}

/// The axis of a number that counts from 1, with 0 for all.
fn axis_or_all(number: i32) -> Result<Option<Axis>, Status> {
    match usize::try_from(number) {
        Ok(0) => Ok(None),
        Ok(number) => Axis::from_index(number - 1).map(Some).ok_or(Status::NoSuchAxis),
        Err(_) => Err(Status::NoSuchAxis),
    }
}

/// The records of `!PH`, each ended by a CR or by the end of the command. Empty lines are not
/// records.
fn vectors(records: &[u8]) -> Result<Vec<Vector>, Status> {
    let says_something =
        |line: &&[u8]| line.iter().any(u8::is_ascii_uppercase) || numbers(line).next().is_some();
    records.split(|&byte| byte == b'\r').filter(says_something).map(vector).collect()
}

/// One record: letters, each with its value. A letter without a number is 0 (assumed); a
/// number without a letter, a letter twice and a letter that is none of the six are too much.
fn vector(line: &[u8]) -> Result<Vector, Status> {
    let first = line.iter().position(u8::is_ascii_uppercase).unwrap_or(line.len());
    if numbers(&line[..first]).next().is_some() {
        return Err(Status::TooManyVectorParameters);
    }
    let mut values = [None; VECTOR_LETTERS.len()];
    let mut rest = &line[first..];
    while let Some((letter, after)) = rest.split_first() {
        let end = after.iter().position(u8::is_ascii_uppercase).unwrap_or(after.len());
        let mut numbers = numbers(&after[..end]);
        let value = numbers.next().map_or(0, Number::whole);
        let place = VECTOR_LETTERS.iter().position(|known| known == letter);
        match place.map(|place| &mut values[place]) {
            Some(free @ None) if numbers.next().is_none() => *free = Some(value),
            _ => return Err(Status::TooManyVectorParameters),
        }
        rest = &after[end..];
    }
    let [x, y, i, j, f, o] = values.map(Option::unwrap_or_default);
    // Assumed: of the orientation only the sign counts.
    let turn = match o.signum() {
        1 => Turn::Counterclockwise,
        -1 => Turn::Clockwise,
        _ => Turn::Straight,
    };
    Ok(Vector { end: [x, y], centre: [i, j], speed_change: f, turn })
}

/// The letters of a record: end, centre, change of speed, orientation.
const VECTOR_LETTERS: [u8; 6] = *b"XYIJFO";
