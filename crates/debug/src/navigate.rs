//! Walking through the history.

use std::collections::{BTreeMap, VecDeque};
use std::ops::ControlFlow;
use std::time::Duration;

use vimc4_device::{
    CommandNumber, Condition, Device, Event, Output, Time, WaitsFor, escape, show_nanos,
};
use vimc4_session::BreakpointId;
use vimc4_timeline::{Act, Begins, BranchId, Found, History, Place, Progress, Sought, Stretch};

use crate::Wired;
use crate::ahead::{SearchEnd, end_of, seek_next};
use crate::breakpoint::{Breakpoint, Counted, Hits, Note, Trigger};
use crate::debugger::{Bookmark, Debugger};
use crate::differences::Difference;
use crate::expression::filled;
use crate::feed::{Asked, Fed, Standing, Turn};
use crate::recurrence::is_timeless;
use crate::stop::{Reason, Stop};
use crate::unmet::Unmet;
use crate::walk::{PROBLEMS_MAX, Problems, Telling, Walk, is_in_program, loops};
use crate::{DebugError, Depth, Feed, Refused, Remedy, Unit, Way};

impl Debugger {
    /// Goes to a difference, counted from 1.
    pub(crate) fn go_to_difference(
        &mut self,
        number: usize,
        progress: &mut Progress<'_>,
    ) -> Result<Stop, DebugError> {
        let place = number.checked_sub(1);
        let found = place.and_then(|place| self.differences.list.get(place)).cloned();
        let Some(Difference { branch, mismatch }) = found else {
            return Err(DebugError::new(format!(
                "there is no difference {number}; `differences` lists those that there are"
            )));
        };
        let is_on_way = self.differences_on_way().any(|own| *own == mismatch);
        if !is_on_way {
            self.history.go_to_end(branch);
        }
        Ok(self.go_to_time(mismatch.at, progress))
    }

    /// Makes a number of steps. With [`Depth::Over`] and [`Depth::Out`] it stops at breakpoints on
    /// the way. What the host asks is a line, and no step of another unit.
    pub fn step(
        &mut self,
        unit: Unit,
        way: Way,
        depth: Depth,
        count: u64,
        progress: &mut Progress<'_>,
    ) -> Stop {
        if let Unit::Time(span) = unit {
            let nanos = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
            return self.pass(way, nanos.saturating_mul(count), unit, progress);
        }
        if depth == Depth::Out && !is_in_program(self.device()) {
            // Out of a list of commands is where it ends, or begins.
            return self.go(way, None, progress);
        }
        self.walk(way, Goal::Steps { unit, depth, count }, progress)
    }

    /// Whether nothing has happened before.
    fn is_at_start(&self) -> bool {
        self.place().moment == self.start().moment
    }

    /// Where everything begins.
    pub(crate) fn start(&self) -> Place {
        let first = self.history().branches().next().map(|branch| branch.first);
        Place { branch: BranchId(0), moment: first.unwrap_or_default() }
    }

    /// Goes on, forward or back, to the next breakpoint. Going forward ends at the given time at
    /// the latest, or where the controller waits for something from outside and the host does
    /// nothing more; going back ends at the beginning.
    pub fn go(&mut self, way: Way, until: Option<Time>, progress: &mut Progress<'_>) -> Stop {
        self.go_while(way, until, true, progress)
    }

    /// The same. If it `repeats`, it goes on with a controller that repeats itself for ever, until it is
    /// cancelled; otherwise that ends it, and the present stays.
    pub(crate) fn go_while(
        &mut self,
        way: Way,
        until: Option<Time>,
        repeats: bool,
        progress: &mut Progress<'_>,
    ) -> Stop {
        self.walk(way, Goal::Breakpoints { until, repeats }, progress)
    }

    /// Walks to a goal, or to what ends the walk before.
    fn walk(&mut self, way: Way, goal: Goal, progress: &mut Progress<'_>) -> Stop {
        self.find_by_hand();
        let mut walked = Walked {
            way,
            goal,
            from: self.place(),
            begun: self.whereabouts_now(),
            made: 0,
            open: loops(self.device()).len(),
            passed: BTreeMap::new(),
            notes: Vec::new(),
            problems: VecDeque::new(),
        };
        self.find_problems(&mut walked.problems);
        let why = loop {
            if let Goal::Steps { unit, count, .. } = goal
                && walked.made == count
            {
                // Before the first step nothing is left to go back to.
                break match way == Way::Back && self.is_at_start() {
                    true => Reason::Beginning,
                    false => Reason::Step(unit),
                };
            }
            match self.walk_on(&mut walked, progress) {
                None => {}
                Some(Reason::Endless(why)) => return self.stays_at(walked.begun, why),
                Some(why) => break why,
            }
        };
        self.stopped_after(why, walked.notes, walked.problems)
    }

    /// Walks to the next place at which a walk may end, and says why it ends there, if it does.
    fn walk_on(&mut self, walked: &mut Walked, progress: &mut Progress<'_>) -> Option<Reason> {
        let Walked { way, goal, .. } = *walked;
        if matches!(self.host_goes_on(way), Turn::Asks | Turn::Comes) {
            return self.ends_at_host(walked, progress);
        }
        let counts = goal.heeds() && way == Way::Forward;
        if counts && !self.count_hits(Breakpoint::is_limited, progress) {
            return Some(Reason::Cancelled);
        }
        let begin = self.counted_here();
        let end = goal.until().min(self.end_of_way());
        let mut found = match self.search(walked, end, progress) {
            Ok(found) => found,
            Err(span) => return Some(Reason::Endless(endless(span, &goal.in_vain()))),
        };
        if counts {
            // Where a step pulse ends the step, hits after it may have been counted.
            self.has_counted(begin, !matches!(goal, Goal::Steps { unit: Unit::Step, .. }));
        }
        if let Some((place, piece)) = found.behind {
            self.asks_again(Some(place), Some(piece));
            walked.passed.clear();
            return self.ends_at_host(walked, progress);
        }
        self.host_moves(found.end);
        if way == Way::Back && found.end == Found::Here {
            if !self.counted_back(&mut found.met, &mut walked.passed, progress) {
                self.history.go_back_to(walked.from);
                return Some(Reason::Cancelled);
            }
            if found.met.is_empty() && !found.is_step {
                return None;
            }
        }
        self.host_hears(&found.problems);
        walked.problems.append(&mut found.problems);
        walked.problems.drain(..walked.problems.len().saturating_sub(PROBLEMS_MAX));
        if found.is_turn {
            return None;
        }
        let why = self.ends_where_found(&mut found, walked, end, progress)?;
        walked.notes.append(&mut found.beyond);
        Some(why)
    }

    /// Looks for the next step, breakpoint or question, up to `end`. An error says that the controller
    /// repeats itself, each time in this span.
    fn search(
        &mut self,
        walked: &mut Walked,
        end: Time,
        progress: &mut Progress<'_>,
    ) -> Result<Search, Duration> {
        let Walked { way, goal, .. } = *walked;
        let (feed, source, history) = (self.feed.as_ref(), self.source.as_ref(), &mut self.history);
        // Only steps of lines, and walks without steps, stop at what the host asks.
        let host = feed.filter(|_| goal.counts_questions());
        let behind = host.filter(|_| way == Way::Back);
        let behind = behind.and_then(|feed| feed.asked_behind(history));
        let is_asked = host.is_some_and(|feed| feed.has_come_to_ask(history));
        let asked = host.filter(|_| way == Way::Forward);
        let asked = asked.and_then(|feed| feed.asked_ahead(history));
        let asked = asked.filter(|place| place.moment.at <= end);
        let limit = asked.map_or(end, |place| place.moment.at);
        let mut walk = Walk::new(way).telling();
        if let Goal::Steps { unit, depth, .. } = goal {
            walk = walk.step(unit, depth, walked.open, source);
        }
        if goal.heeds() {
            walk = walk.heeding(&mut self.breakpoints, source);
        }
        let is_timeless = !goal.repeats() && walk.is_timeless();
        let ahead = match (way, is_asked) {
            (Way::Forward, _) => seek_next(history, feed, limit, &mut walk, is_timeless, progress),
            (Way::Back, false) => SearchEnd::Found(history.seek_last(&mut walk, progress)),
            // What happens at this moment comes before what the host asks.
            (Way::Back, true) => SearchEnd::Found(history.seek_last_or_here(&mut walk, progress)),
        };
        let (is_turn, found) = match ahead {
            SearchEnd::Found(found) => (false, found),
            SearchEnd::HostTurn => (true, Found::Here),
            SearchEnd::Repeats(span) => return Err(span),
        };
        let is_before = |(asked, _): &(Place, usize)| {
            found == Found::Nowhere || !is_after(history.present(), *asked)
        };
        let met = ids(&walk, history.now());
        let is_step = matches!(goal, Goal::Steps { .. }) && (walk.is_step || met.is_empty());
        let beyond = if found == Found::Nowhere { walk.take_back() } else { Vec::new() };
        walked.notes.append(&mut walk.notes);
        Ok(Search {
            end: found,
            is_turn,
            met,
            is_step,
            behind: behind.filter(|asked| found != Found::GivenUp && is_before(asked)),
            is_asked: asked.is_some() && found == Found::Nowhere || is_beyond(history, asked),
            asked,
            beyond,
            problems: walk.problems.take().unwrap_or_default().last,
        })
    }

    /// Why a walk ends where its search has ended.
    fn ends_where_found(
        &mut self,
        found: &mut Search,
        walked: &mut Walked,
        end: Time,
        progress: &mut Progress<'_>,
    ) -> Option<Reason> {
        match found.end {
            Found::Here | Found::Nowhere if found.is_asked => {
                walked.notes.append(&mut found.beyond);
                self.asks_again(found.asked, None);
                self.leave_out_later(&mut walked.problems);
                self.ends_at_host(walked, progress)
            }
            Found::Here if found.met.is_empty() && found.is_step => {
                walked.open = loops(self.device()).len();
                self.has_made(walked);
                None
            }
            Found::Here => Some(Reason::Breakpoints(std::mem::take(&mut found.met))),
            Found::GivenUp => Some(Reason::Cancelled),
            Found::Nowhere if walked.way == Way::Back => {
                if let Goal::Breakpoints { .. } = walked.goal {
                    let beginning = self.beginning();
                    self.history.go_back_to(beginning);
                    self.host_moves(Found::Here);
                }
                Some(Reason::Beginning)
            }
            Found::Nowhere => match self.goes_on(end, progress) {
                Ok(true) => None,
                Err(Reason::Waits(_)) => self.ends_at_host(walked, progress),
                Err(why) => Some(why),
                Ok(false) if end < Time::NEVER && end == walked.goal.until() => {
                    self.history.run_to(end);
                    Some(Reason::Time)
                }
                Ok(false) => Some(self.nothing_more(end)),
            },
        }
    }

    /// Why a walk ends at what the host asks or waits for at the present. A question that it has come to
    /// is a step where lines are counted.
    fn ends_at_host(&mut self, walked: &mut Walked, progress: &mut Progress<'_>) -> Option<Reason> {
        let Walked { way, goal, .. } = *walked;
        if let Some(why) = self.ends_at_line(goal.heeds(), way, &mut walked.notes, progress) {
            return Some(why);
        }
        match goal {
            Goal::Breakpoints { .. } => self.host_asks().then(|| self.rests()),
            Goal::Steps { unit, count, .. } if goal.counts_questions() => {
                self.has_made(walked);
                (walked.made == count).then(|| self.host_waits().unwrap_or(Reason::Step(unit)))
            }
            Goal::Steps { .. } => None,
        }
    }

    /// A walk has made a step: it goes back there at most.
    fn has_made(&self, walked: &mut Walked) {
        walked.made += 1;
        walked.begun = self.whereabouts_now();
    }

    /// When the controller rests, if nothing comes from outside and no breakpoint is met before; nothing as
    /// well if that is not soon known. The present stays.
    #[must_use]
    pub fn rests_at(&self) -> Option<Time> {
        /// So often it is asked whether to go on.
        const PATIENCE: u32 = 1_000;
        let mut left = PATIENCE;
        let mut ahead = self.clone();
        let stop = ahead.go(Way::Forward, None, &mut |_| {
            left -= 1;
            if left > 0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        (stop.why == Reason::Rest).then_some(stop.at)
    }

    /// Goes to where a trigger is met next or was met last, whatever breakpoints there are and whatever
    /// the host asks on the way. If there is no such place nothing has happened.
    pub fn find(&mut self, trigger: Trigger, way: Way, progress: &mut Progress<'_>) -> Stop {
        let known = self.known();
        let stop = self.look_for(trigger, way, progress);
        if stop.why != Reason::Gone {
            self.forget_beyond(known);
        }
        stop
    }

    /// The same, where what has become known stays so.
    fn look_for(&mut self, trigger: Trigger, way: Way, progress: &mut Progress<'_>) -> Stop {
        let (begin, standing) = (self.place(), self.standing());
        let heeded = std::mem::take(&mut self.breakpoints);
        self.await_trigger(trigger);
        let stop = loop {
            let stop = self.go_while(way, None, false, progress);
            if matches!(stop.why, Reason::Waits(_)) && !self.met_waiting().is_empty() {
                self.breakpoints = heeded;
                return Stop { why: Reason::Gone, met: self.met_waiting(), ..stop };
            }
            let feed = self.feed.as_ref();
            let has_more = feed.is_some_and(|feed| feed.asks_here(stop.place).is_some());
            let is_known = way == Way::Back || !self.history.is_at_end() || has_more;
            if !(matches!(stop.why, Reason::Waits(_)) && is_known) {
                break stop;
            }
        };
        self.breakpoints = heeded;
        let why = match stop.why {
            Reason::Breakpoints(_) => return Stop { why: Reason::Gone, ..stop },
            Reason::Cancelled => Reason::Cancelled,
            Reason::Endless(_) => stop.why,
            _ => Reason::Nowhere,
        };
        self.history.go_back_to(begin);
        self.stand(standing);
        self.stopped(why, Vec::new())
    }

    /// Goes to the next or the last instant at which a condition begins to hold. Where the history
    /// has none, `Way::Forward` goes on beyond its end. If there is none the present stays.
    pub fn seek(&mut self, condition: &Condition, way: Way, progress: &mut Progress<'_>) -> Stop {
        let mut problems = Problems::default();
        let mut awaits = None;
        let standing = self.standing();
        let found = match way {
            Way::Back => Ok(self.history.seek_last(&mut Begins::new(condition), progress)),
            Way::Forward => self.seek_ahead(condition, &mut problems, &mut awaits, progress),
        };
        if found == Ok(Found::Here) {
            self.host_moves(Found::Here);
        } else {
            // Nothing has happened.
            problems.last.clear();
            self.stand(standing);
        }
        let why = match found {
            Ok(Found::Here) => Reason::Found,
            Ok(Found::Nowhere) => Reason::Nowhere,
            Ok(Found::GivenUp) => Reason::Cancelled,
            Err(why) => why,
        };
        Stop { awaits, ..self.stopped_after(why, Vec::new(), problems.last) }
    }

    /// First in the history, and then in the future. An unsuccessful search leaves no trace.
    fn seek_ahead(
        &mut self,
        condition: &Condition,
        problems: &mut Problems,
        awaits: &mut Option<String>,
        progress: &mut Progress<'_>,
    ) -> Result<Found, Reason> {
        let begin = self.place();
        let mut known = self.known();
        let mut begins = Begins::new(condition);
        let mut telling = Telling { sought: &mut begins, problems };
        let mut end = end_of(&self.history);
        let mut found = self.history.seek_next(end, &mut telling, progress);
        while found == Found::Nowhere {
            match self.read_ahead(progress) {
                // What is recorded stays known.
                Ok(true) => known = self.known(),
                Ok(false) => break,
                Err(why) => {
                    self.history.go_back_to(begin);
                    return Err(why);
                }
            }
            end = end_of(&self.history);
            found = self.history.seek_next(end, &mut telling, progress);
        }
        let mut repeats = None;
        if found == Found::Nowhere && !self.stays {
            self.history.go_to_time(end);
            let is_timeless = is_timeless(condition);
            match self.seek_beyond(&mut begins, is_timeless, problems, progress) {
                SearchEnd::Found(beyond) => found = beyond,
                SearchEnd::HostTurn => {}
                SearchEnd::Repeats(span) => repeats = Some(span),
            }
        }
        if found != Found::Here {
            *awaits = self.awaited().filter(|_| repeats.is_none() && found == Found::Nowhere);
            self.history.go_back_to(begin);
            self.forget_beyond(known);
        }
        match repeats {
            Some(span) => Err(Reason::Endless(endless(span, "that never comes"))),
            None => Ok(found),
        }
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
        self.host_is_found();
        Ok(self.stopped(Reason::Gone, Vec::new()))
    }

    /// Goes to a bookmark, and to what the host asked there.
    ///
    /// # Errors
    ///
    /// If the history no longer has its moment.
    pub fn go_to_mark(&mut self, mark: Bookmark) -> Result<Stop, DebugError> {
        let stop = self.go_to(mark.place)?;
        if let Some(standing) = mark.standing {
            self.stand(standing);
        }
        Ok(stop)
    }

    /// Goes to where the host asks the operator at a line of the file: where it has asked last, or
    /// where it will.
    ///
    /// # Errors
    ///
    /// If it does not come to ask there.
    pub(crate) fn go_to_question(
        &mut self,
        line: u32,
        progress: &mut Progress<'_>,
    ) -> Result<Stop, DebugError> {
        let waits_at = |own: &Debugger| own.feed.as_ref()?.waits_at(&own.history);
        if waits_at(self) == Some(line) {
            return Ok(self.here());
        }
        let known = self.known();
        for way in [Way::Back, Way::Forward] {
            let stop = self.look_for(Trigger::SourceLine(line), way, progress);
            match stop.why {
                Reason::Gone => return Ok(stop),
                Reason::Cancelled => {
                    self.forget_beyond(known);
                    return Err(Reason::Cancelled.into());
                }
                _ => {}
            }
        }
        // What holds it up is at the end of the way.
        let (begin, standing) = (self.place(), self.standing());
        self.history.go_to_end(self.history.heading());
        self.host_is_found();
        let why = self.rests();
        self.history.go_back_to(begin);
        self.forget_beyond(known);
        self.stand(standing);
        Err(DebugError::new(match why {
            Reason::Waits(what) => format!("before line {line}, {what}"),
            Reason::Refused(why) => format!("line {line} was not reached: {why}"),
            _ => format!("nothing is asked at line {line} here"),
        }))
    }

    /// The breakpoints at the line at which the host waits at the present, of those that would stop a walk
    /// there. Every walk stops at a question anyway.
    fn met_waiting(&self) -> Vec<BreakpointId> {
        let waits = self.feed.as_ref().and_then(|feed| feed.waits_at(&self.history));
        let Some(line) = waits else { return Vec::new() };
        let (device, now, here) = (self.device(), self.now(), self.counted_here());
        let is_counted = |own: &Breakpoint| own.counted == Some(here);
        let is_met = |own: &&Breakpoint| {
            let holds = own.condition.as_ref().is_none_or(|condition| condition.is_so(device, now));
            own.trigger == Trigger::SourceLine(line)
                && own.is_enabled
                && (!own.is_limited() || is_counted(own) && own.hits.allow(own.count))
                && own.log.is_none()
                && holds
        };
        self.breakpoints.iter().filter(is_met).map(|own| own.id).collect()
    }

    /// Goes to a time, after everything that happens then. Beyond the end of the way it leads to where nothing
    /// more happens by itself, and never beyond the end of a recording.
    pub fn go_to_time(&mut self, at: Time, progress: &mut Progress<'_>) -> Stop {
        if self.goes_on_reading()
            && let Err(why) = self.read_until(|own| end_of(&own.history) >= at, progress)
        {
            return self.stopped(why, Vec::new());
        }
        self.history.go_to_time(at);
        self.host_is_found();
        if self.now() >= at {
            return self.stopped(Reason::Gone, Vec::new());
        }
        if self.is_on_recording() {
            return self.stopped(Reason::End, Vec::new());
        }
        self.go_plain(at, false, progress)
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
        let begin = self.place();
        let (known, standing) = (self.known(), self.standing());
        let mut found = self.seek_command(number, progress);
        let mut repeats = None;
        if found == Found::Nowhere {
            // It may be still to come.
            let mut begins = CommandBegins(number);
            let problems = &mut Problems::default();
            match self.seek_beyond(&mut begins, true, problems, progress) {
                SearchEnd::Found(beyond) => found = beyond,
                SearchEnd::HostTurn => {}
                SearchEnd::Repeats(span) => repeats = Some(endless(span, "it never comes to that")),
            }
        }
        if found == Found::Here {
            self.host_moves(found);
            return Ok(self.stopped(Reason::Gone, Vec::new()));
        }
        let waits = match self.rests() {
            Reason::Waits(what) => Some(what),
            _ => None,
        };
        let refused = self.rest_not_sent();
        self.history.go_back_to(begin);
        self.forget_beyond(known);
        self.stand(standing);
        let line = self.source.as_ref().and_then(|source| source.line_of(number));
        let what = line.map_or_else(|| format!("command {number}"), |line| format!("line {line}"));
        let wrong = match (found, waits, refused) {
            (Found::GivenUp, ..) => return Err(DebugError::cancelled()),
            _ if repeats.is_some() => format!("before {what}, {}", repeats.unwrap_or_default()),
            (_, Some(waits), _) => format!("before {what}, {waits}"),
            (_, _, Some(refused)) => format!("{what} was not sent here: {refused}"),
            _ => {
                let wrong = format!("no command has the number {number} here");
                return Err(DebugError::new(wrong).with(Remedy::Numbers));
            }
        };
        Err(DebugError::new(wrong))
    }

    /// Goes to where the execution of a command began: what is still to come is not worked out.
    ///
    /// # Errors
    ///
    /// If it has not begun on the way of the present, which stays then.
    pub fn look_at_command(
        &mut self,
        number: CommandNumber,
        progress: &mut Progress<'_>,
    ) -> Result<(), DebugError> {
        let (begin, heading) = (self.place(), self.history.heading());
        let found = self.seek_command(number, progress);
        if found != Found::Here {
            self.history.go_to_end(heading);
            self.history.go_back_to(begin);
        }
        self.history.drain();
        match found {
            Found::Here => Ok(()),
            Found::GivenUp => Err(Reason::Cancelled.into()),
            Found::Nowhere => {
                let wrong = format!("no command with the number {number} has begun here");
                Err(DebugError::new(wrong).with(Remedy::Numbers))
            }
        }
    }

    /// From the end of the way of the present back to where a command began.
    fn seek_command(&mut self, number: CommandNumber, progress: &mut Progress<'_>) -> Found {
        self.history.go_to_end(self.history.heading());
        self.history.seek_last_or_here(&mut CommandBegins(number), progress)
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
        self.host_is_found();
        let (mut nothing, mut problems) = (Walk::new(Way::Forward), Problems::default());
        let ahead = self.host_goes_on_to(&mut nothing, true, &mut problems, progress);
        let why = match (ahead, self.rests()) {
            (SearchEnd::Found(Found::GivenUp), _) => Reason::Cancelled,
            (_, waits @ Reason::Waits(_)) => waits,
            _ => Reason::Gone,
        };
        self.stopped(why, Vec::new())
    }

    /// From the end of the way on, goes to where `sought` is, whatever the host still does.
    fn seek_beyond(
        &mut self,
        sought: &mut impl Sought<Wired>,
        is_timeless: bool,
        problems: &mut Problems,
        progress: &mut Progress<'_>,
    ) -> SearchEnd {
        let ahead = self.host_goes_on_to(sought, is_timeless, problems, progress);
        if ahead != SearchEnd::Found(Found::Nowhere) || self.stays {
            return ahead;
        }
        let mut telling = Telling { sought, problems };
        seek_next(&mut self.history, None, Time::NEVER, &mut telling, is_timeless, progress)
    }

    /// From the end of the way on, lets the host do what it has not done yet, up to where `sought` is.
    fn host_goes_on_to(
        &mut self,
        sought: &mut impl Sought<Wired>,
        is_timeless: bool,
        problems: &mut Problems,
        progress: &mut Progress<'_>,
    ) -> SearchEnd {
        let mut has_rested = false;
        loop {
            self.host_hears(&problems.last);
            let turn = self.host_goes_on(Way::Forward);
            let feed = self.feed.as_ref();
            let is_done = feed.is_none_or(|feed| feed.is_done(&self.history));
            if turn == Turn::Asks || turn == Turn::Idle && (is_done || has_rested) {
                return SearchEnd::Found(Found::Nowhere);
            }
            let mut telling = Telling { sought, problems };
            let history = &mut self.history;
            let ahead = seek_next(history, feed, Time::NEVER, &mut telling, is_timeless, progress);
            let has_ended = match ahead {
                SearchEnd::Found(Found::Here | Found::GivenUp) | SearchEnd::Repeats(_) => {
                    return ahead;
                }
                SearchEnd::Found(Found::Nowhere) => true,
                SearchEnd::HostTurn => false,
            };
            has_rested = turn == Turn::Idle && has_ended;
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
        let (begin, here, known_to) = (self.place(), self.counted_here(), self.known());
        for number in 0..self.breakpoints.len() {
            let own = &self.breakpoints[number];
            if !which(own) || own.counted == Some(here) {
                continue;
            }
            let known = own.counted.filter(|known| match known.place == begin {
                true => known.asked <= here.asked,
                false => self.is_on_the_way(known.place, begin),
            });
            let count = if known.is_some() { own.count } else { 0 };
            let mut counter =
                [Breakpoint { hits: Hits::All, log: None, is_enabled: true, count, ..own.clone() }];
            let from = known.map_or_else(|| self.beginning(), |known| known.place);
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
            let come_to = self.history.present();
            self.history.go_back_to(begin);
            self.forget_beyond(known_to.clone());
            if !is_counted {
                let asks = !self.questions(&counter[0].trigger).is_empty();
                let own = &mut self.breakpoints[number];
                own.count = counter[0].count;
                own.counted = (!asks).then_some(Counted { place: come_to, asked: 0 });
                return false;
            }
            let asked = self.questions_met(&counter[0], known);
            let own = &mut self.breakpoints[number];
            (own.count, own.counted) = (counter[0].count + asked, Some(here));
        }
        true
    }

    /// Where the present is, for counting.
    fn counted_here(&self) -> Counted {
        let place = self.place();
        let asked = self.feed.as_ref().map_or(0, |feed| feed.has_asked_here(place));
        Counted { place, asked }
    }

    /// What the host asked on the way to the present at the line that a trigger is for.
    fn questions(&self, trigger: &Trigger) -> Vec<Asked> {
        let (Some(feed), Trigger::SourceLine(line)) = (&self.feed, trigger) else {
            return Vec::new();
        };
        let mut asked = feed.asked_on_way(&self.history, self.counted_here().asked);
        asked.retain(|asked| asked.line == *line);
        asked
    }

    /// At how many questions a breakpoint was met on the way to the present, behind where that is known.
    fn questions_met(&mut self, own: &Breakpoint, known: Option<Counted>) -> u64 {
        let begin = self.place();
        let mut asked = self.questions(&own.trigger);
        asked.retain(|asked| {
            known.is_none_or(|known| match asked.place == known.place {
                true => asked.nth >= known.asked,
                false => !self.is_on_the_way(asked.place, known.place),
            })
        });
        if let Some(condition) = &own.condition {
            asked.retain(|asked| {
                self.history.go_back_to(asked.place);
                condition.is_so(self.device(), self.now())
            });
            self.history.go_back_to(begin);
        }
        asked.len() as u64
    }

    /// The host asks: the breakpoints at its line are met. On the way forward those that log do so. Says
    /// whether their hits were counted, where that matters.
    fn meets_question(
        &mut self,
        way: Way,
        notes: &mut Vec<Note>,
        progress: &mut Progress<'_>,
    ) -> bool {
        let waits = self.feed.as_ref().and_then(|feed| feed.waits_at(&self.history));
        let Some(trigger) = waits.map(Trigger::SourceLine) else { return true };
        if !self.count_hits(|own| own.is_limited() && own.trigger == trigger, progress) {
            return false;
        }
        let (device, at) = (self.device(), self.now());
        let logs = self.breakpoints.iter().filter(|own| {
            let holds = || own.condition.as_ref().is_none_or(|it| it.is_so(device, at));
            own.is_enabled
                && own.trigger == trigger
                && (!own.is_limited() || own.hits.allow(own.count))
                && holds()
        });
        let logs = logs.filter_map(|own| {
            let text = filled(own.log.as_ref()?, device, at);
            Some(Note { by: own.id, at, text })
        });
        if way == Way::Forward {
            notes.extend(logs);
        }
        true
    }

    /// Why a walk ends where the host has come to, whatever else it waits for.
    fn ends_at_line(
        &mut self,
        heeds: bool,
        way: Way,
        notes: &mut Vec<Note>,
        progress: &mut Progress<'_>,
    ) -> Option<Reason> {
        if heeds && !self.meets_question(way, notes, progress) {
            return Some(Reason::Cancelled);
        }
        // A question ends walks itself, and says what is asked.
        let met = if heeds && !self.host_asks() { self.met_waiting() } else { Vec::new() };
        (!met.is_empty()).then(|| self.host_waits().unwrap_or(Reason::Breakpoints(met)))
    }

    /// What the host asks or waits for at the present, if that holds it up.
    fn host_waits(&self) -> Option<Reason> {
        self.waits().map(Reason::Waits)
    }

    /// Whether the host asks at the present.
    fn host_asks(&self) -> bool {
        self.feed.as_ref().is_some_and(|feed| feed.asks_now(&self.history))
    }

    /// What breakpoints at questions would have logged, on the way to the present.
    pub(crate) fn questions_noted(&mut self, own: &Breakpoint) -> Vec<Note> {
        let (begin, standing) = (self.place(), self.standing());
        self.host_is_found();
        let mut notes = Vec::new();
        for asked in self.questions(&own.trigger) {
            self.history.go_back_to(asked.place);
            let (device, at) = (self.device(), self.now());
            let holds = own.condition.as_ref().is_none_or(|it| it.is_so(device, at));
            if let Some(log) = own.log.as_ref().filter(|_| holds) {
                notes.push(Note { by: own.id, at, text: filled(log, device, at) });
            }
        }
        self.history.go_back_to(begin);
        self.stand(standing);
        notes
    }

    /// A walk forward has counted the hits on its way; `are_right`: those up to the present.
    fn has_counted(&mut self, begin: Counted, are_right: bool) {
        let here = self.counted_here();
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
        let here = self.counted_here();
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

    /// Goes on to a time, ignoring breakpoints. `passes`: time passes, too, while nothing happens.
    fn go_plain(&mut self, at: Time, passes: bool, progress: &mut Progress<'_>) -> Stop {
        let mut nothing = Walk::new(Way::Forward).telling();
        if self.goes_on_reading()
            && let Err(why) = self.read_until(|own| end_of(&own.history) >= at, progress)
        {
            return self.stopped(why, Vec::new());
        }
        let end = at.min(self.end_of_way());
        let mut turn = self.host_goes_on(Way::Forward);
        loop {
            let (history, feed) = (&mut self.history, self.feed.as_ref());
            let ahead = seek_next(history, feed, end, &mut nothing, false, progress);
            if ahead == SearchEnd::Found(Found::GivenUp) {
                return self.stopped(Reason::Cancelled, Vec::new());
            }
            let went_wrong = nothing.problems.replace(Problems::default()).unwrap_or_default();
            self.host_hears(&went_wrong.last);
            // Time passes although the host waits.
            if turn != Turn::Asks {
                turn = self.host_goes_on(Way::Forward);
            }
            if ahead != SearchEnd::HostTurn && !matches!(turn, Turn::Acted | Turn::Comes) {
                break;
            }
        }
        let rests = self.history.next_act().is_none() && self.now() < end;
        if rests && !passes {
            let why = self.rests();
            return self.stopped(why, Vec::new());
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
    pub(crate) fn go_back_to_time(&mut self, at: Time) {
        let beginning = self.beginning();
        match at > beginning.moment.at {
            true => self.history.go_to_time(at),
            false => _ = self.history.go_back_to(beginning),
        }
        self.host_is_found();
    }

    fn go_by(&mut self, at: Time, unit: Unit, progress: &mut Progress<'_>) -> Stop {
        let mut stop = self.go_plain(at, true, progress);
        if stop.why == Reason::Gone {
            stop.why = Reason::Step(unit);
        }
        stop
    }

    /// Lets the host do what it would do now, and says what it did.
    fn host_goes_on(&mut self, way: Way) -> Turn {
        let Some(feed) = self.feed.as_mut().filter(|_| way == Way::Forward) else {
            return Turn::Idle;
        };
        // What was done here by hand may have been answered at once.
        feed.hear(&self.history, self.history.outputs());
        feed.go_on(&mut self.history)
    }

    /// A walk has led somewhere: what the host asks there comes afterwards.
    fn host_moves(&mut self, found: Found) {
        if let Some(feed) = self.feed.as_mut().filter(|_| found == Found::Here) {
            feed.has_moved();
        }
    }

    /// Somebody has come to the present without a walk.
    fn host_is_found(&mut self) {
        let present = self.place();
        if let Some(feed) = &mut self.feed {
            feed.is_found(present);
        }
    }

    /// How far the way of the present is known, and what the host has done there. What is still to be read
    /// of a recording stays known when it is.
    pub(crate) fn known(&self) -> Option<Known> {
        let way = self.history.known();
        let fed = self.feed.as_ref().map(|feed| feed.fed(self.history.heading()));
        (!self.goes_on_reading()).then_some(Known { way, fed })
    }

    /// Forgets what has become known of it since, which was only tried, and that the host did it. The
    /// present is to be no later.
    pub(crate) fn forget_beyond(&mut self, known: Option<Known>) {
        let Some(Known { way, fed }) = known else { return };
        self.history.forget_beyond(way);
        if let (Some(fed), Some(feed)) = (fed, &mut self.feed) {
            feed.takes_back(fed);
        }
    }

    fn standing(&self) -> Standing {
        self.feed.as_ref().map(Feed::standing).unwrap_or_default()
    }

    fn stand(&mut self, standing: Standing) {
        if let Some(feed) = &mut self.feed {
            feed.stand(standing);
        }
    }

    /// Why nothing more happens at the present: the host waits, or everything is done.
    fn rests(&self) -> Reason {
        let refused = || self.rest_not_sent().map(Reason::Refused);
        self.host_waits().or_else(refused).unwrap_or(Reason::Rest)
    }

    /// Why the rest of the file was not sent, if it was not.
    fn rest_not_sent(&self) -> Option<String> {
        let Refused { command, answer, why } = self.feed.as_ref()?.refused(&self.history)?;
        let source = self.source.as_ref();
        let line = command.zip(source).and_then(|(command, source)| source.line_of(command));
        let text = line.and_then(|line| source?.lines.get((line as usize).checked_sub(1)?));
        let what = match (line, text, command) {
            (Some(line), Some(text), _) => format!("line {line}: {}", text.trim()),
            (_, _, Some(command)) => format!("command {command}"),
            _ => "something".to_owned(),
        };
        Some(format!("{what} was answered {answer}: {why}; the rest was not sent"))
    }

    /// What was done by hand may have been answered with an error at once.
    fn find_problems(&self, problems: &mut VecDeque<Output>) {
        let mut found = Problems::default();
        found.saw(self.history.outputs());
        problems.extend(found.last);
    }

    /// The host hears what has gone wrong.
    fn host_hears(&mut self, problems: &VecDeque<Output>) {
        if let Some(feed) = &mut self.feed {
            feed.hear(&self.history, problems);
        }
    }

    /// A walk that looked beyond the present has seen what is not so yet.
    fn leave_out_later(&mut self, problems: &mut VecDeque<Output>) {
        if problems.is_empty() {
            return;
        }
        let (now, last) = (self.now(), self.executing().map(|command| command.number));
        problems.retain(|problem| match problem {
            Output::Event(stamp, _) => stamp.at < now || stamp.command <= last,
            _ => true,
        });
    }

    /// Goes to where the host asked the operator, who is asked again each time a walk passes there, or came
    /// to wait.
    fn asks_again(&mut self, place: Option<Place>, piece: Option<usize>) {
        if let (Some(place), Some(feed)) = (place, &mut self.feed) {
            self.history.go_back_to(place);
            feed.ask_again(place, piece);
        }
    }

    /// After a search up to `end` found nothing: lets the host act, or reads more, and says whether
    /// there may be something now.
    fn goes_on(&mut self, end: Time, progress: &mut Progress<'_>) -> Result<bool, Reason> {
        match self.host_goes_on(Way::Forward) {
            Turn::Acted => return Ok(true),
            Turn::Asks => return Err(self.rests()),
            Turn::Comes => {
                // The walk comes to it when it looks there next.
                self.host_moves(Found::Here);
                return Ok(true);
            }
            Turn::Idle => {}
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

    /// Where the present is, how far the way is known, and what the host has asked there.
    fn whereabouts_now(&self) -> WalkStart {
        WalkStart { place: self.place(), known: self.known(), standing: self.standing() }
    }

    /// A walk that never ends leaves no trace: the present is where it was.
    fn stays_at(&mut self, begun: WalkStart, why: String) -> Stop {
        self.history.go_back_to(begun.place);
        self.forget_beyond(begun.known);
        self.stand(begun.standing);
        self.stopped(Reason::Endless(why), Vec::new())
    }

    /// What the controller waits for at the present besides a command, and what changes that.
    fn awaited(&self) -> Option<String> {
        let device = self.device();
        let waits_for = device.view(self.now()).waits_for?;
        let remedy = match waits_for {
            WaitsFor::Port { port, bit: Some(bit), from } => {
                let condition = Condition::PortBit { port, bit, level: from == 0 };
                Unmet { condition: &condition, device }.to_string()
            }
            WaitsFor::Port { .. } => String::new(),
            WaitsFor::Character { code } => {
                format!("; `sendraw {}` changes that", escape(&[code]))
            }
            _ => return None,
        };
        Some(format!("the program waits for {waits_for}{remedy}"))
    }

    /// Why nothing more is found ahead.
    fn nothing_more(&self, end: Time) -> Reason {
        if end == Time::NEVER { self.rests() } else { Reason::End }
    }

    /// A stop at the present, as if a walk had just led there.
    pub fn here(&mut self) -> Stop {
        self.stopped(Reason::Gone, Vec::new())
    }

    /// The same, with what went wrong on the way.
    fn stopped_after(&mut self, why: Reason, notes: Vec<Note>, problems: VecDeque<Output>) -> Stop {
        let mut stop = self.stopped(why, notes);
        let mut problems: VecDeque<Output> =
            problems.into_iter().map(|problem| self.as_shown(problem)).collect();
        // The last output is reported there.
        problems.retain(|problem| !stop.outputs.contains(problem));
        problems.drain(..problems.len().saturating_sub(PROBLEMS_MAX));
        stop.problems = problems.into();
        stop
    }

    pub(crate) fn stopped(&mut self, why: Reason, notes: Vec<Note>) -> Stop {
        /// How much of the last output is reported.
        const OUTPUTS_MAX: usize = 100;
        if let Some(feed) = &mut self.feed {
            feed.hear(&self.history, self.history.outputs());
        }
        self.find_by_hand();
        let outputs: Vec<Output> = self.history.drain().take(OUTPUTS_MAX).collect();
        let outputs: Vec<Output> =
            outputs.into_iter().map(|output| self.as_shown(output)).collect();
        let differences = self.differences_passed();
        let said = outputs.iter().map(|output| self.say(output)).collect();
        let (place, at) = (self.place(), self.now());
        let (command, problems) = (self.executing(), Vec::new());
        let line = self.file_line(command.as_ref());
        let met = match why {
            Reason::Waits(_) => self.met_waiting(),
            _ => Vec::new(),
        };
        let awaits = self.awaited().filter(|_| why == Reason::Rest);
        Stop {
            why,
            place,
            at,
            met,
            command,
            line,
            notes,
            problems,
            differences,
            outputs,
            said,
            awaits,
        }
    }
}

/// Where a walk has begun.
struct WalkStart {
    place: Place,
    known: Option<Known>,
    standing: Standing,
}

/// Where a walk ends, if nothing ends it before.
#[derive(Clone, Copy)]
enum Goal {
    /// After so many steps.
    Steps { unit: Unit, depth: Depth, count: u64 },
    /// At a breakpoint, or at this time.
    Breakpoints {
        until: Option<Time>,
        /// It goes on with a controller that repeats itself for ever.
        repeats: bool,
    },
}

impl Goal {
    /// Whether breakpoints end the walk.
    fn heeds(self) -> bool {
        !matches!(self, Goal::Steps { depth: Depth::Into, .. })
    }

    /// Whether a question of the host is a step, or ends the walk.
    fn counts_questions(self) -> bool {
        matches!(self, Goal::Steps { unit: Unit::Line, .. } | Goal::Breakpoints { .. })
    }

    fn until(self) -> Time {
        match self {
            Goal::Breakpoints { until: Some(until), .. } => until,
            _ => Time::NEVER,
        }
    }

    fn repeats(self) -> bool {
        matches!(self, Goal::Breakpoints { repeats: true, .. })
    }

    /// What a controller that repeats itself never does.
    fn in_vain(self) -> String {
        match self {
            Goal::Steps { unit, .. } => format!("no {unit} comes"),
            Goal::Breakpoints { .. } => "nothing stops it".to_owned(),
        }
    }
}

/// How far a walk has come.
struct Walked {
    way: Way,
    goal: Goal,
    from: Place,
    /// Where the step in progress began.
    begun: WalkStart,
    /// Steps made.
    made: u64,
    /// How many loops were open where the step in progress began.
    open: usize,
    /// The numbers of the hits that a walk back has come to.
    passed: BTreeMap<BreakpointId, u64>,
    notes: Vec<Note>,
    problems: VecDeque<Output>,
}

/// What one search of a walk has found.
struct Search {
    end: Found,
    /// The host has its turn.
    is_turn: bool,
    met: Vec<BreakpointId>,
    /// A step ends here.
    is_step: bool,
    /// What the host asked on the way back, before what was found.
    behind: Option<(Place, usize)>,
    /// What the host asked ahead.
    asked: Option<Place>,
    /// Whether the search has come to it.
    is_asked: bool,
    /// Notes of later than the present.
    beyond: Vec<Note>,
    problems: VecDeque<Output>,
}

/// Why a walk never ends: the controller repeats itself each time in this span.
fn endless(span: Duration, what: &str) -> String {
    let span = show_nanos(u64::try_from(span.as_nanos()).unwrap_or(u64::MAX));
    format!("the program repeats itself every {span}, and {what}; `press stop` stops it")
}

/// How far a way is known, and what the host has done on it.
#[derive(Clone)]
pub(crate) struct Known {
    way: vimc4_timeline::Known,
    fed: Option<Fed>,
}

/// Whether the present is beyond a place at the same instant.
fn is_beyond(history: &History<Wired>, place: Option<Place>) -> bool {
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

impl Sought<Wired> for CommandBegins {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        stretch.can_have_command(self.0)
    }

    fn after(&mut self, _: &Wired, _: Act, outputs: &VecDeque<Output>) -> bool {
        outputs.iter().any(|output| match output {
            Output::Event(stamp, Event::Command { .. }) => stamp.command == Some(self.0),
            _ => false,
        })
    }
}
