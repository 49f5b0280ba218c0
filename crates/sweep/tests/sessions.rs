//! Recorded sessions and all their faults.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use vimc4_catalogue::{Controller, machine, model};
use vimc4_device::{Device, Harness, Input, Line, OwnedInput, Time, TimedInput};
use vimc4_sweep::{
    Choice, Exit, Foretold, Habits, Harm, Heard, MachineEnd, Mode, Place, Profile, Results,
    ResultsError, Session, Shard, Subject, Then, Verdict,
};

fn device(name: &str) -> Line<Controller> {
    let model = model(name).unwrap();
    Line::ideal(Controller::new(&model, machine("mill").unwrap(), b"").unwrap())
}

/// Lines at fixed times, far enough apart for each to be done before the next.
fn inputs(lines: &[&str]) -> (Vec<TimedInput>, Time) {
    let inputs = (1..).zip(lines).map(|(second, line)| {
        let at = Time::from_millis(10_000 * second);
        TimedInput { at, input: Input::Bytes(format!("{line}\r").as_bytes()).into() }
    });
    (inputs.collect(), Time::from_millis(10_000 * (lines.len() as u64 + 1)))
}

const LINES: [&str; 6] =
    ["@07", "@0R7", "@0A800,900,0,900,0,900,0,900", "@0P", "@0A-30,900,0,900,0,900,0,900", "@0P"];

fn session(lines: &[&str], choice: &Choice) -> Session<Line<Controller>> {
    let (inputs, end) = inputs(lines);
    Session::new(device("imc-s8"), &inputs, end, b"\r", choice)
}

#[test]
fn a_plan_counts_everything_that_happens() {
    let session = session(&LINES, &Choice::default());
    let (clean, plan) = (session.clean(), session.plan());
    let bytes: usize = LINES.iter().map(|line| line.len() + 1).sum();
    assert_eq!(clean.to_controller.len(), bytes);
    assert_eq!(clean.to_host.len(), 4 + 2 * 19);
    assert_eq!((clean.commands.len(), clean.answers.len()), (6, 6));
    // What moves in a reference run from the reference point is little, but it moves.
    let moves = clean.motions.iter().filter(|motion| !motion.references).count();
    assert_eq!(moves, 2);
    let motions = clean.motions.iter().map(|motion| {
        let way = motion.to.abs_diff(motion.from);
        (1..=3).filter(|quarter| way * quarter / 4 > 0).count()
    });
    let motions: usize = motions.sum();
    // Each byte {dropped, garbled, duplicated} x 3 and late x 2, each command {power} x 3, each quarter
    // of a motion {emergency stop, power} x 3, each answer {power} x 3, STOP x 3 at each command but the
    // reference run and in both moves, and the limit switch x 3 in these.
    let points = (bytes + 4 + 38) * 11 + 6 * 3 + motions * 6 + 6 * 3 + (5 + 6) * 3 + 6 * 3;
    assert_eq!(plan.len(), points as u64);
    assert_eq!(plan.point(plan.len()), None);
    for number in 0..plan.len() {
        let point = plan.point(number).unwrap();
        assert_eq!(point.number, number);
        assert!(!session.begin(&point).is_empty(), "{point:?}");
        assert!(!plan.describe(clean, &point).is_empty());
    }
}

/// From a snapshot comes the same as from the beginning.
#[test]
fn a_point_is_the_same_from_a_snapshot_and_from_the_beginning() {
    let choice = Choice { harms: Harm::ALL.map(|(harm, _)| harm).to_vec(), ..Choice::default() };
    let session = session(&LINES, &choice);
    for number in 0..session.plan().len() {
        let point = session.plan().point(number).unwrap();
        let found = session.run_point(number).unwrap();
        let whole = session.judge(number, &session.with_faults(&point), Exit::Played).unwrap();
        assert_eq!(found.outcome, whole.0.outcome, "{point:?}");
        let case = session.case(number, 0).unwrap();
        assert_eq!((&case.broken, &case.machine), (&whole.1.broken, &whole.1.machine), "{point:?}");
    }
}

/// The number of a point.
fn number(session: &Session<Line<Controller>>, place: Place, harm: Harm, mode: Mode) -> u64 {
    let mut numbers = 0..session.plan().len();
    let is_it = |number: &u64| {
        let point = session.plan().point(*number).unwrap();
        (point.place, point.harm, point.mode) == (place, harm, mode)
    };
    numbers.find(is_it).unwrap()
}

#[test]
fn what_comes_of_a_fault_is_what_the_manual_says() {
    let session = session(&LINES, &Choice::default());
    let run = |place, harm| {
        let number = number(&session, place, harm, Mode::Transient);
        (session.run_point(number).unwrap().outcome, session.case(number, 0).unwrap())
    };
    // The answer to the first move is the third byte that the controller sends.
    let (outcome, case) = run(Place::ToHost(2), Harm::Dropped);
    let cue = outcome.cue.unwrap();
    assert_eq!((&*cue.said, cue.heard), ("`@#A#,#,#,#,#,#,#,#`", Heard::Nothing));
    assert_eq!((outcome.then, outcome.machine), (Then::AsBefore, MachineEnd::InPlace));
    assert_eq!(
        case.broken,
        "`0` (byte 1) of the answer to `@0A800,900,0,900,0,900,0,900` was lost on its way to the host"
    );
    // It comes before the next answer instead.
    let (outcome, case) = run(Place::ToHost(2), Harm::Delayed);
    assert_eq!(outcome.cue.unwrap().heard, Heard::Nothing);
    assert_eq!(outcome.then, Then::Otherwise(vec!["`@#P` more".to_owned()]));
    assert_eq!(
        case.broken,
        "the answer to `@0A800,900,0,900,0,900,0,900` came late: with the next answer"
    );
    // A digit less: the way is shorter, and only the position tells it.
    let digit = LINES[..2].iter().map(|line| line.len() + 1).sum::<usize>() + 5;
    let (outcome, case) = run(Place::ToController(digit), Harm::Dropped);
    assert_eq!(outcome.cue.unwrap().heard, Heard::Otherwise);
    assert_eq!(outcome.machine, MachineEnd::Elsewhere);
    assert_eq!(case.machine, "X at 50 instead of 770");
    // STOP brakes the move, which says so.
    let motion = session.clean().motions.iter().position(|motion| !motion.references).unwrap();
    let (outcome, _) = run(Place::Motion(motion, 2), Harm::Stop);
    assert_eq!(outcome.cue.unwrap().heard, Heard::Instead("F".to_owned()));
    // At the limit switch it stands, and every move is refused until the next reference run.
    let (outcome, case) = run(Place::Motion(motion, 2), Harm::LimitSwitch);
    assert_eq!(outcome.cue.unwrap().heard, Heard::Instead("2".to_owned()));
    assert!(
        case.broken.starts_with("a limit switch was hit when X was at 400, during"),
        "{case:?}"
    );
    // Without power it knows nothing of its axes afterwards.
    let (outcome, _) = run(Place::Motion(motion, 2), Harm::PowerOff);
    assert_eq!(outcome.cue.unwrap().heard, Heard::Nothing);
    let Then::Otherwise(lines) = outcome.then else { panic!() };
    assert!(lines.contains(&"`@#A#,#,#,#,#,#,#,#` `4`".to_owned()), "{lines:?}");
}

#[test]
fn a_host_that_moves_after_a_power_failure_is_caught() {
    let choice = Choice { live: true, ..Choice::default() };
    let session = session(&LINES[..4], &choice);
    let number = number(&session, Place::Answer(2), Harm::PowerOff, Mode::Transient);
    let faults = session.begin(&session.plan().point(number).unwrap());
    let with = |lines: &[&str]| {
        let faults = faults.iter().cloned().map(|input| TimedInput { at: Time::ZERO, input });
        faults.chain(inputs(lines).0).collect::<Vec<_>>()
    };
    // It finds the controller without axes, sets them, and moves: nobody knows from where.
    let recovers = [&LINES[..4], &["@07", "@0A800,900,0,900,0,900,0,900"]].concat();
    let (found, case) = session.judge(number, &with(&recovers), Exit::Code(0)).unwrap();
    assert_eq!(found.outcome.verdicts, [Verdict::MovedUnreferenced, Verdict::FalseSuccess]);
    assert!(case.should.unwrap().contains("(X moved with `@0A800,900,0,900,0,900,0,900`)"));
    // With a reference run before it is right.
    let right = [&LINES[..4], &["@07", "@0R7", "@0A800,900,0,900,0,900,0,900"]].concat();
    let (found, _) = session.judge(number, &with(&right), Exit::Code(0)).unwrap();
    assert_eq!(found.outcome.verdicts, []);
    assert_eq!(found.outcome.machine, MachineEnd::InPlace);
    // An error that is reported is right as well, and so is every end but these.
    let (found, _) = session.judge(number, &with(&LINES[..4]), Exit::Code(1)).unwrap();
    assert_eq!(found.outcome.verdicts, []);
    for (exit, verdict) in [(Exit::Hung, Verdict::Hung), (Exit::Signal(11), Verdict::Crashed)] {
        let (found, _) = session.judge(number, &with(&LINES[..4]), exit).unwrap();
        assert_eq!(found.outcome.verdicts, [verdict]);
    }
}

/// An assertion of the test is the host's own only where it is about the wrong answer itself: what the host goes
/// on after, or what no answer tells, it has not noticed.
#[test]
fn an_assertion_of_the_test_has_noticed_nothing_for_the_host() {
    let choice = Choice { live: true, ..Choice::default() };
    let session = session(&LINES, &choice);
    let judged_as = |exit, place, harm, lines: &[&str]| {
        let number = number(&session, place, harm, Mode::Transient);
        let faults = session.begin(&session.plan().point(number).unwrap());
        let faults = faults.into_iter().map(|input| TimedInput { at: Time::ZERO, input });
        let given: Vec<TimedInput> = faults.chain(inputs(lines).0).collect();
        let (found, case) = session.judge(number, &given, exit).unwrap();
        (found.outcome, case)
    };
    let judged = |place, harm, lines: &[&str]| judged_as(Exit::Asserted, place, harm, lines);
    let motion = session.clean().motions.iter().position(|motion| !motion.references).unwrap();
    let stopped = Place::Motion(motion, 2);
    // It passes F over and goes on, and the test finds the axis elsewhere.
    let (outcome, case) = judged(stopped, Harm::Stop, &LINES);
    assert_eq!(outcome.verdicts, [Verdict::FalseSuccess]);
    assert_eq!(
        outcome.title(),
        "only an assertion of the test fails, and the machine is not where it should be"
    );
    assert!(outcome.did().ends_with("only an assertion of the test failed"), "{}", outcome.did());
    assert!(case.should.unwrap().contains("stopped by STOP"));
    // It returns F, and the test expects another answer.
    let (outcome, _) = judged(stopped, Harm::Stop, &LINES[..3]);
    assert_eq!(outcome.verdicts, []);
    // Only the position tells of a digit that was lost, and it is the test that compares it.
    let digit = LINES[..2].iter().map(|line| line.len() + 1).sum::<usize>() + 5;
    let (outcome, _) = judged(Place::ToController(digit), Harm::Dropped, &LINES);
    assert_eq!(outcome.verdicts, [Verdict::FalseSuccess]);
    // What the test expects is not met once the host has gone on, wherever the machine is.
    let (outcome, _) = judged_as(Exit::Unmet, stopped, Harm::Stop, &LINES[..3]);
    assert_eq!(outcome.verdicts, []);
    let (outcome, _) = judged_as(Exit::Unmet, stopped, Harm::Stop, &LINES);
    assert_eq!(outcome.verdicts, [Verdict::Unmet]);
    assert_eq!(outcome.title(), "it goes on, and an expectation of the test is not met");
}

#[test]
fn shards_share_all_points_and_put_together_they_are_the_whole() {
    let session = session(&LINES[..3], &Choice::default());
    let points = session.plan().len();
    let found = |numbers: &mut dyn Iterator<Item = u64>| {
        let mut results = Results::of(subject(&session));
        let mut text = String::new();
        if let Some(line) = results.head() {
            text += &(serde_json::to_string(&line).unwrap() + "\n");
        }
        for number in numbers {
            let found = session.run_point(number).unwrap();
            let case = || session.case(number, found.size);
            for line in results.add(number, &found.outcome, found.size, case) {
                text += &(serde_json::to_string(&line).unwrap() + "\n");
            }
        }
        (results, text)
    };
    let (whole, _) = found(&mut (0..points));
    assert_eq!(whole.done(), points);
    let (backwards, _) = found(&mut (0..points).rev());
    assert_eq!(backwards.lines(), whole.lines());
    for of in [2, 3, 7] {
        let mut merged = Results::default();
        for number in (1..=of).rev() {
            let (_, text) = found(&mut Shard { number, of }.numbers(points));
            assert_eq!(merged.read(&text), Ok(text.len()));
        }
        assert_eq!(merged.lines(), whole.lines());
    }
    // Half a line at the end is left out, and what belongs elsewhere is refused.
    let (_, text) = found(&mut (0..9));
    let mut torn = Results::default();
    assert_eq!(
        torn.read(&text[..text.len() - 3]),
        Ok(text[..text.len() - 1].rfind('\n').unwrap() + 1)
    );
    assert_eq!(torn.done(), 8);
    let unreadable = Err(ResultsError::Unreadable { line: 1 });
    assert_eq!(Results::default().read("nonsense\n"), unreadable);
    // Points without a head belong to nothing.
    let headless = &text[text.find('\n').unwrap() + 1..];
    let mut results = Results::of(subject(&session));
    assert_eq!(results.read(headless), unreadable);
    assert_eq!(results.done(), 0);
}

/// What a sweep of a session is of.
fn subject(session: &Session<Line<Controller>>) -> Subject {
    let profile = |name| Profile::new(name, &name);
    session.subject("./driver".to_owned(), profile("imc-s8"), profile("mill"))
}

#[test]
fn results_of_another_sweep_are_refused_and_the_difference_is_said() {
    let choice = |harm, mode| Choice { harms: vec![harm], modes: vec![mode], live: false };
    let dropped = choice(Harm::Dropped, Mode::Transient);
    let here = subject(&session(&LINES, &dropped));
    let like = |there: &Subject| {
        let (one, other) = (Results::of(here.clone()), Results::of(there.clone()));
        let line = serde_json::to_string(&other.head()).unwrap() + "\n";
        one.clone().read(&line).map_err(|error| error.to_string())
    };
    assert!(like(&here).is_ok());
    // In what order they were named does not matter.
    let many = |harms: &[Harm]| {
        let choice = Choice { harms: harms.to_vec(), ..dropped.clone() };
        subject(&session(&LINES, &choice))
    };
    assert_eq!(many(&[Harm::Stop, Harm::Dropped, Harm::Stop]), many(&[Harm::Dropped, Harm::Stop]));
    // As many points, in the same places.
    let garbled = subject(&session(&LINES, &choice(Harm::Garbled, Mode::Transient)));
    assert_eq!((garbled.points, &garbled.fingerprint), (here.points, &here.fingerprint));
    let persistent = subject(&session(&LINES, &choice(Harm::Dropped, Mode::Persistent)));
    let shorter = subject(&session(&LINES[..5], &dropped));
    // The same lines, at other times.
    let (mut inputs, end) = inputs(&LINES);
    inputs[2].at = Time::from_millis(30_001);
    let later = subject(&Session::new(device("imc-s8"), &inputs, end, b"\r", &dropped));
    let other = |name: &str| Profile::new(name, &"another");
    for (there, says) in [
        (garbled, "the harms are `garbled` there and `dropped` here"),
        (persistent, "the modes are `persistent` there and `transient` here"),
        (
            Subject { of: "./mended".to_owned(), ..here.clone() },
            "what is swept is `./mended` there and `./driver` here",
        ),
        (
            Subject { model: other("imc4"), ..here.clone() },
            "the model is `imc4` there and `imc-s8` here",
        ),
        (
            Subject { machine: other("bench"), ..here.clone() },
            "the machine is `bench` there and `mill` here",
        ),
        (
            Subject { model: other("imc-s8"), ..here.clone() },
            "the model `imc-s8` has another profile there",
        ),
        (shorter, "without a fault something else happens there"),
        (later, "without a fault something else happens there"),
    ] {
        let refused = format!("line 1: these are the results of another sweep: {says}");
        assert_eq!(like(&there), Err(refused));
    }
}

#[test]
fn two_runs_that_differ_are_told_apart() {
    let one = session(&LINES, &Choice::default());
    let against = |lines: &[&str]| one.difference(&session(lines, &Choice::default()));
    assert_eq!(against(&LINES), None);
    let mut other = LINES;
    other[2] = "@0A801,900,0,900,0,900,0,900";
    assert_eq!(
        against(&other).unwrap(),
        "first it sent `@0A800,900,0,900,0,900,0,900`, then it sent `@0A801,900,0,900,0,900,0,900`"
    );
    assert_eq!(against(&LINES[..5]).unwrap(), "first it sent `@0P`, then it sent nothing more");
}

#[test]
fn names_of_shards_are_checked() {
    assert_eq!("3/16".parse(), Ok(Shard { number: 3, of: 16 }));
    for wrong in ["", "3", "0/4", "5/4", "1/0", "a/b", "1/2/3"] {
        assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
    }
}

/// No fault that a plan has leads a controller of any family to where none can be.
#[test]
fn every_family_can_be_swept() {
    let (inputs, end) = ([("PR;", 10), ("PA100,100;", 20), ("PD;PA200,0;PU;", 30)], 60);
    let inputs = inputs.map(|(line, at)| {
        let input = Input::Bytes(line.as_bytes()).into();
        TimedInput { at: Time::from_millis(1_000 * at), input }
    });
    let device = device("smcu");
    let end = Time::from_millis(1_000 * end);
    let session = Session::new(device.clone(), &inputs, end, b";", &Choice::default());
    assert!(!session.plan().is_empty());
    for number in 0..session.plan().len() {
        session.run_point(number).unwrap();
    }
    assert_eq!(session.device().now(), device.now());
}

/// A host that says its lines and asks where it is in the end; at a wrong answer it ends, at none it hangs.
/// Whether it waits for its answers decides when the next line comes.
fn host(faults: &[OwnedInput], lines: &[&str], waits: bool) -> (Vec<TimedInput>, Exit) {
    let mut harness = Harness::new(device("imc-s8")).keeping_given();
    for fault in faults {
        harness.input(fault.as_input());
    }
    let mut exit = Exit::Code(0);
    for line in lines {
        harness.send(format!("{line}\r").as_bytes());
        if waits {
            harness.run_to_rest().unwrap();
        }
        match &harness.take_bytes()[..] {
            [] if waits => exit = Exit::Hung,
            [] | [b'0', ..] => continue,
            _ => exit = Exit::Code(1),
        }
        break;
    }
    harness.run_to_rest().unwrap();
    (harness.take_given(), exit)
}

#[test]
fn what_a_host_would_do_again_is_known_and_nothing_else() {
    let choice = Choice { live: true, ..Choice::default() };
    let (given, exit) = host(&[], &LINES[..4], true);
    let session = Session::new(device("imc-s8"), &given, Time::ZERO, b"\r", &choice);
    let mut habits = Habits::new(&session, &given, exit).unwrap();
    let (mut known, mut hung) = (0, 0);
    for number in 0..session.plan().len() {
        let point = session.plan().point(number).unwrap();
        let (given, exit) = host(&session.begin(&point), &LINES[..4], true);
        let foretold = habits.foretell(&session, &point);
        let really = Foretold::Known(given.clone(), exit);
        if matches!(foretold, Foretold::Unknown(_)) {
            habits.learn(&session, &given, exit);
            // A host that was too slow once may be faster next time.
            if exit == Exit::Hung && habits.foretell(&session, &point) == foretold {
                hung += 1;
                habits.learn(&session, &given, exit);
            }
        } else {
            known += 1;
        }
        assert_eq!(habits.foretell(&session, &point), really, "{number}");
    }
    assert!(hung > 1 && known * 2 > session.plan().len(), "{hung} {known}");
    // One that does something else where it hears the same is not foretold any more.
    let number = number(&session, Place::Answer(2), Harm::PowerOff, Mode::Persistent);
    let point = session.plan().point(number).unwrap();
    habits.learn(&session, &host(&session.begin(&point), &LINES[..3], true).0, Exit::Code(1));
    assert_eq!(habits.foretell(&session, &point), Foretold::Unclear);
}

#[test]
fn a_host_that_does_not_wait_for_its_answers_is_not_foretold() {
    let choice = Choice { live: true, ..Choice::default() };
    let (given, exit) = host(&[], &LINES[..4], false);
    let session = Session::new(device("imc-s8"), &given, Time::ZERO, b"\r", &choice);
    assert!(Habits::new(&session, &given, exit).is_none());
}
