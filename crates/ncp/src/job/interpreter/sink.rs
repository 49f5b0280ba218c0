//! Where everything goes that comes of a line.

use crate::job::action::{Action, micros};
use crate::job::problem::Problem;
use crate::language::{Span, Value, Word};

/// Takes what is to be said about a part of the line.
pub(super) type Reporter<'r> = &'r mut dyn FnMut(Span, Problem);

/// Where everything goes that comes of a line.
pub(super) struct Sink<'s> {
    /// Where its command stands.
    pub(super) span: Span,
    pub(super) actions: &'s mut Vec<Action>,
    pub(super) report: Reporter<'s>,
}

impl Sink<'_> {
    /// Something is to be done.
    pub(super) fn push(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Nothing is to be done for a while.
    pub(super) fn dwell(&mut self, word: Word) {
        if word.value > Value::ZERO {
            self.push(Action::Dwell(micros(word.value)));
        }
    }

    /// Something is to be said about the command.
    pub(super) fn say(&mut self, problem: Problem) {
        (self.report)(self.span, problem);
    }

    /// Something is to be said about a part of it.
    pub(super) fn say_at(&mut self, span: Span, problem: Problem) {
        (self.report)(span, problem);
    }
}
