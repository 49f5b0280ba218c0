//! Random sessions: watching changes nothing, extra wake-ups change nothing, splitting the
//! input changes nothing, and a snapshot continues anywhere.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "../../plant/tests/support/mod.rs"]
mod support;

use std::collections::BTreeMap;
use std::sync::Arc;

use support::contract::{Act, hold};
use support::{Random, try_all};
use vimc4_device::{
    CommandNumber, Device, Event, Harness, Kinds, Motion, Output, SignalId, SignalKind, Stamp, Time,
};
use vimc4_lpkf::{AfterStatus, BarePairs, Controller, LineFeed, Model, UnknownPairs};
use vimc4_plant::{Machine, PlantSignal};

const COMMANDS: &[&str] = &[
    "PA1000,500",
    "PA0,0,200,-100,300,300",
    "PR-700,20",
    "PR5",
    "AA500,500,90",
    "AR100,0,-350.5",
    "AR100,0,-450.5",
    "AR0,0,90",
    "CI200",
    "EA300,-200",
    "ER50,60",
    "IN",
    "IW0,0,900,900",
    "IW-50000,-50000,50000,50000",
    "OH",
    "OH1",
    "OH:",
    "OS",
    "PD",
    "PU",
    "VS50000",
    "VS0.02",
    "VS5",
    "!AS500",
    "!AS2000,1",
    "!OC!SV5;!RM1;!CC",
    "!OC\n!RM0\r!CC",
    "!OC",
    "!CC",
    "!CI",
    "!OI1",
    "!OI2",
    "!OI3",
    "!CM1",
    "!CS",
    "!CT0",
    "!CT1",
    "!ES1",
    "!ES0",
    "!EM1",
    "!FP",
    "!HP",
    "!GB",
    "!GO",
    "!IS",
    "!IS0",
    "!IS3",
    "!MA100,200,300,400,500,600",
    "!MR-10,20,-30,40,-50,60",
    "!OA0",
    "!OA100",
    "!ON0",
    "!ON3",
    "!PH0,1\rX300Y0F20000\rX100Y100I0J100O1\rX0Y300F-20000\r",
    "!PH0,2\rX50F5000\rX50F-5000",
    "!PH0,1\rX5",
    "!RD0",
    "!RD99",
    "!RC",
    "!RS10000",
    "!RS7937.5,0",
    "!SR0,500,0",
    "!TD1,2,3,4",
    "!TM50,60,70,80",
    "!TS20",
    "!TW100",
    "!TA5",
    "!TA100,200,300",
    "!TR-10,20,-30",
    "!VA9000,2",
    "!VU80000",
    "!VZ9000",
    "!VZ9000,2",
    "!WR0,255",
    "!WR99,1",
    "!ZA300",
    "!ZA300,2",
    "!ZR-20",
    "!ZR-20,3",
    "!CB",
    "!RP",
    "!ST",
    "XX5",
    "garbage",
];

fn session(random: &mut Random, controller: &Controller) -> Vec<(Time, Act)> {
    let signals: Vec<(SignalId, i64, i64)> = controller
        .signals()
        .iter()
        .map(|signal| match signal.kind {
            SignalKind::Analogue { low, high } => {
                (signal.id, i64::from(low.max(-300)), i64::from(high.min(300)))
            }
            _ => (signal.id, 0, 1),
        })
        .collect();
    // Faults are most of the signals and end most of what happens.
    let few = &signals[..signals.len().min(24)];
    let mut at = Time::ZERO;
    let mut acts = Vec::new();
    for _ in 0..random.range(5, 40) {
        if !random.one_in(3) {
            at = at.after_nanos(random.range(0, 900_000_000) as u64);
        }
        let act = match random.range(0, 14) {
            0 | 1 => {
                let any = if random.one_in(4) { &signals } else { few };
                let (id, low, high) = *random.pick(any);
                Act::Signal(id, random.range(low, high) as i32)
            }
            2 if random.one_in(3) => Act::Power(random.one_in(2)),
            3 => Act::Bytes((0..random.range(1, 30)).map(|_| random.next() as u8).collect()),
            4 => Act::Bytes(b"!GO;".to_vec()),
            5 if random.one_in(5) => {
                let flood = "PR1,0;".repeat(random.range(1, 900) as usize);
                Act::Bytes(flood.into_bytes())
            }
            _ => {
                let mut text = String::new();
                for _ in 0..random.range(1, 5) {
                    text.push_str(random.pick::<&str>(COMMANDS));
                    text.push_str(random.pick::<&str>(&[";", ";", "\r", "\r\n", "", "\0"]));
                }
                Act::Bytes(text.into_bytes())
            }
        };
        acts.push((at, act));
    }
    acts
}

fn controller(random: &mut Random) -> Controller {
    let (models, machines) = (Model::names(), Machine::names());
    let machine = Machine::builtin(random.pick::<&str>(&machines)).expect("built in");
    let mut model = Model::builtin(random.pick::<&str>(&models)).expect("built in");
    let other = Arc::make_mut(&mut model);
    other.language.shapes = other.name == "smcu" && random.one_in(2);
    other.quirks.after_status =
        *random.pick(&[AfterStatus::Wait, AfterStatus::Refuse, AfterStatus::Execute]);
    if random.one_in(2) {
        other.quirks.bare_pairs = BarePairs::Repeat;
        other.language.unknown_pairs = UnknownPairs::Move;
        other.language.line_feed = LineFeed::End;
    }
    Controller::new(model, machine)
}

fn try_session(seed: u64) {
    let mut random = Random(seed);
    let blind = controller(&mut random);
    let acts = session(&mut random, &blind);
    hold(blind, &acts, &mut random);
}

#[test]
fn watching_waking_and_splitting_change_nothing_and_snapshots_continue() {
    try_all(1_000, try_session);
}

/// Lets these things happen to a controller, and returns what events they led to.
fn watch(mut watched: Harness<Controller>, acts: &[(Time, Act)]) -> Vec<(Stamp, Event)> {
    for (at, act) in acts {
        watched.run_to(*at);
        watched.input(act.input());
    }
    let end = watched.now().after_nanos(3_000_000_000);
    watched.run_to(end);
    let events = watched.drain().filter_map(|output| match output {
        Output::Event(stamp, event) => Some((stamp, event)),
        Output::Bytes(..) | Output::Flash(..) => None,
    });
    events.collect()
}

/// Every event has the number of a command that came before it, or none.
fn try_numbers(seed: u64) {
    let mut random = Random(seed);
    let blind = controller(&mut random);
    let acts = session(&mut random, &blind);
    let events = watch(Harness::new(blind.clone()).watching(Kinds::ALL), &acts);

    let mut begun: BTreeMap<CommandNumber, Vec<String>> = BTreeMap::new();
    let mut moves = None;
    for (Stamp { command, .. }, event) in &events {
        if let Event::Command { mnemonic, .. } = event {
            let number = command.expect("a command has a number");
            let before = begun.entry(number).or_default();
            // What `!RP` repeats has its number.
            assert!(before.last().is_none_or(|before| before == "!RP"), "{number} came twice");
            before.push(mnemonic.to_string());
        }
        let by = command.map(|number| begun.get(&number).expect("a command before its effects"));
        match event {
            Event::Answer { mnemonic, .. } => match by {
                // What was broken off is answered by what goes on with it.
                Some(by) => assert!(
                    by.iter().any(|by| by == mnemonic || by == "!CS" || by == "!RC"),
                    "{by:?} answers as {mnemonic}"
                ),
                None => assert_eq!(mnemonic, "", "nobody asked"),
            },
            Event::Motion(Motion::Begins { .. }) => {
                assert_eq!(moves.replace(*command), None, "a motion has not ended");
            }
            Event::Motion(Motion::Changes { .. }) => assert_eq!(moves, Some(*command)),
            Event::Motion(Motion::Ends { .. }) => assert_eq!(moves.take(), Some(*command)),
            _ => {}
        }
    }
    // From a snapshot anywhere the numbers are the same.
    let place = random.range(0, acts.len() as i64 - 1) as usize;
    let (before, after) = acts.split_at(place);
    let mut first = Harness::new(blind.clone());
    for (at, act) in before {
        first.run_to(*at);
        first.input(act.input());
    }
    let mut resumed = Harness::new(blind).watching(Kinds::ALL);
    resumed.restore(first.device().state());
    let rest = watch(resumed, after);
    assert!(events.ends_with(&rest), "numbers differ after a snapshot");
}

#[test]
fn every_answer_and_effect_belongs_to_a_command_that_came_before_it() {
    try_all(300, try_numbers);
}

#[test]
fn commands_are_numbered_as_they_come_whenever_they_begin() {
    let model = Model::builtin("motionsystem").expect("built in");
    let machine = Machine::builtin("bench").expect("built in");
    let controller = Harness::new(Controller::new(model, machine));
    let ms = |ms: u64| Time::from_nanos(ms * 1_000_000);
    let stop = Act::Signal(PlantSignal::Stop.id(), 1);
    let bytes = |text: &str| Act::Bytes(text.as_bytes().to_vec());
    let acts = [
        (ms(0), bytes("!ES1;PA1000,0;PR5,5;")),
        (ms(50), stop),
        (ms(900), bytes("!CS;PA9,9;!GO;!RP;")),
    ];
    let events = watch(controller.watching(Kinds::ALL), &acts);
    let of = |(stamp, event): &(Stamp, Event)| {
        let what = match event {
            Event::Command { mnemonic, .. } => mnemonic.to_string(),
            Event::Answer { mnemonic, bytes, .. } => {
                format!("{mnemonic} {}", String::from_utf8_lossy(bytes).trim_end())
            }
            Event::Motion(Motion::Begins { .. }) => "begins".to_owned(),
            Event::Motion(Motion::Changes { .. }) => "brakes".to_owned(),
            Event::Motion(Motion::Ends { .. }) => "ends".to_owned(),
            Event::Signal { .. } => "STOP".to_owned(),
            other => format!("{other:?}"),
        };
        format!("{} {what}", stamp.command.map_or("-".to_owned(), |number| number.to_string()))
    };
    let told: Vec<String> = events.iter().map(of).collect();
    #[rustfmt::skip]
    let expected = [
        "1 !ES", "1 !ES C", "2 PA", "2 begins", "- STOP", "2 brakes", "2 ends", "2 PA E110",
        // !CS goes on with what was broken off, before what waits. Direct commands wait for nothing.
        "4 !CS", "4 begins", "6 !GO", "6 !GO C", "7 !RP", "4 ends", "4 PA C",
        // What !RP repeats comes first, and is what had been executed last when it came.
        "7 !ES", "7 !ES C", "3 PR", "3 begins", "3 ends", "3 PR C", "5 PA", "5 begins", "5 ends", "5 PA C",
    ];
    assert_eq!(told, expected);
}
