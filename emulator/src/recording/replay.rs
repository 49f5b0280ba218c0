//! `vimc4 replay`: a recording is played again, and compared.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use serde_json::json;
use vimc4_device::Time;
use vimc4_timeline::recording::{
    Aside, Divergence, Entry, Recording, SoFar, Tolerance, WALL, What, check, part,
};

use super::card::{card, seconds};
use super::controller::{Other, Site};
use super::drawn;
use super::file;
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
    none_twice([arguments.file.as_path()], outputs)?;
    #[cfg(feature = "api")]
    if let Some(out) = &arguments.html {
        super::page::write(&arguments.file, out)?;
    }
    let mut ending = Some(InOrder::begin());
    let path = arguments.file.clone();
    let Some(recording) = endings::unless_asked(move || file::read(&path)) else {
        let nothing = SoFar { inputs: 0, bytes: 0, at: Time::ZERO, differs: false };
        heed(&mut ending, || broken_off(arguments, None, nothing));
        return Ok(INTERRUPTED.into());
    };
    let recording = recording?;
    let site = Site::recorded(&recording)
        .map_err(|error| file::unplayable(&arguments.file, &recording, error))?;
    let other = site.other(&arguments.other)?;
    let tolerance = match recording.head.clock.as_str() {
        WALL => Tolerance::Nanos(u64::try_from(arguments.tolerance.as_nanos()).unwrap_or(u64::MAX)),
        _ => Tolerance::Exact,
    };
    let unplayable = |error| file::unplayable(&arguments.file, &recording, error);
    let frame = drawing::frame(&arguments.file, &other.model, &other.machine);
    let picture = arguments.pictured.begin(frame)?;
    let sheets = arguments.drawn.open(None)?;
    drawn::draw(&recording, &other, sheets, picture, &unplayable)?;
    ending = Some(InOrder::begin());
    let mut seen = |so_far| heed(&mut ending, || broken_off(arguments, Some(&recording), so_far));
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
    let say = |causes: &[String], is_whole| {
        report(arguments, &recording, &other, &played, causes, is_whole)
    };
    let mut seen = |_| heed(&mut ending, || say(&[], false));
    let causes = match played.difference.as_ref().is_some_and(|found| found.said.is_some()) {
        true if other.is_recorded() => causes(&recording, &site, tolerance, &mut seen),
        _ => Vec::new(),
    };
    if (arguments.drawn.files().chain(arguments.pictured.files())).next().is_some() {
        say_of_going_back(&recording);
    }
    say(&causes, true)?;
    ending.into_iter().for_each(InOrder::done);
    Ok(if played.difference.is_some() { ExitCode::FAILURE } else { ExitCode::SUCCESS })
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

/// Says how far a comparison has come that goes no further; without a recording it was still being read.
fn broken_off(
    arguments: &Arguments,
    recording: Option<&Recording>,
    so_far: SoFar,
) -> Result<(), Failure> {
    let SoFar { inputs, bytes, at, differs } = so_far;
    if arguments.json {
        let report = json!({
            "recording": text::name(&arguments.file),
            "interrupted": true,
            "equal": differs.then_some(false),
            "inputs": inputs,
            "bytes": bytes,
            "end": at,
            "whole": recording.map(Recording::is_whole),
        });
        return output::print(&format!("{report}\n"));
    }
    let how_far = match recording {
        None => ": nothing was compared yet, for it was still being read".to_owned(),
        Some(_) => {
            let outcome = match differs {
                true => "something differs".to_owned(),
                false => format!("equal so far, {}", compared(inputs, bytes)),
            };
            format!(" at {}: {outcome}", seconds(at))
        }
    };
    output::print(&format!("interrupted{how_far}\n"))
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
    seen: &mut dyn FnMut(SoFar),
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

/// Says what the comparison has found, and whether it was whole, with all that would explain it.
fn report(
    arguments: &Arguments,
    recording: &Recording,
    other: &Site,
    played: &Divergence,
    causes: &[String],
    is_whole: bool,
) -> Result<(), Failure> {
    let name = text::name(&arguments.file);
    let exact = recording.head.clock != WALL;
    if arguments.json {
        let found = played.difference.as_ref();
        let said = found.and_then(|found| found.said.as_ref());
        let field = found.and_then(|found| found.field.as_ref());
        let side = |said: Option<vimc4_timeline::recording::Said>| {
            said.map(|said| json!({ "at": said.at, "byte": said.byte }))
        };
        let report = json!({
            "recording": name,
            "interrupted": !is_whole,
            "equal": found.is_none(),
            "inputs": played.inputs,
            "bytes": played.bytes,
            "end": played.end,
            "whole": recording.is_whole(),
            "said": said.map(|said| json!({
                "before": said.before, "line": said.line,
                "one": side(said.one), "other": side(said.other),
            })),
            "field": field.map(|field| json!({
                "at": field.at, "line": field.line, "field": field.field,
                "one": field.one, "other": field.other,
            })),
            "explanations": causes,
        });
        return output::print(&format!("{report}\n"));
    }
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
            let names = match other.is_recorded() || !exact {
                true => ["recorded", "played"],
                false => ["recorded", "other"],
            };
            said += &card(difference, names);
            for cause in causes {
                said += &format!("{cause} would explain it\n");
            }
        }
    }
    if !is_whole {
        said += "interrupted: what would explain it was still being looked for\n";
    }
    output::print(&said)
}
