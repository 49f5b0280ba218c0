//! Walking through the history.

use std::collections::VecDeque;

use vimc4_catalogue::Controller;
use vimc4_device::{CommandNumber, Condition, Event, Kinds, Output, Time};
use vimc4_timeline::{Act, Begins, BranchId, Found, History, Place, Progress, Sought, Stretch};

use crate::breakpoint::{Breakpoint, BreakpointId, Hits, Trigger};
use crate::debugger::Debugger;
use crate::stop::{Reason, Stop};
use crate::walk::{PROBLEMS_MAX, Problems, Telling, Walk};
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
        self.find_by_hand();
        let (mut notes, mut made) = (Vec::new(), 0);
        let mut problems = VecDeque::new();
        while made < count {
            self.host_goes_on(way);
            let end = self.end_of_way();
            let history = &mut self.history;
            let source = self.source.as_ref();
            let mut walk = Walk::new(way).step(unit, depth, history.device(), source).telling();
            if depth != Depth::Into {
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
            let met = ids(&walk, history.now());
            notes.append(&mut walk.notes);
            let went_wrong = walk.problems.take().unwrap_or_default().last;
            self.host_hears(&went_wrong);
            problems.extend(went_wrong);
            problems.drain(..problems.len().saturating_sub(PROBLEMS_MAX));
            let why = match found {
                Found::Here if is_beyond => self.asks_again(asked),
                Found::Here if met.is_empty() => {
                    made += 1;
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
        loop {
            self.host_goes_on(way);
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
            self.host_hears(&went_wrong);
            problems.extend(went_wrong);
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
                    let first = self.history.branches().next().map(|branch| branch.first);
                    let moment = first.unwrap_or_default();
                    self.history.go_back_to(Place { branch: BranchId(0), moment });
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
        self.history.go_back_to(begin);
        Err(DebugError::new(match found {
            Found::GivenUp => "cancelled".to_owned(),
            _ => format!("no command has the number {number} here"),
        }))
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
                self.history.go_to_time(at);
                if at == first && now.nanos_since(first) < nanos {
                    Reason::Beginning
                } else {
                    Reason::Step(unit)
                }
            }
        };
        self.stopped(why, Vec::new())
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
