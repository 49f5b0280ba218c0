//! Recordings that are read while they are gone through.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ops::ControlFlow;

use vimc4_catalogue::Controller;
use vimc4_debug::{Answer, Debugger, Read, Reason, Recorded, Reel, uninterrupted};
use vimc4_device::{Device, Input, OwnedInput, Time};

fn controller() -> Controller {
    let (model, machine) =
        (vimc4_catalogue::model("imc4").unwrap(), vimc4_catalogue::machine("bench").unwrap());
    vimc4_catalogue::bare(&model, &machine, &[]).unwrap()
}

/// What is told one thing after the other, up to what is wrong, if something is.
struct Tape {
    things: std::vec::IntoIter<(Time, Recorded)>,
    wrong: Option<&'static str>,
}

impl Reel for Tape {
    fn next(&mut self) -> Result<Option<(Time, Recorded)>, String> {
        match (self.things.next(), self.wrong) {
            (Some(thing), _) => Ok(Some(thing)),
            (None, Some(wrong)) => Err(wrong.to_owned()),
            (None, None) => Ok(None),
        }
    }

    fn share(&self) -> Option<u32> {
        None
    }
}

/// Far more than is read at once.
const COMMANDS: u64 = 4_950;

/// One command each second: the axes are set, then X goes a step to and fro, but for one long way.
fn things(commands: u64) -> Vec<(Time, Recorded)> {
    let mut things = Vec::new();
    for number in 0..commands {
        let line: &[u8] = match number {
            0 => b"@01\r",
            4_501 => b"@0A700,900\r",
            4_503 => b"@0A-700,900\r",
            odd if odd % 2 == 1 => b"@0A1,900\r",
            _ => b"@0A-1,900\r",
        };
        let at = Time::from_secs(number + 1);
        things.push((at, Recorded::Given(OwnedInput::from(Input::Bytes(line)))));
        if number == 4_750 {
            things.push((at, Recorded::Mark("late".to_owned())));
        }
    }
    things.push((Time::from_secs(commands + 5), Recorded::Passed));
    things
}

fn unread(wrong: Option<&'static str>) -> Debugger {
    unread_of(COMMANDS, wrong)
}

fn unread_of(commands: u64, wrong: Option<&'static str>) -> Debugger {
    let things = things(commands).into_iter();
    Debugger::new(controller()).with_reel(Box::new(Tape { things, wrong }))
}

/// One of which everything is read, standing at its beginning.
fn read() -> Debugger {
    let mut debugger = unread(None);
    assert_eq!(debugger.read_on(usize::MAX, &mut uninterrupted), Read::All);
    debugger
}

#[test]
fn whatever_is_asked_is_as_if_everything_had_been_read_before() {
    let whole = read();
    assert!(!whole.has_unread());
    let lines = [
        "goto end",
        "goto late",
        "goto 4875s",
        "goto command 4875",
        "next x > 500",
        "continue",
        "step 50 command",
        "step 500s",
        "trace x > 500",
        "run until x > 500",
    ];
    for line in lines {
        let (mut whole, mut unread) = (whole.clone(), unread(None));
        if line.starts_with("step") {
            // Over the place up to which it is read by then.
            for debugger in [&mut whole, &mut unread] {
                debugger.execute("goto 4060s", &mut uninterrupted).unwrap();
            }
        }
        let [one, other] = [&mut whole, &mut unread].map(|debugger| {
            (debugger.execute(line, &mut uninterrupted).unwrap(), debugger.place())
        });
        assert_eq!(one, other, "{line}");
        assert_eq!(whole.device().state(), unread.device().state(), "{line}");
        assert_eq!(whole.execute("last x > 0", &mut uninterrupted), {
            unread.execute("last x > 0", &mut uninterrupted)
        });
    }
}

#[test]
fn what_would_come_is_held_against_all_that_came() {
    let mut debugger = unread_of(300, None);
    assert_eq!(debugger.read_on(100, &mut uninterrupted), Read::More);
    let said = debugger.execute("what if quirk stop_reply = F0", &mut uninterrupted).unwrap();
    assert!(said.to_string().ends_with("nothing else comes of it until 305s"), "{said}");
}

#[test]
fn where_one_stands_stays_while_it_is_read() {
    let mut debugger = unread(None);
    let begin = debugger.place();
    for _ in 0..5 {
        assert_eq!(debugger.read_on(100, &mut uninterrupted), Read::More);
        assert_eq!(debugger.place(), begin);
    }
    // It reads no further than it is asked to.
    assert!(debugger.history().branches().all(|branch| branch.inputs == 500));
    debugger.execute("goto 100s", &mut uninterrupted).unwrap();
    let (place, state) = (debugger.place(), debugger.device().state());
    assert_eq!(debugger.read_on(usize::MAX, &mut |_| ControlFlow::Break(())), Read::Cancelled);
    assert_eq!(debugger.read_on(100, &mut uninterrupted), Read::More);
    assert_eq!((debugger.place(), debugger.device().state()), (place, state));
}

#[test]
fn what_is_done_where_reading_has_come_to_is_a_branch() {
    let mut debugger = unread(None);
    assert_eq!(debugger.read_on(10, &mut uninterrupted), Read::More);
    let end = debugger.history().branches().next().unwrap().end.at;
    debugger.execute("goto 10s", &mut uninterrupted).unwrap();
    assert_eq!(debugger.now(), end);
    debugger.execute("send @0A50,900", &mut uninterrupted).unwrap();
    let stopped = debugger.execute("continue", &mut uninterrupted).unwrap();
    // Nothing of the recording comes on it.
    assert!(matches!(stopped, Answer::Stopped(stop, _) if stop.why == Reason::Rest));
    assert_eq!(debugger.evaluate("x").unwrap(), 51);
    assert!(debugger.has_unread());
    // It is read on beside that, and comes where the recording goes on.
    assert_eq!(debugger.read_on(usize::MAX, &mut uninterrupted), Read::All);
    assert_eq!(debugger.evaluate("x").unwrap(), 51);
    debugger.execute("goto main", &mut uninterrupted).unwrap();
    assert_eq!(debugger.now(), Time::from_secs(COMMANDS + 5));
}

#[test]
fn what_is_wrong_is_said_where_one_comes_to_it() {
    const WRONG: &str = "tape, line 9: it is no line";
    let mut debugger = unread(Some(WRONG));
    debugger.execute("goto command 4950", &mut uninterrupted).unwrap();
    debugger.execute("goto 4875s", &mut uninterrupted).unwrap();
    for line in ["continue", "goto end", "goto 12500s", "goto nowhere", "next x > 800", "step s"] {
        debugger.execute("goto 4940s", &mut uninterrupted).unwrap();
        let line = if line == "step s" { "step 100s" } else { line };
        let error = debugger.execute(line, &mut uninterrupted).unwrap_err();
        assert_eq!(error.to_string(), WRONG, "{line}");
    }
    // What is known is gone through all the same.
    debugger.execute("last x > 500", &mut uninterrupted).unwrap();
    assert!(debugger.now() > Time::from_secs(4_502));
}

#[test]
fn reading_is_broken_off_and_gone_on_with() {
    for line in ["goto end", "continue", "goto 4875s", "next x > 500", "goto command 4950"] {
        let mut debugger = unread(None);
        let mut asked = 0;
        let broken_off = debugger.execute(line, &mut |_| {
            asked += 1;
            if asked > 20 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let said = broken_off.map_or_else(|error| error.to_string(), |answer| answer.to_string());
        assert!(said.contains("cancelled"), "{line}: {said}");
        assert!(debugger.has_unread(), "{line}");
        debugger.execute(line, &mut uninterrupted).unwrap();
    }
}

#[test]
fn commands_are_listed_as_far_as_they_are_read() {
    let mut debugger = unread(None);
    debugger.list_commands("tape");
    let lines = |debugger: &Debugger| debugger.source().map_or(0, |source| source.lines.len());
    assert_eq!(lines(&debugger), 0);
    debugger.read_on(1_000, &mut uninterrupted);
    assert_eq!(lines(&debugger), 1_000);
    debugger.execute("goto command 4502", &mut uninterrupted).unwrap();
    let source = debugger.source().unwrap();
    assert_eq!(source.lines[4_501], "@0A700,900");
    assert_eq!(source.of_command.len(), source.lines.len());
    let number = debugger.executing().unwrap().number;
    assert_eq!(debugger.source().unwrap().line_of(number), Some(4_502));
}
