//! What is reported of a controller that runs in real time is a recording: played into a fresh one
//! in virtual time it gives the same bytes and events at the same times, and the same state.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::io::Write;
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use serde_json::Value;
use vimc4::device::{Controller, State};
use vimc4::{
    Clock, Condition, Control, Emulator, Event, EventFilter, Family, Kinds, Machine, Model, Report,
    ReportKind, Reports, Signal, Warning, Worker,
};
use vimc4_conform::fixtures;
use vimc4_conform::script::Action;
use vimc4_device::{Device, Harness, Line, LineState, Output, OwnedInput, Stamp, Time};
use vimc4_tests::fuzzing::Chance;
use vimc4_timeline::recording::{Player, Recording, Tolerance, check};

/// How many sessions are held.
const SESSIONS: u64 = 1_000;

/// So many reports of a session are kept, far more than one makes.
const ROOM: usize = 1 << 20;

/// Lets others go first, now and then for a while.
fn dawdle(chance: &mut Chance) {
    match chance.below(4) {
        0 => thread::sleep(Duration::from_micros(chance.below(300))),
        1 => thread::yield_now(),
        _ => {}
    }
}

/// What is sent in the sessions of a family, a line each.
fn lines(family: Family) -> Vec<Vec<u8>> {
    let sessions = fixtures::sessions().unwrap();
    let steps = sessions.into_iter().filter(|session| session.family == family);
    steps
        .flat_map(|session| session.steps)
        .filter_map(|step| match step.action {
            Action::Send(bytes) => Some(bytes),
            Action::Control(byte) => Some(vec![byte]),
            _ => None,
        })
        .filter(|line| line.len() < 200)
        .collect()
}

/// A client sends some lines, whole or in pieces, and may go without ending the last.
fn converse(mut port: impl Write, lines: &[Vec<u8>], mut chance: Chance) {
    for _ in 0..chance.below(8) {
        let line = chance.pick(lines).clone();
        let cut = match chance.below(3) {
            0 => chance.below(line.len() as u64 + 1) as usize,
            _ => line.len(),
        };
        let (first, second) = line.split_at(cut);
        port.write_all(first).unwrap();
        dawdle(&mut chance);
        port.write_all(second).unwrap();
        dawdle(&mut chance);
    }
}

/// A person is at the panel and the mains switch, and goes back to what was before.
fn operate(person: &Control, mut chance: Chance) {
    let signals = person.signals().wait().unwrap();
    let mut kept = person.snapshot().wait().unwrap();
    for _ in 0..chance.below(12) {
        match chance.below(16) {
            0 => _ = person.power(false).wait().unwrap(),
            1 | 2 => _ = person.power(true).wait().unwrap(),
            3 => kept = person.snapshot().wait().unwrap(),
            4 => person.restore(&kept).wait().unwrap(),
            // Clocks that run by themselves refuse, and a breakpoint may come before.
            5 => {
                let span = Duration::from_micros(chance.below(5_000_000));
                drop(person.advance(span).wait_within(Duration::from_millis(20)));
            }
            // What never comes to rest is not waited for.
            6 => drop(person.run_until_idle().wait_within(Duration::from_millis(1))),
            7 | 8 => debug(person, &signals, &mut chance),
            9 => {
                let breakpoint = *chance.pick(
                    &[
                        Condition::Command { like: None },
                        Condition::Answered { like: None },
                        Condition::AxisAbove { axis: 0, position: 20 },
                        Condition::Idle,
                    ]
                    .each_ref(),
                );
                person.break_when(breakpoint.clone()).wait().unwrap();
            }
            10 => _ = person.resume().wait(),
            _ => {
                let signal = chance.pick(&signals);
                let value = chance.below(2) as i32;
                let _ = person.set_signal(&signal.name, value).wait().unwrap();
            }
        }
        dawdle(&mut chance);
    }
}

/// Somebody pauses time and looks closely: steps, goes back or elsewhere, and lets it go on.
fn debug(person: &Control, signals: &[Signal], chance: &mut Chance) {
    person.pause().wait().unwrap();
    let before = person.controller().wait().unwrap();
    for _ in 0..chance.below(12) {
        match chance.below(8) {
            0 => person.put(before.state()).wait().unwrap(),
            1 => {
                let signal = chance.pick(signals).id;
                let value = chance.below(2) as i32;
                person.inject(OwnedInput::Signal(signal, value)).wait().unwrap();
            }
            2 => person.inject(OwnedInput::Bytes("@01\r!PA10,20;".into())).wait().unwrap(),
            3 => _ = person.hear(chance.below(20) as usize).wait().unwrap(),
            4 => {
                let mut other = person.controller().wait().unwrap();
                other.perform(Time::NEVER);
                person.put(other.state()).wait().unwrap();
            }
            _ => _ = person.step().wait().unwrap(),
        }
        dawdle(chance);
    }
    if chance.below(8) > 0 {
        person.resume().wait().unwrap();
    }
}

/// What came out at which time: byte by byte, and events with the commands they belong to.
#[derive(Clone, Debug, PartialEq)]
enum Said {
    Byte(Time, u8),
    Event(Stamp, Event),
}

/// What a controller said, as it was reported. That nobody listened is not a matter of the controller.
fn said(reports: &[Report]) -> Vec<Said> {
    let mut said = Vec::new();
    for Report { at, what, .. } in reports {
        match what {
            ReportKind::Sent { bytes } => {
                said.extend(bytes.iter().map(|byte| Said::Byte(*at, *byte)))
            }
            ReportKind::Event { event: Event::Warning(Warning::NobodyListens { .. }), .. } => {}
            ReportKind::Event { command, event } => {
                said.push(Said::Event(Stamp { at: *at, command: *command }, event.clone()));
            }
            ReportKind::Missed { reports } => panic!("{reports} reports are missing"),
            _ => {}
        }
    }
    said
}

/// What a controller has said.
fn taken(harness: &mut Harness<Line<Controller>>) -> Vec<Said> {
    let said = harness.drain().collect::<Vec<_>>().into_iter().flat_map(|output| match output {
        Output::Bytes(at, bytes) => bytes.into_iter().map(|byte| Said::Byte(at, byte)).collect(),
        Output::Event(stamp, event) => vec![Said::Event(stamp, event)],
        Output::Flash(..) => Vec::new(),
    });
    said.collect()
}

/// What comes of a recording that is played into a fresh controller.
struct Replayed {
    said: Vec<Said>,
    /// The states that were recorded, and those that came to be at these points.
    states: Vec<[LineState<State>; 2]>,
    /// What is said after the last of them at its very instant, and was not when it was recorded.
    due: Vec<Said>,
}

fn replay(reports: &[Report], fresh: &Line<Controller>) -> Replayed {
    let start = || Harness::new(fresh.clone()).watching(Kinds::ALL);
    let (mut harness, mut states, mut due) = (start(), Vec::new(), Vec::new());
    // It is led: as much has happened as is told.
    let mut stands = false;
    for Report { at, what, .. } in reports {
        match what {
            ReportKind::Input { input, .. } => {
                harness.run_to(*at);
                harness.accept(input.as_input());
            }
            ReportKind::Stands { causes } => {
                stands = true;
                match causes {
                    Some(causes) => harness.run_into(*at, *causes),
                    None => harness.run_to(*at),
                }
            }
            ReportKind::Goes => stands = false,
            ReportKind::State { by, state } => {
                let state = serde_json::from_value(state.clone()).unwrap();
                if !stands {
                    harness.run_to(*at);
                }
                if by.is_some() {
                    harness.restore(state);
                    continue;
                }
                let mut recorded = start();
                recorded.restore(state);
                if !stands {
                    recorded.run_to(*at);
                }
                due = taken(&mut recorded);
                states.push([recorded, harness.clone()].map(|of| of.device().state()));
            }
            _ => {}
        }
    }
    Replayed { said: taken(&mut harness), states, due }
}

/// A recording as people read it.
fn shown(recording: &[Report]) -> String {
    let lines = recording.iter().map(|Report { at, what, .. }| match what {
        ReportKind::State { by, .. } => format!("{at} state by {by:?}\n"),
        what => format!("{at} {what:?}\n"),
    });
    lines.collect()
}

/// Where two states differ first.
fn difference(place: &str, recorded: &Value, replayed: &Value) -> Option<String> {
    match (recorded, replayed) {
        (Value::Object(one), Value::Object(other)) if one.keys().eq(other.keys()) => one
            .iter()
            .zip(other.values())
            .find_map(|((key, one), other)| difference(&format!("{place}.{key}"), one, other)),
        _ if recorded == replayed => None,
        _ => Some(format!("{place}: {recorded}, replayed {replayed}")),
    }
}

/// The same from the file: read, played, equal in every byte, time and state up to its end.
fn hold_file(file: &Path, fresh: Line<Controller>, what: &dyn Fn() -> String) {
    let text = std::fs::read(file).unwrap();
    let recording = Recording::read(&text).unwrap();
    assert!(recording.is_whole() && recording.torn.is_none(), "{}", what());
    assert_eq!(recording.write(), text, "{}", what());
    let state = |written: &Value| {
        serde_json::from_value(written.clone()).map_err(|error| error.to_string())
    };
    let played =
        check(&recording, Player::new(fresh), Tolerance::Exact, &state, &mut |_| {}).unwrap();
    assert_eq!(played.difference, None, "{}\n{}", what(), String::from_utf8_lossy(&text));
    std::fs::remove_file(file).unwrap();
}

/// Holds a session, and plays what was reported of it. Returns how much was said.
fn hold(seed: u64, pools: &[(Family, Vec<Vec<u8>>)], worker: &Worker, folder: &Path) -> usize {
    let mut chance = Chance::of(&seed.to_le_bytes());
    let model = *chance.pick(&vimc4::models());
    let machine = *chance.pick(&vimc4::machines());
    let clocks = ["real", "real", "8x", "1000x", "100000x", "manual", "instant"];
    let clock: Clock = chance.pick(&clocks).parse().unwrap();
    let (paced, tcp) = (chance.below(3) == 0, chance.below(4) == 0);
    let (model, machine): (Model, Arc<Machine>) =
        (vimc4::model(model).unwrap(), vimc4::machine(machine).unwrap());
    let (_, lines) = pools.iter().find(|(family, _)| *family == model.family()).unwrap();

    let file = folder.join(format!("{seed}.jsonl"));
    let (tap, mut reports) = Reports::new(EventFilter::ALL, ROOM);
    let mut builder = Emulator::builder()
        .with_model(model.clone())
        .with_machine(Arc::clone(&machine))
        .time(clock)
        .line_pacing(paced)
        .on(worker)
        .record(false)
        .record(file.as_path())
        .name(seed.to_string())
        .sink(tap.clone());
    if tcp {
        builder = builder.tcp("127.0.0.1:0");
    }
    let emulator = builder.start().unwrap();
    thread::scope(|scope| {
        let ports = [emulator.connect().unwrap(), emulator.connect().unwrap()];
        for port in ports {
            let chance = chance.other();
            scope.spawn(|| converse(port, lines, chance));
        }
        if let Some(address) = emulator.tcp_addr() {
            let chance = chance.other();
            scope.spawn(move || converse(TcpStream::connect(address).unwrap(), lines, chance));
        }
        let person = emulator.control().by("a person");
        operate(&person, chance.other());
    });
    // Who begins to watch is told the state, in its place among the reports.
    emulator.control().watch(tap).wait().unwrap();
    let mut recording = Vec::new();
    let mut states = 0;
    while states < 2 {
        let report = reports.wait().unwrap();
        states += usize::from(matches!(report.what, ReportKind::State { by: None, .. }));
        recording.push(report);
    }
    drop((reports, emulator));

    let fresh = Controller::new(&model, machine, &[]).unwrap();
    let fresh = if paced { Line::paced(fresh) } else { Line::ideal(fresh) };
    let Replayed { said: replayed, states, due } = replay(&recording, &fresh);
    let mut recorded = said(&recording);
    recorded.extend(due);
    let what = || format!("session {seed}: {} at {clock}\n{}", model.name(), shown(&recording));
    for (number, (replayed, recorded)) in replayed.iter().zip(&recorded).enumerate() {
        assert_eq!(replayed, recorded, "number {number} of {}", what());
    }
    assert_eq!(replayed.len(), recorded.len(), "{}", what());
    hold_file(&file, fresh, &what);
    for [recorded, replayed] in states {
        if recorded != replayed {
            let [recorded, replayed] =
                [recorded, replayed].map(|state| serde_json::to_value(state).unwrap());
            panic!("{:?} of {}", difference("state", &recorded, &replayed), what());
        }
    }
    recorded.len()
}

#[test]
fn a_recording_gives_equal_bytes_times_and_states() {
    let pools = Family::ALL.map(|family| (family, lines(family)));
    let worker = Worker::start("replay").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let said: usize = (0..SESSIONS).map(|seed| hold(seed, &pools, &worker, folder.path())).sum();
    assert!(said > 10_000, "{said}: hardly anything has happened");
}
