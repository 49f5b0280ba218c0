//! The four clocks.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use vimc4_device::{Condition, Line, Time};
use vimc4_host::{Clock, ControlError, Effect, MemoryPort, Rate, Runner};

use crate::fake::{Fake, Running, numbered};

fn ask(port: &mut MemoryPort, line: &str, answer: usize) -> String {
    port.write_all(line.as_bytes()).unwrap();
    let mut bytes = vec![0; answer];
    port.read_exact(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn time(port: &mut MemoryPort) -> u64 {
    port.write_all(b"t\r").unwrap();
    let mut text = String::new();
    loop {
        let mut byte = [0];
        port.read_exact(&mut byte).unwrap();
        if byte[0] == b'.' {
            return text.parse().unwrap();
        }
        text.push(char::from(byte[0]));
    }
}

#[test]
fn the_real_clock_is_wall_time() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    let outer = Instant::now();
    let before = time(&mut port);
    let inner = Instant::now();
    assert_eq!(ask(&mut port, "w50\r", 1), "0");
    let inner = inner.elapsed();
    let model = Duration::from_nanos(time(&mut port) - before);
    let outer = outer.elapsed();
    assert!(inner >= Duration::from_millis(50), "{inner:?}");
    assert!(inner <= model && model <= outer, "{inner:?}, {model:?}, {outer:?}");
    assert_eq!(
        running.handle.advance(Duration::from_secs(1)).wait(),
        Err(ControlError::RunsByItself)
    );
    running.end().unwrap();
}

#[test]
fn a_scaled_clock_is_faster() {
    let clock = Clock::Scaled(Rate::new(100, 1).unwrap());
    let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
    let began = Instant::now();
    assert_eq!(ask(&mut port, "w2000\r", 1), "0");
    assert!(began.elapsed() >= Duration::from_millis(20));
    running.end().unwrap();
}

#[test]
fn waiting_for_a_condition_lets_time_run() {
    let clock = Clock::Scaled(Rate::new(100, 1).unwrap());
    let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
    let began = time(&mut port);
    port.write_all(b"w5000\r").unwrap();
    let at = running.handle.run_until(Condition::AxisAt { axis: 0, position: 3_000 });
    // Others are not kept waiting.
    assert!(running.handle.now().wait().unwrap() < Time::from_nanos(began + 3_000_000_000));
    let at = at.wait().unwrap();
    assert!(at >= Time::from_nanos(began + 3_000_000_000));
    let idle = running.handle.run_until(Condition::Idle).wait().unwrap();
    assert!(idle > at);
    running.end().unwrap();
}

#[test]
fn what_happens_is_waited_for_while_time_passes_by_itself() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    let until = |text: &str| running.handle.run_until(numbered(text));
    let (first, second) = (until("command e1"), until("command e2 and axis0 = 0 or command e3"));
    let (moved, given_up) = (until("command e2 and axis0 > 5"), until("command e9"));
    // They wait before anything is sent.
    running.handle.now().wait().unwrap();
    assert_eq!(ask(&mut port, "e1\r", 1), "1");
    let first = first.wait().unwrap();
    assert_eq!(ask(&mut port, "w6\r", 1), "0");
    // Three commands at one instant: the axis stands elsewhere by now.
    assert_eq!(ask(&mut port, "e4\re2\re3\r", 3), "423");
    let second = second.wait().unwrap();
    assert!(second >= first + Duration::from_millis(6));
    assert_eq!(moved.wait(), Ok(second));
    given_up.cancel();
    assert!(matches!(given_up.wait(), Err(ControlError::Cancelled { .. })));
    running.end().unwrap();
}

#[test]
fn what_happens_is_run_to_where_time_is_moved() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let until = |text: &str| running.handle.run_until(numbered(text));
    port.write_all(b"w5\rw7\re7\r").unwrap();
    assert_eq!(until("command w7").wait(), Ok(Time::from_millis(5)));
    assert_eq!(until("command e7").wait(), Ok(Time::from_millis(12)));
    assert_eq!(until("command e7").wait(), Err(ControlError::Never));
    running.end().unwrap();
}

#[test]
fn the_instant_clock_jumps_to_the_answer() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Instant);
    assert_eq!(ask(&mut port, "w3600000\r", 1), "0");
    assert_eq!(time(&mut port), 3_600_000_000_000);
    // Nothing happens, so no time passes.
    assert_eq!(time(&mut port), 3_600_000_000_000);
    running.end().unwrap();
}

#[test]
fn in_the_instant_clock_an_endless_program_keeps_the_line_responsive() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Instant);
    assert_eq!(ask(&mut port, "l\r", 1), "0");
    let mut last = 0;
    for _ in 0..20 {
        assert_eq!(ask(&mut port, "ehello\r", 5), "hello");
        let now = time(&mut port);
        assert!(now >= last);
        last = now;
        // Time jumps when nothing is readable, and only then.
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(last > 0);
    running.end().unwrap();
}

#[test]
fn in_the_manual_clock_time_moves_only_when_told() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    port.write_all(b"w5000\rt\r").unwrap();
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(handle.now().wait(), Ok(Time::ZERO));
    // Exactly step 2,500, then exactly the end.
    let at = handle.run_until(Condition::AxisAt { axis: 0, position: 2_500 }).wait();
    assert_eq!(at, Ok(Time::from_millis(2_500)));
    assert_eq!(handle.view().wait().unwrap().axes[0].position, 2_500);
    assert_eq!(handle.advance(Duration::from_millis(1)).wait(), Ok(Time::from_millis(2_501)));
    assert_eq!(port.drain(), b"");
    assert_eq!(handle.run_until(Condition::Idle).wait(), Ok(Time::from_secs(5)));
    assert_eq!(port.drain(), b"05000000000.");
    // Idle already: no time passes.
    assert_eq!(handle.run_until(Condition::Idle).wait(), Ok(Time::from_secs(5)));
    let never = handle.run_until(Condition::AxisAt { axis: 0, position: 9 }).wait();
    assert_eq!(never, Err(ControlError::Never));
    assert_eq!(handle.now().wait(), Ok(Time::from_secs(5)));
    running.end().unwrap();
}

#[test]
fn a_long_way_through_time_is_no_reason_not_to_end() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    assert_eq!(ask(&mut port, "l\r", 1), "0");
    let way = running.handle.advance(Duration::from_secs(1_000_000_000));
    running.end().unwrap();
    assert_eq!(way.wait(), Err(ControlError::Ended));
}

#[test]
fn a_clock_that_is_too_fast_for_the_computer_gives_way() {
    let clock = Clock::Scaled(Rate::new(1_000_000, 1).unwrap());
    let (running, mut port) = Running::in_memory(Fake::new(b""), clock);
    assert_eq!(ask(&mut port, "l\r", 1), "0");
    // A million ticks a millisecond are too many; the line answers all the same.
    for _ in 0..3 {
        assert_eq!(ask(&mut port, "ehello\r", 5), "hello");
    }
    running.end().unwrap();
}

#[test]
fn a_state_is_returned_to_with_its_time() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    port.write_all(b"w100\r").unwrap();
    handle.advance(Duration::from_millis(40)).wait().unwrap();
    let state = handle.state().wait().unwrap();
    for _ in 0..2 {
        assert_eq!(handle.run_until(Condition::Idle).wait(), Ok(Time::from_millis(100)));
        assert_eq!(port.drain(), b"0");
        handle.restore(state.clone()).wait().unwrap();
        assert_eq!(handle.now().wait(), Ok(Time::from_millis(40)));
    }
    running.end().unwrap();
}

#[test]
fn a_paced_client_is_held_back_and_loses_nothing() {
    let (running, mut port) =
        Running::start(Line::paced(Fake::new(b"")), Clock::Instant, |mut runner: Runner<_>| {
            let (memory, port) = vimc4_host::Memory::pair();
            runner.attach(Box::new(memory));
            (runner, port)
        });
    let mut expected = Vec::new();
    for n in 0..5_000 {
        port.write_all(format!("e{n},\r").as_bytes()).unwrap();
        expected.extend_from_slice(format!("{n},").as_bytes());
    }
    let mut answers = vec![0; expected.len()];
    port.read_exact(&mut answers).unwrap();
    assert_eq!(answers, expected);
    running.end().unwrap();
}

#[test]
fn signals_are_set_by_name() {
    let (running, _port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    let handle = &running.handle;
    // The fake adds the values up: a press and its release are 1 and 0.
    handle.press("start").wait().unwrap();
    handle.press("estop").wait().unwrap();
    handle.turn("key", "auto").wait().unwrap();
    handle.set_input(0, 3, true).wait().unwrap();
    assert_eq!(handle.state().wait().unwrap().signals, [1, 1, 1, 1]);
    let error = |reply: Result<Effect, ControlError>| reply.unwrap_err().to_string();
    assert_eq!(
        error(handle.press("strat").wait()),
        "there is no button `strat`; did you mean start?"
    );
    assert_eq!(
        error(handle.turn("key", "on").wait()),
        "`key` cannot be `on`; it can be test or auto"
    );
    assert_eq!(error(handle.set("start", 2).wait()), "`start` cannot be `2`; it can be 0 or 1");
    assert_eq!(
        error(handle.set_input(1, 0, true).wait()),
        "nothing outside drives bit 0 of port 1; the inputs are input 0.3"
    );
    running.end().unwrap();
}

#[test]
fn a_controller_ends_with_its_last_handle() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    drop(running);
    let mut nothing = [0];
    assert_eq!(port.read(&mut nothing).unwrap(), 0);
}
