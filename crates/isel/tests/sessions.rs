//! Random sessions: watching changes nothing, extra wake-ups change nothing, splitting the
//! input changes nothing, and a snapshot continues anywhere.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "../../plant/tests/support/mod.rs"]
mod support;

use support::contract::{Act, hold};
use support::{Random, try_all};
use vimc4_device::{
    CommandNumber, Device, Event, Harness, Kinds, Motion, Output, SignalId, Stamp, Time, Warning,
};
use vimc4_isel::{Controller, LowerCase, Model};
use vimc4_plant::{Machine, PlantSignal};

const LINES: &[&str] = &[
    "@01",
    "@03",
    "@07",
    "@08",
    "@0R7",
    "@0R1",
    "@0r8",
    "@0A500,2000",
    "@0A-900,9000,300,500",
    "@0a100,4000,-200,800,50,2000,-50,2000",
    "@0M0,1000,0,1000,0,1000,0,1000",
    "@0M10,500",
    "@0P",
    "@0b0",
    "@0b1",
    "@0B2,1",
    "@0B0,255",
    "@0B3,0",
    "@0B3,1",
    "@0d900",
    "@0d900,900,900",
    "@0n7",
    "@0N7",
    "@0z1",
    "@0z0",
    "@0e1",
    "@0e0",
    "@0f-1",
    "@0y400,1500,119,-141,141,-1,-1",
    "@0y800,4000,-50,100,0,-1,1",
    "@0w800,2000,-50,100,0,-1,1,-300",
    "@0S",
    "@0s",
    "@0T1",
    "@0T0",
    "@0F1",
    "@0Z0,1,1,900,800,0,0",
    "@0Z0,1,1,900,800",
    "@0H",
    "@0V",
    "@0DS0",
    "@0DRp",
    "@0i",
    "@0k",
    "@0j200",
    "@0J50",
    "@0ID1",
    "@0IE4660",
    "@0IX",
    "@0IW",
    "@0IA0,1,0",
    "@0Ia0,1,1",
    "@0?",
    "@1P",
    "@0A1,1,1",
    "@0Ax,1",
    "garbage",
    "0100,900",
    "0-50,4000,20,300",
    "3 4,-1",
    "30,-2",
    "30,0",
    "o0,0,1,-1",
    "o0,128,1,2",
    "p0,1,1",
    "p2,1,1",
    "50",
    "52",
    "9",
    "m0,900",
    "77",
    "71",
    "n1",
    "z1",
    "y400,1500,119,-141,141,-1,-1",
    "133",
    "233,-1",
    "6 0,0,1",
    "e1",
];

fn session(random: &mut Random, controller: &Controller) -> Vec<(Time, Act)> {
    let signals: Vec<SignalId> = controller.signals().iter().map(|signal| signal.id).collect();
    let mut at = Time::ZERO;
    let mut acts = vec![(at, Act::Bytes(b"@07\r".to_vec()))];
    for _ in 0..random.range(5, 40) {
        if !random.one_in(3) {
            at = at.after_nanos(random.range(0, 900_000_000) as u64);
        }
        let act = match random.range(0, 19) {
            0 => Act::Bytes(vec![253]),
            1 => Act::Bytes(vec![255]),
            2 if random.one_in(3) => Act::Bytes(vec![254]),
            3..=5 => Act::Signal(*random.pick(&signals), random.range(0, 1) as i32),
            6 if random.one_in(3) => Act::Power(random.one_in(2)),
            7 => Act::Bytes((0..random.range(1, 30)).map(|_| random.next() as u8).collect()),
            _ => {
                let mut text = String::new();
                for _ in 0..random.range(1, 4) {
                    text.push_str(random.pick::<&str>(LINES));
                    text.push_str(if random.one_in(9) { "\r\n" } else { "\r" });
                }
                Act::Bytes(text.into_bytes())
            }
        };
        acts.push((at, act));
    }
    acts
}

fn begin(random: &mut Random) -> Controller {
    let (models, machines) = (Model::names(), Machine::names());
    let machine = Machine::builtin(random.pick::<&str>(&machines)).expect("built in");
    let model = Model::builtin(random.pick::<&str>(&models)).expect("built in");
    Controller::new(model, machine, b"").expect("an erased flash memory")
}

fn try_session(seed: u64) {
    let mut random = Random(seed);
    let blind = begin(&mut random);
    let acts = session(&mut random, &blind);
    let resumed = hold(blind, &acts, &mut random);

    // What the flash image says is what the controller has.
    let model = Model::builtin(&resumed.model().name).expect("built in");
    let image = resumed.flash_image();
    let bench = Machine::builtin("bench").expect("built in");
    let reread = Controller::new(model, bench, &image).expect("its own image");
    assert_eq!(reread.flash_image(), image);
}

/// Every answer belongs to one command that came before it, and none is answered twice, except where
/// a motion that was answered before it began is told to have ended early; what belongs to no command
/// is of control codes, or of what START has begun or gone on with.
fn try_numbers(seed: u64) {
    let mut random = Random(seed);
    let controller = begin(&mut random);
    let late = controller.model().quirks.lower_case == LowerCase::BeforeAndError;
    let acts = session(&mut random, &controller);
    let mut harness = Harness::new(controller).watching(Kinds::ALL);
    for (at, act) in &acts {
        harness.plan(*at, act.input());
    }
    let end = acts.last().map_or(Time::ZERO, |(at, _)| at.after_nanos(30_000_000_000));
    harness.run_to(end);

    let is_start = |act: &Act| matches!(act, Act::Signal(id, 1) if *id == PlantSignal::Start.id());
    let started = acts.iter().find(|(_, act)| is_start(act)).map(|(at, _)| *at);
    // The number that comes next, whether each so far is answered, and whose motion runs.
    let (mut next, mut answered, mut moving) = (CommandNumber::FIRST, Vec::new(), None);
    for output in harness.outputs() {
        let Output::Event(Stamp { at, command }, event) = output else { continue };
        let place = command.map(|number| number.0.get() as usize - 1);
        match event {
            Event::Command { mnemonic, .. } => {
                assert_eq!(*command, Some(next), "{event:?}");
                next = next.next();
                answered.push((mnemonic, 0));
            }
            Event::Answer { mnemonic, why, .. } => match place {
                Some(place) => {
                    let (_, times) = &mut answered[place];
                    *times += 1;
                    let may_be_second = late && why.is_some();
                    assert!(*times == 1 || may_be_second, "{event:?} at {at}");
                }
                None => {
                    let by_button = started.is_some_and(|started| started <= *at);
                    assert!(matches!(&**mnemonic, "254" | "255") || by_button, "{event:?} at {at}");
                }
            },
            Event::Motion(Motion::Begins { .. }) => moving = Some(*command),
            Event::Motion(_) => assert_eq!(moving, Some(*command), "{event:?} at {at}"),
            Event::Ignored { .. }
            | Event::Switch { .. }
            | Event::Warning(Warning::ReceiveOverflow { .. }) => assert_eq!(*command, None),
            _ => {}
        }
        assert!(place.is_none_or(|place| place < answered.len()), "{event:?} came too early");
    }
    // Whoever is not answered is still at it, or was interrupted.
    let interrupts = |act: &Act| match act {
        Act::Bytes(bytes) => bytes.contains(&254),
        Act::Signal(..) => false,
        Act::Power(_) => true,
    };
    if !acts.iter().any(|(_, act)| interrupts(act)) && harness.device().is_idle() {
        // The self-test says what it says.
        let is_silent = |(mnemonic, times): &&(_, u32)| *times == 0 && *mnemonic != "@?";
        let silent: Vec<_> = answered.iter().filter(is_silent).collect();
        assert!(silent.is_empty(), "{silent:?} have no answer");
    }
}

#[test]
fn every_answer_belongs_to_one_command() {
    try_all(2_000, try_numbers);
}

#[test]
fn watching_waking_and_splitting_change_nothing_and_snapshots_continue() {
    try_all(1_000, try_session);
}
