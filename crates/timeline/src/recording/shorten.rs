//! Shortening a recording: to a part of its time, or to the inputs that still show something.

use std::sync::Arc;

use bytes::Bytes;
use serde_json::Value;
use vimc4_device::{Device, Time};

use super::entry::{Entry, Given, What};
use super::play::{Player, StateError};
use super::read::Recording;

/// The part between two times, with the state at its beginning, so that it plays by itself.
///
/// # Errors
///
/// If a recorded state cannot be read.
pub fn cut<D: Device>(
    recording: &Recording,
    mut player: Player<D>,
    from: Time,
    to: Time,
    state: &dyn Fn(&Value) -> Result<D::State, String>,
) -> Result<Recording, StateError> {
    let mut cut = Recording { head: recording.head.clone(), entries: Vec::new(), torn: None };
    // Earlier versions have written news by a clock that could be ahead of everything else.
    let is_news = |entry: &Entry| matches!(entry.what, What::News(_));
    let before = Time::from_nanos(from.as_nanos().saturating_sub(1));
    let mut entries = recording.entries.iter().peekable();
    while let Some(entry) = entries.next_if(|entry| entry.at < from) {
        player.play(entry, state)?;
    }
    if from > Time::ZERO {
        player.run_to(before);
    }
    let written = |player: &Player<D>| What::State {
        by: None,
        // Every state can be written down.
        state: serde_json::to_value(player.device().state()).unwrap_or_default(),
    };
    cut.entries.push(Entry::new(player.device().now(), written(&player)));
    let mut last = from;
    let is_first_state = |entry: &Entry| matches!(entry.what, What::State { by: None, .. });
    let entries = entries.filter(|entry| entry.at <= to || !is_news(entry));
    for entry in entries.take_while(|entry| entry.at <= to) {
        player.play(entry, state)?;
        if !is_news(entry) {
            last = last.max(entry.at);
        }
        let late = entry.at < from || is_first_state(entry);
        if !late && !matches!(entry.what, What::End(_)) {
            cut.entries.push(Entry { line: 0, ..entry.clone() });
        }
    }
    // The output up to the requested end is present and equals the recorded output.
    player.run_to(if to == Time::NEVER { last } else { to });
    cut.entries.push(Entry::new(player.device().now(), written(&player)));
    cut.entries.push(Entry::new(player.device().now(), What::End("it was cut here".to_owned())));
    Ok(cut)
}

/// The recording with its output replaced by what playing its inputs gives.
///
/// # Errors
///
/// If a recorded state cannot be read.
pub fn rerecord<D: Device>(
    recording: &Recording,
    mut player: Player<D>,
    state: &dyn Fn(&Value) -> Result<D::State, String>,
) -> Result<Recording, StateError> {
    let mut made = Recording { head: recording.head.clone(), entries: Vec::new(), torn: None };
    let say = |made: &mut Recording, player: &mut Player<D>, before: Time| {
        while let Some(&(at, _)) = player.said().front().filter(|(at, _)| *at < before) {
            let said = player.said();
            let together = said.iter().take_while(|(then, _)| *then == at).count();
            let bytes: Vec<u8> = said.drain(..together).map(|(_, byte)| byte).collect();
            made.entries.push(Entry::new(at, What::Sent(Bytes::from(bytes))));
        }
    };
    for entry in recording.entries.iter().filter(|entry| !matches!(entry.what, What::Sent(_))) {
        if matches!(entry.what, What::End(_)) {
            player.run_to(entry.at);
            say(&mut made, &mut player, Time::NEVER);
        }
        player.play(entry, state)?;
        say(&mut made, &mut player, entry.at);
        made.entries.push(Entry { line: 0, ..entry.clone() });
        say(&mut made, &mut player, Time::NEVER);
    }
    Ok(made)
}

/// Leaves inputs out as long as the rest still `shows` it, by delta debugging: halves, then
/// quarters, down to single lines. The result has no output, because the recorded output also came
/// from the inputs left out.
///
/// `ends` are the bytes that end a line, so that commands stay whole.
pub fn minimise(
    recording: &Recording,
    ends: &[u8],
    mut shows: impl FnMut(&Recording) -> bool,
) -> Recording {
    let begins = recording.entries.iter().take_while(|entry| !is_given(entry));
    let begins: Vec<Entry> =
        begins.filter(|entry| matches!(entry.what, What::State { .. })).cloned().collect();
    let end = recording.entries.last().cloned();
    let all = units(&recording.entries, ends);
    let mut units: Vec<usize> = (0..all.len()).collect();
    let build = |units: &[usize]| {
        let mut entries = begins.clone();
        entries.extend(units.iter().flat_map(|unit| &all[*unit]).cloned());
        if let Some(end) = &end {
            entries.push(Entry::new(end.at, What::End("what is left of it".to_owned())));
        }
        Recording { head: recording.head.clone(), entries, torn: None }
    };
    let mut pieces = 2;
    while units.len() > 1 && pieces <= units.len() {
        let size = units.len().div_ceil(pieces);
        let mut reduced = false;
        let mut from = 0;
        while from < units.len() {
            let to = (from + size).min(units.len());
            let left: Vec<usize> = [&units[..from], &units[to..]].concat();
            if shows(&build(&left)) {
                units = left;
                reduced = true;
            } else {
                from = to;
            }
        }
        match reduced {
            true => pieces = 2.max(pieces.min(units.len()) - 1),
            false if size == 1 => break,
            false => pieces = (pieces * 2).min(units.len()),
        }
    }
    build(&units)
}

fn is_given(entry: &Entry) -> bool {
    matches!(entry.what, What::Given { .. })
}

/// Inputs that stay together: a line with all its pieces, or one other input.
fn units(entries: &[Entry], ends: &[u8]) -> Vec<Vec<Entry>> {
    let mut units: Vec<Vec<Entry>> = Vec::new();
    let mut open: Vec<Entry> = Vec::new();
    let begun = entries.iter().skip_while(|entry| !is_given(entry));
    for entry in begun {
        match &entry.what {
            What::Given { given: Given::Bytes(bytes), by } => {
                for line in bytes.split_inclusive(|byte| ends.contains(byte)) {
                    let whole = line.last().is_some_and(|byte| ends.contains(byte));
                    let given = Given::Bytes(Bytes::copy_from_slice(line));
                    let what = What::Given { given, by: Arc::clone(by) };
                    open.push(Entry { at: entry.at, what, line: entry.line });
                    if whole {
                        units.push(std::mem::take(&mut open));
                    }
                }
            }
            What::Given { .. } | What::State { by: Some(_), .. } => units.push(vec![entry.clone()]),
            _ => {}
        }
    }
    if !open.is_empty() {
        units.push(open);
    }
    // A line that arrived in pieces keeps the place of its first piece.
    units.sort_by_key(|unit| unit.first().map(|entry| entry.at));
    units
}
