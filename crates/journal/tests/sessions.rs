//! Expectations over sessions that nobody has thought out.

#![expect(clippy::too_many_lines, reason = "one test is one story")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::Duration;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use vimc4_catalogue::{bare, machine, model};
use vimc4_device::{
    Condition, Device, Event, Harness, Input, Kinds, Motion, Names, Output, Point, SignalId, Time,
};
use vimc4_journal::expect::{
    Clause, Expectation, Failure, Pattern, Reply, Rule, Stage, Then, Trial, Unmet,
};
use vimc4_journal::{Entry, Journal, Picture};

/// What is done in a session.
#[derive(Clone, Debug)]
enum Act {
    Send(String),
    Press(&'static str),
    Wait(u64),
}

fn acts() -> impl Strategy<Value = Vec<Act>> {
    let way = || -60..=60_i64;
    let act = prop_oneof![
        4 => (way(), way(), way()).prop_map(|(x, y, z)| {
            Act::Send(format!("@0A{x},900,{y},800,{z},700,0,900\r"))
        }),
        2 => (way(), way()).prop_map(|(x, y)| Act::Send(format!("@0M{x},400,{y},300,0,300,0,300\r"))),
        1 => Just(Act::Send("@0P\r".to_owned())),
        1 => Just(Act::Send("@0X\r".to_owned())),
        1 => (0..4_u8).prop_map(|value| Act::Send(format!("@0B65529,{value}\r"))),
        1 => Just(Act::Send("@0n7\r".to_owned())),
        1 => Just(Act::Send("@0y0\r@0f-1\r@0y40,300,12,0,0,30,1,1\r".to_owned())),
        1 => Just(Act::Press("stop")),
        1 => Just(Act::Press("start")),
        2 => (0..200_u64).prop_map(Act::Wait),
    ];
    prop::collection::vec(act, 1..12)
}

fn conditions() -> impl Strategy<Value = Condition> {
    let place = || -70..=70_i64;
    let one = prop_oneof![
        (0..3_u8, place()).prop_map(|(axis, position)| Condition::AxisAt { axis, position }),
        (0..3_u8, place()).prop_map(|(axis, position)| Condition::AxisBelow { axis, position }),
        (0..3_u8, place()).prop_map(|(axis, position)| Condition::AxisAbove { axis, position }),
        (place(), place(), 0..40_i64).prop_map(|(x, y, size)| {
            let (mut low, mut high) = ([i64::MIN; 6], [i64::MAX; 6]);
            (low[0], high[0], low[1], high[1]) = (x, x + size, y, y + size);
            Condition::Outside { low, high }
        }),
    ];
    prop_oneof![
        3 => one.clone(),
        1 => prop::collection::vec(one.clone(), 2..4).prop_map(Condition::All),
        1 => prop::collection::vec(one, 2..4).prop_map(Condition::Any),
    ]
}

fn patterns() -> impl Strategy<Value = Pattern> {
    let like = || prop::sample::select(vec!["@A", "@M", "@P", "@0A1", "@"]);
    let reply = prop_oneof![
        Just(None),
        Just(Some(Reply::Any)),
        Just(Some(Reply::Text("0".to_owned()))),
        Just(Some(Reply::Error(None))),
    ];
    let span = || (0..300_u64).prop_map(Duration::from_millis);
    prop_oneof![
        2 => conditions().prop_map(Pattern::When),
        1 => Just(Pattern::When(Condition::Answer { text: "F".to_owned() })),
        1 => (like(), conditions()).prop_map(|(like, state)| {
            let command = Condition::Command { like: Some(like.to_owned()) };
            Pattern::When(Condition::All(vec![command, state]))
        }),
        2 => (like(), reply, prop::option::of(span())).prop_map(|(like, reply, within)| {
            let within = within.filter(|_| reply.is_some());
            Pattern::Command { like: like.to_owned(), reply, within }
        }),
    ]
}

fn expectations() -> impl Strategy<Value = Expectation> {
    let clause =
        (patterns(), 0..3_u64, prop::option::of(0..3_u64)).prop_map(|(what, least, more)| {
            let most = more.map(|more| least + more);
            Clause { what, least: if most.is_none() { least.max(1) } else { least }, most }
        });
    let span = || prop::option::of((0..400_u64).prop_map(Duration::from_millis));
    let stage = (prop::collection::vec(clause, 1..3), span(), any::<bool>()).prop_map(
        |(clauses, span, late)| {
            let (after, within) = if late { (None, span) } else { (span, None) };
            Stage { after, within, clauses }
        },
    );
    let held = (conditions(), 0..200_u64)
        .prop_map(|(state, ms)| Then::Held { state, span: Duration::from_millis(ms) });
    let follows = (patterns(), 0..400_u64)
        .prop_map(|(what, ms)| Then::Follows { what, within: Duration::from_millis(ms) });
    let rule = (patterns(), prop_oneof![held, follows], any::<bool>()).prop_map(
        |(whenever, then, if_at_all)| {
            Expectation::Rule(Box::new(Rule { whenever, then, if_at_all }))
        },
    );
    prop_oneof![
        3 => prop::collection::vec(stage, 1..4).prop_map(Expectation::Order),
        2 => rule,
    ]
}

/// Does it, and tells every entry and the time after every act.
fn play(acts: &[Act], mut told: impl FnMut(&mut Journal, Option<Entry>, Time)) -> (Journal, Names) {
    let (model, machine) = (model("imc4").unwrap(), machine("bench").unwrap());
    let controller = bare(&model, &machine, b"").unwrap();
    let mut imc4 = Harness::new(controller).watching(Kinds::ALL);
    let signals = imc4.device().signals();
    let signal = |name: &str| signals.iter().find(|signal| signal.name == name).unwrap().id;
    let names = model.names(signals.clone()).with_scales(machine.scales());
    let mut journal = Journal::new(Picture::of(imc4.device()), usize::MAX);
    let press = |imc4: &mut Harness<_>, id: SignalId| {
        imc4.input(Input::Signal(id, 1));
        imc4.input(Input::Signal(id, 0));
    };
    imc4.send(b"@07\r");
    for act in acts {
        match act {
            Act::Send(line) => imc4.send(line.as_bytes()),
            Act::Press(name) => press(&mut imc4, signal(name)),
            Act::Wait(ms) => imc4.advance(Duration::from_millis(*ms)),
        }
        collect(&mut imc4, &mut journal, &mut told);
    }
    imc4.advance(Duration::from_secs(3));
    collect(&mut imc4, &mut journal, &mut told);
    (journal, names)
}

fn collect<D: Device>(
    imc4: &mut Harness<D>,
    journal: &mut Journal,
    told: &mut impl FnMut(&mut Journal, Option<Entry>, Time),
) {
    while let Some(output) = imc4.take_output() {
        if let Output::Event(stamp, event) = output {
            let entry = journal.keep(stamp, event, "").clone();
            told(journal, Some(entry), stamp.at);
        }
    }
    journal.run_to(imc4.now());
    told(journal, None, imc4.now());
}

/// What it comes to, without the story around it: at once nothing of what follows is known.
fn verdict(outcome: Option<Box<Failure>>) -> Option<Failure> {
    outcome.map(|failure| Failure { around: Vec::new(), ..*failure })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// What is solved on the motions is what is found step by step.
    #[test]
    fn places_are_solved_as_they_are_walked(acts in acts(), condition in conditions()) {
        let (journal, names) = play(&acts, |_, _, _| {});
        let times = walked(&journal, &condition);
        let count = u64::try_from(times.len()).unwrap();
        let expected = |least, most| {
            let what = Pattern::When(condition.clone());
            let clauses = vec![Clause { what, least, most }];
            Expectation::Order(vec![Stage { after: None, within: None, clauses }])
        };
        match Trial::of(expected(count, Some(count)), &journal, &names) {
            Err(Unmet::Mistake(_)) => prop_assert_eq!(count, 0),
            outcome => prop_assert!(outcome.is_ok(), "{:?} {:?}", times, outcome),
        }
        // And at the same instant.
        if let Some(first) = times.first() {
            let failure = Trial::of(expected(0, Some(0)), &journal, &names).unwrap_err();
            let Unmet::Failure(failure) = failure else { panic!("{failure}") };
            prop_assert_eq!(failure.at, *first);
        }
    }
}

/// Followed while it happens, looked at in between at any times or at those that it asks for, an
/// expectation comes to the same as held against the journal afterwards.
#[test]
fn as_it_happens_and_afterwards_are_the_same() {
    let looks = || prop::collection::vec(0..2_000_000_000_u64, 0..20);
    let seen = Mutex::new(BTreeMap::new());
    TestRunner::deterministic()
        .run(&(acts(), expectations(), looks(), any::<bool>()), |(acts, expected, looks, asks)| {
            let outcome = compare(&acts, &expected, looks, asks)?;
            *seen.lock().unwrap().entry(outcome).or_insert(0) += 1;
            Ok(())
        })
        .unwrap();
    // Each way in which it can come out was among them.
    let seen = seen.into_inner().unwrap();
    assert_eq!(seen.len(), 9, "{seen:?}");
}

#[test]
fn what_is_no_sentence_is_told_with_what_would_be() {
    let names = play(&[], |_, _, _| {}).1;
    for (text, right) in [
        ("", "write it as in `command @A, once`"),
        ("; then command @A, once", "write it as in"),
        ("command @A", "say how often, as in `command @A, once`"),
        ("command @A, often", "say how often, as in `command @A, once`"),
        ("rubbish", "`rubbish` is wrong: a condition, such as"),
        ("rubbish, often", "`rubbish` is wrong: a condition, such as"),
        ("command @J, once", "is wrong at `@J`"),
        ("x > far, once", "a position in steps or mm"),
        ("command @A answered 0 1, once", "more than a word"),
        ("command @A answered \"0, once", "lacks the second quotation mark"),
        ("command @A answered within soon, once", "`soon` has no unit of time"),
        ("x > 1, once, within 5", "`5` has no unit of time"),
        ("x > 1, once, within -2 s", "`-2 s` is no time; write"),
        (
            "x > 1, once; then",
            "nothing follows `; then`; go on as in `x > 1, once; then x > 100, once`",
        ),
        ("x > 1, once, and", "as in `x > 1, once, and x > 100, once`"),
        ("x > 1, at least 0 times", "is always so"),
        ("x > 1, at least 0", "is always so"),
        ("command @A answered 0", "say how often, as in `command @A answered 0, once`"),
        ("command @A at least 3", "write `command @A, at least 3`"),
        ("always x > 1", "as in `x < 0, never`"),
        ("always", "as in `x < 0, never`"),
        ("x > 1, always", "as in `x < 0, never`"),
        ("command @A; command @P", "write `command @A, once; then command @P, once`"),
        ("command @A then x > 1, twice", "write `command @A, once; then x > 1, twice`"),
        ("command @A; then", "as in `command @A, once; then x > 100, once`"),
        ("command @A, once then x > 1, never", "write `command @A, once; then x > 1, never`"),
        ("command @A, once, then x > 1, never", "write `command @A, once; then x > 1, never`"),
        ("command @A, once; x > 1, never", "write `command @A, once; then x > 1, never`"),
        ("x > 1, 3 to once", "cannot come 3 times"),
        (
            "command @A answered 0 once",
            "`once` follows a comma and a blank; write `command @A answered 0, once`",
        ),
        ("command @A,never", "`never` follows a comma and a blank; write `command @A, never`"),
        ("x > 1 at least twice", "write `x > 1, at least twice`"),
        ("command @A answered with error 2 once", "write `command @A answered with error 2, once`"),
        (
            "command @A answered error 2, once",
            "as in `answered with an error`, `answered with error 2`",
        ),
        ("command @A answered with error, once", "`answered with error 2`"),
        ("command @A answered with", "`answered with` does not say what the answer is"),
        ("command @A answered within, once", "`answered within 1 s` or `answered \"within\"`"),
        ("command @A,", "as in `command @A, once`"),
        (
            "command @A, within 5 s, once",
            "`within 5 s` stands before how often; write `command @A, once, within 5 s`",
        ),
        ("whenever x > 1", "one colon"),
        ("whenever x > 1: y < 1: z < 1", "one colon"),
        ("whenever x > 1: answer F", "say how soon it follows, as in `answer F within 2 s`"),
        ("whenever x > 1, if at all: command @P", "as in `command @P within 2 s`, or name a state"),
        ("whenever x > 1: command @P for at least 1 s", "as in `command @P within 2 s`"),
        ("whenever x > 1: command @J", "is wrong at `@J`"),
        ("x > 1, once; then whenever x > 2: y > 1", "is wrong: a condition, such as"),
    ] {
        let wrong = Expectation::read(text, &names).unwrap_err().to_string();
        assert!(wrong.contains(right), "{text}: {wrong}");
    }
    for (text, words) in [
        ("command A, once", "command @A, once"),
        ("command A, 3", "command @A, 3 times"),
        ("limit x+, once", ""),
        ("command A, at least 3", "command @A, at least 3 times"),
        ("command A, 1 to 3", "command @A, 1 to 3 times"),
        ("command \"@0A1 then 2\", once", ""),
        (" command \"@0A1, 2\" answered \"0 1\" within 2s, 2 times, and x > 1mm, never", ""),
        ("x > 1, once; then x > 2, once, no sooner than after 1 s, within 5 s", ""),
        ("x > 1, once; then x > 2, once, within 5 s, no sooner than after 1 s", ""),
        ("whenever z < 0: signal cover is closed", ""),
        ("command @A answered \"with\", once, and command @A answered \"error\", once", ""),
        ("command @A and x > 5, twice", ""),
        ("whenever command @R, if at all: command @A within 1.5 s", ""),
    ] {
        let read = Expectation::read(text, &names).unwrap();
        let again = read.in_words(&names);
        assert!(words.is_empty() || again == words, "{again}");
        assert_eq!(Expectation::read(&again, &names).unwrap(), read, "{again}");
    }
}

/// How it comes out, in a word.
fn compare(
    acts: &[Act],
    expected: &Expectation,
    looks: Vec<u64>,
    asks: bool,
) -> Result<String, TestCaseError> {
    let mut trial: Option<Trial> = None;
    let mut at_once: Option<Option<Failure>> = None;
    let mut looks: Vec<Time> = looks.into_iter().map(Time::from_nanos).collect();
    looks.sort();
    let names = play(&[], |_, _, _| {}).1;
    let mut wrong = false;
    let (journal, _) = play(acts, |journal, entry, now| {
        if wrong {
            return;
        }
        let trial = match &mut trial {
            Some(trial) => trial,
            none => match Trial::new(expected.clone(), &names, journal.start().clone(), 0) {
                Ok(begun) => none.insert(begun),
                Err(_) => {
                    wrong = true;
                    return;
                }
            },
        };
        looks.retain(|look| {
            if *look <= now {
                trial.pass(*look);
            }
            *look > now
        });
        while let Some(due) = trial.watch().due().filter(|due| asks && *due <= now) {
            trial.pass(due);
        }
        match &entry {
            Some(entry) => trial.see(entry),
            None => trial.pass(now),
        }
        if at_once.is_none() && trial.watch().has_failed() {
            at_once = Some(verdict(trial.watch().failure(journal, &names)));
        }
    });
    let afterwards = Trial::of(expected.clone(), &journal, &names);
    if wrong {
        prop_assert!(matches!(afterwards, Err(Unmet::Mistake(_))));
        return Ok("mistake".to_owned());
    }
    let afterwards = match afterwards {
        Ok(()) => None,
        Err(Unmet::Failure(failure)) => verdict(Some(failure)),
        Err(Unmet::Mistake(mistake)) => panic!("{mistake}"),
    };
    let Some(trial) = trial else { return Err(TestCaseError::fail("nothing was told")) };
    let live = at_once
        .unwrap_or_else(|| verdict(trial.watch().outcome(journal.until(), &journal, &names)));
    prop_assert_eq!(&live, &afterwards, "{}", expected.in_words(&names));
    // What is written down is read again, and means the same.
    let text = serde_json::to_string(expected).unwrap();
    prop_assert_eq!(&serde_json::from_str::<Expectation>(&text).unwrap(), expected, "{}", text);
    let words = expected.in_words(&names);
    prop_assert_eq!(Expectation::read(&words, &names), Ok(expected.clone()), "{}", words);
    Ok(live.map_or_else(|| "met".to_owned(), |failure| format!("{:?}", failure.reason)))
}

/// When a condition becomes true, found by walking every step.
fn walked(journal: &Journal, condition: &Condition) -> Vec<Time> {
    let mut at: Point =
        std::array::from_fn(|axis| journal.start().position(axis as u8).unwrap_or(0));
    // Any of several parts becomes true by itself.
    let parts: Vec<&Condition> = match condition {
        Condition::Any(parts) => parts.iter().collect(),
        one => vec![one],
    };
    let mut was = vec![false; parts.len()];
    let mut times = Vec::new();
    let mut look = |at: &Point, now: Time| {
        let mut comes = false;
        for (part, was) in parts.iter().zip(&mut was) {
            let is = is_so(part, at);
            comes |= is && !*was;
            *was = is;
        }
        if comes {
            times.push(now);
        }
    };
    look(&at, journal.start().at());
    let mut under_way = None;
    for entry in journal.entries() {
        match entry.event() {
            Some(Event::Motion(Motion::Begins { origin, segment })) => {
                at = *origin;
                look(&at, entry.at);
                under_way = Some((entry.at, *origin, segment.clone()));
            }
            Some(Event::Motion(Motion::Changes { segment })) => {
                if let Some((_, _, running)) = &mut under_way {
                    running.clone_from(segment);
                }
            }
            Some(Event::Motion(Motion::Ends { steps })) => {
                let Some((began, origin, segment)) = under_way.take() else { continue };
                for step in segment.steps().take(usize::try_from(*steps).unwrap()) {
                    at = std::array::from_fn(|axis| origin[axis] + step.offset[axis]);
                    look(&at, began.after_nanos(step.nanos));
                }
            }
            _ => {}
        }
    }
    times
}

fn is_so(condition: &Condition, at: &Point) -> bool {
    match condition {
        Condition::AxisAt { axis, position } => at[usize::from(*axis)] == *position,
        Condition::AxisBelow { axis, position } => at[usize::from(*axis)] < *position,
        Condition::AxisAbove { axis, position } => at[usize::from(*axis)] > *position,
        Condition::Outside { low, high } => {
            at.iter().zip(low.iter().zip(high)).any(|(at, (low, high))| at < low || at > high)
        }
        Condition::All(parts) => parts.iter().all(|part| is_so(part, at)),
        Condition::Any(parts) => parts.iter().any(|part| is_so(part, at)),
        other => panic!("{other}"),
    }
}
