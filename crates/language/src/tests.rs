//! Orders, their help and their completion.

use std::time::Duration;

use vimc4_device::{Condition, Deed, Names, Ruling, Scenario, ScenarioNumber, Signal, SignalId};

use crate::verb::TABLE;
use crate::{Order, Verb, complete, help, read_faulting, read_rule};

/// A panel that has one of everything.
fn names() -> Names {
    let signals = vec![
        Signal::button(SignalId(0), "start", ""),
        Signal::button(SignalId(1), "estop", "").latching(),
        Signal::switch(SignalId(2), "key", ["test", "auto"], "key switch"),
        Signal::input(SignalId(3), "limit x-", ""),
        Signal::input(SignalId(4), "input 0.2", "").read_by([(0, 2)]).wired_to("in1"),
        Signal::analogue(SignalId(5), "ball x", (-9, 9), ""),
    ];
    let axes = [(0, "X"), (1, "Y"), (2, "Z"), (3, "A"), (2, "Z0")];
    let axes = axes.map(|(axis, name)| (axis, name.to_owned()));
    Names::new(axes, signals).with_erasing(true)
}

/// A scenario of one rule, in which axes are numbers.
fn read_one(words: &str) -> Scenario {
    let names = Names::new([], names().signals().to_vec());
    read_rule(words, &names).unwrap().into()
}

fn read(line: &str) -> Result<Option<Order>, String> {
    Order::read(line, &names()).map_err(|error| error.to_string())
}

#[test]
fn every_verb_has_one_row() {
    for verb in Verb::all() {
        assert_eq!(TABLE.iter().filter(|row| row.verb == verb).count(), 1, "{verb:?}");
        assert!(!verb.forms().is_empty());
        // The compiler leads here when a verb is added.
        match verb {
            Verb::Press
            | Verb::Hold
            | Verb::Release
            | Verb::Turn
            | Verb::Input
            | Verb::Set
            | Verb::Erase
            | Verb::Power
            | Verb::Fault
            | Verb::When
            | Verb::While
            | Verb::At
            | Verb::Every
            | Verb::Rule
            | Verb::Reset
            | Verb::Advance
            | Verb::RunUntil
            | Verb::Cancel
            | Verb::Position
            | Verb::Signals
            | Verb::Faults
            | Verb::Rules
            | Verb::Help
            | Verb::Complete
            | Verb::Quit => {}
        }
    }
    assert_eq!(Verb::all().count(), Verb::Quit as usize + 1);
}

#[test]
fn every_order_is_understood() {
    let text = str::to_owned;
    let deed = Order::Do;
    let fault = |words: &str| Box::new(read_faulting(words, Names::numbered()).unwrap());
    let at = |axis, position| Order::RunUntil(Condition::AxisAt { axis, position });
    let rule = |words: &str| Order::Rule(Ruling::Begin(ScenarioNumber::NEXT, read_one(words)));
    let mut seen = Vec::new();
    for (line, order) in [
        ("press start", deed(Deed::Press(text("start")))),
        ("  press   estop ", deed(Deed::Press(text("estop")))),
        ("press limit x-", deed(Deed::Press(text("limit x-")))),
        ("release estop", deed(Deed::Release(text("estop")))),
        ("hold start", deed(Deed::Hold(text("start")))),
        ("key auto", deed(Deed::Turn(text("key"), text("auto")))),
        ("input 0.2 1", deed(Deed::Input { port: 0, bit: 2, level: true })),
        ("set limit x- 1", deed(Deed::Set(text("limit x-"), 1))),
        ("set  limit   x- 1", deed(Deed::Set(text("limit x-"), 1))),
        ("set key auto", deed(Deed::Turn(text("key"), text("auto")))),
        ("set key 1", deed(Deed::Set(text("key"), 1))),
        ("set ball x -9", deed(Deed::Set(text("ball x"), -9))),
        ("set input 0.2 1", deed(Deed::Set(text("input 0.2"), 1))),
        ("erase", Order::Erase),
        ("power off", deed(Deed::Power(false))),
        (
            "fault 3 drop to-host after x > 5",
            deed(Deed::Fault(fault("3 drop to-host after axis0 > 5"))),
        ),
        ("fault end all", deed(Deed::Fault(fault("end all")))),
        ("faults", Order::Faults),
        ("when x > 5: press start", rule("when axis0 > 5: press start")),
        ("while x > 5: input 0.2 1", rule("while axis0 > 5: input 0.2 1")),
        ("at 2s: power off for 100ms", rule("at 2s: power off for 100ms")),
        ("every 1s: press start", rule("every 1s: press start")),
        ("rule jam once at 2s: fault jam x", rule("rule jam once at 2s: fault jam axis0")),
        ("rule end 3", Order::Rule(Ruling::End(ScenarioNumber(3)))),
        ("rule end all", Order::Rule(Ruling::EndAll)),
        ("rules", Order::Rules),
        ("reset", Order::Reset),
        ("advance 250ms", Order::Advance(Duration::from_millis(250))),
        ("advance 1.5 s", Order::Advance(Duration::from_millis(1_500))),
        ("advance 0.1h", Order::Advance(Duration::from_secs(360))),
        ("run until idle", Order::RunUntil(Condition::Idle)),
        ("run until x 2500", at(0, 2_500)),
        ("run until A -5", at(3, -5)),
        ("run until z0 7", at(2, 7)),
        (
            "run  until z < -5000 or limit x+",
            Order::RunUntil(Condition::Any(vec![
                Condition::AxisBelow { axis: 2, position: -5_000 },
                Condition::Limit { axis: 0, positive: true, active: true },
            ])),
        ),
        ("position", Order::Position),
        ("signals", Order::Signals),
        ("cancel", Order::Cancel),
        ("help", Order::Help(None)),
        ("help run until", Order::Help(Some(Verb::RunUntil))),
        ("help  press", Order::Help(Some(Verb::Press))),
        ("press ?", Order::Complete(text("press "))),
        ("?", Order::Complete(String::new())),
        ("quit", Order::Quit),
    ] {
        seen.push(order.verb());
        assert_eq!(read(line), Ok(Some(order)), "{line}");
    }
    assert_eq!(read("   "), Ok(None));
    assert!(Verb::all().all(|verb| seen.contains(&verb)), "{seen:?}");
}

#[test]
fn a_deed_is_ordered_as_it_is_shown() {
    for line in ["press start", "hold limit x-", "release estop", "key test", "input 0.2 0"] {
        let Ok(Some(Order::Do(deed))) = read(line) else { panic!("{line}") };
        assert_eq!(deed.to_string(), line);
    }
}

#[test]
fn a_wrong_line_says_where_and_what_would_be_right() {
    for (line, at, right) in [
        ("press", 5, "press start, estop"),
        ("press strat", 6, "there is no button `strat`; did you mean start?"),
        ("press on", 6, "there is no button `on`; there are start, estop"),
        ("hold limit y-", 5, "did you mean limit x-?"),
        ("release key", 8, "there are start, estop"),
        ("key", 3, "test or auto"),
        ("key automatic", 4, "it can be test or auto"),
        ("input 0.8 1", 6, "a bit from 0 to 7, as in `input 0.2 1`"),
        ("input 0.2 2", 10, "0 or 1, as in `input 0.2 1`"),
        ("input 0.2", 9, "0 or 1, as in `input 0.2 1`"),
        ("input 0.3 1", 6, "nothing outside drives bit 3 of port 0; the inputs are input 0.2"),
        ("input in1 1", 6, "in1 is called input 0.2, as in `input 0.2 1`"),
        ("set", 3, "as in `set probe 1`"),
        ("set in1 1", 4, "in1 is called input 0.2, as in `input 0.2 1`"),
        ("set in7 1", 4, "no signal `in7`; `signals` lists those there are"),
        ("set key shut", 8, "key can be test or auto"),
        ("set limit x-", 12, "0 or 1"),
        ("set limit x- 2", 13, "limit x- can be 0 or 1"),
        ("set limitx- 1", 4, "no signal `limitx-`; did you mean limit x-?"),
        ("set ball x 10", 11, "ball x can be a number from -9 to 9"),
        ("set nothing 1", 4, "no signal `nothing`; `signals` lists those there are"),
        ("fault", 5, "a kind of fault: drop, garble"),
        ("fault dorp", 6, "a kind of fault: drop, garble"),
        ("fault drop to-hots", 11, "to-host, to-controller or both"),
        ("fault drop to-host after x > far", 29, "a position in steps"),
        ("fautl drop", 0, "did you mean fault"),
        ("advance 250", 8, "as in `advance 250ms`"),
        ("advance 99999999999h", 8, "as in `advance 250ms`"),
        ("power", 5, "power on or power off"),
        ("power up", 6, "power on or power off"),
        ("position x", 9, "position takes no arguments"),
        ("help wobble", 5, "not an order; type help for the list"),
        ("help pres", 5, "not an order; did you mean press? type help for the list"),
        ("help press start", 5, "an order, as in `help run until`"),
        ("run until answer \"\\q\"", 18, "`\\\"`, `\\\\`"),
        ("run until start 1", 10, "`signal start is 1`"),
        ("run", 3, "run until idle"),
        ("run until", 9, "a condition"),
        ("run until b 5", 10, "axes are x, y, z, a"),
        ("run until z < -5 or x < far", 24, "a position in steps"),
        ("wobble", 0, "not an order; type help for the list"),
        ("hlep", 0, "did you mean help?"),
    ] {
        let error = Order::read(line, &names()).unwrap_err();
        assert!(error.message().contains(right), "{line}: {error}");
        assert_eq!(error.span.start, at, "{line}: {error}");
        assert!(error.to_string().contains(line), "{error}");
    }
}

#[test]
fn help_and_completion_know_every_verb() {
    let names = names();
    let shown = help(&names);
    for verb in Verb::all() {
        let lines: Vec<_> = match verb {
            Verb::Turn => vec!["key test|auto".to_owned()],
            _ => verb.forms().iter().map(|form| verb.typed(form)).collect(),
        };
        for line in lines {
            assert!(shown.lines().any(|row| row.starts_with(&line)), "{line}: {shown}");
        }
        let begin = if verb == Verb::Turn { "key" } else { verb.name() };
        let offered = complete("", &names);
        let found = offered.iter().find(|way| way.line.trim_end() == begin);
        assert_eq!(found.is_some(), verb != Verb::Complete, "{verb:?}: {offered:?}");
    }
    // They leave out what does not exist.
    let none = Names::new([], Vec::new());
    for absent in ["press", "key", "input", "set", "erase", "signals  "] {
        assert!(!help(&none).lines().any(|row| row.starts_with(absent)), "{}", help(&none));
        assert!(!complete("", &none).iter().any(|way| way.line.starts_with(absent.trim())));
    }
}

#[test]
fn what_is_offered_is_an_order_or_the_begin_of_one() {
    let names = names();
    let mut begun = vec![String::new()];
    let mut whole = 0;
    while let Some(line) = begun.pop() {
        for way in complete(&line, &names) {
            assert!(way.line.starts_with(&line) && way.line.len() > line.len(), "{way:?}");
            match Order::read(&way.line, &names) {
                Ok(_) => whole += 1,
                Err(error) => {
                    assert_eq!(error.span.start, way.line.trim_end().len(), "{way:?}: {error}");
                }
            }
            begun.push(way.line);
        }
    }
    assert!(whole > 40, "{whole}");
    let lines = |line: &str| complete(line, &names).into_iter().map(|way| way.line);
    assert!(lines("s").eq(["set ", "signals"]));
    assert!(lines("set l").eq(["set limit x- "]));
    assert!(lines("set ball x ").eq(["set ball x -9", "set ball x 9"]));
    assert!(lines("key").eq(["key "]));
    assert!(lines("run until l").eq([
        "run until limit x-",
        "run until limit x+",
        "run until limit y-",
        "run until limit y+",
        "run until limit z-",
        "run until limit z+",
        "run until limit a-",
        "run until limit a+",
        "run until line ",
    ]));
}
