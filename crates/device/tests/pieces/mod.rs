// A harness that gets where it is to go in many pieces.

use std::time::Duration;

use vimc4_device::{Device, Harness, Input, Time};

/// Goes to a time in pieces of these lengths in µs, and gives an input there, bytes one by one.
pub(crate) fn in_pieces<'p, D: Device>(
    harness: &mut Harness<D>,
    when: Time,
    mut pieces: impl Iterator<Item = &'p u64>,
    input: Input<'_>,
) {
    while harness.now() < when {
        let piece = pieces.next().map_or(Duration::MAX, |micros| Duration::from_micros(*micros));
        harness.advance(piece.min(when - harness.now()));
    }
    match input {
        Input::Bytes(bytes) => bytes.iter().for_each(|byte| harness.send(&[*byte])),
        other => harness.input(other),
    }
}
