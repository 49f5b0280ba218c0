//! A history and the one moment of it that is present.

use std::collections::{VecDeque, vec_deque};

use serde::{Deserialize, Serialize};
use vimc4_device::{Device, Input, Kinds, Output, Time, TimedInput};

use crate::snapshots::Snapshots;
use crate::tape::Tape;
use crate::{BranchId, Moment, Place};

/// Everything that has happened to a device, and the device as it was or is at one moment of it.
///
/// ```
/// # mod cart { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/../device/tests/cart/mod.rs")); }
/// # use cart::Cart;
/// use vimc4_device::{Input, Output, Time};
/// use vimc4_timeline::History;
///
/// // A cart that makes a step each millisecond, as in `m5`, and says where it is when asked `p`.
/// let mut history = History::new(Cart::default());
/// history.give(Input::Bytes(b"m100\r"));
/// history.run_to(Time::from_millis(30));
/// history.give(Input::Bytes(b"p\r"));
/// history.run_to(Time::from_millis(200));
/// assert_eq!(history.now(), Time::from_millis(200));
///
/// // What if STOP had been pressed after ten steps?
/// history.go_to_time(Time::from_millis(10));
/// history.drain();
/// history.give(Input::Signal(Cart::STOP, 1));
/// history.run_to(Time::from_millis(20));
/// assert_eq!(*history.outputs(), [Output::Bytes(Time::from_millis(10), "stopped".into())]);
///
/// // Both pasts are there.
/// assert_eq!(history.branches().count(), 2);
/// ```
#[derive(Clone, Debug)]
pub struct History<D: Device> {
    device: D,
    present: Place,
    /// When the last act before the present was. Since then only time has passed.
    acted: Time,
    /// How many acts lie between the last snapshot of the branch and the present, if that is
    /// behind it.
    since: u64,
    outputs: VecDeque<Output>,
    /// The branches by their numbers. The first is the one that everything began with.
    tracks: Vec<Track<D::State>>,
    limits: Limits,
}

/// One branch.
#[derive(Clone, Debug)]
struct Track<S> {
    name: String,
    parting: Option<Place>,
    tape: Tape,
    snapshots: Snapshots<S>,
    end: Moment,
}

/// How much is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// So many acts lie between two snapshots. It is what a step back costs at most, and later on,
    /// where snapshots have been thinned out, a multiple of it.
    pub spacing: u64,
    /// So many snapshots are kept for a branch. At least two.
    pub snapshots: usize,
}

/// Fit for millions of commands: a step back takes about a millisecond, and all snapshots of a
/// branch take a few MB.
impl Default for Limits {
    fn default() -> Limits {
        Limits { spacing: 16_384, snapshots: 4_096 }
    }
}

/// What brings a history from one moment to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// The device did something by itself.
    Cause,
    /// A byte of an input came.
    Byte(u8),
    /// An input came that is no bytes.
    Input,
}

/// A branch as its history tells of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Branch {
    /// Its number.
    pub id: BranchId,
    /// What it is called.
    pub name: String,
    /// Where it left another branch; `None` for the first. Its first input says by what.
    pub parted: Option<Place>,
    /// Its first moment.
    pub first: Moment,
    /// How far it has come.
    pub end: Moment,
    /// How many inputs it has.
    pub inputs: u64,
}

/// What a history takes of the memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Usage {
    /// How many inputs it has.
    pub inputs: u64,
    /// What they take, in bytes.
    pub input_bytes: u64,
    /// How many states are kept.
    pub snapshots: u64,
    /// What they take at least, in bytes. What a state shares with others is not counted.
    pub snapshot_bytes: u64,
}

impl<D: Device> History<D> {
    /// Begins with a device as it is now. It is watched as it was before.
    pub fn new(device: D) -> History<D> {
        History::within(device, Limits::default())
    }

    /// Begins with a device as it is now, and keeps so much.
    pub fn within(mut device: D, limits: Limits) -> History<D> {
        let mut outputs = VecDeque::new();
        while let Some(output) = device.poll_output() {
            outputs.push_back(output);
        }
        let first = Moment { at: device.now(), ..Moment::default() };
        let trunk = Track::new("main".to_owned(), None, first, device.state());
        History {
            acted: first.at,
            present: Place { branch: BranchId(0), moment: first },
            since: 0,
            device,
            outputs,
            tracks: vec![trunk],
            limits,
        }
    }

    /// The device at the present moment, to be looked at.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// The device at the present moment, to be driven by somebody else.
    pub fn into_device(self) -> D {
        self.device
    }

    /// Says which kinds of events are wanted from now on, also of what is over.
    pub fn watch(&mut self, kinds: Kinds) {
        self.device.watch(kinds);
    }

    /// The present moment.
    pub fn present(&self) -> Place {
        self.present
    }

    /// The present time.
    pub fn now(&self) -> Time {
        self.present.moment.at
    }

    /// Whether nothing has happened yet after the present moment.
    pub fn is_at_end(&self) -> bool {
        self.present.moment >= self.track().end
    }

    /// All branches, in the order in which they began.
    pub fn branches(&self) -> impl Iterator<Item = Branch> {
        (0..).map(BranchId).zip(&self.tracks).map(|(id, track)| Branch {
            id,
            name: track.name.clone(),
            parted: track.parting,
            first: track.snapshots.first().0,
            end: track.end,
            inputs: track.tape.len(),
        })
    }

    /// Gives a branch another name, and says whether there is one of this number.
    pub fn rename(&mut self, branch: BranchId, name: impl Into<String>) -> bool {
        let track = self.tracks.get_mut(branch.0 as usize);
        track.map(|track| track.name = name.into()).is_some()
    }

    /// The inputs of a branch, from one of a number on, counted from 0.
    pub fn inputs(&self, branch: BranchId, from: u64) -> impl Iterator<Item = TimedInput> {
        let track = self.tracks.get(branch.0 as usize);
        let input = move |number| {
            let (at, input) = track?.tape.get(number)?;
            Some(TimedInput { at, input: input.into() })
        };
        (from..).map_while(input)
    }

    /// What all of it takes of the memory.
    pub fn usage(&self) -> Usage {
        let mut usage = Usage::default();
        for track in &self.tracks {
            usage.inputs += track.tape.len();
            usage.input_bytes += track.tape.size();
            usage.snapshots += track.snapshots.len() as u64;
        }
        let each = size_of::<(Moment, D::State)>() as u64;
        usage.snapshot_bytes = usage.snapshots * each;
        usage
    }

    // --- what comes out ---

    /// What has come out since the present was last gone to, and was not taken. What is over says
    /// again what it said.
    pub fn outputs(&self) -> &VecDeque<Output> {
        &self.outputs
    }

    /// Takes all of it.
    pub fn drain(&mut self) -> vec_deque::Drain<'_, Output> {
        self.outputs.drain(..)
    }

    // --- forward ---

    /// Gives the device an input, now. It comes after what is due by now and takes effect with the
    /// [steps](History::step) that follow. In the past it begins a branch, on which nothing of what
    /// comes after the present has happened; the present is then there.
    pub fn give(&mut self, input: Input<'_>) {
        if matches!(input, Input::Bytes([]) | Input::Wake) {
            return;
        }
        if !self.is_at_end() {
            self.part();
        }
        let now = self.now();
        self.tracks[self.present.branch.0 as usize].tape.push(now, input);
    }

    /// Goes one act forward, and says which it was: an input that was given, or what the device does
    /// by itself next. `None` if nothing more will happen until an input is given; the present
    /// stays then.
    pub fn step(&mut self) -> Option<Act> {
        self.act(Time::NEVER)
    }

    /// Lets time pass up to `at`, with everything that happens until then and just then, as far as
    /// it is known. A time that is over changes nothing.
    pub fn run_to(&mut self, at: Time) {
        while self.act(at).is_some() {}
        self.wait_until(at);
    }

    /// Goes forward until an act after which `found` says so, and says whether it did. If not, the
    /// present is where nothing more happens by `until` at the latest.
    ///
    /// `found` sees the device after the act, the act, and what came out by it.
    pub fn find_next(
        &mut self,
        until: Time,
        mut found: impl FnMut(&D, Act, &VecDeque<Output>) -> bool,
    ) -> bool {
        loop {
            self.outputs.clear();
            let Some(act) = self.act(until) else { return false };
            if found(&self.device, act, &self.outputs) {
                return true;
            }
        }
    }

    // --- back ---

    /// Goes one act back: to just after the act before the last, or, where time has passed since
    /// the last, to just after that. On the first moment of a branch it goes on with the branch that
    /// this one has left. `false` at the very beginning.
    pub fn back(&mut self) -> bool {
        self.find_last(|_, _, _| true)
    }

    /// Goes back to the last moment before the present of which `found` says so, and says whether
    /// there is one; if not, the present stays.
    ///
    /// `found` sees the device just after an act, the act, and what came out by it; at the first
    /// moment of a branch there is no act. It is asked of the moments between two snapshots from the
    /// first to the last of them, the latest two snapshots first.
    pub fn find_last(
        &mut self,
        mut found: impl FnMut(&D, Option<Act>, &VecDeque<Output>) -> bool,
    ) -> bool {
        let begin = self.present;
        let mut place = begin;
        // Whether the place itself is one of the moments in question.
        let mut itself = false;
        loop {
            let track = &self.tracks[place.branch.0 as usize];
            let first = track.snapshots.first().0;
            if place.moment <= first {
                let Some(parting) = track.parting else { break };
                place = parting;
                continue;
            }
            let from = track.snapshots.before(place.moment).0;
            self.restore(Place { branch: place.branch, moment: from });
            let mut last = None;
            if from == first && found(&self.device, None, &self.outputs) {
                last = Some(from);
            }
            while self.present.moment < place.moment {
                self.outputs.clear();
                let Some(act) = self.act(place.moment.at) else { break };
                let asked = itself || self.present.moment < place.moment;
                if asked && found(&self.device, Some(act), &self.outputs) {
                    last = Some(self.present.moment);
                }
            }
            if let Some(moment) = last {
                return self.go_to(Place { branch: place.branch, moment });
            }
            (place.moment, itself) = (from, true);
        }
        self.go_to(begin);
        false
    }

    // --- anywhere ---

    /// Goes to a moment of any branch, and says whether it is one of the history; if not, the
    /// present stays.
    pub fn go_to(&mut self, place: Place) -> bool {
        let begin = self.present;
        if !self.reach(place) {
            self.reach(begin);
        }
        self.present == place
    }

    /// Goes to a time of the present branch, or of those it has come from, after everything that
    /// happens then; beyond the end, to the end.
    pub fn go_to_time(&mut self, at: Time) {
        let mut track = &self.tracks[self.present.branch.0 as usize];
        let mut branch = self.present.branch;
        while let Some(parting) = track.parting
            && at < track.snapshots.first().0.at
        {
            branch = parting.branch;
            track = &self.tracks[branch.0 as usize];
        }
        let (end, from) = (track.end, track.snapshots.earlier(at).0);
        self.restore(Place { branch, moment: from });
        while self.present.moment < end && self.act(at.min(end.at)).is_some() {}
        self.outputs.clear();
        self.wait_until(at.min(end.at));
    }

    /// Goes to the end of a branch, and says whether there is one of this number.
    pub fn go_to_end(&mut self, branch: BranchId) -> bool {
        let end = self.tracks.get(branch.0 as usize).map(|track| track.end);
        end.is_some_and(|moment| self.go_to(Place { branch, moment }))
    }

    // --- inside ---

    /// The next act that comes by `at` at the latest.
    fn act(&mut self, at: Time) -> Option<Act> {
        let mut moment = self.present.moment;
        let tape = &self.tracks[self.present.branch.0 as usize].tape;
        let input = tape.get(moment.inputs).filter(|(given, _)| *given <= at);
        let limit = input.map_or(at, |(given, _)| given);
        // What is never due is no cause, even for those who have no limit.
        let due = self.device.wake().is_some_and(|due| due <= limit && due != Time::NEVER);
        let act = if due && self.device.perform(limit) {
            moment.causes += 1;
            Act::Cause
        } else {
            let (given, input) = input?;
            moment.causes = 0;
            if let Input::Bytes(bytes) = input
                && let Some(byte) = bytes.get(moment.bytes as usize)
            {
                self.device.accept(Input::Bytes(&[*byte]), given);
                moment.bytes += 1;
                if moment.bytes == bytes.len() as u64 {
                    moment.inputs += 1;
                    moment.bytes = 0;
                }
                Act::Byte(*byte)
            } else {
                self.device.accept(input, given);
                moment.inputs += 1;
                Act::Input
            }
        };
        moment.at = self.device.now();
        self.acted = moment.at;
        self.came_to(moment);
        Some(act)
    }

    /// Lets time pass in which nothing happens.
    fn wait_until(&mut self, at: Time) {
        if at > self.now() {
            self.device.accept(Input::Wake, at);
            self.came_to(Moment { at, ..self.present.moment });
        }
    }

    fn came_to(&mut self, moment: Moment) {
        while let Some(output) = self.device.poll_output() {
            self.outputs.push_back(output);
        }
        self.present.moment = moment;
        let track = &mut self.tracks[self.present.branch.0 as usize];
        track.end = track.end.max(moment);
        self.since = if moment <= track.snapshots.last().0 { 0 } else { self.since + 1 };
        // A snapshot is taken just after an act, which everybody passes who goes over it again.
        if self.since >= self.limits.spacing.max(1) && moment.at == self.acted {
            track.snapshots.push(moment, self.device.state(), self.limits.snapshots);
            self.since = 0;
        }
    }

    /// Goes to a moment if there is one, and somewhere if not.
    fn reach(&mut self, place: Place) -> bool {
        let Some(track) = self.tracks.get(place.branch.0 as usize) else { return false };
        if place.moment < track.snapshots.first().0 || place.moment > track.end {
            return false;
        }
        let from = track.snapshots.not_after(place.moment).0;
        let here = self.present;
        let on_the_way =
            here.branch == place.branch && (from..=place.moment).contains(&here.moment);
        if !on_the_way {
            self.restore(Place { branch: place.branch, moment: from });
        }
        let counts = |moment: Moment| (moment.inputs, moment.bytes, moment.causes);
        while counts(self.present.moment) < counts(place.moment)
            && self.act(place.moment.at).is_some()
        {
            self.outputs.clear();
        }
        self.outputs.clear();
        // Nothing may happen in the time that is still to pass.
        if self.device.wake().is_none_or(|due| due > place.moment.at) {
            self.wait_until(place.moment.at);
        }
        self.present == place
    }

    /// Goes to a moment of which the state is kept.
    fn restore(&mut self, kept: Place) {
        let track = &self.tracks[kept.branch.0 as usize];
        let (moment, state) = track.snapshots.not_after(kept.moment);
        self.present = Place { branch: kept.branch, moment: *moment };
        self.acted = moment.at;
        self.since = 0;
        self.device.restore(state.clone());
        self.outputs.clear();
    }

    /// Begins a branch at the present moment.
    fn part(&mut self) {
        let from = self.present;
        let first = Moment { at: from.moment.at, ..Moment::default() };
        let branch = BranchId(self.tracks.len() as u32);
        let (name, state) = (format!("branch {}", branch.0), self.device.state());
        self.tracks.push(Track::new(name, Some(from), first, state));
        self.present = Place { branch, moment: first };
        self.acted = first.at;
        self.since = 0;
    }

    fn track(&self) -> &Track<D::State> {
        &self.tracks[self.present.branch.0 as usize]
    }
}

impl<S> Track<S> {
    fn new(name: String, parting: Option<Place>, first: Moment, state: S) -> Track<S> {
        let snapshots = Snapshots::new(first, state);
        Track { name, parting, tape: Tape::default(), snapshots, end: first }
    }
}
