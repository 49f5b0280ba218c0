//! Comparing a recording with the emulation while it is read.

use std::collections::VecDeque;
use std::fmt;

use serde_json::Value;
use vimc4_device::{CommandNumber, Device, Event, Time, show_nanos};

use super::compare::{
    ByteComparison, Difference, Divergence, FieldDifference, Read, Side, SoFar, Tolerance,
    differing_state, last_command, side, slack,
};
use super::entry::{Entry, What};
use super::play::{Player, StateError};
use super::read::Recording;
use super::reply::{PAUSE, Reply};

/// The longest value of a field in a text.
const VALUE_MAX: usize = 60;

/// A place at which the emulation does something else than the recording says.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    /// The time of the first byte that differs, or of the recorded state.
    pub at: Time,
    /// The line of the recording at which it was found.
    pub line: u32,
    /// The command that the emulated reply belongs to; without one, the last command before.
    pub command: Option<CommandNumber>,
    /// What differs.
    pub kind: MismatchKind,
}

/// What differs between a recording and the emulation.
#[derive(Clone, Debug, PartialEq)]
pub enum MismatchKind {
    /// A reply: its bytes, or its time.
    Reply {
        /// What was recorded.
        recorded: Reply,
        /// What the emulated controller sent.
        emulated: Reply,
    },
    /// A recorded state.
    State {
        /// The first field that differs, as in `device.isel.position.0`.
        field: String,
        /// Its recorded value.
        recorded: Value,
        /// Its value in the emulation.
        emulated: Value,
    },
}

impl Mismatch {
    /// Its time, for people: `8.698 s`.
    #[must_use]
    pub fn seconds(&self) -> String {
        let millis = self.at.as_nanos() / 1_000_000;
        format!("{}.{:03} s", millis / 1_000, millis % 1_000)
    }

    /// Where the emulation begins to differ, for people, if this is the first place.
    #[must_use]
    pub fn summary(&self) -> String {
        format!("the emulation differs from the recording from {} on: {self}", self.seconds())
    }

    /// What was recorded and what was emulated, as texts.
    #[must_use]
    pub fn sides(&self) -> [String; 2] {
        let value = |value: &Value| {
            let text = value.to_string();
            match text.char_indices().nth(VALUE_MAX) {
                Some((end, _)) => format!("{}…", &text[..end]),
                None => text,
            }
        };
        match &self.kind {
            MismatchKind::Reply { recorded, emulated } if recorded.bytes == emulated.bytes => {
                [recorded, emulated].map(|reply| {
                    let at = reply.first.map_or(0, Time::as_nanos);
                    format!("{reply} at {}", show_nanos(at))
                })
            }
            MismatchKind::Reply { recorded, emulated } => {
                [recorded.to_string(), emulated.to_string()]
            }
            MismatchKind::State { recorded, emulated, .. } => [value(recorded), value(emulated)],
        }
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.kind, self.command) {
            (MismatchKind::State { field, .. }, _) => write!(f, "{field}: ")?,
            (MismatchKind::Reply { emulated, .. }, Some(command)) => {
                let place = if emulated.bytes.is_empty() { "after" } else { "reply to" };
                write!(f, "{place} command {command}: ")?;
            }
            (MismatchKind::Reply { .. }, None) => {}
        }
        let [recorded, emulated] = self.sides();
        write!(f, "recorded {recorded}, emulated {emulated} (line {})", self.line)
    }
}

/// A mismatch that may go on.
#[derive(Debug)]
struct OpenMismatch {
    at: Time,
    line: u32,
    /// Recorded and emulated.
    sides: [Reply; 2],
    /// Which side has bytes that differ. The other one is waited for.
    has: [bool; 2],
    /// The time of its last byte.
    end: Time,
    /// Later bytes do not belong to it.
    deadline: Option<Time>,
    command: Option<CommandNumber>,
}

/// Compares a recording with the emulation, line by line as it is read: every reply and every recorded
/// state. It is fed with all entries, and played into a device of its own.
#[derive(Debug)]
pub struct Comparison<D: Device> {
    player: Player<D>,
    tolerance: Tolerance,
    /// Recorded bytes that are not compared yet.
    recorded: VecDeque<(Time, u8)>,
    count: ByteComparison,
    field: Option<FieldDifference>,
    /// What happened before the first difference.
    other: Option<Side>,
    inputs: u64,
    given_at: Time,
    /// How far the recording has come.
    read_at: Time,
    line: u32,
    has_ended: bool,
    open: Option<OpenMismatch>,
    mismatches: VecDeque<Mismatch>,
}

impl<D: Device + Clone> Comparison<D> {
    /// Begins with a device that has just been switched on.
    #[must_use]
    pub fn new(player: Player<D>, tolerance: Tolerance) -> Comparison<D> {
        Comparison {
            player,
            tolerance,
            recorded: VecDeque::new(),
            count: ByteComparison::default(),
            field: None,
            other: None,
            inputs: 0,
            given_at: Time::ZERO,
            read_at: Time::ZERO,
            line: 0,
            has_ended: false,
            open: None,
            mismatches: VecDeque::new(),
        }
    }

    /// Plays the next entry and compares it. `state` reads a state; `seen` is told after each single
    /// thing that the device has done.
    ///
    /// # Errors
    ///
    /// If a recorded state cannot be read.
    pub fn read(
        &mut self,
        entry: &Entry,
        state: Read<'_, D>,
        seen: &mut dyn FnMut(SoFar<'_>),
    ) -> Result<(), StateError> {
        self.line = entry.line;
        let begun = self.player.has_begun();
        let is_put = begun && matches!(entry.what, What::State { by: Some(_), .. });
        if is_put || matches!(entry.what, What::Given { .. }) {
            self.settle(entry, is_put, seen);
        }
        let Comparison { player, count, field, inputs, .. } = self;
        player.play_seen(entry, state, &mut |device, _| {
            let (bytes, said) = (count.equal, count.found.as_ref());
            let at = device.now();
            seen(SoFar { inputs: *inputs, bytes, at, said, field: field.as_ref() });
        })?;
        let mut missing = [false, false];
        match &entry.what {
            What::Given { .. } => {
                self.inputs += 1;
                self.given_at = entry.at;
            }
            What::Sent(bytes) => {
                self.recorded.extend(bytes.iter().map(|byte| (entry.at, *byte)));
                missing[1] = self.tolerance == Tolerance::Exact && !self.player.is_led();
            }
            What::State { by: None, state: written } if begun => {
                let read = state(written).map_err(|why| StateError { line: entry.line, why })?;
                self.compare_state(entry, written, read);
            }
            _ => {}
        }
        self.has_ended = matches!(entry.what, What::End(_));
        match &entry.what {
            // Going back to a state goes back to its time.
            What::State { by: Some(_), .. } => self.read_at = self.player.device().now(),
            // The time of these is that of a clock, which may be ahead.
            What::News(_) | What::Mark(_) => {}
            _ => self.read_at = self.read_at.max(entry.at),
        }
        self.compare(missing);
        Ok(())
    }

    /// The recording is at its end: nothing more is waited for.
    pub fn finish(&mut self) {
        let mut missing = [self.has_ended, true];
        if self.tolerance != Tolerance::Exact {
            // Output that was still to come on a real line comes a little later here.
            let slack = slack(self.tolerance, self.read_at, self.given_at);
            self.player.run_to(self.read_at.after_nanos(slack));
            missing[0] = false;
        }
        self.compare(missing);
        while self.close() {
            self.compare(missing);
        }
    }

    /// Takes the mismatches that were found since the last time, in their order.
    pub fn take_mismatches(&mut self) -> impl Iterator<Item = Mismatch> {
        self.mismatches.drain(..)
    }

    /// Whether both a byte and a field that differ were found.
    pub(super) fn has_found_all(&self) -> bool {
        self.count.found.is_some() && self.field.is_some()
    }

    /// The first differences, and how far both were equal.
    pub(super) fn into_divergence(self) -> Divergence {
        let Comparison { player, count, field, other, inputs, .. } = self;
        let other = other.unwrap_or_else(|| side(&player));
        let (bytes, said) = (count.equal, count.found);
        let difference = (said.is_some() || field.is_some()).then(|| Difference {
            said,
            field,
            one: Side::default(),
            other,
        });
        Divergence { difference, bytes, inputs, end: player.device().now() }
    }

    /// Something goes in: what came out before belongs to what went in before.
    fn settle(&mut self, entry: &Entry, is_put: bool, seen: &mut dyn FnMut(SoFar<'_>)) {
        let is_exact = self.tolerance == Tolerance::Exact;
        if is_put || is_exact && !self.player.is_led() {
            if !self.player.is_led() {
                let Comparison { player, count, field, inputs, .. } = self;
                player.run_to_seen(entry.at, &mut |device, _| {
                    let (bytes, said) = (count.equal, count.found.as_ref());
                    let at = device.now();
                    seen(SoFar { inputs: *inputs, bytes, at, said, field: field.as_ref() });
                });
            }
            let missing = [is_exact, is_exact];
            self.compare(missing);
            while self.close() {
                self.compare(missing);
            }
        } else if let Some(open) = &mut self.open {
            let slack = slack(self.tolerance, entry.at, self.given_at);
            open.deadline.get_or_insert(entry.at.after_nanos(slack));
        }
        self.count.reply = Default::default();
    }

    /// Compares a recorded state with the present one.
    fn compare_state(&mut self, entry: &Entry, written: &Value, read: D::State) {
        let (field, due) = differing_state(&self.player, entry, written, read);
        self.recorded.extend(due);
        let Some(found) = field else { return };
        self.other.get_or_insert_with(|| side(&self.player));
        self.mismatches.push_back(Mismatch {
            at: found.at,
            line: found.line,
            command: found.command.as_ref().and_then(|told| told.command),
            kind: MismatchKind::State {
                field: found.field.clone(),
                recorded: found.one.clone(),
                emulated: found.other.clone(),
            },
        });
        self.field.get_or_insert(found);
    }

    /// Compares the bytes that both have sent. `missing` says which side is complete.
    fn compare(&mut self, missing: [bool; 2]) {
        loop {
            if self.open.is_some() {
                if !self.goes_on() {
                    return;
                }
                self.close();
            }
            let Comparison { player, tolerance, recorded, count, given_at, read_at, .. } = self;
            let (tolerance, given_at) = (*tolerance, *given_at);
            let known = [*read_at, player.device().now()];
            let agree = |one: Time, other: Time| match tolerance {
                Tolerance::Exact => one == other,
                Tolerance::Nanos(_) => {
                    let apart = one.as_nanos().abs_diff(other.as_nanos());
                    apart <= slack(tolerance, one, given_at)
                }
            };
            let is_missing = |side: usize, at: Time| {
                missing[side] || known[side] > at.after_nanos(slack(tolerance, at, given_at))
            };
            if !count.differs(recorded, player.said(), agree, is_missing) {
                return;
            }
            self.begin_mismatch();
        }
    }

    /// The next bytes of both sides differ.
    fn begin_mismatch(&mut self) {
        let command = last_command(&self.player);
        let emulated = self.player.said();
        let fronts = [&self.recorded, emulated].map(|side| side.front().map(|byte| byte.0));
        if self.count.found.is_none() {
            let mut found = self.count.difference(&self.recorded, emulated);
            found.line = self.line;
            found.command.clone_from(&command);
            self.count.found = Some(found);
            self.other = Some(side(&self.player));
        }
        let at = fronts.into_iter().flatten().min().unwrap_or_default();
        if self.count.reply[0].last.is_some_and(|last| at > last.after_nanos(PAUSE)) {
            self.count.reply = Default::default();
        }
        self.open = Some(OpenMismatch {
            at,
            line: self.line,
            sides: std::mem::take(&mut self.count.reply),
            has: [false, false],
            end: at,
            deadline: None,
            command: command.and_then(|told| told.command),
        });
    }

    /// Adds the bytes that belong to the open mismatch, and says whether it is complete.
    fn goes_on(&mut self) -> bool {
        let known = self.read_at.min(self.player.device().now());
        let Some(open) = &mut self.open else { return false };
        let emulated = self.player.said();
        loop {
            let limit = |has: bool| match (has, open.deadline) {
                (true, Some(deadline)) => open.end.after_nanos(PAUSE).min(deadline),
                (true, None) => open.end.after_nanos(PAUSE),
                (false, deadline) => deadline.unwrap_or(Time::NEVER),
            };
            let limits = open.has.map(limit);
            let next = |side: &VecDeque<(Time, u8)>, limit: Time| {
                side.front().copied().filter(|(at, _)| *at <= limit)
            };
            let (one, other) = (next(&self.recorded, limits[0]), next(emulated, limits[1]));
            let takes_one = match (one, other) {
                (Some(one), Some(other)) => one.0 <= other.0,
                (Some(_), None) => true,
                (None, Some(_)) => false,
                (None, None) => break,
            };
            let (place, source) =
                if takes_one { (0, &mut self.recorded) } else { (1, &mut *emulated) };
            let Some(byte) = source.pop_front() else { break };
            open.sides[place].push(byte);
            open.has[place] = true;
            open.end = open.end.max(byte.0);
        }
        let end = match open.has {
            [true, true] => Some(open.end.after_nanos(PAUSE)),
            _ => None,
        };
        end.into_iter().chain(open.deadline).min().is_some_and(|end| known > end)
    }

    /// Ends the open mismatch, and says whether there was one.
    fn close(&mut self) -> bool {
        let Some(OpenMismatch { at, line, sides: [recorded, emulated], command, .. }) =
            self.open.take()
        else {
            return false;
        };
        let command = self.answered(&emulated).or(command);
        let kind = MismatchKind::Reply { recorded, emulated };
        self.mismatches.push_back(Mismatch { at, line, command, kind });
        true
    }

    /// The command that an emulated reply belongs to.
    fn answered(&self, emulated: &Reply) -> Option<CommandNumber> {
        let last = emulated.last?;
        let is_of = |bytes: &[u8]| {
            let text = bytes.trim_ascii();
            !text.is_empty() && emulated.bytes.windows(text.len()).any(|part| part == text)
        };
        let answers = self.player.told().filter_map(|told| match &told.event {
            Event::Answer { bytes, .. } if told.at <= last && is_of(bytes) => told.command,
            _ => None,
        });
        answers.last()
    }
}

/// The first place at which the emulation differs from a recording.
///
/// # Errors
///
/// If a recorded state cannot be read.
pub fn first_mismatch<D: Device + Clone>(
    recording: &Recording,
    player: Player<D>,
    state: Read<'_, D>,
) -> Result<Option<Mismatch>, StateError> {
    let mut comparison = Comparison::new(player, Tolerance::of(&recording.head));
    for entry in &recording.entries {
        comparison.read(entry, state, &mut |_| {})?;
        if !comparison.mismatches.is_empty() {
            break;
        }
    }
    comparison.finish();
    Ok(comparison.take_mismatches().next())
}

/// Plays a recording into a device and compares every byte and time, and the states that were
/// written down. `state` reads a state; `seen` is told after each single thing that the device has
/// done.
///
/// # Errors
///
/// If a recorded state cannot be read.
pub fn check<D: Device + Clone>(
    recording: &Recording,
    player: Player<D>,
    tolerance: Tolerance,
    state: Read<'_, D>,
    seen: &mut dyn FnMut(SoFar<'_>),
) -> Result<Divergence, StateError> {
    let mut comparison = Comparison::new(player, tolerance);
    for entry in &recording.entries {
        comparison.read(entry, state, seen)?;
        if comparison.has_found_all() {
            return Ok(comparison.into_divergence());
        }
    }
    comparison.finish();
    Ok(comparison.into_divergence())
}
