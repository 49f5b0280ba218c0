//! `--coverage` and `vimc4 coverage`: what was met is kept however a program ends, and shown as
//! docs/coverage.md says.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use rustix::process::Signal;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, until};
use process::{Process, VIMC4, ask, connect, root, shell, shown, tcp, vimc4};

const MANUAL: &str = include_str!("../../docs/coverage.md");

fn text(output: &Output) -> String {
    let [out, err] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    format!("{out}{err}")
}

/// What is in a file of coverage: how often this point of a command was met.
fn met(file: &Path, mnemonic: &str, name: &str) -> u64 {
    let coverage = vimc4::read_coverage(file).unwrap();
    let command = coverage.command(mnemonic).unwrap();
    command.points().find(|point| point.name == name).unwrap().met
}

#[test]
fn the_manual_shows_what_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["examples", "bin"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    symlink(VIMC4, folder.path().join("bin/vimc4")).unwrap();
    for name in ["commands.txt", "program.txt", "board.plt"] {
        let file = Path::new("examples").join(name);
        fs::copy(root().join(&file), folder.path().join(&file)).unwrap();
    }
    let shown = shown(MANUAL);
    for (line, expected) in &shown {
        let said = text(&shell(folder.path(), line));
        assert_eq!(said.trim_end(), expected.trim_end(), "docs/coverage.md: {line}");
    }
    assert!(shown.len() >= 9, "{shown:?}");
}

const SERVED: [&str; 6] = ["--pty", "none", "--time", "instant", "--coverage", "coverage.json"];

#[test]
fn what_was_met_is_kept_however_it_ends() {
    for end in [None, Some(Signal::TERM), Some(Signal::INT), Some(Signal::HUP)] {
        let folder = tempfile::tempdir().unwrap();
        let (mut serve, ready) = Process::serve(folder.path(), &SERVED);
        let mut port = connect(tcp(&ready, 0));
        assert_eq!(ask(&mut port, "@01\r@0A5\r", 2), "07");
        match end {
            Some(signal) => serve.signal(signal),
            None => serve.give("quit\n"),
        }
        assert!(serve.child.wait_in_time().unwrap().success(), "{end:?}");
        let file = folder.path().join("coverage.json");
        assert_eq!((met(&file, "@axes", "0"), met(&file, "@A", "7")), (1, 1), "{end:?}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something is left");
    }
}

#[test]
fn several_controllers_and_several_runs_are_added_up() {
    let folder = tempfile::tempdir().unwrap();
    let (mut serve, ready) =
        Process::serve(folder.path(), &[&SERVED[..], &["--count", "3"]].concat());
    for number in [0, 2] {
        assert_eq!(ask(&mut connect(tcp(&ready, number)), "@01\r", 1), "0");
    }
    fs::write(folder.path().join("axes.txt"), "@01\n@0P\n").unwrap();
    let runs: Vec<Process> = (0..8)
        .map(|_| {
            let run = ["run", "axes.txt", "--coverage", "coverage.json"];
            Process::of(vimc4(folder.path(), &run).stdout(Stdio::null()).start().unwrap())
        })
        .collect();
    for mut run in runs {
        assert!(run.child.wait_in_time().unwrap().success());
    }
    serve.signal(Signal::TERM);
    assert!(serve.child.wait_in_time().unwrap().success());
    let file = folder.path().join("coverage.json");
    assert_eq!((met(&file, "@axes", "0"), met(&file, "@P", "0")), (10, 8));
}

#[test]
fn a_run_that_is_interrupted_keeps_what_it_has_met() {
    let folder = tempfile::tempdir().unwrap();
    // For ever: the time and the number of rounds are not limited, and nothing waits.
    let endless = "040,400,0,400,0,400,0,400\n0-40,400,0,400,0,400,0,400\n30,-2\n9\n";
    fs::write(folder.path().join("endless.txt"), endless).unwrap();
    let run = ["run", "endless.txt", "--loops", "4000000000", "--for", "9999h"];
    let mut run = vimc4(folder.path(), &[&run[..], &["--coverage", "coverage.json"]].concat());
    let mut run = Process::of(run.stdout(Stdio::null()).start().unwrap());
    let file = folder.path().join("coverage.json");
    until("there is no file", || fs::read(&file).is_ok_and(|bytes| !bytes.is_empty()));
    run.signal(Signal::TERM);
    assert_eq!(run.child.wait_in_time().unwrap().code(), Some(130));
    assert!(vimc4::read_coverage(&file).is_ok());
}

#[test]
fn a_file_that_cannot_be_used_is_refused_before_anything_begins() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("axes.txt"), "@01\n").unwrap();
    fs::write(at("other.json"), "{}").unwrap();
    let run = |file: &str, model: &str| {
        let run = ["run", "axes.txt", "--model", model, "--coverage", file];
        let output = vimc4(folder.path(), &run).output_in_time().unwrap();
        (output.status.code(), text(&output))
    };
    assert_eq!(run("imc4.json", "imc4").0, Some(0));
    let before = fs::read_to_string(at("imc4.json")).unwrap();
    for (file, model, said) in [
        ("imc4.json", "imc4-m", "it covers the model imc4, and this is imc4-m"),
        ("other.json", "imc4", "it is no coverage that `--coverage` has written"),
        ("nowhere/coverage.json", "imc4", "cannot use the coverage file nowhere/coverage.json"),
    ] {
        let (code, text) = run(file, model);
        assert_eq!(code, Some(2), "{text}");
        assert!(text.contains(said), "{text}");
        assert!(!text.contains("ended"), "it has run: {text}");
    }
    assert_eq!(fs::read_to_string(at("imc4.json")).unwrap(), before);
    assert_eq!(fs::read_to_string(at("other.json")).unwrap(), "{}");
}

/// A folder with the coverage of a few commands, and what `vimc4 coverage` says there.
fn covered() -> (tempfile::TempDir, impl Fn(&[&str]) -> (Option<i32>, String)) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_owned();
    fs::write(path.join("axes.txt"), "@01\n@0A5,900\n").unwrap();
    let run = ["run", "axes.txt", "--coverage", "met.json"];
    assert!(vimc4(&path, &run).output_in_time().unwrap().status.success());
    let coverage = move |arguments: &[&str]| {
        let output = vimc4(&path, &[&["coverage"], arguments].concat()).output_in_time().unwrap();
        (output.status.code(), text(&output))
    };
    (folder, coverage)
}

#[test]
fn no_output_is_written_over_an_input_or_another_output() {
    let (folder, coverage) = covered();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).unwrap();
    symlink(at("met.json"), at("link.json")).unwrap();
    fs::hard_link(at("met.json"), at("hard.json")).unwrap();
    fs::copy(at("met.json"), at("table.txt")).unwrap();
    let before = fs::read(at("met.json")).unwrap();
    let whole = at("met.json");
    for (arguments, twice) in [
        (["met.json", "--html", "met.json"].as_slice(), "met.json"),
        (&["met.json", "--lcov", "met.json"], "met.json"),
        (&["met.json", "--html", "sub/../met.json"], "sub/../met.json"),
        (&["met.json", "--html", whole.to_str().unwrap()], whole.to_str().unwrap()),
        (&["met.json", "--html", "link.json"], "link.json"),
        (&["link.json", "--html", "met.json"], "met.json"),
        (&["met.json", "--html", "hard.json"], "hard.json"),
        // The text of the commands stands beside the tracefile.
        (&["table.txt", "--lcov", "table"], "table.txt"),
        (&["met.json", "--html", "same.out", "--lcov", "same.out"], "same.out"),
        (&["met.json", "--html", "./same.out", "--lcov", "sub/../same.out"], "sub/../same.out"),
        (&["met.json", "--html", "same.txt", "--lcov", "same"], "same.txt"),
    ] {
        let files = fs::read_dir(folder.path()).unwrap().count();
        let (code, said) = coverage(arguments);
        assert_eq!(code, Some(2), "{arguments:?} {said}");
        // Lines are folded where they are long.
        let said = said.replace([' ', '\n', '│', '↳'], "");
        assert!(said.contains(&format!("{twice}isnamedtwice")), "{arguments:?} {said}");
        assert_eq!(fs::read(at("met.json")).unwrap(), before, "{arguments:?}");
        assert_eq!(fs::read(at("table.txt")).unwrap(), before, "{arguments:?}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), files, "{arguments:?}");
    }
    let (code, said) = coverage(&["met.json", "--html", "a.html", "--lcov", "a.info"]);
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn the_tracefile_names_its_text_from_wherever_it_is_read() {
    let (folder, coverage) = covered();
    fs::create_dir(folder.path().join("sub")).unwrap();
    assert_eq!(coverage(&["met.json", "--lcov", "sub/x.info"]).0, Some(0));
    let tracefile = fs::read_to_string(folder.path().join("sub/x.info")).unwrap();
    let named = tracefile.lines().find_map(|line| line.strip_prefix("SF:")).unwrap();
    assert!(Path::new(named).is_absolute(), "{named}");
    assert_eq!(
        fs::canonicalize(named).unwrap(),
        fs::canonicalize(folder.path().join("sub/x.info.txt")).unwrap()
    );
}

/// `vimc4` with no more memory than it needs, so that a test that fails does not take the computer's.
fn with_little_memory(folder: &Path, line: &str) -> (Option<i32>, String) {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("ulimit -v 4000000; exec \"$0\" {line}"), VIMC4]);
    let output = shell.current_dir(folder).stdin(Stdio::null()).output_in_time().unwrap();
    (output.status.code(), text(&output).replace("\n  │ ", " "))
}

#[test]
fn what_never_ends_is_no_file_of_coverage() {
    let (folder, _) = covered();
    assert!(
        Command::new("mkfifo").arg(folder.path().join("pipe")).status_in_time().unwrap().success()
    );
    for (line, said) in [
        ("run axes.txt --coverage /dev/zero", "it is not a regular file"),
        ("run axes.txt --coverage /dev/full", "it is not a regular file"),
        ("run axes.txt --coverage pipe", "it is not a regular file"),
        ("serve --pty none --tcp 0 --coverage /dev/full", "it is not a regular file"),
        ("coverage /dev/zero", "it is longer than 64 MiB"),
    ] {
        let (code, text) = with_little_memory(folder.path(), line);
        assert_eq!(code, Some(2), "{line}: {text}");
        assert!(text.contains(said), "{line}: {text}");
    }
    // What others have written may come through a pipe.
    let (code, text) = with_little_memory(folder.path(), "coverage /dev/stdin < met.json");
    assert_eq!(code, Some(0), "{text}");
}
