//! The sink for the actions and diagnostics of a line.

use crate::job::action::{Action, micros};
use crate::job::problem::Problem;
use crate::language::{Span, Value, Word};

/// Takes a diagnostic about a part of the line.
pub(super) type Reporter<'r> = &'r mut dyn FnMut(Span, Problem);

/// The sink for the actions and diagnostics of a line.
pub(super) struct Sink<'s> {
    /// Where its command stands.
    pub(super) span: Span,
    pub(super) actions: &'s mut Vec<Action>,
    pub(super) report: Reporter<'s>,
}

impl Sink<'_> {
    /// Adds an action.
    pub(super) fn push(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Adds a pause.
    pub(super) fn dwell(&mut self, word: Word) {
        if word.value > Value::ZERO {
            self.push(Action::Dwell(micros(word.value)));
        }
    }

    /// Reports something about the command.
    pub(super) fn say(&mut self, problem: Problem) {
        (self.report)(self.span, problem);
    }

    /// Reports something about a part of it.
    pub(super) fn say_at(&mut self, span: Span, problem: Problem) {
        (self.report)(span, problem);
    }
}
