//! `--plot` and `--as`: the pictures of docs/pictures.md are what the program draws, and what it writes
//! says where things happened.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs::{self, File};
use std::io::Read;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, in_time};
use process::{Process, VIMC4, root, said, shell, shown};
use rustix::process::Signal;

const MANUAL: &str = include_str!("../../docs/pictures.md");

/// A folder with the examples.
fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    symlink(root().join("examples").canonicalize().unwrap(), folder.path().join("examples"))
        .unwrap();
    fs::create_dir(folder.path().join("bin")).unwrap();
    symlink(VIMC4, folder.path().join("bin/vimc4")).unwrap();
    folder
}

fn written(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

/// Runs `vimc4` with these words behind it.
fn run(folder: &Path, line: &str) -> (i32, String, String) {
    process::run(folder, &line.split(' ').collect::<Vec<_>>())
}

/// The lines of an SVG of a class.
fn drawn<'s>(svg: &'s str, class: &str) -> Vec<&'s str> {
    let class = format!("class=\"{class}\"");
    svg.lines().filter(|line| line.contains(&class)).collect()
}

#[test]
fn the_pictures_of_the_manual_are_what_is_drawn() {
    let folder = bench();
    for (line, expected) in shown(MANUAL) {
        let (code, out, err) = said(shell(folder.path(), line));
        assert_eq!((code, err.as_str()), (0, ""), "{line}");
        assert_eq!(out.trim_end(), expected.trim_end(), "{line}");
    }
    for name in ["plate.svg", "drill.svg", "board.svg"] {
        assert!(MANUAL.contains(&format!("]({name})")), "{name} is not shown");
        let shown = fs::read_to_string(root().join("docs").join(name)).unwrap_or_default();
        let is_same = shown == read(folder.path(), name);
        assert!(is_same, "docs/{name} is not what the command line in docs/pictures.md draws");
        assert!(shown.len() < 60_000, "docs/{name} has {} bytes", shown.len());
    }
}

#[test]
fn a_job_shows_its_rapids_and_tools() {
    let folder = bench();
    let job = "IMF_PBL_V1.0\nREF XYZ\nVEL 8000\nFASTVEL 20000\nFASTABS X20000 Y30000 Z-5000\n\
               MOVEREL X9000\nGETTOOL 7\nCWABS I33000 J30000\nFASTABS X0\nPROGEND\n";
    written(folder.path(), "job.ncp", job);
    let line = "ncp run job.ncp --machine mill --yes --plot job.svg";
    let (code, ..) = run(folder.path(), line);
    assert_eq!(code, 0);
    let svg = read(folder.path(), "job.svg");
    for class in ["reference", "rapid", "feed", "arc", "envelope"] {
        assert_eq!(drawn(&svg, class).len(), 2, "{class}: from above and isometric");
    }
    let tool = drawn(&svg, "mark tool");
    assert!(tool[0].contains("X 29.000 mm, Y 30.000 mm, Z -5.000 mm"), "{tool:?}");
    assert!(tool[0].contains("tool 7 is put in, line 7"), "{tool:?}");
}

#[test]
fn stops_errors_and_limits_are_where_they_happened() {
    let folder = bench();
    written(folder.path(), "far.txt", "@07\n@0R7\n@0A40000,4000,0,900,0,900,0,900\n");
    let line = "run far.txt --machine mill --plot far.svg";
    let (code, ..) = run(folder.path(), line);
    assert_eq!(code, 1);
    let svg = read(folder.path(), "far.svg");
    let limit = drawn(&svg, "mark limit");
    // The switch of X is at 24,001 steps, 80 to a mm.
    assert!(limit[0].contains("X 300.0") && limit[0].contains("limit switch X+"), "{limit:?}");
    assert!(drawn(&svg, "mark error").is_empty(), "one thing is one sign");

    written(folder.path(), "stop.txt", "@07\n@0A8000,1000,0,900,0,900,0,900\n");
    let line = "run stop.txt --press stop@2s --plot stop.svg --plot-view top";
    run(folder.path(), line);
    let stop = read(folder.path(), "stop.svg");
    let stop = drawn(&stop, "mark stop");
    assert!(stop.len() == 1 && stop[0].contains("stopped at 2."), "{stop:?}");

    // It came to rest later than the button was pressed, and further on.
    assert!(stop[0].contains("stopped at 2.007"), "{stop:?}");

    // Without a reference run the ends of the machine are where they are, and not around the counters.
    written(folder.path(), "lost.txt", "@07\n@0A40000,4000,0,900,0,900,0,900\n");
    run(folder.path(), "run lost.txt --machine mill --plot lost.svg --plot-view top");
    let lost = read(folder.path(), "lost.svg");
    let first = |class: &str| {
        let line = lost.lines().find(|line| line.contains(&format!("class=\"{class}\"")))?;
        let numbers = line.split_once(" d=\"M")?.1.split([' ', 'l']);
        Some(numbers.map_while(|number| number.parse().ok()).collect::<Vec<f64>>())
    };
    let [ends, limit] = ["envelope", "mark limit"].map(|class| first(class).unwrap());
    assert!((ends[0] + ends[2] - limit[0]).abs() < 1.0, "{ends:?} {limit:?}");

    written(folder.path(), "typo.txt", "@07\n@0A800,1000,0,900,0,900,0,900\n@0A1,1\n");
    run(folder.path(), "run typo.txt --plot typo.svg");
    let error = read(folder.path(), "typo.svg");
    assert_eq!(drawn(&error, "mark error").len(), 1);
}

#[test]
fn an_arc_that_misses_its_end_is_a_warning_at_that_end() {
    let folder = bench();
    written(folder.path(), "arc.txt", "@07\n@0y64000,4000,-800,800,0,-1,1\n");
    run(folder.path(), "run arc.txt --plot arc.svg --plot-view top --as gcode arc.ngc");
    let (svg, gcode) = (read(folder.path(), "arc.svg"), read(folder.path(), "arc.ngc"));
    let warning = drawn(&svg, "mark warning");
    assert!(warning.len() == 1 && warning[0].contains("warning at 16."), "{warning:?}");
    assert!(drawn(&svg, "mark error").is_empty());
    assert!(gcode.contains("(warning at 16.0") && !gcode.contains("(error"), "{gcode}");
}

#[test]
fn a_recording_draws_the_same_path() {
    let folder = bench();
    let line = "run examples/commands.txt --machine mill --record drill.jsonl --plot one.svg";
    assert_eq!(run(folder.path(), line).0, 0);
    assert_eq!(run(folder.path(), "replay drill.jsonl --plot other.svg").0, 0);
    let [one, other] = ["one.svg", "other.svg"].map(|name| read(folder.path(), name));
    assert_eq!(one.replace("commands.txt", "drill.jsonl"), other);
}

#[test]
fn a_circle_is_drawn_around_its_centre() {
    let folder = bench();
    let line = "circle --radius 12.5 --steps-per-mm 80 --plane xz --plot circle.svg";
    let (code, out, _) = run(folder.path(), line);
    assert_eq!((code, out.lines().count()), (0, 3));
    let svg = read(folder.path(), "circle.svg");
    assert_eq!(drawn(&svg, "arc").len(), 2, "from the front and isometric");
    assert!(svg.contains("from the front"));
    let start = drawn(&svg, "mark start");
    assert!(start[0].contains("X 12.500 mm, Y 0.000 mm, Z 0.000 mm"), "{start:?}");
}

#[test]
fn the_path_goes_to_other_programs() {
    let folder = bench();
    let line =
        "run examples/commands.txt --machine mill --as gcode drill.nc --as dxf drill.dxf --json";
    assert_eq!(run(folder.path(), line).0, 0);
    let code = read(folder.path(), "drill.nc");
    // Down and up again, and the way is relative: 800 steps of 80 to a mm.
    let end: Vec<&str> = code.lines().rev().take(5).collect();
    assert_eq!(end, ["M2", "G1 Z-5", "G1 Z-10 F540", "G1 X40 F3000", "G1 Z-5 F540"], "{code}");
    assert!(
        code.starts_with("(commands.txt - imc4 - mill)\nG21 G90 G94 G17\nG0 X50 Y50 Z-20\n"),
        "{code}"
    );
    let drawing = read(folder.path(), "drill.dxf");
    assert_eq!(drawing.matches("\nFEED\n 10\n").count(), 5, "{drawing}");
}

/// A stored program without an end, and a job that takes longer than anybody waits.
fn endless(folder: &Path) {
    let lines = "0400,2000,0,900,0,900,0,900\n0-400,2000,0,900,0,900,0,900\n3 0,-2\n9\n";
    written(folder, "endless.txt", lines);
    // No job is endless, but its steps fill a disk.
    let moves = "MOVEREL X9000\nMOVEREL X-9000\n".repeat(50_000);
    written(folder, "long.ncp", &format!("IMF_PBL_V1.0\n{moves}PROGEND\n"));
}

/// `vimc4` with these words behind it, under way; what it prints goes into files.
fn under_way(folder: &Path, line: &str) -> Process {
    let mut command = process::vimc4(folder, &line.split(' ').collect::<Vec<_>>());
    let file = |name| File::create(folder.join(name)).unwrap();
    command.stdout(file("out.txt")).stderr(file("errors.txt"));
    Process::of(command.start().unwrap())
}

/// Waits until there is this much of a file.
fn grown(folder: &Path, name: &str, size: u64) {
    let path = folder.join(name);
    process::limits::until("it grows", || fs::metadata(&path).is_ok_and(|file| file.len() >= size));
}

fn pipe(folder: &Path, name: &str) {
    assert!(Command::new("mkfifo").arg(folder.join(name)).status_in_time().unwrap().success());
}

/// The time with which the last row of a table begins, in seconds.
fn last_time(table: &str) -> &str {
    table.lines().last().and_then(|row| row.split(',').next()).unwrap_or_default()
}

/// Whoever has seen enough presses Ctrl-C, and has what was done until then.
#[test]
fn an_interrupted_run_leaves_what_happened_until_then() {
    let folder = bench();
    let path = folder.path();
    endless(path);
    let line = "run endless.txt --machine mill --for 10000h -v";
    let job = "ncp run long.ncp --machine mill --no-ref";
    let outputs =
        "--plot out.svg --as gcode out.nc --as dxf out.dxf --trace out.trace --csv out.csv";
    let names = ["out.svg", "out.nc", "out.dxf", "out.trace", "out.csv"];
    for (line, name) in [(line, "line.jsonl.gz"), (job, "job.jsonl")] {
        // What stood there stays until the end.
        names.iter().for_each(|name| written(path, name, "what stood there\n"));
        let mut interrupted = under_way(path, &format!("{line} {outputs} --record {name}"));
        grown(path, "out.trace", 100_000);
        assert_eq!(read(path, "out.nc"), "what stood there\n");
        interrupted.signal(Signal::INT);
        assert_eq!(interrupted.child.wait_in_time().unwrap().code(), Some(130), "{line}");
        let [svg, code, drawing, trace, table] = names.map(|name| read(path, name));
        assert!(svg.ends_with("</svg>\n") && drawn(&svg, "feed").len() == 1, "{svg}");
        assert!(code.contains("\nG1 ") && code.ends_with("\nM2\n"), "{code}");
        assert!(drawing.trim_end().ends_with("EOF"), "{drawing}");
        assert_eq!(trace.lines().last().map(|row| row.split(',').count()), Some(5));
        // All of it ends at the same moment.
        let mut steps = table.lines().filter(|row| row.contains(",x.position,"));
        assert_eq!(steps.next_back().map(last_time), Some(last_time(&trace)), "{line}");
        let (code, said, _) = run(path, &format!("replay {name}"));
        assert!(code == 0 && said.starts_with("equal: "), "{said}");
        // Everything was printed, and where it was interrupted.
        let said = read(path, "out.txt");
        assert!(said.lines().last().unwrap().contains("it was interrupted"), "{said}");
        assert!(read(path, "errors.txt").is_empty());
    }
}

/// The picture of a recording, too, and its waveform up to the same moment.
#[test]
fn an_interrupted_replay_leaves_what_was_played_until_then() {
    let folder = bench();
    let path = folder.path();
    endless(path);
    assert_eq!(run(path, "run endless.txt --machine mill --for 1s --record short.jsonl").0, 3);
    // The same, but its end comes in a thousand years.
    let recording = read(path, "short.jsonl");
    let lines: Vec<&str> = recording.lines().collect();
    let played = lines[..lines.len() - 2].join("\n");
    let end = r#"{"at":31556952000000000,"end":"the run has ended"}"#;
    written(path, "long.jsonl", &format!("{played}\n{end}\n"));
    let told = "{\"bytes\":0,\"end\":0,\"equal\":null,\"explanations\":null,\"field\":null,\"inputs\":0,\
                \"interrupted\":true,\"recording\":\"long.jsonl\",\"said\":null,\"whole\":true}\n";
    for (replay, told) in [("replay", ""), ("replay --json", told)] {
        let line = format!("{replay} long.jsonl --plot out.svg --csv out.csv");
        let mut replay = under_way(path, &line);
        grown(path, "out.csv", 100_000);
        assert!(!path.join("out.svg").exists());
        replay.signal(Signal::TERM);
        assert_eq!(replay.child.wait_in_time().unwrap().code(), Some(130));
        let svg = read(path, "out.svg");
        assert!(svg.ends_with("</svg>\n") && drawn(&svg, "feed").len() == 1, "{svg}");
        let said = read(path, "errors.txt");
        let at = last_time(&read(path, "out.csv")).to_owned();
        assert_eq!(said, format!("interrupted: what is drawn ends at {at} s\n"));
        assert_eq!(read(path, "out.txt"), told);
        ["out.svg", "out.csv"].iter().for_each(|name| fs::remove_file(path.join(name)).unwrap());
    }
}

/// Who ends it before anything has begun, or cannot wait until it has ended, finds nothing that is empty or
/// broken off.
#[test]
fn what_has_not_begun_leaves_nothing() {
    let folder = bench();
    let path = folder.path();
    endless(path);
    let is_there = |name: &str| path.join(name).exists();
    ["in", "unread.vcd", "slow.vcd"].iter().for_each(|name| pipe(path, name));
    // It waits for what it is to read.
    for line in ["run in", "ncp run in", "replay in"] {
        let mut waits = under_way(path, &format!("{line} --plot out.svg"));
        let _input = File::create(path.join("in")).unwrap();
        waits.signal(Signal::TERM);
        assert_eq!(waits.child.wait_in_time().unwrap().code(), Some(130), "{line}");
        assert!(!is_there("out.svg"));
    }
    // It waits for somebody who reads what it draws.
    let outputs = "--plot out.svg --as gcode out.nc --record out.jsonl --trace out.trace";
    for (line, signal) in [("run endless.txt", Signal::INT), ("ncp run long.ncp", Signal::TERM)] {
        let mut waits = under_way(path, &format!("{line} {outputs} --vcd unread.vcd"));
        process::limits::until("it begins", || is_there("out.trace"));
        waits.signal(signal);
        assert_eq!(waits.child.wait_in_time().unwrap().code(), Some(130), "{line}");
        assert!(!["out.svg", "out.nc", "out.jsonl"].into_iter().any(is_there), "{line}");
        fs::remove_file(path.join("out.trace")).unwrap();
    }
    // It runs, draws, and waits for somebody who reads no further: until then nothing is there, and who asks
    // again and again does not wait.
    let line = "run endless.txt --for 10000h --plot out.svg --as gcode out.nc --vcd slow.vcd";
    let mut waits = under_way(path, line);
    let name = path.join("slow.vcd");
    let mut reader = in_time("a writer of the pipe", || File::open(name).unwrap());
    reader.read_exact(&mut [0; 10_000]).unwrap();
    assert!(!["out.svg", "out.nc"].into_iter().any(is_there));
    process::limits::until("it ends", || {
        waits.signal(Signal::INT);
        waits.child.try_wait().unwrap().is_some()
    });
    assert_eq!(waits.child.wait_in_time().unwrap().code(), Some(130));
}

/// A pipe is open until all is written, so that its reader does not find an end before.
#[test]
fn a_picture_goes_into_a_pipe() {
    let folder = bench();
    pipe(folder.path(), "out.svg");
    let mut run =
        under_way(folder.path(), "run examples/commands.txt --machine mill --plot out.svg");
    let svg = read(folder.path(), "out.svg");
    assert_eq!(run.child.wait_in_time().unwrap().code(), Some(0));
    assert!(svg.ends_with("</svg>\n"), "{svg}");
}

/// What stands there is whole until the new picture is, and nothing is left where nothing stood.
#[test]
fn a_disk_that_is_full_breaks_no_picture_off() {
    let folder = bench();
    let path = folder.path();
    written(path, "list.txt", "@07\n@0A100,900,0,900,0,900,0,900\n");
    fs::create_dir(path.join("drawn")).unwrap();
    written(path, "drawn/old.svg", "<svg/>");
    symlink("/dev/full", path.join("full.svg")).unwrap();
    symlink("drawn/old.svg", path.join("link.svg")).unwrap();
    let run = |limit: &str, name: &str| {
        let line = format!("{limit} exec bin/vimc4 run list.txt --plot {name}");
        said(shell(path, &line))
    };
    let small = "trap '' XFSZ; ulimit -f 1;";
    for (limit, name) in
        [(small, "drawn/old.svg"), (small, "link.svg"), (small, "drawn/new.svg"), ("", "full.svg")]
    {
        let (code, _, err) = run(limit, name);
        assert!(code == 2 && err.contains("make room where it leads to"), "{name}: {err}");
        assert_eq!(read(path, "drawn/old.svg"), "<svg/>", "{name}");
        assert_eq!(fs::read_dir(path.join("drawn")).unwrap().count(), 1, "{name}");
    }
    let (code, _, err) = run("", "link.svg");
    assert_eq!(code, 0, "{err}");
    assert!(fs::symlink_metadata(path.join("link.svg")).unwrap().is_symlink());
    assert!(read(path, "drawn/old.svg").ends_with("</svg>\n"));
    assert_eq!(fs::read_dir(path.join("drawn")).unwrap().count(), 1);
}

#[test]
fn what_is_wrong_is_said_before_anything_is_done() {
    let folder = bench();
    ["kept.vcd", "kept.vcd.jsonl"].iter().for_each(|name| written(folder.path(), name, "kept"));
    for (line, text) in [
        ("--plot out.pdf", "use .svg or .png"),
        ("--plot nowhere/out.svg", "cannot write nowhere/out.svg"),
        ("--as step out.step", "--as step: this is not a format"),
        ("--as gcode nowhere/out.nc", "cannot write nowhere/out.nc"),
        ("--as gcode -", "`-` is where the report goes"),
        ("--vcd -", "`-` is where the report goes"),
        ("--record out.jsonl --vcd nowhere/out.vcd", "cannot write nowhere/out.vcd"),
        ("--vcd kept.vcd --record kept.vcd.jsonl", "no recording is overwritten"),
        ("--plot-view top", "--plot <OUT>"),
        ("--plot a.svg --plot-view below", "top, front, side, iso, time"),
    ] {
        let (code, out, err) = run(folder.path(), &format!("run examples/commands.txt {line}"));
        assert_eq!((code, out.as_str()), (2, ""), "{line:?}");
        assert!(err.contains(text), "{line:?}: {err}");
    }
    assert!(!folder.path().join("out.jsonl").exists());
    assert_eq!(read(folder.path(), "kept.vcd"), "kept");
}

#[cfg(target_os = "linux")]
#[test]
fn it_is_shown_where_something_can_show_it() {
    let folder = bench();
    let bin = folder.path().join("bin");
    let open = |path: &Path| {
        let mut command = process::vimc4(
            folder.path(),
            &["circle", "--radius", "9", "--plot", "a.svg", "--open"],
        );
        said(command.env("PATH", path).output_in_time().unwrap())
    };
    let (code, _, err) = open(&bin);
    assert_eq!(code, 0);
    assert!(err.contains("cannot show a.svg, because xdg-open does not start"), "{err}");
    let viewer = "#!/bin/sh\necho \"$1\" > shown.part\nexec /bin/mv shown.part shown.txt\n";
    let program = bin.join("xdg-open");
    fs::write(&program, viewer).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(open(&bin).0, 0);
    let shown = folder.path().join("shown.txt");
    process::limits::until("the picture is shown", || shown.exists());
    assert_eq!(fs::read_to_string(shown).unwrap(), "a.svg\n");
}
