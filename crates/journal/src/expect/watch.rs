//! Whether what happens is what was expected.

use std::collections::VecDeque;
use std::time::Duration;

use vimc4_device::{CommandNumber, Condition, Event, Names, Time};

use super::check::{self, Mistake};
use super::failed::{Failed, Why};
use super::failure::{Failure, Unmet};
use super::{Clause, Expectation, Pattern, Reply, Stage, Then};
use crate::{Entry, Journal, Picture};

/// An expectation that is followed, entry by entry. Between two entries it looks only at the instants at
/// which something about it can change: those are computed from the motion that is under way.
#[derive(Clone, Debug)]
pub struct Watch {
    expected: Expectation,
    /// The number of the last entry before it began.
    before: u64,
    now: Time,
    course: Course,
    /// When it has to be looked at next, if nothing happens before.
    next: Option<Time>,
    failed: Option<Failed>,
}

/// How far an expectation has come.
#[derive(Clone, Debug)]
enum Course {
    Order {
        /// An eye for each clause.
        eyes: Vec<Vec<Eye>>,
        /// How often each has been met.
        counts: Vec<Vec<u64>>,
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
        let course = match &expected {
            Expectation::Order(stages) => {
                let eye = |clause: &Clause| Eye::of(&clause.what);
                Course::Order {
                    eyes: stages.iter().map(|s| s.clauses.iter().map(eye).collect()).collect(),
                    counts: stages.iter().map(|stage| vec![0; stage.clauses.len()]).collect(),
                    stage: 0,
                    since: start.at(),
                }
            }
            Expectation::Rule(rule) => {
                let whenever = Eye::of(&rule.whenever);
                match &rule.then {
                    Then::Held { state, .. } => {
                        Course::Held { whenever, state: Eye::of_state(state), met: 0 }
                    }
                    Then::Follows { what, .. } => Course::Follows {
                        whenever,
                        what: Eye::of(what),
                        pending: VecDeque::new(),
                        met: 0,
                    },
                }
            }
        };
        let now = start.at();
        let mut watch = Watch { expected, before, now, course, next: None, failed: None };
        // What is so at the beginning becomes so then.
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

    /// When it has to be looked at next, if nothing happens before.
    #[must_use]
    pub fn due(&self) -> Option<Time> {
        self.next
    }

    /// Time has passed up to then, and what was under way has gone on.
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

    /// Something has happened, which is in the picture already.
    pub fn see(&mut self, picture: &Picture, entry: &Entry) {
        if self.failed.is_some() {
            return;
        }
        self.now = entry.at;
        self.look(picture, Some(entry));
        self.next = self.next_look(picture);
    }

    /// It is over, at this time: why it is not met, if it is not.
    pub(super) fn finish(mut self, at: Time) -> Option<Failed> {
        self.now = self.now.max(at);
        if self.failed.is_none() {
            self.end();
        }
        self.failed
    }

    /// Why it is not met, if that is clear already. The journal is that in which it was followed.
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

    // --- how it goes on ---

    fn fail(&mut self, entry: Option<&Entry>, why: Why) {
        let failed = Failed { at: self.now, entry: entry.map(|entry| entry.number), why };
        self.failed.get_or_insert(failed);
    }

    /// Looks at a moment.
    fn look(&mut self, picture: &Picture, entry: Option<&Entry>) {
        let now = self.now;
        let mut moment = Moment { picture, now, entry };
        match (&mut self.course, &self.expected) {
            (Course::Order { eyes, counts, stage, since }, Expectation::Order(stages)) => {
                let seen: Vec<Vec<bool>> = eyes
                    .iter_mut()
                    .map(|eyes| eyes.iter_mut().map(|eye| eye.look(&mut moment)).collect())
                    .collect();
                let why = order(stages, &seen, counts, stage, since, now);
                if let Some(why) = why {
                    self.fail(entry, why);
                }
            }
            (Course::Held { whenever, state, met }, Expectation::Rule(rule)) => {
                state.look(&mut moment);
                let span = match &rule.then {
                    Then::Held { span, .. } => *span,
                    Then::Follows { .. } => Duration::ZERO,
                };
                if whenever.look(&mut moment) {
                    *met += 1;
                    let since = state.since();
                    if since.is_none_or(|since| now - since < span) {
                        self.fail(entry, Why::NotHeld { since });
                    }
                }
            }
            (Course::Follows { whenever, what, pending, met }, Expectation::Rule(_)) => {
                if whenever.look(&mut moment) {
                    *met += 1;
                    pending.push_back(now);
                }
                if what.look(&mut moment) {
                    pending.clear();
                }
            }
            _ => {}
        }
    }

    /// By when something has to have come.
    fn deadline(&self) -> Option<Time> {
        match (&self.course, &self.expected) {
            (Course::Order { counts, stage, since, .. }, Expectation::Order(stages)) => {
                let needed = needed(stages, counts, *stage)?;
                Some(*since + stages.get(needed)?.within?)
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
            (Course::Order { counts, stage, .. }, Expectation::Order(stages)) => {
                missing(stages, counts, *stage).map(|(stage, clause, came)| Why::TooLate {
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
            (Course::Order { counts, stage, .. }, Expectation::Order(stages)) => {
                missing(stages, counts, *stage).map(|(stage, clause, came)| Why::Missing {
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
        if self.failed.is_some() {
            return None;
        }
        let now = self.now;
        let next = |eye: &Eye| eye.next(picture, now);
        let changes = match &self.course {
            Course::Order { eyes, .. } => eyes.iter().flatten().filter_map(next).min(),
            Course::Held { whenever, state, .. } => {
                [next(whenever), next(state)].into_iter().flatten().min()
            }
            Course::Follows { whenever, what, .. } => {
                [next(whenever), next(what)].into_iter().flatten().min()
            }
        };
        // What comes just at the deadline is in time.
        let late = self.deadline().map(|deadline| deadline.after_nanos(1));
        changes.into_iter().chain(late).min().filter(|at| *at != Time::NEVER)
    }
}

/// What of several stages is met in a moment counts for the latest that it can be the turn of.
fn order(
    stages: &[Stage],
    seen: &[Vec<bool>],
    counts: &mut [Vec<u64>],
    stage: &mut usize,
    since: &mut Time,
    now: Time,
) -> Option<Why> {
    let last = window(stages, counts, *stage);
    let is_seen = |of: usize| seen.get(of).is_some_and(|seen| seen.contains(&true));
    let chosen = (*stage..=last).rev().find(|of| is_seen(*of))?;
    let (Some(expected), Some(seen), Some(counts)) =
        (stages.get(chosen), seen.get(chosen), counts.get_mut(chosen))
    else {
        return None;
    };
    *stage = chosen;
    let was_complete = is_complete(expected, counts);
    let clauses = expected.clauses.iter().zip(seen).zip(counts.iter_mut()).enumerate();
    for (place, ((clause, _), count)) in clauses.filter(|(_, ((_, seen), _))| **seen) {
        *count += 1;
        let waited = now - *since;
        if expected.after.is_some_and(|after| waited < after) {
            return Some(Why::TooEarly { stage: chosen, clause: place, waited });
        }
        if clause.most.is_some_and(|most| *count > most) {
            return Some(Why::TooOften { stage: chosen, clause: place, came: *count });
        }
    }
    if !was_complete && is_complete(expected, counts) {
        *since = now;
    }
    None
}

/// The last stage that it can be the turn of: behind the present one if that is complete, and behind
/// those of which nothing is needed.
fn window(stages: &[Stage], counts: &[Vec<u64>], stage: usize) -> usize {
    needed(stages, counts, stage).unwrap_or(stages.len().saturating_sub(1))
}

/// The first stage, from this one on, of which something is still needed.
fn needed(stages: &[Stage], counts: &[Vec<u64>], stage: usize) -> Option<usize> {
    let mut open = stages.iter().zip(counts).enumerate().skip(stage);
    open.find(|(_, (stage, counts))| !is_complete(stage, counts)).map(|(place, _)| place)
}

fn is_complete(stage: &Stage, counts: &[u64]) -> bool {
    stage.clauses.iter().zip(counts).all(|(clause, count)| clause.is_complete(*count))
}

/// The first clause that is still needed, and how often it has come.
fn missing(stages: &[Stage], counts: &[Vec<u64>], stage: usize) -> Option<(usize, usize, u64)> {
    let stage = needed(stages, counts, stage)?;
    let mut clauses = stages.get(stage)?.clauses.iter().zip(counts.get(stage)?).enumerate();
    let (clause, (_, came)) = clauses.find(|(_, (clause, count))| !clause.is_complete(**count))?;
    Some((stage, clause, *came))
}

/// A moment: right after an entry, or at an instant between two.
struct Moment<'a> {
    picture: &'a Picture,
    now: Time,
    entry: Option<&'a Entry>,
}

impl Moment<'_> {
    /// Whether a condition holds.
    fn holds(&self, condition: &Condition) -> bool {
        let event = self.entry.and_then(Entry::event);
        self.picture.holds(condition, self.now, event)
    }

    /// Whether it holds without what happens.
    fn lasts(&self, condition: &Condition) -> bool {
        self.picture.holds(condition, self.now, None)
    }
}

/// Sees when something comes.
#[derive(Clone, Debug)]
enum Eye {
    /// A condition becomes true, each of its parts by itself.
    When(Vec<Part>),
    /// A command begins, or is answered.
    Command {
        command: Condition,
        reply: Option<Reply>,
        within: Option<Duration>,
        /// Those that have not been answered as they should.
        open: VecDeque<(CommandNumber, Time)>,
    },
}

/// A condition, and since when it is so.
#[derive(Clone, Debug)]
struct Part {
    condition: Condition,
    since: Option<Time>,
}

/// More commands are hardly under way at a time.
const OPEN: usize = 256;

impl Eye {
    fn of(pattern: &Pattern) -> Eye {
        match pattern {
            Pattern::When(Condition::Any(parts)) => {
                Eye::When(parts.iter().map(Part::new).collect())
            }
            Pattern::When(one) => Eye::of_state(one),
            Pattern::Command { like, reply, within } => Eye::Command {
                command: Condition::Command { like: Some(like.clone()) },
                reply: reply.clone(),
                within: *within,
                open: VecDeque::new(),
            },
        }
    }

    /// One that sees a condition as a whole.
    fn of_state(condition: &Condition) -> Eye {
        Eye::When(vec![Part::new(condition)])
    }

    /// Since when the first of its parts is so that is.
    fn since(&self) -> Option<Time> {
        match self {
            Eye::When(parts) => parts.iter().filter_map(|part| part.since).min(),
            Eye::Command { .. } => None,
        }
    }

    /// Whether it comes in a moment.
    fn look(&mut self, moment: &mut Moment<'_>) -> bool {
        match self {
            Eye::When(parts) => {
                let mut comes = false;
                for Part { condition, since } in parts {
                    let is_so = moment.holds(condition);
                    comes |= is_so && since.is_none();
                    // What only happens is over with its moment.
                    let lasts = is_so && moment.lasts(condition);
                    *since = lasts.then_some(since.unwrap_or(moment.now));
                }
                comes
            }
            Eye::Command { command, reply, within, open } => {
                let Some(entry) = moment.entry else { return false };
                let (Some(event), at) = (entry.event(), entry.at) else { return false };
                match event {
                    Event::Command { .. } if command.is_seen_in(event) => {
                        if reply.is_some()
                            && let Some(number) = entry.command
                        {
                            if open.len() == OPEN {
                                open.pop_front();
                            }
                            open.push_back((number, at));
                        }
                        reply.is_none()
                    }
                    Event::Answer { .. } => {
                        let Some(reply) = reply else { return false };
                        let own =
                            |(number, _): &(CommandNumber, Time)| Some(*number) == entry.command;
                        let Some(place) = open.iter().position(own) else { return false };
                        let in_time = |(_, began): &(CommandNumber, Time)| {
                            within.is_none_or(|within| at - *began <= within)
                        };
                        let comes = reply.is(event) && open.get(place).is_some_and(in_time);
                        if comes {
                            open.remove(place);
                        }
                        comes
                    }
                    _ => false,
                }
            }
        }
    }

    /// When it has to be looked at next because of what is under way.
    fn next(&self, picture: &Picture, now: Time) -> Option<Time> {
        let Eye::When(parts) = self else { return None };
        let span = picture.from(now);
        let next = |Part { condition, since }: &Part| {
            if picture.running().is_none() && !names_a_time(condition) {
                return None;
            }
            let next = match since {
                Some(_) => condition.ends(&span, now),
                None => condition.begins(&span, now),
            };
            next.filter(|at| *at > now)
        };
        parts.iter().filter_map(next).min()
    }
}

impl Part {
    fn new(condition: &Condition) -> Part {
        Part { condition: condition.clone(), since: None }
    }
}

fn names_a_time(condition: &Condition) -> bool {
    match condition {
        Condition::At(_) => true,
        Condition::All(parts) | Condition::Any(parts) => parts.iter().any(names_a_time),
        _ => false,
    }
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
        // Who goes back to an earlier state begins anew from there.
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
        // What is not there any more could have been anything.
        if journal.dropped() > 0 {
            let why = Why::Forgotten { dropped: journal.dropped() };
            let failed = Failed { at, entry: None, why };
            let expected = &trial.watch.expected;
            return Err(Box::new(Failure::of(expected, &failed, before, journal, names)).into());
        }
        Ok(())
    }
}
