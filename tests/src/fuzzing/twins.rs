//! A controller and its twin: what must make no difference makes none.

use std::ops::Range;

use serde::Serialize;
use serde_json::Value;
use vimc4_device::{
    AxisView, Condition, Device, Event, FlashChange, Input, Kinds, Output, Point, SignalId,
    SignalKind, Stamp, Time, View,
};

use super::chance::Chance;
use super::operations::{Operation, Operations, Setup};
use crate::moments::holds;

/// So many operations count; what follows does not.
const OPERATIONS_MAX: usize = 400;
/// So many things may become due in one run, and so many bytes be sent: an endless program or a
/// long list of `Again` shall not take endlessly long.
const CAUSES_MAX: u32 = 4_000;
const BYTES_MAX: usize = 20_000;
/// So many things are due while a controller comes to rest, and so long does it take at most.
const REST_CAUSES_MAX: u32 = 400;
const REST_MAX_NANOS: u64 = 600_000_000_000;
/// So many things become due at one and the same time at most.
const AT_ONCE_MAX: u32 = 5_000;
/// So many outputs follow from a few bytes and a full receive buffer at most.
const OUTPUTS_MAX: usize = 20_000;

/// A family of controllers, as far as its twins are anything special.
pub(super) trait Family: Device + Clone {
    /// What holds the answers against the tables.
    type Conversation: Conversation<Self>;

    /// Where a counter can be, in steps.
    const COUNTERS: Range<i64>;

    /// The controller that a setup is about, just switched on with the image of its flash memory.
    fn open(setup: Setup, image: &[u8]) -> Self;

    /// Whether a byte acts when it arrives, in the middle of whatever else arrives.
    fn acts_at_once(_byte: u8) -> bool {
        false
    }

    /// A position as the counters hold it.
    fn counted(position: i64) -> i64 {
        position
    }

    /// Nothing in a state takes more memory than the controller has.
    fn check_memory(&self, state: &Value);
}

/// What a controller says and what it may say: everything that is watched goes through here.
pub(super) trait Conversation<D>: Clone {
    /// The conversation with a controller that has just been switched on.
    fn new(controller: &D) -> Self;

    /// A byte that acts at once, or the first of some others, has arrived.
    fn received(&mut self, _byte: u8) {}

    /// The controller has forgotten what it was doing: nothing is answered any more.
    fn reset(&mut self);

    /// The flash memory changes.
    fn flash(&mut self) {}

    /// Something has happened.
    fn event(&mut self, stamp: Stamp, event: &Event);

    /// Bytes leave.
    fn sent(&mut self, bytes: &[u8]);

    /// There is no more output for now.
    fn drained(&mut self, _controller: &D) {}
}

/// Two controllers get the operations that some bytes stand for. One is left alone: nobody
/// watches it, it is woken late, and it goes on from states that were written down and read
/// back. The other is watched, is woken when it asks and at random, and gets its bytes in small
/// pieces. They say the same bytes at the same times, make the same changes to their flash
/// memories and have the same state. What is said is what the tables allow, memories stay
/// within their bounds, and nothing is due in the past.
///
/// # Panics
///
/// If something of this does not hold.
pub(super) fn twins<D: Family>(data: &[u8]) {
    let (setup, operations) = Setup::decode(data);
    let mut twins = Twins::<D>::new(setup, Chance::of(data));
    for operation in Operations::new(operations).take(OPERATIONS_MAX) {
        twins.perform(operation);
        twins.compare();
        if twins.causes_left == 0 || twins.bytes_left == 0 {
            break;
        }
    }
    check_view::<D>(&twins.watched.view(twins.watched.now()));
    twins.keep();
    twins.compare();
}

/// What a controller has said and written since it was last compared.
#[derive(Debug, Default, PartialEq)]
struct Record {
    said: Vec<(Time, u8)>,
    written: Vec<(Time, FlashChange)>,
}

struct Twins<D: Family> {
    setup: Setup,
    chance: Chance,
    /// Left alone.
    alone: D,
    /// Watched and disturbed.
    watched: D,
    said_alone: Record,
    said_watched: Record,
    conversation: D::Conversation,
    /// The file that a host would keep.
    disk: Vec<u8>,
    kept: Option<(D::State, D::Conversation, Vec<u8>)>,
    /// The bytes sent last.
    last: Vec<u8>,
    causes_left: u32,
    bytes_left: usize,
}

impl<D: Family> Twins<D> {
    fn new(setup: Setup, chance: Chance) -> Self {
        let alone = D::open(setup, b"");
        let conversation = D::Conversation::new(&alone);
        let mut watched = alone.clone();
        watched.watch(Kinds::ALL);
        Twins {
            setup,
            chance,
            alone,
            watched,
            said_alone: Record::default(),
            said_watched: Record::default(),
            conversation,
            disk: Vec::new(),
            kept: None,
            last: Vec::new(),
            causes_left: CAUSES_MAX,
            bytes_left: BYTES_MAX,
        }
    }

    fn perform(&mut self, operation: Operation<'_>) {
        let now = self.watched.now();
        match operation {
            Operation::Send(bytes) => {
                self.last = bytes.to_vec();
                self.send(bytes);
            }
            Operation::Again(count) => {
                let bytes = std::mem::take(&mut self.last);
                for _ in 0..count {
                    self.send(&bytes);
                }
                self.last = bytes;
            }
            Operation::Wait(nanos) => self.run_to(now.after_nanos(nanos)),
            Operation::Rest => self.rest(),
            Operation::Next => {
                if let Some(wake) = self.watched.wake() {
                    self.run_to(wake);
                }
            }
            Operation::Before(nanos) => {
                if let Some(wake) = self.watched.wake() {
                    let at = wake.as_nanos().saturating_sub(u64::from(nanos));
                    self.run_to(Time::from_nanos(at).max(now));
                }
            }
            Operation::Signal(place, value) => {
                let listed = self.watched.signals();
                let number = usize::from(place);
                // Numbers of signals that the model does not have mean nothing to it.
                let signal = listed.get(number % (listed.len() + 1));
                let id = signal.map_or(SignalId(u16::from(place)), |signal| signal.id);
                self.both(Input::Signal(id, i32::from(value)));
                self.check_signal(id, i32::from(value));
            }
            Operation::Power(on) => {
                self.both(Input::Power(on));
                if !on {
                    self.conversation.reset();
                }
            }
            Operation::Snapshot => self.keep(),
            Operation::Restore => {
                if let Some((state, conversation, disk)) = self.kept.clone() {
                    self.alone.restore(state.clone());
                    self.watched.restore(state);
                    self.conversation = conversation;
                    self.disk = disk;
                }
            }
            Operation::Restart => {
                self.alone = D::open(self.setup, &self.disk);
                self.watched = self.alone.clone();
                self.watched.watch(Kinds::ALL);
                self.conversation = D::Conversation::new(&self.alone);
            }
            Operation::Look(axis, way) => self.look(axis, i64::from(way)),
        }
    }

    /// What is set is shown, unless it has no lasting value.
    fn check_signal(&self, id: SignalId, value: i32) {
        let listed = self.watched.signals();
        let view = self.watched.view(self.watched.now());
        assert!(
            view.signals.iter().map(|s| (s.id, &s.name)).eq(listed.iter().map(|s| (s.id, &s.name))),
            "shows other signals than it lists"
        );
        let kind = listed.iter().find(|signal| signal.id == id).map(|signal| signal.kind);
        let shown = view.signals.iter().find(|shown| shown.id == id).and_then(|shown| shown.value);
        let set = match kind {
            Some(SignalKind::Analogue { low, high }) => value.clamp(low, high),
            _ => i32::from(value != 0),
        };
        assert!(shown.is_none_or(|shown| shown == set), "{id:?} is {set}, not {shown:?}");
    }

    // --- inputs ---

    /// Sends bytes: whole to the one, in small pieces to the other.
    fn send(&mut self, bytes: &[u8]) {
        let bytes = &bytes[..bytes.len().min(self.bytes_left)];
        self.bytes_left -= bytes.len();
        let at = self.watched.now();
        self.alone.handle(Input::Bytes(bytes), at);
        self.drain_alone();
        let mut rest = bytes;
        while let Some(&first) = rest.first() {
            let plain = rest.iter().position(|&byte| D::acts_at_once(byte));
            let plain = plain.unwrap_or(rest.len());
            let piece = 1 + self.chance.below(12) as usize;
            let (piece, others) = rest.split_at(piece.min(plain).max(1));
            rest = others;
            // An earlier time counts as the present.
            let at = if self.chance.below(2) == 0 { at } else { Time::ZERO };
            self.watched.handle(Input::Bytes(piece), at);
            self.drain_watched();
            self.conversation.received(first);
        }
    }

    /// Gives both the same input, now.
    fn both(&mut self, input: Input<'_>) {
        let at = self.watched.now();
        self.watched.handle(input, at);
        self.drain_watched();
        self.alone.handle(input, at);
        self.drain_alone();
    }

    // --- time ---

    /// Lets both run: the one is woken once, at the end, the other whenever it asks.
    fn run_to(&mut self, at: Time) {
        while let Some(wake) = self.watched.wake().filter(|wake| *wake <= at) {
            if self.causes_left == 0 {
                break;
            }
            self.wake_at(wake);
        }
        let at = if self.causes_left == 0 { self.watched.now() } else { at };
        self.disturb(at);
        self.both_at(at);
    }

    fn both_at(&mut self, at: Time) {
        self.watched.handle(Input::Wake, at);
        self.drain_watched();
        self.alone.handle(Input::Wake, at);
        self.drain_alone();
    }

    fn rest(&mut self) {
        let end = self.watched.now().after_nanos(REST_MAX_NANOS);
        for _ in 0..REST_CAUSES_MAX.min(self.causes_left) {
            match self.watched.wake().filter(|wake| *wake <= end) {
                Some(wake) => self.wake_at(wake),
                None => break,
            }
        }
        self.both_at(self.watched.now());
    }

    /// Wakes the watched one when it asked for it.
    fn wake_at(&mut self, wake: Time) {
        self.causes_left = self.causes_left.saturating_sub(1);
        self.disturb(wake);
        let mut at_once = 0;
        while self.watched.wake() == Some(wake) {
            at_once += 1;
            assert!(at_once < AT_ONCE_MAX, "does more and more in no time");
            // All that is due then, or one cause of it.
            match self.chance.below(2) {
                0 => self.watched.handle(Input::Wake, wake),
                _ => assert!(self.watched.perform(wake), "nothing is due"),
            }
            self.drain_watched();
        }
    }

    /// Wakes the watched one before it asked for it, and looks at it: nothing comes of it.
    fn disturb(&mut self, before: Time) {
        for _ in 0..self.chance.below(3) {
            let now = self.watched.now();
            let early = now.after_nanos(self.chance.below(before.nanos_since(now)));
            if early >= before {
                break;
            }
            let said = (self.said_watched.said.len(), self.said_watched.written.len());
            let wake = self.watched.wake();
            let ahead = self.watched.view(early);
            self.watched.handle(Input::Wake, early);
            self.drain_watched();
            assert_eq!(self.watched.wake(), wake, "waking early changes what is due");
            let now_said = (self.said_watched.said.len(), self.said_watched.written.len());
            assert_eq!(now_said, said, "waking early makes it say something");
            check_view::<D>(&ahead);
            let view = self.watched.view(early);
            // Known: ports are shown as they are now, although a carriage will be elsewhere.
            assert_eq!(ahead, View { ports: ahead.ports.clone(), ..view }, "looks ahead wrongly");
        }
    }

    // --- outputs ---

    fn drain_alone(&mut self) {
        while let Some(output) = self.alone.poll_output() {
            match output {
                Output::Bytes(at, bytes) => {
                    self.said_alone.said.extend(bytes.iter().map(|byte| (at, *byte)));
                }
                Output::Flash(at, change) => self.said_alone.written.push((at, change)),
                Output::Event(_, event) => unreachable!("nobody wanted {event:?}"),
            }
        }
    }

    fn drain_watched(&mut self) {
        let now = self.watched.now();
        let mut latest = Time::ZERO;
        for _ in 0..OUTPUTS_MAX {
            let Some(output) = self.watched.poll_output() else {
                let wake = self.watched.wake();
                assert!(wake.is_none_or(|wake| wake >= now), "is due in the past");
                self.conversation.drained(&self.watched);
                return;
            };
            let at = match output {
                Output::Bytes(at, bytes) => {
                    self.conversation.sent(&bytes);
                    self.said_watched.said.extend(bytes.iter().map(|byte| (at, *byte)));
                    at
                }
                Output::Flash(at, change) => {
                    self.conversation.flash();
                    match &change {
                        FlashChange::Append(bytes) => self.disk.extend_from_slice(bytes),
                        FlashChange::Replace(bytes) => self.disk = bytes.to_vec(),
                    }
                    self.said_watched.written.push((at, change));
                    at
                }
                Output::Event(stamp, event) => {
                    self.conversation.event(stamp, &event);
                    stamp.at
                }
            };
            assert!(latest <= at && at <= now, "outputs are out of order");
            latest = at;
        }
        unreachable!("says more and more");
    }

    // --- what must hold ---

    fn compare(&mut self) {
        assert_eq!(self.said_alone.said, self.said_watched.said, "other bytes, or at other times");
        assert_eq!(self.said_alone.written, self.said_watched.written, "other flash changes");
        self.said_alone = Record::default();
        self.said_watched = Record::default();
        let (a, b) = (self.alone.state(), self.watched.state());
        assert!(a == b, "states differ in {:?}", difference(&a, &b));
        if self.chance.below(4) == 0 {
            check_view::<D>(&self.watched.view(self.watched.now()));
        }
    }

    /// Keeps the state; the one that is left alone goes on from what was read back. Nothing of it
    /// takes more memory than there is, and what is on the disk is what the controller has.
    fn keep(&mut self) {
        let state = self.alone.state();
        let text = serde_json::to_string(&state).unwrap_or_default();
        let back: D::State =
            serde_json::from_str(&text).unwrap_or_else(|error| unreachable!("{error}: {text}"));
        assert!(back == state, "written and read back differ in {:?}", difference(&back, &state));
        self.alone.check_memory(&serde_json::from_str(&text).unwrap_or_default());
        let from_disk = D::open(self.setup, &self.disk);
        assert_eq!(from_disk.flash_image(), self.alone.flash_image(), "the disk is different");
        self.alone = from_disk;
        self.alone.restore(back.clone());
        self.kept = Some((back, self.conversation.clone(), self.disk.clone()));
    }

    /// What is forecast happens, at its time and not before.
    fn look(&mut self, axis: u8, way: i64) {
        let now = self.watched.now();
        let view = self.watched.view(now);
        let place = |axis| view.axes.get(axis).map_or(0, |axis: &AxisView| axis.position);
        let here: Point = std::array::from_fn(place);
        let span = way.abs();
        let count = view.axes.len() as u8;
        let (axis, other) = (axis % count, axis / count);
        let mut conditions = vec![
            Condition::AxisAt { axis, position: here[usize::from(axis)] + way },
            Condition::AxisBelow { axis, position: here[usize::from(axis)] + way },
            Condition::AxisAbove { axis, position: here[usize::from(axis)] + way },
            Condition::Outside { low: here.map(|h| h - span), high: here.map(|h| h + span) },
            Condition::Limit { axis, positive: way > 0, active: way & 2 == 0 },
            Condition::At(now.after_nanos(span.unsigned_abs())),
            Condition::Idle,
        ];
        let ports: Vec<u16> = view.ports.iter().filter(|p| p.input).map(|p| p.port).collect();
        if let Some(port) = ports.get(usize::from(other) % ports.len().max(1)) {
            let (bit, level) = (way as u8 & 7, way & 8 == 0);
            conditions.push(Condition::PortBit { port: *port, bit, level });
        }
        let machine = self.setup.machine();
        for condition in conditions {
            let seen = match condition {
                Condition::AxisAt { axis, position } => {
                    Condition::AxisAt { axis, position: D::counted(position) }
                }
                ref other => other.clone(),
            };
            let holds = |at: Time| {
                let mut later = self.watched.clone();
                later.watch(Kinds::NONE);
                later.handle(Input::Wake, at);
                match seen {
                    // Which switch counts for which end is a setting of some controllers.
                    Condition::Limit { .. } => later.crossing(&seen) == Some(at),
                    _ => holds(&seen, &later.view(at), &machine, &later, &[]),
                }
            };
            let last = self.watched.wake().map(|wake| Time::from_nanos(wake.as_nanos() - 1));
            let last = last.filter(|last| *last >= now);
            match self.watched.crossing(&condition) {
                Some(at) => {
                    assert!(now <= at && last.is_none_or(|last| at <= last), "{condition:?}: {at}");
                    assert!(holds(at), "{condition:?} does not hold at {at}");
                    if at > now {
                        let before = Time::from_nanos(at.as_nanos() - 1);
                        assert!(!holds(before), "{condition:?} holds before {at}");
                    }
                }
                None => {
                    assert!(!holds(now), "{condition:?} holds already");
                    if let Some(last) = last {
                        assert!(!holds(last), "{condition:?} holds at {last}");
                    }
                }
            }
        }
        assert!(!self.watched.explain(&self.last).is_empty());
    }
}

/// Numbers in a picture are within what a controller can hold.
fn check_view<D: Family>(view: &View<D::Details>) {
    for axis in &view.axes {
        assert!(D::COUNTERS.contains(&axis.position), "{axis:?}");
    }
    assert!(view.timers.iter().all(|timer| timer.due >= view.at), "{:?}", view.timers);
}

/// The parts in which two states differ.
fn difference<S: Serialize>(a: &S, b: &S) -> Vec<String> {
    let value = |state: &S| serde_json::to_value(state).unwrap_or_default();
    let (a, b) = (value(a), value(b));
    let keys = a.as_object().into_iter().flat_map(serde_json::Map::keys);
    keys.filter(|key| a[*key] != b[*key])
        .map(|key| format!("{key}: {} and {}", a[key], b[key]))
        .collect()
}
