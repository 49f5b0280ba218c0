//! Where the sessions come from: the built-in ones, or a folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use vimc4_conform::fixtures;
use vimc4_conform::format::{self, Session};

use crate::failure::Failure;
use crate::job::file::bounded;

/// No file of sessions is as large as this.
const LARGEST: u64 = 16 << 20;

/// The sessions of a folder, else the built-in ones.
pub(super) fn sessions(folder: Option<&Path>) -> Result<Vec<Session>, Failure> {
    let Some(folder) = folder else { return fixtures::sessions().map_err(Failure::usage) };
    let mut programs: BTreeMap<String, String> = fixtures::programs();
    let own = folder.join("programs");
    if own.is_dir() {
        for path in entries(&own)?.into_iter().filter(|path| path.is_file()) {
            programs.insert(name(&path), read(&path)?);
        }
    }
    let mut sessions = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let topic = name(&folder);
        for path in entries(&folder)?.into_iter().filter(|path| *path != own) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "toml") {
                let more = format::parse(&topic, &path, &read(&path)?, &programs);
                sessions.extend(more.map_err(Failure::usage)?);
            }
        }
    }
    sessions.sort_by(|one: &Session, other| one.path.cmp(&other.path));
    if sessions.is_empty() {
        return Err(Failure::usage(format!(
            "{} holds no sessions; they are TOML files in it or in folders below it",
            folder.display()
        )));
    }
    Ok(sessions)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let listed = fs::read_dir(folder).and_then(|entries| {
        entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()
    });
    let mut paths = listed.map_err(|error| cannot_read(folder, &error))?;
    paths.sort();
    Ok(paths)
}

fn read(path: &Path) -> Result<String, Failure> {
    bounded(path, LARGEST)
        .and_then(|bytes| String::from_utf8(bytes).map_err(std::io::Error::other))
        .map_err(|error| cannot_read(path, &error))
}

fn cannot_read(path: &Path, error: &std::io::Error) -> Failure {
    Failure::usage(format!("cannot read {}: {error}; check its name", path.display()))
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
