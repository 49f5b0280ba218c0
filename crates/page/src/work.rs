//! A file that a host carries out: what is given to the controller, piece by piece.

use std::ops::ControlFlow;
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value, json};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_catalogue::Handling;
use vimc4_debug::Piece;
use vimc4_device::{Condition, Device};
use vimc4_script::{Host, Kind as Sort, Script, is_job, number, storing, takes_jobs, target, told};

use crate::call::{Answer, Outcome};
use crate::served::Served;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    text: String,
}

/// The axes that a data field is for, if its comments do not say it.
const AXES: u8 = 7;

/// The pieces of a command list, a stored program, a plot or a job for this controller.
pub(crate) fn pieces(served: &Served, content: &str) -> Outcome {
    let File { name, text } = serde_json::from_str(content).map_err(|error| {
        let detail = format!("the file is not there: {error}");
        let remedy = "send an object such as {\"name\":\"part.txt\",\"text\":\"…\"}";
        Problem::new(Kind::WrongRequest, detail, remedy)
    })?;
    let wrong = |why: String| Problem::said(Kind::NotUnderstood, &why, "");
    let host = host(served, &name, &text).map_err(wrong)?;
    if let Some(first) = host.errors.first() {
        let more = match host.errors.len() - 1 {
            0 => String::new(),
            more => format!(" ({more} more)"),
        };
        return Err(Problem::new(
            Kind::NotUnderstood,
            format!("{name}: {}{more}", told(first)),
            "",
        ));
    }
    let pieces = host.pieces.iter().zip(&host.lines);
    let pieces = pieces.map(|(piece, line)| written(served, *line, piece));
    let start = host.start.iter().map(|piece| written(served, 0, piece));
    let pieces: Vec<Value> = pieces.chain(start).collect();
    Answer::json(&json!({ "pieces": pieces }))
}

/// Whether the controller is done with all that it was given by what has been heard, and how many bytes it takes
/// before that: none, if it says when it is done.
pub(crate) fn rest(served: &Served) -> Outcome {
    let Served { live, .. } = served;
    let rests = live.line().is_idle() && live.session.pending().next().is_none();
    let room = match live.line().details().says_when_done() {
        true => 0,
        false => live.line().room(true),
    };
    Answer::json(&json!({ "rests": rests, "room": room }))
}

fn host(served: &Served, name: &str, text: &str) -> Result<Host, String> {
    let live = &served.live;
    let signals = live.line().signals();
    let start = signals.iter().find(|signal| signal.name == "start").map(|start| start.id);
    if takes_jobs(&live.model) && is_job(text.as_bytes()) {
        let target = target(&live.model, &live.machine)?;
        let host = Host::job(text, &target, Default::default(), &|| ControlFlow::Continue(()))?;
        return host.ok_or_else(|| format!("{name} holds nothing"));
    }
    let handling = Handling::of(&live.model);
    let script = Script::of(name, text.as_bytes(), &handling)?;
    Ok(match script.kind {
        Sort::Commands => Host::commands(&script.lines, &handling, start),
        Sort::Stream => Host::stream(&script.lines),
        Sort::DataField => {
            let lines = storing(&script.lines, script.axes.unwrap_or(AXES));
            let mut host = Host::stream(&lines);
            host.lines = lines.iter().map(number).collect();
            host.start = start.map(Piece::Press);
            host
        }
    })
}

/// A piece as it is answered.
fn written(served: &Served, line: u32, piece: &Piece) -> Value {
    match piece {
        Piece::Send(bytes) => {
            let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
            json!({ "line": line, "send": text })
        }
        Piece::Press(signal) => {
            let signals = served.live.line().signals();
            let found = signals.iter().find(|own| own.id == *signal);
            let name = found.map_or("start", |own| &*own.name);
            json!({ "line": line, "order": format!("press {name}") })
        }
        Piece::Wait(span) => json!({ "line": line, "wait": nanos(*span) }),
        Piece::Until(condition, why) => {
            json!({ "line": line, "until": bits(condition), "why": why })
        }
        Piece::Ask(question) => json!({ "line": line, "ask": question }),
    }
}

fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

/// The bits of input ports that a job waits for.
fn bits(condition: &Condition) -> Vec<Value> {
    match condition {
        Condition::All(parts) => parts.iter().flat_map(bits).collect(),
        Condition::PortBit { port, bit, level } => {
            vec![json!({ "port": port, "bit": bit, "level": level })]
        }
        _ => Vec::new(),
    }
}
