//! What happened, as people and programs read it.

use std::fmt::{self, Write};
use std::sync::Arc;

use serde::Serialize;
use serde_json::{Map, Value, json};
use vimc4_device::{AXES, Event, Motion, Names, Path, Point, Segment, Time, escape};
use vimc4_session::{LineEvent, Report, ReportKind, Talk, Teller, Verbosity};

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
    /// It as JSON.
    #[must_use]
    pub fn json(&self, names: &Names) -> String {
        let mut text = String::with_capacity(ENTRY);
        self.write(names, &mut text);
        text
    }

    /// Writes it as JSON behind what is there.
    pub fn write(&self, names: &Names, text: &mut String) {
        let mut fields = Fields { text, before: "{\"" };
        tell_all(self, names, &mut fields);
        fields.text.push('}');
    }
}

/// Entries as JSON, with commas between them.
#[must_use]
pub fn list<'a>(items: impl IntoIterator<Item = &'a Arc<Item>>, names: &Names) -> String {
    let mut text = String::new();
    for item in items {
        if !text.is_empty() {
            text.push(',');
        }
        item.write(names, &mut text);
    }
    text
}

/// The words for it, as `serve -v` has them; `None` for what the log leaves out.
pub fn text(item: &Item) -> Option<String> {
    let (mut talk, mut lines) = (Talk::new(Verbosity::Conversation), Lines::default());
    // An answer is shown with its command.
    if let Some(command) = &item.command {
        talk.heard(&command.report);
    }
    talk.tell(&item.report, &|_| item.means.to_string(), &mut lines);
    lines.0.map(|text| text.trim().to_owned())
}

/// What is said of one thing, if anything is.
#[derive(Default)]
struct Lines(Option<String>);

impl Teller for Lines {
    fn line(&mut self, _: Time, text: fmt::Arguments<'_>) {
        self.0 = Some(match self.0.take() {
            Some(before) => format!("{before}\n{text}"),
            None => text.to_string(),
        });
    }
}

/// Most entries are not longer as JSON, bytes.
const ENTRY: usize = 160;

/// The fields of an entry as JSON, which are written as they are told: there may be very many entries.
struct Fields<'a> {
    text: &'a mut String,
    /// What comes before the next of them.
    before: &'static str,
}

impl Fields<'_> {
    /// One that was not told yet. Its key is a name without anything that JSON escapes.
    fn put(&mut self, key: &str, value: impl Into<Value>) {
        self.text.extend([self.before, key, "\":"]);
        self.before = ",\"";
        // Writing to a string cannot fail.
        let _ = write!(self.text, "{}", value.into());
    }

    fn put_all(&mut self, fields: Map<String, Value>) {
        for (key, value) in fields {
            self.put(&key, value);
        }
    }
}

fn tell_all(item: &Item, names: &Names, fields: &mut Fields<'_>) {
    fields.put("number", item.number);
    fields.put("at", item.report.at.as_nanos());
    fields.put("kind", kind(&item.report));
    if let Some(text) = text(item) {
        fields.put("text", text);
    }
    match &item.report.what {
        ReportKind::Event { command, event } => {
            if let Some(command) = command {
                fields.put("command", command.0.get());
            }
            tell(item, event, names, fields);
        }
        ReportKind::News(news) => about(news, fields),
        ReportKind::Missed { reports } => fields.put("reports", *reports),
        _ => {}
    }
}

fn tell(item: &Item, event: &Event, names: &Names, fields: &mut Fields<'_>) {
    match event {
        Event::Command { mnemonic, bytes } => {
            fields.put("mnemonic", &**mnemonic);
            fields.put("bytes", escape(bytes));
        }
        Event::Answer { mnemonic, bytes, why } => {
            fields.put("mnemonic", &**mnemonic);
            fields.put("bytes", escape(bytes));
            if let Some(why) = why {
                fields.put("why", &**why);
            }
        }
        Event::Ignored { bytes, why } => {
            fields.put("bytes", escape(bytes));
            fields.put("why", &**why);
        }
        Event::Signal { signal, value } => {
            let known = names.signals().iter().find(|known| known.id == *signal);
            let name = known.map_or_else(|| signal.0.into(), |known| Value::from(&*known.name));
            fields.put("signal", name);
            fields.put("value", *value);
        }
        // The entry has a number of its own.
        Event::Fault { number, news } => {
            fields.put("fault", number.0);
            fields.put("news", json!(news));
        }
        Event::Motion(motion) => fields.put_all(course(item, motion)),
        event => {
            let mut told = object(event);
            told.remove("event");
            fields.put_all(told);
        }
    }
}

/// The name of a piece of news, and what there is to tell beside it.
fn about(news: &LineEvent, fields: &mut Fields<'_>) {
    let (name, about) = match json!(news) {
        Value::Object(told) => match told.into_iter().next() {
            Some((name, about)) => (Value::from(name), Some(about)),
            None => return,
        },
        // Without more to tell it is a word.
        name => (name, None),
    };
    fields.put("news", name);
    let about = match news {
        LineEvent::Deed { by, deed } | LineEvent::NoEffect { by, deed, .. } => {
            Some(json!({ "by": by.to_string(), "deed": deed.to_string() }))
        }
        _ => about,
    };
    if let Some(about) = about {
        fields.put("about", about);
    }
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

#[cfg(test)]
mod tests {
    use std::num::NonZeroU64;
    use std::sync::Arc;

    use vimc4_device::{
        CommandNumber, Deed, FaultNews, FaultNumber, SignalId, Situation, StopCause, Warning,
    };
    use vimc4_session::{Sink, Source};

    use super::*;
    use crate::feed::Feed;

    /// The entries of what happens one after the other, as JSON.
    fn entries(happens: Vec<ReportKind>) -> Vec<String> {
        let (feed, names) = (Feed::new(Arc::new(|| ())), Names::default());
        let mut ear = feed.sink();
        for (place, what) in happens.into_iter().enumerate() {
            let at = Time::from_nanos(place as u64 * 1_000_000);
            ear.report(&Report { controller: "mill".into(), at, what }, &|_| "in words".to_owned());
        }
        let items = feed.after(0, usize::MAX).items;
        items.iter().map(|item| item.json(&names)).collect()
    }

    fn event(event: Event) -> ReportKind {
        ReportKind::Event { command: NonZeroU64::new(7).map(CommandNumber), event }
    }

    #[test]
    fn an_answer_is_told_with_its_command() {
        let bytes = |text: &'static str| text.as_bytes().into();
        let asked = event(Event::Command { mnemonic: "@P".into(), bytes: bytes("@0P") });
        let why = Some("no reference".into());
        let answered = event(Event::Answer { mnemonic: "@P".into(), bytes: bytes("R\\r"), why });
        assert_eq!(
            entries(vec![asked, answered]),
            [
                r#"{"number":1,"at":0,"kind":"command","text":"@0P  in words","command":7,"mnemonic":"@P","bytes":"@0P"}"#,
                r#"{"number":2,"at":1000000,"kind":"answer","text":"R\\\\r  after 1 ms: no reference","command":7,"mnemonic":"@P","bytes":"R\\\\r","why":"no reference"}"#,
            ]
        );
    }

    #[test]
    fn no_field_of_an_entry_is_told_twice() {
        let bytes = |text: &'static str| text.as_bytes().into();
        let mnemonic = "@A";
        let entries = entries(vec![
            event(Event::Ignored { bytes: bytes("?"), why: "nothing".into() }),
            event(Event::Line { line: 3, mnemonic: mnemonic.into() }),
            event(Event::CutShort { mnemonic: mnemonic.into(), why: "STOP".into() }),
            event(Event::Switch { axis: 0, positive: true, active: true }),
            event(Event::Signal { signal: SignalId(2), value: 1 }),
            event(Event::Port { port: 1, value: 255 }),
            event(Event::Flash { what: "saved".into() }),
            event(Event::Baud { baud: 9_600 }),
            event(Event::Fault { number: FaultNumber(4), news: FaultNews::Ends }),
            event(Event::Warning(Warning::ReceiveOverflow { lost: 9 })),
            event(Event::Warning(Warning::CounterWrapped { axis: 0, name: "X".into(), reads: -1 })),
            event(Event::Course(vimc4_device::Course::Stops {
                mnemonic: mnemonic.into(),
                cause: StopCause::StopByte,
                situation: Situation::StoppedMotion,
            })),
            ReportKind::News(LineEvent::Ends),
            ReportKind::News(LineEvent::Opened {
                transport: "tcp".into(),
                client: "1".into(),
                observes: false,
            }),
            ReportKind::News(LineEvent::Deed {
                by: Source::Controls("test".into()),
                deed: Deed::Power(true),
            }),
            ReportKind::Missed { reports: 5 },
        ]);
        for entry in entries {
            // What is read has each once.
            let read: Value = serde_json::from_str(&entry).expect("it is JSON");
            assert_eq!(read.to_string().len(), entry.len(), "{entry}");
            assert!(is_kind(read["kind"].as_str().unwrap_or_default()), "{entry}");
        }
    }
}
