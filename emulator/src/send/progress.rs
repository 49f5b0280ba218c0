//! How far a job is, as seen from its rehearsal.

use std::time::Duration;

use crate::job::virtual_time::Did;

/// What was done in rehearsal, and how much of it is done.
#[derive(Default)]
pub(super) struct Progress {
    rehearsed: Vec<Did>,
    /// The line that is under way.
    line: u32,
    /// The thing in rehearsal that is next, of those in that line.
    next: usize,
    /// Behind the last of them.
    end: usize,
}

impl Progress {
    /// Nothing is done of it.
    pub(super) fn new(rehearsed: Vec<Did>) -> Progress {
        Progress { rehearsed, ..Progress::default() }
    }

    /// The line that is under way.
    pub(super) fn line(&self) -> u32 {
        self.line
    }

    /// Something that a line asks for begins.
    pub(super) fn begins(&mut self, line: u32) {
        let rest = self.rehearsed.get(self.next..).unwrap_or_default();
        let is_new = self.line != line || self.end == 0;
        self.line = line;
        if !is_new {
            return;
        }
        // Where the operator has typed something, more was done than in rehearsal.
        if let Some(at) = rest.iter().position(|did| did.line == line) {
            self.next += at;
        }
        let is_other = |did: &Did| did.line != line;
        let rest = self.rehearsed.get(self.next..).unwrap_or_default();
        self.end = self.next + rest.iter().position(is_other).unwrap_or(rest.len());
    }

    /// It is done. The last thing of a line is done only when the next line begins, because
    /// anything typed there is done in the same line.
    pub(super) fn done(&mut self) {
        self.next = (self.next + 1).min(self.end.saturating_sub(1).max(self.next));
    }

    /// How long the next thing took in rehearsal, and when it began there.
    pub(super) fn expected(&self) -> (Duration, Duration) {
        let at = |place: usize| {
            let did = self.rehearsed.get(place).or(self.rehearsed.last());
            Duration::from_millis(did.map_or(0, |did| did.millis).into())
        };
        let began = self.next.checked_sub(1).map_or(Duration::ZERO, at);
        (began, at(self.next).saturating_sub(began))
    }

    /// Whether the same was sent in rehearsal.
    pub(super) fn is_foreseen(&self, sent: &[u8]) -> bool {
        self.rehearsed.get(self.next).is_some_and(|did| did.sent == sent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn did(line: u32, millis: u32, sent: &str) -> Did {
        Did { line, millis, sent: sent.as_bytes().to_vec() }
    }

    #[test]
    fn what_is_typed_at_a_question_takes_nothing_from_what_remains() {
        let mut progress = Progress::new(vec![
            did(0, 0, "@07"),
            did(0, 0, "@0z1"),
            did(3, 1_000, "@0A1"),
            did(4, 1_000, ""),
            did(5, 3_000, "@0A2"),
            did(5, 7_000, "@0A3"),
        ]);
        let mut goes = |line, sent: &str, began, takes| {
            progress.begins(line);
            let expected = (Duration::from_secs(began), Duration::from_secs(takes));
            assert_eq!(progress.expected(), expected, "{sent}");
            let is_foreseen = progress.is_foreseen(sent.as_bytes());
            progress.done();
            is_foreseen
        };
        assert!(goes(0, "@07", 0, 0));
        assert!(goes(0, "@0z1", 0, 0));
        assert!(goes(3, "@0A1", 0, 1));
        assert!(goes(4, "", 1, 0));
        // Typed at the question in line 4.
        for _ in 0..5 {
            assert!(!goes(4, "@0A2", 1, 0));
        }
        assert!(goes(5, "@0A2", 1, 2));
        assert!(goes(5, "@0A3", 3, 4));
        // More pieces than in rehearsal.
        assert!(!goes(5, "@0A4", 3, 4));
        assert!(!goes(6, "@0A5", 3, 4));
    }
}
