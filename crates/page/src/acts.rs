//! What the routes do.

use serde_json::{Value, json};
use vimc4_answers::fields::{NO_BYTES, bytes_of, clock_of, no_such, span_of};
use vimc4_answers::limits::SNAPSHOTS;
use vimc4_answers::log::Wanted;
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::seen;
use vimc4_device::{Deed, Device};
use vimc4_session::Effect;

use crate::call::{Answer, Call, Outcome};
use crate::desk::Desk;
use crate::live::page;
use crate::past::{
    cancel_debugger, close_debugger, debug, debugger_view, do_there, end_recording, go, history,
    history_entries, hold_debugger, recording, restore_snapshot, set_flash, take,
};
use crate::profiles;
use crate::served::Served;
use crate::snapshots::Snapshot;
use crate::words::{
    add_breakpoint, begin_fault, begin_rules, breakpoints, completions, end_fault, end_faults,
    end_scenario, end_scenarios, faults, order, quit, remove_breakpoint, reset, rules, run_until,
    verbs,
};

macro_rules! runs {
    ($($method:ident $path:literal $query:ident $body:ident $answer:literal $run:ident $about:literal;)+) => {
        /// What answers each of the routes, in the order of the table.
        pub(crate) static RUNS: &[fn(&mut Desk, &Call) -> Outcome] = &[$($run),+];
    };
}

vimc4_answers::routes!(runs);

// --- the desk ---

fn server(desk: &mut Desk, _: &Call) -> Outcome {
    Answer::json(&json!({
        "name": "virtual IMC4",
        "version": env!("CARGO_PKG_VERSION"),
        "instance": desk.instance(),
        "controllers": desk.controllers.len(),
        "token": false,
    }))
}

fn models(_: &mut Desk, _: &Call) -> Outcome {
    Answer::json(&json!(profiles::models()))
}

fn model(_: &mut Desk, call: &Call) -> Outcome {
    profiles::model_profile(call.named("name"))
}

fn machines(_: &mut Desk, _: &Call) -> Outcome {
    Answer::json(&json!(profiles::machines()))
}

fn machine(_: &mut Desk, call: &Call) -> Outcome {
    profiles::machine_profile(call.named("name"))
}

// --- controllers ---

fn controllers(desk: &mut Desk, _: &Call) -> Outcome {
    Answer::json(&desk.about())
}

fn controller(desk: &mut Desk, call: &Call) -> Outcome {
    let number: usize = call.number("n", "controller")?;
    Answer::json(&desk.present(call)?.about(number))
}

fn its_model(desk: &mut Desk, call: &Call) -> Outcome {
    profiles::model_written(&desk.present(call)?.live.model)
}

fn its_machine(desk: &mut Desk, call: &Call) -> Outcome {
    profiles::machine_written(&desk.present(call)?.live.machine)
}

fn view(desk: &mut Desk, call: &Call) -> Outcome {
    Answer::json(&serde_json::to_value(desk.present(call)?.view()).unwrap_or_default())
}

fn position(desk: &mut Desk, call: &Call) -> Outcome {
    Answer::json(&seen::position(&desk.present(call)?.view()))
}

fn signals(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    Answer::json(&seen::signals(&served.live.line().signals(), &served.view()))
}

fn set_signal(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    let name = call.named("name").to_owned();
    let deed = match call.body.get("value") {
        Some(Value::String(position)) => Deed::Turn(name, position.clone()),
        value => {
            let value = value.and_then(Value::as_i64).unwrap_or_default();
            let value = i32::try_from(value).map_err(|_| {
                Problem::new(
                    Kind::NotUnderstood,
                    format!("`{name}` cannot be {value}"),
                    "ask for the list of signals, which has their values",
                )
            })?;
            Deed::Set(name, value)
        }
    };
    Answer::done(&served.live.act(call.moment, deed)?)
}

fn send(desk: &mut Desk, call: &Call) -> Outcome {
    let bytes = bytes_of(call.text("send"))?;
    if bytes.is_empty() {
        desk.present(call)?;
        return Answer::done(&Effect::Nothing { why: Some(NO_BYTES) });
    }
    let live = &mut desk.present(call)?.live;
    live.request(call.moment, |session, wall| session.send_bytes(wall, &page(), &bytes));
    Answer::done(&Effect::Something)
}

// --- what it keeps without power ---

fn flash(desk: &mut Desk, call: &Call) -> Outcome {
    let image = desk.present(call)?.live.line().flash_image();
    Ok(Answer::Text(String::from_utf8_lossy(&image).into_owned()))
}

// --- time ---

/// Nobody awaits a time here, so every clock can take the place of another.
const CHANGES_TO: &[&str] = &["speed", "manual", "instant"];

fn clock(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Answer::json(&seen::clock(live.now(), live.session.clock(), live.session.paused(), CHANGES_TO))
}

fn set_clock(desk: &mut Desk, call: &Call) -> Outcome {
    let wanted = clock_of(call.text("clock"), CHANGES_TO)?;
    let live = &mut desk.present(call)?.live;
    live.request(call.moment, |session, wall| session.replace_clock(wall, wanted));
    clock(desk, call)
}

fn advance(desk: &mut Desk, call: &Call) -> Outcome {
    let span = span_of(call.text("span"))?;
    let served = desk.present(call)?;
    let at = served.live.advance(call.moment, span)?;
    Answer::json(&served.arrived(at))
}

fn cancel(desk: &mut Desk, call: &Call) -> Outcome {
    Answer::now(desk.present(call)?.live.now())
}

fn pause(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    served.stays_paused(true);
    served.live.pause();
    Answer::now(served.live.now())
}

fn resume(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    served.stays_paused(false);
    let live = &mut served.live;
    let now = live.request(call.moment, |session, wall| session.resume(wall, &page()));
    Answer::now(now.map_err(Problem::of_going_on)?)
}

fn step(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let step = live.request(call.moment, |session, _| session.step())?;
    Answer::json(&seen::step(step, live.now()))
}

// --- snapshots ---

fn snapshots(desk: &mut Desk, call: &Call) -> Outcome {
    let kept = &desk.present(call)?.snapshots.kept;
    let list = kept.iter().map(|(id, kept)| json!({ "id": id, "name": kept.name, "at": kept.at }));
    Answer::json(&list.collect())
}

fn take_snapshot(desk: &mut Desk, call: &Call) -> Outcome {
    let Served { live, snapshots, .. } = desk.present(call)?;
    if snapshots.kept.len() >= SNAPSHOTS {
        let detail = format!("there are {SNAPSHOTS} snapshots already");
        return Err(Problem::new(Kind::TooMany, detail, "delete some of them"));
    }
    let (name, at) = (call.text("name").to_owned(), live.now());
    let id = snapshots.keep(Snapshot { name: name.clone(), at, state: live.line().state() });
    Answer::json(&json!({ "id": id, "name": name, "at": at }))
}

fn remove_snapshot(desk: &mut Desk, call: &Call) -> Outcome {
    let id: u64 = call.number("id", "snapshot")?;
    match desk.present(call)?.snapshots.kept.remove(&id) {
        Some(_) => Answer::done(&Effect::Something),
        None => Err(no_such("snapshot", &id.to_string())),
    }
}

// --- what happened ---

fn journal(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Ok(Answer::Json(Wanted::read(&call.query)?.of(&live.feed, &live.names)))
}

// --- what is still to come ---

fn not_here(what: &str) -> Outcome {
    Err(Problem::new(Kind::NotNow, format!("there are no {what} in a page"), "run vimc4 serve"))
}

fn so_far(desk: &mut Desk, call: &Call) -> Outcome {
    desk.present(call)?;
    not_here("expectations")
}

fn expectations(desk: &mut Desk, call: &Call) -> Outcome {
    so_far(desk, call)
}

fn watch(desk: &mut Desk, call: &Call) -> Outcome {
    so_far(desk, call)
}

fn expectation(desk: &mut Desk, call: &Call) -> Outcome {
    so_far(desk, call)
}

fn wait_until_met(desk: &mut Desk, call: &Call) -> Outcome {
    so_far(desk, call)
}

fn check(desk: &mut Desk, call: &Call) -> Outcome {
    so_far(desk, call)
}

fn give_up(desk: &mut Desk, call: &Call) -> Outcome {
    so_far(desk, call)
}

fn begin_recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    if live.recorder().is_some() {
        let remedy = "read it with GET, and end it with DELETE";
        return Err(Problem::new(Kind::NotNow, "it is recorded already", remedy));
    }
    live.record();
    Answer::done(&Effect::Something)
}
