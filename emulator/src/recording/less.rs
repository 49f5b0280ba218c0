//! `vimc4 cut` and `vimc4 minimise`: less of a recording.

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

use vimc4_catalogue::Handling;
use vimc4_device::{Event, Time, escape};
use vimc4_timeline::recording::{
    self, Recording, StateError, What, first_mismatch, rerecord, say_otherwise,
};

use super::card::seconds;
use super::controller::{Other, Site};
use super::file;
use crate::failure::Failure;
use crate::text;
use crate::values::duration;

#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  vimc4 cut examples/limit.jsonl --from 7s --to 12.5s --out moment.jsonl

What comes out plays by itself: it begins with the state that the controller was in then.

Where somebody went back in time, time comes to the same moment more than once. The part then begins where it
first comes to --from, and ends where it next goes past --to: every going back in between is in it.

Exit codes: 0 written, 1 the recording is wrong, 2 wrong usage.")]
pub(crate) struct CutArguments {
    /// The recording; `-` is standard input
    file: PathBuf,
    /// From this model time on; by default from the beginning
    #[arg(long, value_name = "TIME", default_value = "0s", value_parser = duration)]
    from: Duration,
    /// Up to this model time; by default to the end
    #[arg(long, value_name = "TIME", value_parser = duration)]
    to: Option<Duration>,
    /// Write it into this file, which must not exist yet, instead of to standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(clap::Args)]
#[command(
    long_about = "\
Find the shortest input of a recording that still shows a difference or an error

With another controller (--quirk, --model, --machine) it is a difference between that one and the recorded
one; otherwise it is the last error reply of the recording, or the reply named with --shows. Lines are left out,
half of them first and one by one in the end, as long as it still shows. Times stay as they are.",
    after_long_help = "\
Examples:
  vimc4 minimise examples/limit.jsonl --out short.jsonl
  vimc4 minimise examples/limit.jsonl --shows 2
  vimc4 minimise examples/limit.jsonl --quirk lost_steps=false

Exit codes: 0 written, 1 the recording shows nothing of the kind, or is wrong, 2 wrong usage."
)]
pub(crate) struct MinimiseArguments {
    /// The recording; `-` is standard input
    file: PathBuf,
    #[command(flatten)]
    other: Other,
    /// The reply to keep, as it is printed elsewhere
    #[arg(long, value_name = "REPLY")]
    shows: Option<String>,
    /// Write it into this file, which must not exist yet, instead of to standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn cut(arguments: &CutArguments) -> Result<(), Failure> {
    let recording = file::read(&arguments.file)?;
    let unplayable = |error| file::unplayable(&arguments.file, &recording, error);
    let site = Site::recorded(&recording)
        .map_err(|error| file::unplayable(&arguments.file, &recording, error))?;
    let from = Time::ZERO + arguments.from;
    let to = arguments.to.map_or(Time::NEVER, |to| Time::ZERO + to);
    if to < from {
        return Err(Failure::usage("--to is before --from; name a later time"));
    }
    // What happened later was not recorded. News can be ahead of it.
    let entries = recording.entries.iter().filter(|entry| !matches!(entry.what, What::News(_)));
    let times = || entries.clone().map(|entry| entry.at);
    let begin = times().next().unwrap_or(Time::ZERO);
    let end = times().max().unwrap_or(Time::ZERO);
    let name = text::name(&arguments.file);
    if from > end {
        return Err(Failure::usage(format!(
            "{name} goes no further than {}, which is before --from; name an earlier time",
            seconds(end)
        )));
    }
    if to < begin {
        return Err(Failure::usage(format!(
            "{name} begins at {}, which is after --to; name a later time",
            seconds(begin)
        )));
    }
    if to > end && arguments.to.is_some() {
        let _ = writeln!(
            io::stderr(),
            "{name} goes no further than {}; the part ends with it",
            seconds(end)
        );
    }
    say_of_difference(&recording, &site).map_err(unplayable)?;
    let read = |written: &_| site.read(written);
    let cut = recording::cut(&recording, site.player()?, from, to, &read).map_err(unplayable)?;
    file::write(&cut, arguments.out.as_deref())
}

pub(crate) fn minimise(arguments: &MinimiseArguments) -> Result<(), Failure> {
    let recording = file::read(&arguments.file)?;
    let unplayable = |error| file::unplayable(&arguments.file, &recording, error);
    let site = Site::recorded(&recording)
        .map_err(|error| file::unplayable(&arguments.file, &recording, error))?;
    let other = site.other(&arguments.other)?;
    say_of_difference(&recording, &site).map_err(unplayable)?;
    let ends = Handling::of(&site.model).ends;
    let name = text::name(&arguments.file);
    let short = if other.is_recorded() {
        let replies = replies(&recording, &site);
        let wanted = match &arguments.shows {
            Some(text) => replies.iter().find(|reply| escape(&reply.bytes) == *text),
            None => replies.iter().rfind(|reply| reply.is_error),
        };
        let Some(wanted) = wanted else {
            let what = match &arguments.shows {
                Some(text) => format!("the reply {text}"),
                None => "no error reply".to_owned(),
            };
            let not = if arguments.shows.is_some() { "does not show" } else { "shows" };
            return Err(Failure::midway(format!(
                "{name} {not} {what}; name another one with --shows, or a controller with --quirk, \
                 --model or --machine"
            )));
        };
        let shows = |short: &Recording| {
            let found = self::replies(short, &site);
            found
                .iter()
                .any(|reply| reply.bytes == wanted.bytes && reply.mnemonic == wanted.mnemonic)
        };
        recording::minimise(&recording, ends, shows)
    } else {
        let parts = |short: &Recording| {
            let (Ok(one), Ok(two)) = (site.player(), other.player()) else { return false };
            let (here, there) =
                (|written: &_| site.read(written), |written: &_| other.read(written));
            say_otherwise(short, one, two, [&here, &there]).unwrap_or(false)
        };
        if !parts(&recording) {
            return Err(Failure::midway(format!(
                "both controllers say the same to {name}; name one that says something else"
            )));
        }
        recording::minimise(&recording, ends, parts)
    };
    let read = |written: &_| site.read(written);
    let short = rerecord(&short, site.player()?, &read).map_err(unplayable)?;
    file::write(&short, arguments.out.as_deref())
}

/// Says from when on the emulation, which gives what is written, differs from the recording.
fn say_of_difference(recording: &Recording, site: &Site) -> Result<(), StateError> {
    let Ok(player) = site.player() else { return Ok(()) };
    let read = |written: &_| site.read(written);
    if let Some(first) = first_mismatch(recording, player.without_meanings(), &read)? {
        // Standard error may be closed.
        let _ = writeln!(io::stderr(), "{}", first.summary());
    }
    Ok(())
}

/// A reply to a command.
struct Outcome {
    mnemonic: String,
    bytes: Vec<u8>,
    is_error: bool,
}

/// What is answered when a recording is played.
fn replies(recording: &Recording, site: &Site) -> Vec<Outcome> {
    let handling = Handling::of(&site.model);
    let Ok(player) = site.player() else { return Vec::new() };
    let mut player = player.remembering(usize::MAX);
    for entry in &recording.entries {
        if player.play(entry, &|written| site.read(written)).is_err() {
            break;
        }
    }
    let mut command: Vec<u8> = Vec::new();
    let mut replies = Vec::new();
    for told in player.told() {
        match &told.event {
            Event::Command { bytes, .. } => command = bytes.to_vec(),
            Event::Answer { mnemonic, bytes, .. } => replies.push(Outcome {
                mnemonic: mnemonic.to_string(),
                bytes: bytes.to_vec(),
                is_error: handling.refusal(&command, bytes).is_some(),
            }),
            _ => {}
        }
    }
    replies
}
