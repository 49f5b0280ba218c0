//! What the sessions show: the commands that are executed in them, and what those answer.

use vimc4_conform::format::Session;
use vimc4_conform::play::{Drive, Record, play};
use vimc4_conform::workshop::Workshop;
use vimc4_lpkf::language::{Answer, Dialect, Form, Status};

/// A session on one of its models.
#[derive(Clone, Debug)]
pub struct Shown<'s> {
    /// The session.
    pub session: &'s Session,
    /// The model.
    pub model: &'static str,
    /// What was seen.
    pub record: Record,
}

/// Plays sessions on each of their models. One that fails shows nothing; it is reported by the
/// test that is named after it.
pub fn shown<'s>(sessions: impl IntoIterator<Item = &'s Session>) -> Vec<Shown<'s>> {
    let played = sessions.into_iter().flat_map(|session| {
        session.models.iter().filter_map(move |&model| {
            let workshop = Workshop::new(session, model).ok()?;
            let (record, _) = play(session, Drive::Smooth, |flash| workshop.build(flash)).ok()?;
            Some(Shown { session, model, record })
        })
    });
    played.collect()
}

impl Shown<'_> {
    /// Whether it is played on a model of LPKF with these commands.
    #[must_use]
    pub fn speaks(&self, dialect: Dialect) -> bool {
        let model = vimc4_lpkf::Model::builtin(self.model);
        model.is_some_and(|model| model.command_set == dialect)
    }

    /// Whether a command of LPKF's is carried out in it.
    #[must_use]
    pub fn holds(&self, form: &Form) -> bool {
        let mut answers = self.record.answers.iter().filter(|(of, _)| *of == form.mnemonic);
        match form.answer {
            Answer::Silence => self.record.commands.contains(form.mnemonic),
            _ => answers.any(|(_, kind)| !kind.starts_with('E')),
        }
    }

    /// Whether LPKF's controller sends this status in it.
    #[must_use]
    pub fn sends(&self, status: Status, dialect: Dialect) -> bool {
        let written = status.written(dialect, false);
        written.is_some_and(|text| self.record.answers.iter().any(|(_, kind)| *kind == text))
    }
}
