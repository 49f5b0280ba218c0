//! All that was done to a controller up to the moment that is looked at, in words that do it again.

use bytes::Bytes;
use serde_json::{Value, json};
use vimc4_answers::past::way;
use vimc4_answers::problem::{Kind, Problem};
use vimc4_debug::Debugger;
use vimc4_device::{Deed, Device, Names, OwnedInput, Ruling, Signal, SignalId, TimedInput};
use vimc4_timeline::{BranchId, Place};

use crate::call::{Answer, Outcome};
use crate::served::Served;

/// The moment that is looked at, and what was done on the way there: when, what it was, and with which words. Only
/// what the controller got counts, so it is the same whether it was sent, ordered or typed in the debugger.
pub(crate) fn deeds(served: &mut Served) -> Outcome {
    if served.live.line().line().is_paced() {
        let detail =
            "its line takes time for each character, and a link begins with one that takes none";
        return Err(Problem::new(Kind::NotNow, detail, "save a recording, which has that line"));
    }
    let (at, here) = (served.debugger().now(), served.debugger().place());
    let mut inputs = given(served.debugger())?;
    if served.looks.as_ref().is_none_or(|looks| looks.live == here) {
        let waits = served.live.session.pending().cloned();
        inputs.extend(waits.map(|input| TimedInput { at, input }));
    }
    let names = &served.live.names;
    let mut inputs = inputs.iter().peekable();
    let mut deeds = Vec::new();
    while let Some(input) = inputs.next() {
        let pressed = pressed(names, input);
        let is_released =
            |next: &&TimedInput| pressed.as_ref().is_some_and(|(_, released)| *released == **next);
        match inputs.next_if(is_released) {
            Some(_) => deeds.extend(pressed.map(|(order, _)| json!([input.at, "order", order]))),
            None => deeds.extend(deed(names, input)),
        }
    }
    Answer::json(&json!({ "at": at, "deeds": deeds }))
}

/// What the controller has got on the way to the present, and what it gets there at once.
fn given(debugger: &mut Debugger) -> Result<Vec<TimedInput>, Problem> {
    let here = debugger.place();
    let is_at_end = debugger.history().is_at_end();
    let mut all = Vec::new();
    for place in way(debugger.history(), here).into_iter().rev() {
        let Place { branch, moment } = place;
        if was_put_there(debugger, branch) {
            let detail = "on the way here it was put into another state by hand";
            return Err(Problem::new(
                Kind::NotNow,
                detail,
                "save a recording, which has that in it",
            ));
        }
        let mut inputs = debugger.history().inputs(branch, 0);
        if is_at_end && place == here {
            all.extend(inputs);
            break;
        }
        all.extend(inputs.by_ref().take(usize::try_from(moment.inputs).unwrap_or(usize::MAX)));
        // Of the last piece it may have had a part.
        if let Some(TimedInput { at, input: OwnedInput::Bytes(bytes) }) = inputs.next()
            && moment.bytes > 0
        {
            let part = bytes.slice(..bytes.len().min(moment.bytes as usize));
            all.push(TimedInput { at, input: OwnedInput::Bytes(part) });
        }
    }
    Ok(all)
}

/// Whether a branch begins in another state than that in which the branch was that it left.
fn was_put_there(debugger: &mut Debugger, branch: BranchId) -> bool {
    let history = debugger.history();
    let found = history.branches().find(|own| own.id == branch);
    let Some((first, parted)) = found.and_then(|own| Some((own.first, own.parted?))) else {
        return false;
    };
    let (here, heading) = (history.present(), history.heading());
    let history = debugger.history_mut();
    let mut state = |place| {
        history.go_to(place);
        history.device().state()
    };
    let is_other = state(parted) != state(Place { branch, moment: first });
    history.go_to_end(heading);
    history.go_back_to(here);
    history.drain();
    is_other
}

/// How a button is pressed by this, and what releases it again in the same order.
fn pressed(names: &Names, TimedInput { at, input }: &TimedInput) -> Option<(String, TimedInput)> {
    let OwnedInput::Signal(id, 1) = input else { return None };
    let button = signal(names, *id).filter(|signal| signal.can_be_pressed() && !signal.latches)?;
    let order = Deed::Press(button.name.clone()).to_string();
    Some((order, TimedInput { at: *at, input: OwnedInput::Signal(*id, 0) }))
}

fn signal(names: &Names, id: SignalId) -> Option<&Signal> {
    names.signals().iter().find(|signal| signal.id == id)
}

fn deed(names: &Names, TimedInput { at, input }: &TimedInput) -> Option<Value> {
    let ordered = |deed: &Deed| json!([at, "order", names.write_deed(deed)]);
    Some(match input {
        OwnedInput::Bytes(bytes) => json!([at, "send", characters(bytes)]),
        OwnedInput::Signal(id, value) => {
            let signal = signal(names, *id)?;
            let mut positions = (0..).zip(signal.positions.iter().flatten());
            match positions.find(|(own, _)| own == value) {
                Some((_, position)) => json!([at, "set", signal.name, position]),
                None => json!([at, "set", signal.name, value]),
            }
        }
        OwnedInput::Power(on) => ordered(&Deed::Power(*on)),
        OwnedInput::Fault(faulting) => ordered(&Deed::Fault(Box::new(faulting.clone()))),
        OwnedInput::Rule(Ruling::Begin(_, scenario)) => {
            let rules: Vec<String> =
                scenario.rules.iter().map(|rule| names.write_rule(rule)).collect();
            json!([at, "rules", rules.join("\n")])
        }
        OwnedInput::Rule(Ruling::End(number)) => json!([at, "end-rules", number.to_string()]),
        OwnedInput::Rule(Ruling::EndAll) => json!([at, "end-rules", ""]),
        OwnedInput::Wake => return None,
    })
}

/// Each byte as the character of its number.
fn characters(bytes: &Bytes) -> String {
    bytes.iter().map(|byte| char::from(*byte)).collect()
}
