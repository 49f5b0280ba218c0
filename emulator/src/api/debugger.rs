//! The debugger behind the control API: a session of the console whose lines come by requests, with the
//! past of the controller since the server began.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::Value;
use vimc4::{Control, Report, ReportKind, Sink};
use vimc4_answers::past;
use vimc4_api::{Debugging, Goal, Memory, Past, Reined, Reins};
use vimc4_debug::{Wired, uninterrupted};
use vimc4_device::{Device, Kinds};
use vimc4_timeline::{History, Place};

use crate::console::cancel::Cancel;

use crate::console::session::{Outcome, Session, Wrong};
use crate::live::{Live, state};

/// Opens it on a controller.
pub(super) fn open(control: &Control, memory: &Memory) -> Result<Reined, String> {
    let cancel = Cancel::default();
    let past = |line: &Wired| remembered(line.clone(), &memory.past()?);
    let session = Session::beside(control, "the API", cancel.clone(), past);
    let mut session = session.map_err(|Wrong(why)| why)?;
    let progress = Arc::new(Mutex::new(String::new()));
    let shown = Arc::clone(&progress);
    session.show = Some(Arc::new(move |text: &str| {
        let mut shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
        text.clone_into(&mut shown);
    }));
    let stays_paused = session.live.as_ref().map(Live::stays_paused).unwrap_or_default();
    let outside = Outside { cancel, stays_paused, progress };
    Ok((Box::new(Console { session, is_over: false }), Arc::new(outside)))
}

/// What other threads have of it.
struct Outside {
    cancel: Cancel,
    stays_paused: Arc<AtomicBool>,
    /// How far a search has come; empty without one that takes long.
    progress: Arc<Mutex<String>>,
}

impl Reins for Outside {
    fn cancel(&self) {
        self.cancel.wish();
    }

    fn stay_paused(&self, stays: bool) {
        self.stays_paused.store(stays, Ordering::Relaxed);
    }

    fn progress(&self) -> String {
        let shown = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        // What ends it is a request here.
        shown.split(';').next().unwrap_or_default().to_owned()
    }
}

/// The history of a controller from its past.
fn remembered(mut line: Wired, past: &Past) -> Option<History<Wired>> {
    line.restore(state(&past.state)?);
    let mut history = History::new(line);
    // So that each part of it knows what can be found there.
    history.watch(Kinds::ALL);
    for Report { at, what, .. } in &past.since {
        match what {
            ReportKind::Input { input, .. } => {
                history.run_to(*at);
                history.give(input.as_input());
            }
            ReportKind::State { by, state: written } => {
                history.run_to(*at);
                history.leave(history.present());
                let by = by.as_ref().map_or_else(String::new, |by| format!(" by {by}"));
                history.put_back(format!("put back{by}"), state(written)?);
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
    fn history_mut(&mut self) -> &mut History<Wired> {
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
        Ok(past::history(&self.session.debugger, self.live_place()))
    }

    fn go(&mut self, goal: Goal) -> Result<(), String> {
        self.catch_up()?;
        match goal {
            Goal::Now => {
                let live = self.live_place();
                self.history_mut().go_to(live);
            }
            Goal::End(branch) => past::look_at(&mut self.session.debugger, Some(branch), None)?,
            Goal::At(branch, at) => past::look_at(&mut self.session.debugger, branch, Some(at))?,
            Goal::Entry(entry) => {
                let live = self.live_place();
                past::look_at_entry(&mut self.session.debugger, live, &entry)?;
            }
            Goal::Command(number) => {
                self.session.cancel.forget();
                let mut watched = self.session.watched_search();
                let debugger = &mut self.session.debugger;
                past::look_at_command(debugger, number, &mut |at| watched.goes_on(at))?;
            }
        }
        self.history_mut().drain();
        Ok(())
    }

    fn branch(&mut self, line: &str) -> Result<String, String> {
        self.catch_up()?;
        let live = self.live_place();
        past::part_from_what_happened(&mut self.session.debugger, live);
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
            let cancel = self.session.cancel.clone();
            past::look_ahead(self.history_mut(), || cancel.is_wished());
        }
        Ok(said)
    }

    fn happened(&mut self, branch: Option<u64>, sink: &mut dyn Sink) -> Result<u64, String> {
        self.look()?;
        past::happened(&mut self.session.debugger, branch, sink)
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
