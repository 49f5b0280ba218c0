//! What is known of a stretch of a history without replaying it.

use vimc4_device::{AXES, CommandNumber, Condition, Device, Event, Kinds, Output, Point, SignalId};

/// What has been seen between two kept states. It leaves out a lot, but whatever it rules out did
/// not happen. That makes searches fast.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Where the counters of the axes have been.
    low: Point,
    high: Point,
    /// The kinds of events that were watched all the time.
    watched: Kinds,
    /// The kinds of events that have happened.
    happened: Kinds,
    /// Marks of commands by name and beginning, and of answers.
    commands: Marks,
    answers: Marks,
    errors: Marks,
    signals: Marks,
    /// The least and the greatest number of a line of a program.
    lines: Option<(u32, u32)>,
    /// The first and the last command.
    numbers: Option<(CommandNumber, CommandNumber)>,
}

/// A set that may seem to hold more than was put in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Marks(u128);

impl Marks {
    fn of(thing: &[u8]) -> Marks {
        // FNV, and the upper bits, which are the better ones.
        let hash = thing.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        });
        Marks(1 << (hash >> 57))
    }

    fn add(&mut self, others: Marks) {
        self.0 |= others.0;
    }

    fn may_hold(self, thing: &[u8]) -> bool {
        self.0 & Marks::of(thing).0 != 0
    }
}

/// How many bytes of a command are compared.
const BEGINNING: usize = 4;

/// Beyond this, in steps, counters that wrap show other numbers than their names say.
const WRAPS: i64 = 1 << 23;

impl Stretch {
    /// Begins with a device as it is, which is watched for these kinds of events.
    pub(crate) fn new<D: Device>(device: &D, watched: Kinds) -> Stretch {
        let mut stretch = Stretch {
            low: [i64::MAX; AXES],
            high: [i64::MIN; AXES],
            watched,
            happened: Kinds::NONE,
            commands: Marks::default(),
            answers: Marks::default(),
            errors: Marks::default(),
            signals: Marks::default(),
            lines: None,
            numbers: None,
        };
        let (low, high) = device.reach();
        stretch.reaches(&low, &high);
        stretch
    }

    /// The counters of the axes have been between these.
    pub(crate) fn reaches(&mut self, low: &Point, high: &Point) {
        for axis in 0..AXES {
            self.low[axis] = self.low[axis].min(low[axis]);
            self.high[axis] = self.high[axis].max(high[axis]);
        }
    }

    /// From now on only these kinds of events count as watched throughout.
    pub(crate) fn watched(&mut self, kinds: Kinds) {
        self.watched = self.watched.also_in(kinds);
    }

    /// Something has come out.
    pub(crate) fn saw(&mut self, output: &Output) {
        let Output::Event(stamp, event) = output else { return };
        self.happened = self.happened.and(event.kind());
        match event {
            Event::Command { mnemonic, bytes } => {
                self.commands.add(Marks::of(mnemonic.as_bytes()));
                for end in 1..=BEGINNING.min(bytes.len()) {
                    self.commands.add(Marks::of(&bytes[..end]));
                }
                if let Some(number) = stamp.command {
                    let (first, last) = self.numbers.unwrap_or((number, number));
                    self.numbers = Some((first.min(number), last.max(number)));
                }
            }
            Event::Line { line, .. } => {
                let (first, last) = self.lines.unwrap_or((*line, *line));
                self.lines = Some((first.min(*line), last.max(*line)));
            }
            Event::Answer { mnemonic, bytes, why } => {
                let text = bytes.trim_ascii_end();
                self.answers.add(Marks::of(mnemonic.as_bytes()));
                self.answers.add(Marks::of(text));
                if why.is_some() {
                    self.errors.add(Marks::of(b""));
                    self.errors.add(Marks::of(text));
                    self.errors.add(Marks::of(text.get(1..).unwrap_or_default()));
                }
            }
            Event::Signal { signal: SignalId(id), .. } => {
                self.signals.add(Marks::of(&id.to_le_bytes()));
            }
            _ => {}
        }
    }

    /// Joins this stretch and the one after it.
    pub(crate) fn join(&mut self, next: &Stretch) {
        fn range<T: Ord + Copy>(one: Option<(T, T)>, other: Option<(T, T)>) -> Option<(T, T)> {
            match (one, other) {
                (Some((low, high)), Some((least, most))) => Some((low.min(least), high.max(most))),
                (one, other) => one.or(other),
            }
        }
        self.reaches(&next.low, &next.high);
        self.watched(next.watched);
        self.happened = self.happened.and(next.happened);
        self.commands.add(next.commands);
        self.answers.add(next.answers);
        self.errors.add(next.errors);
        self.signals.add(next.signals);
        self.lines = range(self.lines, next.lines);
        self.numbers = range(self.numbers, next.numbers);
    }

    /// Whether an event of one of these kinds can have happened.
    #[must_use]
    pub fn can_have(&self, kinds: Kinds) -> bool {
        !self.watched.contain(kinds) || self.happened.also_in(kinds) != Kinds::NONE
    }

    /// Whether the command of a number can have begun.
    #[must_use]
    pub fn can_have_command(&self, number: CommandNumber) -> bool {
        let within = |(first, last)| (first..=last).contains(&number);
        !self.watched.contain(Kinds::COMMAND) || self.numbers.is_some_and(within)
    }

    /// Whether a condition can have held.
    #[must_use]
    pub fn can_meet(&self, condition: &Condition) -> bool {
        let kinds = condition.kinds();
        let place = |axis: u8| {
            let axis = usize::from(axis);
            Some((*self.low.get(axis)?, *self.high.get(axis)?))
        };
        match condition {
            Condition::All(parts) => parts.iter().all(|part| self.can_meet(part)),
            Condition::Any(parts) => parts.iter().any(|part| self.can_meet(part)),
            Condition::AxisAt { axis, position } => {
                let within = |(low, high)| (low..=high).contains(position);
                position.saturating_abs() >= WRAPS || place(*axis).is_none_or(within)
            }
            Condition::AxisBelow { axis, position } => {
                place(*axis).is_none_or(|(low, _)| low < *position)
            }
            Condition::AxisAbove { axis, position } => {
                place(*axis).is_none_or(|(_, high)| high > *position)
            }
            Condition::Outside { low, high } => {
                (0..AXES).any(|axis| self.low[axis] < low[axis] || self.high[axis] > high[axis])
            }
            _ if kinds == Kinds::NONE => true,
            _ if !self.watched.contain(kinds) => true,
            Condition::Command { like: Some(like) } => {
                let beginning = &like.as_bytes()[..like.len().min(BEGINNING)];
                self.commands.may_hold(like.as_bytes()) || self.commands.may_hold(beginning)
            }
            // The lines of a program are events of the same kind, and are no commands.
            Condition::Command { like: None } => self.numbers.is_some(),
            Condition::Answered { like: Some(like) } => self.answers.may_hold(like.as_bytes()),
            Condition::Answer { text } => self.answers.may_hold(text.as_bytes()),
            Condition::Error { code } => {
                self.errors.may_hold(code.as_deref().unwrap_or_default().as_bytes())
            }
            Condition::Line { line: Some(line) } => {
                self.lines.is_some_and(|(first, last)| (first..=last).contains(line))
            }
            Condition::SignalChanges { signal, .. } => {
                self.signals.may_hold(&signal.0.to_le_bytes())
            }
            _ => self.happened.also_in(kinds) != Kinds::NONE,
        }
    }
}
