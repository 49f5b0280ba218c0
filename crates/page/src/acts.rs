//! What the routes do.

use serde_json::{Value, json};
use vimc4_answers::fields::{bytes_of, no_such};
use vimc4_answers::limits::{BREAKPOINTS, SNAPSHOTS};
use vimc4_answers::log::Wanted;
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::seen;
use vimc4_catalogue::Controller;
use vimc4_control::order::{erased, ruled, said};
use vimc4_control::{BreakpointId, Clock, ControlError, Effect};
use vimc4_device::{
    Condition, Deed, Device, FaultNumber, Faulting, Order, OwnedInput, Ruling, Scenario,
    ScenarioNumber, Time, faults_in_words, parse_duration, position_in_words, rules_in_words,
};

use crate::call::{Answer, Call, Outcome};
use crate::desk::Desk;
use crate::past::{
    cancel_debugger, close_debugger, debug, debugger_view, do_there, go, history, history_entries,
    hold_debugger, take,
};
use crate::served::{Served, page};
use crate::snapshots::Snapshot;

macro_rules! runs {
    ($($method:ident $path:literal $query:ident $body:ident $answer:literal $run:ident $about:literal;)+) => {
        /// What answers each of the routes, in the order of the table.
        pub(crate) static RUNS: &[fn(&mut Desk, &Call) -> Outcome] = &[$($run),+];
    };
}

vimc4_answers::routes!(runs);

fn done(effect: &Effect) -> Outcome {
    Answer::json(&seen::effect(effect))
}

fn now(at: Time) -> Outcome {
    Answer::json(&json!({ "now": at }))
}

fn names_of(names: &[&str]) -> Outcome {
    Answer::json(&json!(names))
}

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
    names_of(&vimc4_catalogue::models())
}

fn model(_: &mut Desk, call: &Call) -> Outcome {
    let name = call.named("name");
    let profile = vimc4_catalogue::model_profile(name).map_err(|_| no_such("model", name))?;
    Ok(Answer::Text(profile.to_owned()))
}

fn machines(_: &mut Desk, _: &Call) -> Outcome {
    names_of(&vimc4_catalogue::machines())
}

fn machine(_: &mut Desk, call: &Call) -> Outcome {
    let name = call.named("name");
    let profile = vimc4_catalogue::machine_profile(name).map_err(|_| no_such("machine", name))?;
    Ok(Answer::Text(profile.to_owned()))
}

fn quit(_: &mut Desk, _: &Call) -> Outcome {
    let remedy = "close the page, or PUT other controllers to /v1/controllers";
    Err(Problem::new(Kind::NotNow, "there is no program that could end", remedy))
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
    Answer::json(&serde_json::to_value(&desk.present(call)?.live.model).unwrap_or_default())
}

fn its_machine(desk: &mut Desk, call: &Call) -> Outcome {
    let machine = &desk.present(call)?.live.machine;
    Answer::json(&serde_json::to_value(&**machine).unwrap_or_default())
}

fn view(desk: &mut Desk, call: &Call) -> Outcome {
    Answer::json(&serde_json::to_value(desk.present(call)?.view()).unwrap_or_default())
}

fn position(desk: &mut Desk, call: &Call) -> Outcome {
    Answer::json(&seen::position(&desk.present(call)?.view()))
}

fn signals(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    Answer::json(&seen::signals(&served.live.line.signals(), &served.view()))
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
    done(&served.live.act(call.moment, &page(), deed)?)
}

fn send(desk: &mut Desk, call: &Call) -> Outcome {
    let bytes = bytes_of(call.text("send"))?;
    desk.present(call)?.live.hear(call.moment, &bytes, &page());
    done(&Effect::Something)
}

// --- what it keeps without power ---

fn flash(desk: &mut Desk, call: &Call) -> Outcome {
    let image = desk.present(call)?.live.line.flash_image();
    Ok(Answer::Text(String::from_utf8_lossy(&image).into_owned()))
}

fn set_flash(desk: &mut Desk, call: &Call) -> Outcome {
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
    done(&Effect::Something)
}

// --- orders ---

fn verbs(desk: &mut Desk, call: &Call) -> Outcome {
    desk.present(call)?;
    Answer::json(&seen::verbs())
}

fn completions(desk: &mut Desk, call: &Call) -> Outcome {
    let line = call.query.get("line").map_or("", String::as_str);
    Answer::json(&seen::completions(&desk.present(call)?.live.names, line))
}

fn order(desk: &mut Desk, call: &Call) -> Outcome {
    let names = desk.present(call)?.live.names.clone();
    let text = match Order::read(call.text("order"), &names)? {
        None => String::new(),
        Some(Order::Quit) => return quit(desk, call),
        Some(order) => carry_out(desk.present(call)?, call.moment, order)?,
    };
    Answer::json(&json!({ "text": text }))
}

fn carry_out(served: &mut Served, moment: u64, order: Order) -> Result<String, Problem> {
    let (by, live) = (page(), &mut served.live);
    Ok(match order {
        Order::Do(deed) => said(&live.act(moment, &by, deed)?),
        Order::Erase => {
            let takes_ms = live.model.panel_erase_ms().unwrap_or(0);
            let was_powered = live.line.view(live.now()).powered;
            let deed = live.model.erasing(&live.line).map_err(ControlError::Unsupported)?;
            erased(&live.act(moment, &by, deed)?, was_powered, takes_ms)
        }
        Order::Advance(span) => match live.advance(moment, span)? {
            at if live.paused().is_some() => format!("paused at {at}"),
            at => format!("now {at}"),
        },
        Order::RunUntil(condition) => {
            let there = if condition == Condition::Idle { "idle" } else { "there" };
            match live.run_until(moment, condition)? {
                at if live.paused().is_some() => format!("paused at {at}"),
                at => format!("{there} at {at}"),
            }
        }
        // Nothing waits here for time to pass.
        Order::Cancel => "ok".to_owned(),
        Order::Position => position_in_words(&live.line.view(live.now()).axes),
        Order::Faults => faults_in_words(&live.line.faults(), &live.names),
        Order::Rule(Ruling::Begin(_, scenario)) => {
            let number = live.scenario(moment, &by, scenario.clone())?;
            ruled(number, &scenario, &live.line.rules())
        }
        Order::Rule(ruling) => said(&live.do_to(moment, vec![OwnedInput::Rule(ruling)], &by)),
        Order::Reset => said(&live.do_to(moment, everything_ends(), &by)),
        Order::Rules => rules_in_words(&live.line.rules(), &live.names),
        Order::Signals => live.names.list(),
        Order::Help(None) => live.names.help(),
        Order::Help(Some(verb)) => live.names.help_on(verb),
        Order::Complete(begun) => live.names.completions(&begun),
        Order::Quit => String::new(),
    })
}

fn everything_ends() -> Vec<OwnedInput> {
    vec![OwnedInput::Rule(Ruling::EndAll), OwnedInput::Fault(Faulting::EndAll)]
}

// --- time ---

fn clock(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    // Nobody awaits a time here, so every clock can take the place of another.
    let changes_to = ["speed", "manual", "instant"];
    Answer::json(&seen::clock(live.now(), live.pace.clock, live.paused(), &changes_to))
}

fn set_clock(desk: &mut Desk, call: &Call) -> Outcome {
    let wanted: Clock = call.text("clock").parse()?;
    desk.present(call)?.live.set_clock(call.moment, wanted);
    clock(desk, call)
}

fn arrived(served: &Served, at: Time) -> Outcome {
    match served.live.paused() {
        Some(pause) => Answer::json(&json!({ "now": at, "paused": seen::pause(pause) })),
        None => now(at),
    }
}

fn advance(desk: &mut Desk, call: &Call) -> Outcome {
    let text = call.text("span");
    let span = parse_duration(text).map_err(|wrong| {
        Problem::new(
            Kind::NotUnderstood,
            format!("the span `{text}` {wrong}"),
            "send a number that is not negative, with ns, us, ms, s, min or h, such as `250ms`",
        )
    })?;
    let served = desk.present(call)?;
    let at = served.live.advance(call.moment, span)?;
    arrived(served, at)
}

fn run_until(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    let condition = served.live.names.read(call.text("condition"))?;
    let at = served.live.run_until(call.moment, condition)?;
    arrived(served, at)
}

fn cancel(desk: &mut Desk, call: &Call) -> Outcome {
    now(desk.present(call)?.live.now())
}

fn pause(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    served.stays_paused(true);
    now(served.live.pause(page()))
}

fn resume(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    served.stays_paused(false);
    now(served.live.resume(call.moment, &page())?)
}

fn step(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let step = live.step()?;
    Answer::json(&seen::step(step, live.now()))
}

// --- breakpoints ---

fn breakpoints(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Answer::json(&seen::breakpoints(&live.breakpoints.views(), &live.names))
}

fn add_breakpoint(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let condition = live.names.read(call.text("condition"))?;
    if live.breakpoints.views().len() >= BREAKPOINTS {
        let detail = format!("there are {BREAKPOINTS} breakpoints already");
        return Err(Problem::new(Kind::TooMany, detail, "delete some of them"));
    }
    Answer::json(&json!({ "id": live.break_when(condition) }))
}

fn remove_breakpoint(desk: &mut Desk, call: &Call) -> Outcome {
    let id: u64 = call.number("id", "breakpoint")?;
    match desk.present(call)?.live.remove_breakpoint(BreakpointId(id)) {
        true => done(&Effect::Something),
        false => Err(no_such("breakpoint", &id.to_string())),
    }
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
    let id = snapshots.keep(Snapshot { name: name.clone(), at, state: live.line.state() });
    Answer::json(&json!({ "id": id, "name": name, "at": at }))
}

fn restore_snapshot(desk: &mut Desk, call: &Call) -> Outcome {
    let id: u64 = call.number("id", "snapshot")?;
    let Served { live, snapshots, .. } = desk.present(call)?;
    let kept = snapshots.kept.get(&id).cloned();
    let kept = kept.ok_or_else(|| no_such("snapshot", &id.to_string()))?;
    live.restore(call.moment, &page(), kept.state);
    now(live.now())
}

fn remove_snapshot(desk: &mut Desk, call: &Call) -> Outcome {
    let id: u64 = call.number("id", "snapshot")?;
    match desk.present(call)?.snapshots.kept.remove(&id) {
        Some(_) => done(&Effect::Something),
        None => Err(no_such("snapshot", &id.to_string())),
    }
}

// --- faults and rules ---

fn faults(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Answer::json(&seen::faults(&live.line.faults(), &live.names))
}

fn begin_fault(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let fault = live.names.read_fault(call.text("fault"))?;
    Answer::json(&json!({ "number": live.fault(call.moment, &page(), fault)? }))
}

fn end_fault(desk: &mut Desk, call: &Call) -> Outcome {
    let number = FaultNumber(call.number("number", "fault")?);
    let live = &mut desk.present(call)?.live;
    if !live.line.faults().iter().any(|view| view.number == number) {
        return Err(no_such("fault", &number.0.to_string()));
    }
    let deed = Deed::Fault(Box::new(Faulting::End(number)));
    done(&live.act(call.moment, &page(), deed)?)
}

fn end_faults(desk: &mut Desk, call: &Call) -> Outcome {
    let deed = Deed::Fault(Box::new(Faulting::EndAll));
    done(&desk.present(call)?.live.act(call.moment, &page(), deed)?)
}

fn rules(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Answer::json(&seen::rules(&live.line.rules(), &live.names))
}

fn begin_rules(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let lines = call.text("rules").lines().map(str::trim).filter(|line| !line.is_empty());
    let rules = lines.map(|line| live.names.read_rule(line)).collect::<Result<Vec<_>, _>>()?;
    if rules.is_empty() {
        let remedy = "write one in each line, such as `when x > 1000: press stop`";
        return Err(Problem::new(Kind::NotUnderstood, "there are no rules", remedy));
    }
    let number = live.scenario(call.moment, &page(), Scenario { rules })?;
    Answer::json(&json!({ "scenario": number }))
}

fn end_scenario(desk: &mut Desk, call: &Call) -> Outcome {
    let number = ScenarioNumber(call.number("scenario", "scenario")?);
    let live = &mut desk.present(call)?.live;
    if !live.line.rules().iter().any(|view| view.id.scenario == number) {
        return Err(no_such("scenario", &number.0.to_string()));
    }
    done(&live.do_to(call.moment, vec![OwnedInput::Rule(Ruling::End(number))], &page()))
}

fn end_scenarios(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    done(&live.do_to(call.moment, vec![OwnedInput::Rule(Ruling::EndAll)], &page()))
}

fn reset(desk: &mut Desk, call: &Call) -> Outcome {
    done(&desk.present(call)?.live.do_to(call.moment, everything_ends(), &page()))
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

fn not_recorded() -> Problem {
    let remedy = "POST to recording begins one";
    Problem::new(Kind::NoSuchThing, "nothing was to be recorded here", remedy)
}

fn recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    let recorder = live.recorder.as_ref().ok_or_else(not_recorded)?;
    Ok(Answer::Text(recorder.text(live.now())))
}

fn begin_recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    if live.recorder.is_some() {
        let remedy = "read it with GET, and end it with DELETE";
        return Err(Problem::new(Kind::NotNow, "it is recorded already", remedy));
    }
    live.record();
    done(&Effect::Something)
}

fn end_recording(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    live.recorder.take().ok_or_else(not_recorded)?;
    done(&Effect::Something)
}
