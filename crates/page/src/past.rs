//! The debugger, and the past: what is looked at while the controller waits.

use bytes::Bytes;
use serde_json::{Value, json};
use vimc4_answers::feed::Feed;
use vimc4_answers::fields::{bytes_of, no_such};
use vimc4_answers::limits::HISTORY;
use vimc4_answers::past::{
    self, DEBUGGER_REMEDY, Goal, has_come_to, is_on_way, look_ahead, part_from_what_happened,
};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::seen;
use vimc4_control::Effect;
use vimc4_debug::{Answer as Said, Debugger, Directive};
use vimc4_device::{Device, Order, OwnedInput, Time, escape, show_nanos};
use vimc4_timeline::{Act, Place};

use crate::acts::page;
use crate::desk::{Answer, Call, Desk, Outcome, Served};

/// Somebody looks at the past; the controller's time stands still.
#[derive(Debug)]
pub(crate) struct Looks {
    /// Where the controller itself is.
    live: Place,
    /// Where was looked while something was done to the controller itself.
    away: Option<Place>,
}

impl Served {
    fn debugger(&mut self) -> &mut Debugger {
        &mut self.live.line.device_mut().debugger
    }

    /// Opens the debugger, if it is not open.
    fn look(&mut self) {
        if self.looks.is_none() {
            self.live.pause(page());
            let live = self.debugger().place();
            self.looks = Some(Looks { live, away: None });
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

    /// Lets the controller go on. Returns whether the debugger was open.
    fn leave(&mut self, moment: u64) -> bool {
        self.leave_the_past();
        if self.looks.take().is_none() {
            return false;
        }
        // Somebody may have let it go on already.
        let _ = self.live.resume(moment, &page());
        true
    }

    /// The controller itself follows to where the debugger has gone forward from it, so that what happens
    /// on the way is told.
    fn lead(&mut self, is_meant: bool) {
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
        let mut led = Vec::new();
        while !has_come_to(history.present(), here) {
            let mut done = None;
            history.find_next(here.moment.at, |_, act, outputs| {
                done = Some((act, outputs.iter().cloned().collect()));
                true
            });
            let Some((act, outputs)) = done else { break };
            let Place { branch, moment } = history.present();
            let input = match act {
                Act::Byte(byte) => Some(OwnedInput::Bytes(Bytes::copy_from_slice(&[byte]))),
                Act::Input => {
                    let given = history.inputs(branch, moment.inputs.saturating_sub(1)).next();
                    given.map(|given| given.input)
                }
                Act::Cause => None,
            };
            led.push((moment.at, input, outputs));
        }
        history.wait_until(here.moment.at);
        history.drain();
        let there = history.present();
        for (at, input, outputs) in led {
            self.live.was_led(at, input, outputs);
        }
        self.looks = Some(Looks { live: there, away: None });
    }

    /// Carries out a line of the debugger.
    fn carry_out(&mut self, line: &str) -> Result<String, String> {
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
            _ => {}
        }
        let known = Directive::named(word).map_or("", |directive| directive.name);
        let live = self.looks.as_ref().map(|looks| looks.live);
        let was_live = live == Some(self.debugger().place());
        let branches = self.debugger().history().branches().count();
        let mut left = PATIENCE;
        let mut progress = |_: Time| {
            left -= 1;
            match left {
                0 => std::ops::ControlFlow::Break(()),
                _ => std::ops::ControlFlow::Continue(()),
            }
        };
        let answer = self.debugger().execute(line, &mut progress).map_err(|why| why.to_string())?;
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
    fn elsewhere(&mut self) -> Option<String> {
        let live = self.looks.as_ref()?.live;
        let debugger = self.debugger();
        if debugger.place() == live {
            return None;
        }
        let place = shown(debugger, live);
        Some(format!(
            "this is only looked at: the controller itself stays at {place}; `take` takes it here"
        ))
    }

    /// Takes the controller itself to where the debugger is, on a branch of its own if something else
    /// follows there.
    fn take(&mut self) -> String {
        let Some(Looks { live, .. }) = self.looks else { return String::new() };
        let debugger = self.debugger();
        if debugger.place() == live {
            return "the controller is here already".to_owned();
        }
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
                let name = format!("from {}", show_nanos(present.moment.at.as_nanos()));
                let state = history.device().state();
                history.fork(name, state);
            }
        }
        history.drain();
        let here = debugger.place();
        self.looks = Some(Looks { live: here, away: None });
        self.live.is_elsewhere(live.moment.at, &page());
        let place = shown(self.debugger(), here);
        format!("the controller is at {place} now and goes on from there")
    }

    fn go(&mut self, goal: Goal) -> Result<(), String> {
        let Some(Looks { live, .. }) = self.looks else { return Ok(()) };
        match goal {
            Goal::Now => {
                let history = self.debugger().history_mut();
                history.go_to(live);
                history.drain();
            }
            Goal::End(branch) => past::look_at(self.debugger(), Some(branch), None)?,
            Goal::At(branch, at) => past::look_at(self.debugger(), branch, Some(at))?,
            Goal::Command(number) => drop(self.carry_out(&format!("goto command {number}"))?),
        }
        Ok(())
    }

    /// Does something at the moment that is looked at.
    fn do_there(&mut self, line: &str) -> Result<(), String> {
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
    fn history(&mut self) -> Value {
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

/// How often a walk of the debugger asks whether it is to go on, at most: then it stops where it stands.
const PATIENCE: u32 = 20_000;

fn shown(debugger: &Debugger, place: Place) -> String {
    let mut branches = debugger.history().branches();
    let name = branches.find(|branch| branch.id == place.branch).map(|branch| branch.name);
    let at = show_nanos(place.moment.at.as_nanos());
    format!("{at} on {}", name.unwrap_or_default())
}

fn wrong(wrong: String) -> Problem {
    let (detail, remedy) = wrong.split_once("; ").unwrap_or((&wrong, DEBUGGER_REMEDY));
    Problem::new(Kind::NotUnderstood, detail, remedy)
}

// --- the routes ---

pub(crate) fn debug(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.looked_at(call)?;
    served.look();
    let line = call.text("line");
    let text = served.carry_out(line).map_err(wrong)?;
    if Directive::named(line.trim()).is_some_and(|directive| directive.name == "quit") {
        served.leave(call.moment);
    }
    Answer::json(&json!({ "text": text }))
}

pub(crate) fn debugger_view(desk: &mut Desk, call: &Call) -> Outcome {
    let debugger = desk.looked_at(call)?.debugger();
    let view = debugger.device().view(debugger.now());
    Answer::json(&serde_json::to_value(view).unwrap_or_default())
}

pub(crate) fn hold_debugger(desk: &mut Desk, call: &Call) -> Outcome {
    // There is one client, and no connection that could end.
    desk.looked_at(call)?.look();
    Ok(Answer::Text(String::new()))
}

pub(crate) fn cancel_debugger(desk: &mut Desk, call: &Call) -> Outcome {
    // What it does is done before this is asked.
    was_open(desk.looked_at(call)?.looks.is_some())
}

pub(crate) fn close_debugger(desk: &mut Desk, call: &Call) -> Outcome {
    was_open(desk.looked_at(call)?.leave(call.moment))
}

fn was_open(was_open: bool) -> Outcome {
    Answer::json(&seen::effect(&match was_open {
        true => Effect::Something,
        false => Effect::Nothing { why: Some("it was not open") },
    }))
}

/// Does not open the debugger, which would pause the controller.
pub(crate) fn history(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.looked_at(call)?;
    if served.looks.is_some() {
        return Answer::json(&served.history());
    }
    let debugger = served.debugger();
    let (now, heading) = (debugger.now(), debugger.history().heading());
    let first = debugger.history().branches().next().map(|branch| branch.first.at);
    Answer::json(&json!({
        "open": false,
        "possible": true,
        "first": first,
        "at": now,
        "branch": heading,
        "now": { "branch": heading, "at": now },
        "branches": [],
    }))
}

pub(crate) fn go(desk: &mut Desk, call: &Call) -> Outcome {
    let number = |name: &str| call.body.get(name).and_then(Value::as_u64);
    if let Some((name, value)) = call.body.iter().find(|(name, _)| number(name).is_none()) {
        let detail = format!("`{name}` is not to be {value}");
        return Err(Problem::new(Kind::WrongRequest, detail, "send a number from 0 on"));
    }
    let several = ["at", "command", "entry"].into_iter().filter(|name| number(name).is_some());
    if several.count() > 1 {
        let detail = "a moment is named by one of at, command and entry";
        return Err(Problem::new(Kind::WrongRequest, detail, "send only one of them"));
    }
    let served = desk.looked_at(call)?;
    let goal = if let Some(command) = number("command") {
        Goal::Command(command)
    } else if let Some(entry) = number("entry") {
        let part = served.live.feed.after(entry.saturating_sub(1), 1);
        let item = part.items.first().filter(|item| item.number == entry);
        let item = item.ok_or_else(|| no_such("entry", &entry.to_string()))?;
        Goal::At(None, item.report.at)
    } else {
        match (number("branch"), number("at")) {
            (branch, Some(at)) => Goal::At(branch, Time::from_nanos(at)),
            (Some(branch), None) => Goal::End(branch),
            (None, None) => Goal::Now,
        }
    };
    served.look();
    served.go(goal).map_err(wrong)?;
    Answer::json(&served.history())
}

/// Whether the moment is looked at that whoever asks sees, as far as they say it.
fn is_seen(served: &mut Served, call: &Call) -> Result<(), Problem> {
    let history = served.debugger().history();
    let (at, branch) = (history.now().as_nanos(), u64::from(history.heading().0));
    let is = |name: &str, now: u64| {
        call.body.get(name).and_then(Value::as_u64).is_none_or(|seen| seen == now)
    };
    match is("at", at) && is("branch", branch) {
        true => Ok(()),
        false => Err(Problem::new(
            Kind::NotNow,
            format!("another moment is looked at by now: {at} ns on branch {branch}"),
            "look there, or GET the history, which tells it",
        )),
    }
}

pub(crate) fn do_there(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.looked_at(call)?;
    let line = match (call.body.get("order"), call.body.get("send")) {
        (Some(_), None) => {
            let text = call.text("order");
            match Order::read(text, &served.live.names)? {
                Some(Order::Do(_) | Order::Rule(_) | Order::Reset | Order::Erase) => {
                    text.to_owned()
                }
                _ => {
                    return Err(Problem::new(
                        Kind::NotUnderstood,
                        format!("`{text}` does nothing to the controller"),
                        "order something such as `press stop`; go to another time for what comes later",
                    ));
                }
            }
        }
        (None, Some(_)) => format!("sendraw {}", escape(&bytes_of(call.text("send"))?)),
        _ => {
            let detail = "what is to be done is an order, or bytes to send";
            return Err(Problem::new(Kind::WrongRequest, detail, "send one of order and send"));
        }
    };
    served.look();
    is_seen(served, call)?;
    served.do_there(&line).map_err(wrong)?;
    Answer::json(&served.history())
}

pub(crate) fn take(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.looked_at(call)?;
    served.look();
    is_seen(served, call)?;
    served.take();
    Answer::json(&served.history())
}

pub(crate) fn history_entries(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.looked_at(call)?;
    if served.looks.is_none() {
        let remedy = "POST to history/go, which opens it; the journal has what happened";
        return Err(Problem::new(Kind::NotNow, "the debugger is not open", remedy));
    }
    let branch = call.query.get("branch").and_then(|branch| branch.parse().ok());
    let feed = Feed::new(std::sync::Arc::new(|| {}));
    let before = past::happened(served.debugger(), branch, &mut feed.sink()).map_err(wrong)?;
    let part = feed.after(before, HISTORY);
    let names = &served.live.names;
    let entries: Vec<&str> = part.items.iter().map(|item| item.json(names)).collect();
    let (first, last) = (part.first.max(before + 1), part.last);
    Ok(Answer::Json(format!(
        r#"{{"first":{first},"last":{last},"next":{last},"entries":[{}]}}"#,
        entries.join(",")
    )))
}
