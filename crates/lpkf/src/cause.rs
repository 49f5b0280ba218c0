//! What happens by itself, and when.

use vimc4_device::Time;

use crate::state::State;

/// Something that happens by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The present step of the executing command is over, or it has not begun yet.
    Activity,
    /// The trackball was turned, and the axis is free to follow.
    Ball,
    /// `!ST` takes effect: no command executes any more.
    Stop,
    /// The next waiting item has its turn.
    Entry,
    /// The spindle unit has reached its speed.
    SpindleSpeed,
    /// The place of the axis that the trackball moves is sent.
    BallReport,
    /// A contact changes that bounces.
    Contact,
    /// A carriage presses a limit switch or releases it.
    Switch,
}

impl State {
    /// What happens next, and when: at equal times in this order.
    pub(crate) fn next_cause(&self) -> Option<(Time, Cause)> {
        let mut next = match self.job_due() {
            Some(due) => Some((due, Cause::Activity)),
            // Nothing begins while a command executes.
            None if self.ball_turn() => Some((self.now, Cause::Ball)),
            None if self.stop_requested => Some((self.now, Cause::Stop)),
            None if self.entry_turn() => Some((self.now, Cause::Entry)),
            None => None,
        };
        let beside = [(self.unit.due, Cause::SpindleSpeed), (self.ball.due, Cause::BallReport)];
        for (due, cause) in beside {
            if let Some(due) = due
                && next.is_none_or(|(first, _)| due < first)
            {
                next = Some((due, cause));
            }
        }
        // What is already there when something ends comes first.
        if let Some(due) = self.contact_due()
            && next.is_none_or(|(first, _)| due <= first)
        {
            next = Some((due, Cause::Contact));
        }
        if let Some(due) = self.switch_due()
            && next.is_none_or(|(first, _)| due <= first)
        {
            next = Some((due, Cause::Switch));
        }
        next.filter(|(due, _)| *due != Time::NEVER)
    }

    /// When a carriage changes a limit switch next.
    pub(crate) fn switch_due(&self) -> Option<Time> {
        self.plant.switch_due(self.running())
    }

    /// When the next contact changes that bounces.
    pub(crate) fn contact_due(&self) -> Option<Time> {
        if !self.plant.has_faults() {
            return None;
        }
        self.plant.next_contact(self.running(), &self.carriage_signs(), self.now)
    }

    /// Whether it does nothing by itself. The trackball may keep sending the position of its axis.
    pub(crate) fn rests(&self) -> bool {
        let quiet = self.unit.due.is_none() && !self.plant.bounces();
        self.job.is_none() && quiet && !self.entry_turn() && !self.ball_turn()
    }

    /// Whether an axis is to move as the trackball was turned.
    fn ball_turn(&self) -> bool {
        self.job.is_none() && self.ball.waiting != 0 && self.ball_way().is_some()
    }
}
