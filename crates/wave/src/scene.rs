//! Which signals there are to draw: those of a device, grouped as people look for them.

use std::collections::{BTreeMap, BTreeSet};

use vimc4_device::{Device, SignalId, SignalKind, Time, View};

/// The number of a drawn signal: its place in [`Scene::signals`].
pub type Id = usize;

/// Something that is drawn over time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal {
    /// The group that it stands in, such as `x`, `line` or `ports`; empty at the top.
    pub group: String,
    /// Its name within the group: ASCII letters, digits and `_`.
    pub name: String,
    /// Its values.
    pub kind: Kind,
    /// Whether a table for people has it. Pulses and bits on the line have another form there.
    pub in_tables: bool,
}

/// What values a signal takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 0 or 1.
    Bit,
    /// Eight bits side by side.
    Byte,
    /// A whole number with a sign.
    Number,
    /// A few words.
    Text,
}

/// A value of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value<'a> {
    /// Of a [`Kind::Bit`].
    Bit(bool),
    /// Of a [`Kind::Byte`].
    Byte(u8),
    /// Of a [`Kind::Number`].
    Number(i64),
    /// Of a [`Kind::Text`].
    Text(&'a str),
}

/// The signals of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scene {
    /// The name of the whole: that of the model, in the letters of a [`Signal::name`].
    pub name: String,
    /// All of them. Those of a group follow each other.
    pub signals: Vec<Signal>,
    pub(crate) places: Places,
}

/// Where the signals are in the list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Places {
    pub(crate) power: Id,
    pub(crate) state: Id,
    pub(crate) spindle: Id,
    pub(crate) command: Id,
    pub(crate) answer: Id,
    pub(crate) program_line: Id,
    pub(crate) note: Id,
    pub(crate) baud: Id,
    pub(crate) receive: [Id; 2],
    pub(crate) transmit: [Id; 2],
    pub(crate) axes: Vec<AxisPlaces>,
    pub(crate) ports: BTreeMap<(u16, bool), Id>,
    pub(crate) signals: BTreeMap<SignalId, Id>,
}

/// Where those of an axis are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct AxisPlaces {
    /// Its place in every point.
    pub(crate) axis: usize,
    pub(crate) step: Id,
    pub(crate) direction: Id,
    pub(crate) enable: Id,
    pub(crate) position: Id,
    /// At the negative and at the positive end.
    pub(crate) limits: [Id; 2],
}

impl Scene {
    /// The signals of a device.
    pub fn of<D: Device>(device: &D) -> Scene {
        Scene::seen(&device.view(device.now()), &device.signals())
    }

    fn seen<T>(view: &View<T>, things: &[vimc4_device::Signal]) -> Scene {
        let mut list = List::default();
        let mut places = Places {
            power: list.add("", "power", Kind::Bit),
            state: list.add("", "state", Kind::Text),
            command: list.add("", "command", Kind::Text),
            answer: list.add("", "answer", Kind::Text),
            program_line: list.add("", "program_line", Kind::Number),
            note: list.add("", "note", Kind::Text),
            spindle: list.add("", "spindle", Kind::Bit),
            ..Places::default()
        };
        for axis in &view.axes {
            let group = identifier(&axis.name.to_lowercase());
            places.axes.push(AxisPlaces {
                axis: usize::from(axis.index),
                step: list.add_fine(&group, "step", Kind::Bit),
                direction: list.add_fine(&group, "dir", Kind::Bit),
                enable: list.add(&group, "enable", Kind::Bit),
                position: list.add(&group, "position", Kind::Number),
                limits: ["limit_minus", "limit_plus"].map(|name| list.add(&group, name, Kind::Bit)),
            });
        }
        places.receive = [("rx", Kind::Bit), ("rx_text", Kind::Text)]
            .map(|(name, kind)| list.add_fine("line", name, kind));
        places.transmit = [("tx", Kind::Bit), ("tx_text", Kind::Text)]
            .map(|(name, kind)| list.add_fine("line", name, kind));
        places.baud = list.add("line", "baud", Kind::Number);
        for port in &view.ports {
            let way = if port.input { "in" } else { "out" };
            let place = list.add("ports", &format!("{way}{}", port.port), Kind::Byte);
            places.ports.insert((port.port, port.input), place);
        }
        for thing in things {
            let kind = match thing.kind {
                SignalKind::Analogue { .. } => Kind::Number,
                _ => Kind::Bit,
            };
            let place = list.add("signals", &thing.name, kind);
            places.signals.insert(thing.id, place);
        }
        Scene { name: identifier(&view.model), signals: list.signals, places }
    }

    /// The path of a signal: the name of the whole, its group and its own name, with points between
    /// them.
    #[must_use]
    pub fn path(&self, signal: &Signal) -> String {
        match signal.group.as_str() {
            "" => format!("{}.{}", self.name, signal.name),
            group => format!("{}.{group}.{}", self.name, signal.name),
        }
    }
}

#[derive(Default)]
struct List {
    signals: Vec<Signal>,
    taken: BTreeSet<(String, String)>,
}

impl List {
    fn add(&mut self, group: &str, name: &str, kind: Kind) -> Id {
        self.put(group, name, kind, true)
    }

    /// Adds one that tables leave out.
    fn add_fine(&mut self, group: &str, name: &str, kind: Kind) -> Id {
        self.put(group, name, kind, false)
    }

    fn put(&mut self, group: &str, name: &str, kind: Kind, in_tables: bool) -> Id {
        let (group, mut name) = (group.to_owned(), identifier(name));
        while !self.taken.insert((group.clone(), name.clone())) {
            name.push('_');
        }
        self.signals.push(Signal { group, name, kind, in_tables });
        self.signals.len() - 1
    }
}

/// A name in letters that every viewer takes: `x-limit+` is `x_limit_plus`.
fn identifier(name: &str) -> String {
    let name = match (name.strip_suffix('+'), name.strip_suffix('-')) {
        (Some(name), _) => format!("{name}_plus"),
        (_, Some(name)) => format!("{name}_minus"),
        _ => name.to_owned(),
    };
    name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect()
}

/// What of the machine has current. A device says it in the words of its family, so its caller knows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drives {
    /// The motors of the axes: a motor without current makes no step.
    pub motors: bool,
    /// The spindle is switched on.
    pub spindle: bool,
}

/// A stretch of time in which one thing was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span<'a> {
    /// What sort of thing.
    pub track: Track,
    /// What.
    pub name: &'a str,
    /// When it began.
    pub from: Time,
    /// When it ended.
    pub to: Time,
    /// How many steps of the clock a motion made; nothing for anything else.
    pub steps: Option<u64>,
}

/// The sorts of things that take their time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Track {
    /// What the controller is doing.
    State,
    /// A command, from its beginning to its answer.
    Command,
    /// An answer, which takes no time.
    Answer,
    /// A motion from standstill to standstill.
    Motion,
    /// A line of the stored program.
    Program,
    /// A warning, a fault or a rule, which take no time.
    Note,
}

impl Track {
    /// All of them, in the order in which people look at them.
    pub const ALL: [Track; 6] =
        [Track::State, Track::Command, Track::Answer, Track::Motion, Track::Program, Track::Note];

    /// What people call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Track::State => "state",
            Track::Command => "commands",
            Track::Answer => "answers",
            Track::Motion => "motions",
            Track::Program => "program",
            Track::Note => "notes",
        }
    }
}
