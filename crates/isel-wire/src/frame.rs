//! The grammar: from a line to a command and its fields.
//!
//! A line is split before any of its numbers is read. Whether the letter is known, how many
//! fields there are and whether they are numbers are three questions with three answers (`5`,
//! `7`, `1`), and a grammar that read numbers at once would mistake an illegal digit for the end
//! of the fields.

use nom::Parser;
use nom::character::complete::char;
use nom::combinator::verify;
use nom::number::complete::be_u8;
use nom::sequence::{delimited, preceded};

use crate::dialect::{Dialect, Fractions, Mode};
use crate::fault::Fault;
use crate::number::{self, Parsed, blanks};
use crate::table::{self, CommandSpec, Op};

/// A line split, before its numbers are read.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    spec: &'static CommandSpec,
    /// What follows the letter: fields and commas, the code of a diagnosis, the text of `IU`.
    rest: &'a [u8],
    count: usize,
}

/// The addressee of a line.
#[derive(Clone, Copy, Debug)]
pub enum Addressed<'a> {
    /// For this controller.
    Frame(Frame<'a>),
    /// For a controller with another number: no answer and no effect, regardless of what follows.
    OtherDevice,
}

/// Splits a line, given without its CR.
///
/// `device` is the number the controller listens to, 0 to 9; stored lines carry none.
/// Blanks between tokens mean nothing.
///
/// # Errors
///
/// For a direct line [`Fault::NoAddress`]: it does not begin with `@` and a digit, or
/// [`Fault::NoCommand`]: the letter or code is unknown or missing. Of a stored line
/// [`Fault::NotStorable`]: the code cannot be stored, which includes every line that begins with
/// `@`.
pub fn parse<'a>(
    line: &'a [u8],
    dialect: Dialect,
    mode: Mode,
    device: u8,
) -> Result<Addressed<'a>, Fault> {
    match mode {
        Mode::Direct => {
            let (body, digit) = address(line).map_err(|_| Fault::NoAddress)?;
            if digit != device {
                return Ok(Addressed::OtherDevice);
            }
            direct(body, dialect).ok_or(Fault::NoCommand)
        }
        Mode::Stored => stored(line, dialect).ok_or(Fault::NotStorable),
    }
    .map(Addressed::Frame)
}

/// `@` and the device number.
fn address(line: &[u8]) -> Parsed<'_, u8> {
    let digit = verify(token, u8::is_ascii_digit).map(|digit| digit - b'0');
    preceded(delimited(blanks, char('@'), blanks), digit).parse(line)
}

/// One byte and the blanks before it.
fn token(input: &[u8]) -> Parsed<'_, u8> {
    preceded(blanks, be_u8).parse(input)
}

/// What follows the device number.
fn direct(body: &[u8], dialect: Dialect) -> Option<Frame<'_>> {
    let (rest, letter) = token(body).ok()?;
    if matches!(letter, b'0'..=b'9' | b'+' | b'-') {
        // The number of axes stands where other commands have their letter.
        let spec = table::spec(dialect, Mode::Direct, Op::SetAxes)?;
        return Some(Frame::with_fields(spec, body));
    }
    let vocabulary = table::vocabulary(dialect, Mode::Direct);
    if letter == b'I' {
        let (rest, code) = token(rest).ok()?;
        let spec = vocabulary.init(code)?;
        return Some(match spec.op {
            Op::InitUserInfo => Frame::with_text(spec, rest),
            _ => Frame::with_fields(spec, rest),
        });
    }
    let spec = vocabulary.command(letter)?;
    if spec.op == Op::Diagnosis {
        let code = <[u8; 2]>::try_from(trim(rest)).ok()?;
        return table::knows_diagnosis(dialect, code).then(|| Frame::with_text(spec, trim(rest)));
    }
    Some(Frame::with_fields(spec, rest))
}

/// A line of the data field.
fn stored(line: &[u8], dialect: Dialect) -> Option<Frame<'_>> {
    let (rest, code) = token(line).ok()?;
    let spec = table::vocabulary(dialect, Mode::Stored).command(code)?;
    Some(Frame::with_fields(spec, rest))
}

/// Without the blanks at both ends.
fn trim(mut text: &[u8]) -> &[u8] {
    while let [b' ', inner @ ..] | [inner @ .., b' '] = text {
        text = inner;
    }
    text
}

impl<'a> Frame<'a> {
    fn with_fields(spec: &'static CommandSpec, rest: &'a [u8]) -> Self {
        let count = if rest.iter().all(|&byte| byte == b' ') {
            0
        } else {
            1 + rest.iter().filter(|&&byte| byte == b',').count()
        };
        Self { spec, rest, count }
    }

    /// A diagnosis or a text: its commas separate nothing.
    fn with_text(spec: &'static CommandSpec, rest: &'a [u8]) -> Self {
        Self { spec, rest, count: 0 }
    }

    /// The operation.
    #[must_use]
    pub fn op(&self) -> Op {
        self.spec.op
    }

    /// Its row in the table of the dialect and mode.
    #[must_use]
    pub fn spec(&self) -> &'static CommandSpec {
        self.spec
    }

    /// How many fields there are: none if nothing follows the letter, else one more than there
    /// are commas. The code of a diagnosis and the text of `IU` are no fields.
    #[must_use]
    pub fn field_count(&self) -> usize {
        self.count
    }

    /// Reads one field, counted from 0, without asking for its range; `None` if there is no
    /// such field or it is not a number.
    ///
    /// This lets the caller look ahead, to see whether a port is the spindle for example.
    /// Numbers too large for an `i64` come out as the largest or smallest there is.
    #[must_use]
    pub fn number(&self, index: usize, fractions: Fractions) -> Option<i64> {
        number::read(self.fields().nth(index)?, fractions)
    }

    /// The bytes of one field as they were sent, without the blanks around it.
    #[must_use]
    pub fn field(&self, index: usize) -> Option<&'a [u8]> {
        self.fields().nth(index).map(trim)
    }

    /// The fields one after the other.
    pub(crate) fn fields(&self) -> impl Iterator<Item = &'a [u8]> {
        self.rest.split(|&byte| byte == b',').take(self.count)
    }

    /// What follows the letter of a command that has no fields.
    pub(crate) fn text(&self) -> &'a [u8] {
        self.rest
    }
}
