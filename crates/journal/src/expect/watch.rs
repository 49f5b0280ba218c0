//! Following an expectation while things happen.

use std::collections::VecDeque;
use std::time::Duration;

use vimc4_device::{Kinds, Names, Time};

use super::check::{self, Mistake};
use super::eye::{Eye, Moment};
use super::failed::{Failed, Why};
use super::failure::{Failure, Unmet};
use super::{Clause, Expectation, Stage, Then};
use crate::{Entry, Journal, Picture, What};

/// An expectation that is followed, entry by entry. Between two entries it looks only at the instants at
/// which something about it can change: those are computed from the motion that is under way.
#[derive(Clone, Debug)]
pub struct Watch {
    expected: Expectation,
    /// The number of the last entry before it began.
    before: u64,
    now: Time,
    course: Course,
    /// The kinds of events that can make a difference.
    kinds: Kinds,
    /// Whether the passing of time can make one too.
    timed: bool,
    /// When it has to be checked next, if nothing happens before.
    next: Option<Time>,
    failed: Option<Failed>,
}

/// The progress of an expectation.
#[derive(Clone, Debug)]
enum Course {
    Order {
        /// How far each clause of each stage has come.
        stages: Vec<Vec<Progress>>,
        /// Which stage it is.
        stage: usize,
        /// When the last one that had to be completed was.
        since: Time,
    },
    Held {
        whenever: Eye,
        state: Eye,
        met: u64,
    },
    Follows {
        whenever: Eye,
        what: Eye,
        /// Since when it has not followed.
        pending: VecDeque<Time>,
        met: u64,
    },
}

/// How far a clause has come.
#[derive(Clone, Debug)]
struct Progress {
    eye: Eye,
    /// Whether it is met in the moment that was looked at last.
    seen: bool,
    /// How often it has been met.
    count: u64,
}

impl Course {
    fn of(expected: &Expectation, began: Time) -> Course {
        let rule = match expected {
            Expectation::Order(stages) => {
                let progress = |clause: &Clause| Progress {
                    eye: Eye::of(&clause.what),
                    seen: false,
                    count: 0,
                };
                let stages = stages.iter().map(|s| s.clauses.iter().map(progress).collect());
                return Course::Order { stages: stages.collect(), stage: 0, since: began };
            }
            Expectation::Rule(rule) => rule,
        };
        let whenever = Eye::of(&rule.whenever);
        match &rule.then {
            Then::Held { state, .. } => {
                Course::Held { whenever, state: Eye::of_state(state), met: 0 }
            }
            Then::Follows { what, .. } => {
                let what = Eye::of(what);
                Course::Follows { whenever, what, pending: VecDeque::new(), met: 0 }
            }
        }
    }

    /// Does something with every eye.
    fn each(&self, mut of: impl FnMut(&Eye)) {
        match self {
            Course::Order { stages, .. } => {
                stages.iter().flatten().for_each(|progress| of(&progress.eye));
            }
            Course::Held { whenever, state: other, .. }
            | Course::Follows { whenever, what: other, .. } => {
                of(whenever);
                of(other);
            }
        }
    }
}

impl Watch {
    /// Follows an expectation from how things stand, behind the entry of this number.
    ///
    /// # Errors
    ///
    /// If it could never be met.
    pub fn new(
        expected: Expectation,
        names: &Names,
        start: &Picture,
        before: u64,
    ) -> Result<Watch, Mistake> {
        check::expectation(&expected, names, start)?;
        let course = Course::of(&expected, start.at());
        let mut kinds = Kinds::NONE;
        let mut timed = has_deadlines(&expected);
        course.each(|eye| {
            kinds = Kinds::and(kinds, eye.kinds());
            timed |= eye.is_timed();
        });
        let now = start.at();
        let mut watch =
            Watch { expected, before, now, course, kinds, timed, next: None, failed: None };
        // What holds at the beginning becomes true then.
        watch.look(start, None);
        watch.next = watch.next_look(start);
        Ok(watch)
    }

    /// What is expected.
    #[must_use]
    pub fn expected(&self) -> &Expectation {
        &self.expected
    }

    /// The number of the last entry before it began.
    #[must_use]
    pub fn before(&self) -> u64 {
        self.before
    }

    /// Whether it is clear already that it is not met.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed.is_some()
    }

    /// Whether it would be met if nothing more happened.
    #[must_use]
    pub fn is_met(&self) -> bool {
        self.clone().finish(self.now).is_none()
    }

    /// When it has to be checked next, if nothing happens before.
    #[must_use]
    pub fn due(&self) -> Option<Time> {
        self.next
    }

    /// Time has passed up to then, and motions have gone on.
    pub fn pass(&mut self, picture: &Picture, to: Time) {
        while let Some(next) = self.next.filter(|next| *next <= to && self.failed.is_none()) {
            self.now = next;
            if self.deadline().is_some_and(|deadline| deadline < next) {
                self.miss();
            } else {
                self.look(picture, None);
            }
            self.next = self.next_look(picture);
        }
    }

    /// Something has happened, which is in the picture already. Says whether it was something that can
    /// make a difference.
    pub fn see(&mut self, picture: &Picture, entry: &Entry) -> bool {
        let matters = match &entry.what {
            What::Event(event) => self.kinds.contain(event.kind()),
            deed => Picture::is_set_anew_by(deed),
        };
        if self.failed.is_some() || !matters {
            return false;
        }
        self.now = entry.at;
        self.look(picture, Some(entry));
        self.next = self.next_look(picture);
        true
    }

    /// It is over, at this time: why it is not met, if it is not.
    pub(super) fn finish(mut self, at: Time) -> Option<Failed> {
        self.now = self.now.max(at);
        if self.failed.is_none() {
            self.end();
        }
        self.failed
    }

    /// Why it is not met, if that is already clear. The journal must be the one that was followed.
    #[must_use]
    pub fn failure(&self, journal: &Journal, names: &Names) -> Option<Box<Failure>> {
        let failed = self.failed.as_ref()?;
        Some(Box::new(Failure::of(&self.expected, failed, self.before, journal, names)))
    }

    /// It is over: why it is not met, if it is not. Time has been passed up to then before.
    #[must_use]
    pub fn outcome(&self, at: Time, journal: &Journal, names: &Names) -> Option<Box<Failure>> {
        let failed = self.clone().finish(at)?;
        Some(Box::new(Failure::of(&self.expected, &failed, self.before, journal, names)))
    }

    // --- progress ---

    fn fail(&mut self, entry: Option<&Entry>, why: Why) {
        let failed = Failed { at: self.now, entry: entry.map(|entry| entry.number), why };
        self.failed.get_or_insert(failed);
    }

    /// Looks at a moment.
    fn look(&mut self, picture: &Picture, entry: Option<&Entry>) {
        let now = self.now;
        let moment = Moment { picture, now, entry };
        match (&mut self.course, &self.expected) {
            (Course::Order { stages, stage, since }, Expectation::Order(expected)) => {
                for Progress { eye, seen, .. } in stages.iter_mut().flatten() {
                    *seen = eye.look(&moment);
                }
                if let Some(why) = order(expected, stages, stage, since, now) {
                    self.fail(entry, why);
                }
            }
            (Course::Held { whenever, state, met }, Expectation::Rule(rule)) => {
                state.look(&moment);
                let span = match &rule.then {
                    Then::Held { span, .. } => *span,
                    Then::Follows { .. } => Duration::ZERO,
                };
                if whenever.look(&moment) {
                    *met += 1;
                    let since = state.since();
                    if since.is_none_or(|since| now - since < span) {
                        self.fail(entry, Why::NotHeld { since });
                    }
                }
            }
            (Course::Follows { whenever, what, pending, met }, Expectation::Rule(_)) => {
                if whenever.look(&moment) {
                    *met += 1;
                    pending.push_back(now);
                }
                if what.look(&moment) {
                    pending.clear();
                }
            }
            _ => {}
        }
    }

    /// By when something has to have come.
    fn deadline(&self) -> Option<Time> {
        match (&self.course, &self.expected) {
            (Course::Order { stages, stage, since }, Expectation::Order(expected)) => {
                let needed = needed(expected, stages, *stage)?;
                Some(*since + expected.get(needed)?.within?)
            }
            (Course::Follows { pending, .. }, Expectation::Rule(rule)) => match rule.then {
                Then::Follows { within, .. } => Some(*pending.front()? + within),
                Then::Held { .. } => None,
            },
            _ => None,
        }
    }

    /// The deadline is over.
    fn miss(&mut self) {
        let why = match (&self.course, &self.expected) {
            (Course::Order { stages, stage, .. }, Expectation::Order(expected)) => {
                missing(expected, stages, *stage).map(|(stage, clause, came)| Why::TooLate {
                    stage,
                    clause,
                    came,
                })
            }
            (Course::Follows { pending, .. }, _) => {
                pending.front().map(|began| Why::NotFollowed { began: *began, over: false })
            }
            _ => None,
        };
        if let Some(why) = why {
            self.fail(None, why);
        }
    }

    /// Nothing more will happen.
    fn end(&mut self) {
        let why = match (&self.course, &self.expected) {
            (Course::Order { stages, stage, .. }, Expectation::Order(expected)) => {
                missing(expected, stages, *stage).map(|(stage, clause, came)| Why::Missing {
                    stage,
                    clause,
                    came,
                })
            }
            (Course::Held { met, .. } | Course::Follows { met, .. }, Expectation::Rule(rule))
                if *met == 0 && !rule.if_at_all =>
            {
                Some(Why::NeverCame)
            }
            (Course::Follows { pending, .. }, _) => {
                pending.front().map(|began| Why::NotFollowed { began: *began, over: true })
            }
            _ => None,
        };
        if let Some(why) = why {
            self.fail(None, why);
        }
    }

    fn next_look(&self, picture: &Picture) -> Option<Time> {
        if self.failed.is_some() || !self.timed {
            return None;
        }
        let now = self.now;
        let mut next: Option<Time> = None;
        self.course.each(|eye| next = [next, eye.next(picture, now)].into_iter().flatten().min());
        // An event exactly at the deadline is in time.
        let late = self.deadline().map(|deadline| deadline.after_nanos(1));
        next.into_iter().chain(late).min().filter(|at| *at != Time::NEVER)
    }
}

fn has_deadlines(expected: &Expectation) -> bool {
    match expected {
        Expectation::Order(stages) => stages.iter().any(|stage| stage.within.is_some()),
        Expectation::Rule(rule) => matches!(rule.then, Then::Follows { .. }),
    }
}

/// An event that several stages expect counts for the latest stage that can be reached.
fn order(
    expected: &[Stage],
    stages: &mut [Vec<Progress>],
    stage: &mut usize,
    since: &mut Time,
    now: Time,
) -> Option<Why> {
    let is_seen = |of: &Vec<Progress>| of.iter().any(|progress| progress.seen);
    if !stages.iter().any(is_seen) {
        return None;
    }
    let last = window(expected, stages, *stage);
    let chosen = (*stage..=last).rev().find(|of| stages.get(*of).is_some_and(is_seen))?;
    let (Some(expected), Some(clauses)) = (expected.get(chosen), stages.get_mut(chosen)) else {
        return None;
    };
    *stage = chosen;
    let was_complete = is_complete(expected, clauses);
    let seen = expected.clauses.iter().zip(clauses.iter_mut()).enumerate();
    for (place, (clause, progress)) in seen.filter(|(_, (_, progress))| progress.seen) {
        progress.count += 1;
        let (waited, came) = (now - *since, progress.count);
        if expected.after.is_some_and(|after| waited < after) {
            return Some(Why::TooEarly { stage: chosen, clause: place, waited });
        }
        if clause.most.is_some_and(|most| came > most) {
            return Some(Why::TooOften { stage: chosen, clause: place, came });
        }
    }
    if !was_complete && is_complete(expected, clauses) {
        *since = now;
    }
    None
}

/// The last stage that can be reached: beyond the present one if that is complete, and beyond
/// stages that require nothing.
fn window(expected: &[Stage], stages: &[Vec<Progress>], stage: usize) -> usize {
    needed(expected, stages, stage).unwrap_or(expected.len().saturating_sub(1))
}

/// The first stage, from this one on, that still requires something.
fn needed(expected: &[Stage], stages: &[Vec<Progress>], stage: usize) -> Option<usize> {
    let mut open = expected.iter().zip(stages).enumerate().skip(stage);
    open.find(|(_, (stage, clauses))| !is_complete(stage, clauses)).map(|(place, _)| place)
}

fn is_complete(stage: &Stage, clauses: &[Progress]) -> bool {
    stage.clauses.iter().zip(clauses).all(|(clause, progress)| clause.is_complete(progress.count))
}

/// The first clause that is still needed, and how often it has come.
fn missing(
    expected: &[Stage],
    stages: &[Vec<Progress>],
    stage: usize,
) -> Option<(usize, usize, u64)> {
    let stage = needed(expected, stages, stage)?;
    let mut clauses = expected.get(stage)?.clauses.iter().zip(stages.get(stage)?).enumerate();
    let (place, (_, progress)) =
        clauses.find(|(_, (clause, progress))| !clause.is_complete(progress.count))?;
    Some((stage, place, progress.count))
}

/// An expectation that is followed over entries by itself, with a picture of its own.
#[derive(Clone, Debug)]
pub struct Trial {
    picture: Picture,
    watch: Watch,
}

impl Trial {
    /// Begins with how things stand, behind the entry of this number.
    ///
    /// # Errors
    ///
    /// If the expectation could never be met.
    pub fn new(
        expected: Expectation,
        names: &Names,
        start: Picture,
        before: u64,
    ) -> Result<Trial, Mistake> {
        let watch = Watch::new(expected, names, &start, before)?;
        Ok(Trial { picture: start, watch })
    }

    /// Time has passed up to then.
    pub fn pass(&mut self, to: Time) {
        self.watch.pass(&self.picture, to);
    }

    /// Something has happened.
    pub fn see(&mut self, entry: &Entry) {
        // After going back to an earlier state it begins anew from there.
        self.watch.pass(&self.picture, entry.at);
        self.picture.apply(entry);
        self.watch.see(&self.picture, entry);
    }

    /// The expectation, and how far it has come.
    #[must_use]
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// Holds an expectation against a journal.
    ///
    /// # Errors
    ///
    /// If it is not met, or could never be.
    pub fn of(expected: Expectation, journal: &Journal, names: &Names) -> Result<(), Unmet> {
        let before = journal.entries().next().map_or(journal.last(), |first| first.number - 1);
        let mut trial = Trial::new(expected, names, journal.start().clone(), before)?;
        for entry in journal.entries() {
            trial.see(entry);
        }
        trial.pass(journal.until());
        let at = journal.until();
        if let Some(failure) = trial.watch.outcome(at, journal, names) {
            return Err(failure.into());
        }
        // A dropped entry could have been anything.
        if journal.dropped() > 0 {
            let why = Why::Forgotten { dropped: journal.dropped() };
            let failed = Failed { at, entry: None, why };
            let expected = &trial.watch.expected;
            return Err(Box::new(Failure::of(expected, &failed, before, journal, names)).into());
        }
        Ok(())
    }
}
