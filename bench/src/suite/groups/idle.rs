//! What an idle controller costs.

use std::thread;
use std::time::Duration;

use crate::suite::Bench;
use crate::suite::failure::Outcome;
use crate::suite::numbers::{count, nanos};
use crate::suite::port::{ANSWER, LPKF, QUESTION};
use crate::suite::report::{Figure, Section};
use crate::suite::server::Server;

/// The most processor time in a minute.
const TIME: Duration = Duration::from_millis(10);

/// The most context switches in a minute.
const SWITCHES: u64 = 60;

/// What comes before the idle time has come to an end by then.
const SETTLED: Duration = Duration::from_secs(1);

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span = bench.either(Duration::from_secs(60), Duration::from_secs(10));
    let server = || bench.launcher.emulator(&[]);
    // All wait through the same minute, a process for each state.
    let before = server()?;
    let holding = server()?;
    let (mut wire, mut terminal) = (holding.connect()?, holding.open()?);
    wire.ask(QUESTION, ANSWER)?;
    terminal.ask(QUESTION, ANSWER)?;
    let between = server()?;
    visit(&between)?;
    let after = server()?;
    for _ in 0..100 {
        visit(&after)?;
    }
    let board = bench.launcher.emulator(&["--model", "smcu"])?;
    let (question, answer) = LPKF;
    board.connect()?.ask(question, answer)?;
    board.open()?.ask(question, answer)?;
    let servers = [
        ("before the first client", &before),
        ("with silent clients on both lines", &holding),
        ("between clients", &between),
        ("after a hundred clients", &after),
        ("of an SMCU after a client", &board),
    ];

    thread::sleep(SETTLED);
    let look = || servers.iter().map(|(_, server)| server.usage()).collect::<Outcome<Vec<_>>>();
    let began = look()?;
    thread::sleep(span);
    let ended = look()?;

    let mut section = Section::default();
    for ((when, _), (ended, began)) in servers.iter().zip(ended.into_iter().zip(began)) {
        let used = ended.since(began);
        section.add(
            Figure::new(
                format!("{} s {when}", span.as_secs()),
                format!(
                    "{}, {} switches",
                    nanos(used.time.as_nanos() as f64),
                    count(used.switches as f64)
                ),
            )
            .target("≤ 10 ms, ≤ 60 switches", used.time <= TIME && used.switches <= SWITCHES),
        );
    }
    section.note("Processor time and context switches of all threads of the process.");
    Ok(section)
}

/// Clients come on both lines, ask something, and go.
fn visit(server: &Server) -> Outcome<()> {
    server.connect()?.ask(QUESTION, ANSWER)?;
    server.open()?.ask(QUESTION, ANSWER)
}
