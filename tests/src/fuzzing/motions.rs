//! The course of motions, as they are watched.

use vimc4_device::{CommandNumber, Motion};

/// Follows what is told of motions: one at a time, none longer than its path, and each of one
/// command, or of none, from its beginning to its end.
#[derive(Clone, Debug, Default)]
pub(super) struct Motions {
    /// The command of the running motion, and the length of its path in steps.
    running: Option<(Option<CommandNumber>, u64)>,
}

impl Motions {
    pub(super) fn follow(&mut self, command: Option<CommandNumber>, motion: &Motion) {
        match motion {
            Motion::Begins { segment, .. } => {
                assert!(self.running.is_none(), "a motion begins within another");
                assert!(segment.profile.steps() <= segment.path.length());
                self.running = Some((command, segment.path.length()));
            }
            Motion::Changes { segment } => {
                assert_eq!(
                    self.running,
                    Some((command, segment.path.length())),
                    "no motion to change"
                );
            }
            Motion::Ends { steps } => {
                let running = self.running.take();
                let ends = |(by, length)| by == command && *steps <= length;
                assert!(running.is_some_and(ends), "no motion of {command:?} to end");
            }
        }
    }
}
