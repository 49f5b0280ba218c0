//! What led to something: rules, faults that waited, and bytes that were on their way for a while.

#![expect(clippy::panic, clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drive;

use drive::{debugger, run};
use vimc4_catalogue::bare;
use vimc4_debug::{Debugger, uninterrupted};
use vimc4_device::{Input, Line, Ruling, Scenario, ScenarioNumber, show_nanos};
use vimc4_language::read_ruling;
use vimc4_timeline::History;

/// What is answered, a link of a chain in each line, without what stands before it.
fn why(debugger: &mut Debugger, line: &str) -> Vec<String> {
    let said = run(debugger, &[line]).to_string();
    said.lines()
        .map(|line| line.trim().trim_start_matches("because of").trim().to_owned())
        .collect()
}

#[test]
fn a_rule_is_named_with_what_it_did_and_since_when() {
    let mut debugger = debugger("imc4", "bench");
    run(&mut debugger, &["advance 1s", "rule once when x > 700: press stop"]);
    run(&mut debugger, &["send @01", "send @0A1000,1000", "continue"]);
    for about in ["why stop", "why error", "why answer"] {
        let chain = why(&mut debugger, about);
        let acts = chain.iter().position(|link| link.ends_with("rule 1 acts: press stop"));
        let acts = acts.unwrap_or_else(|| panic!("{about}: {chain:#?}"));
        assert_eq!(chain[acts + 1], "1s  rule 1 was begun: once when x > 700: press stop");
        assert!(chain.last().unwrap().ends_with("@0A1000,1000 came over the line"), "{chain:#?}");
    }
    let chain = why(&mut debugger, "why signal");
    assert!(chain.iter().any(|link| link.contains("rule 1 acts")), "{chain:#?}");
    // What the machine's own is after it is nothing of the rule's.
    run(&mut debugger, &["send @0P", "continue"]);
    let chain = why(&mut debugger, "why answer");
    assert!(!chain.iter().any(|link| link.contains("rule")), "{chain:#?}");
}

#[test]
fn which_rule_of_a_scenario_it_was_is_said() {
    let mut debugger = debugger("imc4", "bench");
    let mut scenario = Scenario::new();
    for rule in ["rule far when x > 700: press stop", "when y > 5: power off"] {
        let Ok(Ruling::Begin(_, read)) = read_ruling(rule, debugger.names()) else {
            panic!("{rule}")
        };
        scenario.rules.extend(read.rules);
    }
    debugger.give(Input::Rule(&Ruling::Begin(ScenarioNumber::NEXT, scenario)));
    run(&mut debugger, &["mark ruled", "send @03", "send @0A1000,1000,0,900", "continue"]);
    let chain = why(&mut debugger, "why stop");
    assert!(
        chain.contains(&"0ms  rule 1.1 (far) was begun: far when x > 700: press stop".to_owned())
    );
    run(&mut debugger, &["goto ruled", "send @03", "send @0A0,900,50,900", "continue"]);
    let chain = why(&mut debugger, "why stop");
    assert!(chain[1].ends_with("rule 1.2 acts: power off"), "{chain:#?}");
    assert_eq!(chain[2], "0ms  rule 1.2 was begun: when y > 5: power off");
    // One that there was before the history began.
    let mut later = Debugger::over(History::new(debugger.line().clone()));
    run(&mut later, &["power on", "send @03", "send @0A900,1000,0,900", "continue"]);
    let chain = why(&mut later, "why stop");
    let there =
        |link: &&String| link.contains("rule 1.1 (far) was begun") && link.contains("before");
    assert!(chain.iter().find(there).is_some(), "{chain:#?}");
}

#[test]
fn a_fault_that_waited_is_named_with_what_began_it() {
    let mut debugger = debugger("imc4", "bench");
    run(
        &mut debugger,
        &["fault power-off after x > 300", "send @01", "send @0A1000,1000", "continue"],
    );
    let chain = why(&mut debugger, "why stop");
    let struck = chain.iter().position(|link| link.contains("fault 1 ")).unwrap();
    assert!(chain[struck..].iter().any(|link| link.ends_with("fault 1 strikes from now on")));
    assert!(
        chain.contains(&"0ms  fault 1 was begun: power-off after x > 300".to_owned()),
        "{chain:#?}"
    );

    // A motor that stands is why steps are lost, and a rule is why it stands.
    let mut debugger = drive::debugger("imc4", "bench");
    run(&mut debugger, &["rule when x > 300: fault jam x", "send @01", "send @0A1000,1000"]);
    run(&mut debugger, &["continue"]);
    let chain = why(&mut debugger, "why");
    assert!(chain[0].contains(" lost;"), "{chain:#?}");
    assert!(chain[1].ends_with("fault 1 makes the motor of X stand"), "{chain:#?}");
    assert!(chain[2].ends_with("rule 1 acts: fault jam x"), "{chain:#?}");
    assert_eq!(chain[3], "0ms  rule 1 was begun: when x > 300: fault jam x");

    // What was made of a command on its way.
    let mut debugger = drive::debugger("imc4", "bench");
    run(
        &mut debugger,
        &["send @01", "continue", "fault garble into ? to-controller once after @0P"],
    );
    run(&mut debugger, &["send @0P", "continue", "send @0P", "continue"]);
    let chain = why(&mut debugger, "why error");
    let made = chain.iter().position(|link| link.contains("fault 1 made ? of @")).unwrap();
    assert!(chain[made + 1].ends_with("fault 1 strikes from now on"), "{chain:#?}");
    assert!(chain[made + 2].contains("fault 1 was begun: garble"), "{chain:#?}");
}

#[test]
fn a_control_code_is_found_that_was_on_its_way() {
    let (model, machine) =
        (vimc4_catalogue::model("imc4").unwrap(), vimc4_catalogue::machine("bench").unwrap());
    let paced = Line::paced(bare(&model, &machine, &[]).unwrap());
    let mut debugger = Debugger::over(History::new(paced));
    run(&mut debugger, &["send @01", "continue", "send @0A5000,1000", "next x = 100"]);
    run(&mut debugger, &["sendraw \\xFD", "continue"]);
    let sent = run(&mut debugger, &["goto start", "next x = 100"]);
    run(&mut debugger, &["goto end"]);
    let chain = why(&mut debugger, "why stop");
    let code = chain.iter().find(|link| link.ends_with("the byte \\xFD came over the line"));
    let code = code.unwrap_or_else(|| panic!("{chain:#?}"));
    let sent = drive::stop(sent);
    assert!(code.starts_with(&show_nanos(sent.at.as_nanos())), "{code}");
    // And so is a command of which there is another behind it.
    run(&mut debugger, &["send @0P", "send @0P", "continue", "back command"]);
    let chain = why(&mut debugger, "why");
    assert!(chain.last().unwrap().ends_with("@0P came over the line"), "{chain:#?}");
}

#[test]
fn what_a_fault_or_a_rule_did_last_is_asked_for_by_that_word() {
    let mut debugger = debugger("imc4", "bench");
    for (line, lists) in [("why fault", "`faults`"), ("why rule", "`rules`")] {
        let none = debugger.execute(line, &mut uninterrupted).unwrap_err().to_string();
        assert!(none.contains(lists), "{none}");
    }
    run(&mut debugger, &["when x > 700: fault drop to-host once", "send @01", "continue"]);
    // What has only begun has not struck.
    assert!(debugger.execute("why fault", &mut uninterrupted).is_err());
    run(&mut debugger, &["send @0A1000,1000", "continue", "send @0P", "continue"]);
    let rule = why(&mut debugger, "why rule");
    assert!(rule[0].ends_with("rule 1 acts: fault drop to-host once"), "{rule:#?}");
    assert_eq!(rule[1], "0ms  rule 1 was begun: when x > 700: fault drop to-host once");
    let fault = why(&mut debugger, "why fault");
    assert!(fault[0].contains("fault 1 ") && fault[0].contains("0"), "{fault:#?}");
    assert_eq!(fault[1..], rule, "{fault:#?}");
}

#[test]
fn a_rule_that_acts_when_a_fault_presses_a_switch_has_not_pressed_it() {
    let mut debugger = debugger("imc4", "mill");
    run(&mut debugger, &["fault switch x+ pressed while x > 350", "when x > 350: input 0.3 1"]);
    run(&mut debugger, &["send @01", "send @0A1000,1000", "continue"]);
    let chain = why(&mut debugger, "why switch");
    assert!(chain[0].ends_with("the limit switch X+ became active"), "{chain:#?}");
    assert!(chain[1].contains("fault 1"), "{chain:#?}");
    assert!(!chain.iter().any(|link| link.contains("rule")), "{chain:#?}");
}

#[test]
fn a_jam_is_told_when_it_begins_to_hold_a_motor() {
    let isel = (
        "imc4",
        ["send @03\\r@0A1000,1000,0,1000", "send @0A100,1000,0,1000", "send @0A500,500,500,500"],
    );
    let lpkf = ("smcu", ["send PR1000,0;", "send PR100,0;", "send PR500,500;"]);
    for (model, [first, still, both]) in [isel, lpkf] {
        let mut debugger = debugger(model, "bench");
        let told = |debugger: &mut Debugger| {
            let chain = why(debugger, "why fault");
            let (at, what) = chain[0].split_once("  ").unwrap();
            (at.to_owned(), what.to_owned())
        };
        // In the middle of a motion, once, and not again at its end.
        run(&mut debugger, &[first, "continue 100ms", "fault jam x for 200ms", "step event"]);
        let jammed = ("100ms".to_owned(), "fault 1 makes the motor of X stand".to_owned());
        assert_eq!(told(&mut debugger), jammed, "{model}");
        run(&mut debugger, &["continue"]);
        assert_eq!(told(&mut debugger), jammed, "{model}");
        let counted = run(&mut debugger, &["faults"]).to_string();
        assert!(counted.contains("struck once"), "{model}: {counted}");
        // Of one that was there before a motion it is told when that begins, if it moves the axis.
        run(&mut debugger, &["fault jam y", still, "continue"]);
        assert_eq!(told(&mut debugger), jammed, "{model}");
        run(&mut debugger, &[both, "step segment"]);
        let chain = why(&mut debugger, "why fault");
        assert!(chain[0].ends_with("fault 2 makes the motor of Y stand"), "{model}: {chain:#?}");
        let begun = debugger.executing().unwrap().began;
        assert_eq!(told(&mut debugger).0, show_nanos(begun.as_nanos()), "{model}");
    }
}
