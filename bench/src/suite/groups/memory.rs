//! How much memory idle controllers have.

use crate::suite::Bench;
use crate::suite::failure::Outcome;
use crate::suite::numbers::{bytes, kibibytes};
use crate::suite::port::{ANSWER, LPKF, QUESTION, Wire};
use crate::suite::report::{Figure, Section};
use crate::suite::server::Server;
use crate::suite::usage::Memory;

/// How many controllers there are besides the first.
const MORE: u16 = 1_000;

/// What a whole process with one controller may have, bytes.
const PROCESS: f64 = 5_000_000.0;

/// What a further controller may have, bytes.
const CONTROLLER: f64 = 16.0 * 1024.0;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let alone = bench.launcher.emulator(&[])?;
    let crowd = bench.launcher.emulator(&["--count", &(MORE + 1).to_string()])?;
    let mut section = Section::default();

    let fresh = [alone.memory()?, crowd.memory()?];
    visit(&alone)?;
    visit(&crowd)?;
    let visited = [alone.memory()?, crowd.memory()?];

    let Memory { resident, anonymous } = visited[0];
    section.add(
        Figure::new(
            "one idle controller after a client",
            format!("{} VmRSS, {} RssAnon", bytes(resident), bytes(anonymous)),
        )
        .target("≤ 5 MB VmRSS", resident <= PROCESS),
    );
    let board = bench.launcher.emulator(&["--model", "smcu"])?;
    let (question, answer) = LPKF;
    board.connect()?.ask(question, answer)?;
    let memory = board.memory()?.resident;
    section.add(
        Figure::new("one idle SMCU after a client", format!("{} VmRSS", bytes(memory)))
            .baseline(bytes(resident))
            .target("≤ 1.1 ×", memory <= 1.1 * resident),
    );
    for (when, [one, many]) in [("just started", fresh), ("after a client at each", visited)] {
        let each = |of: fn(&Memory) -> f64| (of(&many) - of(&one)) / f64::from(MORE);
        let resident = each(|memory| memory.resident);
        section.add(
            Figure::new(
                format!("each of {MORE} more idle controllers, {when}"),
                format!(
                    "{} VmRSS, {} RssAnon",
                    kibibytes(resident),
                    kibibytes(each(|memory| memory.anonymous))
                ),
            )
            .target("≤ 16 KiB VmRSS", resident <= CONTROLLER),
        );
    }
    section.note(
        "Every controller has a pseudo-terminal with its link and a TCP port. What the kernel \
         keeps for them is not in these figures; nobody can count it for one process.",
    );
    Ok(section)
}

/// A client connects to every controller, asks something, and leaves.
fn visit(server: &Server) -> Outcome<()> {
    for address in server.addresses() {
        Wire::connect(*address)?.ask(QUESTION, ANSWER)?;
    }
    // The server has noticed the last client's leaving before it answers the next question.
    server.connect()?.ask(QUESTION, ANSWER)
}
