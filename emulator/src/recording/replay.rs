//! `vimc4 replay`: a recording is played again, and compared.

use std::io::{self, Write as _};
use std::iter;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use serde_json::json;
use vimc4_device::Time;
use vimc4_timeline::recording::{
    Aside, Divergence, Entry, Recording, Said, SoFar, Tolerance, WALL, What, check, part,
};

use super::card::{card, field_card, said_card, seconds};
use super::controller::{Other, Site};
use super::drawn;
use super::file;
use crate::console::cancel::Cancel;
use crate::console::reading::{SearchProgress, on_terminal};
use crate::drawing::{self, Pictured};
use crate::endings::{self, INTERRUPTED, InOrder};
use crate::failure::Failure;
use crate::identity::none_twice;
use crate::output;
use crate::text;
use crate::values::duration;
use crate::waves::Drawn;

#[derive(clap::Args)]
#[command(
    long_about = "\
Play a recording again and compare every byte and time

The recorded inputs go into the recorded controller, at full speed, in virtual time. It must send the
recorded bytes at their times, to the nanosecond, and come to the recorded states. With another one
(--quirk, --model, --machine) the same inputs go into that controller as well, and the first difference from the recorded
one is shown. A recording of a real controller is compared within --tolerance, and what
differs is reported with the quirk or model that would explain it.",
    after_long_help = "\
Examples:
  vimc4 run examples/commands.txt --machine mill --record drill.jsonl
  vimc4 replay drill.jsonl
  vimc4 replay drill.jsonl --model imc-s8
  vimc4 replay examples/limit.jsonl --quirk lost_steps=false
  vimc4 replay examples/limit.jsonl --html limit.html

docs/recordings.md has the format.

Exit codes: 0 all is equal, 1 something differs, or the recording is wrong, 2 wrong usage,
130 it was interrupted."
)]
pub(crate) struct Arguments {
    /// The recording; `-` is standard input
    file: PathBuf,
    #[command(flatten)]
    other: Other,
    /// How much earlier or later than recorded a byte of a real controller may come; never less than a
    /// hundredth
    #[arg(long, value_name = "DURATION", default_value = "50ms", value_parser = duration)]
    tolerance: Duration,
    #[command(flatten)]
    drawn: Drawn,
    /// Print one JSON object instead
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    pictured: Pictured,
    /// Write a page that shows the recording in any browser, with nothing else at hand
    #[cfg(feature = "api")]
    #[arg(long, value_name = "OUT")]
    html: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    endings::heed()?;
    let outputs = arguments.drawn.files().chain(arguments.pictured.files());
    #[cfg(feature = "api")]
    let outputs = outputs.chain(arguments.html.as_deref());
    none_twice(iter::once(arguments.file.as_path()).chain(arguments.other.files()), outputs)?;
    let mut ending = Some(InOrder::begin());
    #[cfg(feature = "api")]
    if let Some(out) = arguments.html.clone() {
        let path = arguments.file.clone();
        match endings::unless_asked(move || super::page::write(&path, &out)) {
            Some(written) => written?,
            None => {
                heed(&mut ending, || {
                    not_begun(arguments, None, "its page was still being written")
                });
                return Ok(INTERRUPTED.into());
            }
        }
    }
    let path = arguments.file.clone();
    let Some(recording) = endings::unless_asked(move || file::read(&path)) else {
        heed(&mut ending, || not_begun(arguments, None, "it was still being read"));
        return Ok(INTERRUPTED.into());
    };
    let recording = recording?;
    let site = Site::recorded(&recording)
        .map_err(|error| file::unplayable(&arguments.file, &recording, error))?;
    let other = site.other(&arguments.other)?;
    let tolerance = arguments.tolerance(&recording);
    let unplayable = |error| file::unplayable(&arguments.file, &recording, error);
    let frame = drawing::frame(&arguments.file, &other.model, &other.machine);
    let (pictured, drawn) = (arguments.pictured.clone(), arguments.drawn.clone());
    // Whoever is to read a pipe may never come.
    let begin = move || Ok::<_, Failure>((pictured.begin(frame)?, drawn.open(None)?));
    let Some(begun) = endings::unless_asked(begin) else {
        let why = "what is drawn had no reader yet";
        heed(&mut ending, || not_begun(arguments, Some(&recording), why));
        return Ok(INTERRUPTED.into());
    };
    let (picture, sheets) = begun?;
    // Otherwise it is said up to where it is drawn, and that is all.
    let interrupted = || match arguments.json {
        true => not_begun(arguments, Some(&recording), ""),
        false => Ok(()),
    };
    drawn::draw(&recording, &other, sheets, picture, &unplayable, &interrupted)?;
    ending = Some(InOrder::begin());
    let names = names(&recording, &other);
    let mut seen = |so_far: SoFar<'_>| {
        heed(&mut ending, || broken_off(arguments, &recording, so_far, names));
    };
    let read = |written: &_| site.read(written);
    // What a real controller has said is compared with whichever controller is named.
    let played = if other.is_recorded() || recording.head.clock == WALL {
        let read = |written: &_| other.read(written);
        check(&recording, other.player()?, tolerance, &read, &mut seen)
    } else {
        let there = |written: &_| other.read(written);
        let players = (site.player()?, other.player()?);
        let aside = Aside { values: &other.aside(), is_same: &Site::is_same };
        part(&recording, players.0, players.1, &aside, [&read, &there], &mut seen)
    };
    let played = played.map_err(unplayable)?;
    if !arguments.json {
        output::print(&report(&recording, names, &played))?;
    }
    let say = |causes: Option<&[String]>| match arguments.json {
        true => found_json(arguments, &recording, &played, causes),
        false => output::print(&explanations(causes)),
    };
    let is_searched =
        other.is_recorded() && played.difference.as_ref().is_some_and(|found| found.said.is_some());
    let causes = match is_searched {
        true => search(&recording, &site, tolerance, &mut ending, || say(None)),
        false => Vec::new(),
    };
    if (arguments.drawn.files().chain(arguments.pictured.files())).next().is_some() {
        say_of_going_back(&recording);
    }
    say(Some(&causes))?;
    ending.into_iter().for_each(InOrder::done);
    Ok(if played.difference.is_some() { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Looks for what explains a difference, with its progress on a terminal.
fn search(
    recording: &Recording,
    site: &Site,
    tolerance: Tolerance,
    ending: &mut Option<InOrder>,
    say: impl Fn() -> Result<(), Failure>,
) -> Vec<String> {
    let mut progress = Some(SearchProgress::new(&Cancel::default(), on_terminal(), None));
    let mut seen = |so_far: SoFar<'_>| {
        if let Some(progress) = &mut progress {
            let _ = progress.goes_on(so_far.at);
        }
        heed(ending, || {
            progress = None;
            say()
        });
    };
    causes(recording, site, tolerance, &mut seen)
}

impl Arguments {
    /// How far times may differ.
    fn tolerance(&self, recording: &Recording) -> Tolerance {
        match recording.head.clock.as_str() {
            WALL => Tolerance::Nanos(u64::try_from(self.tolerance.as_nanos()).unwrap_or(u64::MAX)),
            _ => Tolerance::Exact,
        }
    }
}

/// Ends the program if it was asked to end, and has it say before how far it has come.
fn heed(ending: &mut Option<InOrder>, say: impl FnOnce() -> Result<(), Failure>) {
    if let Some(ending) = ending.take_if(|ending| ending.is_asked()) {
        if let Err(failure) = say() {
            failure.report();
        }
        ending.done();
    }
}

/// What the sides of a comparison are called.
fn names(recording: &Recording, other: &Site) -> [&'static str; 2] {
    match other.is_recorded() || recording.head.clock == WALL {
        true => ["recorded", "played"],
        false => ["recorded", "other"],
    }
}

/// Says that a comparison has not begun, and why; without a recording it is not known yet.
fn not_begun(
    arguments: &Arguments,
    recording: Option<&Recording>,
    why: &str,
) -> Result<(), Failure> {
    if arguments.json {
        let nothing = SoFar { inputs: 0, bytes: 0, at: Time::ZERO, said: None, field: None };
        return json(arguments, recording, None, nothing, None);
    }
    output::print(&format!("interrupted: nothing was compared yet, for {why}\n"))
}

/// Says how far a comparison has come that goes no further.
fn broken_off(
    arguments: &Arguments,
    recording: &Recording,
    so_far: SoFar<'_>,
    names: [&str; 2],
) -> Result<(), Failure> {
    let SoFar { inputs, bytes, at, said, field } = so_far;
    let differs = said.is_some() || field.is_some();
    if arguments.json {
        return json(arguments, Some(recording), differs.then_some(false), so_far, None);
    }
    let outcome = match differs {
        true => "something differs".to_owned(),
        false => format!("equal so far, {}", compared(inputs, bytes)),
    };
    let said = said.map(|said| said_card(said, names)).unwrap_or_default();
    let field = field.map(|field| field_card(field, names)).unwrap_or_default();
    output::print(&format!("interrupted at {}: {outcome}\n{said}{field}", seconds(at)))
}

/// Prints what a comparison has found as JSON. What is not known is null: without `causes` it was
/// interrupted.
fn json(
    arguments: &Arguments,
    recording: Option<&Recording>,
    equal: Option<bool>,
    found: SoFar<'_>,
    causes: Option<&[String]>,
) -> Result<(), Failure> {
    let side = |said: Option<Said>| said.map(|said| json!({ "at": said.at, "byte": said.byte }));
    let report = json!({
        "recording": text::name(&arguments.file),
        "interrupted": causes.is_none(),
        "equal": equal,
        "inputs": found.inputs,
        "bytes": found.bytes,
        "end": found.at,
        "whole": recording.map(Recording::is_whole),
        "said": found.said.map(|said| json!({
            "before": said.before, "line": said.line,
            "one": side(said.one), "other": side(said.other),
        })),
        "field": found.field.map(|field| json!({
            "at": field.at, "line": field.line, "field": field.field,
            "one": field.one, "other": field.other,
        })),
        "explanations": causes,
    });
    output::print(&format!("{report}\n"))
}

/// `8 inputs and 1 byte`.
fn compared(inputs: u64, bytes: u64) -> String {
    let s = |count: u64, one: &str| format!("{count} {one}{}", if count == 1 { "" } else { "s" });
    format!("{} and {}", s(inputs, "input"), s(bytes, "byte"))
}

/// Says that what is drawn is not in the controller's own time, where somebody went back.
fn say_of_going_back(recording: &Recording) {
    let is_put = |entry: &&Entry| matches!(entry.what, What::State { by: Some(_), .. });
    let times = match recording.entries.iter().filter(is_put).count() {
        0 => return,
        1 => "once".to_owned(),
        times => format!("{times} times"),
    };
    let text = format!(
        "somebody went back {times}: what is drawn goes on behind that, with times that go on, too; notes and \
         signs show where"
    );
    // Whoever closed standard error does not want to know.
    let _ = writeln!(io::stderr(), "{text}");
}

/// The quirks, and the models of the family, with which everything would be as recorded.
fn causes(
    recording: &Recording,
    site: &Site,
    tolerance: Tolerance,
    seen: &mut dyn FnMut(SoFar<'_>),
) -> Vec<String> {
    let mut candidates: Vec<(String, Site)> = Vec::new();
    for (quirk, values) in vimc4_catalogue::quirks(&site.model) {
        for value in *values {
            if let Ok(other) = site.with_quirk(quirk, value) {
                candidates.push((format!("quirk {quirk} = {}", value.trim_matches('"')), other));
            }
        }
    }
    let explains = |(cause, other): (String, Site)| {
        let read = |written: &_| other.read(written);
        let player = other.player().ok().filter(|_| !other.is_recorded())?;
        let played = check(recording, player, tolerance, &read, seen).ok()?;
        // Another profile is another state, so only what it says counts.
        let said = played.difference.and_then(|difference| difference.said);
        said.is_none().then_some(cause)
    };
    candidates.into_iter().filter_map(explains).collect()
}

/// What the comparison has found, as JSON.
fn found_json(
    arguments: &Arguments,
    recording: &Recording,
    played: &Divergence,
    causes: Option<&[String]>,
) -> Result<(), Failure> {
    let Divergence { difference, bytes, inputs, end } = played;
    let said = difference.as_ref().and_then(|found| found.said.as_ref());
    let field = difference.as_ref().and_then(|found| found.field.as_ref());
    let found = SoFar { inputs: *inputs, bytes: *bytes, at: *end, said, field };
    json(arguments, Some(recording), Some(difference.is_none()), found, causes)
}

/// What would explain a difference; `None` if the search for it was interrupted.
fn explanations(causes: Option<&[String]>) -> String {
    match causes {
        Some(causes) => causes.iter().map(|cause| format!("{cause} would explain it\n")).collect(),
        None => "interrupted: what would explain it was still being looked for\n".to_owned(),
    }
}

/// What the comparison has found.
fn report(recording: &Recording, names: [&str; 2], played: &Divergence) -> String {
    let exact = recording.head.clock != WALL;
    let mut said = String::new();
    if let Some(line) = recording.torn {
        said += &format!("{}\n", file::torn_off(line));
    }
    if !recording.is_whole() {
        said += "It has no end: the program that wrote it was killed, the disk was full, or it is still being written.\n";
    }
    let compared = compared(played.inputs, played.bytes);
    match &played.difference {
        None if exact => {
            said += &format!(
                "equal: {compared} up to {}, each at its time, and every state\n",
                seconds(played.end)
            );
        }
        None => said += &format!("equal: {compared}, each within the tolerance\n"),
        Some(difference) => {
            if let Some(at) = difference.at() {
                let millis = at.as_nanos() / 1_000_000;
                let sides = match names {
                    [_, "other"] => "The other controller differs from the recorded one",
                    _ => "The emulation differs from the recording",
                };
                said += &format!("{sides} from {}.{:03} s on.\n", millis / 1_000, millis % 1_000);
            }
            said += &card(difference, names);
        }
    }
    said
}
