//! What it costs to record: round trips of a controller that is recorded beside one that is not,
//! and those through a tap beside those without it.

use std::time::{Duration, Instant};

use crate::suite::Bench;
use crate::suite::failure::Outcome;
use crate::suite::numbers::nanos;
use crate::suite::port::{ANSWER, ISEL, QUESTION, Wire};
use crate::suite::report::{Figure, Section};
use crate::suite::server::Server;
use crate::suite::stats::{Pair, ROUNDS, Sample, alternate};

/// How many times the rounds of other groups take turns here: a difference of one per cent must
/// show.
const TURNS: usize = 5 * ROUNDS;

/// The least share of the round trips that is left.
const LEAST: f64 = 0.97;

/// How much longer all but a hundredth of the answers may take through a tap, nanoseconds.
const LONGER: f64 = 1e6;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span = bench.either(Duration::from_millis(500), Duration::from_millis(60));
    let mut section = Section::default();
    recorded(bench, &mut section, "TCP", |server| server.connect()?.ping(ISEL, span))?;
    recorded(bench, &mut section, "a pseudo-terminal", |server| server.open()?.ping(ISEL, span))?;
    tapped(bench, &mut section, bench.either(20_000, 2_000))?;
    section.note(
        "The recording lies where temporary files do. What is compared is asked by turns, each of a \
         process of its own on the same core. The tap is a process between client and controller, on \
         the controller's core.",
    );
    Ok(section)
}

/// Lets a controller that is recorded and one that is not take turns.
fn recorded(
    bench: &Bench,
    section: &mut Section,
    line: &str,
    ping: impl Fn(&Server) -> Outcome<f64>,
) -> Outcome<()> {
    let file =
        bench.launcher.file("recording", "")?.with_extension(format!("{}.jsonl", line.len()));
    let file = file.display().to_string();
    let servers = bench.cores.server.run(|| {
        let baseline = bench.launcher.emulator(&[])?;
        Ok(Pair { baseline, ours: bench.launcher.emulator(&["--record", &file])? })
    })?;
    let rates = bench
        .cores
        .client
        .run(|| alternate(TURNS, || ping(&servers.baseline), || ping(&servers.ours)))?;
    section.add(Figure::rates(format!("round trips over {line}, recorded"), rates, LEAST));
    Ok(())
}

/// Lets answers through a tap and without one take turns.
fn tapped(bench: &Bench, section: &mut Section, questions: usize) -> Outcome<()> {
    let file = bench.launcher.file("tapped", "")?.with_extension("jsonl").display().to_string();
    let (device, _behind, tap) = bench.cores.server.run(|| {
        let (device, behind) = (bench.launcher.emulator(&[])?, bench.launcher.emulator(&[])?);
        let address = behind.address()?.to_string();
        let mut command = bench.launcher.command();
        command.args(["record", &file, "--device", &address, "--tcp", "127.0.0.1:0"]);
        Ok((device, behind, Server::start(command)?))
    })?;
    let (direct, through) = bench.cores.client.run(|| {
        let (mut direct, mut through) = (device.connect()?, tap.connect()?);
        let (mut without, mut with) = (Sample::default(), Sample::default());
        for _ in 0..questions {
            without.add(answered(&mut direct)?);
            with.add(answered(&mut through)?);
        }
        Ok((without, with))
    })?;
    let [p50, p99] = [0.5, 0.99].map(|share| through.quantile(share) - direct.quantile(share));
    section.add(
        Figure::new(
            "what a tap adds to an answer over TCP: p50, p99",
            format!("{}, {}", nanos(p50), nanos(p99)),
        )
        .baseline(nanos(direct.median()))
        .target(format!("p99 ≤ {}", nanos(LONGER)), p99 <= LONGER),
    );
    Ok(())
}

/// How long an answer takes, nanoseconds.
fn answered(wire: &mut Wire) -> Outcome<f64> {
    let began = Instant::now();
    wire.ask(QUESTION, ANSWER)?;
    Ok(began.elapsed().as_nanos() as f64)
}
