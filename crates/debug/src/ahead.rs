//! Going forward beside a host that may have something to do before what is sought comes.

use std::collections::VecDeque;
use std::time::Duration;

use vimc4_device::{Condition, Output, Time};
use vimc4_timeline::{Act, Begins, Found, History, Progress, Sought, Stretch, Which};

use crate::recurrence::Recurrence;
use crate::{Feed, Wired};

/// How a search forward has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SearchEnd {
    /// As a search of the history ends.
    Found(Found),
    /// The host has its turn before that.
    HostTurn,
    /// The controller repeats itself, each time in this span, and the search never ends.
    Repeats(Duration),
}

/// Goes forward to what is sought, as [`History::seek_next`] does. The host has its turn before that at the end
/// of what is known, or where what it [looks for](Feed::looks_for) comes. `is_timeless`: what is sought depends
/// on the state of the controller and on events, but not on the time or on how often something has happened.
pub(crate) fn seek_next(
    history: &mut History<Wired>,
    feed: Option<&Feed>,
    until: Time,
    sought: &mut impl Sought<Wired>,
    is_timeless: bool,
    progress: &mut Progress<'_>,
) -> SearchEnd {
    let end = end_of(history);
    if feed.is_some() && !history.is_at_end() && end < until {
        let found = history.seek_next(end, sought, progress);
        if found == Found::Nowhere {
            history.run_to(end);
            return SearchEnd::HostTurn;
        }
        return SearchEnd::Found(found);
    }
    let looked_for = feed.and_then(|feed| feed.looks_for(history));
    if until < Time::NEVER || !is_timeless {
        return seek_or(history, looked_for.as_ref(), until, sought, progress);
    }
    let mut endless = Recurrence::new(sought, end);
    match seek_or(history, looked_for.as_ref(), until, &mut endless, progress) {
        ahead @ SearchEnd::Found(Found::Here) => endless.span().map_or(ahead, SearchEnd::Repeats),
        ahead => ahead,
    }
}

/// Goes forward to what is sought. The host has its turn where a condition begins to hold before that.
fn seek_or(
    history: &mut History<Wired>,
    condition: Option<&Condition>,
    until: Time,
    sought: &mut impl Sought<Wired>,
    progress: &mut Progress<'_>,
) -> SearchEnd {
    let Some(condition) = condition else {
        return SearchEnd::Found(history.seek_next(until, sought, progress));
    };
    let other = Begins::new(condition);
    let mut either = Either { sought, other, is_other: false, looked_until: None };
    match history.seek_next(until, &mut either, progress) {
        Found::Here if either.is_other => SearchEnd::HostTurn,
        found => SearchEnd::Found(found),
    }
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
