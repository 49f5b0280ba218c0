//! What is written to streams: standard output and standard error, what is open already, pipes and devices.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{InTime, Timed, in_time};
use process::{Process, VIMC4, said, shell};
use rustix::process::Signal;

/// A folder with `vimc4`, a list of commands, and a program without an end.
fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("bin")).unwrap();
    symlink(VIMC4, path.join("bin/vimc4")).unwrap();
    written(path, "list.txt", "@07\n@0A100,900,0,900,0,900,0,900\n");
    let lines = "0400,2000,0,900,0,900,0,900\n0-400,2000,0,900,0,900,0,900\n3 0,-2\n9\n";
    written(path, "endless.txt", lines);
    folder
}

fn written(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

/// What is in a folder.
fn names(folder: &Path) -> Vec<String> {
    let all = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        all.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn pipe(folder: &Path, name: &str) {
    assert!(Command::new("mkfifo").arg(folder.join(name)).status_in_time().unwrap().success());
}

/// Where standard output leads to a file, what else is written there stays, however its name is written.
#[test]
fn what_is_drawn_to_standard_output_is_added() {
    let folder = bench();
    let path = folder.path();
    symlink("/dev/stdout", path.join("link.svg")).unwrap();
    symlink("link.svg", path.join("link.vcd")).unwrap();
    symlink("/dev/fd", path.join("open")).unwrap();
    for (name, to) in [
        ("/dev/stdout", ">>"),
        ("/dev/fd/1", ">>"),
        ("/dev/stderr", "2>>"),
        ("link.vcd", ">>"),
        ("open/1", ">>"),
        ("open/../fd/2", "2>>"),
    ] {
        written(path, "all.txt", "before\n");
        let run = format!("bin/vimc4 run list.txt --machine mill --as gcode {name}");
        let line = format!("{{ {run}; echo behind >&2; echo behind; }} {to} all.txt");
        let (code, _, err) = said(shell(path, &line));
        assert_eq!(code, 0, "{err}");
        let all = read(path, "all.txt");
        assert!(all.starts_with("before\n") && all.contains("\nG1 "), "{name}: {all}");
        assert!(all.ends_with("\nbehind\n"), "{name}: {all}");
    }
    let before = names(path);
    for (option, sign) in [
        ("--vcd /dev/stdout", "$timescale"),
        ("--vcd link.vcd", "$timescale"),
        ("--csv /dev/stdout", "seconds,signal"),
        ("--perfetto /dev/stdout", "\"traceEvents\""),
        ("--trace /dev/stdout", "seconds,X"),
        ("--plot link.svg", "</svg>"),
    ] {
        for to in [">", ">>"] {
            written(path, "all.txt", "before\n");
            let line = format!("bin/vimc4 run list.txt {option} {to} all.txt");
            let (code, _, err) = said(shell(path, &line));
            assert_eq!(code, 0, "{err}");
            let all = read(path, "all.txt");
            assert_eq!(all.starts_with("before\n"), to == ">>", "{option}: {all}");
            assert!(all.contains(sign), "{option}: {all}");
            assert!(all.ends_with("every command was answered\n"), "{option}: {all}");
        }
        assert!(!Path::new("/dev/stdout.gtkw").exists(), "{option}");
        assert_eq!(names(path), before, "{option}");
    }
    // A page that is added overwrites nothing.
    let line = "bin/vimc4 run list.txt --record of.jsonl; echo before > all.txt; \
                bin/vimc4 replay of.jsonl --html /dev/stdout >> all.txt";
    let (code, _, err) = said(shell(path, line));
    let all = read(path, "all.txt");
    assert!(code == 0 && all.starts_with("before\n<!doctype html>"), "{err}{all}");
}

/// What somebody holds open is added to as well, and is left as it is by what cannot be added.
#[test]
fn what_is_open_already_is_added_to() {
    let folder = bench();
    let path = folder.path();
    symlink("/dev/fd/3", path.join("link.svg")).unwrap();
    written(path, "all.txt", "");
    let before = names(path);
    for option in [
        "--csv /dev/fd/3",
        "--vcd /dev/fd/3",
        "--trace /dev/fd/3",
        "--as dxf /dev/fd/3",
        "--plot link.svg",
        "--csv link.svg",
    ] {
        written(path, "all.txt", "before\n");
        let line = format!("bin/vimc4 run list.txt {option} 3>>all.txt");
        let (code, _, err) = said(shell(path, &line));
        assert_eq!(code, 0, "{option}: {err}");
        let all = read(path, "all.txt");
        assert!(all.starts_with("before\n") && all.len() > 100, "{option}: {all}");
        assert_eq!(names(path), before, "{option}");
    }
    // And who holds it open goes on behind it.
    for option in ["--csv /dev/fd/3", "--trace link.svg", "--plot link.svg"] {
        let run = format!("bin/vimc4 run list.txt {option} > /dev/null");
        let line = format!("{{ echo before >&3; {run}; echo after >&3; }} 3>all.txt");
        let (code, _, err) = said(shell(path, &line));
        assert_eq!(code, 0, "{option}: {err}");
        let all = read(path, "all.txt");
        let is_whole = all.starts_with("before\nseconds,") || all.starts_with("before\n<svg");
        assert!(is_whole && all.ends_with("\nafter\n"), "{option}: {all}");
    }
    // The beginning of this one is written last, which would be in the midst of something else.
    for name in ["/dev/fd/3", "/dev/stdout", "link.svg", "-"] {
        written(path, "all.txt", "before\n");
        written(path, "other.vcd", "before\n");
        let line = format!(
            "bin/vimc4 run list.txt --vcd other.vcd --fst {name} 3>>all.txt | cat >> all.txt"
        );
        let (_, _, err) = said(shell(path, &line));
        assert!(
            err.contains("needs a file of its own") && !err.contains("/dev/stdout to"),
            "{err}"
        );
        assert_eq!(read(path, "all.txt"), "before\n", "{name}");
        assert_eq!(read(path, "other.vcd"), "before\n", "{name}");
    }
    let (code, _, err) = said(shell(path, "bin/vimc4 run list.txt --trace -"));
    assert!(code == 2 && err.contains("`-` is where the report goes"), "{err}");
    assert!(!path.join("-").exists());
}

/// What other commands write does the same.
#[test]
fn pages_and_data_fields_are_added_too() {
    let folder = bench();
    let path = folder.path();
    written(path, "job.ncp", "IMF_PBL_V1.0\nMOVEREL X100\nPROGEND\n");
    let (code, _, err) = said(shell(path, "bin/vimc4 run list.txt --coverage met.json"));
    assert_eq!(code, 0, "{err}");
    for line in ["coverage met.json --html /dev/stdout", "ncp compile job.ncp -o /dev/stdout"] {
        written(path, "all.txt", "before\n");
        let (code, _, err) = said(shell(path, &format!("bin/vimc4 {line} >> all.txt")));
        let all = read(path, "all.txt");
        assert!(code == 0 && all.starts_with("before\n") && all.len() > 50, "{line}: {err}{all}");
    }
    // Beside this one there would be another.
    pipe(path, "pipe");
    let (code, _, err) = said(shell(path, "bin/vimc4 coverage met.json --lcov pipe"));
    assert!(code == 2 && err.contains("needs a file of its own"), "{err}");
    assert!(!path.join("pipe.txt").exists());
}

/// What is read through standard input is what would be overwritten, as if it were named.
#[test]
fn what_is_read_is_not_overwritten() {
    let folder = bench();
    let path = folder.path();
    written(path, "job.ncp", "IMF_PBL_V1.0\nMOVEREL X100\nPROGEND\n");
    written(path, "field.cnc", "; machine: own.toml\n; axes: 7\n71\n9\n");
    let begin = "bin/vimc4 machines show mill > own.toml; bin/vimc4 run list.txt --record of.jsonl";
    let (code, _, err) = said(shell(path, begin));
    assert_eq!(code, 0, "{err}");
    for (command, name) in [
        ("run - --as gcode", "list.txt"),
        ("run - --vcd", "list.txt"),
        ("run - --trace", "./list.txt"),
        ("run /dev/stdin --csv", "list.txt"),
        ("ncp run - --perfetto", "job.ncp"),
        ("ncp compile - -o", "job.ncp"),
        ("ncp compile job.ncp -o", "job.ncp"),
        ("ncp compile job.ncp --machine own.toml -o", "own.toml"),
        ("ncp run job.ncp --machine own.toml --trace", "./own.toml"),
        ("run list.txt --machine own.toml --plot", "own.toml"),
        ("run field.cnc --trace", "own.toml"),
        ("replay of.jsonl --machine own.toml --csv", "own.toml"),
        ("serve --machine own.toml --log", "own.toml"),
        ("serve --machine own.toml --csv", "own.toml"),
        ("console list.txt --machine own.toml --flash", "own.toml"),
        ("replay - --html", "of.jsonl"),
        ("replay - --vcd", "of.jsonl"),
    ] {
        let before = read(path, name);
        let line = format!("bin/vimc4 {command} {name} < {name}");
        let (code, _, err) = said(shell(path, &line));
        assert!(code == 2 && err.contains("is named twice, and would be overwritten"), "{err}");
        assert_eq!(read(path, name), before, "{line}");
    }
    let before = read(path, "list.txt");
    let (code, _, err) = said(shell(path, "echo picture list.txt | bin/vimc4 console list.txt"));
    assert!(code == 1 && err.contains("list.txt is named twice"), "{err}");
    assert_eq!(read(path, "list.txt"), before);
    let before = read(path, "list.txt");
    let (code, _, err) = said(shell(path, "echo picture list.txt | bin/vimc4 console list.txt"));
    assert!(code == 1 && err.contains("list.txt is named twice"), "{err}");
    assert_eq!(read(path, "list.txt"), before);
}

/// Each of several controllers needs a file, of which there are several only where it is one.
#[test]
fn several_controllers_share_no_stream() {
    let folder = bench();
    let path = folder.path();
    symlink("/dev/stdout", path.join("link.csv")).unwrap();
    pipe(path, "pipe");
    let before = names(path);
    let serve = "echo quit | bin/vimc4 serve --pty none --tcp 127.0.0.1:0 --count 2";
    for option in
        ["--csv link.csv", "--vcd /dev/stdout", "--perfetto pipe", "--record pipe", "--flash pipe"]
    {
        let (code, _, err) = said(shell(path, &format!("{serve} {option}")));
        assert!(code == 2 && err.contains("needs a file of its own"), "{option}: {err}");
        assert_eq!(names(path), before, "{option}");
    }
    let one = serve.replace(" --count 2", " --flash /dev/stdout >> list.txt");
    let (code, _, err) = said(shell(path, &one));
    assert!(code == 2 && err.contains("needs a file of its own"), "{err}");
    let (code, _, err) = said(shell(path, &format!("{serve} --csv /dev/null")));
    assert_eq!(code, 0, "{err}");
    assert!(!Path::new("/dev/null-1").exists());
}

/// Opens a named pipe for reading, which waits for a writer.
fn reader_of(name: PathBuf) -> Timed<File> {
    let text = name.display().to_string();
    Timed::new(text, in_time("a writer of the pipe", || File::open(name).unwrap()))
}

/// Whoever waits in vain for a reader ends it at the first request.
#[test]
fn what_waits_for_a_reader_ends_when_it_is_asked() {
    let folder = bench();
    let path = folder.path();
    ["read", "unread", "unread.svg"].iter().for_each(|name| pipe(path, name));
    let (code, _, err) = said(shell(path, "bin/vimc4 run list.txt --record of.jsonl"));
    assert_eq!(code, 0, "{err}");
    for (line, expected) in [
        ("run list.txt --as dxf read --as gcode unread", 130),
        ("run list.txt --as dxf read --trace unread", 130),
        ("replay of.jsonl --vcd read --csv unread", 130),
        ("serve --pty none --tcp 127.0.0.1:0 --vcd read --csv unread", 0),
    ] {
        for signal in [Signal::INT, Signal::TERM] {
            let mut command = process::vimc4(path, &line.split(' ').collect::<Vec<_>>());
            let mut waits = Process::start(&mut command);
            let reader = reader_of(path.join("read"));
            waits.signal(signal);
            assert_eq!(waits.ended().code(), Some(expected), "{line}");
            drop(reader);
        }
    }
    // And whoever waits for commands.
    let mut command = process::vimc4(path, &["console", "--script", "unread"]);
    let mut waits = Process::start(&mut command);
    let name = path.join("unread");
    let writer =
        in_time("a reader of the pipe", || File::options().write(true).open(name).unwrap());
    waits.signal(Signal::INT);
    assert_eq!(waits.ended().signal(), Some(Signal::INT.as_raw()));
    drop(writer);
    // Its end is that of its input, so that the pipe is what it waits for.
    let mut command = process::vimc4(path, &["run", "-", "--plot", "unread.svg"]);
    let mut waits = Process::start(&mut command);
    waits.give("@07\n");
    drop(waits.input.take());
    let reader = reader_of(path.join("unread.svg"));
    assert!(std::io::read_to_string(reader).unwrap().ends_with("</svg>\n"));
    assert_eq!(waits.ended().code(), Some(0));
}

/// Whoever reads standard output no further has seen enough. Whoever reads something else no further is
/// missed.
#[test]
fn a_reader_that_goes_is_told_as_such() {
    let folder = bench();
    let path = folder.path();
    symlink("/dev/stdout", path.join("link.csv")).unwrap();
    pipe(path, "pipe");
    for option in
        ["--csv /dev/stdout", "--csv link.csv", "--vcd /dev/stdout", "--trace /dev/stdout"]
    {
        let run = format!("bin/vimc4 run endless.txt --for 20s {option}");
        let line = format!("{{ {run}; echo $? > code; }} | head -c 9 > /dev/null");
        let (_, _, err) = said(shell(path, &line));
        assert_eq!((read(path, "code").as_str(), err.as_str()), ("3\n", ""), "{option}");
    }
    // All of them are longer than what a pipe holds.
    for option in ["--for 20s --csv", "--for 20s --vcd", "--for 20s --trace", "--for 2h --as gcode"]
    {
        let run = format!("bin/vimc4 run endless.txt {option} pipe > /dev/null");
        let line = format!("head -c 9 pipe > /dev/null & {run}");
        let (code, _, err) = said(shell(path, &line));
        assert_eq!(code, 2, "{option}: {err}");
        assert!(err.contains("cannot write pipe: ") && err.contains("has gone"), "{option}: {err}");
    }
}

/// Whatever becomes of one output, the others are whole.
#[test]
fn an_output_that_fails_leaves_the_others_whole() {
    let folder = bench();
    let path = folder.path();
    let whole = "--vcd a.vcd --fst a.fst --csv a.csv --perfetto a.json --trace a.trace --as gcode a.nc \
                 --plot a.svg";
    let (code, _, err) = said(shell(path, &format!("bin/vimc4 run list.txt {whole}")));
    assert_eq!(code, 0, "{err}");
    let other = whole.replace(" a.", " b.");
    for failing in ["--as dxf /dev/full", "--vcd /dev/full", "--trace /dev/full"] {
        // An option of which there is one takes the place of its file.
        let option = failing.strip_suffix(" /dev/full").unwrap();
        let rest = other.replace(&format!("{option} b.{} ", &option[2..]), "");
        let line = format!("bin/vimc4 run list.txt {failing} {rest}");
        let (code, _, err) = said(shell(path, &line));
        assert!(code == 2 && err.contains("cannot write /dev/full"), "{err}");
        for name in names(path).iter().filter(|name| name.starts_with("b.")) {
            if !name.ends_with(".gtkw") {
                let [one, other] =
                    [name.replace("b.", "a."), name.clone()].map(|name| fs::read(path.join(name)));
                assert!(one.unwrap() == other.unwrap(), "{failing}: {name}");
            }
            fs::remove_file(path.join(name)).unwrap();
        }
    }
}
