//! The debugger behind the control API: a session of the console whose lines come by requests, with the
//! past of the controller since the server began.

use std::sync::Arc;

use serde_json::{Value, json};
use vimc4::{Control, Report, Sink, What};
use vimc4_api::{Debugging, Goal, Memory, Past};
use vimc4_catalogue::{Controller, State};
use vimc4_debug::uninterrupted;
use vimc4_device::{
    Device, Input, Kinds, LineState, Names, OwnedInput, SignalKind, escape, show_nanos,
};
use vimc4_timeline::{BranchId, History, Place};

use crate::console::session::{Cancel, Outcome, Session, Wrong};
use crate::live::way;
use crate::recording::page::{is_there, report};

/// So far ahead is worked out what would come of something that is done in the past.
const AHEAD: u64 = 60_000_000_000;

/// And no more than so many causes of it.
const CAUSES: usize = 200_000;

/// Opens it on a controller.
pub(super) fn open(
    control: &Control,
    memory: &Memory,
) -> Result<(Box<dyn Debugging>, vimc4_api::Cancel), String> {
    let cancel = Cancel::default();
    let past = |controller: &Controller| remembered(controller.clone(), &memory.past()?);
    let session = Session::beside(control, "the API", cancel.clone(), past);
    let session = session.map_err(|Wrong(why)| why)?;
    Ok((Box::new(Console { session, is_over: false }), Arc::new(move || cancel.wish())))
}

/// The history of a controller from its past.
fn remembered(mut controller: Controller, past: &Past) -> Option<History<Controller>> {
    let state = |written: &Value| -> Option<State> {
        serde_json::from_value::<LineState<State>>(written.clone()).ok().map(|line| line.device)
    };
    controller.restore(state(&past.state)?);
    let mut history = History::new(controller);
    // So that each part of it knows what can be found there.
    history.watch(Kinds::ALL);
    for Report { at, what, .. } in &past.since {
        match what {
            What::Input { input, .. } => {
                history.run_to(*at);
                history.give(input.as_input());
            }
            What::State { by, state: written } => {
                let now = history.now();
                history.run_to(now);
                let by = by.as_ref().map_or_else(String::new, |by| format!(" by {by}"));
                history.fork(format!("put back{by}"), state(written)?);
            }
            _ => {}
        }
        history.drain();
    }
    Some(history)
}

/// A session of the console whose lines come by requests.
struct Console {
    session: Session,
    is_over: bool,
}

impl Console {
    fn history_mut(&mut self) -> &mut History<Controller> {
        self.session.debugger.history_mut()
    }

    /// Where the controller itself is.
    fn live_place(&self) -> Place {
        let live = self.session.live.as_ref();
        live.map_or_else(|| self.session.debugger.place(), |live| live.place())
    }

    /// Takes in what others have done, if time waits for that: to be asked is no reason to stop it.
    fn look(&mut self) -> Result<(), String> {
        match &self.session.live {
            Some(live) if !live.is_paused()? => Ok(()),
            _ => self.catch_up(),
        }
    }

    fn catch_up(&mut self) -> Result<(), String> {
        let Session { live, debugger, .. } = &mut self.session;
        live.as_mut().map_or(Ok(()), |live| live.catch_up(debugger))
    }

    /// What is known of what comes after the present, worked out.
    fn look_ahead(&mut self) {
        let cancel = self.session.cancel.clone();
        let history = self.history_mut();
        let heading = history.heading();
        history.at_end(heading, |history| {
            let end = history.now().after_nanos(AHEAD);
            for _ in 0..CAUSES {
                if cancel.is_wished() || !history.find_next(end, |_, _, _| true) {
                    break;
                }
            }
        });
    }

    fn branch_of(&self, number: u64) -> Result<BranchId, String> {
        let mut branches = self.session.debugger.history().branches();
        let found = branches.find(|branch| u64::from(branch.id.0) == number);
        found.map(|branch| branch.id).ok_or_else(|| {
            let count = self.session.debugger.history().branches().count();
            format!("there is no branch {number}; their numbers are 0 to {}", count - 1)
        })
    }
}

impl Debugging for Console {
    fn carry_out(&mut self, line: &str) -> Result<String, String> {
        self.catch_up()?;
        match self.session.carry_out_once(line) {
            Ok(Outcome::Said(said)) => Ok(said),
            Ok(Outcome::Quit) => {
                self.is_over = true;
                Ok(String::new())
            }
            Ok(Outcome::Screen | Outcome::Picture(..) | Outcome::Source(_)) => {
                Err(format!("`{line}` is for a terminal; `vimc4 console` has one"))
            }
            Err(Wrong(wrong)) => Err(wrong),
        }
    }

    fn view(&self) -> Value {
        let (debugger, at) = (&self.session.debugger, self.session.debugger.now());
        serde_json::to_value(debugger.device().view(at)).unwrap_or_default()
    }

    fn history(&mut self) -> Result<Value, String> {
        self.look()?;
        let now = moment(self.live_place());
        let debugger = &self.session.debugger;
        let history = debugger.history();
        let branches = history.branches().map(|branch| {
            let first = history.inputs(branch.id, 0).next().filter(|_| branch.parted.is_some());
            json!({
                "id": branch.id,
                "name": branch.name,
                "why": first.map(|first| in_words(history.device(), debugger.names(), &first.input)),
                "parted": branch.parted.map(moment),
                "first": branch.first.at,
                "end": branch.end.at,
            })
        });
        Ok(json!({
            "first": history.branches().next().map(|branch| branch.first.at),
            "at": history.now(),
            "branch": history.heading(),
            "now": now,
            "branches": branches.collect::<Vec<_>>(),
        }))
    }

    fn go(&mut self, goal: Goal) -> Result<(), String> {
        self.catch_up()?;
        match goal {
            Goal::Now => {
                let live = self.live_place();
                self.history_mut().go_to(live);
            }
            Goal::End(branch) => {
                let branch = self.branch_of(branch)?;
                self.history_mut().go_to_end(branch);
            }
            Goal::At(branch, at) => {
                let looked_at = self.session.debugger.place();
                let heading = self.session.debugger.history().heading();
                let branch = branch.map_or(Ok(heading), |branch| self.branch_of(branch))?;
                let history = self.history_mut();
                history.go_to_end(branch);
                let end = history.now();
                if end < at {
                    history.go_to_end(heading);
                    history.go_back_to(looked_at);
                    history.drain();
                    return Err(format!(
                        "this branch ends at {} ns; look at a moment up to then, or at another branch",
                        end.as_nanos()
                    ));
                }
                self.session.debugger.go_back_to_time(at);
            }
            Goal::Command(number) => drop(self.carry_out(&format!("goto command {number}"))?),
        }
        self.history_mut().drain();
        Ok(())
    }

    fn branch(&mut self, line: &str) -> Result<String, String> {
        self.catch_up()?;
        let (looked_at, live) = (self.session.debugger.place(), self.live_place());
        let history = self.history_mut();
        let is_behind = looked_at.branch != live.branch
            && way(history, live).iter().any(|on| on.branch == looked_at.branch);
        if is_behind && history.is_at_end() {
            // What really happened ended here, and stays as it is.
            let state = history.device().state();
            history.fork(format!("from {}", show_nanos(looked_at.moment.at.as_nanos())), state);
        }
        let said = self.carry_out(line)?;
        let is_past = self.session.debugger.place().branch != self.live_place().branch;
        // It takes effect at once, at the controller too if that is looked at.
        if let Session { live: Some(live), debugger, .. } = &mut self.session {
            live.during(debugger, false, true, &mut uninterrupted, |debugger, _| {
                let now = debugger.now();
                debugger.history_mut().run_to(now);
            })?;
        }
        if is_past {
            self.look_ahead();
        }
        Ok(said)
    }

    fn happened(&mut self, branch: Option<u64>, sink: &mut dyn Sink) -> Result<u64, String> {
        self.look()?;
        let history = self.session.debugger.history();
        let branch =
            branch.map_or_else(|| Ok(history.heading()), |branch| self.branch_of(branch))?;
        let found = history.branches().find(|own| own.id == branch);
        let Some(found) = found else { return Ok(0) };
        let (first, end) = (found.first, Place { branch, moment: found.end });
        let history = self.history_mut();
        let (place, heading) = (history.present(), history.heading());
        history.go_to(Place { branch, moment: first });
        // A motion that was under way is told from its beginning.
        if history.device().running().is_some() {
            history.find_last(|device, _, _| device.running().is_none());
        }
        let (mut told, mut before) = (0, 0);
        while !is_there(history.present(), end)
            && history.find_next(end.moment.at, |device, _, outputs| {
                for output in outputs {
                    if let Some(report) = report(output) {
                        sink.report(&report, &|line| device.explain(line));
                        told += 1;
                    }
                }
                true
            })
        {
            if history.present().branch != branch {
                before = told;
            }
        }
        history.go_to_end(heading);
        history.go_back_to(place);
        history.drain();
        Ok(before)
    }

    fn is_over(&self) -> bool {
        self.is_over
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        let Session { live, debugger, .. } = &self.session;
        if let Some(live) = live {
            live.deliver(debugger);
        }
    }
}

/// A place as the API has it.
fn moment(Place { branch, moment }: Place) -> Value {
    json!({ "branch": branch, "at": moment.at })
}

/// What was done, for people.
fn in_words(device: &Controller, names: &Names, input: &OwnedInput) -> String {
    match input.as_input() {
        Input::Bytes(bytes) => {
            let line = bytes.trim_ascii();
            format!("{}  {}", escape(line), device.explain(line)).trim().to_owned()
        }
        Input::Signal(id, value) => {
            let Some(signal) = names.signals().iter().find(|signal| signal.id == id) else {
                return String::new();
            };
            let name = &signal.name;
            match signal.kind {
                SignalKind::Button if value == 0 => format!("{name} released"),
                SignalKind::Button => format!("{name} pressed"),
                _ => format!("{name} {value}"),
            }
        }
        Input::Power(on) => format!("power {}", if on { "on" } else { "off" }),
        Input::Fault(_) => "a fault".to_owned(),
        Input::Rule(_) => "a scenario".to_owned(),
        Input::Wake => String::new(),
    }
}
