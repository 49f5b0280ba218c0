//! The built-in sessions and programs, which are the files below `fixtures/`.

use std::collections::BTreeMap;
use std::path::Path;

use crate::format::{self, FormatError, Session, TOPICS};

/// Topic, path and text of every session file.
const SESSIONS: &[(&str, &str, &str)] = include!(concat!(env!("OUT_DIR"), "/sessions.rs"));

/// Name and text of every program that sessions store.
const PROGRAMS: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/programs.rs"));

/// Reads every built-in session, in the order of topics, files and lines.
///
/// # Errors
///
/// The first mistake in a file, with its place.
pub fn sessions() -> Result<Vec<Session>, FormatError> {
    let programs = programs();
    let mut sessions = Vec::new();
    if let Some((topic, path, _)) =
        SESSIONS.iter().find(|(topic, ..)| !TOPICS.iter().any(|(known, _)| known == topic))
    {
        let message = format!("{topic:?} is no topic; add it to TOPICS in crates/conform");
        return Err(FormatError { path: path.into(), line: 1, message });
    }
    for (topic, _) in TOPICS {
        for (_, path, text) in SESSIONS.iter().filter(|(of, ..)| *of == topic) {
            sessions.extend(format::parse(topic, Path::new(path), text, &programs)?);
        }
    }
    Ok(sessions)
}

/// The built-in programs for the data field: name and text.
#[must_use]
pub fn programs() -> BTreeMap<String, String> {
    PROGRAMS.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
}
