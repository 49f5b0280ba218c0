//! Time on its way can be watched, held up and given up.

use std::io::{Read, Write};
use std::time::Duration;

use vimc4_device::{Condition, OwnedInput, Time};
use vimc4_host::{Clock, ControlError, Progress, ReportKind, TimeAdvance, block_on};

use crate::fake::{Diary, Fake, Running, numbered};

/// Much longer than any test: the fake ticks a thousand times a second.
const FAR: Duration = Duration::from_secs(1_000_000_000);

/// Waits until it has come so far.
fn come_to(journey: &mut TimeAdvance, so_far: impl Fn(Progress) -> bool) -> Progress {
    let mut progress = journey.progress();
    while !so_far(progress) {
        progress = block_on(Box::pin(journey.next_progress())).unwrap();
    }
    progress
}

fn at(position: i64) -> Condition {
    Condition::AxisAt { axis: 0, position }
}

#[test]
fn a_long_way_is_paused_and_gone_on_with() {
    for clock in [Clock::Manual, Clock::Instant] {
        let diary = Diary::default();
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        let handle = &running.handle;
        handle.watch(diary.clone()).wait().unwrap();

        port.write_all(b"l\rl\r").unwrap();
        let mut journey = handle.by("a person").advance(FAR);
        let began = come_to(&mut journey, |progress| progress.to.is_some());
        come_to(&mut journey, |progress| progress.now > began.now);
        journey.pause().unwrap();
        let held = come_to(&mut journey, |progress| progress.paused);
        // Time stands still, and everything else works.
        assert_eq!(handle.now().wait(), Ok(held.now));
        port.write_all(b"t\r").unwrap();
        handle.press("start").wait().unwrap();
        assert_eq!(handle.now().wait(), Ok(held.now));
        assert_eq!(String::from_utf8(port.drain()).unwrap(), format!("00{}.", held.now.as_nanos()));
        let other = handle.advance(Duration::from_secs(1)).wait();
        assert!(matches!(other, Err(ControlError::Unsupported(_))), "{other:?}");

        journey.resume().unwrap();
        come_to(&mut journey, |progress| !progress.paused && progress.now > held.now);
        journey.cancel();
        // What is given up is not taken up again.
        journey.resume().unwrap();
        let Err(ControlError::Cancelled { at }) = journey.wait() else {
            panic!("it was given up");
        };
        assert!(at > held.now);
        // As far as time has come, who has sent it there is told.
        let told = diary.all(|report| match &report.what {
            ReportKind::Input { by, input: OwnedInput::Wake } => Some((report.at, by.to_string())),
            _ => None,
        });
        assert_eq!(told, [(at, "a person".to_owned())]);
        if clock == Clock::Manual {
            assert_eq!(handle.now().wait(), Ok(at));
        }
        running.end().unwrap();
    }
}

#[test]
fn a_forecast_is_given_up_and_time_has_not_moved() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    port.write_all(b"l\r").unwrap();
    let mut journey = running.handle.run_until(at(5));
    come_to(&mut journey, |progress| progress.to.is_none());
    journey.cancel();
    let end = journey.wait();
    // On a computer that forgets the test for a while it has been seen to be in vain by itself.
    let given_up = Err(ControlError::Cancelled { at: Time::ZERO });
    let in_vain = |end| matches!(end, Err(ControlError::Unforeseen { .. }));
    assert!(end == given_up || in_vain(end.clone()), "{end:?}");
    // It can be given up before it begins.
    let (go, wait) = std::sync::mpsc::channel();
    let held = running.handle.with(move |_| {
        wait.recv().unwrap();
        Ok(())
    });
    let journey = running.handle.run_until(at(5));
    journey.cancel();
    go.send(()).unwrap();
    held.wait().unwrap();
    assert_eq!(journey.wait(), given_up);
    assert_eq!(running.handle.now().wait(), Ok(Time::ZERO));
    // One that is not given up comes to the same end as ever.
    assert!(in_vain(running.handle.run_until(at(5)).wait()));
    assert_eq!(running.handle.now().wait(), Ok(Time::ZERO));
    running.end().unwrap();
}

#[test]
fn what_happens_in_a_pause_is_heeded() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    let rest = handle.state().wait().unwrap();
    port.write_all(b"l\rw3600000\r").unwrap();
    let mut journey = handle.advance(FAR);
    journey.pause().unwrap();
    come_to(&mut journey, |progress| progress.paused);
    let now = handle.now().wait().unwrap();
    // Where it goes belongs to another time.
    handle.restore(rest).wait().unwrap();
    assert_eq!(journey.wait(), Err(ControlError::Cancelled { at: now }));

    // A condition is forecast anew after a pause.
    port.write_all(b"l\rw3600000\r").unwrap();
    let journey = handle.run_until(at(30_000));
    journey.pause().unwrap();
    journey.resume().unwrap();
    assert_eq!(journey.wait(), Ok(Time::from_secs(30)));
    running.end().unwrap();
}

/// A way that takes longer than anybody waits for what is asked on it.
const LIMIT: Duration = Duration::from_secs(120);

#[test]
fn a_way_without_an_end_leaves_nobody_unheard() {
    for clock in [Clock::Manual, Clock::Instant] {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        let handle = &running.handle;
        port.write_all(b"l\r").unwrap();
        let way = handle.advance(FAR);
        let (second, third) = (handle.advance(Duration::from_secs(1)), handle.advance(FAR));
        // A control and the line are heard, at a time on the way.
        assert!(handle.press("start").wait_within(LIMIT).is_ok());
        let now = handle.now().wait_within(LIMIT).unwrap();
        assert!(now > Time::ZERO && way.progress().to.is_some_and(|to| to > now));
        port.write_all(b"ehere\r").unwrap();
        let mut answer = [0; 5];
        port.read_exact(&mut answer).unwrap();
        assert_eq!(answer, *b"0here");
        // What waits to begin can be given up before, and what waits behind it begins later.
        third.cancel();
        let end = third.wait_within(LIMIT);
        assert!(matches!(end, Err(ControlError::Cancelled { .. })), "{end:?}");
        // What does not need anything from outside goes on.
        handle.cancel_all_unless_by_itself();
        way.cancel();
        let Err(ControlError::Cancelled { at }) = way.wait_within(LIMIT) else {
            panic!("it was given up");
        };
        let next = second.wait_within(LIMIT).unwrap();
        assert!(next >= at + Duration::from_secs(1));
        running.end().unwrap();
    }
}

#[test]
fn what_arrives_while_a_condition_is_forecast_changes_what_it_will_be() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    port.write_all(b"l\r").unwrap();
    // Time stands still as long as it is not known where it goes.
    let journey = handle.run_until(at(3_000));
    handle.press("start").wait_within(LIMIT).unwrap();
    port.write_all(b"w5000\r").unwrap();
    // On a computer that is so fast that all was in vain before, it was not too late.
    match journey.wait_within(LIMIT) {
        Ok(at) => assert_eq!(at, Time::from_secs(3)),
        Err(in_vain) => assert!(matches!(in_vain, ControlError::Unforeseen { .. }), "{in_vain}"),
    }
    running.end().unwrap();
}

#[test]
fn what_is_ordered_behind_a_short_way_comes_behind_it() {
    for clock in [Clock::Manual, Clock::Instant] {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        port.write_all(b"l\r").unwrap();
        let (from, way) = (running.handle.now(), running.handle.advance(Duration::from_secs(90)));
        let to = running.handle.now();
        let (from, at) = (from.wait().unwrap(), way.wait().unwrap());
        assert!(at >= from + Duration::from_secs(90) && to.wait().unwrap() >= at);
        running.end().unwrap();
    }
}

#[test]
fn time_that_moves_by_itself_cannot_be_held_up_but_need_not_be_waited_for() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    port.write_all(b"w3600000\r").unwrap();
    let journey = running.handle.run_until(at(3_000_000));
    assert_eq!(journey.pause(), Err(ControlError::RunsByItself));
    assert_eq!(journey.resume(), Err(ControlError::RunsByItself));
    let other = running.handle.run_until(at(20));
    journey.cancel();
    let end = journey.wait();
    assert!(matches!(end, Err(ControlError::Cancelled { .. })), "{end:?}");
    assert!(other.wait().is_ok());
    running.end().unwrap();
}

#[test]
fn what_takes_something_from_outside_is_given_up_and_what_comes_by_itself_is_not() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    let until = |text: &str| running.handle.run_until(numbered(text));
    let given_up = |journey: TimeAdvance| {
        let end = journey.wait_within(LIMIT);
        assert!(matches!(end, Err(ControlError::Cancelled { .. })), "{end:?}");
    };
    let outside = until("command e9");
    running.handle.cancel_all_unless_by_itself();
    given_up(outside);

    port.write_all(b"w300\re1\r").unwrap();
    let (comes, idle) = (until("command e1"), until("idle"));
    let (never, later) = (until("command e2"), until("command e1 and axis0 = 300"));
    running.handle.cancel_all_unless_by_itself();
    given_up(never);
    let at = comes.wait_within(LIMIT).unwrap();
    assert_eq!((idle.wait_within(LIMIT), later.wait_within(LIMIT)), (Ok(at), Ok(at)));

    // An endless program may go on for ever; what it has not done in 10,000 causes is given up.
    port.write_all(b"l\r").unwrap();
    let (near, far) = (until("at 1000000h"), until("command e9"));
    running.handle.cancel_all_unless_by_itself();
    given_up(near);
    given_up(far);
    running.end().unwrap();
}

#[test]
fn what_would_have_come_by_itself_is_given_up_when_it_cannot_come_any_more() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    let rest = running.handle.state().wait().unwrap();
    port.write_all(b"w3600000\re1\r").unwrap();
    let comes = running.handle.run_until(numbered("command e1"));
    running.handle.cancel_all_unless_by_itself();
    running.handle.restore(rest).wait().unwrap();
    assert_eq!(comes.wait_within(LIMIT), Err(ControlError::Never));
    running.end().unwrap();
}

#[test]
fn all_that_was_asked_for_is_given_up_and_nothing_that_is_asked_for_later() {
    for clock in [Clock::Manual, Clock::Real] {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        let handle = &running.handle;
        port.write_all(b"w3600000\r").unwrap();
        // The second has not even been looked at.
        let journeys = [handle.run_until(at(3_600_001)), handle.run_until(at(3_000_000))];
        handle.cancel_all();
        for journey in journeys {
            let end = journey.wait_within(LIMIT);
            let never = end == Err(ControlError::Never);
            assert!(never || matches!(end, Err(ControlError::Cancelled { .. })), "{end:?}");
        }
        // On a busy machine this moment is over in real time.
        let end = handle.run_until(at(5)).wait_within(LIMIT);
        assert!(matches!(end, Ok(_) | Err(ControlError::Never)), "{end:?}");
        running.end().unwrap();
    }
}
