//! The first instant at which a condition holds is the first that is found by looking at every
//! moment: after every cause and every input, and at every step between two causes.

use std::fmt::Debug;
use std::sync::Arc;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use vimc4_device::{
    Breakpoint, Condition, Device, Event, Harness, Input, Kinds, Motion, Output, OwnedInput, Point,
    Segment, SignalId, Time, View,
};
use vimc4_plant::Machine;
use vimc4_tests::moments::holds;

// --- the definition ---

/// What will happen outside.
type Plan = Vec<(Time, OwnedInput)>;

/// Looks at every moment of a device that stands, without forecasting anything.
struct Looking<'a, D> {
    device: D,
    machine: &'a Machine,
    condition: &'a Condition,
    /// The segment that runs, and when it began.
    running: Option<(Segment, Time)>,
    events: Vec<Event>,
}

impl<D: Device + Clone> Looking<'_, D> {
    /// The first moment from the present on, after what arrives now.
    fn first(self, arriving: &[u8], plan: Plan) -> Option<Time> {
        let condition = self.condition;
        let mut first = None;
        self.moments(arriving, plan, |is_so, at| {
            first = is_so(condition, true).then_some(at);
            first.is_some()
        });
        first
    }

    /// Every moment in which the condition becomes true, or one of several of which any is enough.
    fn beginnings(self, plan: Plan) -> Vec<Time> {
        let parts = match self.condition {
            Condition::Any(parts) => parts.clone(),
            one => vec![one.clone()],
        };
        let mut beginnings = Vec::new();
        // What is so at the very beginning does not become so.
        let mut lasts: Option<Vec<bool>> = None;
        self.moments(b"", plan, |is_so, at| {
            let now: Vec<_> = parts.iter().map(|part| is_so(part, false)).collect();
            if let Some(lasts) = lasts.replace(now)
                && parts.iter().zip(lasts).any(|(part, lasted)| !lasted && is_so(part, true))
            {
                beginnings.push(at);
            }
            false
        });
        beginnings
    }

    /// Looks at every moment from the present on, after what arrives now, until it has seen enough. It
    /// is told whether conditions hold in a moment, with what happens in it or without.
    fn moments(
        mut self,
        arriving: &[u8],
        mut plan: Plan,
        mut look: impl FnMut(&dyn Fn(&Condition, bool) -> bool, Time) -> bool,
    ) {
        self.device.watch(Kinds::ALL);
        self.device.accept(Input::Bytes(arriving), self.device.now());
        self.collect();
        self.events.clear();
        plan.reverse();
        loop {
            let (view, machine, device) = (self.view(), self.machine, &self.device);
            let is_so = |condition: &Condition, happens: bool| {
                let events: &[Event] = if happens { &self.events } else { &[] };
                holds(condition, &view, machine, device, events)
            };
            if look(&is_so, device.now()) {
                return;
            }
            let planned = plan.last().map(|(at, _)| *at);
            let wake = self.device.wake().filter(|at| *at != Time::NEVER);
            let next = wake.into_iter().chain(planned).min();
            for at in self.instants(next) {
                let mut there = self.device.clone();
                there.watch(Kinds::NONE);
                there.accept(Input::Wake, at);
                let view = there.view(at);
                let is_so =
                    |condition: &Condition, _| holds(condition, &view, machine, &there, &[]);
                if look(&is_so, at) {
                    return;
                }
            }
            let Some(next) = next else { return };
            self.events.clear();
            if !self.device.perform(next)
                && let Some((at, input)) = plan.pop()
            {
                self.device.accept(input.as_input(), at);
            }
            self.collect();
        }
    }

    fn view(&self) -> View<D::Details> {
        self.device.view(self.device.now())
    }

    /// The instants between now and what comes next at which anything can change.
    fn instants(&self, next: Option<Time>) -> Vec<Time> {
        let mut instants = Vec::new();
        times(self.condition, &mut instants);
        let before = |at: &Time| next.is_none_or(|next| *at < next);
        if let Some((segment, began)) = &self.running {
            let steps = segment.steps().map(|step| began.after_nanos(step.nanos));
            instants.extend(steps.take_while(before));
        }
        let now = self.device.now();
        instants.retain(|at| *at > now && before(at));
        instants.sort_unstable();
        instants
    }

    fn collect(&mut self) {
        while let Some(output) = self.device.poll_output() {
            let Output::Event(stamp, event) = output else { continue };
            match &event {
                Event::Motion(Motion::Begins { segment, .. }) => {
                    self.running = Some(((**segment).clone(), stamp.at));
                }
                Event::Motion(Motion::Changes { segment }) => {
                    if let Some((running, _)) = &mut self.running {
                        running.clone_from(segment);
                    }
                }
                Event::Motion(Motion::Ends { .. }) => self.running = None,
                _ => {}
            }
            self.events.push(event);
        }
    }
}

/// The times that a condition names.
fn times(condition: &Condition, found: &mut Vec<Time>) {
    match condition {
        Condition::At(time) => found.push(*time),
        Condition::All(parts) | Condition::Any(parts) => {
            parts.iter().for_each(|part| times(part, found));
        }
        _ => {}
    }
}

// --- sessions ---

/// A machine on which everything is near, so that every step can be looked at.
fn machine(axes: &str) -> Arc<Machine> {
    let mut text = "name = \"small\"\ntitle = \"a small machine\"\n".to_owned();
    for (axis, reference) in axes.chars().zip(["negative", "negative", "positive"]) {
        let (low, high, start) = if reference == "positive" { (-61, 1, -30) } else { (-1, 71, 30) };
        text.push_str(&format!(
            "[axes.{axis}]\nunit = \"linear\"\nsteps_per_turn = 400\nlead_um = 3175\n\
             reference = \"{reference}\"\nnegative_switch = {low}\npositive_switch = {high}\n\
             lowest = {}\nhighest = {}\nstart = {start}\n",
            low - 9,
            high + 9,
        ));
    }
    Arc::new(Machine::from_toml(&text).unwrap_or_else(|error| unreachable!("{error}")))
}

fn way() -> impl Strategy<Value = i64> {
    prop_oneof![Just(0), -9..=9_i64, -60..=60_i64]
}

fn speed() -> impl Strategy<Value = u32> {
    30..=5_000_u32
}

fn isel_lines() -> impl Strategy<Value = Vec<u8>> {
    let vector = || {
        (vec((way(), speed()), 3), way()).prop_map(|(ways, last)| {
            let fields: Vec<String> =
                ways.iter().map(|(way, speed)| format!("{way},{speed}")).collect();
            format!("{},{last},900", fields.join(","))
        })
    };
    let line = prop_oneof![
        4 => vector().prop_map(|fields| format!("@0A{fields}\r")),
        2 => vector().prop_map(|fields| format!("@0M{fields}\r")),
        2 => (1..300_i32, speed(), 1..25_i32, select(vec![-1, 1]), select(vec!["0", "-1"])).prop_map(
            |(steps, speed, radius, turn, plane)| {
                format!("@0f{plane}\r@0y{steps},{speed},{},{radius},0,{turn},1\r", -radius / 2)
            }
        ),
        1 => (1..8).prop_map(|axes| format!("@0R{axes}\r")),
        1 => select(vec!["@0P\r", "@0Q\r", "@0A1\r", "@0T1\r", "@0T0\r", "@0B2,1\r", "@0n7\r"])
            .prop_map(str::to_owned),
        2 => (vector(), vector(), 0..9).prop_map(|(first, second, delay)| {
            format!("@0i\r0{first}\r5{delay}\r0{second}\r33,-1\r9\r@0S\r")
        }),
    ];
    vec(line, 1..5).prop_map(|lines| format!("@07\r{}", lines.concat()).into_bytes())
}

fn lpkf_lines() -> impl Strategy<Value = Vec<u8>> {
    let line = prop_oneof![
        4 => (way(), way()).prop_map(|(x, y)| format!("PR{x},{y};")),
        3 => (0..70, 0..70).prop_map(|(x, y)| format!("PA{x},{y};")),
        2 => (-20..20, -20..20, -400..400)
            .prop_map(|(x, y, angle)| format!("AR{x},{y},{angle};")),
        1 => select(vec!["PU;", "PD;", "XX;", "!ON;", "!RP;", "!EM1;", "!TW5;", "!CS;"])
            .prop_map(str::to_owned),
        1 => Just("!PH0,1\rX9F900\rX5Y5I0J5O1\rY9F-900\r;".to_owned()),
        1 => Just("OH;".to_owned()),
    ];
    vec(line, 1..7).prop_map(|lines| format!("IW-999,-999,999,999;{}", lines.concat()).into_bytes())
}

/// What a condition can be about on a device.
#[derive(Clone, Debug)]
struct Words {
    ports: Vec<u16>,
    signals: Vec<SignalId>,
    commands: Vec<&'static str>,
    answers: Vec<&'static str>,
}

fn conditions(words: Words) -> impl Strategy<Value = Condition> {
    let Words { ports, signals, commands, answers } = words;
    let (axis, position) = (|| 0..3_u8, || -70..=70_i64);
    let point = || vec(position(), 3);
    let filled = |values: Vec<i64>, none| -> Point {
        std::array::from_fn(|axis| values.get(axis).copied().unwrap_or(none))
    };
    let like = prop::option::of(select(commands).prop_map(str::to_owned));
    let value = 0..=1_i32;
    let states = prop_oneof![
        3 => (axis(), position()).prop_map(|(axis, position)| Condition::AxisAt { axis, position }),
        2 => (axis(), position())
            .prop_map(|(axis, position)| Condition::AxisBelow { axis, position }),
        2 => (axis(), position())
            .prop_map(|(axis, position)| Condition::AxisAbove { axis, position }),
        1 => (point(), point()).prop_map(move |(low, high)| Condition::Outside {
            low: filled(low, i64::MIN),
            high: filled(high, i64::MAX),
        }),
        1 => (select(ports), 0..8_u8, any::<bool>())
            .prop_map(|(port, bit, level)| Condition::PortBit { port, bit, level }),
        1 => (axis(), any::<bool>(), any::<bool>())
            .prop_map(|(axis, positive, active)| Condition::Limit { axis, positive, active }),
        1 => (select(signals.clone()), value.clone())
            .prop_map(|(signal, value)| Condition::SignalIs { signal, value }),
        1 => Just(Condition::Idle),
        1 => (0..900_000_u64).prop_map(|micros| Condition::At(Time::from_nanos(micros * 1_000))),
    ];
    let happenings = prop_oneof![
        like.clone().prop_map(|like| Condition::Command { like }),
        like.prop_map(|like| Condition::Answered { like }),
        select(answers.clone()).prop_map(|text| Condition::Answer { text: text.to_owned() }),
        prop::option::of(select(answers).prop_map(|code| code.to_owned()))
            .prop_map(|code| Condition::Error { code }),
        prop::option::of(1..5_u32).prop_map(|line| Condition::Line { line }),
        (select(signals), prop::option::of(value))
            .prop_map(|(signal, to)| Condition::SignalChanges { signal, to }),
    ];
    prop_oneof![3 => states, 1 => happenings].prop_recursive(3, 8, 3, |inner| {
        (vec(inner, 2..4), any::<bool>()).prop_map(|(parts, all)| match all {
            true => Condition::All(parts),
            false => Condition::Any(parts),
        })
    })
}

/// Presses and releases of signals, never two things at one time.
fn presses(signals: Vec<SignalId>) -> impl Strategy<Value = Plan> {
    vec((1..400_000_u64, select(signals), 0..=1), 0..4).prop_map(|presses| {
        let mut plan: Plan = presses
            .into_iter()
            .zip(2..)
            .map(|((micros, signal, value), nanos)| {
                let at = Time::from_nanos(micros * 1_000 + nanos);
                (at, OwnedInput::Signal(signal, value))
            })
            .collect();
        plan.sort_by_key(|(at, _)| *at);
        plan
    })
}

fn check<D: Device + Clone + Debug>(
    device: &D,
    machine: &Machine,
    lines: &[u8],
    presses: &Plan,
    condition: &Condition,
) -> Result<Option<Time>, TestCaseError> {
    let look = |arriving: &[u8], plan| {
        let (device, running, events) = (device.clone(), None, Vec::new());
        Looking { device, machine, condition, running, events }.first(arriving, plan)
    };
    // Lines and buttons are to come.
    let mut plan = vec![(Time::from_nanos(1), OwnedInput::from(Input::Bytes(lines)))];
    plan.extend(presses.iter().cloned());
    let mut harness = Harness::new(device.clone());
    for (at, input) in &plan {
        harness.plan(*at, input.as_input());
    }
    let expected = look(b"", plan);
    prop_assert_eq!(harness.run_until(condition), expected, "{}", condition);
    if let Some(at) = expected {
        prop_assert_eq!(harness.now(), at);
    }
    let mut plan = vec![(Time::from_nanos(1), OwnedInput::from(Input::Bytes(lines)))];
    plan.extend(presses.iter().cloned());
    let (running, events) = (None, Vec::new());
    let looking = Looking { device: device.clone(), machine, condition, running, events };
    let expected_meetings = looking.beginnings(plan.clone());
    prop_assert_eq!(meetings(device, condition, plan), expected_meetings, "{}", condition);
    // Lines have arrived, and nothing else will.
    let mut ready = device.clone();
    ready.accept(Input::Bytes(lines), Time::ZERO);
    while ready.poll_output().is_some() {}
    let expected = look(lines, Vec::new());
    prop_assert_eq!(ready.when(condition), expected, "{}", condition);
    Ok(expected)
}

/// When a breakpoint is met.
fn meetings<D: Device + Clone>(device: &D, condition: &Condition, plan: Plan) -> Vec<Time> {
    let mut device = device.clone();
    device.watch(condition.kinds());
    let mut breakpoint = Breakpoint::new(&device, condition.clone());
    let mut plan = plan.into_iter().peekable();
    let mut met = Vec::new();
    loop {
        let wake = device.wake().filter(|at| *at != Time::NEVER);
        let planned = plan.peek().map(|(at, _)| *at);
        let look = breakpoint.next(&device);
        let Some(next) = [wake, planned, look].into_iter().flatten().min() else { return met };
        let next = next.max(device.now());
        if !device.perform(next) {
            if let Some((at, input)) = plan.next_if(|(at, _)| *at <= next) {
                device.accept(input.as_input(), at);
            } else {
                device.accept(Input::Wake, next);
            }
        }
        let mut events = Vec::new();
        while let Some(output) = device.poll_output() {
            if let Output::Event(_, event) = output {
                events.push(event);
            }
        }
        if breakpoint.look(&device, events.iter()) {
            met.push(device.now());
        }
    }
}

fn signals(device: &impl Device) -> Vec<SignalId> {
    device.signals().into_iter().map(|signal| signal.id).collect()
}

fn ports<D: Device>(device: &D) -> Vec<u16> {
    let ports = device.view(device.now()).ports;
    ports.into_iter().filter(|port| port.input).map(|port| port.port).collect()
}

#[test]
fn isel_is_as_it_is_by_looking_at_every_step() {
    let machine = machine("xyz");
    let model = vimc4_isel::Model::builtin("imc4").unwrap();
    let device = vimc4_isel::Controller::new(model, Arc::clone(&machine), b"").unwrap();
    let words = Words {
        ports: ports(&device),
        signals: signals(&device),
        commands: vec!["@A", "@0A", "@y", "@S", "@R", "?", "@0i"],
        answers: vec!["0", "1", "2", "4", "7", "F"],
    };
    let presses = presses(words.signals.clone());
    prove(&device, &machine, isel_lines(), presses, conditions(words));
}

#[test]
fn lpkf_is_as_it_is_by_looking_at_every_step() {
    for (model, axes) in [("smcu", "xyz"), ("motionsystem", "xyz")] {
        let machine = machine(axes);
        let model = vimc4_lpkf::Model::builtin(model).unwrap();
        let device = vimc4_lpkf::Controller::new(model, Arc::clone(&machine));
        let mut ports = ports(&device);
        ports.push(7);
        let words = Words {
            ports,
            signals: signals(&device),
            commands: vec!["PA", "PR", "PA1", "AR", "!PH", "OH", "?"],
            answers: vec!["C", "06", "E06", "137", "P"],
        };
        let presses = presses(words.signals.clone());
        prove(&device, &machine, lpkf_lines(), presses, conditions(words));
    }
}

/// Many turns around small circles, with registers that take a while to settle on one.
fn circles() -> impl Strategy<Value = Vec<u8>> {
    let register = || -3..=3_i64;
    let sign = || select(vec![-1, 1]);
    let line = (30..90_i32, -4..=4_i64, register(), register(), sign(), sign());
    line.prop_map(|(steps, d, x, y, rx, ry)| {
        format!("@07\r@0y{steps},3000,{d},{x},{y},{rx},{ry}\r").into_bytes()
    })
}

/// Two axes in places at once, now or after a time.
fn corners() -> impl Strategy<Value = Condition> {
    let time = (0..60_000_u64).prop_map(|micros| Condition::At(Time::from_nanos(micros * 1_000)));
    let always = Just(Condition::All(Vec::new()));
    ((-4..=4_i64, -4..=4_i64), prop_oneof![time, always]).prop_map(|((x, y), third)| {
        let at = |axis, position| Condition::AxisAt { axis, position };
        Condition::All(vec![at(0, x), at(1, y), third])
    })
}

/// A search for places on a circle goes no further than a turn, which must be enough.
#[test]
fn places_on_circles_are_found_in_their_first_turn() {
    let machine = machine("xyz");
    let model = vimc4_isel::Model::builtin("imc4").unwrap();
    let device = vimc4_isel::Controller::new(model, Arc::clone(&machine), b"").unwrap();
    prove(&device, &machine, circles(), Just(Plan::new()), corners());
}

fn prove<D: Device + Clone + Debug>(
    device: &D,
    machine: &Machine,
    lines: impl Strategy<Value = Vec<u8>>,
    presses: impl Strategy<Value = Plan>,
    conditions: impl Strategy<Value = Condition>,
) {
    let config = ProptestConfig { cases: 250, failure_persistence: None, ..Default::default() };
    let mut runner = proptest::test_runner::TestRunner::new_with_rng(
        config,
        proptest::test_runner::TestRng::deterministic_rng(
            proptest::test_runner::RngAlgorithm::ChaCha,
        ),
    );
    let cases = (lines, presses, vec(conditions, 3));
    let later = std::cell::Cell::new(0_u32);
    let result = runner.run(&cases, |(lines, presses, conditions)| {
        for condition in &conditions {
            let found = check(device, machine, &lines, &presses, condition)?;
            later.set(later.get() + u32::from(found.is_some_and(|at| at > Time::ZERO)));
        }
        Ok(())
    });
    if let Err(error) = result {
        unreachable!("{error}");
    }
    assert!(later.get() > 60, "only {} conditions came to hold while time passed", later.get());
}
