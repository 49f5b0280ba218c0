//! The built-in sessions and programs, which are the files below `fixtures/`.

use std::collections::BTreeMap;
use std::path::Path;

use vimc4_catalogue::Family;

use crate::format::{self, FormatError, Session, topics};

/// Family, topic, path and text of every session file.
const SESSIONS: &[(&str, &str, &str, &str)] = include!(concat!(env!("OUT_DIR"), "/sessions.rs"));

/// Name and text of every program that sessions store.
const PROGRAMS: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/programs.rs"));

/// Reads every built-in session, in the order of families, topics, files and lines.
///
/// # Errors
///
/// The first mistake in a file, with its place.
pub fn sessions() -> Result<Vec<Session>, FormatError> {
    let is_known = |of: &str, about: &str| {
        let family = Family::ALL.into_iter().find(|family| family.name() == of);
        family.is_some_and(|family| topics(family).iter().any(|(topic, _)| *topic == about))
    };
    if let Some((family, topic, path, _)) =
        SESSIONS.iter().find(|(of, about, ..)| !is_known(of, about))
    {
        let message =
            format!("{family}/{topic} is no topic; add it to the topics in crates/conform");
        return Err(FormatError { path: path.into(), line: 1, message });
    }
    let programs = programs();
    let mut sessions = Vec::new();
    for family in Family::ALL {
        for (topic, _) in topics(family) {
            let belongs = |of: &str, about: &str| of == family.name() && about == *topic;
            for (.., path, text) in SESSIONS.iter().filter(|(of, about, ..)| belongs(of, about)) {
                let found = format::parse(topic, Path::new(path), text, &programs)?;
                if let Some(stray) = found.iter().find(|session| session.family != family) {
                    let message = format!(
                        "{} is about {} models; move it to the folder of that family",
                        stray.id, stray.family
                    );
                    return Err(FormatError { path: path.into(), line: 1, message });
                }
                sessions.extend(found);
            }
        }
    }
    Ok(sessions)
}

/// The built-in programs for the data field: name and text.
#[must_use]
pub fn programs() -> BTreeMap<String, String> {
    PROGRAMS.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
}
