//! The sessions, played: what happened in them, for the pages of the commands, and line by line for whoever
//! opens one.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde_json::{Value, json};
use vimc4_catalogue::Family;
use vimc4_conform::fixtures;
use vimc4_conform::format::Session;
use vimc4_conform::transcript::{Transcript, transcript};

use crate::{Outcome, paths};

/// A session and how it goes on each of its models.
pub(crate) struct Played {
    pub(crate) session: Session,
    /// In the order of its models.
    told: Vec<(&'static str, Transcript)>,
    /// The commands that are executed in it, and on which models.
    pub(crate) commands: BTreeMap<String, BTreeSet<&'static str>>,
}

impl Played {
    pub(crate) fn family(&self) -> Family {
        self.session.family
    }

    /// Its file below `fixtures/sessions`, without the ending.
    pub(crate) fn file(&self) -> &str {
        self.session.id.rsplit_once('/').map_or("", |(file, _)| file)
    }

    /// As a page has it. Models on which it goes alike are told of once.
    fn json(&self) -> Value {
        let mut told: Vec<(Vec<&str>, &Transcript)> = Vec::new();
        for (model, transcript) in &self.told {
            match told.iter_mut().find(|(_, other)| *other == transcript) {
                Some((models, _)) => models.push(model),
                None => told.push((vec![model], transcript)),
            }
        }
        let Session { title, source, profile, machine, .. } = &self.session;
        json!({
            "title": title,
            "evidence": source.evidence().to_string(),
            "source": source.to_string(),
            "profile": profile,
            "machine": { "name": machine.name, "differs": machine.differs },
            "paced": self.session.line_pacing,
            "told": told.iter().map(|(models, transcript)| {
                json!({ "models": models, "lines": transcript.lines })
            }).collect::<Vec<_>>(),
        })
    }
}

/// Plays every session on each of its models. One that goes otherwise than it says is an error.
pub(crate) fn play() -> Outcome<Vec<Played>> {
    let sessions = fixtures::sessions().map_err(|error| error.to_string())?;
    sessions.into_iter().map(played).collect()
}

fn played(session: Session) -> Outcome<Played> {
    let mut told = Vec::new();
    let mut commands: BTreeMap<String, BTreeSet<&str>> = BTreeMap::new();
    for &model in &session.models {
        let transcript = transcript(&session, model)?;
        if let Some(failure) = &transcript.failure {
            let (text, got) = (&failure.text, &failure.got);
            return Err(format!("{} on {model}: `{text}`: {got}", session.id));
        }
        for command in &transcript.commands {
            commands.entry(command.to_string()).or_default().insert(model);
        }
        told.push((model, transcript));
    }
    Ok(Played { session, told, commands })
}

/// Writes how the sessions go, a file for each file of theirs.
pub(crate) fn write(played: &[Played], folder: &Path) -> Outcome<()> {
    let mut files: BTreeMap<&str, BTreeMap<&str, Value>> = BTreeMap::new();
    for session in played {
        files.entry(session.file()).or_default().insert(&session.session.id, session.json());
    }
    for (file, sessions) in files {
        let text = serde_json::to_string(&sessions).map_err(|error| error.to_string())?;
        paths::write(&folder.join(format!("{file}.json")), text)?;
    }
    Ok(())
}
