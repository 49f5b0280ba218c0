//! Recordings with one reply, one position or one input changed.

use serde_json::Value;
use vimc4_timeline::recording::{Given, Recording, What};

/// A small generator of numbers, so that every run changes the same things.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, count: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % count as u64) as usize
    }
}

/// A recording with one thing changed, and what was changed.
pub(crate) fn changed(recording: &Recording, number: u64) -> (Recording, String) {
    let mut numbers = Numbers((number + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let mut changed = recording.clone();
    numbers.below(2);
    let what = match number % 3 {
        0 => change_reply(&mut changed, &mut numbers),
        1 => change_position(&mut changed, &mut numbers),
        _ => change_input(&mut changed, &mut numbers),
    };
    (changed, what)
}

/// The places of the entries of one kind.
fn places(recording: &Recording, is_meant: impl Fn(&What) -> bool) -> Vec<usize> {
    let entries = recording.entries.iter().enumerate();
    entries.filter(|(_, entry)| is_meant(&entry.what)).map(|(place, _)| place).collect()
}

fn change_reply(recording: &mut Recording, numbers: &mut Numbers) -> String {
    let replies = places(recording, |what| matches!(what, What::Sent(_)));
    let place = replies[numbers.below(replies.len())];
    let What::Sent(bytes) = &mut recording.entries[place].what else { unreachable!() };
    let mut other = bytes.to_vec();
    let byte = numbers.below(other.len());
    match numbers.below(3) {
        0 if other.len() > 1 => _ = other.remove(byte),
        1 => other.insert(byte, b'7'),
        _ => other[byte] ^= 1 << numbers.below(4),
    }
    *bytes = other.into();
    format!("entry {place}: another reply, {bytes:?}")
}

fn change_position(recording: &mut Recording, numbers: &mut Numbers) -> String {
    let states = places(recording, |what| matches!(what, What::State { .. }));
    let place = states[states.len() - 1];
    let What::State { state, .. } = &mut recording.entries[place].what else { unreachable!() };
    let field = ["/device/isel/position", "/device/isel/plant/carriage"][numbers.below(2)];
    let axis = numbers.below(3);
    let apart = numbers.below(100) as i64 + 1;
    let position = state.pointer_mut(field).unwrap().get_mut(axis).unwrap();
    *position = Value::from(position.as_i64().unwrap() - apart);
    format!("entry {place}: {field} of axis {axis} is {position}")
}

fn change_input(recording: &mut Recording, numbers: &mut Numbers) -> String {
    let is_input = |what: &What| matches!(what, What::Given { given: Given::Bytes(_), .. });
    let inputs = places(recording, is_input);
    let place = inputs[numbers.below(inputs.len())];
    if numbers.below(2) == 0 {
        recording.entries.remove(place);
        return format!("entry {place}: no input");
    }
    let What::Given { given: Given::Bytes(bytes), .. } = &mut recording.entries[place].what else {
        unreachable!()
    };
    let other: &[u8] = if bytes.ends_with(b"P\r") { b"@07\r" } else { b"@0P\r" };
    *bytes = other.to_vec().into();
    format!("entry {place}: another input, {bytes:?}")
}
