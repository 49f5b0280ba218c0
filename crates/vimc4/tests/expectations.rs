//! Expectations as a test of host software uses them.

#![expect(clippy::too_many_lines, reason = "one test is one story")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::io::{ErrorKind, Read, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::time::Duration;

use vimc4::{
    Builder, Button, Clock, Condition, Emulator, Error, Expect, Failure, Live, MemoryPort, Reason,
    Sentence, Time,
};

/// What all of it is about: a reference run, moves, a port, a line that is not a command.
const SESSION: &str = "@07\r@0R7\r@0A800,900,0,900,0,900,0,900\r\
    @0M900,900,0,900,-100,900,0,900\r@0B2,1\r@0X\r@0A400,900,0,900,0,900,0,900\r@0P\r";

fn manual() -> Builder {
    Emulator::builder().machine("mill").time(Clock::Manual)
}

fn send(port: &mut MemoryPort, line: &str) {
    port.write_all(line.as_bytes()).unwrap();
}

/// A mill that has done all that, and its client.
fn after_session() -> (Emulator, MemoryPort) {
    let emu = manual().start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, SESSION);
    emu.run_until_idle().unwrap();
    (emu, port)
}

const fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// Why it was not met.
fn failure<T>(outcome: Result<T, Error>) -> Box<Failure> {
    match outcome {
        Err(Error::Unmet(failure)) => failure,
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("it was met"),
    }
}

#[test]
fn what_was_expected_is_told_with_what_came_closest() {
    type Said = fn(Expect<Live>) -> Sentence<Live>;
    let (emu, _port) = after_session();
    let told: [(Said, Reason, &str); 27] = [
        (
            |e| e.command("@A").at_least(3),
            Reason::Missing,
            "expected command @A, at least 3 times\n  but it came twice",
        ),
        (
            |e| e.command("A").answered("2").once(),
            Reason::Missing,
            "expected command @A answered 2, once\n  but it never came\n  closest: at 6.134611 s, \
             @0A400,900,0,900,0,900,0,900 was answered 0, not 2",
        ),
        (
            |e| e.command("?").answered("0").once(),
            Reason::Missing,
            "expected command ? answered 0, once\n  but it never came\n  closest: at 6.134611 s, @0X \
             was answered 5, not 0: @0X: no command begins like this",
        ),
        (
            |e| e.command("@A").answered("0").within(ms(100)).at_least(1),
            Reason::Missing,
            "expected command @A answered 0 within 100 ms, at least once\n  but it never came\n  \
             closest: at 6.134611 s, @0A400,900,0,900,0,900,0,900 was answered after 448 ms, not \
             within 100 ms",
        ),
        (
            |e| e.command("@A").refused().once(),
            Reason::Missing,
            "expected command @A answered with an error, once\n  but it never came\n  closest: at \
             6.134611 s, @0A400,900,0,900,0,900,0,900 was answered 0, which is not an error",
        ),
        (
            |e| e.command("@A").refused_with("2").once(),
            Reason::Missing,
            "expected command @A answered with error 2, once\n  but it never came\n  closest: at \
             6.134611 s, @0A400,900,0,900,0,900,0,900 was answered 0, not with error 2",
        ),
        (
            |e| e.command("@0A900").once(),
            Reason::Missing,
            "expected command @0A900, once\n  but it never came\n  closest: at 6.134611 s, \
             @0A400,900,0,900,0,900,0,900 does not begin with @0A900",
        ),
        (
            |e| e.command("@n").once(),
            Reason::Missing,
            "expected command @n, once\n  but it never came\n  closest: none; the commands that came \
             are ?, @A (twice), @B, @M, @P, @R, @axes",
        ),
        (
            |e| e.command("@A").once(),
            Reason::TooOften,
            "expected command @A, once\n  but it came a second time at 6.134611 s",
        ),
        (
            |e| e.command("@A").never(),
            Reason::TooOften,
            "expected command @A, never\n  but it came at 5.011500 s",
        ),
        (
            |e| e.command("@P").once().then().command("@A").once(),
            Reason::Missing,
            "expected command @P, once; then command @A, once\n  but `command @A` never came, and \
             should have come once\n  closest: at 6.134611 s, @0A400,900,0,900,0,900,0,900 came \
             before its turn",
        ),
        (
            |e| e.command("@P").once().then().when("z < 0").once(),
            Reason::Missing,
            "expected command @P, once; then z < 0, once\n  but `z < 0` never came, and should have \
             come once\n  closest: it was so at 6.021885 s, before its turn",
        ),
        (
            |e| e.command("@A").times(2).and().command("@P").times(2),
            Reason::Missing,
            "expected command @A, twice, and command @P, twice\n  but `command @P` came once, and \
             should have come twice",
        ),
        (
            |e| e.command("@A").at_most(1).and().command("@P").at_least(1),
            Reason::TooOften,
            "expected command @A, at most once, and command @P, at least once\n  but `command @A` came \
             a second time at 6.134611 s",
        ),
        (
            |e| e.command("@A").at_least(1).then_within(ms(100)).command("@P").times(2),
            Reason::TooLate,
            "expected command @A, at least once; then command @P, twice, within 100 ms\n  but \
             `command @P` had not come by 5.111500 s, and should have come twice\n  closest: none; \
             the commands that came are @A, @R, @axes",
        ),
        (
            |e| e.command("@A").at_least(1).then_after(ms(9_000)).command("@P").once(),
            Reason::TooEarly,
            "expected command @A, at least once; then command @P, once, no sooner than after 9 s\n  \
             but `command @P` came at 6.583055 s, after 1.6 s",
        ),
        (
            |e| e.never("z < -0.5mm and x > 11mm"),
            Reason::TooOften,
            "expected z < -50 and x > 880, never\n  but it came at 6.078166 s",
        ),
        (
            |e| e.when("x = 400").times(2),
            Reason::Missing,
            "expected x = 400, twice\n  but it came once",
        ),
        (
            |e| e.when("z < -5mm").once(),
            Reason::Missing,
            "expected z < -500, once\n  but it never came\n  closest: Z came to -100 (-1 mm), 401 \
             steps short of it",
        ),
        (
            |e| e.when("z < -1mm and x < 0").once(),
            Reason::Missing,
            "expected z < -100 and x < 0, once\n  but it never came\n  closest: Z came to -100 (-1 \
             mm), 1 step short of it\n  closest: `x < 0` was so first at 3.008166 s, but not with \
             the rest",
        ),
        (
            |e| e.when("port 2 bit 3 on or signal cover is open").once(),
            Reason::Missing,
            "expected port 2 bit 3 on or signal cover is open, once\n  but it never came\n  closest: \
             port 2 is 1 since 6.134611 s\n  closest: cover is closed all the time",
        ),
        (
            |e| e.when("answer error 2").once(),
            Reason::Missing,
            "expected answer error 2, once\n  but it never came\n  closest: the last answer was \
             0000514000000FFFF9C at 6.583055 s",
        ),
        (
            |e| e.whenever("z < -0.5mm").must_have_been("port 2 bit 0 on").for_at_least(ms(500)),
            Reason::NotHeld,
            "expected whenever z < -50: port 2 bit 0 on for at least 500 ms\n  but it was not so at \
             6.078166 s",
        ),
        (
            |e| e.whenever("x > 1000").must_have_been("port 2 bit 0 on").for_at_least(ms(500)),
            Reason::NotHeld,
            "expected whenever x > 1000: port 2 bit 0 on for at least 500 ms\n  but at 6.248833 s it \
             had been so for 114 ms only",
        ),
        (
            |e| e.whenever("command @M").must_follow("answer 0").within(ms(3)),
            Reason::NotFollowed,
            "expected whenever command @M: answer 0 within 3 ms\n  but what happened at 5.904388 s \
             was not followed by it in time",
        ),
        (
            |e| e.whenever("command ?").must_follow_command("@n").within(ms(3_000)),
            Reason::NotFollowed,
            "expected whenever command ?: command @n within 3 s\n  but what happened at 6.134611 s \
             was not followed by it before the end, 448 ms later\n  closest: none; the commands that \
             came are ?, @A (twice), @B, @M, @P, @R, @axes",
        ),
        (
            |e| e.whenever("command @n").must_be("z = 0"),
            Reason::NeverCame,
            "expected whenever command @n: z = 0\n  but it never came to that, so nothing is known; \
             say `if_at_all()` if that is right, too\n  closest: none; the commands that came are ?, \
             @A (twice), @B, @M, @P, @R, @axes",
        ),
    ];
    for (said, reason, text) in told {
        let failure = failure(said(emu.expect()).so_far());
        assert_eq!(failure.reason, reason, "{failure}");
        let (words, around) = failure
            .to_string()
            .split_once("\n  what happened around it:\n")
            .map(|(words, around)| (words.to_owned(), around.to_owned()))
            .unwrap();
        assert_eq!(words, text);
        assert!(around.lines().count() >= 4, "{failure}");
    }
}

#[test]
fn what_happened_around_it_is_told_as_in_the_log() {
    let (emu, _port) = after_session();
    let failure = failure(emu.expect().command("@B").never().so_far());
    assert_eq!(
        failure.around,
        [
            "       5.904388 s          halts",
            "       5.904388 s  0  after 893 ms",
            "       5.904388 s  @0M900,900,0,900,-100,900,0,900  absolute move X to 900 at 900 Hz, Y \
             to 0 at 900 Hz, Z to -100 at 900 Hz",
            "       5.904388 s          moves X from 800 to 900",
            "       6.019500 s          halts",
            "       6.019500 s          moves Z from 0 to -100",
            "       6.134611 s          halts",
            "       6.134611 s  0  after 230 ms",
            ">      6.134611 s  @0B2,1  write 1 to port 2",
            "       6.134611 s          port 2 is 1",
            "       6.134611 s  0  at once",
            "       6.134611 s  @0X  unknown or malformed command",
            "       6.134611 s  5  at once: @0X: no command begins like this",
            "       6.134611 s  @0A400,900,0,900,0,900,0,900  relative move X +400 steps at 900 Hz, Y \
             0 steps at 900 Hz, Z 0 steps at 900 Hz",
        ]
    );
    // As a test prints it that ends with it.
    assert_eq!(format!("{failure:?}"), format!("\n{failure}\n"));
    // As data.
    let text = serde_json::to_string(&failure).unwrap();
    assert_eq!(serde_json::from_str::<Failure>(&text).unwrap(), *failure);
}

#[test]
fn what_is_met_is_met() {
    let (emu, _port) = after_session();
    emu.expect().command("@A").answered("0").times(2).so_far().unwrap();
    emu.expect().command("?").refused_with("5").once().so_far().unwrap();
    emu.expect().command("@A").once().then().command("@A").once().so_far().unwrap();
    emu.expect().command("@P").once().and().command("@A").at_least(2).so_far().unwrap();
    emu.expect()
        .command("@A")
        .once()
        .then()
        .command("@R")
        .never()
        .then()
        .when("z < -0.5mm")
        .once()
        .so_far()
        .unwrap();
    emu.expect().never("outside x -4001..16.25mm").so_far().unwrap();
    emu.expect().never(Condition::AxisAbove { axis: 1, position: 0 }).so_far().unwrap();
    emu.expect()
        .whenever("x > 1200")
        .must_have_been("port 2 bit 0 on")
        .for_at_least(ms(200))
        .so_far()
        .unwrap();
    emu.expect().whenever("command").must_follow("answer").within(ms(6_000)).so_far().unwrap_err();
    emu.expect().whenever("command").must_follow("answered").within(ms(6_000)).so_far().unwrap();
    emu.expect().whenever("command @n").must_be("z = 0").if_at_all().so_far().unwrap();
    // What stays so from the beginning becomes so once.
    emu.expect().when("port 2 bit 7 off").once().so_far().unwrap();
    emu.expect()
        .command("@A")
        .at_least(1)
        .then_after(ms(1_000))
        .command("@P")
        .once()
        .so_far()
        .unwrap();
    emu.expect()
        .command("@A")
        .at_least(1)
        .then_within(ms(2_000))
        .command("@P")
        .once()
        .so_far()
        .unwrap();
}

#[test]
fn a_switch_that_a_motion_runs_onto_can_be_expected() {
    let (emu, mut port) = after_session();
    // The reference run has pressed it and left it.
    emu.expect().when("limit x-").once().so_far().unwrap();
    emu.expect().never("limit x+").so_far().unwrap();
    send(&mut port, "@0A30000,3000,0,900,0,900,0,900\r");
    emu.run_until_idle().unwrap();
    emu.expect().when("limit x+").once().so_far().unwrap();
    let failed = failure(emu.expect().never("limit x+").so_far());
    assert_eq!(failed.reason, Reason::TooOften, "{failed}");
}

#[test]
fn what_could_never_be_met_says_so_at_once() {
    type Said = fn(Expect<Live>) -> Sentence<Live>;
    let emu = manual().start().unwrap();
    let told: [(Said, &str); 17] = [
        (
            |e| e.command("@Q").once(),
            "`command @Q` is wrong at `@Q`: what a command begins with: @axes,",
        ),
        (|e| e.never("b < 3"), "`b < 3` is wrong: a condition, such as"),
        (
            |e| e.never("x < 5km"),
            "`x < 5km` is wrong at `5km`: a position in steps or mm, as in `x < -5000` or `x < -12.5mm`",
        ),
        (
            |e| e.never("a < 5mm"),
            "`a < 5mm` is wrong at `5mm`: a position in steps or °, as in `a < -5000` or `a < -12.5°`",
        ),
        (
            |e| e.never("x = 0.001mm"),
            "`x = 0.001mm` is wrong at `0.001mm`: a position at which there is a step: 0 and 1 steps \
             are around it",
        ),
        (|e| e.never("x < 0 and x > 3"), "`x < 0 and x > 3` is never so: no place is both"),
        (
            |e| e.never("command @A and answer 0"),
            "`command @A and answer 0` is never so: these happen one after the other, each in a moment \
             of its own; say `answered` of a command, or `then`",
        ),
        (
            |e| e.when("idle").once(),
            "`idle` is not followed; expect the answer of the last command, or the end of a motion",
        ),
        (
            |e| e.when("x < 0").at_least(0),
            "`x < 0` at least 0 times is always so; say at least once, at most so many times, or never",
        ),
        (
            |e| e.command("@A").refused_with("Z").once(),
            "`answer error Z` is wrong at `Z`: an error of",
        ),
        (
            |e| e.never("port 0 bit 7 on"),
            "port 0 bit 7 is neither an output nor a user input; name the signal behind it, as in \
             `signal NAME is 1`",
        ),
        (
            |e| e.whenever("x < 0").must_be("command @A"),
            "`command @A` happens in one moment and lasts no time; say `must_follow` for what comes \
             after, or name a state",
        ),
        (
            |e| e.when("x < 0").once().if_at_all(),
            "`if_at_all` is for `whenever`; of anything else say `at_most(n)`",
        ),
        (
            |e| e.whenever("x < 0").must_be("z = 0").then().command("@A").once(),
            "a sentence with `whenever` is whole; begin another one for what else is expected",
        ),
        (
            |e| e.command("@A").once().then().whenever("x < 0").must_be("z = 0"),
            "a sentence with `whenever` has nothing before it; begin another one for what else is \
             expected",
        ),
        (
            |e| e.never(Condition::AxisBelow { axis: 5, position: 0 }),
            "there is no axis 5 (0 for X); axes are x, y, z, a",
        ),
        (|e| e.never("never"), "`never` is never so"),
    ];
    for (said, text) in told {
        let outcomes = [said(emu.expect()).so_far(), said(emu.expect()).watch().map(|_| ())];
        for outcome in outcomes {
            match outcome {
                Err(Error::Mistake(mistake)) => {
                    let mistake = mistake.to_string();
                    let why = mistake.strip_prefix("this cannot be expected: ").unwrap();
                    assert!(why.starts_with(text), "{why}");
                }
                other => panic!("{other:?}"),
            }
        }
    }
}

#[test]
fn it_fails_at_once_and_at_the_exact_instant() {
    let emu = manual().start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@07\r@0A800,300,0,300,0,300,0,300\r");
    let (sender, told) = mpsc::channel();
    let watched = emu.expect().never("x > 5mm").watch().unwrap();
    let watched = watched.or_tell(move |failure| sender.send(failure.at).unwrap());
    let at = emu.run_until(&Condition::AxisAt { axis: 0, position: 400 }).unwrap();
    assert!(watched.failure().is_none() && told.try_recv().is_err());
    // A step further.
    emu.advance(ms(10)).unwrap();
    let failed = told.try_recv().unwrap();
    assert_eq!(watched.failure().unwrap().at, failed);
    assert!(failed > at && failed < at + ms(4), "{failed}");
    assert_eq!(failure(watched.check()).at, failed);
}

#[test]
fn a_deadline_that_passes_fails_at_once() {
    let emu = manual().start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@07\r");
    let rule = emu.expect().whenever("command @A").must_follow("answered @A").within(ms(50));
    let rule = rule.watch().unwrap();
    send(&mut port, "@0A800,900,0,900,0,900,0,900\r");
    emu.advance(ms(50)).unwrap();
    assert!(rule.failure().is_none(), "what comes at the deadline is in time");
    emu.advance(Duration::from_nanos(1)).unwrap();
    assert_eq!(rule.failure().unwrap().reason, Reason::NotFollowed);
    failure(rule.check());
}

/// Time that passes by itself when something is due does not pass because somebody watches.
#[test]
fn who_watches_moves_no_time() {
    let emu = Emulator::builder().time(Clock::Instant).start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@07\r");
    let rule = emu.expect().whenever("command @P").must_follow("command @V").within(ms(50));
    let rule = rule.watch().unwrap();
    send(&mut port, "@0P\r");
    let mut answers = [0; 20];
    port.read_exact(&mut answers).unwrap();
    assert_eq!(emu.now().unwrap(), Time::ZERO);
    assert_eq!(failure(rule.check()).at, Time::ZERO);
}

#[test]
fn a_clock_that_runs_tells_of_it_in_time() {
    let emu = Emulator::builder().start().unwrap();
    let mut port = emu.connect().unwrap();
    let rule = emu.expect().whenever("command @P").must_follow("command @V").within(ms(20));
    let rule = rule.watch().unwrap();
    let met = emu.expect().command("@P").at_least(1).watch().unwrap();
    let (sender, told) = mpsc::channel();
    let rule = rule.or_tell(move |failure| sender.send(failure.reason).unwrap());
    send(&mut port, "@07\r@0P\r");
    met.wait_until_met(Duration::from_secs(30)).unwrap();
    met.check().unwrap();
    // Nobody sends anything any more: the deadline alone wakes it.
    assert_eq!(told.recv_timeout(Duration::from_secs(30)).unwrap(), Reason::NotFollowed);
    failure(rule.wait_until_met(Duration::from_secs(30)));
    failure(rule.check());
}

#[test]
fn who_waits_for_nothing_is_told_when_the_emulator_stops() {
    let emu = Emulator::builder().time(Clock::Manual).start().unwrap();
    let mut port = emu.connect().unwrap();
    let watched = emu.expect().command("@V").never().watch().unwrap().or_stop();
    send(&mut port, "@07\r@0V\r");
    // It may have ended before it could say so.
    let _ = emu.now();
    let mut answers = Vec::new();
    let end = port.read_to_end(&mut answers);
    assert!(end.is_ok() || end.is_err_and(|error| error.kind() != ErrorKind::TimedOut));
    assert_eq!(failure(watched.check()).reason, Reason::TooOften);
}

#[test]
fn the_recording_ends_where_it_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.jsonl");
    let emu = manual().record(path.as_path()).start().unwrap();
    let mut port = emu.connect().unwrap();
    let watched = emu.expect().never("x > 5mm").watch().unwrap();
    send(&mut port, "@07\r@0A800,900,0,900,0,900,0,900\r");
    emu.run_until_idle().unwrap();
    send(&mut port, "@0P\r");
    emu.run_until_idle().unwrap();
    let failed = failure(watched.check()).at;
    drop(emu);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("@0A800") && !text.contains("@0P"), "{text}");
    let lines: Vec<&str> = text.lines().rev().collect();
    let at = format!("{{\"at\":{},", failed.as_nanos());
    assert_eq!(lines[0], format!("{at}\"end\":\"an expectation was not met\"}}"));
    let mark = format!("{at}\"mark\":\"expected x > 400, never, but it came at ");
    assert!(lines[1].starts_with(&mark), "{}", lines[1]);
    assert!(lines[2].starts_with(&format!("{at}\"state\":")));
}

/// What a panic says.
fn panic_of(run: impl FnOnce()) -> String {
    let panic = catch_unwind(AssertUnwindSafe(run)).unwrap_err();
    panic.downcast_ref::<String>().cloned().unwrap_or_default()
}

#[test]
fn an_expectation_that_nobody_checks_fails_the_test() {
    let (emu, _port) = after_session();
    let said = panic_of(|| drop(emu.expect().command("@A").once().watch().unwrap()));
    assert!(said.starts_with("an expectation was never checked: command @A, once\n"), "{said}");
    assert!(
        said.contains("call check() on what watch() returns; expected command @A, once"),
        "{said}"
    );
    let said = panic_of(|| drop(emu.expect().command("@A").never().watch().unwrap()));
    assert!(
        said.ends_with("it was met, but a test that does not look passes without it, too"),
        "{said}"
    );
    // A test that fails already says what has failed first.
    let said = panic_of(|| {
        let _watched = emu.expect().command("@A").once().watch().unwrap();
        panic!("{}", "the driver gave up");
    });
    assert_eq!(said, "the driver gave up");
    // What is not wanted any more is given up in so many words.
    emu.expect().command("@A").once().watch().unwrap().give_up();
    // Nor does it matter that the emulator is gone.
    let watched = emu.expect().command("@A").never().watch().unwrap();
    drop(emu);
    watched.check().unwrap();
}

#[test]
fn without_a_record_it_is_watched_all_the_same() {
    let emu = manual().record(false).start().unwrap();
    let mut port = emu.connect().unwrap();
    let watched = emu.expect().command("@P").once().watch().unwrap();
    send(&mut port, "@0P\r");
    watched.check().unwrap();
    let error = emu.expect().command("@P").once().so_far().unwrap_err().to_string();
    assert_eq!(
        error,
        "nothing is remembered; do without Builder::record(false), or watch from the beginning"
    );
    assert_eq!(emu.journal().unwrap().entries().count(), 0);
}

#[test]
fn the_journal_ties_everything_to_its_command() {
    let (emu, _port) = after_session();
    emu.press(Button::Stop).unwrap();
    let (journal, names) = (emu.journal().unwrap(), emu.names().unwrap());
    let commands = emu.commands().unwrap();
    let second = commands[3].number.unwrap();
    let of: Vec<String> = journal
        .json_lines(&names)
        .lines()
        .filter(|line| line.contains(&format!("\"command\":{second},")))
        .map(|line| {
            line.split("\"event\":\"").nth(1).unwrap().split('"').next().unwrap().to_owned()
        })
        .collect();
    assert_eq!(of, ["command", "moves", "halts", "moves", "halts", "answer"]);
    assert_eq!(journal.of(second).count(), of.len());
    let moves = journal.moves();
    let last = moves.last().unwrap();
    assert_eq!((last.from[0], last.to[0], last.low[0], last.high[0]), (900, 1_300, 900, 1_300));
    let story = journal.story(&names);
    assert!(story.iter().any(|line| line.ends_with("  the library: press stop")), "{story:#?}");
    assert_eq!(journal.dropped(), 0);
    // Positions by name, with the box of the motion.
    let halts = journal.json_lines(&names);
    let halts = halts.lines().rfind(|line| line.contains("\"halts\"")).unwrap();
    assert!(halts.contains(r#""high":{"X":1300},"low":{"X":900}"#), "{halts}");
    // Where a run to a switch will end is not known before.
    let text = journal.json_lines(&names);
    let run = text.lines().find(|line| line.contains("\"moves\"")).unwrap();
    assert!(run.contains(r#""from":{"Z":0}"#) && !run.contains("\"to\""), "{run}");
    emu.forget().unwrap();
    assert_eq!(emu.journal().unwrap().entries().count(), 0);
    emu.expect().when("x = 1300").once().so_far().unwrap();
}

/// An LPKF controller answers in another language, and is expected in the same.
#[test]
fn other_families_are_expected_in_the_same_words() {
    let emu = Emulator::builder().model("smcu").time(Clock::Manual).start().unwrap();
    let mut port = emu.connect().unwrap();
    let said = emu.expect().command("PR").once().then().when("x = 5").once().watch().unwrap();
    send(&mut port, "PR5,0;");
    emu.run_until_idle().unwrap();
    said.check().unwrap();
    let failure = failure(emu.expect().command("PA").once().so_far());
    assert_eq!(failure.closest, ["none; the commands that came are PR"]);
}

/// What makes a condition true is looked at, whatever kind of event it is.
#[test]
fn ports_inputs_and_signals_are_counted_as_they_change() {
    type Said = fn(Expect<Live>) -> Sentence<Live>;
    let emu = manual().start().unwrap();
    let mut port = emu.connect().unwrap();
    let sentences: [Said; 6] = [
        |e| e.when("port 2 bit 0 on").times(2),
        |e| e.when("port 0 bit 2 on").times(3),
        |e| e.when("signal cover is open").times(1),
        |e| e.when("signal cover is open and port 2 bit 0 on").times(2),
        |e| e.when("signal cover changes").times(2),
        |e| e.when("command @B and signal cover is open").times(3),
    ];
    let watched: Vec<_> =
        sentences.iter().map(|said| said(emu.expect()).watch().unwrap()).collect();
    send(&mut port, "@07\r");
    emu.run_until_idle().unwrap();
    // Outputs are switched behind an open cover only with the key on test.
    emu.turn("key", "test").unwrap();
    emu.turn("cover", "open").unwrap();
    for value in ["1", "0", "1"] {
        send(&mut port, &format!("@0B2,{value}\r"));
        emu.run_until_idle().unwrap();
    }
    for level in [true, false, true, false, true] {
        emu.input(0, 2, level).unwrap();
    }
    emu.turn("cover", "closed").unwrap();
    for watched in watched {
        watched.check().unwrap();
    }
    for said in sentences {
        said(emu.expect()).so_far().unwrap();
    }
}
