//! Fast signal traces: the compressed format of GTKWave, which Surfer reads too.
//!
//! A file consists of sections: a header, which names the time of the last change, the names, the widths,
//! and any number of sections of changes. A section of changes has a table of times and, for each
//! signal, its changes one after the other, each with how many places in that table it is behind the
//! one before. A section is written as one to skip and becomes valid when it is complete. The header is
//! written again after each section. So a file opens up to its last whole section, however the program
//! ended.

use miniz_oxide::deflate::compress_to_vec_zlib;
use vimc4_device::Time;

use crate::scene::{Id, Kind, Scene, Value};
use crate::sheet::{Ink, Paper, Sheet};

/// A fast signal trace. Numbers are of the type `real`, texts are strings of any length.
pub struct Fst<P> {
    ink: Ink<P>,
    kinds: Vec<Kind>,
    groups: u64,
    changes: Vec<Changes>,
    /// The values at the beginning of the section, and those now.
    frame: Vec<u8>,
    now: Vec<u8>,
    times: Times,
    /// How many bytes the changes of this section have.
    size: usize,
    sections: u64,
    began: u64,
}

/// The changes of one signal in the section.
#[derive(Debug, Default)]
struct Changes {
    /// Where its value is in a frame.
    place: usize,
    /// The place of its last change in the table of times.
    last: u64,
    data: Vec<u8>,
}

/// The table of times of the section.
#[derive(Debug, Default)]
struct Times {
    data: Vec<u8>,
    count: u64,
    last: u64,
    /// The last time of the section before.
    before: u64,
}

/// The size of the changes of a section, in bytes.
const SECTION: usize = 2 << 20;

/// Sorts of sections.
const HEADER: u8 = 0;
const WIDTHS: u8 = 3;
const NAMES_LZ4: u8 = 6;
const CHANGES: u8 = 8;
const SKIPPED: u8 = 255;

/// The size of what stands before the data of a section: its sort and its length. A skipped section
/// without a length is the end for readers.
const HEAD: usize = 9;

impl<P: Paper> Fst<P> {
    /// A trace that is written there, from its beginning.
    pub fn new(paper: P) -> Fst<P> {
        Fst {
            ink: Ink::new(paper),
            kinds: Vec::new(),
            groups: 1,
            changes: Vec::new(),
            frame: Vec::new(),
            now: Vec::new(),
            times: Times::default(),
            size: 0,
            sections: 0,
            began: 0,
        }
    }

    fn header(&self, end: u64) -> Vec<u8> {
        let signals = self.kinds.len() as u64;
        let mut data = Vec::new();
        data.extend(self.began.to_be_bytes());
        data.extend(end.to_be_bytes());
        // By this number readers see in which order the bytes of numbers are.
        data.extend(std::f64::consts::E.to_le_bytes());
        data.extend(0_u64.to_be_bytes());
        for count in [self.groups, signals, signals, self.sections] {
            data.extend(count.to_be_bytes());
        }
        // 10 to the power of -9 seconds.
        data.extend((-9_i8).to_be_bytes());
        let mut version = [0; 128];
        for (place, letter) in version.iter_mut().zip(b"vimc4") {
            *place = *letter;
        }
        data.extend(version);
        data.extend([0; 119]);
        data.push(0);
        data.extend(0_u64.to_be_bytes());
        section(HEADER, &data)
    }

    fn names(&mut self, scene: &Scene) -> Vec<u8> {
        let mut data = Vec::new();
        let text = |data: &mut Vec<u8>, text: &str| {
            data.extend_from_slice(text.as_bytes());
            data.push(0);
        };
        let group = |data: &mut Vec<u8>, name: &str| {
            data.extend([254, 0]);
            text(data, name);
            text(data, "");
        };
        group(&mut data, &scene.name);
        let mut last = "";
        for signal in &scene.signals {
            if signal.group != last {
                if !last.is_empty() {
                    data.push(255);
                }
                last = &signal.group;
                self.groups += 1;
                group(&mut data, last);
            }
            let (sort, bits) = match signal.kind {
                Kind::Bit => (16, ""),
                Kind::Byte => (16, " [7:0]"),
                Kind::Number => (3, ""),
                Kind::Text => (21, ""),
            };
            data.extend([sort, 0]);
            text(&mut data, &format!("{}{bits}", signal.name));
            put_number(&mut data, width(signal.kind) as u64);
            put_number(&mut data, 0);
        }
        if !last.is_empty() {
            data.push(255);
        }
        data.push(255);
        let size = (data.len() as u64).to_be_bytes();
        section(NAMES_LZ4, &[&size[..], &lz4_flex::compress(&data)].concat())
    }

    fn widths(&self) -> Vec<u8> {
        let mut data = Vec::new();
        for kind in &self.kinds {
            let width = match kind {
                Kind::Bit => 1,
                Kind::Byte => 8,
                Kind::Number => 0,
                Kind::Text => u64::from(u32::MAX),
            };
            put_number(&mut data, width);
        }
        let sizes = [data.len() as u64, self.kinds.len() as u64].map(u64::to_be_bytes);
        section(WIDTHS, &[&sizes.concat()[..], &data].concat())
    }

    /// Ends a section of changes and begins the next.
    fn turn(&mut self) {
        let section = section(CHANGES, &self.pack());
        let (head, data) = section.split_at(HEAD);
        self.ink.dry();
        let start = self.ink.written();
        self.ink.put(&[SKIPPED, 0, 0, 0, 0, 0, 0, 0, 0]);
        self.ink.put(data);
        self.ink.dry();
        self.ink.put_at(start, head);
        self.sections += 1;
        let header = self.header(self.times.last);
        self.ink.put_at(0, &header);
        self.frame.clone_from(&self.now);
        self.times.data.clear();
        (self.times.count, self.times.before) = (0, self.times.last);
        self.size = 0;
    }

    /// The data of a section of changes.
    fn pack(&mut self) -> Vec<u8> {
        let mut data = Vec::with_capacity(self.size / 2);
        data.extend(self.times.before.to_be_bytes());
        data.extend(self.times.last.to_be_bytes());
        let size: usize = self.changes.iter().map(|changes| changes.data.len()).sum();
        data.extend((size as u64).to_be_bytes());
        for number in [self.frame.len(), self.frame.len(), self.kinds.len()] {
            put_number(&mut data, number as u64);
        }
        data.extend_from_slice(&self.frame);

        put_number(&mut data, self.changes.len() as u64);
        data.push(b'4');
        let (mut offsets, mut place, mut without) = (Vec::new(), data.len() - 1, 0);
        for changes in &mut self.changes {
            if changes.data.is_empty() {
                without += 1;
                continue;
            }
            if without > 0 {
                put_number(&mut offsets, std::mem::take(&mut without) << 1);
            }
            put_signed(&mut offsets, ((data.len() - place) as i64) << 1 | 1);
            place = data.len();
            let packed = lz4_flex::compress(&changes.data);
            if packed.len() < changes.data.len() {
                put_number(&mut data, changes.data.len() as u64);
                data.extend_from_slice(&packed);
            } else {
                put_number(&mut data, 0);
                data.extend_from_slice(&changes.data);
            }
            changes.data.clear();
            changes.last = 0;
        }
        if without > 0 {
            put_number(&mut offsets, without << 1);
        }
        data.extend_from_slice(&offsets);
        data.extend((offsets.len() as u64).to_be_bytes());

        let packed = compress_to_vec_zlib(&self.times.data, 1);
        let times = if packed.len() < self.times.data.len() { &packed } else { &self.times.data };
        data.extend_from_slice(times);
        for number in [self.times.data.len() as u64, times.len() as u64, self.times.count] {
            data.extend(number.to_be_bytes());
        }
        data
    }

    /// Comes to a time.
    fn time(&mut self, at: Time) {
        let at = at.as_nanos();
        if self.size + self.times.data.len() >= SECTION {
            self.turn();
        }
        if self.times.count > 0 && self.times.last == at {
            return;
        }
        let since = if self.times.count == 0 { 0 } else { self.times.last };
        put_number(&mut self.times.data, at.saturating_sub(since));
        self.times.last = at;
        self.times.count += 1;
    }
}

impl<P: Paper> Sheet for Fst<P> {
    fn begin(&mut self, scene: &Scene, at: Time) {
        self.kinds = scene.signals.iter().map(|signal| signal.kind).collect();
        for kind in &self.kinds {
            self.changes.push(Changes { place: self.frame.len(), ..Changes::default() });
            self.frame.extend(std::iter::repeat_n(b'0', width(*kind)));
        }
        self.now.clone_from(&self.frame);
        (self.began, self.times.before) = (at.as_nanos(), at.as_nanos());
        let names = self.names(scene);
        for section in [self.header(at.as_nanos()), names, self.widths()] {
            self.ink.put(&section);
        }
        self.time(at);
    }

    #[inline]
    fn set(&mut self, at: Time, signal: Id, value: Value<'_>) {
        self.time(at);
        let Some(changes) = self.changes.get_mut(signal) else { return };
        let before = changes.data.len();
        let data = &mut changes.data;
        let behind = self.times.count - 1 - changes.last;
        changes.last = self.times.count - 1;
        let value_now = self.now.get_mut(changes.place..).unwrap_or_default();
        match value {
            Value::Bit(bit) => {
                put_number(data, behind << 2 | u64::from(bit) << 1);
                if let Some(now) = value_now.first_mut() {
                    *now = b'0' + u8::from(bit);
                }
            }
            Value::Byte(byte) => {
                put_number(data, behind << 1);
                data.push(byte);
                for (bit, now) in (0..8).rev().zip(value_now) {
                    *now = b'0' + (byte >> bit & 1);
                }
            }
            Value::Number(number) => {
                let bytes = (number as f64).to_le_bytes();
                put_number(data, behind << 1 | 1);
                data.extend_from_slice(&bytes);
                for (now, byte) in value_now.iter_mut().zip(bytes) {
                    *now = byte;
                }
            }
            Value::Text(text) => {
                put_number(data, behind << 1);
                put_number(data, text.len() as u64);
                data.extend_from_slice(text.as_bytes());
            }
        }
        self.size += data.len() - before;
    }

    fn flush(&mut self) {
        if self.size > 0 {
            self.turn();
        }
    }

    fn end(&mut self, at: Time) {
        self.time(at);
        self.turn();
    }
}

/// How many bytes a value has in a frame.
fn width(kind: Kind) -> usize {
    match kind {
        Kind::Bit => 1,
        Kind::Byte | Kind::Number => 8,
        Kind::Text => 0,
    }
}

/// A section of a sort. Its length counts itself.
fn section(sort: u8, data: &[u8]) -> Vec<u8> {
    let length = data.len() as u64 + 8;
    let mut section = vec![sort];
    section.extend(length.to_be_bytes());
    section.extend_from_slice(data);
    section
}

/// Adds a number, seven bits a byte, the lowest first.
#[inline]
fn put_number(data: &mut Vec<u8>, mut number: u64) {
    while number > 0x7F {
        data.push(number as u8 | 0x80);
        number >>= 7;
    }
    data.push(number as u8);
}

/// Adds a number with a sign: the highest bit of the last seven tells it.
fn put_signed(data: &mut Vec<u8>, mut number: i64) {
    while !(-64..64).contains(&number) {
        data.push(number as u8 | 0x80);
        number >>= 7;
    }
    data.push(number as u8 & 0x7F);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_can_be() {
        let unsigned = |number| {
            let mut data = Vec::new();
            put_number(&mut data, number);
            data
        };
        let signed = |number| {
            let mut data = Vec::new();
            put_signed(&mut data, number);
            data
        };
        assert_eq!([unsigned(0), unsigned(127)], [vec![0], vec![127]]);
        assert_eq!(unsigned(300), [0xAC, 0x02]);
        // LEB128 of DWARF, whose examples these are.
        assert_eq!([signed(2), signed(-2)], [vec![2], vec![0x7E]]);
        assert_eq!([signed(128), signed(-129)], [vec![0x80, 0x01], vec![0xFF, 0x7E]]);
    }
}
