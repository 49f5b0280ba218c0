//! What goes wrong with the machine, of both families: each kind, struck at an exact step, and any of
//! them at any time, however a controller is watched, woken, saved and restored.
//!
//! `VIMC4_CASES=100000 cargo test --release -p vimc4-tests --test mishaps` tries as many cases.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::time::Duration;

use vimc4_catalogue::Controller;
use vimc4_device::{
    Device as _, Event, FaultNews, Harness, Input, Kinds, Line, Loss, Names, Output, Strike, Time,
    Warning,
};
use vimc4_language::{read_condition, read_fault, read_faulting};
use vimc4_plant::Machine;
use vimc4_tests::mishaps::{Act, Random, Session, any_session};

/// A controller on a machine, an expression in TOML that differs from a built-in one.
fn open(model: &str, machine: &str) -> Harness<Line<Controller>> {
    let model = vimc4_catalogue::model(model).expect(model);
    let own = || Machine::from_toml(machine).expect("a machine").into();
    let machine = Machine::builtin(machine).unwrap_or_else(own);
    let controller = Controller::new(&model, machine, b"").expect("an empty memory");
    Harness::new(Line::ideal(controller)).watching(Kinds::ALL)
}

/// A built-in machine with more in the table of X.
fn with_x(machine: &str, keys: &str) -> String {
    let text = Machine::builtin_toml(machine).expect(machine);
    text.replacen("[axes.x]\n", &format!("[axes.x]\n{keys}\n"), 1)
}

fn fault(tried: &mut Harness<Line<Controller>>, text: &str) {
    let faulting = read_faulting(text, &Names::of(tried.device()));
    tried.input(Input::Fault(&faulting.expect(text)));
}

fn ask(tried: &mut Harness<Line<Controller>>, line: &str) -> String {
    tried.send(line.as_bytes());
    rest(tried)
}

fn rest(tried: &mut Harness<Line<Controller>>) -> String {
    tried.run_to_rest().expect("an end");
    tried.take_bytes().into_iter().map(char::from).collect()
}

/// Where the counter and the carriage of X are.
fn x(tried: &Harness<Line<Controller>>) -> (i64, i64) {
    let view = tried.device().view(tried.now());
    (view.axes[0].position, view.axes[0].carriage)
}

fn signal(tried: &Harness<Line<Controller>>, name: &str) -> i32 {
    tried.device().view(tried.now()).signal(name).expect(name)
}

/// How carriages and counters came to disagree, by how many steps; and takes note of it.
fn losses(tried: &mut Harness<Line<Controller>>) -> Vec<(Loss, i64)> {
    let lost = tried.drain().filter_map(|output| match output {
        Output::Event(_, Event::Warning(Warning::StepsLost { steps, how, .. })) => {
            Some((how, steps))
        }
        _ => None,
    });
    lost.collect()
}

fn strikes(tried: &mut Harness<Line<Controller>>) -> Vec<String> {
    let struck = tried.outputs().iter().filter_map(|output| match output {
        Output::Event(_, Event::Fault { news: FaultNews::Strikes(Strike::Machine(it)), .. }) => {
            Some(it.to_string())
        }
        _ => None,
    });
    struck.collect()
}

#[test]
fn the_power_goes_at_a_step() {
    let mut isel = open("imc-s8", "bench");
    assert_eq!(ask(&mut isel, "@01\r"), "0");
    fault(&mut isel, "power-off for 1s after x > 1000");
    // 1,001 steps at 300 Hz.
    isel.send(b"@0A5000,300\r");
    isel.run_to(Time::from_nanos(3_336_666_666));
    assert!(isel.device().view(isel.now()).powered);
    isel.run_to(Time::from_nanos(3_336_666_667));
    let view = isel.device().view(isel.now());
    assert_eq!((view.powered, view.axes[0].carriage, view.axes[0].position), (false, 1_001, 0));
    assert_eq!(rest(&mut isel), "");
    // And comes back after its time.
    isel.advance(Duration::from_secs(1));
    assert!(isel.device().view(isel.now()).powered);

    let mut lpkf = open("smcu", "bench");
    fault(&mut lpkf, "power-off after x > 1000");
    assert_eq!(ask(&mut lpkf, "PA5000,0;"), "");
    assert_eq!(x(&lpkf), (0, 1_001));
    assert!(!lpkf.device().view(lpkf.now()).powered);
    // Nobody switches it on as long as it is off, and then it is as it was switched last.
    lpkf.input(Input::Power(true));
    assert!(!lpkf.device().view(lpkf.now()).powered);
    fault(&mut lpkf, "end all");
    assert!(lpkf.device().view(lpkf.now()).powered);
}

#[test]
fn inputs_are_wired_to_places() {
    for (model, there, back, input) in [
        ("imc-s8", "@01\r@0A2000,300\r", "@0A-2000,300\r", "input 0.3"),
        ("motionsystem", "PA2000,0;", "PA0,0;", "input 1.3"),
    ] {
        let mut tried = open(model, "bench");
        fault(&mut tried, &format!("hold {input} while x > 1000 and x < 1500"));
        for way in [there, back] {
            tried.send(way.as_bytes());
            let names = Names::of(tried.device());
            for (at, on) in [(1_000, 0), (1_001, 1), (1_499, 1), (1_500, 0)] {
                let at = if way == back { 2_500 - at } else { at };
                let read = read_condition(&format!("x = {at}"), &names).expect("a condition");
                tried.run_until(&read).expect(way);
                assert_eq!(signal(&tried, input), on, "{model} {way} {at}");
            }
            rest(&mut tried);
        }
    }
}

#[test]
fn what_is_held_is_given_back_as_it_was_set_last() {
    let mut tried = open("imc-s8", "bench");
    fault(&mut tried, "hold key test");
    assert_eq!(signal(&tried, "key"), 0);
    fault(&mut tried, "hold key auto");
    assert_eq!(signal(&tried, "key"), 1);
    let key = Names::of(tried.device()).signals().iter().find(|s| s.name == "key").expect("key").id;
    tried.input(Input::Signal(key, 0));
    assert_eq!(signal(&tried, "key"), 1);
    fault(&mut tried, "end 2");
    assert_eq!(signal(&tried, "key"), 0);
    fault(&mut tried, "end 1");
    assert_eq!(signal(&tried, "key"), 0);
    fault(&mut tried, "hold key auto");
    tried.input(Input::Signal(key, 1));
    tried.input(Input::Signal(key, 0));
    fault(&mut tried, "end all");
    assert_eq!(signal(&tried, "key"), 0);
}

#[test]
fn heat_and_a_brown_out_halt_the_motors_at_a_step() {
    for cause in ["hold overtemperature", "brown-out", "hold estop"] {
        let mut tried = open("imc-s8", "bench");
        ask(&mut tried, "@01\r");
        fault(&mut tried, &format!("{cause} after x > 500"));
        assert_eq!(ask(&mut tried, "@0A1000,300\r"), "9", "{cause}");
        assert_eq!(x(&tried).1, 501, "{cause}");
        assert_eq!(strikes(&mut tried), ["has struck"], "{cause}");
    }
}

#[test]
fn the_probe_is_touched_at_a_place() {
    let mut tried = open("imc-s8", "mill");
    ask(&mut tried, "@07\r");
    fault(&mut tried, "hold probe while z < -120");
    // A move until port 0, on which the probe is bit 3 of input 1, reads so; a start without a ramp.
    let port = Names::of(tried.device());
    let probe = port.signals().iter().find(|s| s.name == "probe").expect("a probe").bits[0];
    let (port, mask) = (probe.0, 1 << probe.1);
    assert_eq!(ask(&mut tried, &format!("@0Z{port},{mask},{mask},300,0,0,-1000\r")), "0");
    assert_eq!(tried.device().view(tried.now()).axes[2].position, -121);
}

#[test]
fn limit_switches_fail() {
    // Stuck: a move halts at once, at a step.
    let mut tried = open("imc-s8", "mill");
    ask(&mut tried, "@01\r");
    fault(&mut tried, "switch x+ pressed after x > 100");
    assert_eq!(ask(&mut tried, "@0A1000,300\r"), "2");
    assert_eq!(x(&tried), (101, 4_101));

    // Stuck the other way: the carriage runs to the end of the mechanics.
    let mut tried = open("imc-s8", "mill");
    ask(&mut tried, "@01\r");
    fault(&mut tried, "switch x+ released");
    assert_eq!(ask(&mut tried, "@0A30000,300\r"), "0");
    assert_eq!(x(&tried), (30_000, 24_161));
    assert_eq!(losses(&mut tried), [(Loss::AtEnd, -(34_000 - 24_161))]);

    // Missing: a reference run finds nothing, and swapped: the wrong one.
    let mut tried = open("imc-s8", "mill");
    ask(&mut tried, "@01\r");
    fault(&mut tried, "switch x- missing");
    tried.send(b"@0R1\r");
    tried.advance(Duration::from_secs(600));
    assert_eq!((x(&tried).1, tried.take_bytes()), (-161, Vec::new()));
    let endless = |output: &Output| {
        matches!(output, Output::Event(_, Event::Warning(Warning::EndlessReference { .. })))
    };
    assert!(tried.outputs().iter().any(endless));
    // And is not done when the counter is, however far time goes.
    assert_eq!(rest(&mut tried), "");
    assert!(tried.now() < Time::from_secs(1_000));

    let mut tried = open("imc-s8", "mill");
    ask(&mut tried, "@01\r");
    fault(&mut tried, "switch x swapped");
    assert_eq!(ask(&mut tried, "@0R1\r"), "2");
    assert_eq!(x(&tried).1, -1);

    // Late.
    let mut tried = open("imc-s8", "mill");
    ask(&mut tried, "@01\r");
    fault(&mut tried, "switch x- late 30");
    assert_eq!(ask(&mut tried, "@0R1\r"), "0");
    assert_eq!(x(&tried), (0, 30));
}

#[test]
fn limit_switches_of_an_lpkf_machine_fail() {
    for (what, answer, place) in [
        ("switch x+ pressed after x > 100", "E138\r", (101, 101)),
        ("switch x- late 30", "C\r", (500, 500)),
        ("jam x after x > 100", "C\r", (500, 101)),
        // The last motion went out of the switch, and so does this one.
        ("backlash x 12", "C\r", (500, 500)),
        ("push x 7 after x > 100", "C\r", (500, 507)),
    ] {
        let mut tried = open("motionsystem", "positioner");
        assert_eq!(ask(&mut tried, "!IS;"), "C\r");
        fault(&mut tried, what);
        assert_eq!(ask(&mut tried, "PA500,0;"), answer, "{what}");
        assert_eq!(x(&tried), place, "{what}");
    }
    let mut tried = open("motionsystem", "positioner");
    fault(&mut tried, "switch x- late 30");
    assert_eq!(ask(&mut tried, "!IS;"), "C\r");
    assert_eq!(x(&tried), (0, 30));
}

#[test]
fn a_contact_bounces() {
    // The way out of the switch is over as soon as it opens for the first time, before its first step
    // at 300 Hz: the reference point is on the switch.
    for (bounce, place) in [("3 2ms", -1), ("3 4ms", 0)] {
        let mut tried = open("imc-s8", "mill");
        ask(&mut tried, "@01\r");
        fault(&mut tried, &format!("bounce limit x- {bounce}"));
        assert_eq!(ask(&mut tried, "@0R1\r"), "0");
        assert_eq!(x(&tried), (0, place), "{bounce}");
        assert!(strikes(&mut tried).contains(&"makes a contact bounce".to_owned()));
    }
    // A button that is pressed once is pressed three times, 1 ms apart.
    for (model, button) in [("imc-s8", "start"), ("motionsystem", "input 1.3")] {
        let mut tried = open(model, "bench");
        let id = Names::of(tried.device());
        let id = id.signals().iter().find(|s| s.name == button).expect(button).id;
        fault(&mut tried, &format!("bounce {button} 2 1ms"));
        tried.drain();
        tried.input(Input::Signal(id, 1));
        tried.advance(Duration::from_secs(1));
        let seen = tried.drain().filter_map(|output| match output {
            Output::Event(stamp, Event::Signal { value, .. }) => {
                Some((stamp.at.as_nanos() / 1_000_000, value))
            }
            _ => None,
        });
        assert_eq!(seen.collect::<Vec<_>>(), [(0, 1), (1, 0), (2, 1), (3, 0), (4, 1)], "{model}");
    }
}

#[test]
fn motors_cannot_everything() {
    // 100 Hz/ms up to 10,000 Hz; at 5,000 Hz it pulls 100 Hz/ms: (5,000² - 300²)/200,000 = 124.6.
    let machine = with_x("bench", "motor = { pull = [[0, 200], [10000, 0]] }");
    let mut tried = open("imc-s8", &machine);
    ask(&mut tried, "@01\r@0J100\r@0j300\r");
    assert_eq!(ask(&mut tried, "@0A5000,10000\r"), "0");
    assert_eq!(x(&tried), (5_000, 125));
    assert_eq!(losses(&mut tried), [(Loss::Stalled, -4_875)]);
    // A load that asks for 50 Hz/ms more: at 2,500 Hz, 30.8 steps.
    fault(&mut tried, "load x 50");
    assert_eq!(ask(&mut tried, "@0A-5000,10000\r"), "0");
    assert_eq!(x(&tried), (0, 125 - 31));
    assert!(strikes(&mut tried).contains(&"makes the motor of X stand".to_owned()));

    // Along the way with 1,000 mm/s²: 10 um a step make 100 Hz/ms, and √(2·100,000·2) = 632 Hz.
    let machine = with_x("bench", "motor = { pull = [[500, 1000]] }");
    let mut tried = open("smcu", &machine);
    ask(&mut tried, "!RS10000;!VU10000;!AS1000;");
    assert_eq!(ask(&mut tried, "PA5000,0;"), "C\r");
    assert_eq!(x(&tried), (5_000, 2));
    assert_eq!(losses(&mut tried), [(Loss::Stalled, -4_998)]);
}

#[test]
fn backlash_is_gone_through_at_a_reversal_and_not_before() {
    for (begun, before, way, carriage) in [
        // After a reference run, which ends out of the switch, upwards.
        ("after", "@0R1\r", "@0A100,300\r", 100),
        ("before", "@0R1\r", "@0A100,300\r", 100),
        ("after", "@0R1\r", "@0A100,300\r@0A-50,300\r", 62),
        ("after", "@0R1\r@0A200,300\r@0A-100,300\r", "@0A-50,300\r", 50),
        ("after", "@0R1\r@0A200,300\r@0A-100,300\r", "@0A50,300\r", 138),
    ] {
        let mut tried = open("imc-s8", "mill");
        ask(&mut tried, "@01\r");
        if begun == "before" {
            fault(&mut tried, "backlash x 12");
        }
        ask(&mut tried, before);
        if begun == "after" {
            fault(&mut tried, "backlash x 12");
        }
        let answers = ask(&mut tried, way);
        assert!(answers.bytes().all(|answer| answer == b'0'), "{way}: {answers}");
        assert_eq!(x(&tried).1, carriage, "{begun} {before} {way}");
    }
}

#[test]
fn a_load_without_a_motor_says_so() {
    for (model, machine) in [("imc-s8", "mill"), ("smcu", "board-plotter")] {
        let tried = open(model, machine);
        let load = read_fault("load x 50", &Names::of(tried.device())).expect("a fault");
        let why = tried.device().why_in_vain(&load).expect("a reason");
        assert!(why.contains("what the motor of this axis can"), "{why}");
    }
    let tried = open("imc-s8", &with_x("bench", "motor = { pull = [[0, 200], [10000, 0]] }"));
    let load = read_fault("load x 50", &Names::of(tried.device())).expect("a fault");
    assert_eq!(tried.device().why_in_vain(&load), None);
}

#[test]
fn a_strike_is_counted_when_it_makes_a_difference() {
    for (what, before, line, after) in [
        ("bounce limit x+ 5 2ms", 0, "@0A100,300\r", 0),
        ("jam x after x > 50", 0, "@0A100,300\r", 1),
        ("jam x", 0, "@0A100,300\r@0A100,300\r", 2),
        ("backlash x 12", 1, "@0A100,300\r@0A-100,300\r", 1),
        ("hold overtemperature", 1, "@0A100,300\r", 1),
        ("load x 50", 0, "@0A100,300\r", 0),
    ] {
        let mut tried = open("imc-s8", "mill");
        ask(&mut tried, "@01\r");
        fault(&mut tried, what);
        let struck = |tried: &Harness<Line<Controller>>| tried.device().faults()[0].struck;
        assert_eq!(struck(&tried), before, "{what}");
        ask(&mut tried, line);
        assert_eq!(struck(&tried), after, "{what}");
    }
    let mut tried = open("imc-s8", "mill");
    ask(&mut tried, "@01\r@0R1\r");
    fault(&mut tried, "bounce limit x- 3 2ms");
    ask(&mut tried, "@0A100,300\r");
    assert_eq!(tried.device().faults()[0].struck, 0);
}

#[test]
fn a_carriage_is_pushed() {
    let mut tried = open("imc-s8", "bench");
    ask(&mut tried, "@01\r");
    fault(&mut tried, "push x -40 after x > 100");
    assert_eq!(ask(&mut tried, "@0A1000,300\r"), "0");
    assert_eq!(x(&tried), (1_000, 960));
    assert_eq!(losses(&mut tried), [(Loss::Pushed, -40)]);
}

// --- any fault at any time ---

/// Plays acts. Roughly that is with needless wake-ups, unwatched, and with the state written down and
/// read again in between.
fn play(model: &str, machine: &str, acts: &[Act], mut rough: Option<Random>) -> String {
    let mut tried = open(model, machine);
    let signals = Names::of(tried.device());
    let mut said = String::new();
    for act in acts {
        disturb(&mut tried, &mut rough);
        match act {
            Act::Send(line) => tried.send(line.as_bytes()),
            Act::Fault(text) => fault(&mut tried, text),
            Act::Set(name, value) => {
                let signal = signals.signals().iter().find(|signal| signal.name == *name);
                tried.input(Input::Signal(signal.expect("a signal").id, *value));
            }
            Act::Advance(span) => {
                let end = tried.now() + *span;
                if let Some(random) = &mut rough {
                    let nanos = random.range(0, span.as_nanos() as i64) as u64;
                    tried.run_to(tried.now().after_nanos(nanos));
                    tried.input(Input::Wake);
                }
                tried.run_to(end);
            }
        }
        disturb(&mut tried, &mut rough);
        let bytes = tried.take_bytes();
        said.extend(bytes.into_iter().map(char::from));
    }
    let end = tried.now().after_nanos(5_000_000_000);
    tried.run_to(end);
    said.extend(tried.take_bytes().into_iter().map(char::from));
    format!("{said}\n{:?}", tried.device().state())
}

/// What must make no difference.
fn disturb(tried: &mut Harness<Line<Controller>>, rough: &mut Option<Random>) {
    let Some(random) = rough else { return };
    if random.number().is_multiple_of(3) {
        let state = tried.device().state();
        let written = serde_json::to_string(&state).expect("a state");
        tried.restore(serde_json::from_str(&written).expect("the same state"));
    }
    tried.input(Input::Wake);
}

fn try_case(seed: u64) {
    let mut random = Random(seed);
    let Session { model, machine, acts } = any_session(&mut random);
    let smooth = play(model, &machine, &acts, None);
    let rough = play(model, &machine, &acts, Some(random));
    assert_eq!(smooth, rough, "{model}");
}

#[test]
fn any_fault_at_any_time_makes_no_difference_to_who_looks() {
    let asked = std::env::var("VIMC4_CASES").ok().and_then(|text| text.parse().ok());
    for seed in 0..asked.unwrap_or(200_u64) {
        if let Err(reason) = std::panic::catch_unwind(|| try_case(seed)) {
            eprintln!("seed {seed}");
            std::panic::resume_unwind(reason);
        }
    }
}

#[test]
fn strikes_are_counted_whether_anybody_watches_or_not() {
    for kinds in [Kinds::NONE, Kinds::ALL] {
        for (text, struck) in [("jam x", 1), ("push x 5", 1), ("hold estop", 1)] {
            for when in ["", " after x > 100"] {
                let mut tried = open("imc-s8", "bench").watching(kinds);
                ask(&mut tried, "@01\r");
                fault(&mut tried, &format!("{text}{when}"));
                ask(&mut tried, "@0A1000,300\r");
                let faults = tried.device().faults();
                assert_eq!(faults[0].struck, struck, "{text}{when} {kinds:?}");
            }
        }
    }
}
