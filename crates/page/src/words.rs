//! What the routes do that are asked in words: orders, conditions, faults and rules.

use serde_json::json;
use vimc4_answers::fields::no_such;
use vimc4_answers::limits::BREAKPOINTS;
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::seen;
use vimc4_device::{
    Condition, Deed, Device, FaultNumber, Faulting, Input, Ruling, Scenario, ScenarioNumber,
    faults_in_words, position_in_words, rules_in_words,
};
use vimc4_language::{Order, help, help_on, list_signals, read_condition, read_fault, read_rule};
use vimc4_session::order::{erased, ruled, said};
use vimc4_session::{BreakpointId, ControlError, Effect};

use crate::call::{Answer, Call, Outcome};
use crate::desk::Desk;
use crate::live::{Live, page};
use crate::served::Served;

pub(crate) fn quit(_: &mut Desk, _: &Call) -> Outcome {
    let remedy = "close the page, or PUT other controllers to /v1/controllers";
    Err(Problem::new(Kind::NotNow, "there is no program that could end", remedy))
}

pub(crate) fn verbs(desk: &mut Desk, call: &Call) -> Outcome {
    desk.present(call)?;
    Answer::json(&seen::verbs())
}

pub(crate) fn completions(desk: &mut Desk, call: &Call) -> Outcome {
    let line = call.query.get("line").map_or("", String::as_str);
    Answer::json(&seen::completions(&desk.present(call)?.live.names, line))
}

pub(crate) fn order(desk: &mut Desk, call: &Call) -> Outcome {
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
        Order::Do(deed) => said(&live.act(moment, deed)?),
        Order::Erase => {
            let takes_ms = live.model.panel_erase_ms().unwrap_or(0);
            let was_powered = live.line().view(live.now()).powered;
            let deed = live.model.erasing(live.line()).map_err(ControlError::Unsupported)?;
            erased(&live.act(moment, deed)?, was_powered, takes_ms)
        }
        Order::Advance(span) => match live.advance(moment, span)? {
            at if live.session.paused().is_some() => format!("paused at {at}"),
            at => format!("now {at}"),
        },
        Order::RunUntil(condition) => {
            let there = if condition == Condition::Idle { "idle" } else { "there" };
            match live.run_until(moment, condition)? {
                at if live.session.paused().is_some() => format!("paused at {at}"),
                at => format!("{there} at {at}"),
            }
        }
        // Nothing waits here for time to pass.
        Order::Cancel => "ok".to_owned(),
        Order::Position => {
            let view = live.line().view(live.now());
            position_in_words(&view.axes, view.activity)
        }
        Order::Faults => faults_in_words(&live.line().faults(), &live.names),
        Order::Rule(Ruling::Begin(_, scenario)) => {
            let begin = scenario.clone();
            let number =
                live.request(moment, |session, wall| session.begin_scenario(wall, &by, begin))?;
            ruled(number, &scenario, &live.line().rules())
        }
        Order::Rule(ruling) => {
            let inputs = [Input::Rule(&ruling)];
            said(&live.request(moment, |session, wall| session.give_all(wall, &by, &inputs)))
        }
        Order::Reset => said(&live.request(moment, |session, wall| session.reset(wall, &by))),
        Order::Rules => rules_in_words(&live.line().rules(), &live.names),
        Order::Signals => list_signals(&live.names),
        Order::Help(None) => help(&live.names),
        Order::Help(Some(verb)) => help_on(verb, &live.names),
        Order::Complete(begun) => vimc4_language::completions(&begun, &live.names),
        Order::Quit => String::new(),
    })
}

pub(crate) fn run_until(desk: &mut Desk, call: &Call) -> Outcome {
    let served = desk.present(call)?;
    let condition = read_condition(call.text("condition"), &served.live.names)?;
    let at = served.live.run_until(call.moment, condition)?;
    Answer::json(&served.arrived(at))
}

// --- breakpoints ---

pub(crate) fn breakpoints(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Answer::json(&seen::breakpoints(&live.session.breakpoints(), &live.names))
}

pub(crate) fn add_breakpoint(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let condition = read_condition(call.text("condition"), &live.names)?;
    if live.session.breakpoints().len() >= BREAKPOINTS {
        let detail = format!("there are {BREAKPOINTS} breakpoints already");
        return Err(Problem::new(Kind::TooMany, detail, "delete some of them"));
    }
    let id = live.request(call.moment, |session, _| session.add_breakpoint(condition));
    Answer::json(&json!({ "id": id }))
}

pub(crate) fn remove_breakpoint(desk: &mut Desk, call: &Call) -> Outcome {
    let id: u64 = call.number("id", "breakpoint")?;
    let live = &mut desk.present(call)?.live;
    match live.request(call.moment, |session, _| session.remove_breakpoint(BreakpointId(id))) {
        true => Answer::done(&Effect::Something),
        false => Err(no_such("breakpoint", &id.to_string())),
    }
}

// --- faults and rules ---

pub(crate) fn faults(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Answer::json(&seen::faults(&live.line().faults(), &live.names))
}

pub(crate) fn begin_fault(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let fault = read_fault(call.text("fault"), &live.names)?;
    let number =
        live.request(call.moment, |session, wall| session.inject_fault(wall, &page(), fault))?;
    Answer::json(&json!({ "number": number }))
}

pub(crate) fn end_fault(desk: &mut Desk, call: &Call) -> Outcome {
    let number = FaultNumber(call.number("number", "fault")?);
    let live = &mut desk.present(call)?.live;
    if !live.line().faults().iter().any(|view| view.number == number) {
        return Err(no_such("fault", &number.0.to_string()));
    }
    let deed = Deed::Fault(Box::new(Faulting::End(number)));
    Answer::done(&live.act(call.moment, deed)?)
}

pub(crate) fn end_faults(desk: &mut Desk, call: &Call) -> Outcome {
    let deed = Deed::Fault(Box::new(Faulting::EndAll));
    Answer::done(&desk.present(call)?.live.act(call.moment, deed)?)
}

pub(crate) fn rules(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &desk.present(call)?.live;
    Answer::json(&seen::rules(&live.line().rules(), &live.names))
}

pub(crate) fn begin_rules(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    let lines = call.text("rules").lines().map(str::trim).filter(|line| !line.is_empty());
    let rules = lines.map(|line| read_rule(line, &live.names)).collect::<Result<Vec<_>, _>>()?;
    if rules.is_empty() {
        let remedy = "write one in each line, such as `when x > 1000: press stop`";
        return Err(Problem::new(Kind::NotUnderstood, "there are no rules", remedy));
    }
    let scenario = Scenario { rules };
    let number =
        live.request(call.moment, |session, wall| session.begin_scenario(wall, &page(), scenario))?;
    Answer::json(&json!({ "scenario": number }))
}

pub(crate) fn end_scenario(desk: &mut Desk, call: &Call) -> Outcome {
    let number = ScenarioNumber(call.number("scenario", "scenario")?);
    let live = &mut desk.present(call)?.live;
    if !live.line().rules().iter().any(|view| view.id.scenario == number) {
        return Err(no_such("scenario", &number.0.to_string()));
    }
    end(live, call, Some(number))
}

pub(crate) fn end_scenarios(desk: &mut Desk, call: &Call) -> Outcome {
    end(&mut desk.present(call)?.live, call, None)
}

fn end(live: &mut Live, call: &Call, number: Option<ScenarioNumber>) -> Outcome {
    let by = page();
    Answer::done(
        &live.request(call.moment, |session, wall| session.end_scenarios(wall, &by, number)),
    )
}

pub(crate) fn reset(desk: &mut Desk, call: &Call) -> Outcome {
    let live = &mut desk.present(call)?.live;
    Answer::done(&live.request(call.moment, |session, wall| session.reset(wall, &page())))
}
