//! The bits of the characters on one wire of the serial line.

use std::collections::VecDeque;

use bytes::Bytes;
use vimc4_device::{Time, escape};

use crate::pens::Pens;
use crate::scene::{Id, Value};

/// A start bit, eight data bits with the lowest first, and a stop bit.
const BITS: u64 = 10;

/// How many characters may wait for the wire. Without pacing, a program can send more than the line
/// would ever carry.
const WAITING: u64 = 1 << 14;

/// What the text of the wire says where characters are left out.
const LEFT_OUT: &str = "left out: faster than the line";

/// One wire, which is high when nothing is on it.
#[derive(Debug)]
pub(crate) struct Uart {
    /// The bits and the text.
    places: [Id; 2],
    /// Characters that are still to be drawn: when they begin at the earliest, and how fast they are. No
    /// characters are a mark that some were left out.
    queue: VecDeque<(Time, u32, Bytes)>,
    /// When everything in the queue has passed.
    end: Time,
    /// Characters are left out until the wire is free.
    leaves_out: bool,
    /// The character that is being drawn, counted in the first of the queue.
    place: usize,
    /// When the first of the characters began that follow each other without a gap, and how many
    /// of them have passed. Times are computed from there, so that rounding never adds up.
    start: Time,
    passed: u64,
    baud: u32,
    /// The bit that comes next; after the last one the character ends.
    bit: u64,
    is_high: bool,
    /// When the wire is free again.
    free: Time,
}

impl Uart {
    pub(crate) fn new(places: [Id; 2]) -> Uart {
        Uart {
            places,
            queue: VecDeque::new(),
            end: Time::ZERO,
            leaves_out: false,
            place: 0,
            start: Time::ZERO,
            passed: 0,
            baud: 1,
            bit: 0,
            is_high: true,
            free: Time::ZERO,
        }
    }

    /// Characters begin then, or when the wire is free. Where too many wait already, they are left out
    /// until the wire is free again. That depends only on the times at which characters come, so a
    /// recording is drawn as the controller was.
    pub(crate) fn push(&mut self, at: Time, baud: u32, bytes: &Bytes) {
        if bytes.is_empty() {
            return;
        }
        let was_left_out = self.leaves_out;
        self.leaves_out = match was_left_out {
            true => at < self.end,
            false => self.end.nanos_since(at) > span(BITS * WAITING, baud),
        };
        if !self.leaves_out {
            let begins = self.end.max(at);
            self.end = begins.after_nanos(span(BITS * bytes.len() as u64, baud));
            self.add(at, baud, bytes.clone());
        } else if !was_left_out {
            self.add(at, baud, Bytes::new());
        }
    }

    fn add(&mut self, at: Time, baud: u32, bytes: Bytes) {
        self.queue.push_back((at, baud.max(1), bytes));
        if self.queue.len() == 1 {
            self.next_character();
        }
    }

    /// When something happens next.
    pub(crate) fn due(&self) -> Time {
        match self.queue.is_empty() {
            true => Time::NEVER,
            false => self.time_of(self.bit),
        }
    }

    fn time_of(&self, bit: u64) -> Time {
        self.start.after_nanos(span(self.passed * BITS + bit, self.baud))
    }

    /// The character at the place is next.
    fn next_character(&mut self) {
        let Some(&(at, baud, ref bytes)) = self.queue.front() else { return };
        self.bit = 0;
        if at >= self.free || baud != self.baud || bytes.is_empty() {
            (self.start, self.passed, self.baud) = (at.max(self.free), 0, baud);
        } else {
            self.passed += 1;
        }
    }

    /// Draws what happens next, at its time.
    pub(crate) fn run(&mut self, pens: &mut Pens) {
        let at = self.due();
        let Some((_, _, bytes)) = self.queue.front() else { return };
        let [line, text] = self.places;
        let Some(&byte) = bytes.get(self.place) else {
            pens.set(at, text, Value::Text(LEFT_OUT));
            self.queue.pop_front();
            return self.next_character();
        };
        let level = match self.bit {
            0 => false,
            1..=8 => byte >> (self.bit - 1) & 1 == 1,
            _ => true,
        };
        if self.bit == 0 {
            pens.set(at, text, Value::Text(&escape(&[byte])));
        }
        if level != self.is_high {
            self.is_high = level;
            pens.set(at, line, Value::Bit(level));
        }
        self.bit += 1;
        if self.bit <= BITS {
            return;
        }
        self.free = at;
        self.place += 1;
        if self.place == bytes.len() {
            self.queue.pop_front();
            self.place = 0;
        }
        self.next_character();
        if self.due() > at {
            pens.set(at, text, Value::Text(""));
        }
    }
}

/// How long this many bits take, in nanoseconds.
pub(crate) fn span(bits: u64, baud: u32) -> u64 {
    let span = (u128::from(bits) * 1_000_000_000).div_ceil(u128::from(baud.max(1)));
    u64::try_from(span).unwrap_or(u64::MAX)
}
