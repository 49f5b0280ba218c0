//! Walking through the history.

use std::collections::{BTreeMap, VecDeque};

use vimc4_catalogue::Controller;
use vimc4_device::{CommandNumber, Condition, Event, Kinds, Output, Time};
use vimc4_timeline::{Act, Begins, BranchId, Found, History, Place, Progress, Sought, Stretch};

use crate::breakpoint::{Breakpoint, BreakpointId, Hits, Trigger};
use crate::debugger::Debugger;
use crate::stop::{Reason, Stop};
use crate::walk::{PROBLEMS_MAX, Problems, Telling, Walk, is_in_program, loops};
use crate::{DebugError, Depth, Unit, Way};

impl Debugger {
    /// Makes a number of steps. With [`Depth::Over`] and [`Depth::Out`] it stops at breakpoints on
    /// the way.
    pub fn step(
        &mut self,
        unit: Unit,
        way: Way,
        depth: Depth,
        count: u64,
        progress: &mut Progress<'_>,
    ) -> Stop {
        self.unit = unit;
        if let Unit::Time(span) = unit {
            let nanos = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
            return self.pass(way, nanos.saturating_mul(count), unit, progress);
        }
        if depth == Depth::Out && !is_in_program(self.device()) {
            // Out of a list of commands is where it ends, or begins.
            return self.go(way, None, progress);
        }
        self.find_by_hand();
        let (mut notes, mut made) = (Vec::new(), 0);
        let mut problems = VecDeque::new();
        let heeds = depth != Depth::Into;
        let from = self.place();
        let mut passed = BTreeMap::new();
        let mut open = loops(self.device()).len();
        while made < count {
            self.host_goes_on(way);
            if heeds && way == Way::Forward && !self.count_hits(Breakpoint::is_limited, progress) {
                return self.stopped_after(Reason::Cancelled, notes, problems);
            }
            let begin = self.place();
            let end = self.end_of_way();
            let history = &mut self.history;
            let source = self.source.as_ref();
            let mut walk = Walk::new(way).step(unit, depth, open, source).telling();
            if heeds {
                walk = walk.heeding(&mut self.breakpoints, source);
            }
            let asked = self.feed.as_ref().filter(|_| way == Way::Forward);
            let asked = asked.and_then(|feed| feed.asked_ahead(history));
            let limit = asked.map_or(end, |place| place.moment.at.min(end));
            let found = match way {
                Way::Forward => history.seek_next(limit, &mut walk, progress),
                Way::Back => history.seek_last(&mut walk, progress),
            };
            let is_beyond = is_beyond(history, asked);
            let mut met = ids(&walk, history.now());
            let is_step = walk.is_step || met.is_empty();
            notes.append(&mut walk.notes);
            let went_wrong = walk.problems.take().unwrap_or_default().last;
            let has_counted = heeds && way == Way::Forward;
            if has_counted {
                // Where a step pulse ends the step, hits after it may have been counted.
                self.has_counted(begin, unit != Unit::Step);
            }
            if way == Way::Back && !met.is_empty() && found == Found::Here {
                if !self.counted_back(&mut met, &mut passed, progress) {
                    self.history.go_back_to(from);
                    return self.stopped_after(Reason::Cancelled, notes, problems);
                }
                if met.is_empty() && !is_step {
                    continue;
                }
            }
            self.host_hears(&went_wrong);
            problems.extend(went_wrong);
            problems.drain(..problems.len().saturating_sub(PROBLEMS_MAX));
            let why = match found {
                Found::Here if is_beyond => self.asks_again(asked),
                Found::Here if met.is_empty() => {
                    made += 1;
                    open = loops(self.device()).len();
                    continue;
                }
                Found::Here => Reason::Breakpoints(met),
                Found::GivenUp => Reason::Cancelled,
                Found::Nowhere if asked.is_some() => self.asks_again(asked),
                Found::Nowhere if way == Way::Back => Reason::Beginning,
                Found::Nowhere => match self.goes_on(end, progress) {
                    Ok(true) => continue,
                    Ok(false) => self.nothing_more(end),
                    Err(why) => why,
                },
            };
            return self.stopped_after(why, notes, problems);
        }
        self.stopped_after(Reason::Step(unit), notes, problems)
    }

    /// Goes on, forward or back, to the next breakpoint. Going forward ends at the given time at
    /// the latest, or where the controller waits for something from outside and the host does
    /// nothing more; going back ends at the beginning.
    pub fn go(&mut self, way: Way, until: Option<Time>, progress: &mut Progress<'_>) -> Stop {
        self.find_by_hand();
        let mut notes = Vec::new();
        let mut problems = VecDeque::new();
        let from = self.place();
        let mut passed = BTreeMap::new();
        loop {
            self.host_goes_on(way);
            if way == Way::Forward && !self.count_hits(Breakpoint::is_limited, progress) {
                return self.stopped_after(Reason::Cancelled, notes, problems);
            }
            let begin = self.place();
            // A host that fills a buffer looks for room whenever a command leaves it.
            let feed = self.feed.as_ref().filter(|_| way == Way::Forward);
            let fills = feed.is_some_and(|feed| feed.streams(&self.history));
            if fills {
                self.breakpoints.push(leaves_the_buffer());
            }
            let known = self.end_of_way();
            let end = until.unwrap_or(Time::NEVER).min(known);
            let history = &mut self.history;
            let source = self.source.as_ref();
            let mut walk = Walk::new(way).heeding(&mut self.breakpoints, source).telling();
            let asked = self.feed.as_ref().filter(|_| way == Way::Forward);
            let asked = asked.and_then(|feed| feed.asked_ahead(history));
            let asked = asked.filter(|place| place.moment.at <= end);
            let limit = asked.map_or(end, |place| place.moment.at);
            let found = match way {
                Way::Forward => history.seek_next(limit, &mut walk, progress),
                Way::Back => history.seek_last(&mut walk, progress),
            };
            let is_beyond = is_beyond(history, asked);
            let mut met = ids(&walk, history.now());
            notes.append(&mut walk.notes);
            let went_wrong = walk.problems.take().unwrap_or_default().last;
            if way == Way::Forward {
                self.has_counted(begin, true);
            }
            self.host_hears(&went_wrong);
            problems.extend(went_wrong);
            if way == Way::Back && found == Found::Here {
                if !self.counted_back(&mut met, &mut passed, progress) {
                    self.history.go_back_to(from);
                    return self.stopped_after(Reason::Cancelled, notes, problems);
                }
                if met.is_empty() {
                    continue;
                }
            }
            if fills {
                self.breakpoints.pop();
                met.retain(|id| *id != NOBODYS);
                if found == Found::Here && met.is_empty() {
                    continue;
                }
            }
            let why = match found {
                Found::Here if is_beyond => self.asks_again(asked),
                Found::Here => Reason::Breakpoints(met),
                Found::GivenUp => Reason::Cancelled,
                Found::Nowhere if way == Way::Back => {
                    let beginning = self.beginning();
                    self.history.go_back_to(beginning);
                    Reason::Beginning
                }
                Found::Nowhere if asked.is_some() => self.asks_again(asked),
                Found::Nowhere => match (self.goes_on(end, progress), until) {
                    (Ok(true), _) => continue,
                    (Err(why), _) => why,
                    (Ok(false), Some(until)) if until <= known => {
                        self.history.run_to(until);
                        Reason::Time
                    }
                    (Ok(false), _) => self.nothing_more(end),
                },
            };
            return self.stopped_after(why, notes, problems);
        }
    }

    /// Goes to the next or the last instant at which a condition begins to hold. Where the history
    /// has none, `Way::Forward` goes on beyond its end. If there is none the present stays.
    pub fn seek(&mut self, condition: &Condition, way: Way, progress: &mut Progress<'_>) -> Stop {
        let mut problems = Problems::default();
        let found = match way {
            Way::Back => Ok(self.history.seek_last(&mut Begins::new(condition), progress)),
            Way::Forward => self.seek_ahead(condition, &mut problems, progress),
        };
        if found != Ok(Found::Here) {
            // The present is where it was.
            problems.last.clear();
        }
        let why = match found {
            Ok(Found::Here) => Reason::Found,
            Ok(Found::Nowhere) => Reason::Nowhere,
            Ok(Found::GivenUp) => Reason::Cancelled,
            Err(why) => why,
        };
        self.stopped_after(why, Vec::new(), problems.last)
    }

    /// First in the history, and then in the future. The future is tried on a copy, so that an
    /// unsuccessful search leaves no trace here.
    fn seek_ahead(
        &mut self,
        condition: &Condition,
        problems: &mut Problems,
        progress: &mut Progress<'_>,
    ) -> Result<Found, Reason> {
        let begin = self.place();
        let mut begins = Telling { sought: Begins::new(condition), problems };
        let mut end = end_of(&self.history);
        let mut found = self.history.seek_next(end, &mut begins, progress);
        while found == Found::Nowhere {
            match self.read_ahead(progress) {
                Ok(true) => {}
                Ok(false) => break,
                Err(why) => {
                    self.history.go_back_to(begin);
                    return Err(why);
                }
            }
            end = end_of(&self.history);
            found = self.history.seek_next(end, &mut begins, progress);
        }
        if found == Found::Nowhere && !self.stays {
            self.history.go_to_time(end);
            while found == Found::Nowhere && {
                self.host_hears(&begins.problems.last);
                self.host_goes_on(Way::Forward)
            } {
                found = self.history.seek_next(Time::NEVER, &mut begins, progress);
            }
            if found != Found::Nowhere {
                return Ok(self.back_unless_here(found, begin));
            }
            let mut future = History::new(self.device().clone());
            future.watch(Kinds::ALL);
            found = future.seek_next(Time::NEVER, &mut Begins::new(condition), progress);
            if found == Found::Here {
                // The same way once more, here.
                begins.sought = Begins::new(condition);
                found = self.history.seek_next(Time::NEVER, &mut begins, progress);
            }
        }
        Ok(self.back_unless_here(found, begin))
    }

    /// If nothing was found the present is where it was.
    fn back_unless_here(&mut self, found: Found, begin: Place) -> Found {
        if found != Found::Here {
            self.history.go_back_to(begin);
        }
        found
    }

    /// Goes to a moment.
    ///
    /// # Errors
    ///
    /// If the history has no such moment.
    pub fn go_to(&mut self, place: Place) -> Result<Stop, DebugError> {
        if !self.history.go_back_to(place) {
            return Err(DebugError::new("there is no such moment in the history"));
        }
        Ok(self.stopped(Reason::Gone, Vec::new()))
    }

    /// Goes to a time, after everything that happens then; beyond the end, as far as the future is
    /// known without anything from outside.
    pub fn go_to_time(&mut self, at: Time, progress: &mut Progress<'_>) -> Stop {
        if self.goes_on_reading()
            && let Err(why) = self.read_until(|own| end_of(&own.history) >= at, progress)
        {
            return self.stopped(why, Vec::new());
        }
        self.history.go_to_time(at);
        if self.now() < at {
            return self.go_plain(at, progress);
        }
        self.stopped(Reason::Gone, Vec::new())
    }

    /// Goes to where the execution of a command begins.
    ///
    /// # Errors
    ///
    /// If it never begins on the way of the present.
    pub fn go_to_command(
        &mut self,
        number: CommandNumber,
        progress: &mut Progress<'_>,
    ) -> Result<Stop, DebugError> {
        if self.goes_on_reading() {
            let is_read = |own: &Debugger| own.last_read().is_some_and(|last| last >= number);
            self.read_until(is_read, progress)?;
        }
        let (begin, heading) = (self.place(), self.history.heading());
        self.history.go_to_end(heading);
        let mut begins = CommandBegins(number);
        let mut found = self.history.seek_last_or_here(&mut begins, progress);
        if found == Found::Nowhere {
            // The host may still have to send it.
            found = self.host_goes_on_to(CommandBegins(number), progress);
        }
        if found == Found::Nowhere && !self.stays {
            // It may be still to come.
            let mut future = History::new(self.device().clone());
            future.watch(Kinds::ALL);
            found = future.seek_next(Time::NEVER, &mut begins, progress);
            if found == Found::Here {
                found = self.history.seek_next(Time::NEVER, &mut begins, progress);
            }
        }
        if found == Found::Here {
            return Ok(self.stopped(Reason::Gone, Vec::new()));
        }
        let waits = self.feed.as_ref().and_then(|feed| feed.waits()).map(str::to_owned);
        self.history.go_back_to(begin);
        Err(DebugError::new(match (found, waits) {
            (Found::GivenUp, _) => "cancelled".to_owned(),
            (_, Some(waits)) => format!("before command {number}, {waits}"),
            _ => format!("no command has the number {number} here"),
        }))
    }

    /// Goes to the end of the way of the present: of a recording, or of what the host does.
    pub(crate) fn go_to_end(&mut self, progress: &mut Progress<'_>) -> Stop {
        if self.goes_on_reading()
            && let Err(why) = self.read_until(|_| false, progress)
        {
            return self.stopped(why, Vec::new());
        }
        let heading = self.history.heading();
        self.history.go_to_end(heading);
        let found = self.host_goes_on_to(Walk::new(Way::Forward), progress);
        let waits = self.feed.as_ref().is_some_and(|feed| feed.waits().is_some());
        let why = match found {
            Found::GivenUp => Reason::Cancelled,
            _ if waits => Reason::Rest,
            _ => Reason::Gone,
        };
        self.stopped(why, Vec::new())
    }

    /// From the end of the way on, lets the host do what it has not done yet, up to where `sought` is.
    fn host_goes_on_to(
        &mut self,
        sought: impl Sought<Controller>,
        progress: &mut Progress<'_>,
    ) -> Found {
        let is_done =
            |own: &Debugger| own.feed.as_ref().is_none_or(|feed| feed.is_done(&own.history));
        if is_done(self) {
            return Found::Nowhere;
        }
        let mut problems = Problems::default();
        let mut telling = Telling { sought, problems: &mut problems };
        loop {
            let found = self.history.seek_next(Time::NEVER, &mut telling, progress);
            self.host_hears(&telling.problems.last);
            telling.problems.last.clear();
            if found != Found::Nowhere || !self.host_goes_on(Way::Forward) {
                return found;
            }
        }
    }

    // --- counting hits ---

    /// Counts how often some of the breakpoints were hit on the way to the present, as far as that
    /// is not known. Says whether it was completed; what was counted by then is kept.
    pub(crate) fn count_hits(
        &mut self,
        which: impl Fn(&Breakpoint) -> bool,
        progress: &mut Progress<'_>,
    ) -> bool {
        let begin = self.place();
        for number in 0..self.breakpoints.len() {
            let own = &self.breakpoints[number];
            if !which(own) || own.counted == Some(begin) {
                continue;
            }
            let known = own.counted.filter(|place| self.is_on_the_way(*place, begin));
            let count = if known.is_some() { own.count } else { 0 };
            let mut counter =
                [Breakpoint { hits: Hits::All, log: None, is_enabled: true, count, ..own.clone() }];
            let from = known.unwrap_or_else(|| self.beginning());
            self.history.go_back_to(from);
            let source = self.source.as_ref();
            let is_counted = loop {
                let before = counter[0].count;
                let mut walk = Walk::new(Way::Forward).heeding(&mut counter, source);
                let found = self.history.seek_next(begin.moment.at, &mut walk, progress);
                // More may happen at the same instant.
                if is_after(self.history.present(), begin) {
                    counter[0].count = before;
                    break true;
                }
                match found {
                    Found::Here => {}
                    Found::Nowhere => break true,
                    Found::GivenUp => break false,
                }
            };
            let own = &mut self.breakpoints[number];
            own.count = counter[0].count;
            own.counted = Some(if is_counted { begin } else { self.history.present() });
            self.history.go_back_to(begin);
            if !is_counted {
                return false;
            }
        }
        true
    }

    /// A walk forward has counted the hits on its way; `are_right`: those up to the present.
    fn has_counted(&mut self, begin: Place, are_right: bool) {
        let here = self.history.present();
        for own in self.breakpoints.iter_mut().filter(|own| own.is_enabled) {
            let is_known = are_right && own.counted == Some(begin);
            own.counted = is_known.then_some(here);
        }
    }

    /// Leaves of the breakpoints that a walk back has come to those of which this hit counts.
    /// `passed` has the numbers of the hits that it has come to before. Says whether it was
    /// completed.
    fn counted_back(
        &mut self,
        met: &mut Vec<BreakpointId>,
        passed: &mut BTreeMap<BreakpointId, u64>,
        progress: &mut Progress<'_>,
    ) -> bool {
        let here = self.place();
        for id in met.clone() {
            let is_it = |own: &Breakpoint| own.id == id && own.is_limited();
            let Some(number) = self.breakpoints.iter().position(is_it) else { continue };
            if let Some(later) = passed.get(&id) {
                let own = &mut self.breakpoints[number];
                (own.count, own.counted) = (later.saturating_sub(1), Some(here));
            } else if !self.count_hits(is_it, progress) {
                return false;
            }
            let own = &self.breakpoints[number];
            passed.insert(id, own.count);
            if !own.hits.allow(own.count) {
                met.retain(|met| *met != id);
            }
        }
        true
    }

    /// Where everything begins.
    fn beginning(&self) -> Place {
        let first = self.history.branches().next().map(|branch| branch.first);
        Place { branch: BranchId(0), moment: first.unwrap_or_default() }
    }

    /// Whether a place is on the way from the beginning to another.
    fn is_on_the_way(&self, place: Place, to: Place) -> bool {
        let branches: Vec<_> = self.history.branches().collect();
        let mut way = Some(to);
        while let Some(last) = way {
            if last.branch == place.branch {
                return place.moment <= last.moment;
            }
            let branch = branches.iter().find(|branch| branch.id == last.branch);
            way = branch.and_then(|branch| branch.parted);
        }
        false
    }

    // --- inside ---

    /// Goes on to a time, ignoring breakpoints.
    fn go_plain(&mut self, at: Time, progress: &mut Progress<'_>) -> Stop {
        let mut nothing = Walk::new(Way::Forward).telling();
        if self.goes_on_reading()
            && let Err(why) = self.read_until(|own| end_of(&own.history) >= at, progress)
        {
            return self.stopped(why, Vec::new());
        }
        let end = at.min(self.end_of_way());
        loop {
            self.host_goes_on(Way::Forward);
            if self.history.seek_next(end, &mut nothing, progress) == Found::GivenUp {
                return self.stopped(Reason::Cancelled, Vec::new());
            }
            let went_wrong = nothing.problems.replace(Problems::default()).unwrap_or_default();
            self.host_hears(&went_wrong.last);
            if !self.host_goes_on(Way::Forward) {
                break;
            }
        }
        self.history.run_to(end);
        let why = if end < at { Reason::End } else { Reason::Gone };
        self.stopped(why, Vec::new())
    }

    /// Goes by a span of time.
    fn pass(&mut self, way: Way, nanos: u64, unit: Unit, progress: &mut Progress<'_>) -> Stop {
        let now = self.now();
        let why = match way {
            Way::Forward => return self.go_by(now.after_nanos(nanos), unit, progress),
            Way::Back => {
                let first = self.history.branches().next().map(|branch| branch.first.at);
                let first = first.unwrap_or_default();
                let at = Time::from_nanos(now.as_nanos().saturating_sub(nanos)).max(first);
                self.go_back_to_time(at);
                if at == first && now.nanos_since(first) < nanos {
                    Reason::Beginning
                } else {
                    Reason::Step(unit)
                }
            }
        };
        self.stopped(why, Vec::new())
    }

    /// Goes back to a time, after everything that happens then; at the first time of all, before it.
    pub fn go_back_to_time(&mut self, at: Time) {
        let beginning = self.beginning();
        match at > beginning.moment.at {
            true => self.history.go_to_time(at),
            false => _ = self.history.go_back_to(beginning),
        }
    }

    fn go_by(&mut self, at: Time, unit: Unit, progress: &mut Progress<'_>) -> Stop {
        let mut stop = self.go_plain(at, progress);
        if stop.why == Reason::Gone {
            stop.why = Reason::Step(unit);
        }
        stop
    }

    /// Lets the host do what it would do now, and says whether it did anything.
    fn host_goes_on(&mut self, way: Way) -> bool {
        let Some(feed) = self.feed.as_mut().filter(|_| way == Way::Forward) else { return false };
        // What was done here by hand may have been answered at once.
        feed.hear(&self.history, self.history.outputs());
        feed.go_on(&mut self.history)
    }

    /// The host hears what has gone wrong.
    fn host_hears(&mut self, problems: &VecDeque<Output>) {
        if let Some(feed) = &mut self.feed {
            feed.hear(&self.history, problems);
        }
    }

    /// Goes to where the host asked the operator, who is asked again each time a walk passes there.
    fn asks_again(&mut self, place: Option<Place>) -> Reason {
        if let (Some(place), Some(feed)) = (place, &mut self.feed) {
            self.history.go_back_to(place);
            feed.ask_again(place);
        }
        Reason::Rest
    }

    /// After a search up to `end` found nothing: lets the host act, or reads more, and says whether
    /// there may be something now.
    fn goes_on(&mut self, end: Time, progress: &mut Progress<'_>) -> Result<bool, Reason> {
        if self.host_goes_on(Way::Forward) {
            return Ok(true);
        }
        if end < end_of(&self.history) { Ok(false) } else { self.read_ahead(progress) }
    }

    /// Up to when a walk may go: where a recording is only looked at, or goes on, to its end.
    fn end_of_way(&self) -> Time {
        match self.stays || self.goes_on_reading() {
            true => end_of(&self.history),
            false => Time::NEVER,
        }
    }

    /// Why nothing more is found ahead.
    fn nothing_more(&self, end: Time) -> Reason {
        if end == Time::NEVER { Reason::Rest } else { Reason::End }
    }

    /// A stop at the present, as if a walk had just led there.
    pub fn here(&mut self) -> Stop {
        self.stopped(Reason::Gone, Vec::new())
    }

    /// The same, with what went wrong on the way.
    fn stopped_after(
        &mut self,
        why: Reason,
        notes: Vec<crate::Note>,
        mut problems: VecDeque<Output>,
    ) -> Stop {
        let mut stop = self.stopped(why, notes);
        // The last output is reported there.
        problems.retain(|problem| !stop.outputs.contains(problem));
        problems.drain(..problems.len().saturating_sub(PROBLEMS_MAX));
        stop.problems = problems.into();
        stop
    }

    pub(crate) fn stopped(&mut self, why: Reason, notes: Vec<crate::Note>) -> Stop {
        /// How much of the last output is reported.
        const OUTPUTS_MAX: usize = 100;
        if let Some(feed) = &mut self.feed {
            feed.hear(&self.history, self.history.outputs());
        }
        self.find_by_hand();
        let outputs: Vec<Output> = self.history.drain().take(OUTPUTS_MAX).collect();
        let said = outputs.iter().map(|output| self.say(output)).collect();
        let (place, at) = (self.place(), self.now());
        let (command, problems) = (self.executing(), Vec::new());
        Stop { why, place, at, command, notes, problems, outputs, said }
    }
}

/// A number that no breakpoint has.
const NOBODYS: BreakpointId = BreakpointId(0);

/// Waits for a command that leaves the buffer.
fn leaves_the_buffer() -> Breakpoint {
    Breakpoint {
        id: NOBODYS,
        trigger: Trigger::Condition(Condition::Command { like: None }),
        condition: None,
        hits: Hits::All,
        log: None,
        is_enabled: true,
        count: 0,
        counted: None,
    }
}

/// How far the way of the present is known.
pub(crate) fn end_of(history: &History<Controller>) -> Time {
    let heading = history.heading();
    let branch = history.branches().find(|branch| branch.id == heading);
    branch.map_or(Time::NEVER, |branch| branch.end.at)
}

/// Whether the present is beyond a place at the same instant.
fn is_beyond(history: &History<Controller>, place: Option<Place>) -> bool {
    let here = history.present();
    place.is_some_and(|place| here.branch == place.branch && here.moment > place.moment)
}

/// Whether a place comes after another on one way: a branch has a higher number than the one that it
/// has left.
fn is_after(place: Place, other: Place) -> bool {
    (place.branch.0, place.moment) > (other.branch.0, other.moment)
}

/// The breakpoints that a walk has ended at, in order of their numbers.
fn ids(walk: &Walk<'_>, now: Time) -> Vec<BreakpointId> {
    let met = walk.met.iter().filter(|(_, at)| *at == now).map(|(id, _)| *id);
    let mut ids: Vec<BreakpointId> = met.collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// The moment at which the command of a number begins.
struct CommandBegins(CommandNumber);

impl Sought<Controller> for CommandBegins {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        stretch.can_have_command(self.0)
    }

    fn after(&mut self, _: &Controller, _: Act, outputs: &VecDeque<Output>) -> bool {
        outputs.iter().any(|output| match output {
            Output::Event(stamp, Event::Command { .. }) => stamp.command == Some(self.0),
            _ => false,
        })
    }
}
