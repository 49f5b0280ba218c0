//! A controller that runs behind real ports, and the history that follows it.
//!
//! While somebody looks around the controller's time is paused; clients stay connected and notice
//! nothing but time. The history gets what the controller gets. Who goes forward in it leads the
//! controller there. Who goes back looks, and what is done there is a branch to be looked at: the
//! controller itself stays, until it is taken there.

use vimc4::{Control, Emulator, News, Order, Report, Reports, Wants, What};
use vimc4_catalogue::State;
use vimc4_debug::{Breakpoint, Debugger, Note, Reason, Stop, Trigger, Way};
use vimc4_device::{Condition, Device, Input, Kinds, OwnedInput, Time};
use vimc4_timeline::{Act, History, Moment, Place, Progress};

/// So many reports may wait while nobody looks at them.
const WAITING: usize = 1 << 20;

/// No way is led through act by act that has more of them: the controller is put to its end.
const LED: usize = 100_000;

/// Why the controller does not do what is wanted.
pub(crate) type Failed = String;

/// A controller that runs behind real ports.
pub(crate) struct Live {
    emulator: Emulator,
    control: Control,
    reports: Option<Reports>,
    /// Where in the history it is.
    place: Place,
    /// Its breakpoints while it runs.
    set: Vec<vimc4::BreakpointId>,
    /// From where it was let go, while it runs.
    running_from: Option<Place>,
    notes: Vec<Note>,
}

impl Live {
    /// Pauses the controller and begins to follow it, with a debugger that stands where it is.
    pub(crate) fn begin(emulator: Emulator) -> Result<(Live, Debugger), Failed> {
        let control = emulator.control().by("the console");
        control.pause().wait().map_err(failed)?;
        let wants = Wants { inputs: true, sent: false, kinds: Kinds::NONE };
        let (tap, reports) = Reports::new(wants, WAITING);
        control.watch(tap).wait().map_err(failed)?;
        let debugger = Debugger::new(control.controller().wait().map_err(failed)?.device().clone());
        let place = debugger.place();
        let live = Live {
            emulator,
            control,
            reports: Some(reports),
            place,
            set: Vec::new(),
            running_from: None,
            notes: Vec::new(),
        };
        Ok((live, debugger))
    }

    pub(crate) fn emulator(self) -> Emulator {
        self.emulator
    }

    pub(crate) fn control(&self) -> &Control {
        &self.control
    }

    pub(crate) fn is_running(&self) -> bool {
        self.running_from.is_some()
    }

    // --- while time is paused ---

    /// Takes in what clients have sent meanwhile, so that steps find it. They see the answers to that at
    /// once, if they come at once.
    pub(crate) fn hear(&mut self, debugger: &mut Debugger) -> Result<(), Failed> {
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

    /// Brings the controller to where the debugger has gone forward from it, act by act, so that clients
    /// get the answers. Where it has gone anywhere else the controller stays; a branch is followed only
    /// if it has just begun where the controller is.
    pub(crate) fn lead(
        &mut self,
        debugger: &mut Debugger,
        has_begun_here: bool,
    ) -> Result<(), Failed> {
        let here = debugger.place();
        let heading = debugger.history().heading();
        let is_ahead = here != self.place && is_on_way(debugger.history(), self.place, here);
        if !is_ahead || (here.branch != self.place.branch && !has_begun_here) {
            return Ok(());
        }
        let history = debugger.history_mut();
        history.go_to_end(heading);
        history.go_back_to(self.place);
        let mut acts = 0;
        while acts < LED && !is_there(debugger.history(), here) {
            acts += 1;
            let before = debugger.device().clone();
            let history = debugger.history_mut();
            // Not beyond the moment that is gone to.
            let end = here.moment.at;
            let mut done = None;
            let found = history.find_next(end, |_, act, _| {
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
                    let mut before = before;
                    if before.now() < debugger.now() {
                        before.accept(Input::Wake, debugger.now());
                        self.put(before.state())?;
                    }
                    self.control.inject(input).wait().map_err(failed)?;
                }
                None => _ = self.control.step().wait().map_err(failed)?,
            }
        }
        debugger.history_mut().go_to_end(heading);
        debugger.history_mut().go_back_to(here);
        debugger.history_mut().drain();
        let state = debugger.device().state();
        if self.state()? != state {
            self.put(state)?;
        }
        self.place = here;
        self.forget_reports();
        Ok(())
    }

    fn state(&self) -> Result<State, Failed> {
        Ok(self.control.controller().wait().map_err(failed)?.device().state())
    }

    fn put(&self, state: State) -> Result<(), Failed> {
        let mut line = self.control.controller().wait().map_err(failed)?.state();
        line.device = state;
        self.control.put(line).wait().map_err(failed)
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
            // Something was done to it that no input tells.
            history.fork("as it was found", state);
        }
        history.drain();
        Ok(history.present())
    }

    /// Whether the debugger looks at the controller itself.
    pub(crate) fn is_here(&self, debugger: &Debugger) -> bool {
        debugger.place() == self.place
    }

    /// How the debugger goes on to the controller, if it does: to where that is. On a branch on which
    /// the controller is not one can go on for ever and not come to it.
    pub(crate) fn ahead(&self, debugger: &Debugger) -> Option<Place> {
        let history = debugger.history();
        let is_ahead = history.heading() == self.place.branch
            && is_on_way(history, debugger.place(), self.place);
        is_ahead.then_some(self.place)
    }

    /// Where the controller is, for people.
    pub(crate) fn shown_place(&self, debugger: &Debugger) -> String {
        let mut branches = debugger.history().branches();
        let name = branches.find(|branch| branch.id == self.place.branch).map(|branch| branch.name);
        let at = vimc4_device::show_nanos(self.place.moment.at.as_nanos());
        format!("{at} on {}", name.unwrap_or_default())
    }

    /// Takes the controller itself to where the debugger is, and says whether it was elsewhere. Clients
    /// get nothing of the way there, and nothing of what was recorded behind it comes again.
    pub(crate) fn take(&mut self, debugger: &mut Debugger) -> Result<bool, Failed> {
        if self.is_here(debugger) {
            return Ok(false);
        }
        self.put_here(debugger)?;
        self.forget_reports();
        Ok(true)
    }

    /// Puts the controller to where the debugger is, on a branch of its own if something else follows
    /// there.
    fn put_here(&mut self, debugger: &mut Debugger) -> Result<(), Failed> {
        let history = debugger.history_mut();
        if history.is_at_end() {
            // What was just given takes effect now.
            let now = history.now();
            history.run_to(now);
        } else {
            let (present, heading) = (history.present(), history.heading());
            let is_new = history.inputs(heading, present.moment.inputs).next().is_some()
                || heading != present.branch;
            if is_new {
                let name =
                    format!("from {}", vimc4_device::show_nanos(present.moment.at.as_nanos()));
                let state = history.device().state();
                history.fork(name, state);
            }
        }
        history.drain();
        let state = debugger.device().state();
        if self.state()? != state {
            self.put(state)?;
        }
        self.place = debugger.place();
        Ok(())
    }

    // --- while time goes on ---

    /// Lets time go on from where the controller and the debugger are, for so long at most.
    pub(crate) fn go(
        &mut self,
        debugger: &mut Debugger,
        until: Option<Time>,
    ) -> Result<(), Failed> {
        let history = debugger.history_mut();
        if history.is_at_end() {
            let now = history.now();
            history.run_to(now);
            self.lead(debugger, false)?;
        } else {
            // What was recorded behind the present does not come again by itself.
            self.put_here(debugger)?;
        }
        self.running_from = Some(self.place);
        self.notes.clear();
        self.set_breakpoints(debugger, until)?;
        self.forget_reports();
        self.control.resume().wait().map_err(failed)?;
        Ok(())
    }

    fn set_breakpoints(&mut self, debugger: &Debugger, until: Option<Time>) -> Result<(), Failed> {
        let enabled = debugger.breakpoints().iter().filter(|breakpoint| breakpoint.is_enabled);
        let mut conditions: Vec<Condition> = enabled.map(|it| pauses(it, debugger)).collect();
        conditions.extend(until.map(Condition::At));
        for condition in conditions {
            self.set.push(self.control.break_when(condition).wait().map_err(failed)?);
        }
        Ok(())
    }

    /// The reports, for whoever waits for the end of the run. They are given back to
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
        until: Option<Time>,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Stop>, Failed> {
        self.reports = Some(reports);
        for breakpoint in self.set.drain(..) {
            self.control.remove_breakpoint(breakpoint).wait().map_err(failed)?;
        }
        self.place = self.join(debugger)?;
        let from = self.running_from.take().unwrap_or(self.place);
        let at = debugger.now();
        debugger.history_mut().go_back_to(from);
        let mut stop = debugger.go(Way::Forward, Some(at), progress);
        self.notes.append(&mut stop.notes);
        let by_hand = matches!(pause.news(), Some(News::Paused { by: Some(_), .. }));
        let is_time = until.is_some_and(|until| until <= at);
        if !matches!(stop.why, Reason::Breakpoints(_)) {
            debugger.history_mut().go_back_to(self.place);
            if !by_hand && !is_time {
                self.running_from = Some(self.place);
                self.set_breakpoints(debugger, until)?;
                self.forget_reports();
                self.control.resume().wait().map_err(failed)?;
                return Ok(None);
            }
            stop.why = if is_time { Reason::Time } else { Reason::Cancelled };
            (stop.place, stop.at) = (debugger.place(), debugger.now());
            stop.command = debugger.executing();
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

/// Whether a report says that time is paused.
pub(crate) fn is_pause(report: &Report) -> bool {
    matches!(report.news(), Some(News::Paused { .. }))
}

/// Gives the history what the controller was given.
pub(crate) fn follow(debugger: &mut Debugger, report: &Report) {
    if let What::Input { input, .. } = &report.what {
        let history = debugger.history_mut();
        history.run_to(report.at);
        history.give(input.as_input());
        history.drain();
    }
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

/// The moments by which one comes to a place, the latest first: one of each branch.
fn way<D: Device>(history: &History<D>, place: Place) -> Vec<Place> {
    let branches: Vec<_> = history.branches().collect();
    let mut way = vec![place];
    while let Some(last) = way.last()
        && let Some(branch) = branches.iter().find(|branch| branch.id == last.branch)
        && let Some(parted) = branch.parted
    {
        way.push(parted);
    }
    way
}

/// Whether one comes by a place on the way to another.
fn is_on_way<D: Device>(history: &History<D>, place: Place, to: Place) -> bool {
    way(history, to).iter().any(|on| on.branch == place.branch && place.moment <= on.moment)
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
