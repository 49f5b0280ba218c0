//! The guide `docs/library.md` says what is so: it quotes files of the tree, and its sessions
//! go as shown.
//!
//! What needs a tool that is missing is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead, so that nothing is left out unnoticed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::Value;
use vimc4::{Clock, Emulator};

const GUIDE: &str = include_str!("../../docs/library.md");

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
    shell.output()
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

/// The five mistakes of the sample driver are found in one sweep, each in a recording of at most 30 lines;
/// nothing is found in the driver without them.
fn the_mistakes_of_the_drill_are_found() -> Outcome {
    let folder = tempfile::tempdir()?;
    // One of each kind suffices, and so does a part of the bytes of the longer driver.
    let sweep = |driver: &str, more: &str, code: i32| -> Result<Value, Failed> {
        let driver = root().join("examples/sweep").join(driver);
        let line = format!(
            "\"$VIMC4\" sweep --json --modes transient {more} -- python3 {} {{port}}",
            driver.display()
        );
        let output = sh(folder.path(), &line)?;
        if output.status.code() != Some(code) {
            let said = [output.stdout, output.stderr].concat();
            return Err(format!("{line}: {}: {}", output.status, String::from_utf8(said)?).into());
        }
        Ok(serde_json::from_slice(&output.stdout)?)
    };
    let report = sweep("drill.py", "--out drill --limit 5s --jobs 8", 1)?;
    let outcomes: Vec<&Value> = report["outcomes"].as_array().into_iter().flatten().collect();
    let bad = |outcome: &&&Value| {
        outcome["outcome"]["verdicts"].as_array().is_some_and(|v| !v.is_empty())
    };
    let found = |title: &str, broken: &str, heard: &str| {
        let text =
            |outcome: &Value, key: &str| outcome[key].as_str().unwrap_or_default().to_owned();
        let is_it = |outcome: &&&Value| {
            text(outcome, "title").starts_with(title)
                && text(outcome, "broken").contains(broken)
                && text(outcome, "heard").contains(heard)
        };
        outcomes.iter().filter(bad).any(|outcome| is_it(&outcome))
    };
    let mistakes = [
        ("it reports success", "STOP was pressed", "`F` as"),
        ("it hangs", "", "less than a whole answer to `@#P`"),
        ("it reports success", "limit switch was hit", "`2` as"),
        ("it reports success", "the answer to `@0A", "no answer to `@#A#"),
        ("it moves before it has made a reference run", "the power failed", ""),
    ];
    for (title, broken, heard) in mistakes {
        if !found(title, broken, heard) {
            return Err(format!("not found: {title}, {broken}, {heard}, in {report:#}").into());
        }
    }
    for outcome in outcomes.iter().filter(bad) {
        let case = folder.path().join(outcome["recording"].as_str().unwrap_or_default());
        let lines = fs::read_to_string(&case)?.lines().count();
        let output = sh(folder.path(), &format!("\"$VIMC4\" replay '{}'", case.display()))?;
        if lines > 30 || !output.status.success() {
            return Err(format!("{}: {lines} lines, {}", case.display(), output.status).into());
        }
    }
    let report = sweep("mended.py", "--out mended --limit 60s --jobs 8 --shard 1/4", 0)?;
    match report["done"].as_u64() {
        Some(200..) => Ok(()),
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
