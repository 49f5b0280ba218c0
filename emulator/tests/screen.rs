//! The full screen of `vimc4 console`, and what a run leaves on a terminal, as tmux shows it: keys go in as
//! somebody types them, and what is compared is what is seen.
//!
//! Where tmux is missing the tests are shown as ignored, with the reason in their names. With
//! `VIMC4_REQUIRE_TOOLS=1` they fail instead.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::process::{Command, ExitCode};
use std::thread;
use std::time::Duration;

use libtest_mimic::{Arguments, Failed, Trial};

type Outcome = Result<(), Failed>;

/// What is tried, and how.
type Tried = (&'static str, fn() -> Outcome);

#[path = "dap/editor.rs"]
#[expect(dead_code, reason = "each test uses its part of it")]
mod editor;
#[path = "screen/faces.rs"]
mod faces;
#[expect(dead_code, reason = "each test uses its part of it")]
mod process;
#[path = "screen/tmux.rs"]
mod tmux;

use process::limits::InTime;
use tmux::{Tmux, VIMC4, root};

const MILL: &str = "examples/plate.ncp --machine mill";

/// Through a stop, two steps back, a branch with the emergency stop pressed, and back.
fn a_walk() -> Outcome {
    let tmux = Tmux::start(80, 24);
    tmux.console(MILL);
    let first = tmux.screen();
    assert!(first.starts_with(" imc4 on mill  0.000000 s"), "{first}");
    for part in [
        "examples/plate.ncp",
        "axes",
        "path X Y | Z Y",
        "conversation",
        "E estop",
        "time, by command",
    ] {
        assert!(first.contains(part), "{part} is missing:\n{first}");
    }
    // To the circle, where a breakpoint is.
    tmux.type_(":break command @y");
    tmux.press(&["Enter"]);
    tmux.wait_for("breakpoint 1: command @y");
    tmux.type_("c");
    tmux.wait("the stop before the circle", |screen| {
        ["@0y6400", "breakpoint 1", "X      1,600"].iter().all(|part| screen.contains(part))
    });
    // Two commands back.
    tmux.press(&["Left", "Left"]);
    let back = tmux.wait_for("#7 @0A1600");
    assert!(back.lines().next().unwrap().contains("#7 @0A1600"), "{back}");
    // From a moment of that way on the emergency stop is pressed: that is another branch.
    tmux.command(":next x = 800");
    tmux.wait_for("X        800");
    tmux.type_("E");
    tmux.press(&["Right"]);
    tmux.wait_for("estop PRESSED");
    let branch = tmux.wait_for("one of 2 branches");
    assert!(branch.contains("E estop PRESSED"), "{branch}");
    // And back to the other, at whose end the job is done.
    tmux.type_("v");
    let end = tmux.wait("the end of the job", |screen| screen.contains("main, one of 2 branches"));
    assert!(end.contains("X      9,840") && !end.contains("PRESSED"), "{end}");
    tmux.command(":branches");
    let branches = tmux.wait_for("from main");
    assert!(branches.contains("branch 1"), "{branches}");
    // It quits where the footer says so.
    tmux.wait_for("q quit");
    tmux.type_("q");
    tmux.wait_for("ended 0");
    // A screen that was opened from the line console comes back to it.
    tmux.command(&format!("clear; {VIMC4} console {MILL}; echo ended $?"));
    tmux.wait_for("(vimc4)");
    tmux.command("screen");
    tmux.wait_for("q back");
    tmux.type_("q");
    tmux.wait("the line console", |screen| {
        screen.contains("(vimc4)") && !screen.contains(": command")
    });
    tmux.command("quit");
    tmux.wait_for("ended 0");
    Ok(())
}

/// What the cells of a picture say, row by row.
fn text_of(svg: &str) -> Vec<String> {
    let mut rows: Vec<Vec<char>> = Vec::new();
    for line in svg.lines().filter_map(|line| line.strip_prefix("<text ")) {
        let number = |name: &str| -> usize {
            let (_, value) = line.split_once(&format!("{name}=\"")).unwrap();
            value.split('"').next().unwrap().parse().unwrap()
        };
        // A character is 8 wide and 17 high, and there is a margin.
        let (column, row) = ((number("x") - 8) / 8, (number("y") - 21) / 17);
        let (_, text) = line.split_once('>').unwrap();
        let text = text.strip_suffix("</text>").unwrap();
        let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
        let text = text.replace("&amp;", "&");
        rows.resize(rows.len().max(row + 1), Vec::new());
        let cells = &mut rows[row];
        cells.resize(cells.len().max(column + text.chars().count()), ' ');
        for (place, c) in text.chars().enumerate() {
            cells[column + place] = c;
        }
    }
    rows.iter().map(|row| row.iter().collect::<String>().trim_end().to_owned()).collect()
}

/// What the manual shows is what a terminal shows, cell by cell.
fn the_pictures_of_the_manual() -> Outcome {
    for (width, height) in [(80, 24), (200, 60)] {
        let folder = tempfile::tempdir()?;
        for name in ["docs", "examples"] {
            fs::create_dir(folder.path().join(name))?;
        }
        let plate = "examples/plate.ncp";
        fs::copy(root().join(plate), folder.path().join(plate))?;
        let tmux = Tmux::start(width, height);
        tmux.command(&format!("cd {}", folder.path().display()));
        tmux.console(MILL);
        let name = format!("docs/console-{width}x{height}.svg");
        let script = fs::read_to_string(root().join("examples/pictures.txt"))?;
        let typed = script.lines().take_while(|line| !line.contains(&name));
        // A picture that is written is told of on the screen, and not in what a script draws.
        let is_typed = |line: &&str| !line.starts_with('#') && !line.starts_with("picture");
        for line in typed.filter(is_typed) {
            tmux.command(&format!(":{line}"));
        }
        let kept = text_of(&fs::read_to_string(root().join(&name))?);
        // The dots of the path are drawn and not written in a picture.
        let is_dots = |c: char| ('\u{2800}'..='\u{28FF}').contains(&c);
        let rows = |screen: &str| -> Vec<String> {
            let text = screen.replace(is_dots, " ");
            text.lines().map(|row| row.trim_end().to_owned()).collect()
        };
        // What it is about comes last.
        tmux.wait(&format!("what {name} shows:\n{}\n", kept.join("\n")), |screen| {
            rows(screen) == kept
        });
        assert!(kept.len() == usize::from(height), "{name}");
    }
    Ok(())
}

fn the_command_line_completes_and_remembers() -> Outcome {
    let tmux = Tmux::start(80, 24);
    tmux.console(MILL);
    tmux.type_(":conti");
    tmux.press(&["Tab"]);
    tmux.wait_for(":continue [TIME]");
    tmux.press(&["C-u"]);
    tmux.type_("br");
    tmux.press(&["Tab", "Tab"]);
    tmux.wait_for("breakpoints");
    tmux.press(&["Escape"]);
    tmux.wait_for(": command");
    tmux.command(":frobnicate");
    tmux.wait_for("! ");
    tmux.command(":where");
    tmux.wait_for("> where");
    tmux.type_(":");
    tmux.press(&["Up", "Up"]);
    tmux.wait_for(":frobnicate");
    tmux.press(&["Escape"]);
    tmux.wait_for(": command");
    tmux.type_("?");
    let keys = tmux.wait_for("any key closes this");
    assert!(keys.contains("emergency stop"), "{keys}");
    tmux.type_(" ");
    tmux.wait("the keys are gone", |screen| !screen.contains("any key closes this"));
    Ok(())
}

fn another_size_is_drawn_at_once() -> Outcome {
    let tmux = Tmux::start(80, 24);
    tmux.console(MILL);
    tmux.run(&["resize-window", "-t", "t", "-x", "200", "-y", "60"]);
    tmux.wait("the ports have room", |screen| screen.contains("─ ports ─"));
    tmux.run(&["resize-window", "-t", "t", "-x", "50", "-y", "10"]);
    tmux.wait_for("60 x 20 characters are needed");
    tmux.run(&["resize-window", "-t", "t", "-x", "80", "-y", "24"]);
    tmux.wait_for(": command");
    Ok(())
}

fn ctrl_z_gives_the_terminal_back_and_fg_comes_back() -> Outcome {
    let tmux = Tmux::start(80, 24);
    tmux.console(MILL);
    tmux.press(&["C-z"]);
    tmux.wait("the shell has the terminal", |screen| {
        screen.contains("shell>") && !screen.contains(": command")
    });
    tmux.command("echo still $((40 + 2))");
    tmux.wait_for("still 42");
    tmux.command("fg");
    tmux.wait_for(": command");
    tmux.type_("s");
    tmux.wait_for("#1 @07");
    Ok(())
}

fn who_ends_it_from_outside_gets_the_terminal_back() -> Outcome {
    let tmux = Tmux::start(80, 24);
    tmux.console(MILL);
    let process = tmux.process();
    let killed = Command::new("kill").arg(process.to_string()).status_in_time()?;
    assert!(killed.success());
    let screen = tmux.wait_for("ended 143");
    assert!(!screen.contains(": command"), "{screen}");
    tmux.command("echo still $((40 + 2))");
    tmux.wait_for("still 42");
    Ok(())
}

fn without_colour_there_is_none() -> Outcome {
    let tmux = Tmux::start(80, 24);
    tmux.command("export NO_COLOR=1");
    tmux.console(MILL);
    let screen = tmux.screen_with_attributes();
    let colours = ["\x1b[31m", "\x1b[32m", "\x1b[35m", "\x1b[36m", ";31m", ";35m"];
    assert!(!colours.iter().any(|colour| screen.contains(colour)), "{screen:?}");
    assert!(screen.contains("\x1b[7m"), "the heading is reversed: {screen:?}");
    Ok(())
}

/// The processor time that a program has used, in ticks of the clock.
fn ticks(process: u32) -> u64 {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit(") ").next().unwrap().split(' ').collect();
    let number = |place: usize| fields[place].parse::<u64>().unwrap();
    number(11) + number(12)
}

fn while_nobody_types_nothing_is_done() -> Outcome {
    let tmux = Tmux::start(200, 60);
    tmux.console(MILL);
    let process = tmux.process();
    let before = ticks(process);
    thread::sleep(Duration::from_secs(1));
    assert_eq!(ticks(process), before);
    Ok(())
}

/// A controller behind a port: it runs while the screen shows it, and is paused at a key.
fn a_running_controller_is_seen_and_paused() -> Outcome {
    let tmux = Tmux::start(80, 24);
    let port = "--pty none --tcp 127.0.0.1:0";
    tmux.console(&format!("imc4 --machine mill {port}"));
    tmux.wait_for("paused");
    tmux.command(":send @07");
    tmux.command(":send @0A12000,400,0,900,0,900,0,900");
    tmux.type_(" ");
    tmux.wait("it moves", |screen| screen.contains("RUNS") && screen.contains("400 Hz"));
    tmux.type_("X");
    tmux.wait("it stands", |screen| screen.contains("RUNS") && !screen.contains("400 Hz"));
    tmux.type_(" ");
    let paused = tmux.wait_for("paused");
    assert!(paused.contains("stopped by STOP"), "{paused}");
    Ok(())
}

/// A search that takes long, on the last line of the screen until Ctrl-C ends it.
fn a_long_search_shows_how_far_it_is() -> Outcome {
    let tmux = Tmux::start(80, 24);
    let list = tmux.folder.path().join("list.txt").display().to_string();
    fs::write(&list, "71\n0 2,900,0,900,0,900,0,900\n0 -1,900,0,900,0,900,0,900\n3 0,-2\n9\n")?;
    tmux.console(&list);
    tmux.wait_for("q quit");
    tmux.command(":next y = 5");
    let during = tmux.wait_for("searching, at ");
    assert!(during.contains(" s; Ctrl-C ends it") && !during.contains("q quit"), "{during}");
    tmux.press(&["C-c"]);
    let after = tmux.wait_for("cancelled");
    assert!(tmux.wait_for("q quit").contains("axes"), "{after}");
    tmux.type_("q");
    tmux.wait_for("ended 0");
    Ok(())
}

/// A recording of which only the beginning is read before anything is shown.
fn a_long_recording_is_read_while_nobody_types() -> Outcome {
    let tmux = Tmux::start(80, 24);
    let file = |name: &str| tmux.folder.path().join(name).display().to_string();
    let (commands, recording) = (file("long.txt"), file("long.jsonl"));
    fs::write(&commands, "@01\n".to_owned() + &"@0P\n".repeat(12_000))?;
    let mut run = Command::new(VIMC4);
    run.args(["run", &commands, "--record", &recording]);
    assert!(run.output_in_time()?.status.success());
    // Nobody asks for its end, and it is there.
    tmux.console(&recording);
    tmux.wait("all of it is read", |screen| {
        screen.contains("time, by command") && !screen.contains("% read")
    });
    tmux.type_("q");
    tmux.wait_for("ended 0");
    // What is typed meanwhile is carried out first, and then it is read on.
    tmux.command(&format!("clear; {VIMC4} console {recording}; echo ended $?"));
    tmux.command("print 40 + 2");
    tmux.wait("the answer", |screen| screen.lines().any(|line| line.trim() == "42"));
    tmux.wait("all of it is read", |_| {
        tmux.command("usage");
        tmux.screen().contains("12001 inputs")
    });
    let screen = tmux.screen();
    assert!(screen.contains("(vimc4) usage"), "{screen}");
    tmux.command("quit");
    tmux.wait_for("ended 0");
    tmux.command("echo still $((40 + 2))");
    tmux.wait_for("still 42");
    Ok(())
}

/// It stands where the job begins, and each wait of it holds up who goes on.
fn a_job_that_asks_the_operator() -> Outcome {
    let tmux = Tmux::start(80, 24);
    let job = tmux.folder.path().join("job.ncp");
    fs::write(&job, "IMF_PBL_V1.0\nREF XYZ\nVEL 8000\nHALT\nGETTOOL 2\nMOVEABS X10000\nPROGEND\n")?;
    tmux.console(&format!("{} --machine mill", job.display()));
    let first = tmux.screen();
    assert!(first.starts_with(" imc4 on mill  0.000000 s"), "{first}");
    tmux.type_("c");
    tmux.wait_for("line 4: HALT; continue goes on");
    tmux.type_("c");
    tmux.wait_for("line 5: put in tool 2; continue goes on");
    Ok(())
}

/// What showed how far the files are is gone before it is said that they end, and does not come back.
fn behind_what_an_interrupted_run_says_is_no_progress() -> Outcome {
    let tmux = Tmux::start(120, 24);
    let path = |name: &str| tmux.folder.path().join(name).display().to_string();
    fs::write(
        path("round.txt"),
        "0400,2000,0,900,0,900,0,900\n0-400,2000,0,900,0,900,0,900\n3 0,-2\n9\n",
    )?;
    let run = format!("run {} --machine mill", path("round.txt"));
    let short = path("short.jsonl");
    tmux.command(&format!("{VIMC4} {run} --for 1s --record {short} > {}; echo made", path("said")));
    tmux.wait("a recording", |screen| screen.contains("\nmade"));
    // The same, but its end comes in thirty years.
    let recording = fs::read_to_string(&short)?;
    let begin = recording.trim_end().rsplit_once('\n').map_or("", |(begin, _)| begin);
    let end = r#"{"at":1000000000000000000,"end":"the run has ended"}"#;
    fs::write(path("long.jsonl"), format!("{begin}\n{end}\n"))?;
    let replay = format!("replay {}", path("long.jsonl"));
    for (line, said) in [
        (format!("{run} --for 10000h"), "it was interrupted"),
        (replay, "interrupted: what is drawn ends"),
    ] {
        tmux.command("clear");
        let seen = path("seen");
        let _ = fs::remove_file(&seen);
        tmux.run(&["pipe-pane", "-t", "t", &format!("cat > {seen}")]);
        let (csv, perfetto) = (path("o.csv"), path("o.pf"));
        tmux.command(&format!("{VIMC4} {line} --csv {csv} --perfetto {perfetto}; echo ended $?"));
        tmux.wait_for("o.csv: ");
        tmux.press(&["C-c"]);
        tmux.wait("the end", |screen| screen.contains("ended 130"));
        let mut behind = String::new();
        process::limits::until("all of it is written down", || {
            let all = String::from_utf8_lossy(&fs::read(&seen).unwrap_or_default()).into_owned();
            behind = all.split_once(said).map_or(String::new(), |all| all.1.to_owned());
            behind.contains("ended 130")
        });
        tmux.run(&["pipe-pane", "-t", "t"]);
        assert!(!behind.contains("MB"), "{behind:?}");
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let missing = tmux::missing();
    let tests: [Tried; 14] = [
        ("the pictures of the manual", the_pictures_of_the_manual),
        ("a walk through a job", a_walk),
        ("a job that asks the operator", a_job_that_asks_the_operator),
        ("every face shows the same state", faces::every_face_shows_the_same_state),
        ("the command line completes and remembers", the_command_line_completes_and_remembers),
        ("another size is drawn at once", another_size_is_drawn_at_once),
        (
            "an interrupted run leaves no progress",
            behind_what_an_interrupted_run_says_is_no_progress,
        ),
        ("Ctrl-Z and fg", ctrl_z_gives_the_terminal_back_and_fg_comes_back),
        ("ended from outside", who_ends_it_from_outside_gets_the_terminal_back),
        ("without colour", without_colour_there_is_none),
        ("while nobody types nothing is done", while_nobody_types_nothing_is_done),
        ("a running controller is seen and paused", a_running_controller_is_seen_and_paused),
        ("a long search shows how far it is", a_long_search_shows_how_far_it_is),
        (
            "a long recording is read while nobody types",
            a_long_recording_is_read_while_nobody_types,
        ),
    ];
    let trials = tests.map(|(name, body)| {
        let name = missing.map_or(name.to_owned(), |why| format!("{name} ({why})"));
        Trial::test(name, body).with_ignored_flag(missing.is_some() && !required)
    });
    libtest_mimic::run(&arguments, trials.into()).exit_code()
}
