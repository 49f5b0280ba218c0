//! How fast `@0P` is answered, compared with an echo on the same core.

use std::time::{Duration, Instant};

use crate::suite::Bench;
use crate::suite::crowd::Crowd;
use crate::suite::failure::Outcome;
use crate::suite::numbers::{nanos, rate, times};
use crate::suite::port::{ANSWER, QUESTION};
use crate::suite::report::{Figure, Section};
use crate::suite::server::Server;
use crate::suite::stats::{Pair, ROUNDS, alternate};

/// How many clients there are when there are many.
const MANY: usize = 50;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span = bench.either(Duration::from_secs(2), Duration::from_millis(300));
    let mut section = Section::default();
    compare(
        bench,
        &mut section,
        ("one client over TCP", 0.9),
        || bench.launcher.baseline("tcp"),
        || bench.launcher.emulator(&[]),
        |server, answer| server.connect()?.ping(answer, span),
    )?;
    compare(
        bench,
        &mut section,
        ("50 clients over TCP, a controller each", 0.8),
        || bench.launcher.baseline("tcp"),
        || bench.launcher.emulator(&["--count", &MANY.to_string()]),
        |server, answer| ping_together(server, answer, span),
    )?;
    compare(
        bench,
        &mut section,
        ("one client over a pseudo terminal", 0.9),
        || bench.launcher.baseline("pty"),
        || bench.launcher.emulator(&[]),
        |server, answer| server.open()?.ping(answer, span),
    )?;
    section.note(
        "The emulator answers 19 bytes to `@0P`, the echo the 4 it was asked with. The processor \
         time is the server's; where the client is the slower one, it shows what the rate hides.",
    );
    Ok(section)
}

/// Lets a baseline and the emulator take turns on the same core.
fn compare(
    bench: &Bench,
    section: &mut Section,
    (what, least): (&str, f64),
    baseline: impl FnOnce() -> Outcome<Server>,
    ours: impl FnOnce() -> Outcome<Server>,
    ping: impl Fn(&Server, usize) -> Outcome<f64>,
) -> Outcome<()> {
    let servers = bench.cores.server.run(|| Ok(Pair { baseline: baseline()?, ours: ours()? }))?;
    let mut spent = Pair { baseline: Spent::default(), ours: Spent::default() };
    let rates = bench.cores.client.run(|| {
        alternate(
            ROUNDS,
            || spent.baseline.during(&servers.baseline, || ping(&servers.baseline, QUESTION.len())),
            || spent.ours.during(&servers.ours, || ping(&servers.ours, ANSWER)),
        )
    })?;
    let ratio = rates.ratio();
    section.add(
        Figure::new(
            format!("round trips, {what}"),
            format!("{}, {}", rate(rates.ours), times(ratio)),
        )
        .baseline(rate(rates.baseline))
        .target(format!("≥ {least} ×"), ratio >= least),
    );
    section.add(
        Figure::new("… processor time for each", nanos(spent.ours.nanos_each()))
            .baseline(nanos(spent.baseline.nanos_each())),
    );
    Ok(())
}

/// What a server spends on round trips.
#[derive(Default)]
struct Spent {
    time: Duration,
    rounds: f64,
}

impl Spent {
    /// Measures a rate of round trips, and what they cost the server.
    fn during(&mut self, server: &Server, ping: impl FnOnce() -> Outcome<f64>) -> Outcome<f64> {
        let (before, began) = (server.usage()?, Instant::now());
        let rate = ping()?;
        self.rounds += rate * began.elapsed().as_secs_f64();
        self.time += server.usage()?.since(before).time;
        Ok(rate)
    }

    fn nanos_each(&self) -> f64 {
        self.time.as_nanos() as f64 / self.rounds
    }
}

/// Round trips in a second of many clients, each of which asks again when it is answered. A
/// server with a single port gets them all there.
fn ping_together(server: &Server, answer: usize, span: Duration) -> Outcome<f64> {
    let mut crowd = Crowd::connect(server.addresses().iter().copied().cycle().take(MANY))?;
    let mut received = vec![0; crowd.len()];
    for client in 0..crowd.len() {
        crowd.send(client, QUESTION)?;
    }
    let (began, mut rounds) = (Instant::now(), 0.0);
    crowd.converse(began + span, |client, count| {
        received[client] += count;
        if received[client] < answer {
            return None;
        }
        received[client] = 0;
        rounds += 1.0;
        Some(QUESTION)
    })?;
    Ok(rounds / began.elapsed().as_secs_f64())
}
