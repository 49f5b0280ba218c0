//! A recording as a page that shows it, without a server.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::path::Path;

use vimc4_answers::past::{differences, has_come_to, report};
use vimc4_api::Film;
use vimc4_debug::{Read, uninterrupted};
use vimc4_device::Time;
use vimc4_timeline::{Branch, BranchId, Place};

use super::history::{Commands, Opened, open};
use crate::failure::Failure;
use crate::output::Destination;
use crate::streams::is_stream;
use crate::text;

/// How a page begins.
const PAGE: &[u8] = b"<!doctype html>";

/// Writes it.
pub(super) fn write(recording: &Path, out: &Path) -> Result<(), Failure> {
    if out.is_file() && !is_stream(out) && !is_page(out) {
        let name = text::name(out);
        return Err(Failure::usage(format!(
            "{name} is there and is no page, and would be overwritten; name another file"
        )));
    }
    let destination = Destination::claim(out)?;
    let Opened { mut debugger, model, machine, share, .. } = open(recording, Commands::Unlisted)?;
    if let Read::Broken(why) = debugger.read_on(usize::MAX, &mut uninterrupted) {
        return Err(Failure::midway(why));
    }
    let differences = differences(&debugger, true);
    if let Some(first) = debugger.differences().first() {
        // Standard error may be closed.
        let _ = writeln!(io::stderr(), "{}", first.mismatch.summary());
    }
    let history = debugger.history_mut();
    let branches: BTreeMap<BranchId, _> =
        history.branches().map(|branch| (branch.id, branch)).collect();
    let heading = history.heading();
    let Some(end) = branches.get(&heading) else { return Ok(()) };
    let end = Place { branch: heading, moment: end.end };
    let ends = left_at(&branches, heading);
    let mut branch = BranchId(0);
    if let Some(first) = branches.get(&branch) {
        history.go_to_end(heading);
        history.go_back_to(Place { branch, moment: first.first });
    }
    // Whoever gets the page has no use for the folder.
    let title = text::name(recording.file_name().map_or(recording, Path::new));
    let mut film = Film::new(&title, &model, &machine, history.device().device());
    film.went_back(branches.len() - 1);
    film.differs(differences);
    film.has_end(share.is_whole());
    while !has_come_to(history.present(), end) && history.find_next(Time::NEVER, |_, _, _| true) {
        if history.present().branch != branch {
            branch = history.present().branch;
            let first = branches.get(&branch).map_or(history.now(), |branch| branch.first.at);
            film.part(branch.0, first);
        }
        if ends.get(&branch).is_some_and(|end| history.now() > *end) {
            continue;
        }
        for report in history.outputs().iter().filter_map(report) {
            film.tell(&report, history.device().device());
        }
        film.see(history.device().device());
    }
    // Time may have passed since the last thing that happened.
    history.go_to(end);
    film.see(history.device().device());
    let page = film.page().map_err(Failure::midway)?;
    destination.write(page.as_ref())
}

/// Up to when the branches count on the way to one, where somebody has left them for an earlier time.
fn left_at(branches: &BTreeMap<BranchId, Branch>, to: BranchId) -> BTreeMap<BranchId, Time> {
    let mut ends = BTreeMap::new();
    let mut next = branches.get(&to);
    while let Some(branch) = next
        && let Some(parted) = branch.parted
    {
        ends.insert(parted.branch, branch.first.at);
        next = branches.get(&parted.branch);
    }
    ends
}

/// Whether a file is a page, or nothing yet.
fn is_page(path: &Path) -> bool {
    let mut begin = Vec::new();
    let read = File::open(path).and_then(|file| file.take(64).read_to_end(&mut begin));
    read.is_ok() && (begin.is_empty() || begin.to_ascii_lowercase().starts_with(PAGE))
}
