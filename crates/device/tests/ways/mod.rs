// A cart that goes every way there is at once: all must lead to the same.

use std::time::Duration;

use vimc4_device::{Device, Harness, Input, Kinds, Line, Output, Time};

use crate::cart::Cart;
use crate::pieces::in_pieces;

pub(crate) struct Ways<'p, P: Iterator<Item = &'p u64>> {
    pub(crate) whole: Harness<Line<Cart>>,
    watched: Harness<Line<Cart>>,
    pieced: Harness<Line<Cart>>,
    pieces: P,
    planned: Harness<Line<Cart>>,
    restored: Harness<Line<Cart>>,
}

impl<'p, P: Iterator<Item = &'p u64>> Ways<'p, P> {
    /// With the lengths in µs of the pieces in which time passes for one of them.
    pub(crate) fn new(paced: bool, pieces: P) -> Self {
        let line = match paced {
            true => Line::paced(Cart::default()),
            false => Line::ideal(Cart::default()),
        };
        let whole = Harness::new(line);
        let watched = whole.clone().watching(Kinds::ALL);
        let [pieced, planned, restored] = std::array::from_fn(|_| whole.clone());
        Ways { whole, watched, pieced, pieces, planned, restored }
    }

    /// Gives an input at a time.
    pub(crate) fn give(&mut self, when: Time, input: Input<'_>) {
        for harness in [&mut self.whole, &mut self.watched] {
            harness.run_to(when);
            harness.input(input);
        }
        in_pieces(&mut self.pieced, when, &mut self.pieces, input);
        self.planned.plan(when, input);
        self.restored.run_to(when);
        written_down(&mut self.restored);
        self.restored.input(input);
        written_down(&mut self.restored);
    }

    /// Holds that all have sent the same, and are in the same state at the end.
    pub(crate) fn meet(&mut self, end: Time) {
        while self.planned.planned().is_some() {
            self.planned.step();
        }
        let wanted = sent(&mut self.whole, end);
        for (way, harness) in [
            ("watched", &mut self.watched),
            ("in pieces", &mut self.pieced),
            ("planned", &mut self.planned),
            ("restored", &mut self.restored),
        ] {
            assert_eq!(sent(harness, end), wanted, "{way}");
            assert_eq!(harness.device().state(), self.whole.device().state(), "{way}");
        }
    }

    /// Lets a second pass after the last of it, and holds that nothing is wrong any more.
    pub(crate) fn nothing_is_left(&mut self) {
        self.whole.run_to(self.whole.now() + Duration::from_secs(1));
        let line = self.whole.device();
        assert!(line.faults().is_empty() && line.rules().is_empty());
    }
}

/// Puts it into the state that was written down and read again.
fn written_down(harness: &mut Harness<Line<Cart>>) {
    let state = serde_json::to_string(&harness.device().state()).unwrap();
    harness.restore(serde_json::from_str(&state).unwrap());
}

/// The bytes that were sent up to the end, each with its time.
fn sent(harness: &mut Harness<Line<Cart>>, end: Time) -> Vec<(Time, u8)> {
    harness.run_to(end);
    let mut bytes = Vec::new();
    for output in harness.outputs() {
        if let Output::Bytes(at, piece) = output {
            bytes.extend(piece.iter().map(|byte| (*at, *byte)));
        }
    }
    bytes
}
