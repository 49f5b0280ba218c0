//! Whether bytes arrive when a real line would have brought them.
//!
//! # A conversation whose times are known
//!
//! A character takes c = 10 bits / 19,200 baud = 520.833 µs, and no character follows another
//! before that. The client writes many `@0P` and a carriage return, 4 characters each, at once,
//! at the time 0. The first has arrived at 4·c. The controller needs no time for it, so its
//! answer, 19 characters, begins to leave there, and its first character has arrived at 5·c. A
//! question takes 4·c and an answer 19·c, so the next answers have long been there whenever one
//! has left, and as long as the client keeps questions waiting the answers follow each other
//! without a gap: the character number i, from 1, has arrived at (4 + i)·c.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use crate::suite::Bench;
use crate::suite::alarm;
use crate::suite::failure::Outcome;
use crate::suite::numbers::{count, nanos};
use crate::suite::port::{ANSWER, Port, QUESTION};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::Sample;

/// Bits per second.
const BAUD: u64 = 19_200;

/// A start bit, eight data bits, a stop bit.
const BITS: u64 = 10;

/// How many questions wait to be answered.
const AHEAD: usize = 64;

/// How far from its time the last character may be, nanoseconds.
const LAST: f64 = 1e6;

/// When so many characters have passed, nanoseconds.
fn passed(characters: usize) -> u64 {
    characters as u64 * BITS * 1_000_000_000 / BAUD
}

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span = bench.either(Duration::from_secs(60), Duration::from_secs(6));
    let server = bench.cores.server.run(|| bench.launcher.emulator(&["--line-pacing"]))?;
    let mut section = Section::default();
    let mut add = |line: &str, talk: &mut dyn FnMut() -> Outcome<Arrivals>| {
        let mut arrivals = Arrivals::default();
        let until = Instant::now() + span;
        let character = Duration::from_nanos(passed(1));
        let alarms = alarm::beside(bench.cores.server, character, until, || {
            arrivals = talk()?;
            Ok(())
        })?;
        report(&mut section, line, span, &arrivals, &alarms);
        Outcome::Ok(())
    };
    bench.cores.client.run(|| {
        add("TCP", &mut || arrivals(&mut server.connect()?, span))?;
        add("a pseudo-terminal", &mut || arrivals(&mut server.open()?, span))
    })?;
    section.note(
        "19,200 baud, 10 bits for a character: 521 µs. The time counts from before the client's \
         first write. The baseline is a timerfd that rings as often, waited for by another \
         thread on the emulator's core meanwhile: what the machine itself does to such times.",
    );
    Ok(section)
}

/// How far from their times characters arrived, nanoseconds.
#[derive(Default)]
struct Arrivals {
    /// All of them, whether early or late.
    off: Sample,
    /// The last one: how late.
    last: f64,
}

fn report(
    section: &mut Section,
    line: &str,
    span: Duration,
    Arrivals { off, last }: &Arrivals,
    alarms: &Sample,
) {
    let text =
        |sample: &Sample| format!("{}, {}", nanos(sample.median()), nanos(sample.quantile(0.99)));
    let characters = count(off.count() as f64);
    section.add(
        Figure::new(
            format!("{characters} characters over {line}, off their time: p50, p99"),
            text(off),
        )
        .baseline(text(alarms))
        .target("p99 ≤ 521 µs", off.quantile(0.99) <= passed(1) as f64),
    );
    section.add(
        Figure::new(
            format!("… the last of {} s", span.as_secs()),
            format!("{} late", nanos(*last)),
        )
        .target("within 1 ms", last.abs() <= LAST),
    );
}

/// Holds the conversation.
fn arrivals<T: Read + Write>(port: &mut Port<T>, span: Duration) -> Outcome<Arrivals> {
    let mut arrivals = Arrivals::default();
    let (mut asked, mut received) = (0, 0);
    let mut buffer = [0; 256];
    let began = Instant::now();
    while began.elapsed() < span {
        let missing = (received / ANSWER + AHEAD).saturating_sub(asked);
        if missing > 0 {
            port.send(&QUESTION.repeat(missing))?;
            asked += missing;
        }
        let count = port.receive(&mut buffer)?;
        let at = began.elapsed().as_nanos() as f64;
        for _ in 0..count {
            received += 1;
            arrivals.last = at - passed(QUESTION.len() + received) as f64;
            arrivals.off.add(arrivals.last.abs());
        }
    }
    // What was asked is answered to its end, so that the next measurement finds a quiet line.
    while received < asked * ANSWER {
        received += port.receive(&mut buffer)?;
    }
    Ok(arrivals)
}
