//! What goes in is told with the one time it was handled at, and can be written down, read and
//! given again.

use std::io::Write;
use std::time::Duration;

use vimc4_device::{Device, Event, Harness, Output, OwnedInput, SignalId, Time, TimedInput};
use vimc4_host::{Clock, EventFilter, Handle, LineEvent, Report, ReportKind, Reports, Source};

use crate::fake::{Diary, Fake, Running};

/// What a device does that gets what was told: what it says, and itself.
fn replay(reports: &[Report]) -> (Vec<(Time, u8)>, Fake) {
    let mut harness = Harness::new(Fake::new(b""));
    for report in reports {
        match &report.what {
            ReportKind::State { state, .. } => {
                harness.run_to(report.at);
                harness.restore(serde_json::from_value(state.clone()).unwrap());
            }
            ReportKind::Input { input, .. } => {
                harness.play(&TimedInput { at: report.at, input: input.clone() });
            }
            _ => {}
        }
    }
    let said = harness.drain().collect::<Vec<_>>().into_iter().flat_map(|output| match output {
        Output::Bytes(at, bytes) => bytes.into_iter().map(|byte| (at, byte)).collect(),
        _ => Vec::new(),
    });
    (said.collect(), harness.into_device())
}

fn inputs(reports: &[Report]) -> Vec<(Time, String, OwnedInput)> {
    let told = reports.iter().filter_map(|report| match &report.what {
        ReportKind::Input { by, input } => Some((report.at, by.to_string(), input.clone())),
        _ => None,
    });
    told.collect()
}

#[test]
fn everything_that_goes_in_is_told_and_can_be_given_again() {
    let diary = Diary::default();
    let told = diary.clone();
    let (running, mut port) = Running::start(Fake::new(b""), Clock::Manual, |mut runner| {
        let (memory, port) = vimc4_host::Memory::pair();
        runner.attach(Box::new(memory));
        let mut runner = runner.named("left");
        runner.watch(Box::new(told));
        (runner, port)
    });
    let person = running.handle.by("a person");
    port.write_all(b"w50\r").unwrap();
    person.advance(Duration::from_millis(20)).wait().unwrap();
    person.press("start").wait().unwrap();
    let state = person.state().wait().unwrap();
    port.write_all(b"es\xFDx\r").unwrap();
    person.run_until(vimc4_device::Condition::Idle).wait().unwrap();
    running.handle.restore(state).wait().unwrap();
    person.power(false).wait().unwrap();
    port.write_all(b"lost").unwrap();
    person.advance(Duration::from_millis(7)).wait().unwrap();
    let end = person.state().wait().unwrap();

    let reports = diary.0.lock().unwrap().clone();
    let ms = Time::from_millis;
    let bytes = |bytes: &'static [u8]| OwnedInput::Bytes(bytes.into());
    let start = |value| OwnedInput::Signal(SignalId(0), value);
    let expected = [
        (ms(0), "memory", bytes(b"w50\r")),
        (ms(20), "a person", OwnedInput::Wake),
        (ms(20), "a person", start(1)),
        (ms(20), "a person", start(0)),
        (ms(20), "memory", bytes(b"es")),
        (ms(20), "memory", bytes(b"\xFD")),
        (ms(20), "memory", bytes(b"x\r")),
        (ms(50), "a person", OwnedInput::Wake),
        (ms(20), "a person", OwnedInput::Power(false)),
        (ms(20), "memory", bytes(b"lost")),
        (ms(27), "a person", OwnedInput::Wake),
    ];
    let expected = expected.map(|(at, by, input)| (at, by.to_owned(), input));
    assert_eq!(inputs(&reports), expected);
    assert!(reports.iter().all(|report| &*report.controller == "left"));

    // Written down and read, and given to another device.
    let written: Vec<String> =
        reports.iter().map(|report| serde_json::to_string(report).unwrap()).collect();
    let read: Vec<Report> =
        written.iter().map(|report| serde_json::from_str(report).unwrap()).collect();
    assert_eq!(read, reports);
    let said: Vec<_> = reports
        .iter()
        .flat_map(|report| match &report.what {
            ReportKind::Sent { bytes } => bytes.iter().map(|byte| (report.at, *byte)).collect(),
            _ => Vec::new(),
        })
        .collect();
    let (replayed, fake) = replay(&read);
    assert_eq!(said, [(ms(50), b'0'), (ms(50), b's'), (ms(50), b'\xFD'), (ms(50), b'x')]);
    assert_eq!((replayed, fake.state()), (said, end));
    running.end().unwrap();
}

#[test]
fn what_came_while_the_power_was_off_is_told() {
    let lost = |diary: &Diary| {
        diary.all(|report| match report.news() {
            Some(LineEvent::PowerWasOff { bytes }) => Some((report.at, *bytes)),
            _ => None,
        })
    };
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    let diary = Diary::default();
    handle.watch(diary.clone()).wait().unwrap();
    for on in [true, false, true] {
        handle.power(on).wait().unwrap();
    }
    assert_eq!(lost(&diary), []);
    handle.power(false).wait().unwrap();
    port.write_all(b"et\r").unwrap();
    handle.advance(Duration::from_millis(3)).wait().unwrap();
    port.write_all(b"et\r").unwrap();
    handle.power(false).wait().unwrap();
    assert_eq!(lost(&diary), []);
    handle.power(true).wait().unwrap();
    assert_eq!(lost(&diary), [(Time::from_millis(3), 6)]);
    // At the end too, and when somebody goes back to a time before.
    let state = handle.state().wait().unwrap();
    handle.power(false).wait().unwrap();
    port.write_all(b"e").unwrap();
    handle.restore(state).wait().unwrap();
    handle.power(false).wait().unwrap();
    port.write_all(b"ab").unwrap();
    handle.now().wait().unwrap();
    running.end().unwrap();
    assert_eq!(lost(&diary).into_iter().map(|(_, bytes)| bytes).collect::<Vec<_>>(), [6, 1, 2]);
}

#[test]
fn one_that_is_detached_hears_nothing_more() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let diary = Diary::default();
    let id = running.handle.watch(diary.clone()).wait().unwrap();
    let other = running.handle.watch(Diary::default()).wait().unwrap();
    port.write_all(b"ea\r").unwrap();
    assert_eq!(running.handle.detach(id).wait(), Ok(true));
    let heard = diary.0.lock().unwrap().len();
    assert!(heard > 0);
    port.write_all(b"ea\r").unwrap();
    running.handle.press("start").wait().unwrap();
    assert_eq!(diary.0.lock().unwrap().len(), heard);
    assert_eq!(running.handle.detach(id).wait(), Ok(false));
    assert_eq!(running.handle.detach(other).wait(), Ok(true));
    running.end().unwrap();
}

/// What a controller is asked on its way while somebody watches who never looks.
fn converse(handle: &Handle<Fake>, port: &mut vimc4_host::MemoryPort) {
    for _ in 0..100 {
        port.write_all(b"ea\r").unwrap();
    }
    handle.now().wait().unwrap();
    assert_eq!(port.drain(), [b'a'; 100]);
}

#[test]
fn one_that_takes_its_time_is_told_what_it_has_missed() {
    let (tap, mut reports) = Reports::new(EventFilter::ALL, 20);
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    running.handle.watch(tap).wait().unwrap();
    converse(&running.handle, &mut port);
    let kept: Vec<_> = std::iter::from_fn(|| reports.take()).collect();
    assert_eq!(kept.len(), 21);
    assert!(matches!(kept[0].what, ReportKind::State { by: None, .. }));
    let Some(ReportKind::Missed { reports: missed }) = kept.last().map(|report| &report.what)
    else {
        panic!("nothing is missing: {kept:?}");
    };
    // At least an input and an answer for each of the writes; they may have come in pieces.
    assert!(*missed > 0, "{missed}");
    // It goes on from there.
    running.handle.press("start").wait().unwrap();
    let next = reports.take().unwrap();
    let by = Source::Controls("the library".into());
    assert!(matches!(next.news(), Some(LineEvent::Deed { by: who, .. }) if *who == by), "{next:?}");
    // Dropped, it is let go of; what it wanted is not made any more.
    drop(reports);
    running.handle.press("start").wait().unwrap();
    let (late, mut late_reports) = Reports::new(EventFilter::default(), 20);
    running.handle.watch(late).wait().unwrap();
    converse(&running.handle, &mut port);
    running.end().unwrap();
    // The end is news for everybody, and the last one.
    assert_eq!(late_reports.wait().unwrap().news(), Some(&LineEvent::Ends));
    assert_eq!(late_reports.wait(), None);
}

#[test]
fn reports_can_be_awaited_while_it_runs() {
    let (tap, mut reports) = Reports::new(EventFilter::ALL, 1_000);
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    running.handle.watch(tap).wait().unwrap();
    let watches = std::thread::spawn(move || {
        let mut heard = Vec::new();
        while let Some(report) = reports.wait() {
            if let ReportKind::Sent { bytes } = &report.what {
                heard.extend_from_slice(bytes);
            }
            assert!(!matches!(report.event(), Some(Event::Line { .. })));
        }
        heard
    });
    converse(&running.handle, &mut port);
    running.end().unwrap();
    assert_eq!(watches.join().unwrap(), [b'a'; 100]);
}
