//! A debugger over any history: what goes back comes forward again, and what is typed breaks nothing.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::Duration;

use vimc4_catalogue::{bare, machine, model, models};
use vimc4_debug::{Debugger, Depth, Reason, Stop, Unit, Way, Wired, uninterrupted};
use vimc4_device::{Condition, Device, Input, Kinds, Line, OwnedInput, SignalId, Time, TimedInput};
use vimc4_timeline::{
    Act, Begins, BranchId, Found, History, Limits, Place, Sought, Stretch, Which,
};

use super::chance::Chance;
use super::operations::{Operation, Operations, Setup};

/// So many operations count; what follows does not.
const OPERATIONS_MAX: usize = 60;
/// So many acts are performed in one operation at most, and in all.
const ACTS_MAX: usize = 200;
const ALL_ACTS_MAX: u64 = 2_000;
/// So many steps are gone back and forward.
const STEPS_MAX: u64 = 6;
/// The last time that anybody waits for.
const LATEST: Time = Time::from_millis(86_400_000_000);

/// A controller gets the operations that some bytes stand for, some of them in its past. Then, from
/// some places and by every unit, so many steps back and as many forward lead to where they began,
/// and to the same places on the way; and what is searched for is found at the same places from both
/// sides, and where somebody finds it who goes through everything. The input is as for `history`.
///
/// # Panics
///
/// If something does not hold.
pub fn walk(data: &[u8]) {
    let Some((family, rest)) = data.split_first() else { return };
    let (setup, operations) = Setup::decode(rest);
    let name = match family {
        b'i' => setup.model_of(&vimc4_isel::Model::names()),
        _ => setup.model_of(&vimc4_lpkf::Model::names()),
    };
    let (Ok(model), Ok(machine)) = (model(name), machine(&setup.machine().name)) else { return };
    let Ok(device) = bare(&model, &machine, &[]) else { return };
    let mut chance = Chance::of(data);
    let (spacing, snapshots) = (1 + chance.below(60), 2 + chance.below(20) as usize);
    let limits = Limits { spacing, snapshots, stride: 7, waypoints: 20 };
    let mut history = History::within(Line::ideal(device), limits);
    history.watch(Kinds::ALL);
    perform(&mut history, operations, &mut chance);
    let mut debugger = Debugger::over(history);
    debugger.stay_within(true);
    let mut walker = Walker { debugger, chance };
    walker.by_every_unit();
    walker.found_from_both_sides();
}

/// From some places of a history, and by every unit, so many steps back and as many forward lead to
/// where they began, to the same states on the way. Says how many steps of each unit were made back.
///
/// # Panics
///
/// If something does not hold.
pub fn back_and_forward(history: History<Wired>, chance: Chance) -> Vec<(Unit, usize)> {
    let mut debugger = Debugger::over(history);
    debugger.stay_within(true);
    Walker { debugger, chance }.by_every_unit()
}

/// What is done to the controller.
fn perform(history: &mut History<Wired>, operations: &[u8], chance: &mut Chance) {
    let mut acts = 0;
    let mut run_to = |history: &mut History<Wired>, at: Time| {
        let mut count = 0;
        let at = at.min(LATEST);
        while count < ACTS_MAX && history.find_next(at, |_, _, _| true) {
            count += 1;
        }
        if count < ACTS_MAX {
            history.run_to(at);
        }
        acts += count as u64;
        acts
    };
    for operation in Operations::new(operations).take(OPERATIONS_MAX) {
        let now = history.now();
        let due = history.device().wake();
        let all = match operation {
            Operation::Send(bytes) => {
                history.give(Input::Bytes(bytes));
                run_to(history, now)
            }
            Operation::Signal(place, value) => {
                let listed = history.device().signals();
                let signal = listed.get(usize::from(place) % (listed.len() + 1));
                let id = signal.map_or(SignalId(u16::from(place)), |signal| signal.id);
                history.give(Input::Signal(id, i32::from(value)));
                run_to(history, now)
            }
            Operation::Power(on) => {
                history.give(Input::Power(on));
                run_to(history, now)
            }
            Operation::Wait(nanos) => run_to(history, now.after_nanos(nanos)),
            Operation::Rest => run_to(history, now.after_nanos(60_000_000_000)),
            Operation::Next | Operation::Again(_) => run_to(history, due.unwrap_or(now)),
            Operation::Before(nanos) => {
                let at = due.unwrap_or(now).as_nanos().saturating_sub(u64::from(nanos));
                run_to(history, Time::from_nanos(at))
            }
            // What is done next is done in the past, on a branch of its own.
            Operation::Snapshot | Operation::Restore | Operation::Restart => {
                let at = chance.below(now.as_nanos() + 1);
                history.go_to_time(Time::from_nanos(at));
                0
            }
            Operation::Look(_, way) => {
                (0..way.unsigned_abs() % 8).take_while(|_| history.back()).count() as u64
            }
        };
        if all > ALL_ACTS_MAX {
            break;
        }
    }
}

struct Walker {
    debugger: Debugger,
    chance: Chance,
}

/// Where one stands, and what is there.
type Here = (Place, <Wired as Device>::State);

impl Walker {
    fn here(&self) -> Here {
        (self.debugger.place(), self.debugger.line().state())
    }

    fn step(&mut self, unit: Unit, way: Way) -> Stop {
        self.debugger.step(unit, way, Depth::Into, 1, &mut uninterrupted)
    }

    /// Somewhere on some branch.
    fn anywhere(&mut self) {
        let history = self.debugger.history_mut();
        let branches = history.branches().count() as u64;
        history.go_to_end(BranchId(self.chance.below(branches) as u32));
        let at = self.chance.below(history.now().as_nanos() + 2);
        history.go_to_time(Time::from_nanos(at));
    }

    fn by_every_unit(&mut self) -> Vec<(Unit, usize)> {
        let span = Duration::from_nanos(1 + self.chance.below(50_000_000));
        let named = Unit::NAMED.into_iter().map(|(_, unit, _)| unit);
        named.chain([Unit::Time(span)]).map(|unit| (unit, self.back_and_forward(unit))).collect()
    }

    fn back_and_forward(&mut self, unit: Unit) -> usize {
        self.anywhere();
        // From where such a step ends.
        if self.step(unit, Way::Forward).why != Reason::Step(unit)
            && self.step(unit, Way::Back).why != Reason::Step(unit)
        {
            return 0;
        }
        let mut trail = vec![self.here()];
        for _ in 0..1 + self.chance.below(STEPS_MAX) {
            if self.step(unit, Way::Back).why != Reason::Step(unit) {
                break;
            }
            let here = self.here();
            let last = trail.last().map(|(place, _)| *place);
            assert!(last.is_none_or(|last| place_is_before(here.0, last)), "{unit}: {last:?}");
            trail.push(here);
        }
        // The beginning may have come before the step was whole.
        if let Some((place, _)) = trail.pop() {
            assert!(self.debugger.history_mut().go_back_to(place));
        }
        let made = trail.len();
        for (place, state) in trail.into_iter().rev() {
            let stop = self.step(unit, Way::Forward);
            assert_eq!(stop.why, Reason::Step(unit), "to {place:?}");
            assert_eq!(self.debugger.place(), place, "a {unit} back and forward");
            assert_eq!(self.debugger.line().state(), state, "a {unit} to {place:?}");
        }
        made
    }

    /// The same is found forward, backwards, and by somebody who leaves nothing out.
    fn found_from_both_sides(&mut self) {
        /// So many are looked for.
        const FOUND_MAX: usize = 40;
        let history = self.debugger.history_mut();
        let branches = history.branches().count() as u64;
        history.go_to_end(BranchId(self.chance.below(branches) as u32));
        let end = history.now();
        let position = history.device().position(end);
        for condition in conditions(&mut self.chance, position) {
            let history = self.debugger.history_mut();
            let first = history.branches().next().map(|branch| branch.first).unwrap_or_default();
            let begin = Place { branch: BranchId(0), moment: first };
            assert!(history.go_back_to(begin));
            let mut forward = Vec::new();
            let mut begins = Begins::new(&condition);
            while forward.len() < FOUND_MAX
                && history.seek_next(end, &mut begins, &mut uninterrupted) == Found::Here
            {
                forward.push(history.present());
            }
            assert!(history.go_back_to(begin));
            let mut all = Vec::new();
            let mut plain = Plain(Begins::new(&condition));
            while all.len() < FOUND_MAX
                && history.seek_next(end, &mut plain, &mut uninterrupted) == Found::Here
            {
                all.push(history.present());
            }
            assert_eq!(forward, all, "{condition} is left out");
            if forward.len() == FOUND_MAX {
                continue;
            }
            let heading = history.heading();
            history.go_to_end(heading);
            let mut back = Vec::new();
            let mut begins = Begins::new(&condition);
            let mut found = history.seek_last_or_here(&mut begins, &mut uninterrupted);
            while found == Found::Here && back.len() <= FOUND_MAX {
                back.push(history.present());
                found = history.seek_last(&mut begins, &mut uninterrupted);
            }
            back.reverse();
            assert_eq!(back, forward, "{condition} from both sides");
        }
    }
}

fn place_is_before(one: Place, other: Place) -> bool {
    one.branch != other.branch || one.moment < other.moment
}

/// Conditions that a controller may come to.
fn conditions(chance: &mut Chance, position: vimc4_device::Point) -> Vec<Condition> {
    let axis = chance.below(3) as u8;
    let place = position[usize::from(axis)];
    let position = place / 2 + chance.below(20) as i64 - 10;
    let low = [position.min(0); vimc4_device::AXES];
    let high = [position.max(0); vimc4_device::AXES];
    let line = Condition::Line { line: Some(1 + chance.below(4) as u32) };
    let signal = SignalId(chance.below(30) as u16);
    vec![
        Condition::AxisAt { axis, position },
        Condition::AxisBelow { axis, position },
        Condition::AxisAbove { axis, position },
        Condition::Outside { low, high },
        Condition::Limit { axis, positive: chance.below(2) == 0, active: true },
        Condition::Idle,
        Condition::Command { like: Some("@A".to_owned()) },
        Condition::Command { like: Some("PA".to_owned()) },
        Condition::Answer { text: "0".to_owned() },
        Condition::Error { code: None },
        line,
        Condition::SignalChanges { signal, to: None },
        Condition::Any(vec![Condition::AxisAbove { axis, position }, Condition::Idle]),
        Condition::All(vec![
            Condition::AxisAbove { axis, position },
            Condition::AxisBelow { axis: 0, position: 1_000 },
        ]),
    ]
}

/// One who goes through everything.
struct Plain<'c>(Begins<'c>);

impl<D: Device> Sought<D> for Plain<'_> {
    fn can_be_in(&self, _: &Stretch) -> bool {
        true
    }

    fn begin(&mut self, device: &D) {
        self.0.begin(device);
    }

    fn between(&mut self, device: &D, until: Time, which: Which) -> Option<Time> {
        self.0.between(device, until, which)
    }

    fn after(&mut self, device: &D, act: Act, outputs: &VecDeque<vimc4_device::Output>) -> bool {
        self.0.after(device, act, outputs)
    }
}

/// What is done before somebody types.
const PRELUDE: [&str; 3] = [
    "@07\r@0A1000,2000,0,21,0,21,0,21\r@0P\r@0A-100,2000\r",
    "@07\r@0i\r00,500,0,500,0,500,0,500\r31,-1\r9\r@0S\r",
    "!CM1;PU;PA1000,1000;PD;PR5,5;!OS;",
];

/// Lines that somebody types into a console: each is carried out, or refused with what is wrong; and
/// every beginning of one can be completed. The first byte says which controller, the rest are the
/// lines.
///
/// # Panics
///
/// If something does not hold.
pub fn console(data: &[u8]) {
    /// So many lines count.
    const LINES_MAX: usize = 12;
    /// A search is given up when it was asked so often.
    const ASKED_MAX: u32 = 20;
    let Some((which, text)) = data.split_first() else { return };
    let names = models();
    let name = names[usize::from(*which) % names.len()];
    let (Ok(model), Ok(machine)) = (model(name), machine("bench")) else { return };
    let Ok(device) = bare(&model, &machine, &[]) else { return };
    let mut debugger = Debugger::new(device);
    let prelude = PRELUDE[usize::from(*which / 32) % PRELUDE.len()];
    let input = OwnedInput::from(Input::Bytes(prelude.as_bytes()));
    debugger.follow(&TimedInput { at: Time::from_millis(5), input });
    let text = String::from_utf8_lossy(text);
    for line in text.lines().take(LINES_MAX) {
        let mut asked = 0;
        let mut give_up = |_: Time| {
            asked += 1;
            if asked > ASKED_MAX { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let shown = match debugger.execute(line, &mut give_up) {
            Ok(answer) => answer.to_string(),
            Err(error) => error.to_string(),
        };
        assert!(!shown.contains('\u{1b}'), "{shown}");
        let place = debugger.place();
        assert!(debugger.history_mut().go_back_to(place), "the present is none: {place:?}");
        let cursor = line.len() / 2;
        let completion = debugger.complete(line, cursor);
        if let Some(begun) = line.get(..cursor) {
            let word = &begun[completion.from..];
            let fits = |text: &str| text.starts_with(word) && text != word;
            assert!(completion.candidates.iter().all(|candidate| fits(&candidate.text)));
        }
    }
}

/// A line for every command of the console.
pub(super) fn lines() -> Vec<Vec<u8>> {
    let examples: Vec<&str> =
        vimc4_debug::TABLE.iter().map(|directive| directive.example).collect();
    let some = |(number, lines): (usize, &[&str])| {
        let text = lines.join("\n") + "\nback 3 causes\nwhy\nwhere\nframes\nlist\nstep 2 events";
        [&[(number as u8).wrapping_mul(37)], text.as_bytes()].concat()
    };
    examples.chunks(5).enumerate().map(some).collect()
}
