//! `--vcd`, `--fst`, `--csv` and `--perfetto`: waveforms of runs, jobs, recordings and controllers that are
//! served, as docs/waves.md says, and as GTKWave's own programs read them.
//!
//! What needs a tool that is missing is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead, so that nothing is left out unnoticed.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use libtest_mimic::{Arguments, Failed, Trial};
use rustix::process::Signal;
use serde_json::Value;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{InTime, LIMIT, until};
use process::{Process, ask, connect, rest_of, root, run, shell, shown, tcp};

const MANUAL: &str = include_str!("../../docs/waves.md");

/// The changes of each signal, by its path, as a value change dump has them.
type Changes = BTreeMap<String, Vec<(u64, String)>>;

fn read(file: &Path) -> Changes {
    let text = fs::read_to_string(file).unwrap();
    let (mut groups, mut names) = (Vec::new(), BTreeMap::new());
    let (mut changes, mut now) = (Changes::new(), 0);
    let mut is_defined = false;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["$enddefinitions", "$end"] => is_defined = true,
            ["$scope", _, name, "$end"] => groups.push(name),
            ["$upscope", "$end"] => drop(groups.pop()),
            ["$var", _, _, code, name, ..] => {
                let path = format!("{}.{name}", groups.join("."));
                names.insert(code.to_owned(), path.trim_end_matches("[7:0]").to_owned());
            }
            _ if !is_defined => {}
            [word] if word.starts_with('#') => now = word[1..].parse().unwrap(),
            [word] if word.starts_with(['0', '1']) => {
                note(&mut changes, &names, &word[1..], now, &word[..1]);
            }
            [value, code] if value.starts_with(['b', 'r', 's']) => {
                note(&mut changes, &names, code, now, &value[1..]);
            }
            _ => {}
        }
    }
    changes
}

fn note(changes: &mut Changes, names: &BTreeMap<String, String>, code: &str, at: u64, value: &str) {
    let changes = changes.entry(names[code].clone()).or_default();
    // At one instant the last value counts.
    changes.pop_if(|(last, _)| *last == at);
    if changes.last().is_none_or(|(_, last)| last != value) {
        changes.push((at, value.to_owned()));
    }
}

fn rises(changes: &Changes, name: &str) -> Vec<u64> {
    let changes = changes[name].iter();
    changes.filter(|(_, value)| value == "1").map(|(at, _)| *at).collect()
}

/// A folder with the examples.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("examples")).unwrap();
    for name in ["commands.txt", "program.txt", "plate.ncp", "board.plt", "limit.jsonl"] {
        let file = Path::new("examples").join(name);
        fs::copy(root().join(&file), folder.path().join(&file)).unwrap();
    }
    folder
}

/// Every step of a run is an edge, at the time that the table of steps has. What a run with a plot file
/// reports leaves out the reference run.
fn edges_are_the_steps(arguments: &[&str], axes: &[&str], counts_all: bool) {
    let folder = folder();
    let outputs = ["--json", "--trace", "steps.csv", "--vcd", "out.vcd"];
    let (code, said, errors) = run(folder.path(), &[arguments, &outputs].concat());
    assert_eq!((code, errors.as_str()), (0, ""));
    let report: Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    let drawn = read(&folder.path().join("out.vcd"));
    let model = drawn.keys().next().unwrap().split('.').next().unwrap().to_owned();
    let steps = fs::read_to_string(folder.path().join("steps.csv")).unwrap();
    let mut rows = steps.lines();
    let names: Vec<&str> = rows.next().unwrap().split(',').skip(1).collect();
    let mut before: Option<Vec<i64>> = None;
    let mut expected: BTreeMap<&str, Vec<u64>> = BTreeMap::new();
    for row in rows {
        let (at, places) = row.split_once(',').unwrap();
        let at: u64 = at.replace('.', "").parse().unwrap();
        let places: Vec<i64> = places.split(',').map(|place| place.parse().unwrap()).collect();
        for (axis, name) in names.iter().enumerate() {
            // Between motions a counter may be set; a step is by one.
            let moves = before.as_ref().map(|before| (places[axis] - before[axis]).abs());
            if moves == Some(1) || moves.is_none() && places[axis].abs() == 1 {
                expected.entry(name).or_default().push(at);
            }
        }
        before = Some(places);
    }
    for axis in axes {
        let edges = rises(&drawn, &format!("{model}.{}.step", axis.to_lowercase()));
        if counts_all {
            let travelled = &report["axes"][axis]["travelled"];
            assert_eq!(edges.len() as u64, travelled.as_u64().unwrap(), "{axis}");
        }
        let places = &drawn[&format!("{model}.{}.position", axis.to_lowercase())];
        let end = report["axes"][axis]["position"].as_i64().unwrap();
        assert_eq!(places.last().unwrap().1, end.to_string(), "{axis}");
        let lacks = |at: &&u64| edges.binary_search(at).is_err();
        assert_eq!(expected[axis].iter().find(lacks), None, "{axis}");
    }
}

fn the_edges_of_a_run_are_its_steps() {
    let commands = ["run", "examples/commands.txt", "--machine", "mill"];
    edges_are_the_steps(&commands, &["X", "Y", "Z"], true);
    let plot = ["run", "examples/board.plt", "--model", "smcu", "--machine", "board-plotter"];
    edges_are_the_steps(&plot, &["X", "Y"], false);
}

fn a_job_is_drawn_like_its_commands() {
    let folder = folder();
    let job = ["ncp", "run", "examples/plate.ncp", "--machine", "mill", "--yes", "--json"];
    let drawn = ["--vcd", "out.vcd", "--perfetto", "out.json"];
    let (code, said, _) = run(folder.path(), &[&job[..], &drawn].concat());
    assert_eq!(code, 0, "{said}");
    let report: Value = serde_json::from_str(&said).unwrap();
    let drawn = read(&folder.path().join("out.vcd"));
    let end = drawn["imc4.x.position"].last().unwrap().1.parse::<i64>().unwrap();
    assert_eq!(end, report["axes"]["X"]["position"].as_i64().unwrap());
    let trace = fs::read_to_string(folder.path().join("out.json")).unwrap();
    let trace: Value = serde_json::from_str(&trace).unwrap();
    let answered = trace["traceEvents"].as_array().unwrap();
    let answered = answered.iter().filter(|event| event["tid"] == 3 && event["ph"] == "i");
    assert_eq!(answered.count() as u64, report["commands"].as_u64().unwrap());
}

fn a_recording_is_drawn_as_the_run_was() {
    let folder = folder();
    let outputs = ["--record", "run.jsonl", "--vcd", "run.vcd", "--csv", "run.csv"];
    let commands = ["run", "examples/commands.txt", "--machine", "mill"];
    assert_eq!(run(folder.path(), &[&commands[..], &outputs].concat()).0, 0);
    let replay = ["replay", "run.jsonl", "--vcd", "again.vcd", "--csv", "again.csv"];
    assert_eq!(run(folder.path(), &replay).0, 0);
    for ending in ["vcd", "csv"] {
        let of = |name: &str| fs::read(folder.path().join(format!("{name}.{ending}"))).unwrap();
        assert!(of("run") == of("again"), "{ending}");
    }
}

fn a_run_that_ends_sooner_is_drawn_the_same_up_to_there() {
    let folder = folder();
    let whole = ["run", "examples/commands.txt", "--machine", "mill", "--vcd", "whole.vcd"];
    assert_eq!(run(folder.path(), &whole).0, 0);
    let part = ["run", "examples/commands.txt", "--machine", "mill", "--vcd", "part.vcd"];
    assert_eq!(run(folder.path(), &[&part[..], &["--for", "2345678us"]].concat()).0, 3);
    let [whole, part] =
        ["whole", "part"].map(|name| read(&folder.path().join(name).with_extension("vcd")));
    let until = 2_345_678_000;
    for (name, part) in part {
        let before = whole[&name].iter().filter(|(at, _)| *at <= until);
        let part = part.iter().filter(|(at, _)| *at <= until);
        assert!(part.eq(before), "{name}");
    }
}

/// A controller that is served is drawn as its recording is, with its line paced or not.
fn what_is_served_is_drawn_as_its_recording() {
    for paced in [&["--time", "instant"][..], &["--time", "instant", "--line-pacing"]] {
        let folder = folder();
        let drawn = ["--pty", "none", "--record", "of.jsonl", "--vcd", "of.vcd", "--fst", "of.fst"];
        let (mut serve, ready) = Process::serve(folder.path(), &[&drawn[..], paced].concat());
        let mut port = connect(tcp(&ready, 0));
        assert_eq!(ask(&mut port, "@07\r", 1), "0");
        assert_eq!(ask(&mut port, "@0A 900,900,-70,800,0,900,0,900\r", 1), "0");
        assert_eq!(ask(&mut port, "@0P\r", 19), "0000384FFFFBA000000");
        serve.give("quit\n");
        assert!(serve.ended().success());
        let again = ["replay", "of.jsonl", "--vcd", "again.vcd"];
        let (code, said, errors) = run(folder.path(), &again);
        assert_eq!(code, 0, "{said}{errors}");
        let [of, again] = ["of.vcd", "again.vcd"].map(|name| read(&folder.path().join(name)));
        assert_eq!(rises(&of, "imc4.x.step").len(), 900);
        assert_eq!(rises(&of, "imc4.y.step").len(), 70);
        for (name, changes) in &of {
            assert_eq!(Some(changes), again.get(name), "{name}");
        }
    }
}

fn a_file_that_somebody_has_is_left() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("out.gtkw"), "mine").unwrap();
    let commands = ["run", "examples/commands.txt", "--machine", "mill"];
    assert_eq!(run(folder.path(), &[&commands[..], &["--vcd", "out.vcd"]].concat()).0, 0);
    assert_eq!(fs::read_to_string(path("out.gtkw")).unwrap(), "mine");
    assert!(path("out.sucl").exists());
    for (outputs, named) in [
        (&["--csv", "examples/commands.txt"][..], "examples/commands.txt"),
        (&["--vcd", "one", "--fst", "./one"], "./one"),
        (&["--as", "gcode", "examples/commands.txt"], "examples/commands.txt"),
        (&["--trace", "./examples/commands.txt"], "./examples/commands.txt"),
        (&["--record", "one", "--vcd", "one"], "one"),
        (&["--plot", "one.svg", "--as", "gcode", "one.svg"], "one.svg"),
        (&["--as", "gcode", "one", "--as", "dxf", "one"], "one"),
    ] {
        let (code, _, errors) = run(folder.path(), &[&commands[..], outputs].concat());
        assert_eq!(code, 2);
        assert!(errors.contains(&format!("{named} is named twice")), "{errors}");
    }
    let (code, _, errors) = run(folder.path(), &[&commands[..], &["--vcd", "no/out.vcd"]].concat());
    assert!(code == 2 && errors.contains("cannot write no/out.vcd"), "{errors}");
}

/// Whoever has seen enough presses Ctrl-C, and has what was drawn until then.
fn an_interrupted_run_leaves_whole_files() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    fs::write(
        path("endless.txt"),
        "0400,2000,0,900,0,900,0,900\n0-400,2000,0,900,0,900,0,900\n3 0,-2\n9\n",
    )
    .unwrap();
    let outputs =
        ["--for", "10000h", "--vcd", "out.vcd", "--fst", "out.fst", "--perfetto", "out.json"];
    let mut command = process::vimc4(folder.path(), &["run", "endless.txt", "--machine", "mill"]);
    let mut run = Process::start(command.args(outputs));
    let size = |name: &str| fs::metadata(path(name)).map_or(0, |file| file.len());
    until("it draws", || size("out.vcd") > 1_000_000);
    let interrupted =
        Command::new("kill").args(["-INT", &run.child.id().to_string()]).status_in_time();
    assert!(interrupted.unwrap().success());
    assert_eq!(run.end().0, Some(130));
    let text = fs::read_to_string(path("out.vcd")).unwrap();
    assert!(text.ends_with('\n'), "it ends in the middle of a line");
    let drawn = read(&path("out.vcd"));
    let steps = rises(&drawn, "imc4.x.step").len();
    assert!(steps > 1_000, "{steps}");
    let trace: Value =
        serde_json::from_str(&fs::read_to_string(path("out.json")).unwrap()).unwrap();
    assert!(trace.is_array() || trace.is_object());
    // What is compressed has the same, if there is a reader.
    let mut other = Command::new("fst2vcd");
    if let Ok(status) =
        other.args(["out.fst", "-o", "other.vcd"]).current_dir(folder.path()).status_in_time()
    {
        assert!(status.success());
        assert_eq!(rises(&read(&path("other.vcd")), "imc4.x.step").len(), steps);
    }
}

/// Sends a hundred queries at once and reads the answers, for as long as this.
fn poll_for(port: &mut TcpStream, time: Duration) {
    let queries = "@0P\r".repeat(100);
    let begun = Instant::now();
    while begun.elapsed() < time {
        ask(port, &queries, 1_900);
    }
}

/// The most memory that a process has had, in kB.
fn most_memory(process: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

const FORMATS: [&str; 8] =
    ["--vcd", "of.vcd", "--fst", "of.fst", "--csv", "of.csv", "--perfetto", "of.json"];

/// However fast a client polls, memory stays bounded and the end comes at once. Here nothing is
/// optimised and other tests run beside this one: the limits are a few times those of docs/waves.md.
fn a_client_that_polls_costs_neither_memory_nor_time_at_the_end() {
    for clock in ["real", "8x", "instant"] {
        let folder = folder();
        let arguments = [&["--pty", "none", "--time", clock][..], &FORMATS].concat();
        let (mut serve, ready) = Process::serve(folder.path(), &arguments);
        let mut port = connect(tcp(&ready, 0));
        assert_eq!(ask(&mut port, "@07\r", 1), "0");
        poll_for(&mut port, Duration::from_millis(200));
        let before = most_memory(serve.child.id());
        poll_for(&mut port, Duration::from_secs(2));
        let most = most_memory(serve.child.id());
        assert!(most < before + 40_000, "{clock}: {before} kB, then {most} kB");
        assert_eq!(ask(&mut port, "@0A 31,900,0,900,0,900,0,900\r", 1), "0");
        serve.signal(Signal::TERM);
        let asked = Instant::now();
        assert_eq!(serve.ended().code(), Some(0), "{clock}");
        assert!(asked.elapsed() < Duration::from_secs(10), "{clock}: {:?}", asked.elapsed());
        let drawn = read(&folder.path().join("of.vcd"));
        assert_eq!(rises(&drawn, "imc4.x.step").len(), 31, "{clock}");
    }
}

/// The files of a program that is killed have everything but the last moments, on any clock.
fn a_killed_controller_leaves_files_that_open() {
    for clock in ["real", "8x", "instant"] {
        let folder = folder();
        let path = |name: &str| folder.path().join(name);
        let arguments = [&["--pty", "none", "--time", clock][..], &FORMATS].concat();
        let (mut serve, ready) = Process::serve(folder.path(), &arguments);
        let mut port = connect(tcp(&ready, 0));
        assert_eq!(ask(&mut port, "@07\r", 1), "0");
        poll_for(&mut port, Duration::from_millis(300));
        assert_eq!(ask(&mut port, "@0A 31,900,0,900,0,900,0,900\r", 1), "0");
        // The program goes on although nothing more happens: what is due reaches the file.
        for (file, last) in [("of.csv", ",x.position,31\n"), ("of.json", "\"args\":{\"steps\":31}")]
        {
            until(&format!("{clock}: {file} has the last step"), || {
                fs::read_to_string(path(file)).unwrap().contains(last)
            });
        }
        assert!(serve.child.try_wait().unwrap().is_none());
        serve.child.kill().unwrap();
        serve.ended();
        let drawn = read(&path("of.vcd"));
        assert_eq!(rises(&drawn, "imc4.x.step").len(), 31, "{clock}");
        let trace: Value = serde_json::from_slice(&fs::read(path("of.json")).unwrap()).unwrap();
        assert!(trace["traceEvents"].is_array(), "{clock}");
        assert!(fs::read_to_string(path("of.csv")).unwrap().ends_with('\n'), "{clock}");
        // What is compressed has the same, if there is a reader.
        let mut other = Command::new("fst2vcd");
        let other = other.args(["of.fst", "-o", "other.vcd"]).current_dir(folder.path());
        if let Ok(status) = other.status_in_time() {
            assert!(status.success(), "{clock}");
            assert_eq!(read(&path("other.vcd"))["imc4.x.position"].last().unwrap().1, "31");
        }
    }
}

/// A file that can no longer be written ends there, which is said at once; everything else goes on.
fn a_full_disk_ends_only_the_file() {
    let folder = folder();
    let arguments = ["--pty", "none", "--csv", "/dev/full", "--vcd", "of.vcd"];
    let (mut serve, ready) = Process::serve(folder.path(), &arguments);
    let errors = serve.errors();
    let said = errors.recv_timeout(LIMIT).unwrap();
    let words = "cannot write /dev/full: No space left on device (os error 28); it ends there, and \
                 the controllers go on";
    assert_eq!(said, words);
    let mut port = connect(tcp(&ready, 0));
    assert_eq!(ask(&mut port, "@07\r", 1), "0");
    assert_eq!(ask(&mut port, "@0A 31,900,0,900,0,900,0,900\r", 1), "0");
    serve.give("quit\n");
    assert_eq!(serve.ended().code(), Some(1));
    let rest = rest_of(&errors);
    assert!(rest.contains("cannot write /dev/full"), "{rest}");
    assert_eq!(rises(&read(&folder.path().join("of.vcd")), "imc4.x.step").len(), 31);
}

/// A reader that stands still does not keep the program from ending, and a second signal ends it at once.
fn a_reader_that_stands_still_does_not_hold_up_the_end() {
    for signals in [1, 2] {
        let folder = folder();
        let pipe = folder.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status_in_time().unwrap().success());
        // Open for both, it waits for nobody, and nobody reads what is written.
        let reader = fs::OpenOptions::new().read(true).write(true).open(&pipe).unwrap();
        let (mut serve, ready) = Process::serve(folder.path(), &["--csv", "pipe"]);
        let mut port = connect(tcp(&ready, 0));
        // More than a pipe takes; in the end the client is not heard any more.
        port.set_nonblocking(true).unwrap();
        let commands = "@01\r@07\r".repeat(1_000);
        let mut answers = vec![0; 100_000];
        let (mut sent, mut quiet) = (0, 0);
        until("it takes no more", || {
            let taken = port.write(commands.as_bytes()).unwrap_or(0);
            let answered = port.read(&mut answers).unwrap_or(0);
            (sent, quiet) = (sent + taken, if taken + answered > 0 { 0 } else { quiet + 1 });
            quiet == 100
        });
        serve.signal(Signal::TERM);
        if signals == 2 {
            let link = folder.path().join("vimc4.pty");
            until("it ends", || fs::symlink_metadata(&link).is_err());
            serve.signal(Signal::TERM);
        }
        let (code, errors) = serve.end();
        assert_eq!(code, Some(1), "{errors}");
        let words = ["cannot finish pipe: its reader", "ended at once, at the second request"];
        assert!(errors.contains(words[signals - 1]), "{errors}");
        drop(reader);
        assert!(sent > 0);
    }
}

/// GTKWave's own reader of its own format.
fn fst2vcd_reads_the_same() {
    let folder = folder();
    let runs: [&[&str]; 2] = [
        &["run", "examples/commands.txt", "--machine", "mill"],
        &["run", "examples/board.plt", "--model", "smcu", "--machine", "board-plotter"],
    ];
    for arguments in runs {
        let outputs = ["--vcd", "out.vcd", "--fst", "out.fst"];
        assert_eq!(run(folder.path(), &[arguments, &outputs].concat()).0, 0);
        let mut other = Command::new("fst2vcd");
        let other = other.args(["out.fst", "-o", "other.vcd"]).current_dir(folder.path());
        assert!(other.status_in_time().unwrap().success());
        let [ours, theirs] = ["out.vcd", "other.vcd"].map(|name| read(&folder.path().join(name)));
        assert_eq!(ours.len(), theirs.len());
        for (name, changes) in ours {
            assert_eq!(theirs.get(&name), Some(&changes), "{name}");
        }
    }
}

/// The sessions of the manual go as they are shown.
fn the_manual_shows_what_is_printed() {
    let folder = folder();
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).unwrap();
    std::os::unix::fs::symlink(process::VIMC4, bin.join("vimc4")).unwrap();
    let shown = shown(MANUAL);
    for (line, expected) in &shown {
        let output = shell(folder.path(), line);
        let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert_eq!(said.trim_end(), expected.trim_end(), "docs/waves.md: {line}");
    }
    assert!(shown.len() >= 4, "{shown:?}");
}

fn main() -> ExitCode {
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let test = |name: &str, body: fn()| {
        Trial::test(name, move || {
            body();
            Ok::<(), Failed>(())
        })
    };
    // It says how it is used, and ends.
    let gtkwave = Command::new("fst2vcd").arg("--help").output_in_time().is_ok();
    let name = "fst2vcd reads the same";
    let name = if gtkwave { name.to_owned() } else { format!("{name} (needs gtkwave)") };
    let trials = vec![
        test("the edges of a run are its steps", the_edges_of_a_run_are_its_steps),
        test("a job is drawn like its commands", a_job_is_drawn_like_its_commands),
        test("a recording is drawn as the run was", a_recording_is_drawn_as_the_run_was),
        test("an interrupted run leaves whole files", an_interrupted_run_leaves_whole_files),
        test(
            "a run that ends sooner is drawn the same up to there",
            a_run_that_ends_sooner_is_drawn_the_same_up_to_there,
        ),
        test("what is served is drawn as its recording", what_is_served_is_drawn_as_its_recording),
        test(
            "a client that polls costs neither memory nor time at the end",
            a_client_that_polls_costs_neither_memory_nor_time_at_the_end,
        )
        .with_ignored_flag(!cfg!(target_os = "linux")),
        test(
            "a killed controller leaves files that open",
            a_killed_controller_leaves_files_that_open,
        ),
        test("a full disk ends only the file", a_full_disk_ends_only_the_file)
            .with_ignored_flag(!cfg!(target_os = "linux")),
        test(
            "a reader that stands still does not hold up the end",
            a_reader_that_stands_still_does_not_hold_up_the_end,
        ),
        test("a file that somebody has is left", a_file_that_somebody_has_is_left),
        test("the manual shows what is printed", the_manual_shows_what_is_printed),
        test(&name, fst2vcd_reads_the_same).with_ignored_flag(!gtkwave && !required),
    ];
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}
