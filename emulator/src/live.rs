//! A controller that runs behind real ports, and the history that follows it.
//!
//! During inspection the controller's time is paused; clients stay connected and notice only the
//! delay. The history gets what the controller gets. Going forward in it moves the controller
//! itself. Going back only looks, and acts there begin a branch to look at: the controller itself
//! stays until it is taken there.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::Value;
use vimc4::{
    Control, Emulator, EventFilter, LineEvent, Order, Report, ReportKind, Reports, Sink, Source,
    Step, Tap,
};
use vimc4_answers::past::{self, Lived, is_on_way, way};
use vimc4_catalogue::State;
use vimc4_debug::{
    Breakpoint, BreakpointId, Debugger, Note, Reason, Stop, Trigger, Unit, Way, Wired,
    uninterrupted,
};
#[cfg(feature = "api")]
use vimc4_device::TimedInput;
use vimc4_device::{Condition, Device, Input, Kinds, LineState, OwnedInput, Time};
use vimc4_timeline::{Act, History, Moment, Place, Progress};

/// How many reports may wait until they are looked at.
const WAITING: usize = 1 << 20;

/// How many acts a controller is led by before asking whether to go on.
const PATIENCE: u32 = 64;

/// In whose name a debugger pauses the controller when what it waits for has come.
const DEBUGGER: &str = "the debugger";

/// Why the controller does not do what is wanted.
pub(crate) type Failed = String;

/// Is called when there is something to be looked at; it must not block.
pub(crate) type Ring = Arc<dyn Fn() + Send + Sync>;

/// Until when a released controller runs by itself: at the latest until a breakpoint or a user
/// pauses it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Until {
    #[default]
    Paused,
    /// A command begins.
    Command,
    Time(Time),
}

impl Until {
    fn time(self) -> Option<Time> {
        match self {
            Until::Time(at) => Some(at),
            Until::Paused | Until::Command => None,
        }
    }
}

/// A controller that runs behind real ports.
pub(crate) struct Live {
    /// The controller itself, if it ends with the debugger.
    emulator: Option<Emulator>,
    /// Whether it is left to others without the debugger.
    goes_on_alone: bool,
    /// Whether somebody else has paused it, and nobody has let it go on since.
    stays_paused: Arc<AtomicBool>,
    control: Control,
    reports: Option<Reports>,
    /// Where in the history it is.
    place: Place,
    /// How far it has been on each branch that it has left.
    lived: Lived,
    /// Its breakpoints while it runs.
    set: Vec<vimc4::BreakpointId>,
    /// In whose names those pause it.
    stops: Vec<Source>,
    /// From where it was let go, while it runs.
    running_from: Option<Place>,
    /// Until when, and the breakpoint that waits for a command.
    until: Until,
    awaited: Option<BreakpointId>,
    notes: Vec<Note>,
}

/// Notifies that reports have come.
struct Rung {
    tap: Tap,
    ring: Ring,
}

impl Sink for Rung {
    fn wants(&self) -> EventFilter {
        self.tap.wants()
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        self.tap.report(report, explain);
        (self.ring)();
    }

    fn has_enough(&self) -> bool {
        self.tap.has_enough()
    }
}

impl Live {
    /// Pauses a controller and begins to follow it, with a debugger that stands where it is. It ends with
    /// the debugger.
    pub(crate) fn of(emulator: Emulator, ring: Option<Ring>) -> Result<(Live, Debugger), Failed> {
        let (mut live, debugger) = Live::with(emulator.control(), "the console", ring, |_| None)?;
        (live.emulator, live.goes_on_alone) = (Some(emulator), false);
        Ok((live, debugger))
    }

    /// The same with a controller that runs for others, on behalf of a client of this name.
    /// Afterwards it goes on. `past` gives its history, if that is known.
    pub(crate) fn with(
        control: &Control,
        who: &str,
        ring: Option<Ring>,
        past: impl FnOnce(&Wired) -> Option<History<Wired>>,
    ) -> Result<(Live, Debugger), Failed> {
        let control = control.by(who);
        let stays_paused = control.paused().wait().map_err(failed)?.is_some();
        control.pause().wait().map_err(failed)?;
        let wants = EventFilter { inputs: true, sent: false, kinds: Kinds::NONE };
        let (tap, reports) = Reports::new(wants, WAITING);
        let watching = match ring {
            Some(ring) => control.watch(Rung { tap, ring }),
            None => control.watch(tap),
        };
        watching.wait().map_err(failed)?;
        let line = control.controller().wait().map_err(failed)?;
        let past = past(&line);
        let is_remembered = past.is_some();
        let mut debugger = Debugger::over(past.unwrap_or_else(|| History::new(line)));
        let (place, lived) = (debugger.place(), Lived::all(debugger.history()));
        let mut live = Live {
            emulator: None,
            goes_on_alone: true,
            stays_paused: Arc::new(stays_paused.into()),
            control,
            reports: Some(reports),
            place,
            lived,
            set: Vec::new(),
            stops: Vec::new(),
            running_from: None,
            until: Until::Paused,
            awaited: None,
            notes: Vec::new(),
        };
        if is_remembered {
            live.place = live.join(&mut debugger)?;
        }
        Ok((live, debugger))
    }

    /// The controller, if it is to be ended with the debugger.
    pub(crate) fn into_emulator(mut self) -> Option<Emulator> {
        self.emulator.take()
    }

    pub(crate) fn control(&self) -> &Control {
        &self.control
    }

    pub(crate) fn is_running(&self) -> bool {
        self.running_from.is_some()
    }

    /// Whether it stays paused without the debugger. Others may want that at any time.
    #[cfg(feature = "api")]
    pub(crate) fn stays_paused(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stays_paused)
    }

    fn goes_on_with_others(&self) {
        self.stays_paused.store(false, Ordering::Relaxed);
    }

    // --- while time is paused ---

    /// Does something with the debugger. What has come for the controller is heard before, if that
    /// goes forward; where it has led forward from the controller, or a branch has begun there that
    /// is meant for it, the controller is led there afterwards. Returns whether that was completed:
    /// if not, the debugger stands where the controller was led to.
    pub(crate) fn during<T>(
        &mut self,
        debugger: &mut Debugger,
        goes_forward: bool,
        is_meant: bool,
        progress: &mut Progress<'_>,
        deed: impl FnOnce(&mut Debugger, &mut Progress<'_>) -> T,
    ) -> Result<(T, bool), Failed> {
        if goes_forward {
            self.hear(debugger)?;
        }
        let was_here = self.is_here(debugger);
        let branches = debugger.history().branches().count();
        let done = deed(debugger, progress);
        let has_parted = debugger.history().branches().count() > branches;
        let arrived = self.lead(debugger, was_here && has_parted && is_meant, progress)?;
        Ok((done, arrived))
    }

    /// Takes in what clients have sent meanwhile, so that steps find it. They see the answers to that at
    /// once, if they come at once.
    fn hear(&mut self, debugger: &mut Debugger) -> Result<(), Failed> {
        if debugger.place() != self.place {
            return Ok(());
        }
        self.forget_reports();
        if self.control.hear(usize::MAX).wait().map_err(failed)? == 0 {
            return Ok(());
        }
        loop {
            let line = self.control.controller().wait().map_err(failed)?;
            if line.wake().is_none_or(|due| due > line.now()) {
                break;
            }
            self.control.step().wait().map_err(failed)?;
        }
        let present = debugger.place();
        while let Some(report) = self.reports.as_mut().and_then(Reports::take) {
            follow(debugger, &report);
        }
        self.place = self.join(debugger)?;
        debugger.history_mut().go_back_to(present);
        Ok(())
    }

    /// Takes in what others have done to the controller, whose time is to be paused all the while. The
    /// debugger keeps looking where it looks; one that looks at the controller itself goes along.
    #[cfg(feature = "api")]
    pub(crate) fn catch_up(&mut self, debugger: &mut Debugger) -> Result<(), Failed> {
        if self.control.paused().wait().map_err(failed)?.is_none() {
            self.goes_on_with_others();
            self.control.pause().wait().map_err(failed)?;
        }
        let mut news = Vec::new();
        while let Some(report) = self.reports.as_mut().and_then(Reports::take) {
            let is_done = matches!(
                report.what,
                ReportKind::Input { .. } | ReportKind::State { by: Some(_), .. }
            );
            news.extend(is_done.then_some(report));
        }
        let now = self.control.now().wait().map_err(failed)?;
        if news.is_empty() && now == self.place.moment.at {
            return Ok(());
        }
        let (looked_at, heading) = (debugger.place(), debugger.history().heading());
        let was_here = self.is_here(debugger);
        debugger.history_mut().go_to(self.place);
        for report in &news {
            follow(debugger, report);
        }
        self.place = self.join(debugger)?;
        if !was_here {
            let history = debugger.history_mut();
            history.go_to_end(heading);
            history.go_back_to(looked_at);
            history.drain();
        }
        Ok(())
    }

    /// Whether its time waits. Somebody else may have let it go on.
    #[cfg(feature = "api")]
    pub(crate) fn is_paused(&self) -> Result<bool, Failed> {
        Ok(self.control.paused().wait().map_err(failed)?.is_some())
    }

    /// The controller gets what was sent to it in the debugger and is still on its way.
    #[cfg(feature = "api")]
    pub(crate) fn deliver(&self, debugger: &Debugger) {
        let Place { branch, moment } = self.place;
        let given = debugger.history().inputs(branch, moment.inputs);
        let mut given_before = usize::try_from(moment.bytes).unwrap_or_default();
        for TimedInput { input, .. } in given.take_while(|given| given.at <= moment.at) {
            let rest = match input.as_input() {
                Input::Bytes(bytes) => {
                    let rest = bytes.get(given_before..).unwrap_or_default();
                    (!rest.is_empty()).then(|| OwnedInput::from(Input::Bytes(rest)))
                }
                _ => Some(input),
            };
            given_before = 0;
            rest.into_iter().for_each(|input| drop(self.control.inject(input)));
        }
    }

    /// Where the controller is.
    #[cfg(feature = "api")]
    pub(crate) fn place(&self) -> Place {
        self.place
    }

    /// Brings the controller to where the debugger has gone forward from it, act by act, so that
    /// clients get the answers. Where it has gone anywhere else the controller stays; a branch is
    /// followed only if it has just begun where the controller is. Returns whether it has arrived:
    /// if not, it was cancelled, and the debugger stands where the controller is by then.
    fn lead(
        &mut self,
        debugger: &mut Debugger,
        has_begun_here: bool,
        progress: &mut Progress<'_>,
    ) -> Result<bool, Failed> {
        let here = debugger.place();
        let heading = debugger.history().heading();
        let is_ahead = here != self.place && is_on_way(debugger.history(), self.place, here);
        if !is_ahead || (here.branch != self.place.branch && !has_begun_here) {
            return Ok(true);
        }
        let history = debugger.history_mut();
        history.go_to_end(heading);
        history.go_back_to(self.place);
        let mut end = here;
        let mut acts = 0_u32;
        while !is_there(debugger.history(), here) {
            acts += 1;
            if acts.is_multiple_of(PATIENCE) && progress(debugger.now()).is_break() {
                end = debugger.place();
                break;
            }
            let history = debugger.history_mut();
            let mut done = None;
            // Not beyond the target moment.
            let found = history.find_next(here.moment.at, |_, act, _| {
                done = Some(act);
                true
            });
            if !found || after(debugger.history(), here) {
                break;
            }
            let input = match done {
                Some(Act::Byte(byte)) => Some(OwnedInput::from(Input::Bytes(&[byte]))),
                Some(Act::Input) => {
                    let Place { branch, moment } = debugger.place();
                    let number = moment.inputs.saturating_sub(1);
                    debugger.history().inputs(branch, number).next().map(|given| given.input)
                }
                _ => None,
            };
            match input {
                Some(input) => {
                    self.control.wait_until(debugger.now()).wait().map_err(failed)?;
                    self.control.inject(input).wait().map_err(failed)?;
                }
                // Where a breakpoint of somebody else is met on the way, only time has passed.
                None => while self.control.step().wait().map_err(failed)? == Step::Time {},
            }
        }
        debugger.history_mut().go_to_end(heading);
        debugger.history_mut().go_back_to(end);
        debugger.history_mut().drain();
        self.control.wait_until(end.moment.at).wait().map_err(failed)?;
        self.put_state(debugger)?;
        self.place = end;
        self.forget_reports();
        Ok(end == here)
    }

    fn state(&self) -> Result<LineState<State>, Failed> {
        Ok(self.control.controller().wait().map_err(failed)?.state())
    }

    /// Puts the controller into the state that the debugger looks at, if it is in another.
    fn put_state(&self, debugger: &mut Debugger) -> Result<(), Failed> {
        let state = debugger.line().state();
        if self.state()? != state {
            self.control.put(state).wait().map_err(failed)?;
            debugger.history_mut().leave(self.place);
        }
        Ok(())
    }

    /// What the console itself has done is in the history already.
    fn forget_reports(&mut self) {
        while self.reports.as_mut().and_then(Reports::take).is_some() {}
    }

    /// Goes in the history to where the controller is.
    fn join(&self, debugger: &mut Debugger) -> Result<Place, Failed> {
        let state = self.state()?;
        let at = self.control.now().wait().map_err(failed)?;
        let history = debugger.history_mut();
        history.run_to(Time::from_nanos(at.as_nanos().saturating_sub(1)));
        while history.device().state() != state && history.find_next(at, |_, _, _| true) {}
        if history.device().state() != state {
            history.run_to(at);
        }
        if history.device().state() != state {
            // Something was done to it that no input shows.
            history.put_back("as it was found", state);
        }
        history.drain();
        Ok(history.present())
    }

    /// Whether the debugger looks at the controller itself.
    pub(crate) fn is_here(&self, debugger: &Debugger) -> bool {
        debugger.place() == self.place
    }

    /// How the debugger goes on to the controller, if it does: to where that is. A branch without
    /// the controller never leads to it.
    fn ahead(&self, debugger: &Debugger) -> Option<Place> {
        let history = debugger.history();
        let is_ahead = history.heading() == self.place.branch
            && is_on_way(history, debugger.place(), self.place);
        is_ahead.then_some(self.place)
    }

    /// Whether the debugger goes on to the controller.
    pub(crate) fn is_ahead(&self, debugger: &Debugger) -> bool {
        self.ahead(debugger).is_some()
    }

    /// Where the controller itself is, if the debugger is elsewhere.
    pub(crate) fn elsewhere(&self, debugger: &Debugger) -> Option<String> {
        past::elsewhere(debugger, self.place)
    }

    /// Takes the controller itself to where the debugger is, and says what came of it. It is put to where it
    /// has been last on the way there, of which clients get nothing again, and led on from that, so that
    /// they get what they have not had. What was recorded after it does not come again.
    pub(crate) fn take(
        &mut self,
        debugger: &mut Debugger,
        progress: &mut Progress<'_>,
    ) -> Result<String, Failed> {
        if self.is_here(debugger) {
            return Ok("the controller is here already".to_owned());
        }
        let history = debugger.history_mut();
        if history.is_at_end() {
            // What was just given takes effect now.
            let now = history.now();
            history.run_to(now);
            history.drain();
        }
        let (here, heading) = (history.present(), history.heading());
        self.lived.came_to(history, self.place);
        let known = self.lived.last_on_way(history, here);
        if known != here {
            history.go_to(known);
            self.put_state(debugger)?;
            self.place = known;
            debugger.history_mut().go_to_end(heading);
            debugger.history_mut().go_back_to(here);
            debugger.history_mut().drain();
            self.lead(debugger, true, progress)?;
        }
        self.put_here(debugger)?;
        self.forget_reports();
        self.goes_on_with_others();
        Ok(past::taken(debugger, self.place))
    }

    /// Puts the controller to where the debugger is, on a branch of its own if something else follows
    /// there.
    fn put_here(&mut self, debugger: &mut Debugger) -> Result<(), Failed> {
        past::go_on_from_here(debugger.history_mut());
        self.put_state(debugger)?;
        self.place = debugger.place();
        Ok(())
    }

    // --- while time goes on ---

    /// Goes through what is recorded to where the controller is, and lets that go on; does not wait for
    /// it. If the debugger has stopped before, or looks at something that the controller is not a part of,
    /// nothing runs, and where it has stopped is returned.
    pub(crate) fn let_go(
        &mut self,
        debugger: &mut Debugger,
        until: Until,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Stop>, Failed> {
        if !self.is_here(debugger) {
            let ahead = self.ahead(debugger);
            let end = ahead.map(|place| place.moment.at);
            let to = until.time().into_iter().chain(end).min();
            let stop = debugger.go(Way::Forward, to, progress);
            let is_early = until.time().is_some_and(|until| end.is_none_or(|end| until < end));
            let has_stopped = matches!(stop.why, Reason::Breakpoints(_) | Reason::Cancelled);
            let Some(place) = ahead.filter(|_| !is_early && !has_stopped) else {
                return Ok(Some(stop));
            };
            debugger.history_mut().go_back_to(place);
        }
        let history = debugger.history_mut();
        if history.is_at_end() {
            let now = history.now();
            history.run_to(now);
            if !self.lead(debugger, false, progress)? {
                return Ok(Some(cancelled(debugger)));
            }
        } else {
            // What was recorded after the present does not come again by itself.
            self.put_here(debugger)?;
        }
        self.notes.clear();
        self.until = until;
        if until == Until::Command {
            let trigger = Trigger::Condition(Condition::Command { like: None });
            self.awaited = Some(debugger.await_trigger(trigger));
        }
        self.heed(debugger)?;
        self.goes_on()?;
        Ok(None)
    }

    /// Time goes on.
    fn goes_on(&mut self) -> Result<(), Failed> {
        self.running_from = Some(self.place);
        self.goes_on_with_others();
        self.forget_reports();
        self.control.resume().wait().map_err(failed)?;
        Ok(())
    }

    /// Has the controller paused by the breakpoints that the debugger has now, and no others.
    pub(crate) fn heed(&mut self, debugger: &Debugger) -> Result<(), Failed> {
        let enabled = debugger.breakpoints().iter().filter(|breakpoint| breakpoint.is_enabled);
        let stop = |breakpoint: &Breakpoint| {
            let by = match self.awaited == Some(breakpoint.id) {
                true => DEBUGGER.to_owned(),
                false => format!("breakpoint {} of {DEBUGGER}", breakpoint.id),
            };
            (pauses(breakpoint, debugger), by)
        };
        let mut stops: Vec<(Condition, String)> = enabled.map(stop).collect();
        let until = self.until.time().map(Condition::At);
        stops.extend(until.map(|until| (until, DEBUGGER.to_owned())));
        let before = std::mem::take(&mut self.set);
        self.stops.clear();
        for (condition, by) in stops {
            let by = Source::Controls(by.into());
            self.stops.push(by.clone());
            self.set.push(self.control.stop_when(condition, by).wait().map_err(failed)?);
        }
        self.heed_no_more(before)
    }

    fn heed_no_more(&self, set: Vec<vimc4::BreakpointId>) -> Result<(), Failed> {
        for breakpoint in set {
            self.control.remove_breakpoint(breakpoint).wait().map_err(failed)?;
        }
        Ok(())
    }

    /// Asks the running controller to pause; the next look shows it.
    pub(crate) fn pause(&self) {
        drop(self.control.pause());
    }

    /// Follows the running controller as far as it has come, and says where it has stopped, if it has.
    pub(crate) fn look(&mut self, debugger: &mut Debugger) -> Result<Option<Stop>, Failed> {
        while let Some(report) = self.reports.as_mut().and_then(Reports::take) {
            if is_pause(&report) {
                let Some(reports) = self.reports.take() else { return Ok(None) };
                match self.paused(debugger, reports, &report, &mut uninterrupted)? {
                    None => continue,
                    stop => return Ok(stop),
                }
            }
            if matches!(report.news(), Some(LineEvent::Ends)) {
                return Err("the controller has ended".to_owned());
            }
            follow(debugger, &report);
        }
        Ok(None)
    }

    /// The reports, for the code that waits for the end of the run. They are given back to
    /// [`paused`](Live::paused).
    pub(crate) fn take_reports(&mut self) -> Option<Reports> {
        self.reports.take()
    }

    /// Time is paused again: goes to where that is, and says why. Where no breakpoint of the debugger
    /// counts, time goes on and there is nothing to say yet.
    pub(crate) fn paused(
        &mut self,
        debugger: &mut Debugger,
        reports: Reports,
        pause: &Report,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Stop>, Failed> {
        self.reports = Some(reports);
        let set = std::mem::take(&mut self.set);
        self.heed_no_more(set)?;
        self.place = self.join(debugger)?;
        let from = self.running_from.take().unwrap_or(self.place);
        let at = debugger.now();
        debugger.history_mut().go_back_to(from);
        let mut stop = debugger.go(Way::Forward, Some(at), progress);
        self.notes.append(&mut stop.notes);
        let by_hand = matches!(
            pause.news(),
            Some(LineEvent::Paused { by: Some(by), .. }) if !self.stops.contains(by)
        );
        let is_time = self.until.time().is_some_and(|until| until <= at);
        if !matches!(stop.why, Reason::Breakpoints(_)) {
            debugger.history_mut().go_back_to(self.place);
            if !by_hand && !is_time {
                self.heed(debugger)?;
                self.goes_on()?;
                return Ok(None);
            }
            stop.why = if is_time { Reason::Time } else { Reason::Cancelled };
            (stop.place, stop.at) = (debugger.place(), debugger.now());
            stop.command = debugger.executing();
        }
        if let Some(awaited) = self.awaited.take() {
            debugger.remove_breakpoint(awaited);
            if let Reason::Breakpoints(met) = &mut stop.why {
                met.retain(|met| *met != awaited);
                if met.is_empty() {
                    stop.why = Reason::Step(Unit::Command);
                }
            }
        }
        stop.notes = std::mem::take(&mut self.notes);
        Ok(Some(stop))
    }

    /// Something is done to the controller while it runs, in the words that `serve` knows.
    pub(crate) fn order(&self, line: &str) -> Result<(), Failed> {
        let names = self.control.names().wait().map_err(failed)?;
        match Order::read(line, &names).map_err(failed)? {
            Some(order) => {
                // What it does is seen.
                drop(self.control.give(&order));
                Ok(())
            }
            None => Ok(()),
        }
    }
}

impl Drop for Live {
    /// A controller that runs for others goes on undisturbed, or stays paused as it was.
    fn drop(&mut self) {
        if self.goes_on_alone {
            for breakpoint in self.set.drain(..) {
                drop(self.control.remove_breakpoint(breakpoint));
            }
            if !self.stays_paused.load(Ordering::Relaxed) {
                drop(self.control.resume());
            }
        }
    }
}

/// The stop of a cancelled walk, where the debugger stands.
pub(crate) fn cancelled(debugger: &mut Debugger) -> Stop {
    Stop { why: Reason::Cancelled, ..debugger.here() }
}

/// Whether a report says that time is paused.
pub(crate) fn is_pause(report: &Report) -> bool {
    matches!(report.news(), Some(LineEvent::Paused { .. }))
}

/// Gives the history what the controller was given, and puts it into the states that it was put into.
pub(crate) fn follow(debugger: &mut Debugger, report: &Report) {
    let history = debugger.history_mut();
    match &report.what {
        ReportKind::Input { input, .. } => {
            history.run_to(report.at);
            history.give(input.as_input());
        }
        ReportKind::State { by: Some(by), state: written } => {
            history.run_to(report.at);
            history.leave(history.present());
            if let Some(state) = state(written) {
                history.put_back(format!("put back by {by}"), state);
            }
        }
        _ => return,
    }
    history.drain();
}

/// The state of a controller and its line, as it is reported.
pub(crate) fn state(written: &Value) -> Option<LineState<State>> {
    serde_json::from_value(written.clone()).ok()
}

/// When a running controller has to be paused for a breakpoint: when its condition becomes so, or
/// whenever something happens, where only the debugger knows what it waits for.
fn pauses(breakpoint: &Breakpoint, debugger: &Debugger) -> Condition {
    if let Trigger::Condition(condition) = &breakpoint.trigger {
        return condition.clone();
    }
    let signals = debugger.device().signals();
    let mut any = vec![
        Condition::Command { like: None },
        Condition::Answered { like: None },
        Condition::Line { line: None },
    ];
    let change =
        |signal: vimc4_device::Signal| Condition::SignalChanges { signal: signal.id, to: None };
    any.extend(signals.into_iter().map(change));
    Condition::Any(any)
}

/// Whether everything has happened that happens on the way to a place. A branch begins where another
/// was left.
fn is_there<D: Device>(history: &History<D>, place: Place) -> bool {
    let counts = |moment: Moment| (moment.inputs, moment.bytes, moment.causes);
    let (present, way) = (history.present(), way(history, place));
    let is_begin = counts(place.moment) == (0, 0, 0);
    let same = way.iter().take(if is_begin { 2 } else { 1 });
    same.into_iter()
        .any(|same| same.branch == present.branch && counts(same.moment) == counts(present.moment))
}

/// Whether the present has gone beyond a place.
fn after<D: Device>(history: &History<D>, place: Place) -> bool {
    let present = history.present();
    present.branch == place.branch && present.moment > place.moment
}

fn failed(error: impl ToString) -> Failed {
    error.to_string()
}
