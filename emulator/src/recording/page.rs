//! A recording as a page that shows it, without a server.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use vimc4_answers::past::{has_come_to, report};
use vimc4_api::Film;
use vimc4_debug::{Read, uninterrupted};
use vimc4_timeline::{BranchId, Place};

use super::history::{Commands, Opened, open};
use crate::failure::Failure;
use crate::output::{create, unwritable};
use crate::text;

/// How a page begins.
const PAGE: &[u8] = b"<!doctype html>";

/// Writes it.
pub(super) fn write(recording: &Path, out: &PathBuf) -> Result<(), Failure> {
    if out.is_file() && !is_page(out) {
        let name = text::name(out);
        return Err(Failure::usage(format!(
            "{name} is there and is no page, and would be overwritten; name another file"
        )));
    }
    create(out)?;
    let Opened { mut debugger, model, machine, .. } = open(recording, Commands::Unlisted)?;
    if let Read::Broken(why) = debugger.read_on(usize::MAX, &mut uninterrupted) {
        return Err(Failure::midway(why));
    }
    let history = debugger.history_mut();
    let branches: BTreeMap<BranchId, _> =
        history.branches().map(|branch| (branch.id, branch)).collect();
    let heading = history.heading();
    let Some(end) = branches.get(&heading) else { return Ok(()) };
    let end = Place { branch: heading, moment: end.end };
    let mut branch = BranchId(0);
    if let Some(first) = branches.get(&branch) {
        history.go_to_end(heading);
        history.go_back_to(Place { branch, moment: first.first });
    }
    let mut film = Film::new(&text::name(recording), &model, &machine, history.device());
    while !has_come_to(history.present(), end)
        && history.find_next(end.moment.at.max(history.now()), |controller, _, outputs| {
            for output in outputs {
                if let Some(report) = report(output) {
                    film.tell(&report, controller);
                }
            }
            film.see(controller);
            true
        })
    {
        if history.present().branch != branch {
            branch = history.present().branch;
            let first = branches.get(&branch).map_or(history.now(), |branch| branch.first.at);
            film.part(branch.0, first);
        }
    }
    let page = film.page().map_err(Failure::midway)?;
    fs::write(out, page).map_err(|error| unwritable(out, &error))
}

/// Whether a file is a page, or nothing yet.
fn is_page(path: &Path) -> bool {
    let mut begin = Vec::new();
    let read = File::open(path).and_then(|file| file.take(64).read_to_end(&mut begin));
    read.is_ok() && (begin.is_empty() || begin.to_ascii_lowercase().starts_with(PAGE))
}
