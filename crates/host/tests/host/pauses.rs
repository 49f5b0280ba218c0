//! A controller's time is paused, led step by step and goes on, and its clients notice nothing but
//! time.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::Duration;

use vimc4_device::{Condition, Device, Harness, Input, Line, OwnedInput, SignalId, Time};
use vimc4_host::{
    BreakpointId, Clients, Clock, ControlError, Handle, LineEvent, MemoryPort, Pause, Rate, Report,
    ReportKind, Source, Step, Tcp,
};

use crate::fake::{Diary, Fake, Running};

const MS: u64 = 1_000_000;

/// Long enough for whatever might happen in the meantime, on a computer that has nothing else to do.
const A_WHILE: Duration = Duration::from_millis(60);

fn clocks_that_run() -> [Clock; 2] {
    [Clock::Real, Clock::Scaled(Rate::new(8, 1).unwrap())]
}

fn all_clocks() -> [Clock; 4] {
    let [real, eight] = clocks_that_run();
    [real, eight, Clock::Manual, Clock::Instant]
}

fn at(position: i64) -> Condition {
    Condition::AxisAt { axis: 0, position }
}

fn read(port: &mut impl Read, answer: usize) -> String {
    let mut bytes = vec![0; answer];
    port.read_exact(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// What the fake says that its time is.
fn time(port: &mut impl Read) -> u64 {
    let mut digits = String::new();
    loop {
        match read(port, 1).as_str() {
            "." => return digits.parse().unwrap(),
            digit => digits.push_str(digit),
        }
    }
}

/// Waits until time is paused.
fn pause<D: Device + Clone + 'static>(handle: &Handle<D>) -> Pause {
    handle.until_paused().wait_within(Duration::from_secs(60)).unwrap()
}

fn place(running: &Running<impl Device<Details = ()> + Clone + Send + 'static>) -> i64 {
    running.handle.view().wait().unwrap().axes[0].position
}

#[test]
fn time_stands_still_and_goes_on_from_there() {
    for clock in clocks_that_run() {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        let handle = &running.handle;
        port.write_all(b"t\rw400\rt\r").unwrap();
        let began = time(&mut port);
        let paused = handle.pause().wait().unwrap();
        thread::sleep(A_WHILE);
        port.write_all(b"t\r").unwrap();
        thread::sleep(A_WHILE);
        assert_eq!(handle.now().wait(), Ok(paused));
        assert_eq!(handle.pause().wait(), Ok(paused));
        assert_eq!(port.drain(), b"");
        // It went on, and the motion took no longer than ever: nothing of the pause is in it.
        assert_eq!(handle.resume().wait(), Ok(paused));
        assert_eq!(read(&mut port, 1), "0");
        assert_eq!(time(&mut port), began + 400 * MS);
        assert!(time(&mut port) >= began + 400 * MS);
        running.end().unwrap();
    }
}

#[test]
fn the_pause_is_not_made_up_for() {
    for clock in clocks_that_run() {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        port.write_all(b"l\r").unwrap();
        assert_eq!(read(&mut port, 1), "0");
        let paused = running.handle.pause().wait().unwrap();
        // Far longer than what follows may take.
        let ticks = running.handle.state().wait().unwrap().ticks;
        thread::sleep(Duration::from_millis(500));
        running.handle.with(|_| Ok(())).wait().unwrap();
        assert_eq!(running.handle.state().wait().unwrap().ticks, ticks);
        running.handle.resume().wait().unwrap();
        let again = running.handle.pause().wait().unwrap();
        let passed = again.nanos_since(paused);
        assert!(passed < 400 * MS, "{passed} ns of {clock} have passed");
        running.end().unwrap();
    }
}

#[test]
fn another_controller_goes_on() {
    for clock in clocks_that_run() {
        let (paused, mut waits) = Running::in_memory(Fake::new(b""), clock);
        let (_other, mut goes) = Running::in_memory(Fake::new(b""), clock);
        paused.handle.pause().wait().unwrap();
        waits.write_all(b"w5\r").unwrap();
        for _ in 0..3 {
            goes.write_all(b"w5\r").unwrap();
            assert_eq!(read(&mut goes, 1), "0");
        }
        assert_eq!(waits.drain(), b"");
        paused.handle.resume().wait().unwrap();
        assert_eq!(read(&mut waits, 1), "0");
    }
}

fn told(diary: &Diary) -> Vec<String> {
    diary.all(|report| match report.news() {
        Some(LineEvent::Opened { .. }) => Some("opened".to_owned()),
        Some(LineEvent::Closed { .. }) => Some("closed".to_owned()),
        Some(LineEvent::Refused { .. }) => Some("refused".to_owned()),
        Some(LineEvent::Paused { by: Some(by), .. }) => Some(format!("paused by {by}")),
        Some(LineEvent::Paused { breakpoints, .. }) => Some(format!("paused at {breakpoints:?}")),
        Some(LineEvent::Resumed { by }) => Some(format!("resumed by {by}")),
        _ => None,
    })
}

#[test]
fn clients_of_a_socket_notice_nothing_but_time() {
    for clock in clocks_that_run() {
        let diary = Diary::default();
        let (running, address) = Running::with(Fake::new(b""), clock, || {
            let tcp = Tcp::bind("127.0.0.1:0".parse().unwrap(), Clients::Refuse).unwrap();
            let address = tcp.address();
            (tcp, address)
        });
        let handle = running.handle.by("a debugger");
        handle.watch(diary.clone()).wait().unwrap();
        let mut first = TcpStream::connect(address).unwrap();
        first.write_all(b"ea\r").unwrap();
        assert_eq!(read(&mut first, 1), "a");
        handle.pause().wait().unwrap();
        // The first says something and goes, and the next comes: at any other time it would get
        // the line, and so it does now, although it has to wait longer than a newcomer may.
        first.write_all(b"fstored\r").unwrap();
        drop(first);
        let mut second = TcpStream::connect(address).unwrap();
        second.write_all(b"eb\r").unwrap();
        thread::sleep(Duration::from_millis(300));
        assert_eq!(told(&diary), ["opened", "paused by a debugger"]);
        handle.resume().wait().unwrap();
        assert_eq!(read(&mut second, 1), "b");
        assert_eq!(
            told(&diary),
            ["opened", "paused by a debugger", "resumed by a debugger", "closed", "opened"]
        );
        handle.pause().wait().unwrap();
        assert_eq!(handle.state().wait().unwrap(), running.handle.state().wait().unwrap());
        running.end().unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn clients_of_a_terminal_notice_nothing_but_time() {
    use std::fs::OpenOptions;

    use vimc4_host::Pty;

    for clock in clocks_that_run() {
        let diary = Diary::default();
        let (running, path) = Running::with(Fake::new(b""), clock, || {
            let pty = Pty::open(19_200).unwrap();
            let path = pty.path().to_owned();
            (pty, path)
        });
        let handle = running.handle.by("a debugger");
        handle.watch(diary.clone()).wait().unwrap();
        let open = || OpenOptions::new().read(true).write(true).open(&path).unwrap();
        let mut first = open();
        first.write_all(b"ea\r").unwrap();
        assert_eq!(read(&mut first, 1), "a");
        handle.pause().wait().unwrap();
        first.write_all(b"eb\rw5\r").unwrap();
        thread::sleep(A_WHILE);
        assert_eq!(told(&diary), ["opened", "paused by a debugger"]);
        handle.resume().wait().unwrap();
        assert_eq!(read(&mut first, 2), "b0");
        // What one has written that goes meanwhile is taken in before it is told to be gone.
        handle.pause().wait().unwrap();
        first.write_all(b"fleft\r").unwrap();
        drop(first);
        thread::sleep(A_WHILE);
        handle.resume().wait().unwrap();
        diary.wait_for("the end", |report| matches!(report.news(), Some(LineEvent::Closed { .. })));
        let from_nobody = |report: &Report| match &report.what {
            ReportKind::Input { by: Source::Client { client, .. }, .. } => Some(client.is_none()),
            _ => None,
        };
        assert_eq!(diary.all(from_nobody), [false; 3]);
        running.end().unwrap();
    }
}

#[test]
fn a_paused_controller_ends() {
    for clock in all_clocks() {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        running.handle.break_when(at(3)).wait().unwrap();
        port.write_all(b"w5\r").unwrap();
        let waits = running.handle.until_paused();
        running.handle.pause().wait().unwrap();
        waits.wait().unwrap();
        port.write_all(b"w5\r").unwrap();
        running.end().unwrap();
    }
    // Nobody waits for ever.
    let (running, _port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let waits = running.handle.until_paused();
    running.end().unwrap();
    assert_eq!(waits.wait(), Err(ControlError::Ended));
}

#[test]
fn only_a_paused_controller_is_led() {
    let (running, _port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    assert_eq!(handle.step().wait(), Err(ControlError::NotPaused));
    assert_eq!(handle.resume().wait(), Err(ControlError::NotPaused));
    assert_eq!(handle.hear(1).wait(), Err(ControlError::NotPaused));
    assert_eq!(handle.paused().wait(), Ok(None));
    handle.pause().wait().unwrap();
    assert_eq!(handle.step().wait(), Ok(Step::Rest));
    assert_eq!(handle.advance(A_WHILE).wait(), Err(ControlError::Paused));
    assert_eq!(handle.run_until(at(1)).wait(), Err(ControlError::Paused));
    assert_eq!(handle.now().wait(), Ok(Time::ZERO));
    running.end().unwrap();
}

#[test]
fn it_is_led_cause_by_cause() {
    for clock in all_clocks() {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        let handle = &running.handle;
        let began = handle.pause().wait().unwrap();
        let ms = |ms: u64| began.after_nanos(ms * MS);
        handle.inject(OwnedInput::Bytes("l\rw3\reend\r".into())).wait().unwrap();
        assert_eq!(port.drain(), b"0");
        for tick in 1..=2 {
            assert_eq!(handle.step().wait(), Ok(Step::Cause));
            assert_eq!(handle.now().wait(), Ok(ms(tick)));
        }
        assert_eq!(place(&running), 2);
        assert_eq!(port.drain(), b"");
        assert_eq!(handle.step().wait(), Ok(Step::Cause));
        assert_eq!(port.drain(), b"0end");
        // What a client sends is taken in as far as somebody wants.
        port.write_all(b"eone\retwo\r").unwrap();
        assert_eq!(handle.hear(5).wait(), Ok(5));
        assert_eq!(port.drain(), b"one");
        assert_eq!(handle.hear(4).wait(), Ok(4));
        assert_eq!(handle.hear(100).wait(), Ok(1));
        assert_eq!(port.drain(), b"two");
        assert_eq!(handle.hear(100).wait(), Ok(0));
        assert_eq!(handle.now().wait(), Ok(ms(3)));
        running.end().unwrap();
    }
}

#[test]
fn another_state_is_put_in_and_gone_on_from() {
    for clock in clocks_that_run() {
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        let handle = &running.handle;
        handle.pause().wait().unwrap();
        handle.inject(OwnedInput::Bytes("w40\rt\r".into())).wait().unwrap();
        let before = handle.device().wait().unwrap();
        handle.step().wait().unwrap();
        assert_eq!(read(&mut port, 1), "0");
        let ended = time(&mut port);
        // Back, and another way: it was stopped by nobody, but somebody switched off.
        handle.restore(before.state()).wait().unwrap();
        assert_eq!(handle.now().wait(), Ok(before.now()));
        assert_eq!(port.drain(), b"");
        assert_eq!(handle.paused().wait().unwrap().map(|pause| pause.by.is_some()), Some(true));
        // A later time is as good.
        let mut later = Harness::new(before.clone());
        later.advance(Duration::from_millis(20));
        later.input(Input::Signal(SignalId(0), 1));
        handle.restore(later.device().state()).wait().unwrap();
        assert_eq!(place(&running), 20);
        handle.resume().wait().unwrap();
        assert_eq!(read(&mut port, 1), "0");
        assert_eq!(time(&mut port), ended);
        assert_eq!(handle.state().wait().unwrap().signals[0], 1);
        running.end().unwrap();
    }
}

#[test]
fn a_breakpoint_pauses_where_it_becomes_true_and_again() {
    for clock in all_clocks() {
        let diary = Diary::default();
        let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
        let handle = &running.handle;
        handle.watch(diary.clone()).wait().unwrap();
        let moves = Condition::Command { like: Some("w".to_owned()) };
        let commands = handle.break_when(moves.clone()).wait().unwrap();
        let there = Condition::AxisAbove { axis: 0, position: 6 };
        let above = handle.break_when(there.clone()).wait().unwrap();
        assert_ne!(commands, above);
        port.write_all(b"t\rw5\rw5\rw5\rt\r").unwrap();
        let go = |breakpoint: BreakpointId, moved: i64| {
            let pause = pause(handle);
            assert_eq!((pause.by, pause.breakpoints), (None, vec![breakpoint]));
            assert_eq!(place(&running), moved);
            handle.now().wait().unwrap()
        };
        let goes_on = || {
            handle.resume().wait().unwrap();
            // Time that does not go by itself is sent.
            if clock == Clock::Manual {
                drop(handle.advance(Duration::from_millis(5)));
            }
        };
        let began = go(commands, 0);
        goes_on();
        assert_eq!(go(commands, 5), began.after_nanos(5 * MS));
        goes_on();
        assert_eq!(go(above, 7), began.after_nanos(7 * MS));
        handle.resume().wait().unwrap();
        assert_eq!(go(commands, 10), began.after_nanos(10 * MS));
        let views = handle.breakpoints().wait().unwrap();
        let views = views.into_iter().map(|view| (view.id, view.condition, view.met));
        assert_eq!(views.collect::<Vec<_>>(), [(commands, moves, 3), (above, there, 1)]);
        assert_eq!(handle.remove_breakpoint(commands).wait(), Ok(true));
        assert_eq!(handle.remove_breakpoint(commands).wait(), Ok(false));
        goes_on();
        assert_eq!(time(&mut port), began.as_nanos());
        assert_eq!(read(&mut port, 3), "000");
        assert_eq!(time(&mut port), began.as_nanos() + 15 * MS);
        let told = told(&diary).iter().filter(|told| told.starts_with("paused")).count();
        assert_eq!(told, 4);
        running.end().unwrap();
    }
}

#[test]
fn a_journey_is_held_up_by_a_breakpoint_and_goes_on() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    handle.break_when(at(3)).wait().unwrap();
    handle.pause().wait().unwrap();
    handle.inject(OwnedInput::Bytes("w9\r".into())).wait().unwrap();
    handle.resume().wait().unwrap();
    let journey = handle.run_until(at(8));
    assert_eq!(pause(handle).at, Time::from_millis(3));
    assert_eq!(place(&running), 3);
    handle.resume().wait().unwrap();
    assert_eq!(journey.wait(), Ok(Time::from_millis(8)));
    // One that is held up can be given up.
    handle.break_when(at(9)).wait().unwrap();
    let journey = handle.advance(A_WHILE);
    assert_eq!(pause(handle).at, Time::from_millis(9));
    journey.cancel();
    let at = Time::from_millis(9);
    assert_eq!(journey.wait(), Err(ControlError::Cancelled { at }));
    assert_eq!(handle.now().wait(), Ok(at));
    assert_eq!(port.drain(), b"0");
    running.end().unwrap();
}

/// A line whose characters take time: the end of an answer and the beginning of a command are causes
/// of their own.
fn paced(clock: Clock) -> (Running<Line<Fake>>, MemoryPort) {
    Running::in_memory(Line::paced(Fake::new(b"")), clock)
}

#[test]
fn what_is_behind_a_breakpoint_waits_and_is_not_lost() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    // An urgent byte comes by itself, and so what is before it comes before it.
    handle.watch(Diary::default()).wait().unwrap();
    handle.break_when(Condition::Command { like: None }).wait().unwrap();
    port.write_all(b"ea\r\xFDb\r").unwrap();
    assert_eq!(pause(handle).at, Time::ZERO);
    handle.resume().wait().unwrap();
    pause(handle);
    handle.resume().wait().unwrap();
    assert_eq!(port.drain(), b"a?");
    running.end().unwrap();
}

#[test]
fn the_line_is_led_character_by_character() {
    let (running, mut port) = paced(Clock::Manual);
    let handle = &running.handle;
    handle.pause().wait().unwrap();
    handle.inject(OwnedInput::Bytes("eok\r".into())).wait().unwrap();
    let mut steps = 0;
    while handle.step().wait().unwrap() != Step::Rest {
        steps += 1;
    }
    // Four to the device and two from it.
    assert_eq!(steps, 6);
    assert_eq!(port.drain(), b"ok");
    running.end().unwrap();
}
