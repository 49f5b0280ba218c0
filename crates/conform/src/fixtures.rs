//! The built-in sessions and programs, read from the files below `fixtures/`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use vimc4_catalogue::Family;
use vimc4_fixtures::{PROGRAMS, SESSIONS, SessionFile, TOPICS};

use crate::format::{self, FormatError, Session};

/// The topics of each family: folder and heading.
static HEADINGS: LazyLock<BTreeMap<String, Vec<(String, String)>>> = LazyLock::new(|| {
    // A mistake in it is then a mistake in every session file, and a test names it.
    toml::from_str(TOPICS).unwrap_or_default()
});

/// The topics of a family, which are the folders below `fixtures/sessions` and its name, in the
/// order of the behaviour document, and their headings there.
#[must_use]
pub fn topics(family: Family) -> &'static [(String, String)] {
    HEADINGS.get(family.name()).map_or(&[], Vec::as_slice)
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
    if let Some(SessionFile { family, topic, path, .. }) =
        SESSIONS.iter().find(|file| !is_known(file.family, file.topic))
    {
        let message = format!("{family}/{topic} is not a topic; add it to fixtures/topics.toml");
        return Err(FormatError { path: path.into(), line: 1, message });
    }
    let programs = programs();
    let mut sessions = Vec::new();
    for family in Family::ALL {
        for (topic, _) in topics(family) {
            let belongs = |file: &&SessionFile| file.family == family.name() && file.topic == topic;
            for SessionFile { path, text, .. } in SESSIONS.iter().filter(belongs) {
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
        let topics: BTreeMap<String, Vec<(String, String)>> = toml::from_str(TOPICS).unwrap();
        assert_eq!(topics, *HEADINGS);
        for (family, topics) in &topics {
            assert!(Family::ALL.into_iter().any(|known| known.name() == family), "{family}");
            for (topic, _) in topics {
                let belongs = |file: &SessionFile| file.family == family && file.topic == topic;
                assert!(SESSIONS.iter().any(belongs), "{family}/{topic}");
            }
        }
    }
}
