//! What the routes of the debugger, of the past and of other states do.

use serde_json::json;
use vimc4_answers::entry::list;
use vimc4_answers::feed::Feed;
use vimc4_answers::fields::no_such;
use vimc4_answers::limits::HISTORY;
use vimc4_answers::past::{self, Sight, wrong_line, wrong_look};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_catalogue::Controller;
use vimc4_debug::Directive;
use vimc4_device::Device;
use vimc4_session::{ControlError, Effect};

use crate::call::{Answer, Call, Outcome};
use crate::desk::Desk;
use crate::live::page;
use crate::served::Served;

fn wrong(wrong: String) -> Problem {
    wrong_look(&wrong)
}

// --- the routes ---

/// Does something in the debugger, which is opened for that. What was refused has stopped no time.
fn looking<T>(
    desk: &mut Desk,
    call: &Call,
    deed: impl FnOnce(&mut Served) -> Result<T, Problem>,
) -> Result<T, Problem> {
    let served = desk.looked_at(call)?;
    let was_open = served.looks.is_some();
    served.look();
    let done = deed(served);
    if done.is_err() && !was_open {
        served.leave(call.moment);
    }
    done
}

pub(crate) fn debug(desk: &mut Desk, call: &Call) -> Outcome {
    let line = call.text("line");
    let wrong = |why: String| wrong_line(line, &why);
    let text = looking(desk, call, |served| served.carry_out(line).map_err(wrong))?;
    if Directive::named(line.trim()).is_some_and(|directive| directive.name == "quit") {
        desk.looked_at(call)?.leave(call.moment);
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
    let mut history = json!({
        "open": false,
        "possible": true,
        "first": first,
        "at": now,
        "branch": heading,
        "now": { "branch": heading, "at": now },
        "branches": [],
    });
    if !debugger.differences().is_empty() {
        history["differences"] = past::differences(debugger, false);
    }
    Answer::json(&history)
}

pub(crate) fn go(desk: &mut Desk, call: &Call) -> Outcome {
    let feed = &desk.looked_at(call)?.live.feed;
    let goal = past::goal(&call.body, feed)?;
    looking(desk, call, |served| {
        served.go(goal).map_err(wrong)?;
        Answer::json(&served.history())
    })
}

pub(crate) fn do_there(desk: &mut Desk, call: &Call) -> Outcome {
    let line = past::deed(&call.body, &desk.looked_at(call)?.live.names)?;
    looking(desk, call, |served| {
        Sight::of(&call.body).is_right(&served.history())?;
        served.do_there(&line).map_err(wrong)?;
        Answer::json(&served.history())
    })
}

pub(crate) fn take(desk: &mut Desk, call: &Call) -> Outcome {
    needs_debugger(desk, call)?;
    looking(desk, call, |served| {
        Sight::of(&call.body).is_right(&served.history())?;
        served.take();
        Answer::json(&served.history())
    })
}

/// Refuses requests about the moment that is looked at while there is none: to open the debugger would pause the
/// controller.
fn needs_debugger(desk: &mut Desk, call: &Call) -> Result<(), Problem> {
    match desk.looked_at(call)?.looks.is_some() {
        true => Ok(()),
        false => Err(past::not_open()),
    }
}

pub(crate) fn history_entries(desk: &mut Desk, call: &Call) -> Outcome {
    needs_debugger(desk, call)?;
    let served = desk.looked_at(call)?;
    let branch = call.query.get("branch").and_then(|branch| branch.parse().ok());
    let feed = Feed::new(std::sync::Arc::new(|| {}));
    let before = past::happened(served.debugger(), branch, &mut feed.sink()).map_err(wrong)?;
    let part = feed.after(before, HISTORY);
    let names = &served.live.names;
    let (first, last) = (part.first.max(before + 1), part.last);
    Ok(Answer::Json(format!(
        r#"{{"first":{first},"last":{last},"next":{last},"entries":[{}]}}"#,
        list(&part.items, names)
    )))
}

// --- another state, and what was recorded ---

pub(crate) fn set_flash(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let image = call.text("image").replace("\r\n", "\n");
    let filled = Controller::new(&live.model, live.machine.clone(), image.as_bytes())?.state();
    if !live.line().is_idle() {
        return Err(ControlError::Unsupported(
            "something is going on, and may come from the memory; wait until it is idle, or press stop",
        )
        .into());
    }
    let mut state = live.line().state();
    state.device = state.device.with_memory_of(&filled).ok_or(ControlError::Ended)?;
    live.request(call.moment, |session, wall| session.restore(wall, &page(), state));
    Answer::done(&Effect::Something)
}

pub(crate) fn restore_snapshot(desk: &mut Desk, call: &Call) -> Outcome {
    let id: u64 = call.number("id", "snapshot")?;
    let Served { live, snapshots, .. } = desk.present(call)?;
    let kept = snapshots.kept.get(&id).cloned();
    let kept = kept.ok_or_else(|| no_such("snapshot", &id.to_string()))?;
    live.request(call.moment, |session, wall| session.restore(wall, &page(), kept.state));
    Answer::now(live.now())
}

fn not_recorded() -> Problem {
    let remedy = "POST to recording begins one";
    Problem::new(Kind::NoSuchThing, "nothing was to be recorded here", remedy)
}

pub(crate) fn recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    let recorder = live.recorder().ok_or_else(not_recorded)?;
    Ok(Answer::Text(recorder.text(live.now(), live.session.clock())))
}

pub(crate) fn end_recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    if !live.end_recording() {
        return Err(not_recorded());
    }
    Answer::done(&Effect::Something)
}
