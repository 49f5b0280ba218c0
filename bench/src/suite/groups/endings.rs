//! How fast clients come and go, and how fast the emulator ends.

use std::net::TcpListener;
use std::time::Instant;

use crate::suite::Bench;
use crate::suite::failure::Outcome;
use crate::suite::numbers::{count, nanos, rate, times};
use crate::suite::port::{ANSWER, QUESTION, Wire};
use crate::suite::report::{Figure, Section};
use crate::suite::server::Server;
use crate::suite::stats::{ROUNDS, Sample, alternate};

/// A move that is under way when the end comes: an hour.
const MOVE: &[u8] = b"@0A7200000,2000,0,900,0,900,0,900\r";

/// The longest end, nanoseconds.
const END: f64 = 50e6;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let mut section = Section::default();
    reconnecting(bench, &mut section)?;
    ending(bench, &mut section, 1, bench.either(20, 5))?;
    ending(bench, &mut section, 1_000, bench.either(5, 1))?;
    Ok(section)
}

/// A client that asks something, closes, and connects again at once.
fn reconnecting(bench: &Bench, section: &mut Section) -> Outcome<()> {
    let visits = bench.either(1_000, 200);
    let mut refused = 0;
    let (echo, vimc4) = bench
        .cores
        .server
        .run(|| Ok((bench.launcher.baseline("tcp")?, bench.launcher.emulator(&[])?)))?;
    let rates = bench.cores.client.run(|| {
        let visit =
            |server: &Server, answer| Wire::connect(server.address()?)?.ask(QUESTION, answer);
        alternate(
            ROUNDS,
            || {
                let began = Instant::now();
                for _ in 0..visits {
                    visit(&echo, QUESTION.len())?;
                }
                Ok(f64::from(visits) / began.elapsed().as_secs_f64())
            },
            || {
                let began = Instant::now();
                for _ in 0..visits {
                    refused += u32::from(visit(&vimc4, ANSWER).is_err());
                }
                Ok(f64::from(visits) / began.elapsed().as_secs_f64())
            },
        )
    })?;
    section.add(
        Figure::new(
            "clients that connect at once after the last has closed",
            format!("{}, {}", rate(rates.ours), times(rates.ratio())),
        )
        .baseline(rate(rates.baseline)),
    );
    let total = f64::from(visits) * ROUNDS as f64;
    section.add(
        Figure::new(format!("… refused of {}", count(total)), refused.to_string())
            .target("none", refused == 0),
    );
    Ok(())
}

/// SIGTERM while a client is connected and a move is under way.
fn ending(bench: &Bench, section: &mut Section, controllers: u16, rounds: u32) -> Outcome<()> {
    let mut ends = Sample::default();
    let mut clean = true;
    for _ in 0..rounds {
        let server = bench.launcher.emulator(&["--count", &controllers.to_string()])?;
        let (address, links) = (server.address()?, server.links().to_vec());
        let mut wire = server.connect()?;
        wire.ask(b"@07\r", 1)?;
        wire.send(MOVE)?;
        ends.add(server.terminate()?.as_nanos() as f64);
        clean &= TcpListener::bind(address).is_ok();
        // Looking at what a link leads to would not find one that leads nowhere.
        clean &= links.iter().all(|link| link.symlink_metadata().is_err());
    }
    let what = if controllers == 1 {
        "a controller".to_owned()
    } else {
        count(f64::from(controllers)) + " controllers"
    };
    let median = ends.median();
    let after = if clean { "port free, links gone" } else { "port or links left" };
    section.add(
        Figure::new(
            format!("from SIGTERM to the end of {what}, median of {rounds}"),
            format!("{}; {after}", nanos(median)),
        )
        .target("≤ 50 ms, port free at once", median <= END && clean),
    );
    Ok(())
}
