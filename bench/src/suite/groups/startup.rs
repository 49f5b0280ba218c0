//! How long after its start a program answers.

use std::time::Instant;

use crate::suite::Bench;
use crate::suite::failure::Outcome;
use crate::suite::numbers::{nanos, times};
use crate::suite::port::{ANSWER, QUESTION};
use crate::suite::report::{Figure, Section};
use crate::suite::server::Server;
use crate::suite::stats::alternate;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let rounds = bench.either(20, 5);
    let first_answer = |start: &dyn Fn() -> Outcome<Server>, answer: usize| {
        let began = Instant::now();
        let server = start()?;
        server.connect()?.ask(QUESTION, answer)?;
        Ok(began.elapsed().as_nanos() as f64)
    };
    let times_taken = alternate(
        rounds,
        || first_answer(&|| bench.launcher.baseline("tcp"), QUESTION.len()),
        || first_answer(&|| bench.launcher.emulator(&[]), ANSWER),
    )?;
    let ratio = times_taken.ratio();
    let mut section = Section::default();
    section.add(
        Figure::new(
            "from the start of the program to the answer to `@0P` over TCP",
            format!("{}, {}", nanos(times_taken.ours), times(ratio)),
        )
        .baseline(nanos(times_taken.baseline))
        .target("≤ 1.5 ×", ratio <= 1.5),
    );
    section.note(format!(
        "Medians of {rounds}. Either program prints where it listens and is connected to then; \
         the emulator makes a pseudo-terminal and its link as well."
    ));
    Ok(section)
}
