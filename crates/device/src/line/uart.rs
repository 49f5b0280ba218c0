//! How a receiver reads bits.

/// What is read when a spike so many bits before a byte, 1 to 8, is taken for its start bit, and the
/// line is high before and after: each byte, and whether it has its stop bit.
pub(super) fn read_early(byte: u8, early: u32) -> Vec<(u8, bool)> {
    // The line from the spike on, a bit each, the first one lowest: the spike, the idle line, the
    // start bit, the data and a line that is high for ever.
    let early = early.clamp(1, 8);
    let idle = (1_u64 << early) - 2;
    let line = idle | u64::from(byte) << (early + 1) | !0 << (early + 9);
    let level = |bit: u32| line.checked_shr(bit).is_none_or(|rest| rest & 1 == 1);
    let mut read = Vec::new();
    let mut from = Some(0);
    while let Some(start) = from {
        let data = (0..8).fold(0, |data, bit| data | u8::from(level(start + 1 + bit)) << bit);
        let stop = start + 9;
        read.push((data, level(stop)));
        // Another byte begins where the line falls.
        from = (stop..40).find(|bit| level(*bit) && !level(bit + 1)).map(|bit| bit + 1);
    }
    read
}
