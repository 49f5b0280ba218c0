//! Bits on a line, and how a receiver reads them.
//!
//! The receiver samples the line sixteen times a bit of its own speed, as nearly every UART does. A
//! low line is the edge of a start bit. Half a bit later, eight samples on, the line has to be low
//! still, or it was a spike. From there on it looks once a bit, in the middle: at eight bits of
//! data, and at the stop bit, which has to be high. A byte without a stop bit is read all the same;
//! the next one can only begin when the line has been high again. An idle line is high.
//!
//! Its samples are at whole sixteenths of its bits since the beginning of time, so everything that
//! it reads follows from what is on the line. What it reads next is computed, not searched for
//! sample by sample.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::Time;

/// How many samples the receiver takes in a bit.
const OVERSAMPLING: u128 = 16;

/// The middle of a bit, in samples from its edge on.
const MIDDLE: u128 = OVERSAMPLING / 2;

/// A start bit, eight bits of data and a stop bit.
const FRAME: u64 = 10;

/// The fastest line, bits a second; a higher speed counts as this one.
const FASTEST: u32 = 10_000_000;

const NANOS_IN_A_SECOND: u64 = 1_000_000_000;

const NANOS: u128 = NANOS_IN_A_SECOND as u128;

/// What is on one direction of a line on which both ends have speeds of their own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Wave {
    /// Characters whose bits the receiver may still have to look at.
    sent: VecDeque<Char>,
    /// The sender is not ready for the next character before.
    free: Time,
    /// The receiver looks for a start bit from here on.
    seek: Time,
    /// It has to see the line high before.
    low: bool,
}

/// A character that is sent. Those of a run follow each other without gaps from its beginning on, so that
/// rounding never adds up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Char {
    run: Time,
    place: u64,
    baud: u32,
    byte: u8,
}

/// What a receiver has read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reading {
    /// When it has seen the stop bit, or that there is none.
    pub(super) at: Time,
    pub(super) byte: u8,
    /// Whether there was a stop bit.
    pub(super) whole: bool,
}

impl Char {
    /// The level of one of its bits, 0 to 9.
    fn level(&self, bit: u64) -> bool {
        match bit {
            0 => false,
            1..=8 => self.byte >> (bit - 1) & 1 == 1,
            _ => true,
        }
    }

    /// The first sample of a receiver of this speed at which one of its bits is on the line; of the
    /// tenth, when the character is over.
    fn sample(&self, bit: u64, baud: u32) -> u128 {
        let own = u128::from(self.baud);
        let bits = u128::from(self.place * FRAME + bit) * NANOS;
        let begin = u128::from(self.run.as_nanos()) * own + bits;
        (begin * OVERSAMPLING * u128::from(baud)).div_ceil(NANOS * own)
    }

    fn end(&self) -> Time {
        let bits = u128::from((self.place + 1) * FRAME) * NANOS;
        let span = bits.div_ceil(u128::from(self.baud));
        self.run.after_nanos(u64::try_from(span).unwrap_or(u64::MAX))
    }
}

impl Wave {
    pub(super) fn len(&self) -> usize {
        self.sent.len()
    }

    /// Sends bytes at a speed, as soon as what is being sent is over.
    pub(super) fn push(&mut self, bytes: &[u8], at: Time, baud: u32) {
        let baud = baud.clamp(1, FASTEST);
        for &byte in bytes {
            let follows = self.sent.back().filter(|last| last.baud == baud && at <= self.free);
            let char = match follows {
                Some(last) => Char { place: last.place + 1, byte, ..*last },
                None => Char { run: at.max(self.free), place: 0, baud, byte },
            };
            self.free = char.end();
            self.sent.push_back(char);
        }
    }

    /// The level at a sample of a receiver of this speed.
    fn level(&self, sample: u128, baud: u32) -> bool {
        let Some(char) = self.sent.iter().find(|char| sample < char.sample(FRAME, baud)) else {
            return true;
        };
        let bits = (0..FRAME).take_while(|bit| char.sample(*bit, baud) <= sample);
        // Before its first bit the line is idle.
        bits.last().is_none_or(|bit| char.level(bit))
    }

    /// The first sample from one on at which the line is at a level.
    fn first(&self, level: bool, from: u128, baud: u32) -> Option<u128> {
        if self.level(from, baud) == level {
            return Some(from);
        }
        let edges = self.sent.iter().flat_map(|char| {
            let edge = move |bit: u64| (char.sample(bit, baud), bit == FRAME || char.level(bit));
            (0..=FRAME).map(edge)
        });
        let later = edges.filter(|(sample, to)| *sample > from && *to == level);
        later.map(|(sample, _)| sample).find(|sample| self.level(*sample, baud) == level)
    }

    /// When a receiver of this speed finishes its next byte, or the rest of the line if there is no
    /// byte in it; provided that nothing more is sent.
    pub(super) fn due(&self, baud: u32) -> Option<Time> {
        let last = self.sent.back()?;
        // After this long, nothing that follows can turn a spike into a byte.
        let rest = || last.end().after_nanos(NANOS_IN_A_SECOND / u64::from(baud.max(1)) + 1);
        Some(self.next(baud).map_or_else(rest, |reading| reading.at))
    }

    /// What a receiver of this speed reads next.
    fn next(&self, baud: u32) -> Option<Reading> {
        let baud = baud.clamp(1, FASTEST);
        let rate = OVERSAMPLING * u128::from(baud);
        let mut from = (u128::from(self.seek.as_nanos()) * rate).div_ceil(NANOS);
        if self.low {
            from = self.first(true, from, baud)?;
        }
        loop {
            let edge = self.first(false, from, baud)?;
            let middle = edge + MIDDLE;
            if self.level(middle, baud) {
                from = middle;
                continue;
            }
            let level = |bit: u32| self.level(middle + OVERSAMPLING * u128::from(bit), baud);
            let byte = (0..8).fold(0, |byte, bit| byte | u8::from(level(bit + 1)) << bit);
            let stop = middle + OVERSAMPLING * 9;
            let at = u64::try_from((stop * NANOS).div_ceil(rate)).unwrap_or(u64::MAX);
            return Some(Reading { at: Time::from_nanos(at), byte, whole: level(9) });
        }
    }

    /// Takes what is read next, if there is any more, and the characters that are over with it.
    pub(super) fn take(&mut self, baud: u32) -> (Option<Reading>, Vec<u8>) {
        let reading = self.next(baud);
        if let Some(reading) = reading {
            self.seek = reading.at.after_nanos(1);
            self.low = !reading.whole;
        }
        let mut over = Vec::new();
        while let Some(char) = self.sent.front()
            && (reading.is_none() || char.end() <= self.seek)
        {
            over.push(char.byte);
            self.sent.pop_front();
        }
        (reading, over)
    }
}

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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The speeds that controllers of both families and their hosts can be set to.
    const SPEEDS: [u32; 7] = [2_400, 4_800, 9_600, 19_200, 38_400, 57_600, 115_200];

    /// A receiver that looks at the line sample by sample.
    #[derive(Default)]
    struct Stepwise {
        /// How many samples ago the start bit began.
        count: Option<u32>,
        byte: u8,
        /// It waits for a high line.
        waits: bool,
        read: Vec<(u8, bool)>,
    }

    impl Stepwise {
        fn sample(&mut self, level: bool) {
            self.waits &= !level;
            let Some(count) = self.count.as_mut() else {
                if !level && !self.waits {
                    (self.count, self.byte) = (Some(0), 0);
                }
                return;
            };
            *count += 1;
            match *count {
                8 if level => self.count = None,
                count if count >= 24 && count % 16 == 8 => match count / 16 {
                    bit @ 1..=8 => self.byte |= u8::from(level) << (bit - 1),
                    _ => {
                        self.read.push((self.byte, level));
                        (self.count, self.waits) = (None, !level);
                    }
                },
                _ => {}
            }
        }

        /// What it reads of bytes that are sent one after the other from a time on.
        fn read(bytes: &[u8], at: u64, sent: u32, read: u32) -> Vec<(u8, bool)> {
            let mut receiver = Stepwise::default();
            let rate = 16 * i128::from(read);
            let begin = i128::from(at) * rate / 1_000_000_000;
            let last = begin + (10 * bytes.len() as i128 + 12) * rate / i128::from(sent.min(read));
            for sample in begin.max(1)..last {
                // In which bit of the sender the sample is.
                let elapsed = sample * 1_000_000_000 - i128::from(at) * rate;
                let bit = (elapsed * i128::from(sent)).div_euclid(1_000_000_000 * rate);
                let (byte, bit) = (bit.div_euclid(10), bit.rem_euclid(10));
                let byte = usize::try_from(byte).ok().and_then(|byte| bytes.get(byte));
                receiver.sample(match (byte, bit) {
                    (None, _) | (_, 9) => true,
                    (_, 0) => false,
                    (Some(byte), bit) => byte >> (bit - 1) & 1 == 1,
                });
            }
            receiver.read
        }
    }

    /// The same in closed form.
    fn read(bytes: &[u8], at: u64, sent: u32, read: u32) -> Vec<(u8, bool)> {
        let mut wave = Wave::default();
        wave.push(bytes, Time::from_nanos(at), sent);
        let mut all = Vec::new();
        let mut before = Time::ZERO;
        while let Some(due) = wave.due(read) {
            let Some(reading) = wave.take(read).0 else { break };
            assert!(reading.at > before && reading.at == due);
            before = reading.at;
            all.push((reading.byte, reading.whole));
        }
        assert_eq!(wave.len(), 0);
        all
    }

    #[test]
    fn every_byte_at_every_speed_is_read_as_sample_by_sample() {
        for sent in SPEEDS {
            for at in SPEEDS {
                for byte in 0..=255 {
                    let begin = 1_000_003 * u64::from(byte) + 17;
                    let stepwise = Stepwise::read(&[byte], begin, sent, at);
                    assert_eq!(read(&[byte], begin, sent, at), stepwise, "{byte} {sent} {at}");
                    if sent == at {
                        assert_eq!(stepwise, [(byte, true)]);
                    }
                }
            }
        }
    }

    /// By hand: at twice the speed each bit is read twice.
    #[test]
    fn what_is_read_at_twice_and_half_the_speed() {
        // `@` is 0000001 and a zero after its start bit: fourteen bits that are low, which is a zero
        // without a stop bit; then 11, 00, and a line that stays high.
        assert_eq!(read(b"@", 0, 9_600, 19_200), [(0, false), (0xFE, true)]);
        // 0xFF: its start bit is a start bit and a low bit.
        assert_eq!(read(b"\xFF", 0, 9_600, 19_200), [(0xFE, true)]);
        // At half the speed the middle of a bit is the edge between two: the later one is seen. So a
        // start bit alone is a spike, and of nine low bits the first is the start bit, the third, fifth
        // and seventh are data, and the ninth is just over.
        assert_eq!(read(b"\xFF", 0, 19_200, 9_600), []);
        assert_eq!(read(b"\x00", 0, 19_200, 9_600), [(0xF8, true)]);
    }

    proptest! {
        #[test]
        fn so_are_bytes_that_follow_each_other(
            bytes in prop::collection::vec(any::<u8>(), 1..6),
            begin in 0..1_000_000_000_u64,
            sent in 300..300_000_u32,
            at in 300..300_000_u32,
        ) {
            prop_assume!(sent.max(at) < 40 * sent.min(at));
            let stepwise = Stepwise::read(&bytes, begin, sent, at);
            prop_assert_eq!(read(&bytes, begin, sent, at), stepwise);
        }

        /// It makes no difference whether bytes are sent together or each when it can be.
        #[test]
        fn pieces_are_read_as_the_whole(
            bytes in prop::collection::vec(any::<u8>(), 1..6),
            place in 0..6_usize,
            sent in 300..300_000_u32,
            at in 300..300_000_u32,
        ) {
            let begin = Time::from_millis(7);
            let mut whole = Wave::default();
            whole.push(&bytes, begin, sent);
            let mut pieces = Wave::default();
            let (one, other) = bytes.split_at(place.min(bytes.len()));
            pieces.push(one, begin, sent);
            pieces.push(other, begin, sent);
            let read = |mut wave: Wave| {
                std::iter::from_fn(|| wave.take(at).0).collect::<Vec<_>>()
            };
            prop_assert_eq!(read(whole), read(pieces));
        }

        /// A spike is read as one bit early.
        #[test]
        fn a_spike_shifts_the_bits(byte in any::<u8>(), early in 1..9_u32) {
            // The same line at one speed, as characters: the spike is the start bit of one that is all
            // ones up to the start bit of the other.
            let read = read_early(byte, early);
            let first = u8::try_from((u32::from(byte) << early | ((1 << (early - 1)) - 1)) & 0xFF).unwrap();
            prop_assert_eq!(read[0].0, first);
            prop_assert_eq!(read[0].1, early == 0 || byte >> (8 - early) & 1 == 1);
            prop_assert!(read.len() <= 2);
        }
    }
}
