//! What the routes of the debugger, of the past and of other states do.

use serde_json::{Value, json};
use vimc4_answers::feed::Feed;
use vimc4_answers::fields::{bytes_of, no_such};
use vimc4_answers::limits::HISTORY;
use vimc4_answers::past::{self, DEBUGGER_REMEDY, Goal};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_catalogue::Controller;
use vimc4_control::{ControlError, Effect};
use vimc4_debug::Directive;
use vimc4_device::{Device, Order, Time, escape};

use crate::call::{Answer, Call, Outcome};
use crate::desk::Desk;
use crate::served::{Served, page};

fn wrong(wrong: String) -> Problem {
    Problem::said(Kind::NotUnderstood, &wrong, DEBUGGER_REMEDY)
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
    Answer::done(&match was_open {
        true => Effect::Something,
        false => Effect::Nothing { why: Some("it was not open") },
    })
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

// --- another state, and what was recorded ---

pub(crate) fn set_flash(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let image = call.text("image").replace("\r\n", "\n");
    let filled = Controller::new(&live.model, live.machine.clone(), image.as_bytes())?.state();
    if !live.line.is_idle() {
        return Err(ControlError::Unsupported(
            "something is going on, and may come from the memory; wait until it is idle, or press stop",
        )
        .into());
    }
    let mut state = live.line.state();
    state.device = state.device.with_memory_of(&filled).ok_or(ControlError::Ended)?;
    live.restore(call.moment, &page(), state);
    Answer::done(&Effect::Something)
}

pub(crate) fn restore_snapshot(desk: &mut Desk, call: &Call) -> Outcome {
    let id: u64 = call.number("id", "snapshot")?;
    let Served { live, snapshots, .. } = desk.present(call)?;
    let kept = snapshots.kept.get(&id).cloned();
    let kept = kept.ok_or_else(|| no_such("snapshot", &id.to_string()))?;
    live.restore(call.moment, &page(), kept.state);
    Answer::now(live.now())
}

fn not_recorded() -> Problem {
    let remedy = "POST to recording begins one";
    Problem::new(Kind::NoSuchThing, "nothing was to be recorded here", remedy)
}

pub(crate) fn recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    let recorder = live.recorder.as_ref().ok_or_else(not_recorded)?;
    Ok(Answer::Text(recorder.text(live.now())))
}

pub(crate) fn end_recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    live.recorder.take().ok_or_else(not_recorded)?;
    Answer::done(&Effect::Something)
}
