//! The line with the time of its characters, without any host.

use proptest::prelude::*;
use vimc4_device::{Condition, Device, Harness, Input, Line, Output, Time};

use crate::fake::Fake;

/// When ten bits of the `n`-th character have passed.
fn characters(n: u64, baud: u64) -> Time {
    Time::from_nanos((n * 10_000_000_000).div_ceil(baud))
}

fn ideal() -> Harness<Line<Fake>> {
    Harness::new(Line::ideal(Fake::new(b"")))
}

fn paced() -> Harness<Line<Fake>> {
    Harness::new(Line::paced(Fake::new(b"")))
}

/// Lets the line run until it is silent; what left, and when.
fn run(line: &mut Harness<Line<Fake>>) -> Vec<(Time, u8)> {
    line.run_to_rest().unwrap();
    let said = line.drain().filter_map(|output| match output {
        Output::Bytes(at, bytes) => Some(bytes.into_iter().map(move |byte| (at, byte))),
        Output::Flash(..) | Output::Event(..) => None,
    });
    said.flatten().collect()
}

#[test]
fn every_character_takes_ten_bit_times_both_ways() {
    let mut line = paced();
    line.send(b"eab\r");
    let sent = run(&mut line);
    // The command is complete with its fourth character.
    let complete = characters(4, 19_200);
    let first = complete.after_nanos(characters(1, 19_200).as_nanos());
    let second = complete.after_nanos(characters(2, 19_200).as_nanos());
    assert_eq!(sent, [(first, b'a'), (second, b'b')]);
}

#[test]
fn splitting_the_bytes_changes_nothing() {
    let mut whole = paced();
    whole.run_to(Time::from_millis(5));
    whole.send(b"ehello\rw3\rt\r");
    let mut split = paced();
    split.run_to(Time::from_millis(5));
    for byte in b"ehello\rw3\rt\r" {
        split.send(&[*byte]);
    }
    assert_eq!(whole.device().state(), split.device().state());
    assert_eq!(run(&mut whole), run(&mut split));
    assert_eq!(whole.device().state(), split.device().state());
}

#[test]
fn waking_early_or_late_changes_nothing() {
    let script: &[u8] = b"ehello\rw7\rs20\r";
    let mut exact = paced();
    exact.send(script);
    let expected = run(&mut exact);
    let mut late = Line::paced(Fake::new(b""));
    late.handle(Input::Bytes(script), Time::ZERO);
    late.handle(Input::Wake, Time::from_secs(1));
    assert_eq!(run(&mut Harness::new(late)), expected);
    let mut early = paced();
    early.send(script);
    for micros in 0..50_000 {
        early.run_to(Time::from_micros(micros * 2));
    }
    assert_eq!(run(&mut early), expected);
}

#[test]
fn rounding_does_not_add_up() {
    let mut line = paced();
    line.send(b"s1920\r");
    let sent = run(&mut line);
    // 1,920 characters at 1,920 characters a second.
    assert_eq!(sent[1_919].0, characters(6, 19_200) + std::time::Duration::from_secs(1));
}

#[test]
fn a_new_speed_holds_from_the_next_character_on() {
    let mut line = paced();
    line.send(b"b9600\r");
    assert_eq!(run(&mut line).len(), 1);
    let now = line.now();
    line.send(b"ex\r");
    let sent = run(&mut line);
    assert_eq!(sent[0].0.nanos_since(now), characters(3, 9_600).as_nanos() + 1_041_667);
}

#[test]
fn a_line_without_pacing_takes_no_time() {
    let mut line = ideal();
    line.run_to(Time::from_millis(3));
    line.send(b"eab\r");
    assert_eq!(run(&mut line), [(Time::from_millis(3), b'a'), (Time::from_millis(3), b'b')]);
    assert_eq!(line.device().room(true), usize::MAX);
}

#[test]
fn it_is_idle_only_when_the_last_character_has_left() {
    let mut line = paced();
    line.send(b"ex\r");
    assert!(!line.device().is_idle());
    let idle = line.device().when(&Condition::Idle).unwrap();
    assert_eq!(idle.as_nanos(), characters(3, 19_200).as_nanos() + 520_834);
    // The forecast has changed nothing.
    assert_eq!(line.now(), Time::ZERO);
    assert_eq!(run(&mut line), [(idle, b'x')]);
    assert!(line.device().is_idle());
}

#[test]
fn a_move_is_forecast_through_the_line() {
    let mut line = paced();
    line.send(b"w100\r");
    let at = line.device().when(&Condition::AxisAt { axis: 0, position: 40 }).unwrap();
    assert_eq!(at, characters(5, 19_200) + std::time::Duration::from_millis(40));
}

#[test]
fn what_was_being_sent_is_gone_with_the_power() {
    let mut line = paced();
    line.send(b"s10\r");
    line.plan(characters(6, 19_200).after_nanos(1_000), Input::Power(false));
    assert_eq!(run(&mut line).len(), 2);
}

#[test]
fn a_line_continues_from_its_state() {
    let mut line = paced();
    line.send(b"ehello\rw5\r");
    line.run_to(Time::from_millis(3));
    line.drain();
    let state = line.device().state();
    let mut other = ideal();
    other.restore(state);
    assert_eq!(run(&mut other), run(&mut line));
    assert_eq!(other.device().state(), line.device().state());
}

#[test]
fn a_full_line_takes_no_more() {
    let mut line = paced();
    let room = line.device().room(true);
    line.send(&vec![b'e'; room]);
    assert_eq!(line.device().room(true), 0);
    line.run_to(Time::from_millis(1));
    assert_eq!(line.device().room(true), 1);
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
        let fake = Fake::new(b"");
        let line = if paced { Line::paced(fake) } else { Line::ideal(fake) };
        let mut inputs: Vec<_> =
            script.iter().map(|(micros, line)| (Time::from_micros(*micros), lines[*line])).collect();
        inputs.sort_by_key(|(at, _)| *at);
        let end = Time::from_secs(1);

        let mut late = line.clone();
        for (at, bytes) in &inputs {
            late.handle(Input::Bytes(bytes), *at);
        }
        late.handle(Input::Wake, end);
        let mut late = Harness::new(late);

        let mut driven = Harness::new(line);
        let mut wakes: Vec<_> = wakes.into_iter().map(Time::from_micros).collect();
        wakes.sort();
        let mut wakes = wakes.into_iter().peekable();
        for (at, bytes) in &inputs {
            while let Some(wake) = wakes.next_if(|wake| wake <= at) {
                driven.run_to(wake);
            }
            driven.run_to(*at);
            for piece in bytes.chunks(cut) {
                driven.send(piece);
            }
        }
        driven.run_to(end);
        prop_assert_eq!(run(&mut driven), run(&mut late));
        prop_assert_eq!(driven.device().state(), late.device().state());
    }
}
