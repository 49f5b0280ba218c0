//! What it costs to be watched: round trips of a controller in the process whose journal is kept,
//! and of one of which fifty things are expected, compared with one that is not watched.

use std::time::Duration;

use vimc4::{Emulator, Watched};

use crate::suite::Bench;
use crate::suite::failure::{Doing, Failure, Outcome};
use crate::suite::port::{ISEL, Wire};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{ROUNDS, alternate};

/// How many times the rounds of other groups take turns here: a difference of a hundredth shall show.
const TURNS: usize = 5 * ROUNDS;

/// The least share of the round trips that is left.
const LEAST: f64 = 0.95;

/// How many things are expected.
const EXPECTED: usize = 50;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span = bench.either(Duration::from_millis(200), Duration::from_millis(30));
    let mut section = Section::default();
    for (what, expected) in [
        ("its journal is kept", 0),
        ("its journal is kept and fifty things are expected", EXPECTED),
    ] {
        let (plain, kept) = (start(false)?, start(true)?);
        let watched = expect(&kept, expected)?;
        let (mut without, mut with) = (connect(&plain)?, connect(&kept)?);
        let rates = alternate(TURNS, || without.ping(ISEL, span), || with.ping(ISEL, span))?;
        watched.into_iter().for_each(Watched::give_up);
        section.add(Figure::rates(format!("round trips over TCP, {what}"), rates, LEAST));
    }
    section.note(
        "The controllers are in the measuring process, each in a thread of its own. Without \
         `Builder::record` nothing watches them: that is the baseline.",
    );
    Ok(section)
}

fn start(record: bool) -> Outcome<Emulator> {
    let builder = Emulator::builder().record(record).tcp("127.0.0.1:0");
    builder.start().doing("start an emulator")
}

fn connect(emulator: &Emulator) -> Outcome<Wire> {
    let address = emulator.tcp_addr().ok_or_else(|| Failure::new("the emulator has no TCP"))?;
    Wire::connect(address)
}

/// So many expectations of every sort.
fn expect(emulator: &Emulator, count: usize) -> Outcome<Vec<Watched>> {
    let sorts = (0..count).map(|number| {
        let expect = emulator.expect();
        let sentence = match number % 5 {
            0 => expect.never("z < -5000 and x < 0"),
            1 => expect.command("@A").answered("0").at_least(2).then().command("@V").once(),
            2 => expect.never("answer error"),
            3 => {
                let span = Duration::from_millis(500);
                expect.whenever("z < 0").must_have_been("port 2 bit 0 on").for_at_least(span)
            }
            _ => expect.command("@R").at_most(1),
        };
        sentence.watch().doing("expect something")
    });
    sorts.collect()
}
