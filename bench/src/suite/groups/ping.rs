//! How fast a controller says where it is, compared with an echo on the same core, and one
//! family of controllers with the other.

use std::time::{Duration, Instant};

use crate::suite::Bench;
use crate::suite::crowd::Crowd;
use crate::suite::failure::Outcome;
use crate::suite::numbers::nanos;
use crate::suite::port::{ECHO, ISEL, LPKF, QUESTION, Question};
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
        (ECHO, ISEL),
        || bench.launcher.baseline("tcp"),
        || bench.launcher.emulator(&[]),
        |server, question| server.connect()?.ping(question, span),
    )?;
    compare(
        bench,
        &mut section,
        ("50 clients over TCP, a controller each", 0.8),
        (ECHO, ISEL),
        || bench.launcher.baseline("tcp"),
        || bench.launcher.emulator(&["--count", &MANY.to_string()]),
        |server, (_, answer)| ping_together(server, answer, span),
    )?;
    compare(
        bench,
        &mut section,
        ("one client over a pseudo-terminal", 0.9),
        (ECHO, ISEL),
        || bench.launcher.baseline("pty"),
        || bench.launcher.emulator(&[]),
        |server, question| server.open()?.ping(question, span),
    )?;
    let board = &["--model", "smcu"][..];
    compare(
        bench,
        &mut section,
        ("one client over TCP, an SMCU beside an IMC4", 0.9),
        (ISEL, LPKF),
        || bench.launcher.emulator(&[]),
        || bench.launcher.emulator(board),
        |server, question| server.connect()?.ping(question, span),
    )?;
    compare(
        bench,
        &mut section,
        ("one client over a pseudo-terminal, an SMCU beside an IMC4", 0.9),
        (ISEL, LPKF),
        || bench.launcher.emulator(&[]),
        || bench.launcher.emulator(board),
        |server, question| server.open()?.ping(question, span),
    )?;
    compare(
        bench,
        &mut section,
        ("one client over TCP, with VIMC4_LOG=info beside without", 0.97),
        (ISEL, ISEL),
        || bench.launcher.emulator(&[]),
        || bench.launcher.traced("info", &[]),
        |server, question| server.connect()?.ping(question, span),
    )?;
    section.note(
        "An IMC4 answers 19 bytes to `@0P`, an SMCU 9 to `!ON0;`, the echo the 4 it was asked \
         with. The processor \
         time is the server's; where the client is the slower one, it shows what the rate hides.",
    );
    Ok(section)
}

/// Lets a baseline and the emulator take turns on the same core.
fn compare(
    bench: &Bench,
    section: &mut Section,
    (what, least): (&str, f64),
    (asked, ours_asked): (Question, Question),
    baseline: impl FnOnce() -> Outcome<Server>,
    ours: impl FnOnce() -> Outcome<Server>,
    ping: impl Fn(&Server, Question) -> Outcome<f64>,
) -> Outcome<()> {
    let servers = bench.cores.server.run(|| Ok(Pair { baseline: baseline()?, ours: ours()? }))?;
    let mut spent = Pair { baseline: Spent::default(), ours: Spent::default() };
    let rates = bench.cores.client.run(|| {
        alternate(
            ROUNDS,
            || spent.baseline.during(&servers.baseline, || ping(&servers.baseline, asked)),
            || spent.ours.during(&servers.ours, || ping(&servers.ours, ours_asked)),
        )
    })?;
    section.add(Figure::rates(format!("round trips, {what}"), rates, least));
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
