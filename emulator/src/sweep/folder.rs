//! The folder in which the results of a sweep are kept.
//!
//! Results are added line by line, so whatever was found before a sweep is killed is there when it is
//! resumed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use vimc4::sweep::{Case, Results, ResultsError, Row, Shard};

use crate::failure::Failure;

/// A folder of results that is written.
pub(super) struct Folder {
    path: PathBuf,
    file: File,
    name: PathBuf,
    pub(super) results: Results,
}

impl Folder {
    /// Opens a folder for the points of a shard. What is there already is gone on with if that is wanted,
    /// and an error if not.
    pub(super) fn open(
        path: &Path,
        shard: Shard,
        results: Results,
        resume: bool,
    ) -> Result<Folder, Failure> {
        let failed = |error| cannot(path, error);
        fs::create_dir_all(path).map_err(failed)?;
        let name = path.join(format!("results-{}-of-{}.jsonl", shard.number, shard.of));
        // Other shards of the same sweep may have their results here, and nothing else.
        for file in results_in(path).map_err(failed)?.into_iter().filter(|file| *file != name) {
            // One that is being written may be locked.
            let Ok(text) = fs::read_to_string(&file) else { continue };
            results.clone().read(&text).map_err(|error| wrong(&file, error, ELSEWHERE))?;
        }
        let mut folder = match fs::read_to_string(&name) {
            Ok(_) if !resume => {
                return Err(Failure::usage(format!(
                    "{} has results already; go on with --resume, or name another folder with --out",
                    path.display()
                )));
            }
            Ok(text) => {
                let mut results = results;
                let whole = results.read(&text).map_err(|error| wrong(&name, error, ELSEWHERE))?;
                // A line that was being written is written again.
                let cut = OpenOptions::new().write(true).open(&name);
                cut.and_then(|file| file.set_len(whole as u64)).map_err(failed)?;
                let file = added_to().open(&name).map_err(failed)?;
                Folder { path: path.to_owned(), file, name, results }
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                let file = added_to().create_new(true).open(&name).map_err(failed)?;
                Folder { path: path.to_owned(), file, name, results }
            }
            Err(error) => return Err(failed(error)),
        };
        match folder.file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(Failure::usage(format!(
                    "another sweep writes into {}; wait for its end, or name another folder with --out",
                    path.display()
                )));
            }
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let cases = folder.results.cases().values();
        let is_lost = |case: &&Case| !path.join(recording_of(case)).exists();
        let lost: Vec<u64> = cases.filter(is_lost).map(|case| case.point).collect();
        lost.into_iter().for_each(|point| folder.results.forget(point));
        if folder.file.metadata().map_err(failed)?.len() == 0 {
            let head: Vec<Row> = folder.results.head().into_iter().collect();
            folder.write(&head)?;
        }
        Ok(folder)
    }

    /// Adds lines, which the operating system has when this returns.
    pub(super) fn write(&mut self, rows: &[Row]) -> Result<(), Failure> {
        self.file.write_all(&lines(rows)).map_err(|error| cannot(&self.name, error))
    }

    /// Keeps the recording of a case, and what the host has printed.
    pub(super) fn keep(
        &self,
        case: &Case,
        recording: &[u8],
        printed: &[u8],
    ) -> Result<(), Failure> {
        let file = self.path.join(recording_of(case));
        fs::write(&file, recording).map_err(|error| cannot(&file, error))?;
        if !printed.is_empty() {
            let file = self.path.join(printed_of(case));
            fs::write(&file, printed).map_err(|error| cannot(&file, error))?;
        }
        Ok(())
    }

    /// Puts the results in order, and removes recordings of cases that are not the smallest.
    pub(super) fn finish(self) -> Result<Results, Failure> {
        let Folder { path, file, name, results } = self;
        // A lock may keep readers out, and another file from taking the place of this one.
        drop(file);
        // Another shard may have its cases in the same folder.
        let mut all = results.clone();
        for file in results_in(&path).map_err(|error| cannot(&path, error))? {
            if let Ok(text) = fs::read_to_string(&file) {
                let _ = all.read(&text);
            }
        }
        write_whole(&name, &lines(&results.lines()))?;
        tidy(&path, &[&all, &results])?;
        Ok(results)
    }
}

/// The name of the recording of a case.
pub(super) fn recording_of(case: &Case) -> String {
    format!("case-{}.jsonl", case.point)
}

pub(super) fn printed_of(case: &Case) -> String {
    format!("case-{}.txt", case.point)
}

/// Puts the results in several folders together in another one.
pub(super) fn merge(folders: &[PathBuf], out: &Path) -> Result<Results, Failure> {
    if results_in(out).is_ok_and(|files| !files.is_empty()) {
        return Err(Failure::usage(format!(
            "{} has results already; name another folder with --out",
            out.display()
        )));
    }
    let mut results = Results::default();
    let mut files = 0;
    for folder in folders {
        for file in results_in(folder).map_err(|error| cannot(folder, error))? {
            let text = fs::read_to_string(&file).map_err(|error| cannot(&file, error))?;
            results.read(&text).map_err(|error| wrong(&file, error, "name parts of one sweep"))?;
            files += 1;
        }
    }
    if files == 0 {
        return Err(Failure::usage(
            "there are no results in these folders; name folders into which `vimc4 sweep --out` has written",
        ));
    }
    fs::create_dir_all(out).map_err(|error| cannot(out, error))?;
    let name = out.join("results-1-of-1.jsonl");
    write_whole(&name, &lines(&results.lines()))?;
    for case in results.cases().values() {
        for name in [recording_of(case), printed_of(case)] {
            let from = folders.iter().map(|folder| folder.join(&name)).find(|file| file.exists());
            let to = out.join(&name);
            if let Some(from) = from.filter(|from| *from != to) {
                fs::copy(&from, &to).map_err(|error| cannot(&to, error))?;
            }
        }
    }
    Ok(results)
}

fn results_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with("results-") && name.ends_with(".jsonl") {
            files.push(entry.path());
        }
    }
    files.sort();
    Ok(files)
}

/// Removes the recordings of cases that none of these has.
fn tidy(folder: &Path, results: &[&Results]) -> Result<(), Failure> {
    let cases = results.iter().flat_map(|results| results.cases().values());
    let kept: Vec<String> = cases.flat_map(|case| [recording_of(case), printed_of(case)]).collect();
    let failed = |error| cannot(folder, error);
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let number = name.strip_prefix("case-").and_then(|rest| rest.split_once('.'));
        let is_case = number.is_some_and(|(number, _)| number.parse::<u64>().is_ok());
        if is_case && !kept.contains(&name) {
            fs::remove_file(entry.path()).map_err(failed)?;
        }
    }
    Ok(())
}

/// How a file is opened to which lines are added. Windows locks none that could not be read, too.
fn added_to() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).append(true);
    options
}

/// Writes a file so that it is there as a whole or as it was.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let new = path.with_extension("new");
    fs::write(&new, bytes)
        .and_then(|()| fs::rename(&new, path))
        .map_err(|error| cannot(path, error))
}

fn lines(rows: &[Row]) -> Vec<u8> {
    let mut lines = Vec::new();
    for row in rows {
        // Every row can be written.
        lines.extend(serde_json::to_vec(row).unwrap_or_default());
        lines.push(b'\n');
    }
    lines
}

/// What to do with results that are in the way.
const ELSEWHERE: &str = "name another folder with --out";

fn wrong(path: &Path, error: ResultsError, help: &str) -> Failure {
    let help = match error {
        ResultsError::Unreadable { .. } => "remove the file and begin again",
        ResultsError::Another { .. } => help,
    };
    Failure::usage(format!("{}, {error}; {help}", path.display()))
}

fn cannot(path: &Path, error: io::Error) -> Failure {
    let path = path.display();
    Failure::usage(format!("cannot use {path}: {error}; name a folder that can be written to"))
}
