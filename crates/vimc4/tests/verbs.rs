//! Every verb of the table is documented, has a method, and does what it says.

#![expect(clippy::cognitive_complexity, clippy::too_many_lines, reason = "one test is one story")]
#![expect(
    clippy::expect_used,
    clippy::unwrap_used,
    reason = "a test that finds nothing has failed"
)]

use std::fs;
use std::io::{Read, Write};
use std::time::Duration;

use vimc4::{Clock, Emulator, Names, Order, Sort, Time, Verb, help, help_on};

/// An emulator whose time stands still, with the names of its axes and signals.
fn emulator() -> (Emulator, Names) {
    let emu = Emulator::builder().machine("bench").time(Clock::Manual).start().unwrap();
    let names = emu.names().unwrap();
    (emu, names)
}

/// What an order is answered.
fn give(emu: &Emulator, names: &Names, line: &str) -> String {
    let order = Order::read(line, names).unwrap().expect("it says something");
    vimc4_host::block_on(emu.control().give(&order)).unwrap()
}

#[test]
fn each_verb_does_what_it_says() {
    for verb in Verb::all() {
        let (emu, names) = emulator();
        let give = |line: &str| give(&emu, &names, line);
        let signal = |name: &str| emu.view().unwrap().signal(name);
        match verb {
            Verb::Press => {
                assert_eq!(
                    give("press stop"),
                    "ok, without effect: nothing moves and no program runs"
                );
                assert_eq!(give("press estop"), "ok");
                assert_eq!((signal("stop"), signal("estop")), (Some(0), Some(1)));
            }
            Verb::Hold => {
                give("hold stop");
                give("hold limit x+");
                assert_eq!((signal("stop"), signal("limit x+")), (Some(1), Some(1)));
            }
            Verb::Release => {
                give("hold stop");
                assert_eq!(give("release stop"), "ok");
                assert_eq!(signal("stop"), Some(0));
            }
            Verb::Turn => {
                assert_eq!(give("cover open"), "ok");
                assert_eq!(signal("cover"), Some(0));
            }
            Verb::Input => {
                assert_eq!(give("input 0.2 1"), "ok");
                assert_eq!(signal("input 0.2"), Some(1));
                // What a port shows of the panel is set by its bit, too.
                let start = names.signals().iter().find(|signal| signal.name == "start").unwrap();
                let (port, bit) = start.bits[0];
                assert_eq!(give(&format!("input {port}.{bit} 1")), "ok");
                assert_eq!(signal("start"), Some(1));
            }
            Verb::Set => {
                assert_eq!(give("set power-ok 0"), "ok");
                assert_eq!(signal("power-ok"), Some(0));
            }
            Verb::Erase => {
                store(&emu);
                let lines = || {
                    emu.view()
                        .unwrap()
                        .details
                        .isel()
                        .unwrap()
                        .program
                        .as_ref()
                        .map(|p| p.lines.len())
                };
                assert_eq!(lines(), Some(1));
                give("key test");
                assert!(give("erase").starts_with("ok: the memory is erased, which takes 20 s"));
                emu.run_until_idle().unwrap();
                assert_eq!(lines(), None);
                // The key is turned back to where it was.
                assert_eq!((signal("key"), signal("estop")), (Some(0), Some(0)));
            }
            Verb::Power => {
                assert_eq!(give("power off"), "ok");
                assert!(!emu.view().unwrap().powered);
                assert_eq!(give("power on"), "ok");
                assert!(emu.view().unwrap().powered);
            }
            Verb::Fault => {
                assert_eq!(give("fault drop to-host once"), "ok");
                assert_eq!(give("fault cut for 20ms after x > 5"), "ok");
                assert_eq!(give("fault end 1"), "ok");
                assert_eq!(give("fault end 1"), "ok, without effect: there is no such fault");
                assert_eq!(emu.faults().unwrap().len(), 1);
                assert_eq!(give("fault end all"), "ok");
                assert!(emu.faults().unwrap().is_empty());
            }
            Verb::When | Verb::While | Verb::At | Verb::Every | Verb::Rule => {
                let rule = match verb {
                    Verb::When => "when command @A: hold stop",
                    Verb::While => "while x >= 0: hold stop",
                    Verb::At => "at 20ms: hold stop",
                    Verb::Every => "every 20ms: hold stop for 5ms",
                    _ => "rule it once when idle: hold stop until at 50ms",
                };
                assert_eq!(give(rule), "ok, rule 1");
                let mut port = emu.connect().unwrap();
                port.write_all(b"@01\r@0A5,900\r").unwrap();
                emu.advance(Duration::from_millis(20)).unwrap();
                assert_eq!(signal("stop"), Some(1), "{rule}");
                assert_eq!(give("rule end 1"), "ok");
                assert_eq!(signal("stop"), Some(0), "{rule}");
                assert_eq!(give("rule end 1"), "ok, without effect: there is no such rule");
                assert_eq!(give("rule end all"), "ok, without effect: there are no rules");
            }
            Verb::Reset => {
                give("fault drop to-host");
                give("at 5ms: hold stop");
                emu.advance(Duration::from_millis(20)).unwrap();
                assert_eq!(give("reset"), "ok");
                assert_eq!(signal("stop"), Some(0));
                assert!(emu.faults().unwrap().is_empty() && emu.rules().unwrap().is_empty());
                assert_eq!(
                    give("reset"),
                    "ok, without effect: there are no rules, and nothing is wrong"
                );
            }
            Verb::Rules => {
                assert_eq!(give("rules"), "there are no rules");
                give("when answered: hold stop");
                give("rule later once at 1s: power off for 100ms; fault jam x");
                let mut port = emu.connect().unwrap();
                port.write_all(b"@01\r").unwrap();
                emu.advance(Duration::ZERO).unwrap();
                assert_eq!(
                    give("rules"),
                    "1     holds, acted once         when answered: hold stop\n\
                     2     waits, acted 0 times      rule later once at 1s: power off for 100ms; \
                     fault jam x"
                );
            }
            Verb::Faults => {
                assert_eq!(give("faults"), "nothing is wrong");
                give("fault garble into ? to-host");
                give("fault cut for 20ms after x > 5");
                let mut port = emu.connect().unwrap();
                port.write_all(b"@01\r").unwrap();
                let mut answer = [0];
                port.read_exact(&mut answer).unwrap();
                assert_eq!(&answer, b"?");
                assert_eq!(
                    give("faults"),
                    "1   is over, struck once        garble into \"?\" to-host once\n\
                     2   waits, struck 0 times       cut both for 20ms after x > 5"
                );
            }
            Verb::Advance => {
                assert_eq!(give("advance 250ms"), "now 0.250000000 s");
                assert_eq!(emu.now().unwrap(), Time::from_millis(250));
            }
            Verb::RunUntil => {
                assert_eq!(give("run until at 2s"), "there at 2.000000000 s");
                assert_eq!(emu.now().unwrap(), Time::from_millis(2_000));
                assert_eq!(give("run until idle"), "idle at 2.000000000 s");
            }
            Verb::Position => {
                ask(&emu, "@01");
                ask(&emu, "@0A70,900");
                emu.advance(Duration::from_secs(1)).unwrap();
                assert_eq!(give("position"), "X 70 Y 0 Z 0 A 0");
            }
            Verb::Signals => {
                let list = give("signals");
                let listed: Vec<_> =
                    list.lines().map(|line| line.split("  ").next().unwrap()).collect();
                let known: Vec<_> = names.signals().iter().map(|signal| &*signal.name).collect();
                assert_eq!(listed, known);
            }
            Verb::Cancel => {
                // A program without an end, and a time that is far.
                for line in ["@01", "@0i", "0100,900", "3 0,-1", "9"] {
                    ask(&emu, line);
                }
                give("press start");
                let order = Order::read("advance 999999h", &names).unwrap().unwrap();
                let advance = emu.control().give(&order);
                assert_eq!(give("cancel"), "ok");
                let end = vimc4_host::block_on(advance).unwrap_err().to_string();
                assert!(end.starts_with("given up at "), "{end}");
            }
            Verb::Help => {
                assert_eq!(give("help"), help(&names));
                assert_eq!(give("help run until"), help_on(Verb::RunUntil, &names));
            }
            Verb::Complete => {
                assert_eq!(
                    give("press st?"),
                    "press start           START button\npress stop            STOP button"
                );
                assert_eq!(
                    give("set ball x 3?"),
                    "nothing that could be listed follows `set ball x 3`"
                );
            }
            Verb::Quit => {
                assert_eq!(give("quit"), "");
                assert_eq!(
                    vimc4_host::block_on(Box::pin(emu.ended())).map_err(|e| e.to_string()),
                    Ok(())
                );
            }
        }
    }
}

/// A program of one line.
fn store(emu: &Emulator) {
    for line in ["@01", "@0i", "0100,900", "9"] {
        ask(emu, line);
    }
}

/// Sends a line whose answer is not looked at.
fn ask(emu: &Emulator, line: &str) {
    use std::io::Write;
    let mut port = emu.connect().unwrap();
    port.write_all(format!("{line}\r").as_bytes()).unwrap();
    emu.now().unwrap();
}

#[test]
fn each_verb_is_in_the_documents() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let page = fs::read_to_string(format!("{root}/docs/library.md")).unwrap();
    let mut rows = Vec::new();
    for verb in Verb::all() {
        for form in verb.forms() {
            let order = verb.typed(form).replace('|', "\\|");
            let method = form.method.map(|name| format!("`{name}` ")).unwrap_or_default();
            rows.push(format!("| `{order}` | {method}| {} |", form.about));
        }
    }
    let (_, rest) = page.split_once("| order | method | what it does |\n|---|---|---|\n").unwrap();
    let shown: Vec<_> = rest.lines().take_while(|line| line.starts_with('|')).collect();
    assert_eq!(shown, rows, "docs/library.md has the table as it was; this is how it is");
}

#[test]
fn each_method_of_a_verb_is_there() {
    let source =
        |file: &str| fs::read_to_string(format!("{}/src/{file}", env!("CARGO_MANIFEST_DIR")));
    for file in ["control.rs", "emulator.rs"] {
        let text = source(file).unwrap();
        for verb in Verb::all() {
            for form in verb.forms() {
                assert!(verb.sort() == Sort::Prompt || form.method.is_some(), "{verb:?}");
                if let Some(method) = form.method {
                    assert!(text.contains(&format!("    pub fn {method}(")), "{file}: {method}");
                }
            }
        }
    }
}
