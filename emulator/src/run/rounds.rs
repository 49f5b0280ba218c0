//! The rounds of a program without an end.

use std::collections::BTreeMap;

/// How often a program must come by without anything having happened before it is sure that
/// nothing will. Once would do but for the loops that are left open, and these are 15 at most.
const SURE: u32 = 16;

/// Follows a program from line to line.
///
/// A *round* is over whenever the program jumps back to the earliest line that it comes to again.
/// Jumps of loops that have a count are no rounds, and neither is a jump back if nothing moved, was
/// switched or sent since the line it leads to was executed last: that is waiting.
#[derive(Debug, Default)]
pub(crate) struct Rounds {
    /// The lines whose jumps back are counted, so that they come to an end by themselves.
    counted: Vec<u32>,
    /// What had happened when a line was executed last.
    seen: BTreeMap<u32, Happened>,
    happened: Happened,
    last: Option<u32>,
    /// The line where a round begins.
    head: Option<u32>,
    made: u64,
    /// How often it came by in vain since something happened.
    in_vain: u32,
}

/// How much has happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Happened {
    /// Things that the world notices.
    outside: u64,
    /// Jumps of loops that have a count.
    repeats: u64,
}

impl Rounds {
    /// Says which program is followed from now on, by the text of its lines.
    pub(crate) fn begin(&mut self, lines: &[String]) {
        let counted = (0..).zip(lines).filter(|(_, text)| is_counted_loop(text));
        *self = Rounds { counted: counted.map(|(line, _)| line).collect(), ..Rounds::default() };
    }

    /// Something moved, was switched or sent.
    pub(crate) fn something_happened(&mut self) {
        self.happened.outside += 1;
        self.in_vain = 0;
    }

    /// An act from outside, which may change the course of the program.
    pub(crate) fn disturbed(&mut self) {
        self.in_vain = 0;
    }

    /// A line is executed.
    pub(crate) fn line(&mut self, line: u32) {
        let from = self.last.replace(line).filter(|&from| from >= line);
        let seen = self.seen.insert(line, self.happened);
        let (Some(from), Some(seen)) = (from, seen) else { return };
        if self.counted.binary_search(&from).is_ok() {
            self.happened.repeats += 1;
            self.in_vain = 0;
        } else if seen == self.happened {
            self.in_vain += 1;
        } else if seen.outside != self.happened.outside {
            match self.head {
                Some(head) if head < line => {}
                Some(head) if head == line => self.made += 1,
                _ => {
                    self.head = Some(line);
                    self.made = 1;
                }
            }
        }
    }

    /// The line that was executed last.
    pub(crate) fn last(&self) -> Option<u32> {
        self.last
    }

    /// How many rounds have been made.
    pub(crate) fn made(&self) -> u64 {
        self.made
    }

    /// Whether the program goes round in a circle and will do so for ever without an act from
    /// outside.
    pub(crate) fn is_idling(&self) -> bool {
        self.in_vain >= SURE
    }
}

/// Whether a line is a loop with a count, such as `35,-6`; `30,-6` is a jump.
fn is_counted_loop(text: &str) -> bool {
    let text: String = text.chars().filter(|c| *c != ' ').collect();
    let count = text.strip_prefix('3').and_then(|fields| fields.split(',').next()?.parse().ok());
    count.is_some_and(|count: u32| count != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounds(program: &[&str]) -> Rounds {
        let mut rounds = Rounds::default();
        rounds.begin(&program.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>());
        rounds
    }

    #[test]
    fn a_loop_has_a_count_and_a_jump_has_none() {
        for (text, counted) in [
            ("35,-6", true),
            (" 3 5, -6", true),
            ("3+5,-6", true),
            ("30,-6", false),
            ("3 0,-6", false),
            ("300,-6", false),
            ("3", false),
            ("", false),
        ] {
            assert_eq!(is_counted_loop(text), counted, "{text}");
        }
    }

    #[test]
    fn rounds_end_at_the_earliest_line_that_comes_again() {
        // 0 a reference run, 1 a move, 2 a move, 3 twice from 2, 4 back to 1
        let mut rounds = rounds(&["77", "0", "0", "32,-1", "30,-3"]);
        for line in [0, 1, 2, 3, 2, 3, 4] {
            rounds.line(line);
            rounds.something_happened();
        }
        assert_eq!(rounds.made(), 0);
        for round in 1..=3 {
            for line in [1, 2, 3, 2, 3, 4] {
                rounds.line(line);
                rounds.something_happened();
            }
            assert_eq!(rounds.made(), round);
        }
        assert!(!rounds.is_idling());
    }

    #[test]
    fn waiting_makes_no_rounds_and_is_noticed() {
        // 0 a move, 1 asks a port, 2 back to 1
        let mut rounds = rounds(&["0", "o0,3,1,1", "30,-1"]);
        rounds.line(0);
        rounds.something_happened();
        for _ in 0..SURE {
            assert!(!rounds.is_idling());
            rounds.line(1);
            rounds.line(2);
        }
        rounds.line(1);
        assert!(rounds.is_idling());
        rounds.disturbed();
        assert!(!rounds.is_idling());
        assert_eq!(rounds.made(), 0);
    }
}
