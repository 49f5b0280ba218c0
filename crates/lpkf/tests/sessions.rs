//! Random sessions: watching changes nothing, extra wake-ups change nothing, splitting the
//! input changes nothing, and a snapshot continues anywhere.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "../../plant/tests/support/mod.rs"]
mod support;

use std::sync::Arc;

use support::contract::{Act, hold};
use support::{Random, try_all};
use vimc4_device::{Device, SignalId, SignalKind, Time};
use vimc4_lpkf::{AfterStatus, BarePairs, Controller, LineFeed, Model, UnknownPairs};
use vimc4_plant::Machine;

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

fn try_session(seed: u64) {
    let mut random = Random(seed);
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
    let blind = Controller::new(model, machine);
    let acts = session(&mut random, &blind);
    hold(blind, &acts, &mut random);
}

#[test]
fn watching_waking_and_splitting_change_nothing_and_snapshots_continue() {
    try_all(1_000, try_session);
}
