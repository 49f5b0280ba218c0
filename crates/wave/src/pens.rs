//! Several sheets that are drawn on at once.

use vimc4_device::Time;

use crate::scene::{Id, Scene, Span, Value};
use crate::sheet::Sheet;

/// The sheets, and the time up to which they are drawn.
pub(crate) struct Pens {
    sheets: Vec<Box<dyn Sheet>>,
    last: Time,
}

impl Pens {
    pub(crate) fn new(sheets: Vec<Box<dyn Sheet>>) -> Pens {
        Pens { sheets, last: Time::ZERO }
    }

    pub(crate) fn begin(&mut self, scene: &Scene, at: Time) {
        self.last = at;
        self.sheets.iter_mut().for_each(|sheet| sheet.begin(scene, at));
    }

    #[inline]
    pub(crate) fn set(&mut self, at: Time, signal: Id, value: Value<'_>) {
        debug_assert!(at >= self.last, "{at} is before {}", self.last);
        self.last = at.max(self.last);
        for sheet in &mut self.sheets {
            sheet.set(self.last, signal, value);
        }
    }

    pub(crate) fn span(&mut self, span: &Span<'_>) {
        self.sheets.iter_mut().for_each(|sheet| sheet.span(span));
    }

    /// Writes what has been drawn on all of them.
    pub(crate) fn flush(&mut self) {
        self.sheets.iter_mut().for_each(|sheet| sheet.flush());
    }

    /// Ends all of them.
    pub(crate) fn end(&mut self, at: Time) {
        self.sheets.iter_mut().for_each(|sheet| sheet.end(at.max(self.last)));
    }
}
