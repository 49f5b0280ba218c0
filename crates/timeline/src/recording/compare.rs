//! Where a recording and its playback differ.

use std::collections::VecDeque;

use serde_json::Value;
use vimc4_device::{Device, Time};

use super::entry::{Entry, Head, WALL, What};
use super::play::{Player, StateError, Told, exchange};
use super::read::Recording;
use super::reply::{PAUSE, Reply};

/// How exactly times must agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tolerance {
    /// To the nanosecond.
    Exact,
    /// Up to this many nanoseconds earlier or later; at least a hundredth of the time since the
    /// last input.
    Nanos(u64),
}

impl Tolerance {
    /// How exactly the times of a recording are compared where nobody says otherwise: those of a
    /// real controller within 50 ms.
    #[must_use]
    pub fn of(head: &Head) -> Tolerance {
        match head.clock.as_str() {
            WALL => Tolerance::Nanos(50_000_000),
            _ => Tolerance::Exact,
        }
    }
}

/// A byte that came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Said {
    /// When.
    pub at: Time,
    /// The byte.
    pub byte: u8,
}

/// The first byte that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct SaidDifference {
    /// How many bytes came out before, all equal.
    pub before: u64,
    /// What was recorded, or sent by the first device.
    pub one: Option<Said>,
    /// What was played, or sent by the second device.
    pub other: Option<Said>,
    /// What followed on either side, beginning with this byte, as far as it is known.
    pub rest: [Vec<u8>; 2],
    /// The line of the recording at which it was found.
    pub line: u32,
    /// The command that it belongs to: the last that had begun.
    pub command: Option<Told>,
}

/// The first field of the state that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldDifference {
    /// When it was found.
    pub at: Time,
    /// The line of the recording at which it was found.
    pub line: u32,
    /// The field, as in `device.isel.position.0`.
    pub field: String,
    /// Its value in the one.
    pub one: Value,
    /// Its value in the other.
    pub other: Value,
    /// The last command that had begun.
    pub command: Option<Told>,
}

/// What was happening on a side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Side {
    /// What led there, oldest first. It is not known for a recording that is not played.
    pub told: Vec<Told>,
}

/// What differs first, and what led to the first byte, or, if no byte differs, to the field.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The first byte.
    pub said: Option<SaidDifference>,
    /// The first field of the state.
    pub field: Option<FieldDifference>,
    /// The recorded one.
    pub one: Side,
    /// The played one.
    pub other: Side,
}

impl Difference {
    /// From when on the two differ.
    #[must_use]
    pub fn at(&self) -> Option<Time> {
        let said = self.said.iter().flat_map(|said| [said.one, said.other]).flatten();
        said.map(|said| said.at).chain(self.field.as_ref().map(|field| field.at)).min()
    }
}

/// Where the two differ, and how far they were equal.
#[derive(Clone, Debug, PartialEq)]
pub struct Divergence {
    /// What differs, if anything does.
    pub difference: Option<Difference>,
    /// How many bytes came out, equal on both sides.
    pub bytes: u64,
    /// How many inputs were given.
    pub inputs: u64,
    /// How far time came.
    pub end: Time,
}

/// How far a comparison has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoFar<'a> {
    /// How many inputs were given.
    pub inputs: u64,
    /// How many bytes came out, equal on both sides.
    pub bytes: u64,
    /// How far time has come.
    pub at: Time,
    /// The first byte that differs, if one does already: then what else differs is still looked for.
    pub said: Option<&'a SaidDifference>,
    /// The first field of the state that differs, if one does already.
    pub field: Option<&'a FieldDifference>,
}

/// Reads a state, or says why it cannot be read.
pub(super) type Read<'a, D> = &'a dyn Fn(&Value) -> Result<<D as Device>::State, String>;

/// Compares the bytes of two sides as they come.
#[derive(Debug, Default)]
pub(super) struct ByteComparison {
    /// How many bytes were equal before the first difference.
    pub(super) equal: u64,
    pub(super) found: Option<SaidDifference>,
    /// The equal bytes at the end of what was compared, on either side, as far as they are one reply.
    pub(super) reply: [Reply; 2],
}

type Bytes = VecDeque<(Time, u8)>;

impl ByteComparison {
    /// Takes equal bytes from the fronts of both sides, and says whether the next ones differ.
    /// `missing` says whether a side is complete up to the time of a byte that only the other has.
    pub(super) fn differs(
        &mut self,
        one: &mut Bytes,
        other: &mut Bytes,
        agree: impl Fn(Time, Time) -> bool,
        missing: impl Fn(usize, Time) -> bool,
    ) -> bool {
        loop {
            match (one.front().copied(), other.front().copied()) {
                (Some(a), Some(b)) if a.1 != b.1 || !agree(a.0, b.0) => return true,
                (Some(a), Some(b)) => {
                    one.pop_front();
                    other.pop_front();
                    self.equal += u64::from(self.found.is_none());
                    let [mine, others] = &mut self.reply;
                    if mine.last.is_some_and(|last| a.0 > last.after_nanos(PAUSE)) {
                        (*mine, *others) = Default::default();
                    }
                    mine.push(a);
                    others.push(b);
                }
                (Some(a), None) => return missing(1, a.0),
                (None, Some(b)) => return missing(0, b.0),
                (None, None) => return false,
            }
        }
    }

    /// The difference at the fronts of both sides.
    pub(super) fn difference(&self, one: &Bytes, other: &Bytes) -> SaidDifference {
        let said = |side: &Bytes| side.front().map(|&(at, byte)| Said { at, byte });
        let rest = [one, other].map(|side| side.iter().map(|said| said.1).take(40).collect());
        let before = self.equal;
        SaidDifference { before, one: said(one), other: said(other), rest, line: 0, command: None }
    }

    /// Compares what both have sent up to the first difference. `missing` says which side will send
    /// nothing more.
    fn compare(
        &mut self,
        one: &mut Bytes,
        other: &mut Bytes,
        agree: impl Fn(Time, Time) -> bool,
        missing: [bool; 2],
    ) -> bool {
        if self.found.is_some() {
            one.clear();
            other.clear();
            return false;
        }
        let differs = self.differs(one, other, agree, |side, _| missing[side]);
        self.found = differs.then(|| self.difference(one, other));
        differs
    }
}

/// Fields that states have only since a later version of the program. A state that was written down
/// without one says nothing about it.
const LATER: [&str; 2] = ["upwards", "next_switch"];

/// Compares a recorded state with the present one, after everything that is due at that instant.
/// Returns the first field that differs, and what the recorded controller still had to send at that
/// instant.
pub(super) fn differing_state<D: Device + Clone>(
    player: &Player<D>,
    entry: &Entry,
    written: &Value,
    read: D::State,
) -> (Option<FieldDifference>, Vec<(Time, u8)>) {
    let mut field = None;
    let mut recorded = Player::new(player.device().clone());
    recorded.restore(read);
    if !player.is_led() {
        recorded.run_to(entry.at);
    }
    let (one, other) = (recorded.device().state(), player.device().state());
    if one != other {
        let [mut one, mut other] = written_down([&one, &other]);
        for unknown in LATER.into_iter().filter(|name| !mentions(written, name)) {
            leave_out(&mut one, unknown);
            leave_out(&mut other, unknown);
        }
        field = first_field("", &one, &other).map(|(name, one, other)| FieldDifference {
            at: entry.at,
            line: entry.line,
            field: name,
            one,
            other,
            command: last_command(player),
        });
    }
    (field, recorded.said().drain(..).collect())
}

/// How two devices that are compared are meant to differ.
pub struct Aside<'a, D: Device> {
    /// Pairs of values that stand for each other in their states, such as the two models.
    pub values: &'a [(Value, Value)],
    /// Whether two states are the same apart from these. If it says no, the states are serialised
    /// and compared, which takes a hundred times as long.
    pub is_same: &'a dyn Fn(&D::State, &D::State) -> bool,
}

/// Whether two devices send different bytes, or at other times, when a recording is played into
/// them.
///
/// # Errors
///
/// If a recorded state cannot be read.
pub fn say_otherwise<D: Device + Clone>(
    recording: &Recording,
    mut one: Player<D>,
    mut other: Player<D>,
    states: [Read<'_, D>; 2],
) -> Result<bool, StateError> {
    for entry in &recording.entries {
        one.play(entry, states[0])?;
        other.play(entry, states[1])?;
        // Both have come to the same time.
        if one.said() != other.said() {
            return Ok(true);
        }
        one.said().clear();
        other.said().clear();
    }
    Ok(false)
}

/// Plays a recording into two devices and says where they differ: the first byte, and the first
/// field of the state that is not `aside`. `seen` is told after each single thing that one of them has
/// done.
///
/// # Errors
///
/// If a recorded state cannot be read.
pub fn part<D: Device + Clone>(
    recording: &Recording,
    mut one: Player<D>,
    mut other: Player<D>,
    aside: &Aside<'_, D>,
    states: [Read<'_, D>; 2],
    seen: &mut dyn FnMut(SoFar<'_>),
) -> Result<Divergence, StateError> {
    let (mut count, mut field, mut sides) = (ByteComparison::default(), None, None);
    let mut inputs = 0;
    let last = recording.entries.len().saturating_sub(1);
    for (place, entry) in recording.entries.iter().enumerate() {
        let bytes = count.equal;
        let (said, differing) = (count.found.as_ref(), field.as_ref());
        let mut see =
            |device: &D| seen(SoFar { inputs, bytes, at: device.now(), said, field: differing });
        one.play_seen(entry, states[0], &mut |device, _| see(device))?;
        other.play_seen(entry, states[1], &mut |device, _| see(device))?;
        inputs += u64::from(matches!(entry.what, What::Given { .. }));
        let done = [true, true];
        // Both have reached the same time, so anything that only one has sent is a difference.
        let found = count.compare(one.said(), other.said(), |one, other| one == other, done);
        if let Some(found) = count.found.as_mut().filter(|_| found) {
            found.line = entry.line;
            found.command = last_command(&one).or_else(|| last_command(&other));
            sides = Some((side(&one), side(&other)));
        }
        if field.is_none() {
            let (here, there) = (one.device().state(), other.device().state());
            let differs = match (aside.is_same)(&here, &there) {
                true => None,
                false => alike(&here, &there, aside.values),
            };
            field = differs.map(|(name, a, b)| FieldDifference {
                at: entry.at,
                line: entry.line,
                field: name,
                one: a,
                other: b,
                command: last_command(&one),
            });
            if field.is_some() {
                sides.get_or_insert_with(|| (side(&one), side(&other)));
            }
        }
        if count.found.is_some() && field.is_some() || place == last {
            break;
        }
    }
    let end = one.device().now();
    let (here, there) = sides.unwrap_or_else(|| (side(&one), side(&other)));
    let (bytes, said) = (count.equal, count.found);
    let difference = (said.is_some() || field.is_some()).then(|| Difference {
        said,
        field,
        one: here,
        other: there,
    });
    Ok(Divergence { difference, bytes, inputs, end })
}

/// The first input of one recording that the other does not have, or has at another time, as it
/// stands in each. The origin of an input does not count.
#[must_use]
pub fn given_apart<'a>(one: &'a Recording, other: &'a Recording) -> Option<[Option<&'a Entry>; 2]> {
    let given = |recording: &'a Recording| {
        let is_given = |entry: &&Entry| {
            matches!(entry.what, What::Given { .. } | What::State { by: Some(_), .. })
        };
        recording.entries.iter().filter(is_given)
    };
    let same = |one: &Entry, other: &Entry| {
        one.at == other.at
            && match (&one.what, &other.what) {
                (What::Given { given: one, .. }, What::Given { given: other, .. }) => one == other,
                (What::State { state: one, .. }, What::State { state: other, .. }) => one == other,
                _ => false,
            }
    };
    let (mut one, mut other) = (given(one), given(other));
    loop {
        match (one.next(), other.next()) {
            (None, None) => return None,
            (Some(a), Some(b)) if same(a, b) => {}
            apart => return Some(apart.into()),
        }
    }
}

/// The first output byte of one recording that the other does not have, or has at another time.
#[must_use]
pub fn said_apart(one: &Recording, other: &Recording) -> Option<SaidDifference> {
    let said = |recording: &Recording| {
        let said = recording.entries.iter().filter_map(|entry| match &entry.what {
            What::Sent(bytes) => Some(bytes.iter().map(|byte| (entry.at, *byte))),
            _ => None,
        });
        said.flatten().collect::<VecDeque<_>>()
    };
    let mut count = ByteComparison::default();
    let exact = |one: Time, other: Time| one == other;
    count.compare(&mut said(one), &mut said(other), exact, [true, true]);
    count.found
}

/// The first field in which two recorded states of the same time differ, with its value in each and its
/// line in the first recording. States from entry `end` on do not count.
#[must_use]
pub fn states_apart(
    one: &Recording,
    other: &Recording,
    end: usize,
    aside: &[(Value, Value)],
) -> Option<FieldDifference> {
    let states = |recording: &'_ Recording, end: usize| {
        let states = recording.entries.iter().take(end).filter_map(|entry| match &entry.what {
            What::State { by: None, state } => Some((entry.at, entry.line, state.clone())),
            _ => None,
        });
        states.collect::<VecDeque<_>>()
    };
    let (mut ones, mut others) = (states(one, end), states(other, usize::MAX));
    while let (Some((at, line, a)), Some((other_at, _, b))) = (ones.front(), others.front()) {
        if at == other_at {
            let (mut a, mut b) = (a.clone(), b.clone());
            for later in LATER {
                if !mentions(&a, later) || !mentions(&b, later) {
                    leave_out(&mut a, later);
                    leave_out(&mut b, later);
                }
            }
            if let Some((field, one, other)) = alike(&a, &b, aside) {
                let (at, line) = (*at, *line);
                return Some(FieldDifference { at, line, field, one, other, command: None });
            }
        }
        let order = at.cmp(other_at);
        if order.is_le() {
            ones.pop_front();
        }
        if order.is_ge() {
            others.pop_front();
        }
    }
    None
}

/// The first field in which two states differ, with its value in each.
pub fn alike<S: serde::Serialize>(
    one: &S,
    other: &S,
    aside: &[(Value, Value)],
) -> Option<(String, Value, Value)> {
    let [mut one, mut other] = written_down([one, other]);
    for (mine, others) in aside {
        exchange(&mut one, mine, &Value::Null);
        exchange(&mut other, others, &Value::Null);
    }
    first_field("", &one, &other)
}

/// Every state can be written down.
fn written_down<S: serde::Serialize>(states: [&S; 2]) -> [Value; 2] {
    states.map(|state| serde_json::to_value(state).unwrap_or_default())
}

/// Whether a field of this name is anywhere in a value.
fn mentions(value: &Value, name: &str) -> bool {
    match value {
        Value::Object(fields) => {
            fields.contains_key(name) || fields.values().any(|value| mentions(value, name))
        }
        Value::Array(values) => values.iter().any(|value| mentions(value, name)),
        _ => false,
    }
}

/// Takes the fields of this name out of a value.
fn leave_out(value: &mut Value, name: &str) {
    match value {
        Value::Object(fields) => {
            fields.remove(name);
            fields.values_mut().for_each(|value| leave_out(value, name));
        }
        Value::Array(values) => values.iter_mut().for_each(|value| leave_out(value, name)),
        _ => {}
    }
}

/// The first field in which two values differ, with its value in each.
#[must_use]
pub fn first_field(place: &str, one: &Value, other: &Value) -> Option<(String, Value, Value)> {
    let within = |name: &str| match place {
        "" => name.to_owned(),
        _ => format!("{place}.{name}"),
    };
    match (one, other) {
        (Value::Object(one), Value::Object(other)) if one.keys().eq(other.keys()) => one
            .iter()
            .zip(other.values())
            .find_map(|((key, one), other)| first_field(&within(key), one, other)),
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            (0..).zip(one.iter().zip(other)).find_map(|(place, (one, other))| {
                first_field(&within(&format!("{place}")), one, other)
            })
        }
        _ if one == other => None,
        _ => Some((place.to_owned(), one.clone(), other.clone())),
    }
}

/// How much earlier or later a time may be, in nanoseconds.
pub(super) fn slack(tolerance: Tolerance, at: Time, given: Time) -> u64 {
    match tolerance {
        Tolerance::Exact => 0,
        Tolerance::Nanos(nanos) => nanos.max(at.as_nanos().saturating_sub(given.as_nanos()) / 100),
    }
}

pub(super) fn side<D: Device + Clone>(player: &Player<D>) -> Side {
    Side { told: player.told().cloned().collect() }
}

pub(super) fn last_command<D: Device + Clone>(player: &Player<D>) -> Option<Told> {
    let is_command = |told: &&Told| matches!(told.event, vimc4_device::Event::Command { .. });
    player.told().filter(is_command).last().cloned()
}
