//! A group is one time: in one go as in pieces, from a state taken on the way as without, and controllers
//! that nothing connects are as if they were alone.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;
use vimc4::device::{Controller, Device as _, Harness, Input, Output};
use vimc4::{Group, GroupError, Kinds, Machine, Member, Model, Simulation, Time, World};

fn profiles(family: u8) -> (Model, Arc<Machine>) {
    let (model, machine) = match family % 3 {
        0 => ("imc4", "bench"),
        1 => ("imc-s8", "mill"),
        _ => ("smcu", "bench"),
    };
    (vimc4::model(model).unwrap(), vimc4::machine(machine).unwrap())
}

/// What a host sends: moves, outputs, a program that waits for an input, questions.
fn lines(family: u8) -> &'static [&'static str] {
    match family % 3 {
        2 => &[
            "PA100,50;",
            "PR5,-7;",
            "!TW20;",
            "!WR0,1;",
            "!WR0,0;",
            "!ON0;",
            "IN;",
            "!ST;",
            "!GO;",
        ],
        _ => &[
            "@01\r",
            "@07\r",
            "@0A40,900\r",
            "@0A40,900,-5,100,3,50,0,30\r",
            "@0B0,1\r",
            "@0B0,0\r",
            "@0B0,9\r",
            "@0P\r",
            "@0b0\r",
            "@0i\r",
            "o0,3,0,-1\r",
            "p0,1,1\r",
            "05,100\r",
            "50\r",
            "30,-2\r",
            "9\r",
            "@0S\r",
            "\u{fd}",
            "\u{ff}",
            "@0R1\r",
        ],
    }
}

/// Something happens to somebody after a while.
type Deed = (u64, usize, usize);

fn deeds() -> impl Strategy<Value = Vec<Deed>> {
    prop::collection::vec((0..400_000_000_u64, 0..3_usize, 0..32_usize), 0..40)
}

/// What a deed of so many sends: bytes, or a button.
fn bytes(family: u8, which: usize) -> Option<Vec<u8>> {
    let lines = lines(family);
    let line = lines.get(which)?;
    Some(line.chars().map(|c| c as u8).collect())
}

const BUTTONS: [(&str, i32); 4] = [("start", 1), ("start", 0), ("stop", 1), ("stop", 0)];

/// A conveyor: while it is switched on, something passes the light barrier every 70 ms.
#[derive(Clone, Debug, Default, PartialEq)]
struct Conveyor {
    passes: Option<(Member, Time)>,
    count: u32,
}

impl Simulation for Conveyor {
    fn due(&self) -> Option<Time> {
        self.passes.map(|(_, at)| at)
    }

    fn act(&mut self, world: &mut World<'_>) {
        if let Some((of, at)) = &mut self.passes {
            self.count += 1;
            world.set(*of, "input 0.2", i32::from(self.count % 2 == 1));
            *at = world.now() + Duration::from_millis(70);
        }
    }

    fn output(&mut self, of: Member, port: u16, value: u8, world: &mut World<'_>) {
        // An SMCU has no such input.
        if port == 0 && world.view(of).signal("input 0.2").is_some() {
            let next = world.now() + Duration::from_millis(70);
            self.passes = (value & 1 == 1).then_some((of, next));
        }
    }
}

/// A group of three, the first two wired to each other.
fn group(family: u8) -> (Group<Conveyor>, [Member; 3]) {
    let mut group = Group::with(Conveyor::default());
    let families = [1, 1, family];
    let members = families.map(|family| {
        let (model, machine) = profiles(family);
        group.join_watched(&model, &machine, Kinds::ALL).unwrap()
    });
    let [first, second, _] = members;
    group.wire((first, 0, 0), (second, "input 0.3")).unwrap();
    group.wire((second, 0, 0), (first, "input 0.3")).unwrap();
    group.wire((second, 0, 3), (first, "stop")).unwrap();
    (group, members)
}

fn act<S: Simulation>(group: &mut Group<S>, member: Member, family: u8, which: usize) {
    match bytes(family, which) {
        Some(bytes) => group.send(member, &bytes).unwrap(),
        None => {
            let (button, value) = BUTTONS[which % 4];
            // An SMCU has no START.
            match group.set(member, button, value) {
                Ok(()) | Err(GroupError::Deed(_)) => {}
                Err(error) => panic!("{error}"),
            }
        }
    }
}

fn cases() -> u32 {
    std::env::var("VIMC4_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(48)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    /// Split anywhere, stepped cause by cause, or rolled back and done again: always the same.
    #[test]
    fn one_go_is_pieces_is_a_second_try(
        deeds in deeds(),
        splits in prop::collection::vec(0..400_000_000_u64, 1..8),
        family in 0..3_u8,
    ) {
        let (mut whole, members) = group(family);
        let (mut pieces, mut tried) = (whole.clone(), whole.clone());
        let families = [1, 1, family];
        let mut splits = splits.iter().cycle();
        for (after, who, which) in deeds {
            let at = whole.now() + Duration::from_nanos(after);
            whole.run_to(at).unwrap();
            // In pieces, some of them single causes.
            let split = (pieces.now() + Duration::from_nanos(*splits.next().unwrap())).min(at);
            pieces.run_to(split).unwrap();
            while pieces.due().is_some_and(|due| due <= at) {
                pieces.step().unwrap();
            }
            pieces.run_to(at).unwrap();
            // Rolled back from further on, in which something else has happened.
            let before = tried.state();
            tried.advance(Duration::from_millis(50)).unwrap();
            act(&mut tried, members[(who + 1) % 3], families[(who + 1) % 3], which);
            tried.restore(&before).unwrap();
            prop_assert_eq!(&tried.state(), &before);
            tried.run_to(at).unwrap();
            for group in [&mut whole, &mut pieces, &mut tried] {
                act(group, members[who], families[who], which);
            }
            prop_assert_eq!(pieces.state(), whole.state());
            prop_assert_eq!(tried.state(), whole.state());
        }
        for member in members {
            prop_assert_eq!(pieces.take_outputs(member), whole.take_outputs(member));
        }
    }

    /// Nothing connects them, so each is as if it were alone.
    #[test]
    fn strangers_in_a_group_are_alone(deeds in deeds(), family in 0..3_u8) {
        let families = [family, 1];
        let mut group = Group::new();
        let mut alone = Vec::new();
        let mut members = Vec::new();
        for family in families {
            let (model, machine) = profiles(family);
            members.push(group.join_watched(&model, &machine, Kinds::ALL).unwrap());
            let controller = Controller::new(&model, machine, &[]).unwrap();
            alone.push(Harness::new(controller).watching(Kinds::ALL));
        }
        for (after, who, which) in deeds {
            let who = who % 2;
            let at = group.now() + Duration::from_nanos(after);
            group.run_to(at).unwrap();
            act(&mut group, members[who], families[who], which);
            alone.iter_mut().for_each(|harness| harness.run_to(at));
            let harness = &mut alone[who];
            match bytes(families[who], which) {
                Some(bytes) => harness.send(&bytes),
                None => {
                    let (button, value) = BUTTONS[which % 4];
                    let signals = harness.device().signals();
                    if let Some(signal) = signals.iter().find(|signal| signal.name == button) {
                        harness.input(Input::Signal(signal.id, value));
                    }
                }
            }
        }
        for (member, harness) in members.iter().zip(&mut alone) {
            let outputs: Vec<Output> = harness.drain().collect();
            prop_assert_eq!(group.take_outputs(*member), outputs);
            prop_assert_eq!(group.view(*member), harness.device().view(group.now()));
        }
    }
}

#[test]
fn wires_and_the_simulation_act_at_the_instant() {
    let (mut group, [first, second, _]) = group(0);
    let level = |group: &Group<Conveyor>, of: Member| group.view(of).signal("input 0.3").unwrap();
    group.send(first, b"@0B0,1\r").unwrap();
    assert_eq!((level(&group, first), level(&group, second)), (0, 1));
    group.advance(Duration::from_millis(700)).unwrap();
    assert_eq!(group.simulation().count, 10);
    // Bit 3 of the second is the STOP button of the first, which halts in the same instant.
    group.send(first, b"@01\r@0A4000,300\r").unwrap();
    group.advance(Duration::from_secs(1)).unwrap();
    group.take_bytes(first);
    group.send(second, b"@0B0,8\r").unwrap();
    group.advance(Duration::from_millis(1)).unwrap();
    assert_eq!((group.take_bytes(first), group.position(first)[0]), (b"F".to_vec(), 300));
}

#[test]
fn at_the_same_instant_whoever_joined_first_is_first() {
    let (model, machine) = profiles(0);
    let mut group = Group::new();
    let members = [(); 2].map(|()| group.join(&model, &machine).unwrap());
    for member in members.iter().rev() {
        group.send(*member, b"@01\r@0A40,400\r").unwrap();
        group.take_bytes(*member);
    }
    let [first, second] = members;
    let end = group.due().unwrap();
    assert_eq!(group.step().unwrap(), Some(end));
    assert_eq!((group.take_bytes(first), group.take_bytes(second)), (b"0".to_vec(), Vec::new()));
    assert_eq!(group.step().unwrap(), Some(end));
    assert_eq!(group.take_bytes(second), b"0");
    assert_eq!(group.step().unwrap(), None);
}

#[test]
fn what_is_not_there_is_said_with_what_is() {
    let (model, machine) = profiles(0);
    let mut group = Group::new();
    let one = group.join(&model, &machine).unwrap();
    let said = |error: Result<(), GroupError>| error.unwrap_err().to_string();
    let text = said(group.wire((one, 7, 0), (one, "input 0.0")));
    assert!(
        text.starts_with("the imc4 has no output port 7 with a bit 0; its output ports are 0"),
        "{text}"
    );
    let text = said(group.wire((one, 0, 0), (one, "lamp")));
    assert!(text.starts_with("there is no signal `lamp`; there are start, stop"), "{text}");
    assert_eq!(said(group.set(one, "start", 7)), "`start` cannot be `7`; it can be 0 or 1");
    let text = said(group.restore(&Group::new().state()));
    assert_eq!(
        text,
        "this is the state of a group of nobody, and here is a group of imc4 (bench): restore it where it was \
         taken"
    );
    // As many controllers, but others.
    for family in [1, 2] {
        let (model, machine) = profiles(family);
        let mut others = Group::new();
        others.join(&model, &machine).unwrap();
        others.advance(Duration::from_secs(3)).unwrap();
        let before = group.state();
        let text = said(group.restore(&others.state()));
        assert!(
            text.contains(if family == 1 { "imc-s8 (mill)" } else { "smcu (bench)" }),
            "{text}"
        );
        assert_eq!(group.state(), before);
    }
}

/// It fails half a second after the beginning, or as soon as it hears of an output.
#[derive(Clone, Debug)]
struct Fragile {
    hears: bool,
    wrong: fn(&mut World<'_>, Member),
}

impl Simulation for Fragile {
    fn due(&self) -> Option<Time> {
        (!self.hears).then_some(Time::from_nanos(500_000_000))
    }

    fn act(&mut self, world: &mut World<'_>) {
        let one = world.members().next().unwrap();
        (self.wrong)(world, one);
    }

    fn output(&mut self, of: Member, _: u16, _: u8, world: &mut World<'_>) {
        if self.hears && world.now() > Time::ZERO {
            (self.wrong)(world, of);
        }
    }
}

/// With whom it drives, on the way since the beginning.
fn fragile(hears: bool, wrong: fn(&mut World<'_>, Member)) -> (Group<Fragile>, Member) {
    let mut group = Group::with(Fragile { hears, wrong });
    let (model, machine) = profiles(1);
    let one = group.join(&model, &machine).unwrap();
    group.send(one, b"@01\r@0A9000,900\r").unwrap();
    (group, one)
}

#[test]
fn time_stands_still_where_the_simulation_fails() {
    let end = Time::from_nanos(500_000_000);
    let far = Duration::from_secs(10);
    type Goes = fn(&mut Group<Fragile>, Member, Duration) -> Result<(), GroupError>;
    let ways: [Goes; 4] = [
        |group, _, far| group.advance(far).map(drop),
        |group, _, _| group.run_until_idle().map(drop),
        |group, _, far| group.advance_to_next(far).map(drop),
        |group, one, _| {
            let there = vimc4::Condition::AxisAt { axis: 0, position: 8_000 };
            group.run_until(one, &there).map(drop)
        },
    ];
    for go in ways {
        let (mut group, one) = fragile(false, |world, one| {
            world.set(one, "stop", 1);
            world.fail("the belt has torn");
        });
        let error = go(&mut group, one, far).unwrap_err();
        assert_eq!(
            error.to_string(),
            "at 0.500000000 s the simulation has failed: the belt has torn"
        );
        // Up to 900 steps a second, and nothing is set.
        assert_eq!(group.now(), end);
        assert!((440..=450).contains(&group.position(one)[0]), "{:?}", group.position(one));
        assert_eq!(group.view(one).signal("stop"), Some(0));
    }
    // A mistake in what it sets is one, too.
    for (wrong, says) in [
        (
            (|world, one| world.set(one, "bell", 1)) as fn(&mut World<'_>, Member),
            "no signal `bell`",
        ),
        (|world, one| world.set(one, "stop", 2), "`stop` cannot be `2`; it can be 0 or 1"),
    ] {
        let (mut group, _) = fragile(false, wrong);
        let error = group.advance(far).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
        assert_eq!(group.now(), end);
    }
}

#[test]
fn wires_carry_what_a_failed_simulation_does_not_hear() {
    let (mut group, one) = fragile(true, |world, _| world.fail("deaf"));
    group.wire((one, 0, 0), (one, "input 0.5")).unwrap();
    group.advance(Duration::from_secs(20)).unwrap();
    group.take_bytes(one);
    assert!(group.send(one, b"@0B0,1\r").is_err());
    // The rest of the instant is not lost.
    assert_eq!(
        (group.take_bytes(one), group.view(one).signal("input 0.5")),
        (b"0".to_vec(), Some(1))
    );
}

/// It is due in the past for ever.
#[derive(Clone, Debug)]
struct Late;

impl Simulation for Late {
    fn due(&self) -> Option<Time> {
        Some(Time::ZERO)
    }

    fn act(&mut self, _: &mut World<'_>) {}
}

#[test]
fn a_simulation_that_is_always_due_is_an_error() {
    let mut group = Group::with(Late);
    for _ in 0..2 {
        let error = group.advance(Duration::from_secs(1)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "at 0.000000000 s the simulation acts again and again; after it has acted, it has to be due later, or not \
             at all"
        );
        assert!(matches!(group.run_until_idle(), Err(GroupError::Insistent { at: Time::ZERO })));
    }
}
