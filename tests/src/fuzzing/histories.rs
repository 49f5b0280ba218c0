//! A history of a controller: the way there makes no difference.

use std::collections::VecDeque;

use vimc4_device::{Device, Event, Input, Kinds, Line, Output, SignalId, Stamp, Time, Warning};
use vimc4_isel::Controller as Isel;
use vimc4_lpkf::Controller as Lpkf;
use vimc4_timeline::{BranchId, History, Limits, Place};

use super::chance::Chance;
use super::operations::{Operation, Operations, Setup};
use super::twins::Family;

/// So many operations count; what follows does not.
const OPERATIONS_MAX: usize = 120;
/// So many acts are performed in one operation at most.
const ACTS_MAX: usize = 300;
/// So many moments are held against what they were when they were present first.
const KEPT_MAX: usize = 60;
/// So many moments there are at most: an endless list of commands shall not take endlessly long.
const MOMENTS_MAX: usize = 6_000;
/// The last time that anybody waits for.
const LATEST: Time = Time::from_millis(86_400_000_000);

/// A controller gets the operations that some bytes stand for, and is sent back and forth between
/// what it was and what it could have been. Wherever it goes, and however, it is what it was there,
/// and what it says on the way is what a controller says that knows of no history. The first byte
/// is `i` for a controller of isel, all others are LPKF's; what follows is as for them.
///
/// # Panics
///
/// If something does not hold.
pub fn history(data: &[u8]) {
    match data.split_first() {
        Some((b'i', rest)) => of_family::<Isel>(rest),
        Some((_, rest)) => of_family::<Lpkf>(rest),
        None => {}
    }
}

/// Every fourth of them is at the end of a line on which characters take their time.
fn of_family<D: Family>(data: &[u8]) {
    let (setup, operations) = Setup::decode(data);
    let mut chance = Chance::of(data);
    let device = D::open(setup, b"");
    match chance.below(4) {
        0 => wander(Line::paced(device), operations, chance),
        _ => wander(device, operations, chance),
    }
}

/// What came out, with the times.
#[derive(Debug, Default, PartialEq)]
struct Said {
    bytes: Vec<(Time, u8)>,
    events: Vec<(Stamp, Event)>,
}

struct Wandering<D: Device> {
    /// As it was at first.
    new: D,
    history: History<D>,
    chance: Chance,
    /// Some of the moments that were present, and what was then.
    kept: Vec<(Place, D::State)>,
    /// How many moments were present.
    moments: usize,
}

fn wander<D: Device + Clone>(mut new: D, operations: &[u8], mut chance: Chance) {
    new.watch(Kinds::ALL);
    let (spacing, snapshots) = (1 + chance.below(40), 2 + chance.below(6) as usize);
    let limits = Limits { spacing, snapshots, stride: 7, waypoints: 20 };
    let history = History::within(new.clone(), limits);
    let mut wandering = Wandering { new, history, chance, kept: Vec::new(), moments: 0 };
    for operation in Operations::new(operations).take(OPERATIONS_MAX) {
        wandering.perform(operation);
        if wandering.moments > MOMENTS_MAX {
            break;
        }
    }
    wandering.everything_is_as_it_was();
    wandering.the_way_back_is_the_way_there();
    wandering.a_controller_without_history_does_the_same();
}

impl<D: Device + Clone> Wandering<D> {
    fn perform(&mut self, operation: Operation<'_>) {
        let now = self.history.now();
        match operation {
            Operation::Send(bytes) => self.give(Input::Bytes(bytes)),
            Operation::Signal(place, value) => {
                let listed = self.history.device().signals();
                let signal = listed.get(usize::from(place) % (listed.len() + 1));
                let id = signal.map_or(SignalId(u16::from(place)), |signal| signal.id);
                self.give(Input::Signal(id, i32::from(value)));
            }
            Operation::Power(on) => self.give(Input::Power(on)),
            Operation::Wait(nanos) => self.run_to(now.after_nanos(nanos)),
            Operation::Rest => self.run_to(now.after_nanos(60_000_000_000)),
            Operation::Next | Operation::Again(_) => {
                if let Some(due) = self.history.device().wake() {
                    self.run_to(due);
                }
            }
            Operation::Before(nanos) => {
                if let Some(due) = self.history.device().wake() {
                    let at = due.as_nanos().saturating_sub(u64::from(nanos));
                    self.run_to(Time::from_nanos(at));
                }
            }
            Operation::Snapshot => self.keep(),
            Operation::Restore | Operation::Restart => {
                if let Some((place, state)) = self.any_kept() {
                    assert!(self.history.go_to(place), "{place:?} is no longer there");
                    assert_eq!(self.history.device().state(), state, "is another at {place:?}");
                }
            }
            Operation::Look(axis, way) => {
                let back = (usize::from(axis) + way.unsigned_abs() as usize) % 30;
                for _ in 0..back {
                    self.history.back();
                }
            }
        }
    }

    fn give(&mut self, input: Input<'_>) {
        self.history.give(input);
        // Sometimes the next one comes before anything has come of this one.
        if self.chance.below(4) > 0 {
            self.run_to(self.history.now());
        }
    }

    fn run_to(&mut self, at: Time) {
        let at = at.min(LATEST);
        let mut acts = 0;
        while acts < ACTS_MAX && self.history.find_next(at, |_, _, _| true) {
            acts += 1;
            self.moments += 1;
            if self.chance.below(16) == 0 {
                self.keep();
            }
        }
        if acts < ACTS_MAX {
            self.history.run_to(at);
        }
        self.history.drain();
    }

    fn keep(&mut self) {
        let kept = (self.history.present(), self.history.device().state());
        if self.kept.len() < KEPT_MAX {
            self.kept.push(kept);
        } else {
            let place = self.chance.below(KEPT_MAX as u64) as usize;
            self.kept[place] = kept;
        }
    }

    fn any_kept(&mut self) -> Option<(Place, D::State)> {
        let place = self.chance.below(self.kept.len() as u64) as usize;
        self.kept.get(place).cloned()
    }

    /// Every moment that was kept is what it was, whatever has been present since.
    fn everything_is_as_it_was(&mut self) {
        for (place, state) in std::mem::take(&mut self.kept) {
            assert!(self.history.go_to(place), "{place:?} is no longer there");
            assert_eq!(self.history.device().state(), state, "is another at {place:?}");
            self.history.go_to_time(place.moment.at);
            assert_eq!(self.history.now(), place.moment.at, "{place:?}");
        }
    }

    /// So many steps back and as many forward lead to where they began.
    fn the_way_back_is_the_way_there(&mut self) {
        let branches = self.history.branches().count() as u64;
        let branch = BranchId(self.chance.below(branches) as u32);
        self.history.go_to_end(branch);
        let mut trail = Vec::new();
        for _ in 0..self.chance.below(50) {
            let here = (self.history.present(), self.history.device().state());
            if !self.history.back() || self.history.present().branch != branch {
                break;
            }
            trail.push(here);
        }
        // The last of them may be a time at which nothing happened, where no step leads.
        let natural = trail.len().min(1);
        if self.history.present().branch != branch {
            return;
        }
        for (place, state) in trail.drain(natural..).rev() {
            assert!(self.history.step().is_some(), "nothing leads to {place:?}");
            assert_eq!(self.history.present(), place);
            assert_eq!(self.history.device().state(), state, "is another at {place:?}");
        }
    }

    /// Each branch, played into a controller whole, says the same and ends the same.
    fn a_controller_without_history_does_the_same(&mut self) {
        let branches: Vec<_> = self.history.branches().collect();
        for branch in branches {
            let mut plain = self.new.clone();
            let mut said = Said::default();
            if let Some(parted) = branch.parted {
                assert!(self.history.go_to(parted));
                plain.restore(self.history.device().state());
            }
            for timed in self.history.inputs(branch.id, 0) {
                plain.handle(timed.input.as_input(), timed.at);
                while let Some(output) = plain.poll_output() {
                    note(&output, &mut said);
                }
            }
            plain.handle(Input::Wake, branch.end.at);
            while let Some(output) = plain.poll_output() {
                note(&output, &mut said);
            }
            let first = Place { branch: branch.id, moment: branch.first };
            assert!(self.history.go_to(first));
            let mut replayed = Said::default();
            self.history.find_next(branch.end.at, |_, _, outputs: &VecDeque<Output>| {
                outputs.iter().for_each(|output| note(output, &mut replayed));
                false
            });
            self.history.run_to(branch.end.at);
            assert_eq!(replayed, said, "{} says something else", branch.name);
            assert_eq!(self.history.device().state(), plain.state(), "{}", branch.name);
        }
    }
}

fn note(output: &Output, said: &mut Said) {
    match output {
        Output::Bytes(at, bytes) => said.bytes.extend(bytes.iter().map(|byte| (*at, *byte))),
        // How many are lost at a time depends on how many come at a time.
        Output::Event(_, Event::Warning(Warning::ReceiveOverflow { .. })) | Output::Flash(..) => {}
        Output::Event(stamp, event) => said.events.push((*stamp, event.clone())),
    }
}
