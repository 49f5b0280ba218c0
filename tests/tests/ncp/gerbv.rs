//! `gerbv`, a viewer for circuit boards, writes job files for drilling machines.
//!
//! Its export of `fixtures/ncp/gerbv/board.drl` is there as a fixture; where the tool is installed
//! the export is made anew. What is missing is shown as ignored, with the reason; with
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};

use libtest_mimic::{Failed, Trial};
use vimc4_ncp::job::{self, Job, Options, Question, Step};
use vimc4_ncp::{Severity, language};
use vimc4_tests::jobs;

use crate::limits::InTime;
use crate::player::Player;

/// The depth that gerbv writes, in µm.
const DEPTH: i64 = -1_800;
/// µm a step, times 2, on every axis of the bench.
const STEP_TWICE: i64 = 25;

pub(crate) fn trials() -> Vec<Trial> {
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let there = has_gerbv();
    let name = "gerbv/board, exported now";
    let name = if there { name.to_owned() } else { format!("{name} (needs gerbv)") };
    vec![
        Trial::test("gerbv/board", || drills_every_hole(&folder().join("board.ncp"))),
        Trial::test(name, exported_now).with_ignored_flag(!there && !required),
    ]
}

fn folder() -> std::path::PathBuf {
    jobs::folder().join("gerbv")
}

fn has_gerbv() -> bool {
    let mut command = Command::new("gerbv");
    command.arg("--version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status_in_time().is_ok_and(|status| status.success())
}

fn exported_now() -> Result<(), Failed> {
    let made = tempfile::tempdir()?;
    let file = made.path().join("board.ncp");
    let mut command = Command::new("gerbv");
    command.args(["-x", "idrill", "-o"]).arg(&file).arg(folder().join("board.drl"));
    let output = command.output_in_time();
    let output = output.map_err(|error| format!("gerbv does not run: {error}"))?;
    if !output.status.success() || !file.exists() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    drills_every_hole(&file)
}

/// The holes of the board, in steps.
fn holes() -> Result<BTreeSet<(i64, i64)>, Failed> {
    let board = std::fs::read_to_string(folder().join("board.drl"))?;
    let hole = |line: &str| {
        let (x, y) = line.strip_prefix('X')?.split_once('Y')?;
        Some((steps(micrometres(x)?), steps(micrometres(y)?)))
    };
    Ok(board.lines().filter_map(hole).collect())
}

/// A length in mm, such as `12.7`.
fn micrometres(text: &str) -> Option<i64> {
    Some((text.parse::<f64>().ok()? * 1e3).round() as i64)
}

/// The nearest step; no place of the board is half-way.
fn steps(micrometres: i64) -> i64 {
    (2 * micrometres + STEP_TWICE / 2).div_euclid(STEP_TWICE)
}

/// Plays an export. Wherever the drill comes to its depth there must be a hole.
fn drills_every_hole(file: &Path) -> Result<(), Failed> {
    let model = vimc4::model("imc-s8")?;
    let machine = vimc4::machine("bench")?;
    let target = jobs::target(&model, &machine)?;
    let bytes = std::fs::read(file)?;
    let text = language::decode(&bytes);
    let mut said = Vec::new();
    let mut hear = |found: vimc4_ncp::Diagnostic| said.push(found.problem);
    job::check(&text, &target, Options::default(), &mut hear);
    if let Some(problem) = said.iter().find(|problem| problem.severity() == Severity::Error) {
        return Err(problem.to_string().into());
    }
    let mut player = Player::new(vimc4::bare(&model, &machine, &[])?, &[])?;
    let (mut drilled, mut tools) = (BTreeSet::new(), Vec::new());
    let mut job = Job::new(&text, &target, Options::default());
    while let Some(order) = job.next(&mut |_| {}) {
        match &order.step {
            Step::Dwell(micros) => player.pass(micros * 1_000)?,
            Step::Ask(Question::Tool(number)) => tools.push(*number),
            step => player.send(&step.line(target.controller.dialect).ok_or("nothing to send")?)?,
        }
        if let [x, y, z, ..] = player.counters()[..]
            && z == steps(DEPTH)
        {
            drilled.insert((x, y));
        }
    }
    let holes = holes()?;
    if tools.len() != 3 || holes.len() != 12 || drilled != holes {
        return Err(format!("tools {tools:?}, drilled {drilled:?}, not {holes:?}").into());
    }
    Ok(())
}
