//! What a controller notices of a neighbour that is flooded with garbage.

use std::io::{Read, Write};
use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};

use vimc4_device::{Device, Time};

use crate::suite::Bench;
use crate::suite::failure::{Doing, Failure, Outcome};
use crate::suite::numbers::{bytes, count, nanos, times};
use crate::suite::play::{bench as machine, controller, play};
use crate::suite::port::{ANSWER, QUESTION, Wire};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{Pair, ROUNDS, Sample};

/// The size of the garbage, which is sent over and over.
const BLOCK: usize = 1_000_000;

/// Garbage, and how many bytes a controller answers to it.
struct Garbage {
    block: Vec<u8>,
    answer: usize,
}

/// A flood that is over.
#[derive(Clone, Copy, Default)]
struct Flood {
    /// Bytes sent.
    sent: usize,
    /// Bytes that came back.
    answered: usize,
    seconds: f64,
}

/// Round trips without a flood and beside one, nanoseconds; and the floods together.
#[derive(Default)]
struct Latency {
    quiet: Sample,
    flooded: Sample,
    flood: Flood,
}

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let blocks = bench.either(20, 2);
    let quiet = bench.either(Duration::from_secs(2), Duration::from_millis(300));
    let garbage = Garbage::new()?;
    // Two processes: what they do to each other is what the machine does.
    let echoes = [bench.launcher.baseline("tcp")?, bench.launcher.baseline("tcp")?];
    let vimc4 = bench.launcher.emulator(&["--count", "2"])?;
    let &[flooded, asked] = vimc4.addresses() else {
        return Err(Failure::new("two controllers do not have two ports"));
    };
    let before = vimc4.memory()?;
    let mut latency = Pair { baseline: Latency::default(), ours: Latency::default() };
    for _ in 0..ROUNDS {
        latency.baseline.add(
            (echoes[0].address()?, garbage.block.len()),
            (echoes[1].address()?, QUESTION.len()),
            &garbage.block,
            (quiet, blocks),
        )?;
        latency.ours.add(
            (flooded, garbage.answer),
            (asked, ANSWER),
            &garbage.block,
            (quiet, blocks),
        )?;
    }
    let after = vimc4.memory()?;

    let mut section = Section::default();
    for (name, share, has_target) in [("median", 0.5, true), ("p99", 0.99, false)] {
        let quantiles = |of: &Latency| Pair {
            baseline: of.quiet.quantile(share),
            ours: of.flooded.quantile(share),
        };
        let (echo, ours) = (quantiles(&latency.baseline), quantiles(&latency.ours));
        let text = |pair: Pair<f64>| {
            format!("{} → {}, {}", nanos(pair.baseline), nanos(pair.ours), times(pair.ratio()))
        };
        let figure = Figure::new(format!("round trip beside a flood, {name}"), text(ours))
            .baseline(text(echo));
        section.add(match has_target {
            true => figure.target(
                "≤ 1.1 ×, or no more than the echo's",
                ours.ratio() <= 1.1 || ours.ratio() <= echo.ratio(),
            ),
            false => figure,
        });
    }
    let Flood { sent, answered, seconds } = latency.ours.flood;
    let speed = |flood: Flood| format!("{} /s", bytes(flood.sent as f64 / flood.seconds));
    section.add(
        Figure::new("garbage taken", speed(latency.ours.flood))
            .baseline(speed(latency.baseline.flood)),
    );
    let due = sent / BLOCK * garbage.answer;
    section.add(
        Figure::new(
            format!("answers to {} of garbage", bytes(sent as f64)),
            format!("{} bytes of {}", count(answered as f64), count(due as f64)),
        )
        .target("all", answered == due),
    );
    section.add(Figure::new(
        "memory of the emulator, before and after (VmRSS)",
        format!("{}, {}", bytes(before.resident), bytes(after.resident)),
    ));
    section.note(format!(
        "Nothing is pinned. Without a flood the cores fall asleep between a question and its \
         answer, and waking them takes most of the time; beside a flood they are awake. The echo \
         beside a flooded echo, each in a process of its own, shows what the flood's client and \
         server do to everybody else on this machine. The garbage are lines of random bytes, some \
         20 long: {} lines a second.",
        count(answered as f64 / seconds)
    ));
    Ok(section)
}

impl Garbage {
    /// Random lines, and what a controller answers to them in virtual time. Without the three
    /// bytes that act at once wherever they are: one of them is a reset.
    fn new() -> Outcome<Garbage> {
        let mut state = 1_u64;
        let mut random = || {
            // The high bits of a linear congruence are random enough for garbage.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            state >> 33
        };
        let byte = |_| if random().is_multiple_of(20) { b'\r' } else { (random() % 253) as u8 };
        let mut block: Vec<u8> = (1..BLOCK).map(byte).collect();
        block.push(b'\r');
        let mut device = controller(machine()?)?;
        let answer = play(&mut device, &block).bytes;
        if play(&mut device, &block).bytes != answer || device.now() != Time::ZERO {
            return Err(Failure::new("the garbage is a command that changes something"));
        }
        Ok(Garbage { block, answer })
    }
}

impl Latency {
    /// Asks one server without and with a flood of the other. With each address goes what
    /// comes back: of a block of the flood, and of a question.
    fn add(
        &mut self,
        (flooded, comes_back): (SocketAddr, usize),
        (asked, answer): (SocketAddr, usize),
        block: &[u8],
        (quiet, blocks): (Duration, usize),
    ) -> Outcome<()> {
        let mut wire = Wire::connect(asked)?;
        let until = Instant::now() + quiet;
        while Instant::now() < until {
            self.quiet.add(round_trip(&mut wire, answer)?);
        }
        thread::scope(|scope| {
            let flood = scope.spawn(|| flood(flooded, block, blocks, comes_back * blocks));
            while !flood.is_finished() {
                self.flooded.add(round_trip(&mut wire, answer)?);
            }
            let flood = flood.join().unwrap_or_else(|_| Err(Failure::new("the flood failed")))?;
            self.flood.sent += flood.sent;
            self.flood.answered += flood.answered;
            self.flood.seconds += flood.seconds;
            Ok(())
        })
    }
}

/// Nanoseconds from a question to its answer.
fn round_trip(wire: &mut Wire, answer: usize) -> Outcome<f64> {
    let began = Instant::now();
    wire.ask(QUESTION, answer)?;
    Ok(began.elapsed().as_nanos() as f64)
}

/// Sends a block over and over as fast as it is taken, and reads what comes back.
fn flood(address: SocketAddr, block: &[u8], blocks: usize, comes_back: usize) -> Outcome<Flood> {
    let mut stream = Wire::connect(address)?.into_stream();
    let mut other_end = stream.try_clone().doing("read beside writing")?;
    thread::scope(|scope| {
        let reader = scope.spawn(move || {
            let mut buffer = vec![0; 64 * 1024];
            let mut answered = 0;
            while answered < comes_back {
                match other_end.read(&mut buffer) {
                    Ok(count) if count > 0 => answered += count,
                    // Nothing more comes; how much is missing is reported.
                    _ => break,
                }
            }
            answered
        });
        let began = Instant::now();
        for _ in 0..blocks {
            stream.write_all(block).doing("flood the line")?;
        }
        let answered = reader.join().unwrap_or_default();
        let seconds = began.elapsed().as_secs_f64();
        Ok(Flood { sent: blocks * block.len(), answered, seconds })
    })
}
