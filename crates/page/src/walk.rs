//! A walk through the past of a controller, which waits meanwhile.

use std::ops::ControlFlow;

use serde_json::Value;
use vimc4_answers::past::{
    self, Goal, go_on_from_here, has_come_to, is_on_way, look_ahead, part_from_what_happened,
};
use vimc4_debug::{Answer as Said, Debugger, Directive};
use vimc4_device::{Device, Time};
use vimc4_timeline::Place;

use crate::live::{Live, page};
use crate::looks::Looks;
use crate::served::Served;

/// How often a walk of the debugger asks whether it is to go on, at most: then it stops where it stands.
const PATIENCE: u32 = 20_000;

/// Goes on as long as somebody may wait for it.
fn patience() -> impl FnMut(Time) -> ControlFlow<()> {
    let mut left = PATIENCE;
    move |_| {
        left = left.saturating_sub(1);
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Served {
    pub(crate) fn debugger(&mut self) -> &mut Debugger {
        &mut self.live.session.device_mut().debugger
    }

    /// Opens the debugger, if it is not open.
    pub(crate) fn look(&mut self) {
        if self.looks.is_none() {
            let stays_paused = self.live.session.paused().is_some();
            self.live.pause();
            let live = self.debugger().place();
            self.looks = Some(Looks { live, away: None, stays_paused });
        }
    }

    /// Goes to where the controller itself is, until [`back`](Served::back).
    pub(crate) fn leave_the_past(&mut self) {
        let here = self.debugger().place();
        if let Some(looks) = &mut self.looks
            && looks.away.is_none()
        {
            looks.away = Some(here);
            let live = looks.live;
            if live != here {
                self.debugger().history_mut().go_to(live);
            }
        }
    }

    /// Goes back to where was looked. Whoever looked at the controller itself goes along with it.
    pub(crate) fn back(&mut self) {
        let here = self.debugger().place();
        let Some(looks) = &mut self.looks else { return };
        let Some(away) = looks.away.take() else { return };
        let was_live = away == looks.live;
        looks.live = here;
        if !was_live {
            let history = self.debugger().history_mut();
            history.go_to_end(away.branch);
            history.go_back_to(away);
            history.drain();
        }
    }

    /// The controller itself is here now.
    fn is_led_to(&mut self, live: Place) {
        if let Some(looks) = &mut self.looks {
            (looks.live, looks.away) = (live, None);
        }
    }

    /// Whether the controller stays paused when the debugger is closed.
    pub(crate) fn stays_paused(&mut self, stays: bool) {
        if let Some(looks) = &mut self.looks {
            looks.stays_paused = stays;
        }
    }

    /// Lets the controller go on. Returns whether the debugger was open.
    pub(crate) fn leave(&mut self, moment: u64) -> bool {
        self.leave_the_past();
        let Some(Looks { stays_paused, .. }) = self.looks.take() else { return false };
        if !stays_paused {
            // Somebody may have let it go on already.
            let _ = self.live.request(moment, |session, wall| session.resume(wall, &page()));
        }
        true
    }

    /// The controller itself follows to where the debugger has gone forward from it, so that what happens
    /// on the way is told.
    pub(crate) fn lead(&mut self, is_meant: bool) {
        let Some(Looks { live, .. }) = self.looks else { return };
        let debugger = self.debugger();
        let (here, heading) = (debugger.place(), debugger.history().heading());
        let is_ahead = here != live && is_on_way(debugger.history(), live, here);
        if !is_ahead || (here.branch != live.branch && !is_meant) {
            return;
        }
        let history = debugger.history_mut();
        history.go_to_end(heading);
        history.go_back_to(live);
        while !has_come_to(self.debugger().place(), here) && self.live.follow(here.moment.at) {}
        self.live.arrive(here.moment.at);
        let there = self.debugger().place();
        self.is_led_to(there);
    }

    /// Carries out a line of the debugger.
    pub(crate) fn carry_out(&mut self, line: &str) -> Result<String, String> {
        let (word, rest) = line.trim().split_once(char::is_whitespace).unwrap_or((line.trim(), ""));
        match (word, rest.trim()) {
            ("screen" | "picture" | "source", _) => {
                return Err(format!("`{line}` is for a terminal; `vimc4 console` has one"));
            }
            ("controller", _) => {
                let remedy = "ask /v1/controllers/2/debugger for the second";
                return Err(format!("the address says which controller it is; {remedy}"));
            }
            ("take", "") => return Ok(self.take()),
            ("take", rest) => {
                return Err(format!("nothing follows `take`, and here does `{rest}`"));
            }
            _ => {}
        }
        let known = Directive::named(word).map_or("", |directive| directive.name);
        let live = self.looks.as_ref().map(|looks| looks.live);
        let was_live = live == Some(self.debugger().place());
        let branches = self.debugger().history().branches().count();
        let answer = self.debugger().execute(line, &mut patience());
        let answer = answer.map_err(|why| why.to_string())?;
        let has_parted = self.debugger().history().branches().count() > branches;
        if let Said::Quit = answer {
            return Ok(String::new());
        }
        // What would come is looked at; what is done to the controller is done to it.
        self.lead(was_live && has_parted && known != "what");
        let mut said = answer.to_string();
        if has_parted && let Some(elsewhere) = self.elsewhere() {
            if !said.is_empty() {
                said.push('\n');
            }
            said.push_str(&elsewhere);
        }
        Ok(said)
    }

    /// Where the controller itself is, if something else is looked at.
    pub(crate) fn elsewhere(&mut self) -> Option<String> {
        let live = self.looks.as_ref()?.live;
        past::elsewhere(self.debugger(), live)
    }

    /// Takes the controller itself to where the debugger is, on a branch of its own if something else
    /// follows there: to where it has been last on the way, and on from that.
    pub(crate) fn take(&mut self) -> String {
        let Some(Looks { live, .. }) = self.looks else { return String::new() };
        if self.debugger().place() == live {
            return "the controller is here already".to_owned();
        }
        let Served { live: Live { session, .. }, lived, .. } = self;
        let history = session.device_mut().debugger.history_mut();
        if history.is_at_end() {
            // What was just given takes effect now.
            let now = history.now();
            history.run_to(now);
        }
        let (here, heading) = (history.present(), history.heading());
        lived.came_to(history, live);
        let known = lived.last_on_way(history, here);
        history.go_to(known);
        history.drain();
        self.is_led_to(known);
        self.stays_paused(false);
        if known != live {
            self.debugger().history_mut().leave(live);
            self.live.is_elsewhere(live.moment.at, &page());
        }
        let history = self.debugger().history_mut();
        history.go_to_end(heading);
        history.go_back_to(here);
        history.drain();
        // What clients have not had of the way there they get now.
        self.lead(true);
        go_on_from_here(self.debugger().history_mut());
        let here = self.debugger().place();
        self.is_led_to(here);
        past::taken(self.debugger(), here)
    }

    pub(crate) fn go(&mut self, goal: Goal) -> Result<(), String> {
        let Some(Looks { live, .. }) = self.looks else { return Ok(()) };
        match goal {
            Goal::Now => {
                let history = self.debugger().history_mut();
                history.go_to(live);
                history.drain();
            }
            Goal::End(branch) => past::look_at(self.debugger(), Some(branch), None)?,
            Goal::At(branch, at) => past::look_at(self.debugger(), branch, Some(at))?,
            Goal::Entry(entry) => past::look_at_entry(self.debugger(), live, &entry)?,
            Goal::Command(number) => {
                past::look_at_command(self.debugger(), number, &mut patience())?;
            }
        }
        Ok(())
    }

    /// Does something at the moment that is looked at.
    pub(crate) fn do_there(&mut self, line: &str) -> Result<(), String> {
        let Some(Looks { live, .. }) = self.looks else { return Ok(()) };
        part_from_what_happened(self.debugger(), live);
        let was_live = self.debugger().place() == live;
        self.carry_out(line)?;
        // It takes effect at once, at the controller too if that is looked at.
        let history = self.debugger().history_mut();
        let now = history.now();
        history.run_to(now);
        history.drain();
        self.lead(was_live);
        let live = self.looks.as_ref().map(|looks| looks.live.branch);
        if Some(self.debugger().place().branch) != live {
            look_ahead(self.debugger().history_mut(), || false);
        }
        Ok(())
    }

    /// The past, and the moment that is looked at.
    pub(crate) fn history(&mut self) -> Value {
        let Some(Looks { live, .. }) = self.looks else { return Value::Null };
        let debugger = self.debugger();
        let mut history = past::history(debugger, live);
        history["open"] = true.into();
        history["possible"] = true.into();
        let view = debugger.device().view(debugger.now());
        history["view"] = serde_json::to_value(view).unwrap_or_default();
        history
    }
}
