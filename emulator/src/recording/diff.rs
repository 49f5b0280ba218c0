//! `vimc4 diff`: where two recordings part.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::Value;
use vimc4_device::escape;
use vimc4_timeline::recording::{
    Aside, Entry, Given, Recording, What, first_field, given_apart, part, said_apart, states_apart,
};

use super::card::{card, field_card, led, said_card, seconds};
use super::controller::Site;
use super::file;
use crate::failure::Failure;
use crate::output;

#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  vimc4 diff examples/limit.jsonl examples/limit.jsonl

Says what of the profiles differs, the first input that differs, the first byte, and the first field of the
state, with what led there on either side.

Exit codes: 0 they are equal, 1 they differ, or one is wrong, 2 wrong usage.")]
pub(crate) struct Arguments {
    /// A recording
    one: PathBuf,
    /// Another one
    other: PathBuf,
}

const NAMES: [&str; 2] = ["one", "other"];

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let one = file::read(&arguments.one)?;
    let other = file::read(&arguments.other)?;
    let mut text = String::new();
    for (name, [a, b]) in [
        ("model", [&one.head.model, &other.head.model]),
        ("machine", [&one.head.machine, &other.head.machine]),
    ] {
        if let Some((field, a, b)) = first_field("", a, b) {
            text += &format!("The profiles of the {name} differ, first in {field}: {a}, and {b}\n");
        }
    }
    let given = given_apart(&one, &other);
    if let Some(entries) = given {
        text += "The first input that differs:\n";
        for (name, entry) in NAMES.iter().zip(entries) {
            text += &format!("  {name:<9} {}\n", entry.map_or("nothing".to_owned(), input));
        }
    }
    let before = given.map_or(usize::MAX, |[entry, _]| {
        let place = |entry: &Entry| one.entries.iter().position(|other| std::ptr::eq(other, entry));
        entry.and_then(place).unwrap_or(usize::MAX)
    });
    // Up to there both get the same, so that what differs is the controllers' doing.
    let mut same = one.clone();
    same.entries.truncate(before);
    let apart = futures(arguments, &same, &one, &other)?;
    match (&apart, said_apart(&one, &other)) {
        (Some(difference), _) if difference.said.is_some() => text += &card(difference, NAMES),
        (difference, said) => {
            if only_times(&one, &other) && (given.is_some() || said.is_some()) {
                text.insert_str(0, "What went in and what came out is the same, at other times.\n");
            }
            let shown = match &said {
                Some(said) => said_card(said, NAMES) + &led(difference.as_ref(), NAMES),
                None => difference.as_ref().map_or_else(String::new, |it| card(it, NAMES)),
            };
            text += &shown;
        }
    }
    if apart.as_ref().is_none_or(|found| found.field.is_none())
        && let Some(found) = states_apart(&one, &other, before, &aside(&one, &other))
    {
        text += &field_card(&found, NAMES);
    }
    let equal = text.is_empty();
    output::print(if equal { "equal\n" } else { &text })?;
    Ok(if equal { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The profiles that differ, which stand for each other in the states.
fn aside(one: &Recording, other: &Recording) -> Vec<(Value, Value)> {
    let aside = [
        (one.head.model.clone(), other.head.model.clone()),
        (one.head.machine.clone(), other.head.machine.clone()),
    ];
    aside.into_iter().filter(|(one, other)| one != other).collect()
}

/// Where the two controllers part when they get the same.
fn futures(
    arguments: &Arguments,
    same: &Recording,
    one: &Recording,
    other: &Recording,
) -> Result<Option<vimc4_timeline::recording::Difference>, Failure> {
    let site = |recording: &Recording, path: &PathBuf| {
        Site::recorded(recording).map_err(|error| file::unplayable(path, recording, error))
    };
    let (here, there) = (site(one, &arguments.one)?, site(other, &arguments.other)?);
    let aside = aside(one, other);
    let first = other.first_state().cloned().unwrap_or_default();
    let read = |written: &_| here.read(written);
    // Each begins where it began, and goes wherever the one was put.
    let begun = std::cell::Cell::new(false);
    let read_other = |written: &_| match begun.replace(true) {
        false => there.read(&first),
        true => there.read(written),
    };
    let players = (here.player()?, there.player()?);
    let aside = Aside { values: &aside, is_same: &Site::is_same };
    let played = part(same, players.0, players.1, &aside, [&read, &read_other], &mut |_| {});
    Ok(played.map_err(|error| file::unplayable(&arguments.one, one, error))?.difference)
}

/// Whether the same was given and said in the same order, whatever the times.
fn only_times(one: &Recording, other: &Recording) -> bool {
    let given = |recording: &Recording| -> Vec<Given> {
        let given = recording.entries.iter().filter_map(|entry| match &entry.what {
            What::Given { given, .. } => Some(given.clone()),
            _ => None,
        });
        given.collect()
    };
    let out = |recording: &Recording| -> Vec<u8> {
        let out = recording.entries.iter().filter_map(|entry| match &entry.what {
            What::Sent(bytes) => Some(bytes.to_vec()),
            _ => None,
        });
        out.flatten().collect()
    };
    given(one) == given(other) && out(one) == out(other)
}

fn input(entry: &Entry) -> String {
    let what = match &entry.what {
        What::Given { given: Given::Bytes(bytes), .. } => escape(bytes),
        What::Given { given: Given::Signal { name, value }, .. } => format!("{name} = {value}"),
        What::Given { given: Given::Power(on), .. } => {
            format!("power {}", if *on { "on" } else { "off" })
        }
        What::Given { given: Given::Fault(words), .. } => format!("fault {words}"),
        What::Given { given: Given::Rule(words), .. } => format!("rule {words}"),
        What::Given { given: Given::Wait, .. } => "time passes".to_owned(),
        _ => "it is put into a state".to_owned(),
    };
    format!("{}  {what}  (line {})", seconds(entry.at), entry.line)
}
