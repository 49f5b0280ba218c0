//! From bytes to commands, one byte at a time.
//!
//! A command is two capital letters, or `!` and two, and then anything that is not a capital letter
//! and no `!`: digits, signs and points are its numbers, and every other byte, lower-case letters
//! too, separates them. It is complete
//!
//! - with its last letter, if no model has a form of it with parameters: `IN`, `PD`, `!ST` act
//!   at once;
//! - at `;` or CR, which belong to no command;
//! - at the next capital letter or `!`, with which the next command begins.
//!
//! LF separates, or ends a command as CR does: [`Grammar::line_feed_ends`]. `OH` ends at a colon, too.
//!
//! `!PH` is the exception: its records stand between CRs and are made of letters, so it ends at `;`
//! only, or at a `!` (assumed: a host that gave up begins again). The SMCU, which does not know the
//! command, does not know its records either: each letter of them begins an unknown command.
//!
//! Letters that are interrupted by anything but a letter are an unknown command, and so is a `!` on
//! its own. Numbers outside a command are ignored, unless [`Grammar::bare_pairs`] makes them moves,
//! and so are those of an unknown command, unless [`Grammar::unknown_pairs`] does.
//!
//! Once `!OC` has been read every byte is for the unit on the second channel, until `!CC`.

use std::mem;

use serde::{Deserialize, Serialize};

use super::command::Command;
use super::dialect::Dialect;
use super::grammar::Grammar;
use super::number::{Number, numbers};
use super::parse::{letters, parse};
use super::status::Status;
use super::table;

/// The longest command that is kept, in bytes, its end not counted.
///
/// Assumed. It must be enough for a `!PH` with the most possible records, each with six numbers of
/// 32 bits, and some blanks.
pub const COMMAND_MAX: usize = 8192;

/// Commands are rarely longer than this, in bytes, so one allocation for each is enough.
const COMMAND_USUAL: usize = 64;

/// How much meaningless input is kept.
const OUTSIDE_MAX: usize = 101;

/// What closes the second channel.
const CLOSE_CHANNEL: &[u8] = b"!CC";

/// What the bytes of a line mean. `R` are the bytes of a command, owned or borrowed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Item<R = Vec<u8>> {
    /// A command is complete.
    Command {
        /// Its bytes, without the end and the blanks before it.
        raw: R,
        /// What it means, or the status that refuses it.
        command: Result<Command, Status>,
    },
    /// A command with more than [`COMMAND_MAX`] bytes is complete; they are gone.
    TooLong,
    /// A byte for the unit on the second channel.
    Through(u8),
}

impl Item<&[u8]> {
    /// The same with bytes of its own.
    #[must_use]
    pub fn into_owned(self) -> Item {
        match self {
            Item::Command { raw, command } => Item::Command { raw: raw.to_vec(), command },
            Item::TooLong => Item::TooLong,
            Item::Through(byte) => Item::Through(byte),
        }
    }
}

/// Reads what arrives on the line of a controller.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reader {
    grammar: Grammar,
    /// Whether bare pairs are ways, because the last move was `PR`.
    relative: bool,
    /// The command that has been begun.
    raw: Vec<u8>,
    /// It has more than [`COMMAND_MAX`] bytes; `raw` has the first of them.
    too_long: bool,
    /// While the second channel is open, how much of [`CLOSE_CHANNEL`] has just been read.
    channel: Option<usize>,
    /// Numbers outside a command are being ignored.
    ignores: bool,
    /// That has not been reported yet.
    stray: bool,
    /// The input outside a command since the last end or command, as far as it is kept.
    outside: Vec<u8>,
    /// A command or an end has come after it.
    is_past: bool,
}

impl Reader {
    /// A line on which nothing has arrived yet.
    #[must_use]
    pub fn new(grammar: impl Into<Grammar>) -> Self {
        Self {
            grammar: grammar.into(),
            relative: false,
            raw: Vec::new(),
            too_long: false,
            channel: None,
            ignores: false,
            stray: false,
            outside: Vec::new(),
            is_past: false,
        }
    }

    /// Takes one byte and yields the items that it completes, in order; mostly none.
    pub fn feed(&mut self, byte: u8, mut emit: impl FnMut(Item)) {
        self.read(byte, |item| emit(item.into_owned()));
    }

    /// The same, with the bytes of a command lent while it is visited.
    pub fn read(&mut self, byte: u8, emit: impl FnMut(Item<&[u8]>)) {
        if self.channel.is_some() {
            return self.pass(byte, emit);
        }
        match byte {
            b'!' => self.begin(byte, emit),
            b'A'..=b'Z' if self.in_vectors() || self.takes_letter() => self.push(byte, emit),
            b'A'..=b'Z' => self.begin(byte, emit),
            b'\r' if self.in_vectors() => self.push(byte, emit),
            b';' | b'\r' => self.end_here(emit),
            b'\n' if self.grammar.line_feed_ends && !self.in_vectors() => self.end_here(emit),
            b':' if self.raw.starts_with(b"OH") => self.end_here(emit),
            b'0'..=b'9' | b'+' | b'-' | b'.' if self.grammar.bare_pairs => self.push(byte, emit),
            // Input before the first command, or after the end of one, means nothing.
            _ if self.raw.is_empty() => {
                self.stray |= byte.is_ascii_digit() && !self.ignores;
                self.ignores |= self.stray;
                let begins = !byte.is_ascii_whitespace() && !b",.+-\0".contains(&byte);
                if (begins || !self.outside.is_empty()) && self.outside.len() < OUTSIDE_MAX {
                    self.outside.push(byte);
                }
            }
            _ => self.push(byte, emit),
        }
    }

    /// Whether nothing of a command has arrived and the second channel is closed.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.raw.is_empty() && self.channel.is_none()
    }

    /// The command that has been begun, as far as it is kept.
    #[must_use]
    pub fn pending(&self) -> &[u8] {
        &self.raw
    }

    /// Whether numbers outside a command have been ignored since the last call.
    pub fn take_stray(&mut self) -> bool {
        mem::take(&mut self.stray)
    }

    /// The meaningless input outside a command since the last call, once a command or an end has
    /// come after it: letters, digits and the like, shortened to a readable length. Blanks, commas
    /// and signs on their own do not count.
    pub fn take_ignored(&mut self) -> Option<Vec<u8>> {
        mem::take(&mut self.is_past).then(|| mem::take(&mut self.outside))
    }

    /// Whether what arrives is for the unit on the second channel.
    #[must_use]
    pub const fn channel_open(&self) -> bool {
        self.channel.is_some()
    }

    /// Closes the second channel, because the `!OC` that was read is refused.
    pub fn close_channel(&mut self) {
        // The possible beginning of `!CC` is now the beginning of a command.
        if let Some(held) = self.channel.take() {
            self.raw.extend_from_slice(&CLOSE_CHANNEL[..held]);
        }
    }

    /// Whether a letter that comes now belongs to the letters of the command.
    fn takes_letter(&self) -> bool {
        let rest = self.raw.strip_prefix(b"!").unwrap_or(&self.raw);
        !self.raw.is_empty() && rest.len() < 2 && rest.iter().all(u8::is_ascii_uppercase)
    }

    /// Whether the command is one with records.
    fn in_vectors(&self) -> bool {
        self.grammar.dialect == Dialect::MotionSystem && self.raw.starts_with(b"!PH")
    }

    /// Takes a byte that ends the command before it and belongs to none.
    fn end_here(&mut self, mut emit: impl FnMut(Item<&[u8]>)) {
        self.ignores = false;
        self.is_past = !self.outside.is_empty();
        self.end(&mut emit);
    }

    /// Takes a byte that cannot belong to the command before it.
    fn begin(&mut self, byte: u8, mut emit: impl FnMut(Item<&[u8]>)) {
        self.ignores = false;
        self.end(&mut emit);
        // The command before it may have opened the channel.
        if self.channel.is_some() { self.pass(byte, emit) } else { self.push(byte, emit) }
    }

    fn push(&mut self, byte: u8, mut emit: impl FnMut(Item<&[u8]>)) {
        if self.raw.len() >= COMMAND_MAX {
            self.too_long = true;
            return;
        }
        if self.raw.is_empty() {
            self.is_past = !self.outside.is_empty();
            self.raw.reserve(COMMAND_USUAL);
        }
        self.raw.push(byte);
        if byte.is_ascii_uppercase() && table::is_complete(&self.raw) {
            self.end(&mut emit);
        }
    }

    /// Ends the command that has been begun, if one has.
    fn end(&mut self, emit: &mut impl FnMut(Item<&[u8]>)) {
        if self.raw.is_empty() {
            return;
        }
        let mut bytes = mem::take(&mut self.raw);
        self.end_with(bytes.trim_ascii_end(), emit);
        // The memory is kept for the next command, unless this was a very long one.
        if bytes.capacity() <= 4 * COMMAND_USUAL {
            bytes.clear();
            self.raw = bytes;
        }
    }

    fn end_with(&mut self, raw: &[u8], emit: &mut impl FnMut(Item<&[u8]>)) {
        let too_long = mem::take(&mut self.too_long);
        // A sign or a point on its own is not a pair.
        if letters(raw).is_empty() && numbers(raw).next().is_none() {
            return;
        }
        if too_long {
            // A `!PH` that long has more records than there is room for.
            let dialect = self.grammar.dialect;
            return emit(if raw.starts_with(b"!PH") && dialect == Dialect::MotionSystem {
                Item::Command { raw: &raw[..3], command: Err(Status::VectorBufferFull) }
            } else {
                Item::TooLong
            });
        }
        let command = self.understand(raw);
        match &command {
            Ok(Command::OpenChannel(_)) => self.channel = Some(0),
            Ok(Command::Initialize | Command::PlotAbsolute(_)) => self.relative = false,
            Ok(Command::PlotRelative(_)) => self.relative = true,
            _ => {}
        }
        emit(Item::Command { raw, command });
    }

    /// What the bytes of one command mean, which begin with its letters, or with its first number
    /// if they are a move without any.
    ///
    /// # Errors
    ///
    /// The status that refuses it, as [`parse`] finds it.
    pub fn understand(&self, raw: &[u8]) -> Result<Command, Status> {
        let letters = letters(raw);
        if letters.is_empty() {
            return self.move_by(numbers(raw));
        }
        match parse(raw, self.grammar) {
            Err(Status::UnknownCommand) if self.grammar.unknown_pairs => {
                let numbers: Vec<Number> = numbers(&raw[letters.len()..]).collect();
                let whole = numbers.len() & !1;
                if whole == 0 {
                    return Err(Status::UnknownCommand);
                }
                self.move_by(numbers.into_iter().take(whole))
            }
            command => command,
        }
    }

    /// The move that numbers without a command are.
    fn move_by(&self, numbers: impl Iterator<Item = Number>) -> Result<Command, Status> {
        let numbers: Vec<i32> = numbers.map(Number::whole).collect();
        let (pairs, rest) = numbers.as_chunks::<2>();
        match (pairs, rest, self.relative) {
            ([], [], _) => Err(Status::MissingParameter),
            (_, [_, ..], _) => Err(Status::SingleCoordinate),
            (pairs, _, false) => Ok(Command::PlotAbsolute(pairs.to_vec())),
            (pairs, _, true) => Ok(Command::PlotRelative(pairs.to_vec())),
        }
    }

    /// Takes a byte while the second channel is open.
    fn pass(&mut self, byte: u8, mut emit: impl FnMut(Item<&[u8]>)) {
        let held = self.channel.unwrap_or_default();
        if CLOSE_CHANNEL.get(held) == Some(&byte) {
            self.channel = Some(held + 1);
            if held + 1 == CLOSE_CHANNEL.len() {
                self.channel = None;
                self.raw.extend_from_slice(CLOSE_CHANNEL);
            }
            return;
        }
        // It was not the end after all. Only a `!` can be the beginning of it.
        CLOSE_CHANNEL.iter().take(held).for_each(|&byte| emit(Item::Through(byte)));
        self.channel = Some(usize::from(byte == CLOSE_CHANNEL[0]));
        if byte != CLOSE_CHANNEL[0] {
            emit(Item::Through(byte));
        }
    }
}
