//! The course of motions, as they are watched.

use vimc4_device::Motion;

/// Follows what is told of motions: one at a time, none longer than its path.
#[derive(Clone, Debug, Default)]
pub(super) struct Motions {
    /// The length of the path of the running motion, in steps.
    running: Option<u64>,
}

impl Motions {
    pub(super) fn follow(&mut self, motion: &Motion) {
        match motion {
            Motion::Begins { segment, .. } => {
                assert!(self.running.is_none(), "a motion begins within another");
                assert!(segment.profile.steps() <= segment.path.length());
                self.running = Some(segment.path.length());
            }
            Motion::Changes { segment } => {
                assert_eq!(self.running, Some(segment.path.length()), "no motion to change");
            }
            Motion::Ends { steps } => {
                let length = self.running.take();
                assert!(length.is_some_and(|length| *steps <= length), "no motion to end");
            }
        }
    }
}
