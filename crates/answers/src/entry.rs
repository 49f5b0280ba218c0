//! What happened, as people and programs read it.

use std::fmt;

use serde::Serialize;
use serde_json::{Map, Value, json};
use vimc4_control::{News, Report, Talk, Teller, Verbosity, What};
use vimc4_device::{AXES, Event, Motion, Names, Path, Point, Segment, Time, escape};

use crate::feed::Item;
use crate::problem::{Kind, Problem};

/// Every kind of entry, and what it tells.
pub const KINDS: [(&str, &str); 17] = [
    ("command", "a command is being executed: mnemonic, bytes"),
    ("ignored", "something came that is ignored silently: bytes, why"),
    ("line", "a line of the stored program is being executed: line, mnemonic"),
    ("answer", "an answer: mnemonic, bytes, and why, if it is an error"),
    ("cut-short", "a command or program was ended early: mnemonic, why"),
    ("motion", "a motion begins, changes or ends: motion, mnemonic, from, to, steps, points"),
    ("switch", "a limit or reference switch changed: axis, positive, active"),
    ("signal", "a thing of the outside world has another value: signal, value"),
    ("port", "an output port changed: port, value"),
    ("flash", "the non-volatile memory changed: what"),
    ("baud", "the line has another speed: baud"),
    ("fault", "a fault has begun, struck or ended: fault (its number), news"),
    ("rule", "a rule has begun, acted or ended: rule, news"),
    ("warning", "something a real machine would not tell: warning"),
    ("course", "what a command found, for coverage"),
    ("news", "somebody came, went or did something, or time stands still: news"),
    ("missed", "so many are missing here: reports"),
];

/// The kind of an entry.
pub fn kind(report: &Report) -> &'static str {
    let Some(event) = report.event() else {
        return if report.news().is_some() { "news" } else { "missed" };
    };
    match event {
        Event::Command { .. } => "command",
        Event::Ignored { .. } => "ignored",
        Event::Line { .. } => "line",
        Event::Answer { .. } => "answer",
        Event::CutShort { .. } => "cut-short",
        Event::Motion(_) => "motion",
        Event::Switch { .. } => "switch",
        Event::Signal { .. } => "signal",
        Event::Port { .. } => "port",
        Event::Flash { .. } => "flash",
        Event::Baud { .. } => "baud",
        Event::Fault { .. } => "fault",
        Event::Rule { .. } => "rule",
        Event::Warning(_) => "warning",
        _ => "course",
    }
}

/// Whether there are entries of this kind.
#[must_use]
pub fn is_kind(name: &str) -> bool {
    KINDS.iter().any(|(kind, _)| *kind == name)
}

/// What is said of a name that is no kind.
#[must_use]
pub fn unknown_kind(name: &str) -> Problem {
    let known: Vec<&str> = KINDS.iter().map(|(kind, _)| *kind).collect();
    Problem::new(
        Kind::NotUnderstood,
        format!("there is no kind of entry `{name}`"),
        format!("there are {}", known.join(", ")),
    )
}

impl Item {
    /// It as JSON: made once, however many want it.
    pub fn json(&self, names: &Names) -> &str {
        self.json.get_or_init(|| Value::Object(fields(self, names)).to_string().into())
    }
}

/// The words for it, as `serve -v` has them; `None` for what the log leaves out.
pub fn text(item: &Item) -> Option<String> {
    let (mut talk, mut lines) = (Talk::new(Verbosity::Conversation), Lines::default());
    let means = |item: &Item| {
        let means = item.means.to_string();
        move |_: &[u8]| means.clone()
    };
    // An answer is shown with its command.
    if let Some(command) = &item.command {
        talk.tell(&command.report, &means(command), &mut lines);
        lines.0.clear();
    }
    talk.tell(&item.report, &means(item), &mut lines);
    (!lines.0.is_empty()).then(|| lines.0.join("\n").trim().to_owned())
}

/// What is said of one thing.
#[derive(Default)]
struct Lines(Vec<String>);

impl Teller for Lines {
    fn line(&mut self, _: Time, text: fmt::Arguments<'_>) {
        self.0.push(text.to_string());
    }
}

fn fields(item: &Item, names: &Names) -> Map<String, Value> {
    let mut fields = Map::new();
    let mut put = |key: &str, value: Value| _ = fields.insert(key.to_owned(), value);
    put("number", item.number.into());
    put("at", item.report.at.as_nanos().into());
    put("kind", kind(&item.report).into());
    if let Some(text) = text(item) {
        put("text", text.into());
    }
    match &item.report.what {
        What::Event { command, event } => {
            if let Some(command) = command {
                put("command", command.0.get().into());
            }
            if let Event::Motion(motion) = event {
                for (key, value) in course(item, motion) {
                    put(&key, value);
                }
                return fields;
            }
            for (key, value) in object(event) {
                match (key.as_str(), event) {
                    ("event", _) => {}
                    // The entry has a number of its own.
                    ("number", Event::Fault { .. }) => put("fault", value),
                    (
                        "bytes",
                        Event::Command { bytes, .. }
                        | Event::Answer { bytes, .. }
                        | Event::Ignored { bytes, .. },
                    ) => put("bytes", escape(bytes).into()),
                    ("signal", Event::Signal { signal, .. }) => {
                        let known = names.signals().iter().find(|known| known.id == *signal);
                        put("signal", known.map_or(value, |known| known.name.clone().into()));
                    }
                    _ => put(&key, value),
                }
            }
        }
        What::News(news) => {
            for (name, value) in object(news) {
                put("news", name.into());
                put("about", value);
            }
            // Without more to tell it is a word.
            if let Ok(Value::String(name)) = serde_json::to_value(news) {
                put("news", name.into());
            }
            if let News::Deed { by, deed } | News::NoEffect { by, deed, .. } = news {
                put("about", json!({ "by": by.to_string(), "deed": deed.to_string() }));
            }
        }
        What::Missed { reports } => put("reports", (*reports).into()),
        _ => {}
    }
    fields
}

/// Its fields, if it has any. What happens can always be written.
fn object(value: &impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(value) {
        Ok(Value::Object(fields)) => fields,
        _ => Map::new(),
    }
}

// --- where it goes ---

/// A motion of more steps ends only when something ends it.
const ENDLESS: u64 = 1 << 40;

/// A path is given by no more points.
const POINTS: usize = 1_000;

/// An arc is given by so many pieces.
const PIECES: u64 = 64;

fn course(item: &Item, motion: &Motion) -> Map<String, Value> {
    let mut fields = Map::new();
    let mut put = |key: &str, value: Value| _ = fields.insert(key.to_owned(), value);
    if let Some(command) = &item.command
        && let Some(Event::Command { mnemonic, .. }) = command.report.event()
    {
        put("mnemonic", (**mnemonic).into());
    }
    let before = item.course.as_deref();
    let (name, segment, steps) = match motion {
        Motion::Begins { segment, .. } => ("begins", Some(&**segment), segment.profile.steps()),
        Motion::Changes { segment } => ("changes", Some(&**segment), segment.profile.steps()),
        Motion::Ends { steps } => ("ends", before.and_then(segment_of), *steps),
    };
    put("motion", name.into());
    let (Some(origin), Some(segment)) = (origin_of(item), segment) else { return fields };
    let absolute = |offset: Point| -> Vec<i64> {
        (0..AXES).map(|axis| origin[axis].saturating_add(offset[axis])).collect()
    };
    put("from", json!(origin));
    if steps >= ENDLESS {
        put("to", Value::Null);
        return fields;
    }
    put("to", absolute(segment.path.at(steps)).into());
    put("steps", steps.into());
    let points = polyline(&segment.path, steps).into_iter();
    put("points", points.map(absolute).collect::<Vec<_>>().into());
    fields
}

/// Where a motion began.
fn origin_of(item: &Item) -> Option<Point> {
    match item.report.event() {
        Some(Event::Motion(Motion::Begins { origin, .. })) => Some(*origin),
        _ => origin_of(item.course.as_deref()?),
    }
}

fn segment_of(item: &Item) -> Option<&Segment> {
    match item.report.event() {
        Some(Event::Motion(Motion::Begins { segment, .. } | Motion::Changes { segment })) => {
            Some(segment)
        }
        _ => None,
    }
}

/// The first so many steps of a path, as offsets from its start, from corner to corner and along
/// curves.
fn polyline(path: &Path, steps: u64) -> Vec<Point> {
    let mut marks = vec![0];
    corners(path, 0, steps, &mut marks);
    marks.push(steps);
    marks.dedup();
    // What has more corners than anybody sees is thinned.
    let every = marks.len().div_ceil(POINTS).max(1);
    let last = marks.len() - 1;
    let kept = marks.iter().enumerate().filter(|(place, _)| place % every == 0 || *place == last);
    kept.map(|(_, mark)| path.at(*mark)).collect()
}

/// After which steps the direction changes.
fn corners(path: &Path, before: u64, steps: u64, marks: &mut Vec<u64>) {
    let length = path.length();
    match path {
        Path::Line(_) => marks.extend((before + length <= steps).then_some(before + length)),
        Path::Chain(chain) => {
            for (start, link) in chain.links() {
                if before + start < steps {
                    corners(link, before + start, steps, marks);
                }
            }
        }
        Path::Arc(_) | Path::Helix(_) => {
            let pieces = PIECES.min(length).max(1);
            let ends = (1..=pieces).map(|piece| {
                let end = u128::from(length) * u128::from(piece) / u128::from(pieces);
                before + u64::try_from(end).unwrap_or(length)
            });
            marks.extend(ends.take_while(|end| *end <= steps));
        }
    }
}
