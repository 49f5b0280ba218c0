//! Going forward beside a host that may have something to do before what is sought comes.

use std::collections::VecDeque;

use vimc4_device::{Condition, Output, Time};
use vimc4_timeline::{Act, Begins, Found, History, Progress, Sought, Stretch, Which};

use crate::{Feed, Wired};

/// Goes forward to what is sought, as [`History::seek_next`] does. `None` where the host has its turn before
/// that: at the end of what is known, or where what it [looks for](Feed::looks_for) comes.
pub(crate) fn seek_next(
    history: &mut History<Wired>,
    feed: Option<&Feed>,
    until: Time,
    sought: &mut impl Sought<Wired>,
    progress: &mut Progress<'_>,
) -> Option<Found> {
    let end = end_of(history);
    if feed.is_some() && !history.is_at_end() && end < until {
        let found = history.seek_next(end, sought, progress);
        if found == Found::Nowhere {
            history.run_to(end);
        }
        return Some(found).filter(|found| *found != Found::Nowhere);
    }
    let looked_for = feed.and_then(|feed| feed.looks_for(history));
    seek_or(history, looked_for.as_ref(), until, sought, progress)
}

/// Goes forward to what is sought; `None` where a condition begins to hold before that.
pub(crate) fn seek_or(
    history: &mut History<Wired>,
    condition: Option<&Condition>,
    until: Time,
    sought: &mut impl Sought<Wired>,
    progress: &mut Progress<'_>,
) -> Option<Found> {
    let Some(condition) = condition else {
        return Some(history.seek_next(until, sought, progress));
    };
    let other = Begins::new(condition);
    let mut either = Either { sought, other, is_other: false, looked_until: None };
    let found = history.seek_next(until, &mut either, progress);
    (found != Found::Here || !either.is_other).then_some(found)
}

/// How far the way of the present is known.
pub(crate) fn end_of(history: &History<Wired>) -> Time {
    let heading = history.heading();
    let branch = history.branches().find(|branch| branch.id == heading);
    branch.map_or(Time::NEVER, |branch| branch.end.at)
}

/// Looks, forward, for what is sought and for something else.
struct Either<'s, S> {
    sought: &'s mut S,
    other: Begins<'s>,
    /// Whether only the other was found.
    is_other: bool,
    /// How far what is sought was looked for, if not to the end of the question.
    looked_until: Option<Time>,
}

impl<S: Sought<Wired>> Sought<Wired> for Either<'_, S> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        self.sought.can_be_in(stretch) || Sought::<Wired>::can_be_in(&self.other, stretch)
    }

    fn begin(&mut self, device: &Wired) {
        self.sought.begin(device);
        self.other.begin(device);
    }

    fn between(&mut self, device: &Wired, until: Time, which: Which) -> Option<Time> {
        let other = self.other.between(device, until, which);
        // What is sought is not looked for beyond the other: it counts what it passes.
        let until = other.map_or(until, |at| at.after_nanos(1).min(until));
        let found = self.sought.between(device, until, which);
        self.looked_until = self.sought.looked_until();
        self.is_other = found.is_none() && self.looked_until.is_none();
        found.or(other.filter(|_| self.is_other))
    }

    fn looked_until(&mut self) -> Option<Time> {
        self.looked_until.take()
    }

    fn after(&mut self, device: &Wired, act: Act, outputs: &VecDeque<Output>) -> bool {
        let is_found = self.sought.after(device, act, outputs);
        self.is_other = self.other.after(device, act, outputs) && !is_found;
        is_found || self.is_other
    }
}
