//! The built-in sessions and programs, which are the files below `fixtures/`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use vimc4_catalogue::Family;

use crate::format::{self, FormatError, Session};

/// The topics of each family: folder and heading.
static TOPICS: LazyLock<BTreeMap<String, Vec<(String, String)>>> = LazyLock::new(|| {
    // A mistake in it is then a mistake in every session file, and a test names it.
    toml::from_str(include_str!("../../../fixtures/topics.toml")).unwrap_or_default()
});

/// Family, topic, path and text of every session file.
const SESSIONS: &[(&str, &str, &str, &str)] = include!(concat!(env!("OUT_DIR"), "/sessions.rs"));

/// Name and text of every program that sessions store.
const PROGRAMS: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/programs.rs"));

/// The topics of a family, which are the folders below `fixtures/sessions` and its name, in the
/// order of the behaviour document, and their headings there.
#[must_use]
pub fn topics(family: Family) -> &'static [(String, String)] {
    TOPICS.get(family.name()).map_or(&[], Vec::as_slice)
}

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
        let message = format!("{family}/{topic} is not a topic; add it to fixtures/topics.toml");
        return Err(FormatError { path: path.into(), line: 1, message });
    }
    let programs = programs();
    let mut sessions = Vec::new();
    for family in Family::ALL {
        for (topic, _) in topics(family) {
            let belongs = |of: &str, about: &str| of == family.name() && about == topic;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_is_of_a_family_and_has_sessions() {
        let text = include_str!("../../../fixtures/topics.toml");
        let topics: BTreeMap<String, Vec<(String, String)>> = toml::from_str(text).unwrap();
        assert_eq!(topics, *TOPICS);
        for (family, topics) in &topics {
            assert!(Family::ALL.into_iter().any(|known| known.name() == family), "{family}");
            for (topic, _) in topics {
                let has = SESSIONS.iter().any(|(of, about, ..)| of == family && about == topic);
                assert!(has, "{family}/{topic}");
            }
        }
    }
}
