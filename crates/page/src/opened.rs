//! A recording that is opened.

use std::fmt::Display;

use serde::Deserialize;
use serde_json::{Value, json};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::profiles::{self, completed_machine, completed_model, known};
use vimc4_catalogue::{State, bare};
use vimc4_device::{Device, Line, LineState, Names, OtherController};
use vimc4_session::{Clock, Source};
use vimc4_timeline::recording::{Comparison, LineSort, Player, Recording, Tolerance, What};

use crate::live::Live;
use crate::served::Served;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    text: String,
}

fn wrong(why: String) -> Problem {
    let remedy = "open what `vimc4 serve --record` or a test has recorded";
    Problem::new(Kind::NotUnderstood, why, remedy)
}

fn at_line(line: u32, why: &dyn Display) -> Problem {
    wrong(format!("line {line}: {why}"))
}

/// The state in a line of a recording, if a controller in the state `own` can continue from it.
fn state_of(own: &State, line: u32, written: &Value) -> Result<LineState<State>, Problem> {
    let state: LineState<State> =
        serde_json::from_value(written.clone()).map_err(|error| at_line(line, &error))?;
    state.device.fits(own).map_err(|OtherController { found, own }| {
        at_line(line, &format!("a state of {found}, and the first line names {own}"))
    })?;
    Ok(state)
}

/// The controller of a recording, with all that happened to it, at its end: its time stands still.
/// Beside it, what is missing of the recording: the number of the line that was torn off, and whether
/// it has its end; and from when on the emulation differs from it, if it does.
pub(crate) fn recorded(content: &str) -> Result<(Served, Value), Problem> {
    let Text { text } = serde_json::from_str(content).map_err(|error| {
        let detail = format!("the recording is not there: {error}");
        Problem::new(Kind::WrongRequest, detail, "send an object such as {\"text\":\"…\"}")
    })?;
    let recording = Recording::read(text.as_bytes()).map_err(|error| wrong(error.to_string()))?;
    let head = &recording.head;
    let model = profiles::model(&completed_model(&head.model)).map_err(wrong)?;
    let machine = profiles::machine(&completed_machine(&head.machine)).map_err(wrong)?;
    let controller = bare(&model, &machine, &[])?;
    let mut line = match head.line {
        LineSort::Ideal => Line::ideal(controller),
        LineSort::Paced => Line::paced(controller),
    };
    let own = line.state().device;
    let player = Player::new(line.clone()).without_meanings();
    let mut comparison = Comparison::new(player, Tolerance::of(head));
    let read = |written: &Value| {
        serde_json::from_value::<LineState<State>>(written.clone())
            .map_err(|error| error.to_string())
    };
    let mut entries = recording.entries.iter().peekable();
    // It begins with a state; without one, as a controller that was just switched on.
    while let Some(entry) = entries.next_if(|entry| !matches!(entry.what, What::Given { .. })) {
        comparison.read(entry, &read, &mut |_| {}).map_err(|error| wrong(error.to_string()))?;
        if let What::State { state, .. } = &entry.what {
            line.restore(state_of(&own, entry.line, state)?);
            break;
        }
    }
    // Whoever goes on from it sees time pass, as fast as it did then, or as it does.
    let clock = head.clock.parse().ok().filter(|clock: &Clock| clock.rate().is_some());
    let clock = clock.unwrap_or(Clock::Real);
    let mut served = Served::new(Live::new(model, machine, line, clock));
    let live = &mut served.live;
    // So that all of it can be saved, with what follows.
    live.record();
    let names = Names::of(live.line());
    // While it was led cause by cause, it was told where it stood.
    let mut is_led = false;
    for entry in entries {
        comparison.read(entry, &read, &mut |_| {}).map_err(|error| wrong(error.to_string()))?;
        comparison
            .take_mismatches()
            .for_each(|found| live.session.device_mut().debugger.add_mismatch(found));
        let is_ahead = entry.at > live.now();
        match &entry.what {
            What::Given { by, given } => {
                let input = known(&names, given).map_err(|why| at_line(entry.line, &why))?;
                live.replay(entry.at, &input, &Source::Controls(by.clone()), is_led);
            }
            What::State { by: Some(by), state } => {
                let state = state_of(&own, entry.line, state)?;
                if is_ahead && !is_led {
                    live.replay_to(entry.at);
                }
                live.replay_state(&Source::Controls(by.clone()), state);
            }
            What::Mark(name) => {
                live.replay_to(entry.at);
                live.session.device_mut().debugger.mark(name.as_str());
            }
            // Led, what is sent comes before it is told how much was done at that instant; at the end
            // nothing comes any more, and time may have gone on after the last of it.
            What::Sent(_) if is_ahead && !is_led => live.replay_to(entry.at),
            What::End(_) if is_ahead => live.replay_to(entry.at),
            What::Stands(causes) => {
                is_led = true;
                live.replay_into(entry.at, *causes);
            }
            What::Goes => is_led = false,
            _ => {}
        }
    }
    comparison.finish();
    comparison
        .take_mismatches()
        .for_each(|found| live.session.device_mut().debugger.add_mismatch(found));
    let differs =
        live.session.device_mut().debugger.differences().first().map(|first| first.mismatch.at);
    live.pause_by(Source::Controls("the end of the recording".into()));
    let is_whole = recording.is_whole();
    Ok((served, json!({ "torn": recording.torn, "is_whole": is_whole, "differs": differs })))
}
