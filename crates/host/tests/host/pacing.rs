//! The line with the time of its characters, without any host.

use proptest::prelude::*;
use vimc4_device::{Condition, Device, Input, Output, Time};
use vimc4_host::Line;

use crate::fake::Fake;

/// When ten bits of the `n`-th character have passed.
fn characters(n: u64, baud: u64) -> Time {
    Time::from_nanos((n * 10_000_000_000).div_ceil(baud))
}

/// Lets the device run until it is silent; what leaves, and when.
fn run(line: &mut Line<Fake>) -> Vec<(Time, u8)> {
    let mut sent = Vec::new();
    loop {
        match line.poll_output() {
            Output::Bytes(at, bytes) => sent.extend(bytes.iter().map(|byte| (at, *byte))),
            Output::Wake(Some(due)) => line.handle(Input::Wake, due),
            Output::Wake(None) => return sent,
            _ => {}
        }
    }
}

#[test]
fn every_character_takes_ten_bit_times_both_ways() {
    let mut line = Line::paced(Fake::new(b""));
    line.handle(Input::Bytes(b"eab\r"), Time::ZERO);
    let sent = run(&mut line);
    // The command is complete with its fourth character.
    let complete = characters(4, 19_200);
    let first = complete.after_nanos(characters(1, 19_200).as_nanos());
    let second = complete.after_nanos(characters(2, 19_200).as_nanos());
    assert_eq!(sent, [(first, b'a'), (second, b'b')]);
}

#[test]
fn splitting_the_bytes_changes_nothing() {
    let mut whole = Line::paced(Fake::new(b""));
    whole.handle(Input::Bytes(b"ehello\rw3\rt\r"), Time::from_millis(5));
    let mut split = Line::paced(Fake::new(b""));
    for byte in b"ehello\rw3\rt\r" {
        split.handle(Input::Bytes(&[*byte]), Time::from_millis(5));
    }
    assert_eq!(whole.state(), split.state());
    assert_eq!(run(&mut whole), run(&mut split));
    assert_eq!(whole.state(), split.state());
}

#[test]
fn waking_early_or_late_changes_nothing() {
    let script: &[u8] = b"ehello\rw7\rs20\r";
    let mut exact = Line::paced(Fake::new(b""));
    exact.handle(Input::Bytes(script), Time::ZERO);
    let expected = run(&mut exact);
    let mut late = Line::paced(Fake::new(b""));
    late.handle(Input::Bytes(script), Time::ZERO);
    late.handle(Input::Wake, Time::from_secs(1));
    assert_eq!(run(&mut late), expected);
    let mut early = Line::paced(Fake::new(b""));
    early.handle(Input::Bytes(script), Time::ZERO);
    let mut sent = Vec::new();
    for micros in 0..50_000 {
        early.handle(Input::Wake, Time::from_micros(micros * 2));
        while let output @ (Output::Bytes(..) | Output::Event(..)) = early.poll_output() {
            if let Output::Bytes(at, bytes) = output {
                sent.extend(bytes.iter().map(|byte| (at, *byte)));
            }
        }
    }
    assert_eq!(sent, expected);
}

#[test]
fn rounding_does_not_add_up() {
    let mut line = Line::paced(Fake::new(b""));
    line.handle(Input::Bytes(b"s1920\r"), Time::ZERO);
    let sent = run(&mut line);
    // 1,920 characters at 1,920 characters a second.
    assert_eq!(sent[1_919].0, characters(6, 19_200) + std::time::Duration::from_secs(1));
}

#[test]
fn a_new_speed_holds_from_the_next_character_on() {
    let mut line = Line::paced(Fake::new(b""));
    line.handle(Input::Bytes(b"b9600\r"), Time::ZERO);
    assert_eq!(run(&mut line).len(), 1);
    let now = line.now();
    line.handle(Input::Bytes(b"ex\r"), now);
    let sent = run(&mut line);
    assert_eq!(sent[0].0.nanos_since(now), characters(3, 9_600).as_nanos() + 1_041_667);
}

#[test]
fn a_line_without_pacing_takes_no_time() {
    let mut line = Line::ideal(Fake::new(b""));
    line.handle(Input::Bytes(b"eab\r"), Time::from_millis(3));
    assert_eq!(run(&mut line), [(Time::from_millis(3), b'a'), (Time::from_millis(3), b'b')]);
    assert_eq!(line.room(true), usize::MAX);
}

#[test]
fn it_is_idle_only_when_the_last_character_has_left() {
    let mut line = Line::paced(Fake::new(b""));
    line.handle(Input::Bytes(b"ex\r"), Time::ZERO);
    assert!(!line.is_idle());
    let idle = line.when(&Condition::Idle).unwrap();
    assert_eq!(idle.as_nanos(), characters(3, 19_200).as_nanos() + 520_834);
    // The forecast has changed nothing.
    assert_eq!(line.now(), Time::ZERO);
    assert_eq!(run(&mut line), [(idle, b'x')]);
    assert!(line.is_idle());
}

#[test]
fn a_move_is_forecast_through_the_line() {
    let mut line = Line::paced(Fake::new(b""));
    line.handle(Input::Bytes(b"w100\r"), Time::ZERO);
    let at = line.when(&Condition::AxisAt { axis: 0, position: 40 }).unwrap();
    assert_eq!(at, characters(5, 19_200) + std::time::Duration::from_millis(40));
}

#[test]
fn what_was_being_sent_is_gone_with_the_power() {
    let mut line = Line::paced(Fake::new(b""));
    line.handle(Input::Bytes(b"s10\r"), Time::ZERO);
    line.handle(Input::Power(false), characters(6, 19_200).after_nanos(1_000));
    assert_eq!(run(&mut line).len(), 2);
}

#[test]
fn a_line_continues_from_its_state() {
    let mut line = Line::paced(Fake::new(b""));
    line.handle(Input::Bytes(b"ehello\rw5\r"), Time::ZERO);
    line.handle(Input::Wake, Time::from_millis(3));
    while !matches!(line.poll_output(), Output::Wake(_)) {}
    let state = line.state().clone();
    let mut other = Line::ideal(Fake::new(b""));
    other.restore(state);
    assert_eq!(run(&mut other), run(&mut line));
    assert_eq!(other.state(), line.state());
}

#[test]
fn a_full_line_takes_no_more() {
    let mut line = Line::paced(Fake::new(b""));
    let room = line.room(true);
    line.handle(Input::Bytes(&vec![b'e'; room]), Time::ZERO);
    assert_eq!(line.room(true), 0);
    line.handle(Input::Wake, Time::from_millis(1));
    assert_eq!(line.room(true), 1);
}

proptest! {
    /// Whatever is sent when, however it is cut and whenever the host wakes up: the same bytes
    /// leave at the same times, and the same state is left.
    #[test]
    fn how_a_host_drives_it_makes_no_difference(
        script in prop::collection::vec((0_u64..20_000, 0_usize..5), 1..20),
        wakes in prop::collection::vec(0_u64..20_000, 0..40),
        cut in 1_usize..4,
        paced in any::<bool>(),
    ) {
        let lines: [&[u8]; 5] = [b"ehi\r", b"w3\r", b"s7\r", b"b9600\r", b"t\r"];
        let new = || {
            let fake = Fake::new(b"");
            if paced { Line::paced(fake) } else { Line::ideal(fake) }
        };
        let mut inputs: Vec<_> =
            script.iter().map(|(micros, line)| (Time::from_micros(*micros), lines[*line])).collect();
        inputs.sort_by_key(|(at, _)| *at);
        let end = Time::from_secs(1);

        let mut plain = new();
        for (at, bytes) in &inputs {
            plain.handle(Input::Bytes(bytes), *at);
        }
        plain.handle(Input::Wake, end);
        let expected = run(&mut plain);

        let mut driven = new();
        let mut sent = Vec::new();
        let mut drain = |line: &mut Line<Fake>| {
            while let Output::Bytes(at, bytes) = line.poll_output() {
                sent.extend(bytes.iter().map(|byte| (at, *byte)));
            }
        };
        let mut wakes: Vec<_> = wakes.into_iter().map(Time::from_micros).collect();
        wakes.sort();
        let mut wakes = wakes.into_iter().peekable();
        for (at, bytes) in &inputs {
            while let Some(wake) = wakes.next_if(|wake| wake <= at) {
                driven.handle(Input::Wake, wake);
                drain(&mut driven);
            }
            for piece in bytes.chunks(cut) {
                driven.handle(Input::Bytes(piece), *at);
                drain(&mut driven);
            }
        }
        driven.handle(Input::Wake, end);
        drain(&mut driven);
        prop_assert_eq!(sent, expected);
        prop_assert_eq!(driven.state(), plain.state());
    }
}
