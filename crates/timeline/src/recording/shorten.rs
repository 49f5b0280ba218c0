//! Shortening a recording: to a part of its time, or to the inputs that still show something.

use std::sync::Arc;

use bytes::Bytes;
use serde_json::Value;
use vimc4_device::{Device, Time};

use super::entry::{Entry, Given, What};
use super::play::{Player, StateError};
use super::read::Recording;

/// The part that begins when time first comes to `from`, and ends when it next goes past `to`, with
/// the state at its beginning, so that it plays by itself. Where somebody has gone back in between,
/// all of that belongs to it.
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
    let mut begins = recording.entries.iter().take_while(|entry| !is_given(entry));
    let has_state = begins.any(|entry| matches!(entry.what, What::State { .. }));
    let mut entries = recording.entries.iter().peekable();
    let is_before = |player: &Player<D>, entry: &Entry| {
        has_state && !player.has_begun()
            || player.device().now() < from && !lasts_to(player, entry, from)
    };
    while let Some(entry) = entries.next_if(|entry| is_before(&player, entry)) {
        player.play(entry, state)?;
    }
    let before = Time::from_nanos(from.as_nanos().saturating_sub(1));
    if player.device().now() < before {
        player.run_to(before);
    }
    let written = |player: &Player<D>| {
        // Every state can be written down.
        let state = serde_json::to_value(player.device().state()).unwrap_or_default();
        Entry::new(player.device().now(), What::State { by: None, state })
    };
    cut.entries.push(written(&player));
    if player.is_led() {
        cut.entries.push(Entry::new(player.device().now(), What::Stands(Some(0))));
    }
    let (mut has_gone_back, mut last) = (false, Time::ZERO);
    for entry in entries {
        if lasts_to(&player, entry, to.after_nanos(1)) {
            // The output up to the requested end is present and equals the recorded output.
            player.run_to(to);
            if player.is_led() {
                cut.entries.push(Entry::new(to, What::Goes));
            }
            break;
        }
        match &entry.what {
            What::News(_) if entry.at > to => continue,
            What::State { by: Some(_), .. } => {
                if !player.is_led() {
                    player.run_to(entry.at);
                }
                let here = player.device().state();
                player.play(entry, state)?;
                if player.device().now() > to {
                    // Somebody has gone further than that at once.
                    player.restore(here);
                    break;
                }
                (has_gone_back, last) = (true, Time::ZERO);
            }
            what => {
                player.play(entry, state)?;
                if !matches!(what, What::News(_)) {
                    last = last.max(entry.at);
                }
            }
        }
        // What a real controller said before can be late.
        let is_late = entry.at < from && !has_gone_back;
        let is_compared = matches!(entry.what, What::State { by: None, .. });
        if !is_late && !is_compared && !matches!(entry.what, What::End(_)) {
            cut.entries.push(Entry { line: 0, ..entry.clone() });
        }
    }
    if !player.is_led() {
        player.run_to(last);
    }
    cut.entries.push(written(&player));
    cut.entries.push(Entry::new(player.device().now(), What::End("it was cut here".to_owned())));
    Ok(cut)
}

/// Whether time passes up to then before a line.
fn lasts_to<D: Device>(player: &Player<D>, entry: &Entry, then: Time) -> bool {
    match entry.what {
        // Earlier versions have written news by a clock that could be ahead of everything else.
        What::News(_) => false,
        // Who is led stands still until then.
        What::State { by: Some(_), .. } if player.is_led() => false,
        _ => entry.at >= then,
    }
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
        // What it says up to then comes before the end, and before its time is another one.
        if matches!(entry.what, What::End(_)) || is_put(entry) {
            if !player.is_led() {
                player.run_to(entry.at);
            }
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
/// from the inputs left out. Where somebody has gone back to an earlier time, that is left out only
/// with what it takes for the rest to stay in order.
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
        let mut rest: Vec<&(usize, Entry)> = units.iter().flat_map(|unit| &all[*unit]).collect();
        // Something else may have come between two pieces of a line.
        rest.sort_by_key(|(place, _)| *place);
        entries.extend(rest.into_iter().map(|(_, entry)| entry.clone()));
        if let Some(end) = &end {
            let last = entries.last().filter(|last| !is_put(last)).map_or(Time::ZERO, |it| it.at);
            let at = end.at.max(last);
            entries.push(Entry::new(at, What::End("what is left of it".to_owned())));
        }
        Recording { head: recording.head.clone(), entries, torn: None }
    };
    let mut shows = |left: &Recording| is_in_order(&left.entries) && shows(left);
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

/// Whether somebody has put the controller into another state there.
fn is_put(entry: &Entry) -> bool {
    matches!(entry.what, What::State { by: Some(_), .. })
}

/// Whether time goes back only where somebody has put it back.
fn is_in_order(entries: &[Entry]) -> bool {
    entries.windows(2).all(|two| is_put(&two[0]) || two[0].at <= two[1].at)
}

/// Inputs that stay together, each with its place: a line with all its pieces, or one other input.
fn units(entries: &[Entry], ends: &[u8]) -> Vec<Vec<(usize, Entry)>> {
    let mut units: Vec<Vec<(usize, Entry)>> = Vec::new();
    let mut open: Vec<(usize, Entry)> = Vec::new();
    let begun = entries.iter().enumerate().skip_while(|(_, entry)| !is_given(entry));
    for (place, entry) in begun {
        match &entry.what {
            What::Given { given: Given::Bytes(bytes), by } => {
                for line in bytes.split_inclusive(|byte| ends.contains(byte)) {
                    let whole = line.last().is_some_and(|byte| ends.contains(byte));
                    let given = Given::Bytes(Bytes::copy_from_slice(line));
                    let what = What::Given { given, by: Arc::clone(by) };
                    open.push((place, Entry { at: entry.at, what, line: entry.line }));
                    if whole {
                        units.push(std::mem::take(&mut open));
                    }
                }
            }
            What::State { by: Some(_), .. } => {
                // What had been received of a line is part of the state.
                units.extend(Some(std::mem::take(&mut open)).filter(|open| !open.is_empty()));
                units.push(vec![(place, entry.clone())]);
            }
            What::Given { .. } => units.push(vec![(place, entry.clone())]),
            _ => {}
        }
    }
    if !open.is_empty() {
        units.push(open);
    }
    // A line that arrived in pieces keeps the place of its first piece.
    units.sort_by_key(|unit| unit.first().map(|(place, _)| *place));
    units
}
