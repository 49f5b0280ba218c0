//! How fast a stored program runs when nothing waits.

use vimc4_device::{Device, Input, Time};
use vimc4_isel::Controller;
use vimc4_plant::PlantSignal;

use crate::suite::Bench;
use crate::suite::failure::{Failure, Outcome};
use crate::suite::numbers::count;
use crate::suite::play::{Answer, bench as machine, controller, expect};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{ROUNDS, Sample};
use crate::suite::usage::processor_time;

/// A program of the kind that people store: loops, moves, half circles, delays, without an end.
const PROGRAM: &str =
    include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/programs/pattern.cnc"));

/// The least number of the controller's seconds in one of processor time.
const LEAST: f64 = 1e5;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span: u64 = bench.either(200_000, 20_000);
    let mut device = controller(machine()?)?;
    for line in PROGRAM.lines() {
        expect(&mut device, line, b'0')?;
    }
    for value in [1, 0] {
        device.handle(Input::Signal(PlantSignal::Start.id(), value), device.now());
    }
    let rounds = (0..ROUNDS).map(|_| forward(&mut device, span));
    let median = rounds.collect::<Outcome<Sample>>()?.median();
    let mut section = Section::default();
    section.add(
        Figure::new(
            "the program `fixtures/programs/pattern.cnc`",
            format!("{} × real time", count(median)),
        )
        .target("≥ 100,000 × real time", median >= LEAST),
    );
    section.note(format!(
        "{span} seconds of the controller's time, compared with the processor time; nobody \
         watches."
    ));
    Ok(section)
}

/// How many seconds of the controller's time pass in one of processor time.
fn forward(device: &mut Controller, span: u64) -> Outcome<f64> {
    let began = device.now();
    let end = Time::from_nanos(began.as_nanos() + span * 1_000_000_000);
    let mut answer = Answer::default();
    let mut rests = false;
    let spent = processor_time(|| {
        while device.now() < end && !rests {
            answer.hear(device);
            match device.wake() {
                Some(due) => device.handle(Input::Wake, due),
                None => rests = true,
            }
        }
    });
    if rests {
        return Err(Failure::new("the program has come to an end, which it should not"));
    }
    Ok(device.now().nanos_since(began) as f64 / spent)
}
