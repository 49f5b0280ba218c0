//! A history of a million commands: what it takes to find something in it, and to step back.

use std::time::Instant;

use vimc4_debug::{Debugger, Depth, Reason, Unit, Way, uninterrupted};
use vimc4_device::{Input, Time};

use crate::suite::Bench;
use crate::suite::failure::{Doing, Failure, Outcome};
use crate::suite::numbers::{bytes, nanos};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::Sample;
use crate::suite::usage::Memory;

/// How many places are visited.
const PLACES: u64 = 200;

/// How many commands are gone back one after the other.
const ROW: u64 = 60;

/// How much memory a million commands may take, bytes.
const MOST_MEMORY: f64 = 256e6;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let commands: u64 = bench.either(1_000_000, 100_000);
    let here = std::process::id();
    let before = Memory::of(here)?;
    let mut debugger = recorded(commands)?;
    let memory = Memory::of(here)?.anonymous - before.anonymous;
    let mut section = Section::default();
    let share = commands as f64 / 1e6;
    section.add(
        Figure::new("memory", bytes(memory))
            .target("≤ 256 MB", memory <= MOST_MEMORY * share.max(0.1)),
    );

    let end = debugger.place();
    let mut search = |what: &str, line: &str, reason: &Reason, target: f64| {
        let mut sample = Sample::default();
        for _ in 0..5 {
            debugger.go_to(end).doing("go to the end")?;
            let condition =
                vimc4::read_condition(line, debugger.names()).doing("read a condition")?;
            let began = Instant::now();
            let stop = debugger.seek(&condition, Way::Back, &mut uninterrupted);
            sample.add(began.elapsed().as_nanos() as f64);
            if stop.why != *reason {
                return Err(Failure::new(format!("{line}: {}", stop.why)));
            }
        }
        let worst = sample.quantile(1.0);
        let measured = format!("{}, {}", nanos(sample.median()), nanos(worst));
        let figure = Figure::new(what, measured);
        section.add(figure.target(format!("≤ {} each", nanos(target)), worst <= target));
        Ok(())
    };
    search("`last z < -5000`, far back", "z < -5000", &Reason::Found, 1e9)?;
    search("`last z < -50000`, which never was", "z < -50000", &Reason::Nowhere, 1e9)?;
    search("`last answer error 5`, far back", "answer error 5", &Reason::Found, 1e9)?;

    let mut chance = 88_172_645_463_325_252_u64;
    let mut random = move |below: u64| {
        chance ^= chance << 13;
        chance ^= chance >> 7;
        chance ^= chance << 17;
        chance % below.max(1)
    };
    let (mut backs, mut scrubs, mut rows) =
        (Sample::default(), Sample::default(), Sample::default());
    for _ in 0..PLACES {
        let at = Time::from_nanos(random(end.moment.at.as_nanos()));
        let began = Instant::now();
        debugger.go_to_time(at, &mut uninterrupted);
        scrubs.add(began.elapsed().as_nanos() as f64);
        let began = Instant::now();
        let stop = debugger.step(Unit::Command, Way::Back, Depth::Into, 1, &mut uninterrupted);
        backs.add(began.elapsed().as_nanos() as f64);
        if !matches!(stop.why, Reason::Step(_) | Reason::Beginning) {
            return Err(Failure::new(format!("a step back at {at:?}: {}", stop.why)));
        }
        let began = Instant::now();
        for _ in 0..ROW {
            debugger.step(Unit::Command, Way::Back, Depth::Into, 1, &mut uninterrupted);
        }
        rows.add(began.elapsed().as_nanos() as f64);
    }
    let mut sampled = |what: &str, sample: &Sample, target: f64| {
        let worst = sample.quantile(1.0);
        let measured = format!("{}, {}", nanos(sample.median()), nanos(worst));
        let figure = Figure::new(what, measured);
        section.add(figure.target(format!("≤ {} each", nanos(target)), worst <= target));
    };
    sampled("a command back, anywhere", &backs, 20e6);
    sampled(&format!("{ROW} more commands back, one after the other"), &rows, 100e6);
    sampled("to any time", &scrubs, 50e6);
    section.note(format!(
        "{commands} moves and questions of an IMC4, one after the answer to the other; a debugger \
         watches all events. The first number is the median, the second the worst of {PLACES}, or \
         of 5 searches. A search leaves out what it knows not to hold what it looks for."
    ));
    Ok(section)
}

/// A controller that has got so many commands, one of a kind among the first of them.
fn recorded(commands: u64) -> Outcome<Debugger> {
    let model = vimc4_catalogue::model("imc4").doing("find the model imc4")?;
    let machine = vimc4_catalogue::machine("bench").doing("find the machine bench")?;
    let device = vimc4_catalogue::bare(&model, &machine, &[]).doing("make a controller")?;
    let mut debugger = Debugger::new(device);
    let mut give = |line: &str| {
        debugger.give(Input::Bytes(line.as_bytes()));
        debugger.history_mut().run_to_rest();
    };
    give("@07\r");
    for number in 1..commands {
        if number == commands / 4 {
            give("@0A0,900,0,900,-6000,5000,0,900\r");
            give("@0A0,900,0,900,6000,5000,0,900\r");
            give("@0X\r");
            continue;
        }
        let way = (number * 7_919 % 400) as i64 * if number % 2 == 0 { 1 } else { -1 };
        match number % 8 {
            0 => give("@0P\r"),
            1 => give("@0y40,2000,-20,10,0,1,1\r"),
            _ => give(&format!("@0A{way},5000,{},5000,0,900,0,900\r", -way / 2)),
        }
    }
    Ok(debugger)
}
