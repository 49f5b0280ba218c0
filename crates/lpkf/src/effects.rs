//! What a command may do to a machine.

use crate::language::Command;

impl Command {
    /// Whether it may set an axis in motion.
    #[must_use]
    pub fn moves(&self) -> bool {
        matches!(
            self,
            Command::ArcAbsolute { .. }
                | Command::Circle(_)
                | Command::EdgeAbsolute(_)
                | Command::EdgeRelative(_)
                | Command::SpaceAbsolute(_)
                | Command::SpaceRelative(_)
                | Command::ArcRelative { .. }
                | Command::PlotAbsolute(_)
                | Command::PlotRelative(_)
                | Command::MoveAllAbsolute(_)
                | Command::MoveAllRelative(_)
                | Command::MoveZAbsolute(_)
                | Command::MoveZRelative(_)
                | Command::MoveAxisAbsolute { .. }
                | Command::MoveAxisRelative { .. }
                | Command::FollowVectors { .. }
                | Command::Repeat
                | Command::OpenInterface(_)
        ) || self.resumes()
            || self.seeks_switches()
    }

    /// Whether it continues an aborted command in any way.
    pub(crate) fn resumes(&self) -> bool {
        matches!(self, Command::Continue | Command::GoBack | Command::RepeatBroken)
    }

    /// Whether it drives axes to their switches, wherever those are.
    #[must_use]
    pub(crate) fn seeks_switches(&self) -> bool {
        matches!(self, Command::Reference(_) | Command::HardClipLimits(_))
    }

    /// Whether it switches the spindle, the head, the motor currents or an output.
    #[must_use]
    pub(crate) fn switches_outputs(&self) -> bool {
        matches!(
            self,
            Command::PenDown
                | Command::PenUp
                | Command::Spindle(_)
                | Command::FullCurrent
                | Command::HalfCurrent
                | Command::WritePort { .. }
                | Command::Repeat
        )
    }
}
