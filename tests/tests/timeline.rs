//! The history of random sessions of both families, with commands, the panel, faults of the machine and the
//! line, rules, and clocks that cut time differently: however a moment is reached, the whole state is the same.
//!
//! `VIMC4_CASES=100000 cargo test --release -p vimc4-tests --test timeline` tries as many sessions.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::panic::{catch_unwind, resume_unwind};

use vimc4_catalogue::{State, bare};
use vimc4_debug::{Unit, Wired};
use vimc4_device::{
    Device as _, Harness, Input, Kinds, Line, LineState, Names, OwnedInput, Time, TimedInput,
};
use vimc4_language::{read_faulting, read_ruling};
use vimc4_plant::Machine;
use vimc4_tests::fuzzing::{Chance, back_and_forward};
use vimc4_tests::mishaps::{Act, Random, Session, any_session};
use vimc4_timeline::{History, Limits};

/// After the last input this passes.
const AFTER_NANOS: u64 = 5_000_000_000;

/// So many times are gone to.
const JUMPS: u64 = 3;

/// How clocks cut time, in ns: as it comes, a short and a long round, and everything at once.
const CLOCKS: [Option<u64>; 4] = [Some(37_300_000), Some(300_000_000), Some(2_000_000_000), None];

/// What goes wrong on the line, and what happens by itself, among what else is done.
const BESIDES: [&str; 8] = [
    "fault drop to-host 2 bytes",
    "fault garble to-controller once after x > 100",
    "fault delay 30ms to-host for 2s",
    "fault duplicate to-host once while x < 0",
    "fault split 1ms to-controller for 900ms",
    "rule when x > 200: press stop",
    "rule once when x < -100: fault jam y for 300ms",
    "rule every 700ms: press stop",
];

/// A controller at its line, and what comes when.
struct Told {
    new: Wired,
    inputs: Vec<TimedInput>,
    end: Time,
}

fn told(session: &Session, chance: &mut Chance) -> Told {
    let model = vimc4_catalogue::model(session.model).expect(session.model);
    let machine = Machine::from_toml(&session.machine).expect("a machine").into();
    let new = bare(&model, &machine, &[]).expect("an empty memory");
    // On every third line characters take their time.
    let mut new = if chance.below(3) == 0 { Line::paced(new) } else { Line::ideal(new) };
    new.watch(Kinds::ALL);
    let names = Names::of(&new);
    let mut at = Time::ZERO;
    let mut inputs = Vec::new();
    for act in &session.acts {
        if chance.below(25) == 0 {
            let besides = *chance.pick(&BESIDES);
            let input = match besides.split_once(' ') {
                Some(("fault", fault)) => read_faulting(fault, &names).map(OwnedInput::Fault).ok(),
                _ => read_ruling(besides, &names).map(OwnedInput::Rule).ok(),
            };
            inputs.push(TimedInput { at, input: input.expect(besides) });
        }
        let input = match act {
            Act::Send(line) => OwnedInput::from(Input::Bytes(line.as_bytes())),
            Act::Fault(text) => OwnedInput::Fault(read_faulting(text, &names).expect(text)),
            Act::Set(name, value) => {
                let signal = names.signals().iter().find(|signal| signal.name == *name);
                OwnedInput::Signal(signal.expect(name).id, *value)
            }
            Act::Advance(span) => {
                at = at + *span;
                continue;
            }
        };
        inputs.push(TimedInput { at, input });
    }
    Told { new, inputs, end: at.after_nanos(AFTER_NANOS) }
}

impl Told {
    /// Runs to a time from the beginning, without a history. A clock cuts the time.
    fn run(&self, until: Time, clock: Option<u64>) -> LineState<State> {
        let mut harness = Harness::new(self.new.clone());
        let run_to = |harness: &mut Harness<Wired>, at: Time| {
            while let Some(nanos) = clock
                && harness.now().after_nanos(nanos) < at
            {
                harness.run_to(harness.now().after_nanos(nanos));
            }
            harness.run_to(at);
        };
        for timed in self.inputs.iter().filter(|timed| timed.at <= until) {
            run_to(&mut harness, timed.at);
            harness.input(timed.input.as_input());
        }
        run_to(&mut harness, until);
        harness.device().state()
    }

    /// The same session with a history that keeps few states.
    fn history(&self, chance: &mut Chance) -> History<Wired> {
        let limits = Limits {
            spacing: 1 + chance.below(12),
            snapshots: 2 + chance.below(30) as usize,
            stride: 1 + chance.below(12),
            waypoints: chance.below(30) as usize,
        };
        let mut history = History::within(self.new.clone(), limits);
        history.watch(Kinds::ALL);
        for timed in &self.inputs {
            history.run_to(timed.at);
            history.give(timed.input.as_input());
        }
        history.run_to(self.end);
        history
    }
}

/// Holds a session, and says how many steps of each unit were made.
fn hold(seed: u64) -> Vec<(Unit, usize)> {
    let session = any_session(&mut Random(seed));
    let mut chance = Chance::of(&seed.to_le_bytes());
    let told = told(&session, &mut chance);
    let whole = told.run(told.end, None);
    let clock = *chance.pick(&CLOCKS);
    assert_eq!(told.run(told.end, clock), whole, "{} with {clock:?}", session.model);
    let mut history = told.history(&mut chance);
    assert_eq!(history.device().state(), whole, "{} with a history", session.model);
    for _ in 0..JUMPS {
        let at = match chance.pick(&told.inputs) {
            // The instant of an input, or any other.
            timed if chance.below(4) == 0 => timed.at,
            _ => Time::from_nanos(chance.below(told.end.as_nanos())),
        };
        history.go_to_time(at);
        assert_eq!(history.device().state(), told.run(at, None), "{} at {at}", session.model);
    }
    back_and_forward(history, chance)
}

/// The sessions of every second seed from one on.
fn hold_half(first: u64, cases: u64) -> Vec<(Unit, usize)> {
    let mut sums: Vec<(Unit, usize)> = Vec::new();
    for seed in (first..cases).step_by(2) {
        let made = catch_unwind(|| hold(seed)).unwrap_or_else(|reason| {
            eprintln!("seed {seed}");
            resume_unwind(reason)
        });
        for (place, (unit, count)) in made.into_iter().enumerate() {
            match sums.get_mut(place) {
                Some((_, sum)) => *sum += count,
                None => sums.push((unit, count)),
            }
        }
    }
    sums
}

/// Every unit has its share, or it was not tried.
fn hold_sessions(first: u64) {
    let asked = std::env::var("VIMC4_CASES").ok().and_then(|text| text.parse().ok());
    let cases = asked.unwrap_or(300);
    let made = hold_half(first, cases);
    let rare = |(_, sum): &(Unit, usize)| (*sum as u64) < cases / 100;
    assert!(!made.iter().any(rare), "{made:?}");
}

// Two tests, so that two processors have something to do.

#[test]
fn however_a_moment_is_reached_it_is_the_same_in_even_sessions() {
    hold_sessions(0);
}

#[test]
fn however_a_moment_is_reached_it_is_the_same_in_odd_sessions() {
    hold_sessions(1);
}
