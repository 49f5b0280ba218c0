//! The unit on the second channel of LPKF's controllers: a spindle's.

use std::time::Duration;

/// How long a unit may take to answer.
pub(crate) const UNIT: Duration = Duration::from_millis(300);

/// How long a spindle may take until it has its speed.
pub(crate) const RUN_UP: Duration = Duration::from_secs(30);

/// Whether the unit says later that it has done what a line asks for: `!RM` lets the spindle run.
pub(crate) fn passes_later(line: &[u8]) -> bool {
    line.trim_ascii_start().starts_with(b"!RM")
}

/// Whether it has said so, or that it cannot: `8`, `9` for standstill, `1`, `2`.
pub(crate) fn passed(said: &[u8]) -> bool {
    let mut lines = said.split(|byte| *byte == b'\r');
    lines.any(|line| matches!(line.trim_ascii(), b"8" | b"9" | b"1" | b"2"))
}
