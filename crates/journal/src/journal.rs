//! What happened, as far back as it is kept.

use std::collections::VecDeque;
use std::fmt::Write;
use std::sync::Arc;

use serde_json::{Map, Value, json};
use vimc4_device::{
    CommandNumber, Deed, Event, Grouped, Motion, Names, Point, SignalId, Stamp, Time, escape,
};

use crate::moves::{Move, moves};
use crate::words::{self, Words};
use crate::{Entry, Picture, What};

/// What happened, in order, as far back as there is room: the oldest entries are dropped first, and
/// counted.
///
/// ```
/// use vimc4_device::{Event, Stamp, Time};
/// use vimc4_journal::{Journal, Picture};
///
/// let mut journal = Journal::new(Picture::default(), 2);
/// for port in 1..=3 {
///     journal.keep(Stamp::from(Time::ZERO), Event::Port { port, value: 1 }, "");
/// }
/// assert_eq!(journal.dropped(), 1);
/// let first = journal.entries().next().ok_or("two are left")?;
/// assert_eq!((first.number, first.event()), (2, Some(&Event::Port { port: 2, value: 1 })));
/// // What is not there any more is known all the same.
/// assert_eq!(journal.start().port(1), Some(1));
/// # Ok::<(), &str>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Journal {
    start: Picture,
    entries: VecDeque<Entry>,
    /// The number of the last entry.
    last: u64,
    dropped: u64,
    room: usize,
    /// How far time has advanced, if that is further than the last entry.
    until: Time,
}

impl Default for Journal {
    fn default() -> Journal {
        Journal::new(Picture::default(), usize::MAX)
    }
}

impl Journal {
    /// An empty journal that begins with this picture and has room for this many entries.
    #[must_use]
    pub fn new(start: Picture, room: usize) -> Journal {
        let until = start.at();
        Journal { start, entries: VecDeque::new(), last: 0, dropped: 0, room, until }
    }

    /// Something has happened. `means` describes a command for people.
    pub fn keep(&mut self, stamp: Stamp, event: Event, means: impl Into<Arc<str>>) -> &Entry {
        self.push(stamp, means.into(), What::Event(event))
    }

    /// Something other than a command was done. `means` describes an immediate byte for people.
    pub fn keep_deed(
        &mut self,
        at: Time,
        by: impl Into<Arc<str>>,
        deed: Deed,
        means: impl Into<Arc<str>>,
    ) -> &Entry {
        self.push(Stamp::from(at), means.into(), What::Deed { by: by.into(), deed })
    }

    fn push(&mut self, Stamp { at, command }: Stamp, means: Arc<str>, what: What) -> &Entry {
        if self.entries.len() >= self.room.max(1)
            && let Some(oldest) = self.entries.pop_front()
        {
            self.start.apply(&oldest);
            self.dropped += 1;
        }
        self.last += 1;
        self.until = at;
        let last = self.entries.len();
        self.entries.push_back(Entry { number: self.last, at, command, means, what });
        &self.entries[last]
    }

    /// Time has come so far.
    pub fn run_to(&mut self, at: Time) {
        self.until = self.until.max(at);
    }

    /// Forgets the entries so far, and begins with the present picture. Numbers go on.
    pub fn forget(&mut self, start: Picture) {
        self.start = start;
        self.entries.clear();
        self.dropped = 0;
    }

    /// How many entries were dropped for lack of room; those that were [forgotten](Journal::forget)
    /// do not count.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The picture before the first entry that is there.
    #[must_use]
    pub fn start(&self) -> &Picture {
        &self.start
    }

    /// How far time has come.
    #[must_use]
    pub fn until(&self) -> Time {
        self.until
    }

    /// Everything that is there, oldest first.
    pub fn entries(&self) -> impl DoubleEndedIterator<Item = &Entry> + Clone {
        self.entries.iter()
    }

    /// The number of the last entry that was kept; 0 if there was none.
    #[must_use]
    pub fn last(&self) -> u64 {
        self.last
    }

    /// A command, its answers, and everything that came of it.
    pub fn of(&self, command: CommandNumber) -> impl Iterator<Item = &Entry> {
        self.entries().filter(move |entry| entry.command == Some(command))
    }

    /// The motions, each with its box. The last one may not have ended yet.
    #[must_use]
    pub fn moves(&self) -> Vec<Move> {
        moves(self.start.running(), self.entries())
    }

    // --- in words ---

    /// All of it in words, one line each, as a conversation is logged, with what is done to the
    /// machine in between. `names` are those of the device.
    pub fn story(&self, names: &Names) -> Vec<String> {
        let mut words = Words::default();
        self.entries().map(|entry| story_line(&mut words, entry, names)).collect()
    }

    /// The lines of the story around an entry, with their numbers: `context` of them before it and
    /// after it.
    #[must_use]
    pub fn around(
        &self,
        number: u64,
        before: u64,
        after: u64,
        names: &Names,
    ) -> Vec<(u64, String)> {
        let (first, last) = (number.saturating_sub(before), number.saturating_add(after));
        let mut words = Words::default();
        // An answer is shown with its command, which may be long before.
        let from = first.saturating_sub(WITH_COMMANDS);
        let shown = self.entries().filter(|entry| (from..=last).contains(&entry.number));
        let lines = shown.map(|entry| (entry.number, story_line(&mut words, entry, names)));
        lines.filter(|(number, _)| *number >= first).collect()
    }

    /// All of it as lines of JSON, each with its end: `number`, `at` in nanoseconds, `command`, and what
    /// it is. Bytes are text as in the log, axes have their names, and motions their box. If entries were
    /// dropped the first line says how many.
    pub fn json_lines(&self, names: &Names) -> String {
        let mut text = String::new();
        if self.dropped > 0 {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", json!({ "dropped": self.dropped }));
        }
        let mut picture = self.start.clone();
        for entry in self.entries() {
            let ended = picture.running().cloned();
            picture.apply(entry);
            let course = picture.running().or(ended.as_ref());
            let over = match entry.event() {
                Some(Event::Motion(Motion::Ends { steps })) => Some((entry.at, *steps)),
                _ => None,
            };
            let course = course.map(|course| Move::new(entry.command, course, over));
            let _ = writeln!(text, "{}", Value::Object(as_json(entry, course.as_ref(), names)));
        }
        text
    }
}

/// How many entries before the shown ones are searched for their commands.
const WITH_COMMANDS: u64 = 64;

fn story_line(words: &mut Words, entry: &Entry, names: &Names) -> String {
    let means = |_: &[u8]| entry.means.to_string();
    let text = match &entry.what {
        What::Deed { by, deed } => words::deed(by, deed, means),
        What::Event(event) => words
            .event(entry.at, entry.command, event, means)
            .unwrap_or_else(|| machine_words(event, names)),
    };
    words::line(entry.at, text)
}

/// What happens to the machine, which the log of a conversation leaves out.
fn machine_words(event: &Event, names: &Names) -> String {
    match event {
        Event::Motion(Motion::Begins { origin, segment }) => {
            let steps = segment.profile.steps();
            let to = segment.path.at(steps);
            let ways = (0_u8..).zip(origin.iter().zip(&to)).filter(|(_, (_, way))| **way != 0);
            let ways: Vec<String> = ways
                .map(|(axis, (from, way))| {
                    let name = names.axis_name(axis).to_uppercase();
                    format!("{name} from {} to {}", Grouped(*from), Grouped(from + way))
                })
                .collect();
            match ways.as_slice() {
                [] => "        moves".to_owned(),
                _ if steps >= ENDLESS => {
                    let axes = ways.iter().filter_map(|way| way.split(' ').next());
                    format!("        moves {}", axes.collect::<Vec<_>>().join(", "))
                }
                ways => format!("        moves {}", ways.join(", ")),
            }
        }
        Event::Motion(Motion::Changes { .. }) => "        brakes".to_owned(),
        Event::Motion(Motion::Ends { .. }) => "        halts".to_owned(),
        Event::Switch { axis, positive, active } => {
            let (end, level) = (if *positive { '+' } else { '-' }, on_off(*active));
            format!("        limit switch {}{end} {level}", names.axis_name(*axis).to_uppercase())
        }
        Event::Signal { signal, value } => {
            format!("        {}", signal_words(*signal, *value, names))
        }
        Event::Port { port, value } => format!("        port {port} is {value}"),
        _ => "        something else happened".to_owned(),
    }
}

/// A motion of more steps ends only when something ends it.
const ENDLESS: u64 = 1 << 40;

fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

/// `cover is open`.
pub(crate) fn signal_words(signal: SignalId, value: i32, names: &Names) -> String {
    let known = names.signals().iter().find(|known| known.id == signal);
    let name = known.map_or_else(|| format!("signal {}", signal.0), |known| known.name.clone());
    let positions = known.and_then(|known| known.positions.as_ref());
    let position = usize::try_from(value).ok().and_then(|value| positions?.get(value));
    match position {
        Some(position) => format!("{name} is {position}"),
        None => format!("{name} is {value}"),
    }
}

// --- as JSON ---

fn as_json(entry: &Entry, course: Option<&Move>, names: &Names) -> Map<String, Value> {
    let mut fields = Map::new();
    let mut put = |key: &str, value: Value| _ = fields.insert(key.to_owned(), value);
    put("number", entry.number.into());
    put("at", entry.at.as_nanos().into());
    if let Some(command) = entry.command {
        put("command", command.0.get().into());
    }
    if !entry.means.is_empty() {
        put("means", Value::from(&*entry.means));
    }
    let what = match &entry.what {
        What::Deed { by, deed } => {
            put("by", Value::from(&**by));
            put("what", deed.to_string().into());
            "deed".into()
        }
        What::Event(Event::Motion(motion)) => {
            if let Some(course) = course {
                let used = |axis: u8| {
                    let axis = usize::from(axis);
                    course.low.get(axis) != course.high.get(axis)
                };
                let point = |point: &Point| {
                    let axes = (0_u8..).zip(point).filter(|(axis, _)| used(*axis));
                    let named = axes.map(|(axis, place)| {
                        (names.axis_name(axis).to_uppercase(), (*place).into())
                    });
                    Value::Object(named.collect())
                };
                put("began", course.began.as_nanos().into());
                put("from", point(&course.from));
                // The end of a motion that only something else ends is not known.
                if course.steps < ENDLESS {
                    put("to", point(&course.to));
                    put("low", point(&course.low));
                    put("high", point(&course.high));
                    put("steps", course.steps.into());
                }
            }
            match motion {
                Motion::Begins { .. } => "moves".into(),
                Motion::Changes { .. } => "brakes".into(),
                Motion::Ends { .. } => "halts".into(),
            }
        }
        What::Event(event) => {
            let mut kind = Value::Null;
            // Serialising events cannot fail.
            if let Ok(Value::Object(own)) = serde_json::to_value(event) {
                for (key, value) in own {
                    match (key.as_str(), event) {
                        ("event", _) => kind = value,
                        ("bytes", Event::Command { bytes, .. })
                        | ("bytes", Event::Answer { bytes, .. })
                        | ("bytes", Event::Ignored { bytes, .. }) => {
                            put("bytes", escape(bytes).into())
                        }
                        ("axis", _) => {
                            let axis = value.as_u64().and_then(|axis| u8::try_from(axis).ok());
                            let name = axis.map(|axis| names.axis_name(axis).to_uppercase());
                            put("axis", name.map_or(value, Value::from));
                        }
                        ("signal", Event::Signal { signal, .. }) => {
                            let known = names.signals().iter().find(|known| known.id == *signal);
                            put("signal", known.map_or(value, |known| known.name.clone().into()));
                        }
                        _ => put(&key, value),
                    }
                }
            }
            kind
        }
    };
    fields.insert("event".to_owned(), what);
    fields
}
