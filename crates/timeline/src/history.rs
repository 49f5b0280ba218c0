//! A history and the one moment of it that is the present.

use std::collections::{VecDeque, vec_deque};

use serde::{Deserialize, Serialize};
use vimc4_device::{Device, Input, Kinds, Output, Time, TimedInput, show_nanos};

use crate::search::{ACTS_BETWEEN, ByAct};
use crate::snapshots::{Kept, Snapshots};
use crate::tape::Tape;
use crate::waypoints::{Waypoint, Waypoints};
use crate::{Act, BranchId, Found, Moment, Place, Progress, Sought, Stretch, Which};

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
    /// The branch on which the present continues: its own, or one that leaves it later on.
    heading: BranchId,
    /// The kinds of events that are watched.
    watched: Kinds,
    /// When the last act before the present was. Since then only time has passed.
    acted: Time,
    /// How many acts lie between the last snapshot of the branch and the present, if that is
    /// behind it.
    since: u64,
    /// How many acts lie between the last known state on the way and the present.
    passed: u64,
    outputs: VecDeque<Output>,
    waypoints: Waypoints<D::State>,
    /// The branches by their numbers. The first is the one that everything began with.
    tracks: Vec<Track<D::State>>,
    left: Vec<Place>,
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
    /// The number of acts between two snapshots. To go anywhere costs at most this many acts. When
    /// there are too many snapshots, every second one goes and the spacing is doubled.
    pub spacing: u64,
    /// How many snapshots are kept for a branch. At least two.
    pub snapshots: usize,
    /// The number of acts between two of the states that are kept besides on the ways that were gone
    /// last. Where one has just been, a step back costs some times this many acts.
    pub stride: u64,
    /// How many of these are kept, for all branches together.
    pub waypoints: usize,
}

/// Suits millions of commands: a step back takes less than a millisecond, and all states of a
/// branch take a few MB.
impl Default for Limits {
    fn default() -> Limits {
        Limits { spacing: 8_192, snapshots: 8_192, stride: 64, waypoints: 1_024 }
    }
}

/// What a history tells about one of its branches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Branch {
    /// Its number.
    pub id: BranchId,
    /// What it is called.
    pub name: String,
    /// Where it left another branch; `None` for the first. Its first input is what made it leave.
    pub parted: Option<Place>,
    /// Its first moment.
    pub first: Moment,
    /// How far it has come.
    pub end: Moment,
    /// How many inputs it has.
    pub inputs: u64,
}

/// How far a branch is known, to [forget](History::forget_beyond) what is only tried after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Known {
    end: Place,
    inputs: u64,
}

/// How much memory a history takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Usage {
    /// How many inputs it has.
    pub inputs: u64,
    /// What they take, in bytes.
    pub input_bytes: u64,
    /// How many states are kept.
    pub snapshots: u64,
    /// What they take at least, in bytes. Memory that a state shares with others is not counted.
    pub snapshot_bytes: u64,
}

impl<D: Device> History<D> {
    /// Begins with a device as it is now. It is watched as it was before.
    pub fn new(device: D) -> History<D> {
        History::within(device, Limits::default())
    }

    /// Begins with a device as it is now, and keeps as much as `limits` says.
    pub fn within(mut device: D, limits: Limits) -> History<D> {
        let mut outputs = VecDeque::new();
        while let Some(output) = device.poll_output() {
            outputs.push_back(output);
        }
        let first = Moment { at: device.now(), ..Moment::default() };
        let watched = device.watch(Kinds::NONE);
        device.watch(watched);
        let trunk = Track::new("main".to_owned(), None, first, &device, watched);
        History {
            heading: BranchId(0),
            watched,
            acted: first.at,
            present: Place { branch: BranchId(0), moment: first },
            since: 0,
            passed: 0,
            device,
            outputs,
            waypoints: Waypoints::new(),
            tracks: vec![trunk],
            left: Vec::new(),
            limits,
        }
    }

    /// The device at the present moment, to be looked at.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// The device at the present moment, to be driven by other code.
    pub fn into_device(self) -> D {
        self.device
    }

    /// Says which kinds of events to watch from now on, in the past too.
    pub fn watch(&mut self, kinds: Kinds) {
        self.device.watch(kinds);
        self.watched = kinds;
        for track in &mut self.tracks {
            track.snapshots.open_stretch().watched(kinds);
        }
    }

    /// Which kinds of events are watched.
    pub fn watched(&self) -> Kinds {
        self.watched
    }

    /// The branch on which the present continues: its own, or one that leaves it later and from
    /// which the present was reached by going back.
    pub fn heading(&self) -> BranchId {
        self.heading
    }

    /// The present moment.
    pub fn present(&self) -> Place {
        self.present
    }

    /// The present time.
    pub fn now(&self) -> Time {
        self.present.moment.at
    }

    /// When the last act before the present was, or the first moment. Since then only time has passed.
    pub fn acted(&self) -> Time {
        self.acted
    }

    /// Whether nothing has happened yet after the present moment.
    pub fn is_at_end(&self) -> bool {
        self.heading == self.present.branch && self.present.moment >= self.track().end
    }

    /// All branches, in the order in which they began.
    pub fn branches(&self) -> impl Iterator<Item = Branch> {
        (0..).map(BranchId).zip(&self.tracks).map(|(id, track)| Branch {
            id,
            name: track.name.clone(),
            parted: track.parting,
            first: track.snapshots.first().moment,
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

    /// The moments of a branch whose states are kept. All other moments can be reached from these.
    pub fn snapshots(&self, branch: BranchId) -> impl Iterator<Item = Moment> {
        let track = self.tracks.get(branch.0 as usize);
        track.into_iter().flat_map(|track| track.snapshots.iter().map(|kept| kept.moment))
    }

    /// How much memory all of it takes.
    pub fn usage(&self) -> Usage {
        let mut usage = Usage::default();
        for track in &self.tracks {
            usage.inputs += track.tape.len();
            usage.input_bytes += track.tape.size();
            usage.snapshots += track.snapshots.len() as u64;
        }
        usage.snapshots += self.waypoints.len() as u64;
        let each = size_of::<Kept<D::State>>() as u64;
        usage.snapshot_bytes = usage.snapshots * each;
        usage
    }

    // --- what comes out ---

    /// What has come out since the last jump and has not been taken. Going over the past again
    /// yields its output again, and a search back that of the act that it has found.
    pub fn outputs(&self) -> &VecDeque<Output> {
        &self.outputs
    }

    /// Takes all of it.
    pub fn drain(&mut self) -> vec_deque::Drain<'_, Output> {
        self.outputs.drain(..)
    }

    // --- forward ---

    /// Gives the device an input, now. It comes after what is due by now and takes effect with the
    /// [steps](History::step) that follow. In the past it begins a branch, on which nothing after
    /// the present has happened, and the present moves there.
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

    /// Lets time pass up to `at`, with everything that is known to happen by then. A time in the
    /// past changes nothing.
    pub fn run_to(&mut self, at: Time) {
        while self.act(at).is_some() {}
        self.wait_until(at);
    }

    /// Lets everything happen that follows without further input, which is endless if the device
    /// never rests.
    pub fn run_to_rest(&mut self) {
        while self.act(Time::NEVER).is_some() {
            self.outputs.clear();
        }
    }

    /// Goes forward to the first act for which `found` returns true, and says whether there was
    /// one. If not, the present ends where nothing more happens, at `until` at the latest.
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

    /// Goes forward to the first moment after the present at which `sought` is, up to and including
    /// `until`. If there is none, the present ends where nothing more happens by then; if the
    /// search is given up, it stays where the search has got to.
    pub fn seek_next(
        &mut self,
        until: Time,
        sought: &mut impl Sought<D>,
        progress: &mut Progress<'_>,
    ) -> Found {
        sought.begin(&self.device);
        // The last moment up to which knowing the stretch is enough.
        let mut looked_up = None;
        let mut acts = 0_u64;
        loop {
            if acts.is_multiple_of(ACTS_BETWEEN) && progress(self.now()).is_break() {
                return Found::GivenUp;
            }
            acts += 1;
            if let Some(next) = self.leave_out(until, &mut looked_up, sought) {
                self.restore(next);
                sought.begin(&self.device);
                continue;
            }
            let end = self.quiet_until().min(until.after_nanos(1));
            if end > self.now()
                && let Some(at) = sought.between(&self.device, end, Which::First)
            {
                self.outputs.clear();
                self.wait_until(at);
                return Found::Here;
            }
            if let Some(at) = sought.looked_until() {
                self.wait_until(at);
                sought.begin(&self.device);
                acts = acts.next_multiple_of(ACTS_BETWEEN);
                continue;
            }
            if self.turn_off(until) {
                continue;
            }
            let last = std::mem::take(&mut self.outputs);
            let Some(act) = self.act(until) else {
                // What came out last is still what came out last.
                self.outputs = last;
                return Found::Nowhere;
            };
            if sought.after(&self.device, act, &self.outputs) {
                return Found::Here;
            }
        }
    }

    /// The kept moment at the end of the present's stretch, if what is sought cannot be before it.
    fn leave_out(
        &self,
        until: Time,
        looked_up: &mut Option<Place>,
        sought: &impl Sought<D>,
    ) -> Option<Place> {
        let Place { branch, moment } = self.present;
        if looked_up.is_some_and(|until| until.branch == branch && moment < until.moment) {
            return None;
        }
        let snapshots = &self.track().snapshots;
        let next = snapshots.after(moment)?;
        let parting = self.parting();
        let is_ahead =
            next.moment.at <= until && parting.is_none_or(|(_, parting)| next.moment <= parting);
        let place = Place { branch, moment: next.moment };
        *looked_up = Some(place);
        let kept = snapshots.not_after(moment);
        (is_ahead && !sought.can_be_in(&kept.stretch)).then_some(place)
    }

    // --- back ---

    /// Goes one act back: to just after the act before the last, or, where time has passed since
    /// the last, to just after that. From the first act of a branch it continues on the branch that
    /// this one has left; going forward from there leads back into this one. `false` at the very
    /// beginning.
    pub fn back(&mut self) -> bool {
        self.find_last(|_, _, _| true)
    }

    /// Goes back to the last moment before the present for which `found` returns true, and says
    /// whether there is one; if not, the present stays.
    ///
    /// `found` sees the device just after an act, the act, and what came out by it; at the very
    /// beginning there is no act. It is asked of the moments between two snapshots from the first
    /// to the last of them, the latest two snapshots first.
    pub fn find_last(
        &mut self,
        found: impl FnMut(&D, Option<Act>, &VecDeque<Output>) -> bool,
    ) -> bool {
        let go_on = &mut |_| std::ops::ControlFlow::Continue(());
        self.seek_last(&mut ByAct(found), go_on) == Found::Here
    }

    /// Goes back to the last moment before the present at which `sought` is. If there is none, or
    /// the search is given up, the present stays.
    pub fn seek_last(&mut self, sought: &mut impl Sought<D>, progress: &mut Progress<'_>) -> Found {
        self.seek_back(false, sought, progress)
    }

    /// The same, but the present itself counts too.
    pub fn seek_last_or_here(
        &mut self,
        sought: &mut impl Sought<D>,
        progress: &mut Progress<'_>,
    ) -> Found {
        self.seek_back(true, sought, progress)
    }

    /// `itself`: whether the present is one of the moments in question.
    fn seek_back(
        &mut self,
        mut itself: bool,
        sought: &mut impl Sought<D>,
        progress: &mut Progress<'_>,
    ) -> Found {
        let (begin, heading) = (self.present, self.heading);
        let mut place = begin;
        let mut acts = 0_u64;
        let mut came_out = VecDeque::new();
        let found = loop {
            let track = &self.tracks[place.branch.0 as usize];
            let first = track.snapshots.first().moment;
            if place.moment <= first {
                // The first moment of a branch is that at which it has left the other one.
                if let Some(parting) = track.parting {
                    place = parting;
                    continue;
                }
                if itself {
                    self.restore(Place { branch: place.branch, moment: first });
                    if sought.at_the_beginning(&self.device) {
                        break Some(self.present);
                    }
                }
                break None;
            }
            let kept = track.snapshots.before(place.moment);
            let mut from = kept.moment;
            if sought.can_be_in(&kept.stretch) {
                let nearer = self.waypoints.before(place.branch, from, place.moment);
                from = nearer.unwrap_or(from);
                self.restore(Place { branch: place.branch, moment: from });
                sought.begin(&self.device);
                let mut last = None;
                loop {
                    if acts.is_multiple_of(ACTS_BETWEEN) && progress(self.now()).is_break() {
                        self.heading = heading;
                        self.go_to_place(begin);
                        return Found::GivenUp;
                    }
                    acts += 1;
                    let end = place.moment.at.after_nanos(u64::from(itself));
                    let counts = self.present.moment.counts();
                    let is_last = counts >= place.moment.counts();
                    let due = self.next_act().filter(|due| !is_last && *due <= place.moment.at);
                    let until = due.unwrap_or(end);
                    if until > self.now()
                        && let Some(at) = sought.between(&self.device, until, Which::Last)
                    {
                        last = Some(Moment { at, ..self.present.moment });
                        came_out.clear();
                    }
                    if let Some(at) = sought.looked_until() {
                        self.wait_until(at);
                        sought.begin(&self.device);
                        acts = acts.next_multiple_of(ACTS_BETWEEN);
                        continue;
                    }
                    if due.is_none() {
                        break;
                    }
                    self.outputs.clear();
                    let Some(act) = self.act_here(place.moment.at) else { break };
                    let asked = itself || self.present.moment < place.moment;
                    if asked && sought.after(&self.device, act, &self.outputs) {
                        last = Some(self.present.moment);
                        std::mem::swap(&mut self.outputs, &mut came_out);
                    }
                }
                if let Some(moment) = last {
                    break Some(Place { branch: place.branch, moment });
                }
            } else {
                acts += 1;
            }
            (place.moment, itself) = (from, true);
        };
        self.heading = heading;
        self.go_to_place(found.unwrap_or(begin));
        if found.is_none() {
            return Found::Nowhere;
        }
        self.outputs = came_out;
        Found::Here
    }

    // --- anywhere ---

    /// Goes to a moment of any branch, and says whether the history has that moment; if not, the
    /// present stays.
    pub fn go_to(&mut self, place: Place) -> bool {
        let is_there = self.go_to_place(place);
        if is_there {
            self.heading = place.branch;
        }
        is_there
    }

    /// The same, and continues from there on the same way as before if the place is on that way.
    pub fn go_back_to(&mut self, place: Place) -> bool {
        let is_there = self.go_to_place(place);
        let is_on_the_way = self.parting().is_some_and(|(_, parting)| place.moment <= parting);
        if is_there && !is_on_the_way {
            self.heading = place.branch;
        }
        is_there
    }

    /// Goes to a time of the branch on which the present continues, or of those it came from, after
    /// everything that happens then. A time beyond the end leads to the end.
    pub fn go_to_time(&mut self, at: Time) {
        let end = self.go_to_before(at);
        while self.present.moment < end && self.act_here(at.min(end.at)).is_some() {}
        self.outputs.clear();
        self.wait_until(at.min(end.at));
    }

    /// Goes to a known state before a time, or to the first of a branch that begins then, on the branch on
    /// which the present continues, or on those it came from. Returns the end of the branch.
    fn go_to_before(&mut self, at: Time) -> Moment {
        let mut branch = self.heading;
        let mut track = &self.tracks[branch.0 as usize];
        while let Some(parting) = track.parting
            && at < track.snapshots.first().moment.at
        {
            branch = parting.branch;
            track = &self.tracks[branch.0 as usize];
        }
        let (end, kept) = (track.end, track.snapshots.earlier(at).moment);
        let moment = self.waypoints.earlier(branch, kept, at).unwrap_or(kept);
        self.restore(Place { branch, moment });
        end
    }

    /// Goes to the end of a branch, and says whether there is one of this number.
    pub fn go_to_end(&mut self, branch: BranchId) -> bool {
        let end = self.tracks.get(branch.0 as usize).map(|track| track.end);
        end.is_some_and(|moment| self.go_to(Place { branch, moment }))
    }

    /// Does something at the end of a branch and comes back to the present, so that more of the
    /// future becomes known. A present that continues on the branch continues on the longer branch.
    pub fn at_end<T>(&mut self, branch: BranchId, work: impl FnOnce(&mut Self) -> T) -> T {
        let (begin, heading, acted) = (self.present, self.heading, self.acted);
        let outputs = std::mem::take(&mut self.outputs);
        self.go_to_end(branch);
        let done = work(self);
        if heading != branch {
            self.heading = heading;
        }
        self.go_to_place(begin);
        if !self.is_on_the_way() {
            self.heading = heading;
        }
        (self.acted, self.outputs) = (acted, outputs);
        done
    }

    /// How far the branch is known on which the present continues.
    pub fn known(&self) -> Known {
        let track = &self.tracks[self.heading.0 as usize];
        let end = Place { branch: self.heading, moment: track.end };
        Known { end, inputs: track.tape.len() }
    }

    /// Forgets what has become known of a branch since then, its inputs too: it was only tried, and what
    /// is given next comes instead of it. A present beyond that goes back to where it ends. What
    /// other branches have left is kept.
    pub fn forget_beyond(&mut self, known: Known) {
        let Known { end, inputs } = known;
        let is_left = self
            .tracks
            .iter()
            .filter_map(|track| track.parting)
            .any(|parting| parting.branch == end.branch && parting.moment > end.moment);
        let Some(track) = self.tracks.get_mut(end.branch.0 as usize) else { return };
        if is_left || (track.end <= end.moment && track.tape.len() <= inputs) {
            return;
        }
        track.tape.truncate(inputs);
        track.snapshots.truncate(end.moment);
        track.end = end.moment;
        self.waypoints.forget_beyond(end);
        if self.present.branch == end.branch {
            let here = self.present.moment.min(end.moment);
            // The number of acts since the last snapshot is another one by now.
            let kept = self.track().snapshots.not_after(here).moment;
            self.restore(Place { branch: end.branch, moment: kept });
            self.reach(Place { branch: end.branch, moment: here });
        }
    }

    /// Begins a branch at the present moment with another state of the device, which is put in by
    /// hand. The present moves there, and to the time of that state, which may be an earlier one.
    pub fn fork(&mut self, name: impl Into<String>, state: D::State) {
        self.device.restore(state);
        self.outputs.clear();
        self.part();
        if let Some(track) = self.tracks.last_mut() {
            track.name = name.into();
        }
    }

    /// Goes on from a state that the device was put back into. Where it was in that state on the way to the
    /// present, or else on another branch, the latest first, a branch begins there, called after its time;
    /// otherwise one of this name [here](History::fork). None begins at the end of a branch, nor if the
    /// device is in that state now.
    pub fn put_back(&mut self, name: impl Into<String>, state: D::State)
    where
        D::State: PartialEq,
    {
        let begin = self.present;
        self.heading = begin.branch;
        let own = self.device.state();
        self.device.restore(state.clone());
        let at = self.device.now();
        self.device.restore(own);
        if !self.is_at_end() || !self.go_to_state_anywhere(at, &state) {
            self.heading = begin.branch;
            self.go_to_place(begin);
            self.fork(name, state);
        } else if !self.is_at_end() {
            self.fork(format!("from {}", show_nanos(at.as_nanos())), state);
        }
    }

    /// The device itself was put elsewhere, and has left here.
    pub fn leave(&mut self, place: Place) {
        self.left.push(place);
    }

    /// From where the device itself was put elsewhere, oldest first.
    pub fn left(&self) -> &[Place] {
        &self.left
    }

    /// Goes to where the device was in a state at a time, on the way to the present or else on another
    /// branch, the latest first. If there is no such moment the present ends anywhere.
    fn go_to_state_anywhere(&mut self, at: Time, state: &D::State) -> bool
    where
        D::State: PartialEq,
    {
        let (own, now) = (self.heading, self.now());
        let is_then = |branch: &BranchId| {
            let track = &self.tracks[branch.0 as usize];
            *branch != own && (track.snapshots.first().moment.at..=track.end.at).contains(&at)
        };
        let others = (0..self.tracks.len() as u32).rev().map(BranchId).filter(is_then);
        let branches: Vec<BranchId> =
            (at <= now).then_some(own).into_iter().chain(others).collect();
        branches.into_iter().any(|branch| {
            self.heading = branch;
            self.go_to_state(at, state)
        })
    }

    /// Goes to where the device was in a state at a time, on the branch of the present or on those it came
    /// from. If there is no such moment the present ends anywhere.
    fn go_to_state(&mut self, at: Time, state: &D::State) -> bool
    where
        D::State: PartialEq,
    {
        let end = self.go_to_before(at);
        let until = at.min(end.at);
        loop {
            // What is due at that very time may have been left to be done.
            if self.next_act().is_none_or(|due| due >= until) {
                self.wait_until(until);
            }
            if self.now() == at && self.device.state() == *state {
                self.outputs.clear();
                return true;
            }
            if self.present.moment >= end || self.act_here(until).is_none() {
                return false;
            }
        }
    }

    // --- inside ---

    /// Whether the way of the present leads from where it is to where it continues.
    fn is_on_the_way(&self) -> bool {
        self.heading == self.present.branch
            || self.parting().is_some_and(|(_, parting)| self.present.moment <= parting)
    }

    /// Where the present continues on another branch, and on which.
    fn parting(&self) -> Option<(BranchId, Moment)> {
        let mut branch = self.heading;
        while branch != self.present.branch {
            let parting = self.tracks.get(branch.0 as usize)?.parting?;
            if parting.branch == self.present.branch {
                return Some((branch, parting.moment));
            }
            branch = parting.branch;
        }
        None
    }

    /// Where the present's branch is left by `at` at the latest, the present moves to the other
    /// branch.
    fn turn_off(&mut self, at: Time) -> bool {
        if self.heading == self.present.branch {
            return false;
        }
        let Some((branch, parting)) = self.parting() else { return false };
        let (here, there) = (self.present.moment, parting);
        if here.counts() != there.counts() || there.at > at {
            return false;
        }
        // The other branch may begin with a state that was put in by hand.
        let first = self.tracks[branch.0 as usize].snapshots.first().moment;
        self.restore(Place { branch, moment: first });
        true
    }

    /// When the next act of the present's branch is, as far as it is known.
    pub fn next_act(&self) -> Option<Time> {
        let input = self.track().tape.get(self.present.moment.inputs).map(|(given, _)| given);
        let wake = self.device.wake().filter(|due| *due != Time::NEVER);
        input.into_iter().chain(wake).min().map(|due| due.max(self.now()))
    }

    /// Until when nothing happens on the way of the present. That instant is excluded, except where
    /// it is the one at which a branch is left.
    fn quiet_until(&self) -> Time {
        match self.parting() {
            Some((_, parting)) if parting.counts() == self.present.moment.counts() => {
                parting.at.after_nanos(1)
            }
            _ => self.next_act().unwrap_or(Time::NEVER),
        }
    }

    /// The next act that comes by `at` at the latest.
    fn act(&mut self, at: Time) -> Option<Act> {
        while self.turn_off(at) {}
        let waits =
            |(_, parting): (BranchId, Moment)| parting.counts() == self.present.moment.counts();
        if self.heading != self.present.branch && self.parting().is_some_and(waits) {
            return None;
        }
        self.act_here(at)
    }

    /// The same, on the present's branch.
    fn act_here(&mut self, at: Time) -> Option<Act> {
        let mut moment = self.present.moment;
        let tape = &self.tracks[self.present.branch.0 as usize].tape;
        let input = tape.get(moment.inputs).filter(|(given, _)| *given <= at);
        let limit = input.map_or(at, |(given, _)| given);
        // What is never due is no cause, even without a limit.
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
        self.came_to(moment, Some(act));
        Some(act)
    }

    /// Lets time pass in which nothing happens: nothing is due before, and what is due at that very instant
    /// is still to be done.
    pub fn wait_until(&mut self, at: Time) {
        if at > self.now() {
            self.device.accept(Input::Wake, at);
            self.came_to(Moment { at, ..self.present.moment }, None);
        }
    }

    fn came_to(&mut self, moment: Moment, act: Option<Act>) {
        let before = self.outputs.len();
        while let Some(output) = self.device.poll_output() {
            self.outputs.push_back(output);
        }
        self.present.moment = moment;
        let track = &mut self.tracks[self.present.branch.0 as usize];
        self.since = if moment <= track.snapshots.last().moment { 0 } else { self.since + 1 };
        let is_new = moment > track.end;
        if is_new {
            track.end = moment;
        }
        // Like snapshots, waypoints are just after an act, which every later replay passes too.
        self.passed += u64::from(act.is_some());
        if act.is_some() && self.passed >= self.limits.stride.max(1) {
            let (device, since) = (&self.device, self.since);
            let state = || Waypoint { state: device.state(), since };
            self.waypoints.pass(self.present, self.limits.waypoints, state);
            self.passed = 0;
        }
        if !is_new {
            return;
        }
        let stretch = track.snapshots.open_stretch();
        self.outputs.range(before..).for_each(|output| stretch.saw(output));
        let (low, high) = match act {
            // Receiving alone starts nothing.
            Some(Act::Byte(byte)) if !self.device.is_urgent(byte) => {
                let here = self.device.position(moment.at);
                (here, here)
            }
            Some(_) => self.device.reach(),
            None => return,
        };
        stretch.reaches(&low, &high);
        // A snapshot is taken just after an act, a place that every later replay passes too.
        if self.since >= track.snapshots.spacing(self.limits.spacing) {
            let state = self.device.state();
            let stretch = Stretch::new(&self.device, self.watched);
            track.snapshots.push(Kept { moment, state, stretch }, self.limits.snapshots);
            self.since = 0;
        }
    }

    /// Goes to a moment and says whether it exists; if not, stays.
    fn go_to_place(&mut self, place: Place) -> bool {
        let begin = self.present;
        if !self.reach(place) {
            self.reach(begin);
        }
        self.present == place
    }

    /// Goes to a moment; if it does not exist, the present may end anywhere.
    fn reach(&mut self, place: Place) -> bool {
        let Some(track) = self.tracks.get(place.branch.0 as usize) else { return false };
        if place.moment < track.snapshots.first().moment || place.moment > track.end {
            return false;
        }
        let kept = track.snapshots.not_after(place.moment).moment;
        let nearer = self.waypoints.not_after(place.branch, kept, place.moment);
        let from = nearer.unwrap_or(kept);
        let here = self.present;
        let on_the_way =
            here.branch == place.branch && (from..=place.moment).contains(&here.moment);
        if !on_the_way {
            self.restore(Place { branch: place.branch, moment: from });
        }
        while self.present.moment.counts() < place.moment.counts()
            && self.act_here(place.moment.at).is_some()
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

    /// Goes to a moment whose state is kept.
    fn restore(&mut self, kept: Place) {
        let (state, since) = match self.waypoints.get(kept) {
            Some(Waypoint { state, since }) => (state, *since),
            None => {
                let track = &self.tracks[kept.branch.0 as usize];
                (&track.snapshots.not_after(kept.moment).state, 0)
            }
        };
        self.device.restore(state.clone());
        self.present = kept;
        self.acted = kept.moment.at;
        (self.since, self.passed) = (since, 0);
        self.outputs.clear();
    }

    /// Begins a branch at the present moment.
    fn part(&mut self) {
        let from = self.present;
        // A state that was put in by hand may be of another time.
        let first = Moment { at: self.device.now(), ..Moment::default() };
        let branch = BranchId(self.tracks.len() as u32);
        let name = format!("branch {}", branch.0);
        self.tracks.push(Track::new(name, Some(from), first, &self.device, self.watched));
        self.present = Place { branch, moment: first };
        self.heading = branch;
        self.acted = first.at;
        (self.since, self.passed) = (0, 0);
    }

    fn track(&self) -> &Track<D::State> {
        &self.tracks[self.present.branch.0 as usize]
    }
}

impl<S> Track<S> {
    fn new<D: Device<State = S>>(
        name: String,
        parting: Option<Place>,
        first: Moment,
        device: &D,
        watched: Kinds,
    ) -> Track<S> {
        let kept =
            Kept { moment: first, state: device.state(), stretch: Stretch::new(device, watched) };
        let snapshots = Snapshots::new(kept);
        Track { name, parting, tape: Tape::default(), snapshots, end: first }
    }
}
