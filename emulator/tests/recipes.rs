//! The guide `docs/library.md` says what is so: it quotes files of the tree, and its sessions
//! go as shown; and so does the sample project of `docs/sweep.md`.
//!
//! What needs a tool that is missing is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead, so that nothing is left out unnoticed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::InTime;

use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::Value;
use vimc4::{Clock, Emulator};

const GUIDE: &str = include_str!("../../docs/library.md");
const SWEEPS: &str = include_str!("../../docs/sweep.md");

type Outcome = Result<(), Failed>;

/// A block of the guide between fences.
#[derive(Default)]
struct Block {
    language: &'static str,
    /// The last line with text before it.
    heading: &'static str,
    lines: Vec<&'static str>,
}

fn blocks() -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut open: Option<Block> = None;
    let mut heading = "";
    for line in GUIDE.lines() {
        match (open.take(), line.strip_prefix("```")) {
            (None, Some(language)) => open = Some(Block { language, heading, lines: Vec::new() }),
            (None, None) if line.is_empty() => {}
            (None, None) => heading = line,
            (Some(block), Some(_)) => blocks.push(block),
            (Some(mut block), None) => {
                block.lines.push(line);
                open = Some(block);
            }
        }
    }
    blocks
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn sh(folder: &Path, command: &str) -> std::io::Result<std::process::Output> {
    let mut shell = Command::new("sh");
    shell.args(["-c", command]).current_dir(folder);
    // The recipes find the program that belongs to this test, and leave nothing behind.
    shell.env("VIMC4", env!("CARGO_BIN_EXE_vimc4")).env("PYTHONDONTWRITEBYTECODE", "1");
    shell.output_in_time()
}

fn has(command: &str) -> bool {
    sh(&root(), command).is_ok_and(|output| output.status.success())
}

/// Every block of code is part of the file that the line before it links to.
fn code_is_quoted_from_files() -> Outcome {
    let mut languages = Vec::new();
    for Block { language, heading, lines } in blocks() {
        if !["rust", "python", "c", "text"].contains(&language) {
            continue;
        }
        let path = heading.split_once("](../").and_then(|(_, rest)| rest.split_once(')'));
        let Some((path, _)) = path else {
            return Err(format!("no line that links to the file stands before {lines:#?}").into());
        };
        if !fs::read_to_string(root().join(path))?.contains(&lines.join("\n")) {
            return Err(format!("{path} does not contain {lines:#?}").into());
        }
        languages.push(language);
    }
    for language in ["rust", "python", "c", "text"] {
        if !languages.contains(&language) {
            return Err(format!("the guide quotes nothing in {language}").into());
        }
    }
    Ok(())
}

/// The session with the C program, played as it is printed, beside a controller like the one
/// that the guide starts.
fn the_c_session_goes_as_shown() -> Outcome {
    let folder = tempfile::tempdir()?;
    fs::copy(root().join("examples/c/axis.c"), folder.path().join("axis.c"))?;
    let emulator = Emulator::builder()
        .machine("mill")
        .time(Clock::Instant)
        .pty(folder.path().join("vimc4.pty"))
        .start()?;
    let session =
        blocks().into_iter().find(|b| b.lines.iter().any(|line| line.starts_with("$ cc")));
    let session = session.ok_or("the guide shows no session with cc")?.lines;
    let mut printed = String::new();
    for command in session.iter().filter_map(|line| line.strip_prefix("$ ")) {
        let output = sh(folder.path(), command)?;
        printed += &format!("$ {command}\n");
        printed += &String::from_utf8(output.stdout)?;
        printed += &String::from_utf8(output.stderr)?;
    }
    if printed.trim_end() != session.join("\n") {
        return Err(format!("the session went so:\n{printed}").into());
    }
    c_program_says_why(&emulator, folder.path())
}

/// What a session cannot show: an operator who interferes.
fn c_program_says_why(emulator: &Emulator, folder: &Path) -> Outcome {
    let refused = |arguments: &str, code: i32, why: &str| -> Outcome {
        let output = sh(folder, &format!("./axis {arguments}"))?;
        let said = String::from_utf8(output.stderr)?;
        if output.status.code() != Some(code) || !said.contains(why) || !output.stdout.is_empty() {
            return Err(format!("axis {arguments} said {said}, {}", output.status).into());
        }
        Ok(())
    };
    emulator.turn("cover", "open")?;
    refused("vimc4.pty 100 900", 1, "@0A100,900: the cover is open (H)")?;
    refused("vimc4.pty 100 19", 1, "@0A100,19: ")?;
    emulator.power(false)?;
    refused("vimc4.pty 100 900", 1, "@01: no answer; is the controller on?")?;
    refused("none.pty 100 900", 2, "none.pty: ")?;
    refused("vimc4.pty far 900", 2, "far: a number is expected here")?;
    refused("vimc4.pty 100", 2, "usage: axis PORT STEPS SPEED")
}

/// The tests of the Python driver, run by the command that the guide shows.
fn the_python_tests_pass() -> Outcome {
    let command = GUIDE.lines().find_map(|line| line.strip_prefix("$ python3 -m unittest"));
    let command = command.ok_or("the guide does not show how to run the Python tests")?;
    let output = sh(&root(), &format!("python3 -m unittest{command}"))?;
    let said = String::from_utf8(output.stderr)?;
    // A run that finds no tests succeeds as well.
    if !output.status.success() || said.contains("Ran 0 tests") {
        return Err(said.into());
    }
    Ok(())
}

/// What the report says of an answer that is taken for another's.
const LATE: &str =
    "the answer comes later, before that to another command, and must not be taken for it";

/// The entries of a report without what can differ next time, as the page says: how many points they have,
/// and which of them is the example.
fn entries(report: &str) -> Vec<Vec<&str>> {
    let varies = ["  broken ", "  machine ", "  should ", "  case ", "  printed "];
    let stays = |line: &&str| !varies.iter().any(|begin| line.starts_with(begin));
    let mut entries = Vec::new();
    for entry in report.split("\n\n").filter(|entry| entry.contains(varies[0])) {
        let mut lines = entry.lines();
        let title = lines.next().and_then(|line| line.split_once(" (")).map(|(title, _)| title);
        entries.push(title.into_iter().chain(lines.filter(stays)).collect());
    }
    entries
}

/// The page on sweeps shows its sample project as it is: its tests pass, and one sweep finds the five
/// mistakes of the driver, each in a recording of at most 30 lines. Nothing is found in the driver without
/// them.
fn the_mistakes_of_the_drill_are_found() -> Outcome {
    let folder = tempfile::tempdir()?;
    std::os::unix::fs::symlink(root().join("examples"), folder.path().join("examples"))?;
    let command = SWEEPS.lines().find_map(|line| line.strip_prefix("$ vimc4 sweep "));
    let command = command.ok_or("the page does not show how to sweep the sample project")?;
    let (choice, host) = command.split_once("-- ").ok_or("the page shows no host command")?;
    let sweep = |before: &str, options: &str, code: i32| -> Result<String, Failed> {
        let line = format!("{before}\"$VIMC4\" sweep {options} -- {host}");
        let output = sh(folder.path(), &line)?;
        let said = String::from_utf8(output.stdout)?;
        if output.status.code() != Some(code) {
            let errors = String::from_utf8(output.stderr)?;
            return Err(format!("{line}: {}: {said}{errors}", output.status).into());
        }
        Ok(said)
    };
    let report = sweep("", choice, 1)?;
    let shown: Vec<&str> = SWEEPS.split("```text\n").skip(1).collect();
    let shown: Vec<&str> = shown.iter().filter_map(|it| it.split("```").next()).collect();
    let shown: Vec<Vec<&str>> = shown.iter().flat_map(|it| entries(it)).collect();
    let found = entries(&report);
    if shown.len() != 5
        || !shown.iter().all(|entry| found.contains(entry))
        || !report.contains(LATE)
    {
        return Err(format!("the page shows {shown:#?}, and the report is\n{report}").into());
    }
    for line in report.lines() {
        let Some(case) = line.strip_prefix("  case     ") else { continue };
        let lines = fs::read_to_string(folder.path().join(case))?.lines().count();
        let output = sh(folder.path(), &format!("\"$VIMC4\" replay '{case}'"))?;
        if lines > 30 || !output.status.success() {
            return Err(format!("{case}: {lines} lines, {}", output.status).into());
        }
    }
    // A part of all that can go wrong, since the careful driver says so much more.
    let part = "--modes transient --shard 1/10 --json --out mended";
    let report: Value = serde_json::from_str(&sweep("DRIVER=mended ", part, 0)?)?;
    match report["done"].as_u64() {
        Some(100..) => Ok(()),
        _ => Err(format!("{report:#}").into()),
    }
}

fn main() -> ExitCode {
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let with = |there: bool, reason: &str, name: &str, body: fn() -> Outcome| {
        let name = if there { name.to_owned() } else { format!("{name} ({reason})") };
        Trial::test(name, body).with_ignored_flag(!there && !required)
    };
    let cc = has("cc --version");
    let pyserial = has("python3 -c 'import serial'");
    let trials = vec![
        Trial::test("the guide quotes its code from files", code_is_quoted_from_files),
        with(cc, "needs cc", "the C session goes as shown", the_c_session_goes_as_shown),
        with(
            pyserial,
            "needs python3 with pyserial",
            "the Python tests pass",
            the_python_tests_pass,
        ),
        with(
            pyserial,
            "needs python3 with pyserial",
            "the mistakes of the drill are found",
            the_mistakes_of_the_drill_are_found,
        ),
    ];
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}
