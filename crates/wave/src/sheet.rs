//! What is drawn on.

use vimc4_device::Time;

use crate::scene::{Id, Scene, Span, Value};

/// Something that is drawn on: a file of one format, as it grows. Times never go back.
pub trait Sheet: Send {
    /// The signals; the value of each follows, at this time.
    fn begin(&mut self, scene: &Scene, at: Time);

    /// A signal takes another value.
    fn set(&mut self, at: Time, signal: Id, value: Value<'_>);

    /// Something was done that took this long. It may have begun before what was drawn last.
    fn span(&mut self, _span: &Span<'_>) {}

    /// Writes everything that has been drawn. A program that is killed afterwards leaves a file that
    /// opens up to here.
    fn flush(&mut self);

    /// Nothing more comes; the last values hold up to then.
    fn end(&mut self, at: Time);
}

/// Where the bytes of a sheet go, in large pieces. The owner handles write errors.
pub trait Paper: Send {
    /// Appends bytes to those of earlier calls of `put`.
    fn put(&mut self, bytes: &[u8]);

    /// Writes bytes at this offset from the beginning, over bytes that are there or behind the last
    /// one. The next [`put`](Paper::put) still appends to the last `put`. Output that has no offsets,
    /// such as a pipe, ignores it.
    fn put_at(&mut self, offset: u64, bytes: &[u8]);
}

/// How much is collected before it is written.
const PIECE: usize = 1 << 16;

/// A buffer in front of paper.
pub(crate) struct Ink<P> {
    pub(crate) text: Vec<u8>,
    paper: P,
    /// How many bytes have been written.
    written: u64,
}

impl<P: Paper> Ink<P> {
    pub(crate) fn new(paper: P) -> Ink<P> {
        Ink { text: Vec::with_capacity(PIECE + PIECE / 4), paper, written: 0 }
    }

    pub(crate) fn put(&mut self, text: &[u8]) {
        self.text.extend_from_slice(text);
    }

    /// Writes what has been collected, if it is much.
    pub(crate) fn flow(&mut self) {
        if self.is_full() {
            self.dry();
        }
    }

    /// Whether much has been collected.
    pub(crate) fn is_full(&self) -> bool {
        self.text.len() >= PIECE
    }

    /// Writes what has been collected.
    pub(crate) fn dry(&mut self) {
        self.paper.put(&self.text);
        self.written += self.text.len() as u64;
        self.text.clear();
    }

    /// How many bytes have been written, without those that are still collected.
    pub(crate) fn written(&self) -> u64 {
        self.written
    }

    /// Writes at an offset.
    pub(crate) fn put_at(&mut self, offset: u64, bytes: &[u8]) {
        self.paper.put_at(offset, bytes);
    }
}

/// Adds a number in decimal digits.
pub(crate) fn put_decimal(text: &mut Vec<u8>, number: u64) {
    let mut digits = [0; 20];
    let (mut place, mut rest) = (digits.len(), number);
    loop {
        place -= 1;
        if let Some(digit) = digits.get_mut(place) {
            *digit = b'0' + (rest % 10) as u8;
        }
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    text.extend_from_slice(digits.get(place..).unwrap_or_default());
}

/// Adds a number in decimal digits, with its sign if it is below 0.
pub(crate) fn put_signed(text: &mut Vec<u8>, number: i64) {
    if number < 0 {
        text.push(b'-');
    }
    put_decimal(text, number.unsigned_abs());
}
