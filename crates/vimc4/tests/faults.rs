//! Faults of a running emulator: begun and ended by handles, in its states and its recordings.

#![expect(clippy::unwrap_used, reason = "tests end at what they do not expect")]

use std::io::Write;
use std::time::Duration;

use vimc4::device::{Controller, Device, Line};
use vimc4::{
    Clock, Damage, Emulator, Error, FaultNumber, LineFault, MemoryPort, Order, Time, Way, When,
    read_condition, read_fault,
};
use vimc4_timeline::recording::{Player, Recording, What};

fn emulator() -> (Emulator, MemoryPort) {
    let emu = Emulator::builder().machine("bench").time(Clock::Manual).start().unwrap();
    let port = emu.connect().unwrap();
    (emu, port)
}

/// What has come back when nothing more comes.
fn ask(emu: &Emulator, port: &mut MemoryPort, sent: &str) -> String {
    port.write_all(sent.as_bytes()).unwrap();
    emu.run_until_idle().unwrap();
    vimc4::escape(&port.drain())
}

#[test]
fn a_fault_ends_with_its_handle() {
    let (emu, mut port) = emulator();
    let cut = emu.fault("cut to-host").unwrap();
    let typed = LineFault::new(
        Damage::Duplicate,
        Way::ToHost,
        When::once().after(read_condition("at 1s", &emu.names().unwrap()).unwrap()),
    );
    let typed = emu.fault(typed).unwrap();
    assert_eq!((cut.number(), typed.number()), (FaultNumber(1), FaultNumber(2)));
    assert_eq!(ask(&emu, &mut port, "@01\r"), "");
    assert!(cut.struck().unwrap() == 1 && !cut.is_over().unwrap());
    drop(cut);
    assert_eq!(emu.advance(Duration::from_secs(1)).unwrap(), Time::from_millis(1_000));
    assert_eq!(ask(&emu, &mut port, "@01\r@01\r"), "000");
    assert!(typed.is_over().unwrap());
    assert_eq!(typed.keep(), FaultNumber(2));
    assert_eq!(emu.faults().unwrap().len(), 1);
    let ended = emu.fault("cut").unwrap();
    emu.end_faults().unwrap();
    assert!(emu.faults().unwrap().is_empty() && ended.is_over().unwrap());
    drop(ended);
    assert_eq!(ask(&emu, &mut port, "@01\r"), "0");
    let wrong = emu.fault("cut to-hots").unwrap_err();
    assert!(matches!(wrong, Error::Fault(_)), "{wrong}");
}

#[test]
fn one_fault_too_many_is_refused_and_ends_no_other() {
    let (emu, mut port) = emulator();
    let held = emu.fault("hold overtemperature").unwrap();
    for _ in 1..vimc4::MOST_FAULTS {
        emu.fault("drop to-host after x > 100").unwrap().keep();
    }
    let refused = emu.fault("drop to-host").err().unwrap().to_string();
    assert!(refused.starts_with("no more than 1,000 faults at once"), "{refused}");
    let order = Order::read("fault drop to-host", &emu.names().unwrap()).unwrap().unwrap();
    assert_eq!(emu.give(&order).unwrap(), format!("ok, without effect: {refused}"));
    assert_eq!(emu.faults().unwrap().first().unwrap().number, held.number());
    assert_eq!(ask(&emu, &mut port, "@01\r"), "0");
}

#[test]
fn what_a_person_sets_to_what_a_rule_holds_stays() {
    let (emu, _port) = emulator();
    let give = |words: &str| {
        let order = Order::read(words, &emu.names().unwrap()).unwrap().unwrap();
        emu.give(&order).unwrap()
    };
    let wrong = emu.scenario("at 1s: press stop\nwhen rule zzz: press stop").unwrap_err();
    assert_eq!(
        wrong.to_string(),
        "rule 2 is wrong: there is no rule `zzz`; write the name of a rule that there is"
    );
    let rule = emu.scenario("every 1s: input 0.3 1 until never").unwrap();
    emu.advance(Duration::from_secs(1)).unwrap();
    assert_eq!(give("input 0.3 1"), "ok");
    drop(rule);
    assert_eq!(give("input 0.3 1"), "ok, without effect: it was so already");
}

#[test]
fn a_rule_that_waits_for_one_not_there_says_so() {
    let (emu, _port) = emulator();
    let give = |words: &str| {
        let order = Order::read(words, &emu.names().unwrap()).unwrap().unwrap();
        emu.give(&order).unwrap()
    };
    assert_eq!(give("when rule zzz: press stop"), "ok, rule 1; there is no rule `zzz` yet");
    assert_eq!(give("rule zzz when x > 1: press stop"), "ok, rule 2");
    assert_eq!(give("when rule zzz: press stop"), "ok, rule 3");
    assert!(Order::read("when @PU: press stop", &emu.names().unwrap()).is_err());
}

#[test]
fn one_rule_too_many_is_refused_and_ends_no_other() {
    let (emu, _port) = emulator();
    for _ in 0..vimc4::MOST_RULES {
        emu.scenario("when x > 900: press stop").unwrap().keep();
    }
    let refused = emu.scenario("when x > 901: press stop").err().unwrap().to_string();
    assert!(refused.starts_with("no more than 1,000 rules at once"), "{refused}");
    let order = Order::read("when x > 902: press stop", &emu.names().unwrap()).unwrap().unwrap();
    assert_eq!(emu.give(&order).unwrap_err().to_string(), refused);
    let many = "[[rule]]\nwhen = \"x > 1\"\ndo = \"press stop\"\n".repeat(1_001);
    let error = vimc4_catalogue::scenario(&many, &emu.names().unwrap()).unwrap_err();
    assert!(error.message.contains("rule 1,001"), "{error:?}");
    assert_eq!(error.span.unwrap().start, many.len() - many.len() / 1_001);
}

/// Time that jumps from one thing to the next takes the end of a fault for such a thing, whatever the
/// fault.
#[test]
fn time_that_jumps_comes_to_the_end_of_every_fault() {
    for fault in ["cut for 200ms", "drop to-host for 200ms", "break 200ms", "power-off for 200ms"] {
        let emu = Emulator::builder().machine("bench").time(Clock::Instant).start().unwrap();
        let fault = emu.fault(fault).unwrap();
        emu.run_until_idle().unwrap();
        let begun = std::time::Instant::now();
        while !fault.is_over().unwrap() && begun.elapsed() < Duration::from_secs(60) {
            std::thread::yield_now();
        }
        assert!(fault.is_over().unwrap());
        assert_eq!(emu.now().unwrap(), Time::from_millis(200));
    }
}

#[test]
fn an_order_without_effect_says_what_is_in_its_way() {
    let emu = Emulator::builder().machine("mill").time(Clock::Manual).start().unwrap();
    let names = emu.names().unwrap();
    for (order, said) in [
        ("fault load z 50", "ok, without effect: the machine profile does not say what the motor"),
        ("fault hold overtemperature", "ok"),
        ("set overtemperature 0", "ok, without effect: a fault holds it; `faults` says which"),
        ("fault power-off", "ok"),
        ("power on", "ok, without effect: a fault holds it; `faults` says which"),
    ] {
        let order = Order::read(order, &names).unwrap().unwrap();
        let answer = emu.give(&order).unwrap();
        assert!(
            answer.starts_with(said) && (said != "ok" || answer == "ok"),
            "{order:?}: {answer}"
        );
    }
}

#[test]
fn a_snapshot_in_the_middle_of_faults_goes_on_as_they_did() {
    let (emu, mut port) = emulator();
    let faults = ["garble to-host 50% seed 9", "delay 30ms to-host every 3rd", "drop to-host 5%"];
    let faults = faults.map(|fault| emu.fault(fault).unwrap());
    ask(&emu, &mut port, "@01\r@01\r");
    let snapshot = emu.snapshot().unwrap();
    let line = "@01\r".repeat(40);
    let first = ask(&emu, &mut port, &line);
    assert_ne!(first, "0".repeat(40));
    emu.restore(&snapshot).unwrap();
    assert_eq!(ask(&emu, &mut port, &line), first);
    drop(faults);
    assert_eq!(ask(&emu, &mut port, "@01\r"), "0");
}

#[test]
fn a_recording_plays_its_faults_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("faulty.jsonl");
    let emu = Emulator::builder().machine("bench").time(Clock::Manual).record(path.as_path());
    let emu = emu.start().unwrap();
    let mut port = emu.connect().unwrap();
    let faults = [
        "garble to-host 30% seed 4 after x > 50",
        "drop to-controller every 7th",
        "cut to-host for 40ms after signal stop changes",
        "insert ? to-host after at 700ms",
        "speed 38400 after answer 0 then at 2s",
    ];
    let faults = faults.map(|fault| emu.fault(fault).unwrap());
    for line in ["@01\r", "@0A100,1000\r", "@0P\r", "@01\r@01\r@01\r"] {
        ask(&emu, &mut port, line);
    }
    emu.press("stop").unwrap();
    ask(&emu, &mut port, &"@01\r".repeat(9));
    emu.advance(Duration::from_secs(3)).unwrap();
    ask(&emu, &mut port, &"@01\r".repeat(9));
    drop(faults);
    ask(&emu, &mut port, "@01\r");
    drop(emu);

    let recording = Recording::read(&std::fs::read(&path).unwrap()).unwrap();
    let fresh =
        Controller::new(&vimc4::model("imc-s8").unwrap(), vimc4::machine("bench").unwrap(), b"");
    let mut player = Player::new(Line::ideal(fresh.unwrap()));
    let mut said = Vec::new();
    for entry in &recording.entries {
        let state = &|state: &_| {
            serde_json::from_value(Clone::clone(state))
                .map_err(|e: serde_json::Error| e.to_string())
        };
        if let What::Sent(bytes) = &entry.what {
            said.extend(bytes.iter().map(|byte| (entry.at, *byte)));
        }
        player.play(entry, state).unwrap();
        if let What::State { state: written, .. } = &entry.what {
            let now = serde_json::to_value(player.device().state()).unwrap();
            assert_eq!(&now, written, "at {}", entry.at);
        }
    }
    assert_eq!(player.unknown(), [""; 0]);
    let played: Vec<_> = player.said().drain(..).collect();
    assert_eq!(played, said);
    assert!(said.iter().any(|(_, byte)| *byte == b'?'), "{said:?}");
}

/// Every kind of fault is on the page, in its order, and what the page shows is one.
#[test]
fn the_page_of_faults_has_all_kinds() {
    let page = include_str!("../../../docs/faults.md");
    let (emu, _port) = emulator();
    let names = emu.names().unwrap();
    let mut shown = Vec::new();
    for (heading, way) in [("what arrives", " to-host"), ("what is wrong", "")] {
        let (_, table) = page.split_once(&format!("| fault | {heading} |\n|---|---|\n")).unwrap();
        for row in table.lines().take_while(|line| line.starts_with('|')) {
            let cell = row.split(" | ").next().unwrap_or_default();
            for fault in cell.split('`').skip(1).step_by(2) {
                let read = read_fault(&format!("{fault}{way}"), &names);
                read.unwrap_or_else(|error| panic!("{error}"));
                shown.push(fault.split(' ').next().unwrap_or_default().to_owned());
            }
        }
    }
    shown.dedup();
    let wrong = read_fault("?", &names).unwrap_err();
    let kinds = wrong.expected.rsplit(": ").next().unwrap().split(", ");
    assert_eq!(shown, kinds.collect::<Vec<_>>());
}
