//! How late answers are in real time, compared with a bare timer.

use std::time::{Duration, Instant};

use vimc4_device::Device;

use crate::suite::Bench;
use crate::suite::alarm;
use crate::suite::crowd::Crowd;
use crate::suite::failure::{Doing, Outcome};
use crate::suite::numbers::{count, nanos};
use crate::suite::play::{bench as machine, controller, expect};
use crate::suite::port::Wire;
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{Pair, Sample};

/// How much later than the bare timer's an answer may be, at the 99th percentile, nanoseconds.
const MOST: f64 = 2e6;

/// The bare timer rings so often.
const ALARM: Duration = Duration::from_millis(7);

/// All moves that are sent at first arrive together and wait for each other; those that are sent
/// after this time do not.
const SETTLED: Duration = Duration::from_secs(1);

/// A move and how long it takes, to the nanosecond.
struct Move {
    line: Vec<u8>,
    duration: Duration,
}

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span = bench.either(Duration::from_secs(30), Duration::from_secs(5));
    let mut section = Section::default();
    // The lengths differ, so that nothing keeps step.
    let cases = [
        ("one controller", 1, moves((20..60).step_by(3), 900)?),
        ("500 controllers that move all the time", 500, moves((500..1_000).step_by(7), 2_000)?),
    ];
    for (what, controllers, moves) in cases {
        let Pair { baseline, ours } = lateness(bench, controllers, &moves, span)?;
        let above = ours.quantile(0.99) - baseline.quantile(0.99);
        section.add(
            Figure::new(
                format!("answers of {what}: p50, p99"),
                format!("{} late, {} late", nanos(ours.median()), nanos(ours.quantile(0.99))),
            )
            .baseline(format!("{}, {}", nanos(baseline.median()), nanos(baseline.quantile(0.99))))
            .target("p99 ≤ baseline + 2 ms", above <= MOST),
        );
        section.note(format!(
            "{what}: {} answers, {} alarms.",
            count(ours.count() as f64),
            count(baseline.count() as f64)
        ));
    }
    section.note(
        "The lateness is the time from the client's sending of a move to the arrival of its \
         answer, less the exact time of the move; so the way there and back is in it. The \
         baseline is a timerfd that another thread waits for meanwhile, on the emulator's core.",
    );
    Ok(section)
}

/// Moves of X of these lengths, and how long each takes: played in virtual time.
fn moves(lengths: impl Iterator<Item = u32>, speed: u32) -> Outcome<Vec<Move>> {
    let mut device = controller(machine()?)?;
    expect(&mut device, "@07", b'0')?;
    let play = |length| {
        let began = device.now();
        let line = format!("@0A{length},{speed},0,900,0,900,0,900");
        expect(&mut device, &line, b'0')?;
        let duration = Duration::from_nanos(device.now().nanos_since(began));
        Ok(Move { line: format!("{line}\r").into_bytes(), duration })
    };
    lengths.map(play).collect()
}

/// How late answers are, and how late a timer is at the same time on the same core, nanoseconds.
fn lateness(
    bench: &Bench,
    controllers: usize,
    moves: &[Move],
    span: Duration,
) -> Outcome<Pair<Sample>> {
    let count = controllers.to_string();
    let server = bench.cores.server.run(|| bench.launcher.emulator(&["--count", &count]))?;
    for &address in server.addresses() {
        Wire::connect(address)?.ask(b"@07\r", 1)?;
    }
    bench.cores.client.run(|| {
        let mut crowd = Crowd::connect(server.addresses().iter().copied())?;
        let mut next = moves.iter().cycle();
        let mut under_way = Vec::new();
        for client in 0..crowd.len() {
            let first = next.next().doing("find a move")?;
            under_way.push((Instant::now(), first));
            crowd.send(client, &first.line)?;
        }
        let counted = Instant::now() + SETTLED;
        let until = counted + span;
        let mut ours = Sample::default();
        let baseline = alarm::beside(bench.cores.server, ALARM, until, || {
            crowd.converse(until, |client, _| {
                let (sent, last) = under_way[client];
                let late = sent.elapsed().as_nanos() as f64 - last.duration.as_nanos() as f64;
                if sent > counted {
                    ours.add(late);
                }
                let next = next.next()?;
                under_way[client] = (Instant::now(), next);
                Some(&next.line)
            })
        })?;
        Ok(Pair { baseline, ours })
    })
}
