//! What the routes do: each is a method of the library, or a few.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};
use vimc4::device::OwnedInput;
use vimc4::{
    BreakpointId, Clock, Condition, Control, ControlError, Effect, FaultNumber, Order, Pause,
    Scenario, ScenarioNumber, Time, TimeAdvance, Verb, read_condition, read_fault, read_rule,
};
use vimc4_answers::fields::{NO_BYTES, bytes_of, clock_of, no_such, span_of};
use vimc4_answers::limits::{BREAKPOINTS, LONGEST_NAME, SNAPSHOTS};
use vimc4_answers::log::Wanted;
use vimc4_answers::past::{self, Sight};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::seen;

use crate::call::{Answer, Call, Outcome};
use crate::debugger::Question;
use crate::limits::RECORDING;
use crate::reading::Reading;
use crate::refusal::problem;
use crate::served::{Debug, Kept, Served};

// --- the server ---

pub(crate) async fn server(call: Call) -> Outcome {
    Answer::json(&json!({
        "name": "virtual IMC4",
        "version": env!("CARGO_PKG_VERSION"),
        "instance": call.app.instance,
        "controllers": call.app.controllers.len(),
        "token": call.app.token.is_some(),
    }))
}

pub(crate) async fn models(_: Call) -> Outcome {
    Answer::json(&vimc4::models())
}

pub(crate) async fn model(call: Call) -> Outcome {
    let name = call.path.get("name").map_or("", String::as_str);
    let profile = vimc4::model_profile(name).map_err(|_| no_such("model", name))?;
    Ok(Answer::Text(profile.to_owned()))
}

pub(crate) async fn machines(_: Call) -> Outcome {
    Answer::json(&vimc4::machines())
}

pub(crate) async fn machine(call: Call) -> Outcome {
    let name = call.path.get("name").map_or("", String::as_str);
    let profile = vimc4::machine_profile(name).map_err(|_| no_such("machine", name))?;
    Ok(Answer::Text(profile.to_owned()))
}

pub(crate) async fn quit(call: Call) -> Outcome {
    order_end(&call);
    done(&Effect::Something)
}

/// Has the program end, by a task of its own: in this thread that has its turn when the connection has
/// written the answer.
fn order_end(call: &Call) {
    let quit = Arc::clone(&call.app.quit);
    tokio::spawn(async move { quit.notify_one() });
}

// --- controllers ---

pub(crate) async fn controllers(call: Call) -> Outcome {
    let about = call.app.controllers.iter().map(|served| &served.about);
    Answer::json(&about.collect::<Vec<_>>())
}

pub(crate) async fn controller(call: Call) -> Outcome {
    Answer::json(&call.controller()?.about)
}

pub(crate) async fn its_model(call: Call) -> Outcome {
    Answer::json(call.controller()?.control.model())
}

pub(crate) async fn its_machine(call: Call) -> Outcome {
    Answer::json(&**call.controller()?.control.machine())
}

pub(crate) async fn view(call: Call) -> Outcome {
    Answer::json(&call.controller()?.control.view().await?)
}

pub(crate) async fn position(call: Call) -> Outcome {
    // Not shared with others: it is to show what the asker has done just before.
    Answer::json(&seen::position(&call.controller()?.control.view().await?))
}

pub(crate) async fn signals(call: Call) -> Outcome {
    let control = &call.controller()?.control;
    let (signals, view) = (control.signals(), control.view());
    let (signals, view) = (signals.await?, view.await?);
    Answer::json(&seen::signals(&signals, &view))
}

pub(crate) async fn set_signal(call: Call) -> Outcome {
    let control = &call.controller()?.control;
    let name = call.path.get("name").map_or("", String::as_str);
    let effect = match call.body.get("value") {
        Some(Value::String(position)) => control.turn(name, position),
        value => {
            let value = value.and_then(Value::as_i64).unwrap_or_default();
            let value = i32::try_from(value).map_err(|_| {
                Problem::new(
                    Kind::NotUnderstood,
                    format!("`{name}` cannot be {value}"),
                    "ask for the list of signals, which has their values",
                )
            })?;
            control.set_signal(name, value)
        }
    };
    done(&effect.await?)
}

pub(crate) async fn send(call: Call) -> Outcome {
    let bytes = bytes_of(call.text("send"))?;
    if bytes.is_empty() {
        call.controller()?;
        return done(&Effect::Nothing { why: Some(NO_BYTES) });
    }
    call.controller()?.control.inject(OwnedInput::Bytes(bytes.into())).await?;
    done(&Effect::Something)
}

// --- what it keeps without power ---

pub(crate) async fn flash(call: Call) -> Outcome {
    let image = call.controller()?.control.flash().await?;
    Ok(Answer::Text(String::from_utf8_lossy(&image).into_owned()))
}

pub(crate) async fn set_flash(call: Call) -> Outcome {
    call.controller()?.control.set_flash(call.text("image").as_bytes())?.await?;
    done(&Effect::Something)
}

// --- recordings ---

pub(crate) async fn recording(call: Call) -> Outcome {
    let served = call.controller()?;
    // What was sent before is in it.
    served.control.now().await?;
    let recording = served.recordings.present().ok_or_else(not_recorded)?;
    let (left, from) = recording.so_far().map_err(|error| {
        let remedy = "POST to recording begins another one";
        Problem::new(Kind::NotNow, format!("the recording cannot be read: {error}"), remedy)
    })?;
    Ok(Answer::Recording(Reading::of(left, from)))
}

fn not_recorded() -> Problem {
    let remedy = "POST to recording begins one";
    Problem::new(Kind::NoSuchThing, "nothing was to be recorded here", remedy)
}

pub(crate) async fn begin_recording(call: Call) -> Outcome {
    let served = call.controller()?;
    let is_there = || {
        let remedy = "read it with GET, and end it with DELETE";
        Problem::new(Kind::NotNow, "it is recorded already", remedy)
    };
    if served.recordings.own().is_some() {
        return Err(is_there());
    }
    let file = served.control.record_in_memory("the API", RECORDING).await?;
    // Somebody else may have been quicker.
    let mut own = served.recordings.own();
    if own.is_some() {
        file.end_here();
        return Err(is_there());
    }
    *own = Some(file);
    drop(own);
    done(&Effect::Something)
}

pub(crate) async fn end_recording(call: Call) -> Outcome {
    let served = call.controller()?;
    let own = served.recordings.own().take();
    match own {
        Some(own) => own.end_here(),
        None if served.recordings.present().is_some() => {
            let remedy = "read it with GET; it ends with the program";
            let detail = "what is recorded was begun by --record, and is nobody's to end here";
            return Err(Problem::new(Kind::NotNow, detail, remedy));
        }
        None => return Err(not_recorded()),
    }
    done(&Effect::Something)
}

// --- orders ---

pub(crate) async fn verbs(call: Call) -> Outcome {
    call.controller()?;
    Answer::json(&seen::verbs())
}

pub(crate) async fn order(call: Call) -> Outcome {
    let served = call.controller()?;
    let typed = call.text("order");
    let read = Order::read(typed, &call.app.names);
    // How far it is to move matters only where something moves it.
    if read.is_err() && typed.split_whitespace().next() == Some(Verb::Advance.name()) {
        is_moved(&call).await?;
    }
    let text = match read? {
        None => String::new(),
        Some(Order::Quit) => {
            order_end(&call);
            "ok".to_owned()
        }
        Some(Order::Advance(span)) => advanced(&call, span).await?.text("now"),
        Some(Order::RunUntil(condition)) => {
            let what = if condition == Condition::Idle { "idle at" } else { "there at" };
            arrived(&call, |control| control.run_until(condition)).await?.text(what)
        }
        Some(order) => served.control.give(&order).await.map_err(problem)?,
    };
    Answer::json(&json!({ "text": text }))
}

pub(crate) async fn completions(call: Call) -> Outcome {
    call.controller()?;
    let line = call.query.get("line").map_or("", String::as_str);
    Answer::json(&seen::completions(&call.app.names, line))
}

// --- time ---

pub(crate) async fn clock(call: Call) -> Outcome {
    let control = &call.controller()?.control;
    let (now, clock, paused) = (control.now(), control.clock(), control.paused());
    let (now, clock, paused) = (now.await?, clock.await?, paused.await?);
    Answer::json(&seen::clock(now, clock, paused.as_ref(), changes_to(clock)))
}

/// One that runs by itself can change its speed, and that is all.
fn changes_to(clock: Clock) -> &'static [&'static str] {
    if clock.rate().is_some() { &["speed"] } else { &[] }
}

pub(crate) async fn set_clock(call: Call) -> Outcome {
    let control = &call.controller()?.control;
    let wanted = clock_of(call.text("clock"), changes_to(control.clock().await?))?;
    control.set_clock(wanted).await?;
    clock(call).await
}

pub(crate) async fn advance(call: Call) -> Outcome {
    is_moved(&call).await?;
    let span = span_of(call.text("span"))?;
    Answer::json(&advanced(&call, span).await?.json())
}

/// Whether time is moved, and does not move by itself.
async fn is_moved(call: &Call) -> Result<(), Problem> {
    // That it is paused, too, is not what is in the way.
    if call.controller()?.control.clock().await?.rate().is_some() {
        return Err(Problem::new(
            Kind::NotNow,
            "time moves by itself with this clock",
            "wait, or POST a line such as `step 250ms` to the debugger; `--time manual` starts a \
             controller whose time is moved",
        ));
    }
    Ok(())
}

async fn advanced(call: &Call, span: Duration) -> Result<Arrival, Problem> {
    is_moved(call).await?;
    arrived(call, |control| control.advance(span)).await
}

pub(crate) async fn run_until(call: Call) -> Outcome {
    let condition = read_condition(call.text("condition"), &call.app.names)?;
    Answer::json(&arrived(&call, |control| control.run_until(condition)).await?.json())
}

/// A journey ends with whoever waits for it.
struct Escorted(TimeAdvance);

impl Drop for Escorted {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// Where a journey has led to, or what has ended it.
enum Arrival {
    There(Time),
    Paused(Pause),
}

impl Arrival {
    fn json(&self) -> Value {
        match self {
            Arrival::There(now) => json!({ "now": now }),
            Arrival::Paused(pause) => json!({ "now": pause.at, "paused": seen::pause(pause) }),
        }
    }

    /// As an order answers, which says by `what` that it has arrived.
    fn text(&self, what: &str) -> String {
        match self {
            Arrival::There(now) => format!("{what} {now}"),
            Arrival::Paused(pause) => format!("paused at {}", pause.at),
        }
    }
}

/// Waits until time is there, or is paused on the way: whoever asked could not let it go on while they
/// wait.
async fn arrived(
    call: &Call,
    set_out: impl FnOnce(&Control) -> TimeAdvance,
) -> Result<Arrival, Problem> {
    let control = &call.controller()?.control;
    let _room = call.app.journey()?;
    // Asked before: what is asked later has its turn when time has arrived.
    if control.paused().await?.is_some() {
        return Err(ControlError::Paused.into());
    }
    if control.now().await? == Time::NEVER {
        let remedy = "restore a snapshot, or start the program anew";
        return Err(Problem::new(Kind::NotNow, "time has come to its end", remedy));
    }
    let mut journey = Escorted(set_out(control));
    tokio::select! {
        biased;
        now = pin!(&mut journey.0) => Ok(Arrival::There(now?)),
        pause = control.until_paused() => Ok(Arrival::Paused(pause?)),
    }
}

pub(crate) async fn cancel(call: Call) -> Outcome {
    let control = &call.controller()?.control;
    control.cancel_all();
    Answer::json(&json!({ "now": control.now().await? }))
}

pub(crate) async fn pause(call: Call) -> Outcome {
    pause_or_go_on(&call, true).await
}

pub(crate) async fn resume(call: Call) -> Outcome {
    pause_or_go_on(&call, false).await
}

async fn pause_or_go_on(call: &Call, is_to_pause: bool) -> Outcome {
    let Served { desk, control, .. } = call.controller()?;
    let now = desk.pause(control, is_to_pause).await.map_err(Problem::of_going_on);
    Answer::json(&json!({ "now": now? }))
}

pub(crate) async fn step(call: Call) -> Outcome {
    let control = &call.controller()?.control;
    let (step, now) = (control.step(), control.now());
    Answer::json(&seen::step(step.await?, now.await?))
}

// --- breakpoints ---

pub(crate) async fn breakpoints(call: Call) -> Outcome {
    let points = call.controller()?.control.breakpoints().await?;
    Answer::json(&seen::breakpoints(&points, &call.app.names))
}

pub(crate) async fn add_breakpoint(call: Call) -> Outcome {
    let control = &call.controller()?.control;
    let condition = read_condition(call.text("condition"), &call.app.names)?;
    if control.breakpoints().await?.len() >= BREAKPOINTS {
        let detail = format!("there are {BREAKPOINTS} breakpoints already");
        return Err(Problem::new(Kind::TooMany, detail, "delete some of them"));
    }
    Answer::json(&json!({ "id": control.break_when(condition).await? }))
}

pub(crate) async fn remove_breakpoint(call: Call) -> Outcome {
    let id: u64 = call.number("id", "breakpoint")?;
    match call.controller()?.control.remove_breakpoint(BreakpointId(id)).await? {
        true => done(&Effect::Something),
        false => Err(no_such("breakpoint", &id.to_string())),
    }
}

// --- the debugger ---

pub(crate) async fn debug(call: Call) -> Outcome {
    ask_debugger(&call, Question::Line(call.text("line").to_owned())).await
}

pub(crate) async fn debugger_view(call: Call) -> Outcome {
    if !call.controller()?.desk.is_open().await {
        // To look pauses nothing.
        return view(call).await;
    }
    ask_debugger(&call, Question::View).await
}

async fn ask_debugger(call: &Call, question: Question) -> Outcome {
    let Served { desk, control, memory, .. } = call.controller()?;
    let open = call.app.debugger.as_ref().map(|Debug(open)| open);
    let answer = desk.ask(open, control, memory, question).await;
    // Those who watch may see another moment now.
    call.app.news.send_replace(());
    Ok(Answer::Json(answer?))
}

/// Whoever waits for the end of the answer has the debugger, which others may share, and leaves it by
/// leaving.
pub(crate) async fn hold_debugger(call: Call) -> Outcome {
    let Served { desk, control, memory, .. } = call.controller()?;
    let open = call.app.debugger.as_ref().map(|Debug(open)| open);
    let by = match call.text("by") {
        "" => "another client".to_owned(),
        by => by.chars().take(LONGEST_NAME).collect(),
    };
    let (holding, mut held) = desk.hold(open, control, memory, by).await?;
    tokio::spawn(async move {
        held.ended().await;
        if let Ok(Served { desk, .. }) = call.controller() {
            desk.leave(&held).await;
            call.app.news.send_replace(());
        }
    });
    Ok(Answer::Holding(holding))
}

pub(crate) async fn cancel_debugger(call: Call) -> Outcome {
    debugger_was_open(call.controller()?.desk.cancel().await)
}

pub(crate) async fn close_debugger(call: Call) -> Outcome {
    let was_open = call.controller()?.desk.close().await;
    call.app.news.send_replace(());
    debugger_was_open(was_open)
}

fn debugger_was_open(was_open: bool) -> Outcome {
    match was_open {
        true => done(&Effect::Something),
        false => done(&Effect::Nothing { why: Some("it was not open") }),
    }
}

// --- the past ---

/// Does not open the debugger, which would pause the controller.
pub(crate) async fn history(call: Call) -> Outcome {
    let Served { desk, control, memory, .. } = call.controller()?;
    if desk.is_open().await {
        return ask_debugger(&call, Question::History).await;
    }
    let now = control.now().await?;
    Answer::json(&json!({
        "open": false,
        "possible": call.app.debugger.is_some(),
        "first": memory.first().unwrap_or(now),
        "at": now,
        "branch": 0,
        "now": { "branch": 0, "at": now },
        "branches": [],
    }))
}

pub(crate) async fn go(call: Call) -> Outcome {
    let feed = &call.controller()?.feed;
    let goal = past::goal(&call.body, feed)?;
    ask_debugger(&call, Question::Go(goal)).await
}

pub(crate) async fn do_there(call: Call) -> Outcome {
    let line = past::deed(&call.body, &call.app.names)?;
    ask_debugger(&call, Question::Do(line, Sight::of(&call.body))).await
}

pub(crate) async fn take(call: Call) -> Outcome {
    needs_debugger(&call).await?;
    ask_debugger(&call, Question::Take(Sight::of(&call.body))).await
}

/// Refuses requests about the moment that is looked at while there is none: to open the debugger would pause the
/// controller.
async fn needs_debugger(call: &Call) -> Result<(), Problem> {
    // Without one that could be opened, that is what is refused.
    match call.controller()?.desk.is_open().await || call.app.debugger.is_none() {
        true => Ok(()),
        false => Err(past::not_open()),
    }
}

pub(crate) async fn history_entries(call: Call) -> Outcome {
    needs_debugger(&call).await?;
    let branch = call.query.get("branch").and_then(|branch| branch.parse().ok());
    let names = Box::new(call.app.names.clone());
    ask_debugger(&call, Question::Entries(branch, names)).await
}

// --- snapshots ---

pub(crate) async fn snapshots(call: Call) -> Outcome {
    let kept = call.controller()?.snapshots.kept();
    let list = kept.iter().map(|(id, kept)| json!({ "id": id, "name": kept.name, "at": kept.at }));
    Answer::json(&list.collect::<Vec<_>>())
}

pub(crate) async fn take_snapshot(call: Call) -> Outcome {
    let served = call.controller()?;
    let (at, snapshot) = (served.control.now(), served.control.snapshot());
    let (at, snapshot) = (at.await?, snapshot.await?);
    if served.snapshots.kept().len() >= SNAPSHOTS {
        let detail = format!("there are {SNAPSHOTS} snapshots already");
        return Err(Problem::new(Kind::TooMany, detail, "delete some of them"));
    }
    let name = call.text("name").to_owned();
    let id = served.snapshots.keep(Kept { name: name.clone(), at, snapshot });
    Answer::json(&json!({ "id": id, "name": name, "at": at }))
}

pub(crate) async fn restore_snapshot(call: Call) -> Outcome {
    let served = call.controller()?;
    let id: u64 = call.number("id", "snapshot")?;
    let kept = served.snapshots.kept().get(&id).cloned();
    let Some(kept) = kept else { return Err(no_such("snapshot", &id.to_string())) };
    let (restored, now) = (served.control.restore(&kept.snapshot), served.control.now());
    restored.await?;
    Answer::json(&json!({ "now": now.await? }))
}

pub(crate) async fn remove_snapshot(call: Call) -> Outcome {
    let id: u64 = call.number("id", "snapshot")?;
    match call.controller()?.snapshots.kept().remove(&id) {
        Some(_) => done(&Effect::Something),
        None => Err(no_such("snapshot", &id.to_string())),
    }
}

// --- faults and rules ---

pub(crate) async fn faults(call: Call) -> Outcome {
    let faults = call.controller()?.control.faults().await?;
    Answer::json(&seen::faults(&faults, &call.app.names))
}

pub(crate) async fn begin_fault(call: Call) -> Outcome {
    let fault = read_fault(call.text("fault"), &call.app.names)?;
    Answer::json(&json!({ "number": call.controller()?.control.fault(fault).await? }))
}

pub(crate) async fn end_fault(call: Call) -> Outcome {
    let number = FaultNumber(call.number("number", "fault")?);
    let control = &call.controller()?.control;
    if !control.faults().await?.iter().any(|view| view.number == number) {
        return Err(no_such("fault", &number.0.to_string()));
    }
    done(&control.end_fault(number).await?)
}

pub(crate) async fn end_faults(call: Call) -> Outcome {
    done(&call.controller()?.control.end_faults().await?)
}

pub(crate) async fn rules(call: Call) -> Outcome {
    let rules = call.controller()?.control.rules().await?;
    Answer::json(&seen::rules(&rules, &call.app.names))
}

pub(crate) async fn begin_rules(call: Call) -> Outcome {
    let lines = call.text("rules").lines().map(str::trim).filter(|line| !line.is_empty());
    let rules =
        lines.map(|line| read_rule(line, &call.app.names)).collect::<Result<Vec<_>, _>>()?;
    if rules.is_empty() {
        let remedy = "write one in each line, such as `when x > 1000: press stop`";
        return Err(Problem::new(Kind::NotUnderstood, "there are no rules", remedy));
    }
    let number = call.controller()?.control.scenario(Scenario { rules }).await?;
    Answer::json(&json!({ "scenario": number }))
}

pub(crate) async fn end_scenario(call: Call) -> Outcome {
    let number = ScenarioNumber(call.number("scenario", "scenario")?);
    let control = &call.controller()?.control;
    if !control.rules().await?.iter().any(|view| view.id.scenario == number) {
        return Err(no_such("scenario", &number.0.to_string()));
    }
    done(&control.end_scenario(number).await?)
}

pub(crate) async fn end_scenarios(call: Call) -> Outcome {
    done(&call.controller()?.control.end_scenarios().await?)
}

pub(crate) async fn reset(call: Call) -> Outcome {
    done(&call.controller()?.control.reset().await?)
}

// --- what happened ---

pub(crate) async fn journal(call: Call) -> Outcome {
    let served = call.controller()?;
    let wanted = Wanted::read(&call.query)?;
    // What was sent before is there first.
    served.control.now().await?;
    Ok(Answer::Json(wanted.of(&served.feed, &call.app.names)))
}

/// What came of a deed.
pub(crate) fn done(effect: &Effect) -> Outcome {
    Answer::json(&seen::effect(effect))
}
