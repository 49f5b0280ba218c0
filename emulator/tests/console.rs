//! `vimc4 console`, from outside: scripts, pipes, terminals, and host software that is held.

#![expect(clippy::cognitive_complexity, clippy::too_many_lines, reason = "one test is one story")]
#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{BufRead, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

#[path = "console/terminal.rs"]
mod terminal;

use terminal::Terminal;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, Timed};
use process::{Process, VIMC4, ask, connect, root, run, vimc4};

/// Runs `vimc4 console` in the folder of the project with this on its standard input.
fn console(arguments: &[&str], typed: &str) -> Output {
    console_of(arguments, typed.as_bytes())
}

/// The same with any bytes.
fn console_of(arguments: &[&str], typed: &[u8]) -> Output {
    let mut command = vimc4(&root(), &[&["console"], arguments].concat());
    let mut child = command.stdin(Stdio::piped()).start().unwrap();
    // It may end without having read anything.
    let _ = child.stdin.take().unwrap().write_all(typed);
    child.output_in_time().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What a list of commands said that were all carried out.
fn said(arguments: &[&str], typed: &str) -> String {
    let output = console(arguments, typed);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{out}\n{err}");
    out
}

// --- scripts ---

#[test]
fn a_broken_recording_is_opened_as_a_recording() {
    let whole = fs::read(root().join("examples/limit.jsonl")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let first = whole.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    };
    for broken in [
        file("bom.jsonl", &[b"\xEF\xBB\xBF", &whole[..]].concat()),
        file("headless.jsonl", &whole[first..]),
        file("blank.jsonl", &[b" ", &whole[..]].concat()),
    ] {
        let output = console(&[&broken], "where\n");
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert!(!err.contains("unknown or malformed command"), "{broken}: {err}");
        match output.status.code() {
            Some(0) => assert!(out.contains("> where\n0ms on main"), "{broken}: {out}"),
            _ => assert!(err.contains("line 1") && err.contains("recording"), "{broken}: {err}"),
        }
    }
    // What was torn off while it was written is told of, and the rest is there.
    let torn = file("torn.jsonl", &whole[..whole.len() - 20]);
    let output = console(&[&torn], "goto end\n");
    let lines = whole.iter().filter(|byte| **byte == b'\n').count();
    let err = text(&output.stderr);
    assert!(err.contains(&format!("Line {lines} was torn off")), "{err}");
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn an_endless_file_is_no_script() {
    let output = console(&["imc4", "--pty", "none", "--tcp", "none"], "source /dev/zero\n");
    let err = text(&output.stderr);
    assert!(output.status.code() == Some(1) && err.contains("larger than 8 MiB"), "{err}");
    let script = ["imc4", "--pty", "none", "--tcp", "none", "--script", "/dev/zero"];
    let output = console(&script, "");
    let err = text(&output.stderr);
    assert!(output.status.code() == Some(2) && err.contains("larger than 8 MiB"), "{err}");
}

#[test]
fn what_comes_through_a_pipe_is_carried_out_line_by_line() {
    let out = said(
        &["examples/commands.txt", "--machine", "mill"],
        "# what comes first\n\nnext z < -100\nprint z\nback command\nassert z = 0\nassert not (x = 5)\n",
    );
    assert!(out.contains("> print z\n-101\n"), "{out}");
    assert!(!out.contains("what comes first"), "{out}");
}

#[test]
fn a_claim_that_does_not_hold_ends_a_script_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("look.txt");
    fs::write(&script, "continue\nassert x = 3200\nassert x = 3201\nprint 5\n").unwrap();
    let script = script.to_str().unwrap();
    let output = console(&["examples/commands.txt", "--machine", "mill", "--script", script], "");
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(1), "{out}{err}");
    assert!(err.contains("line 3") && err.contains("assert x = 3201"), "{err}");
    // What holds says nothing, and nothing is done behind what does not.
    assert!(out.contains("> assert x = 3200\n") && !out.contains("print 5"), "{out}");
}

#[test]
fn a_command_that_is_none_ends_a_pipe_with_its_line() {
    let output =
        console(&["imc4", "--pty", "none", "--tcp", "none"], "where\nfrobnicate\nprint x\n");
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(err.contains("line 2") && err.contains("frobnicate"), "{err}");
    assert!(!text(&output.stdout).contains("print x"));
}

#[test]
fn what_is_no_text_ends_a_pipe_with_its_line() {
    let arguments = ["imc4", "--pty", "none", "--tcp", "none"];
    let noise: Vec<u8> =
        (0_u32..4_096).map(|n| (n.wrapping_mul(0x9E37_79B9) >> 24) as u8).collect();
    let long = vec![b'x'; 1 << 17];
    for (typed, wanted) in [
        (&b"where\n\xFF\xFE\nprint x\n"[..], "line 2: this is not a text: the byte FF"),
        (
            b"where\nsend @07\x1B[2J\n",
            "line 2: this is not a text: it has the control character 1B",
        ),
        (b"\0\0\0\n", "line 1: this is not a text: it has the control character 00"),
        (&noise, "line 1: this is not a text"),
        (&long, "line 1: a line has 65536 bytes at most"),
    ] {
        let output = console_of(&arguments, typed);
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{err}");
        assert!(err.contains(wanted), "{err}");
        assert!(!text(&output.stdout).contains("print x"));
    }
    // Lines of Windows are lines.
    assert!(said(&arguments, "print x\r\nprint y\r\n").ends_with("> print y\n0\n"));
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("script.txt");
    fs::write(&script, "where\nprint \x07x\n").unwrap();
    let output = console(&[&arguments[..], &["--script", script.to_str().unwrap()]].concat(), "");
    assert!(
        text(&output.stderr).contains("line 2: this is not a text"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn a_job_is_stepped_through_with_the_options_that_it_is_run_with() {
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("job.ncp");
    fs::write(&job, "IMF_PBL\nREF XYZ\nVEL 5000\nMOVEABS X1000 Z-5000\n").unwrap();
    let job = job.to_str().unwrap();
    let end = |options: &[&str]| {
        said(&[&[job, "--machine", "mill"], options].concat(), "goto end\nprint x\n")
    };
    let last = |out: String| out.lines().last().unwrap_or_default().to_owned();
    assert_eq!(last(end(&["--zero=100mm,50mm,-60mm"])), "8080");
    assert_eq!(last(end(&[])), "80");
    for other in ["examples/commands.txt", "examples/limit.jsonl", "imc4"] {
        let refused = console(&[other, "--zero=1,2"], "");
        let err = text(&refused.stderr);
        assert!(err.contains(&format!("{other} is no job")) && err.contains("--zero"), "{err}");
        assert_eq!(refused.status.code(), Some(2));
    }
}

#[test]
fn a_recording_is_opened_and_not_run() {
    let output = Command::new(VIMC4)
        .args(["run", "examples/overlooked.jsonl"])
        .current_dir(root())
        .output_in_time()
        .unwrap();
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{err}");
    for wanted in ["overlooked.jsonl is a recording", "vimc4 replay", "vimc4 console"] {
        assert!(err.contains(wanted), "{err}");
    }
}

/// Whichever way a file is opened, it is told what it is.
#[test]
fn what_is_no_program_is_told_alike() {
    let folder = tempfile::tempdir().unwrap();
    let shell = |line: &str| {
        let line = line.replace("vimc4", VIMC4);
        let mut command = Command::new("sh");
        let output =
            command.args(["-c", &line]).current_dir(folder.path()).output_in_time().unwrap();
        (output.status.code(), text(&output.stderr))
    };
    let limit = fs::read(root().join("examples/limit.jsonl")).unwrap();
    for (name, bytes) in [
        ("limit.jsonl", limit),
        ("typo.txt", b"MOVABS X10\nMOVABS X20\n".to_vec()),
        ("list.txt", b"@07\n@0P\n".to_vec()),
        ("field.txt", b"; axes: 7\n71\n9\n".to_vec()),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let packed = shell("gzip -k list.txt limit.jsonl && mv limit.jsonl.gz limit.packed");
    assert_eq!(packed.0, Some(0), "{}", packed.1);
    let runs = "vimc4 run {}; vimc4 send {} --to /dev/null";
    let opened = "vimc4 run {}; vimc4 console {} < /dev/null; vimc4 send {} --to /dev/null";
    for (line, name, told) in [
        (runs, "limit.jsonl", "limit.jsonl is a recording"),
        (runs, "limit.packed", "limit.packed is a recording"),
        (opened, "list.txt.gz", "list.txt.gz is packed with gzip"),
        (opened, "typo.txt", "typo.txt begins with MOVABS"),
        (
            opened,
            "field.txt --model smcu",
            "field.txt is a data field, and the smcu does not speak",
        ),
    ] {
        for line in line.replace("{}", name).split("; ") {
            let (code, err) = shell(line);
            assert!(code == Some(2) && err.contains(told), "{line}: {err}");
            assert!(
                name != "typo.txt" || err.contains("perhaps MOVEABS is meant"),
                "{line}: {err}"
            );
        }
    }
    let (_, err) = shell("vimc4 run - < limit.jsonl");
    assert!(err.contains("standard input is a recording"), "{err}");
    assert!(err.contains("`vimc4 replay -` plays it again"), "{err}");
}

#[test]
fn what_is_no_file_and_no_model_is_wrong_usage() {
    for (arguments, wanted) in [
        (&["nothing.txt"][..], "nothing.txt is neither a file nor a model"),
        (&["imc4", "--machine", "lathe"], "lathe"),
        (&["imc4", "--pty", "none", "--tcp", "none", "--script", "nothing.txt"], "nothing.txt"),
        (&["imc4", "--time", "manual", "--pty", "none", "--tcp", "127.0.0.1:0"], "moved by hand"),
        (&["imc4", "--screen"], "needs a terminal"),
    ] {
        let output = console(arguments, "quit\n");
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {err}");
        assert!(err.contains(wanted), "{arguments:?}: {err}");
    }
}

#[test]
fn a_picture_without_room_is_refused() {
    let arguments = ["imc4", "--pty", "none", "--tcp", "none"];
    let output = console(&arguments, "picture /nowhere/x.svg 20x5\n");
    assert!(text(&output.stderr).contains("60x20 characters at least"), "{}", text(&output.stderr));
}

#[test]
fn on_a_branch_the_rest_of_the_file_is_sent_until_an_error_reply() {
    let file = ["examples/commands.txt", "--machine", "mill"];
    let sent = "as you go on, the rest of examples/commands.txt is sent";
    // Somewhere else on X, and the relative ways that follow begin there.
    let out = said(&file, "goto command 4\nput x = 1000\ncontinue\nprint x\nbranches\n");
    assert!(out.contains(sent), "{out}");
    let main = said(&file, "continue\nprint x\n");
    assert!(main.ends_with("> print x\n3200\n"), "{main}");
    assert!(out.contains("> print x\n4200\n"), "{out}");
    // Software that is careful ends with what it does not understand.
    let out = said(&file, "goto command 4\npress stop\ncontinue\nlist commands\n");
    assert!(!out.contains(sent) && out.contains("F: stopped by STOP"), "{out}");
    assert!(!out.contains("5  @0A800"), "{out}");
    let keeps = [&file[..], &["--keep-going"]].concat();
    let out = said(&keeps, "goto command 4\npress stop\ncontinue\nlist commands\n");
    assert!(out.contains("5  @0A800"), "{out}");
    let out = said(&file, "step 2\nwhat if press stop\ngoto end\npress stop\n");
    assert!(!out.contains(sent), "{out}");
}

#[test]
fn what_is_done_is_done_before_the_next_step() {
    let file = ["examples/commands.txt", "--machine", "mill"];
    let out = said(&file, "goto 1s\nset probe 1\nprint signals.probe\nassert signals.probe = 1\n");
    assert!(out.contains("> print signals.probe\n1\n"), "{out}");
}

#[test]
fn a_compressed_recording_is_known_by_its_content() {
    let folder = tempfile::tempdir().unwrap();
    let packed = folder.path().join("short.jsonl.gz");
    let cut = ["cut", "examples/limit.jsonl", "--from", "7s", "--to", "8s", "--out"];
    let cut = [&cut[..], &[packed.to_str().unwrap()]].concat();
    assert!(vimc4(&root(), &cut).status_in_time().unwrap().success());
    let other = folder.path().join("other.jsonl");
    fs::rename(packed, &other).unwrap();
    let out = said(&[other.to_str().unwrap()], "goto end\nwhere\n");
    assert!(out.contains("8s"), "{out}");
}

#[test]
fn a_list_that_was_not_sent_to_its_end_says_why_there() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("list.txt");
    fs::write(&list, "@07\n@0A1,2\n@0R7\n").unwrap();
    let out = said(&[list.to_str().unwrap(), "--machine", "mill"], "goto end\ncontinue\n");
    assert!(out.contains("line 2: @0A1,2 was answered"), "{out}");
    assert!(out.contains("the rest was not sent"), "{out}");
}

#[test]
fn what_is_sent_by_hand_is_in_no_line_and_moves_none() {
    let file = ["examples/commands.txt", "--machine", "mill"];
    // In front of the one in line 7 comes another one, which nobody has written down.
    let by_hand = "goto command 3\nnext idle\nsend @0V\n";
    let lines = "step\nframes\nstep\nframes\nstep\nframes\n";
    let out = said(&file, &format!("{by_hand}{lines}"));
    assert!(out.contains("command #4: @0V\n"), "{out}");
    assert!(out.contains("command #5: @0M2400,4000,1600,4000,-500,900,0,900 (line 7 of"), "{out}");
    assert!(out.contains("command #6: @0A800,4000,0,4000,-500,900,500,900 (line 9 of"), "{out}");
    // A breakpoint at a line waits for that line, and on the other branch nothing has changed.
    let rest = "break line 9\ncontinue\nframes\ngoto main\nframes\ngoto line 9\nframes\n";
    let out = said(&file, &format!("{by_hand}{rest}"));
    assert!(out.contains("command #6: @0A800,4000,0,4000,-500,900,500,900 (line 9 of"), "{out}");
    assert!(out.contains("command #6: @0P (line 10 of"), "{out}");
    assert!(out.contains("command #5: @0A800,4000,0,4000,-500,900,500,900 (line 9 of"), "{out}");
}

#[test]
fn what_would_come_is_not_sent_twice() {
    let file = ["examples/commands.txt", "--machine", "mill"];
    // What was sent on the one way was sent on the other as well.
    let deeds = ["what if press start", "what if machine bench", "what if send @0P"];
    for deed in deeds {
        let out = said(&file, &format!("goto command 4\n{deed}\ncontinue\nprint x\n"));
        assert!(out.ends_with("> print x\n3200\n"), "{deed}: {out}");
    }
}

#[test]
fn a_script_can_call_another_and_not_itself() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("first.txt"), folder.path().join("second.txt"));
    fs::write(&first, format!("source {}\nprint x\n", second.display())).unwrap();
    fs::write(&second, "send @01\ncontinue\nsend @0A700,900\ncontinue\n").unwrap();
    let out =
        said(&["imc4", "--pty", "none", "--tcp", "none", "--script", first.to_str().unwrap()], "");
    assert!(out.ends_with("> print x\n700\n"), "{out}");
    fs::write(&second, format!("source {}\n", first.display())).unwrap();
    let output = console(
        &["imc4", "--pty", "none", "--tcp", "none", "--script", first.to_str().unwrap()],
        "",
    );
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("calls itself"), "{}", text(&output.stderr));
}

// --- what can be opened ---

#[test]
fn a_list_a_program_a_plot_and_a_job_are_opened_where_they_begin() {
    for (arguments, line, condition) in [
        (&["examples/commands.txt", "--machine", "mill"][..], "goto line 7", "command @M"),
        (&["examples/plate.ncp", "--machine", "mill"], "goto line 9", "command @y"),
        (
            &["examples/board.plt", "--model", "smcu", "--machine", "board-plotter"],
            "step",
            "command PA",
        ),
        (&["examples/program.txt"], "step 2 lines", "line 2"),
    ] {
        let out = said(
            arguments,
            &format!("where\nlist\n{line}\nwhere\ngoto start\nnext {condition}\nwhere\n"),
        );
        assert!(out.contains("> where\n0ms on main") || arguments[0].contains("program"), "{out}");
        assert!(!out.contains("not to be found"), "{arguments:?}: {out}");
    }
}

/// A job that asks the operator three times, twice at one moment.
const ASKS: &str = "IMF_PBL_V1.0\nREF XYZ\nVEL 8000\nMOVEABS X5000\nHALT\nGETTOOL 2\n\
    MOVEABS X10000\nHALT\nPROGEND\n";

#[test]
fn a_job_that_asks_the_operator_is_opened_where_it_begins_and_waits_there() {
    let folder = tempfile::tempdir().unwrap();
    let (job, script) = (folder.path().join("job.ncp"), folder.path().join("script.txt"));
    let walk = "where\ncontinue\ncontinue\ncontinue\nprint x\ncontinue\nprint x\n";
    fs::write(&job, ASKS).unwrap();
    fs::write(&script, walk).unwrap();
    let (job, script) = (job.to_str().unwrap(), script.to_str().unwrap());
    for more in [&[][..], &["--keep-going"]] {
        let arguments = [&[job, "--machine", "mill"], more].concat();
        let typed = said(&arguments, walk);
        assert!(typed.starts_with("> where\n0ms on main"), "{typed}");
        for wait in ["line 5: HALT", "line 6: put in tool 2", "line 8: HALT"] {
            assert!(typed.contains(&format!("{wait}; continue goes on")), "{wait}: {typed}");
        }
        let scripted = said(&[&arguments[..], &["--script", script]].concat(), "");
        assert_eq!(scripted, typed);
    }
}

/// A job that asks and then waits for an input of the bench.
const WAITS: &str = "IMF_PBL_V1.0\nREF XYZ\nVEL 8000\nMOVEABS X5000\nWAIT 500\nHALT ; one\n\
    WAITBIT E1.4==1\nMOVEREL X5000\nPROGEND\n";

#[test]
fn a_job_that_waits_for_an_input_waits_at_its_beginning_and_on_every_branch() {
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("job.ncp");
    fs::write(&job, WAITS).unwrap();
    let arguments = [job.to_str().unwrap(), "--machine", "bench"];
    let waits = "line 7 waits for port 0 bit 3 to be 1; it is 0, and `input 0.3 1` changes that";
    // Whoever runs the job is told that it waits, and for what.
    let told = text(&console(&arguments, "quit\n").stderr);
    assert!(told.contains(&format!("{waits}; the rest is sent then")), "{told}");
    let begins = "goto start\ncontinue\n";
    let branch = "goto 100ms\nhold start\nrelease start\n";
    for before in [begins, &format!("{begins}input 0.3 1\ncontinue\n{branch}continue\n")] {
        let walk = "continue\ncontinue\ncontinue 2s\ncontinue\ninput 0.3 1\ncontinue\nprint x\n";
        let out = said(&arguments, &format!("{before}{walk}goto line 8\nframes\n"));
        assert_eq!(out.matches(waits).count(), 3, "{out}");
        assert!(out.contains("> print x\n800\n"), "{out}");
        assert!(out.ends_with("(line 8 of the file)\n"), "{out}");
    }
    let refused = console(&arguments, "continue\ncontinue\ngoto line 8\n");
    assert_eq!(refused.status.code(), Some(1));
    let told = text(&refused.stderr);
    assert!(told.contains("before line 8, line 7 waits for"), "{told}");
}

#[test]
fn breakpoints_where_a_job_asks_are_counted_logged_and_traced() {
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("job.ncp");
    fs::write(&job, ASKS).unwrap();
    let out = said(
        &[job.to_str().unwrap(), "--machine", "mill"],
        "break line 5\nbreak line 6 log tool {x}\nbreak line 8 hit 2\ncontinue\ncontinue\ncontinue\n\
         breakpoints\ntrace line 8 log at {x}\nreverse\nbreakpoints\n",
    );
    assert_eq!(out.matches("2: tool ").count(), 1, "{out}");
    let listed: Vec<&str> = out.lines().filter(|line| line.contains(" of the file")).collect();
    let times = |place: usize| listed[place].split("  ").last().unwrap_or_default();
    let counted: Vec<&str> = (3..9).map(times).collect();
    assert_eq!(counted, ["1 time", "1 time", "1 time", "1 time", "1 time", "0 times"], "{out}");
    assert!(out.contains("0: at ") || out.contains("  at "), "{out}");
}

#[test]
fn each_command_of_a_job_is_found_by_its_line_and_the_other_way_round() {
    let out = said(
        &["examples/plate.ncp", "--machine", "mill"],
        "break line 13\ncontinue\nlist\nframes\nbreak line 9\nreverse\nframes\n",
    );
    let present: Vec<&str> =
        out.lines().filter(|line| line.starts_with('>') && line.contains("  ")).collect();
    assert!(present.iter().any(|line| line.contains("13  DRILL X0 Y0")), "{out}");
    assert!(out.contains("(line 9 of the file)"), "{out}");
}

#[test]
fn what_follows_an_error_reply_is_sent_if_somebody_wants_it() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("list.txt");
    fs::write(&list, "@01\n@0Q\n@0A500,900\n").unwrap();
    let list = list.to_str().unwrap();
    let output = console(&[list], "continue\nprint x\n");
    assert!(text(&output.stderr).contains("line 2: @0Q was answered"), "{}", text(&output.stderr));
    assert!(text(&output.stdout).ends_with("> print x\n0\n"));
    let output = console(&[list, "--keep-going"], "continue\nprint x\n");
    assert!(text(&output.stderr).contains("1 error reply"), "{}", text(&output.stderr));
    assert!(text(&output.stdout).ends_with("> print x\n500\n"));
}

#[test]
fn steps_and_searches_tell_of_every_error_on_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("list.txt");
    fs::write(&list, "@01\n@0Q\n@0A500,900\n@0W\n@0A700,900\n").unwrap();
    let list = list.to_str().unwrap();
    let files = [list, "--keep-going"];
    for walk in ["step 5 commands", "next x = 700", "continue"] {
        let out = said(&files, &format!("{walk}\n"));
        for wrong in ["@0Q: no command begins", "@0W: no command begins"] {
            assert_eq!(out.matches(wrong).count(), 1, "{walk}: {out}");
        }
    }
    // What is only looked for and not found has no errors on the way.
    let out = said(&files, "next x = 9999\n");
    assert!(out.contains("not to be found") && !out.contains("answer to"), "{out}");
}

// --- host software that is held ---

/// A console with controllers behind TCP ports, to which commands are given one by one.
struct Held {
    process: Process,
    ports: Vec<String>,
}

impl Held {
    fn start(folder: &Path, arguments: &[&str]) -> Held {
        let mut command = Command::new(VIMC4);
        command.args(["console", "imc4", "--machine", "mill", "--tcp", "127.0.0.1:0"]);
        let mut process = Process::start(command.args(arguments).current_dir(folder));
        let controllers = if arguments.contains(&"2") { 2 } else { 1 };
        let mut ports = Vec::new();
        while ports.len() < controllers {
            let line = process.line();
            assert!(!line.is_empty());
            ports.extend(line.strip_prefix("tcp ").map(str::to_owned));
        }
        Held { process, ports }
    }

    fn connect(&self, number: usize) -> TcpStream {
        connect(&self.ports[number - 1])
    }

    fn type_(&mut self, line: &str) {
        self.process.give(&format!("{line}\n"));
    }

    /// Gives a command and returns what it is answered.
    fn ask(&mut self, line: &str) -> String {
        // What comes next says where the answer ends.
        self.type_(line);
        self.type_("controller");
        let output = self.process.output.as_mut().unwrap();
        let mut answer = String::new();
        loop {
            let mut said = String::new();
            assert!(output.read_line(&mut said).unwrap() > 0, "it has ended: {answer}");
            if said == "> controller\n" {
                let mut number = String::new();
                output.read_line(&mut number).unwrap();
                return answer.trim_end().to_owned();
            }
            if said.trim_end() != format!("> {line}") {
                answer.push_str(&said);
            }
        }
    }

    fn quit(mut self) {
        self.type_("quit");
        assert_eq!(self.process.ended().code(), Some(0));
    }
}

#[test]
fn a_breakpoint_holds_the_controller_and_the_client_notices_nothing_but_time() {
    for clock in ["real", "8x"] {
        let folder = tempfile::tempdir().unwrap();
        let mut held =
            Held::start(folder.path(), &["--pty", "none", "--count", "2", "--time", clock]);
        let (mut first, mut second) = (held.connect(1), held.connect(2));
        held.ask("break z < -100");
        first.write_all(b"@07\r@0A400,4000,0,900,-200,900,0,900\r@0P\r").unwrap();
        let stop = held.ask("continue");
        assert!(stop.contains("breakpoint 1, #2 @0A400"), "{stop}");
        assert_eq!(held.ask("print z"), "-101");
        // The first is held in the middle of its move; the second runs on.
        assert_eq!(ask(&mut first, "", 1), "0");
        assert_eq!(
            ask(&mut second, "@07\r@0A300,900,0,900,0,900,0,900\r@0P\r", 21),
            "00000012C000000000000"
        );
        first.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
        assert!(first.read_exact(&mut [0]).is_err(), "nothing is answered while it is held");
        first.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        assert_eq!(held.ask("delete 1"), "");
        let stop = held.ask("continue 1s");
        assert!(stop.contains("the time has come"), "{stop}");
        assert_eq!(ask(&mut first, "", 20), "00000190000000FFFF38", "in {clock} time");
        // The second one is paused only when somebody looks at it.
        let second_is = held.ask("controller 2");
        assert!(second_is.contains("X         300"), "{second_is}");
        held.quit();
    }
}

#[test]
fn who_steps_forward_leads_the_controller_and_who_goes_back_only_looks() {
    let folder = tempfile::tempdir().unwrap();
    let mut held = Held::start(folder.path(), &["--pty", "none", "--time", "8x"]);
    let mut client = held.connect(1);
    held.ask("break command @A");
    client.write_all(b"@07\r@0A400,900,0,900,0,900,0,900\r").unwrap();
    let stop = held.ask("continue");
    assert!(stop.contains("#2 @0A400"), "{stop}");
    assert_eq!(ask(&mut client, "", 1), "0");
    // To the end of the move: the client gets the answer, and only once.
    held.ask("next x = 400");
    assert_eq!(held.ask("print x"), "400");
    assert_eq!(ask(&mut client, "", 1), "0");
    held.ask("last x = 100");
    assert_eq!(held.ask("print x"), "100");
    held.ask("goto end");
    client.write_all(b"@0P\r").unwrap();
    held.ask("continue 10ms");
    assert_eq!(ask(&mut client, "", 19), "0000190000000000000");
    // In the past STOP is pressed instead: that is another branch, and the controller is taken there.
    held.ask("last x = 100");
    held.ask("press stop");
    held.ask("take");
    held.ask("continue 100ms");
    let place: i64 = held.ask("print x").parse().unwrap();
    assert!((101..200).contains(&place), "{place}");
    assert_eq!(ask(&mut client, "", 1), "F");
    let branches = held.ask("branches");
    assert_eq!(branches.lines().count(), 2, "{branches}");
    held.quit();
}

#[test]
fn who_has_looked_back_goes_on_where_the_controller_is() {
    let folder = tempfile::tempdir().unwrap();
    let mut held = Held::start(folder.path(), &["--pty", "none", "--time", "8x"]);
    let mut client = held.connect(1);
    client.write_all(b"@07\r@0A400,900,0,900,0,900,0,900\r").unwrap();
    held.ask("continue 2s");
    assert_eq!(ask(&mut client, "", 2), "00");
    // From the past one comes forward, also over a breakpoint, and then the controller goes on.
    held.ask("back 2");
    held.ask("break x > 200");
    let stop = held.ask("continue");
    assert!(stop.contains("breakpoint 1") && !stop.contains("only looked at"), "{stop}");
    held.ask("delete 1");
    held.ask("continue 5s");
    assert_eq!(converse_while(&mut held, &mut client, "@0P\r", 19), "0000190000000000000");
    assert_eq!(held.ask("branches").lines().count(), 1);
    // What is done in the past is a branch, on which one can go on; nobody notices.
    held.ask("last x = 100");
    let answer = held.ask("press stop");
    assert!(
        answer.contains("the controller itself stays") && answer.contains("`take`"),
        "{answer}"
    );
    let stop = held.ask("continue");
    assert!(stop.contains("on main") && stop.contains("`take`"), "{stop}");
    assert!(held.ask("print x").parse::<i64>().unwrap() < 200);
    held.ask("step 2 events");
    held.ask("goto main");
    assert_eq!(converse_while(&mut held, &mut client, "@0P\r", 19), "0000190000000000000");
    // What would come is no more than that, also from the present on.
    let future = held.ask("what if send @0A77,900,0,900,0,900,0,900");
    assert!(future.contains("`take`"), "{future}");
    held.ask("continue");
    held.ask("goto main");
    assert_eq!(converse_while(&mut held, &mut client, "@0P\r", 19), "0000190000000000000");
    // Taken back it stands there, and nothing that was said is said again.
    held.ask("goto start");
    let taken = held.ask("take");
    assert!(taken.contains("the controller is at"), "{taken}");
    assert_eq!(held.ask("take"), "the controller is here already");
    let answers = converse_while(&mut held, &mut client, "@07\r@0P\r", 20);
    assert_eq!(answers, "00000000000000000000");
    // Also not when what was is looked at to its end.
    held.ask("goto main");
    held.ask("continue");
    held.ask("where");
    client.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    assert!(client.read_exact(&mut [0]).is_err(), "a byte of the past has come");
    held.quit();
}

/// A client sends a line while the controller is let go on for a moment.
fn converse_while(held: &mut Held, stream: &mut TcpStream, line: &str, count: usize) -> String {
    stream.write_all(line.as_bytes()).unwrap();
    let stop = held.ask("continue 500ms");
    assert!(stop.contains("the time has come"), "{stop}");
    ask(stream, "", count)
}

#[test]
fn a_pseudo_terminal_is_there_and_gone_afterwards_also_when_it_is_told_to_end() {
    for told in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let mut held = Held::start(folder.path(), &["--pty", "machine.pty"]);
        let link = folder.path().join("machine.pty");
        assert!(link.is_symlink());
        if told {
            held.process.signal(rustix::process::Signal::TERM);
            assert!(!held.process.ended().success());
        } else {
            held.quit();
        }
        assert!(!link.is_symlink(), "told: {told}");
    }
}

// --- what the manual shows ---

const MANUAL: &str = include_str!("../../docs/stepping.md");

/// What the manual shows of a console that is opened so, if that is what it says.
fn shown(arguments: &[&str]) -> String {
    let opened = format!("$ vimc4 console {}\n", arguments.join(" "));
    let (_, block) = MANUAL.split_once(&opened).unwrap();
    let (block, _) = block.split_once("```").unwrap();
    let typed: String = block
        .lines()
        .filter_map(|line| line.strip_prefix("> "))
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(typed.lines().count() <= 6, "{typed}");
    let out = said(arguments, &typed);
    assert_eq!(out, block, "docs/stepping.md is to show this:\n{out}");
    out
}

#[test]
fn the_limit_switch_is_found_as_the_manual_shows_it() {
    let out = shown(&["examples/overlooked.jsonl"]);
    assert!(
        out.contains("stopped by STOP at the panel") && out.contains("limit switch X+"),
        "{out}"
    );
}

#[test]
fn the_job_that_waits_goes_as_the_manual_shows_it() {
    let out = shown(&["examples/clamped.ncp", "--machine", "bench"]);
    assert!(out.contains("`input 0.3 1` changes that\n    clamped.ncp, line 7: WAITBIT"), "{out}");
}

#[test]
fn the_recording_of_the_hidden_bug_is_that_of_its_driver() {
    if !Command::new("python3")
        .arg("--version")
        .output_in_time()
        .is_ok_and(|output| output.status.success())
    {
        assert!(std::env::var_os("VIMC4_REQUIRE_TOOLS").is_none(), "needs python3");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut command = vimc4(
        folder.path(),
        &["serve", "--machine", "mill", "--time", "instant", "--tcp", "none", "--pty", "vimc4.pty"],
    );
    command.args(["--record", "again.jsonl", "--json", "--until-stdin-closes"]);
    let mut serve = Process::start(&mut command);
    serve.line();
    let driver = root().join("examples/overlooked.py");
    assert!(
        Command::new("python3")
            .arg(driver)
            .current_dir(folder.path())
            .status_in_time()
            .unwrap()
            .success()
    );
    drop(serve.input.take());
    serve.ended();
    // Nobody has pressed STOP this time. What it sends is the same, whatever it is answered.
    let sent = |path: PathBuf| -> Vec<String> {
        let text = fs::read_to_string(path).unwrap();
        let lines =
            text.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        lines.filter_map(|line| Some(line["in"].as_str()?.to_owned())).collect()
    };
    let again = sent(folder.path().join("again.jsonl")).concat();
    assert_eq!(again, sent(root().join("examples/overlooked.jsonl")).concat());
    assert!(again.contains("@0A20000"), "{again}");
}

#[test]
fn the_pictures_of_the_manual_are_what_the_screen_shows() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("docs")).unwrap();
    fs::create_dir(folder.path().join("examples")).unwrap();
    fs::copy(root().join("examples/plate.ncp"), folder.path().join("examples/plate.ncp")).unwrap();
    let script = root().join("examples/pictures.txt");
    let output = Command::new(VIMC4)
        .args(["console", "examples/plate.ncp", "--machine", "mill", "--script"])
        .arg(script)
        .current_dir(folder.path())
        .output_in_time()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    for name in ["docs/console-80x24.svg", "docs/console-200x60.svg"] {
        let (shown, kept) = (folder.path().join(name), root().join(name));
        if std::env::var_os("VIMC4_WRITE").is_some() {
            fs::copy(&shown, &kept).unwrap();
        }
        let is_same = fs::read_to_string(shown).unwrap() == fs::read_to_string(kept).unwrap();
        assert!(
            is_same,
            "{name} shows something else; run this with VIMC4_WRITE=1, and look at it"
        );
        assert!(MANUAL.contains(name.trim_start_matches("docs/")), "{name}");
    }
}

// --- at a terminal ---

#[test]
fn tab_completes_enter_repeats_and_lines_are_remembered() {
    let home = tempfile::tempdir().unwrap();
    let begin = || {
        Terminal::start(
            VIMC4,
            &["console", "examples/commands.txt", "--machine", "mill"],
            &root(),
            home.path(),
        )
    };
    let mut terminal = begin();
    terminal.wait_for("(vimc4) ");
    // `conti` can be one word only.
    terminal.type_("conti\t\r");
    terminal.wait_for("at rest");
    terminal.wait_for("(vimc4) ");
    terminal.type_("back 2 commands\r");
    terminal.wait_for("#4 @0M2400");
    // Nothing but Enter does the last line again.
    terminal.type_("\r");
    terminal.wait_for("#2 @0d2500");
    // Two Tabs show what it can be.
    terminal.type_("br\t\t");
    terminal.wait_for("branches");
    terminal.type_("\x15quit\r");
    assert_eq!(terminal.end(), 0);
    // Another one remembers what was typed.
    let mut terminal = begin();
    terminal.wait_for("(vimc4) ");
    terminal.type_("\x1b[A\x1b[A");
    terminal.wait_for("back 2 commands");
    terminal.type_("\x15\x04");
    assert_eq!(terminal.end(), 0);
}

#[test]
fn ctrl_c_ends_what_is_looked_for_and_not_the_console() {
    let home = tempfile::tempdir().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("list.txt");
    // A program that never ends nor repeats itself, and never comes to where it is looked for.
    fs::write(&list, "71\n0 2,900,0,900,0,900,0,900\n0 -1,900,0,900,0,900,0,900\n3 0,-2\n9\n")
        .unwrap();
    let list = list.to_str().unwrap().to_owned();
    let mut terminal = Terminal::start(VIMC4, &["console", &list], &root(), home.path());
    terminal.wait_for("(vimc4) ");
    terminal.type_("next y > 1000\r");
    terminal.wait_for("\r\n");
    terminal.wait_for("searching, at ");
    terminal.wait_for(" s; Ctrl-C ends it");
    terminal.type_("\x03");
    terminal.wait_for("cancelled");
    terminal.wait_for("(vimc4) ");
    terminal.type_("quit\r");
    assert_eq!(terminal.end(), 0);
}

/// So does a replay that looks for what would explain a difference, which it has shown before.
#[test]
fn a_replay_shows_a_difference_before_it_looks_for_explanations() {
    let home = tempfile::tempdir().unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("list.txt"), "@01\n".to_owned() + &"@0P\n".repeat(6_000)).unwrap();
    let run = Command::new(VIMC4)
        .args(["run", "list.txt", "--record", "r.jsonl"])
        .current_dir(folder.path())
        .output_in_time()
        .unwrap();
    assert!(run.status.success(), "{run:?}");
    let recording = folder.path().join("r.jsonl");
    let text = fs::read_to_string(&recording).unwrap();
    fs::write(&recording, text.replacen("\"out\":\"0\"", "\"out\":\"1\"", 1)).unwrap();
    let mut terminal = Terminal::start(VIMC4, &["replay", "r.jsonl"], folder.path(), home.path());
    terminal.wait_for("They part after 0 bytes");
    terminal.wait_for("searching, at ");
    terminal.wait_for(" s; Ctrl-C ends it");
    terminal.type_("\x03");
    terminal.wait_for("interrupted: what would explain it was still being looked for");
    assert_eq!(terminal.end(), 130);
}

#[test]
fn a_stored_program_is_listed_and_stepped_by_lines_from_its_first_on() {
    let out = said(&["examples/program.txt"], "list\nstep\nstep\nstep\n");
    assert!(out.contains("> list\nthe stored program\n"), "{out}");
    let [first, second, third] = [1, 2, 3].map(|nth| out.split("> step\n").nth(nth).unwrap());
    assert!(first.contains("  a line\n") && first.contains("program line 1: 0\n"), "{out}");
    assert!(second.contains("program line 2: o\n"), "{out}");
    let waits =
        "the program waits for bit 3 of port 0 to be 1; it is 0, and `input 0.3 1` changes that";
    assert!(third.contains(waits), "{out}");
    let out = said(&["examples/program.txt"], "input 0.3 1\nstep command\nnext x = 99999\n");
    assert_eq!(out.matches("the program repeats itself every 1.11").count(), 2, "{out}");
}

#[test]
fn a_recording_has_no_future_beyond_its_end() {
    let lines = "goto end\nwhere\ngoto 30000s\nwhere\ngoto start\ngoto +30000s\nwhere\n";
    let out = said(&["examples/overlooked.jsonl"], lines);
    let places: Vec<&str> =
        out.split("> where\n").skip(1).map(|rest| rest.lines().next().unwrap()).collect();
    assert!(places.iter().all(|place| *place == places[0]) && places.len() == 3, "{out}");
    assert_eq!(out.matches("the end of what is recorded").count(), 2, "{out}");
}

/// Who ends it from outside while a line is typed gets back the terminal as it was, and nothing else.
#[test]
fn the_terminal_is_given_back_from_the_prompt() {
    use rustix::process::{Signal, kill_process};
    for signal in [Signal::TERM, Signal::HUP, Signal::QUIT] {
        let home = tempfile::tempdir().unwrap();
        let program = format!(
            "stty -a >before; {VIMC4} console imc4 --tcp none --pty none & echo $! >pid; fg >/dev/null; \
             stty -a >after; cmp before after && echo the same"
        );
        let mut terminal = Terminal::start("bash", &["-mc", &program], home.path(), home.path());
        terminal.wait_for("(vimc4) ");
        let pid = fs::read_to_string(home.path().join("pid")).unwrap();
        let pid = rustix::process::Pid::from_raw(pid.trim().parse().unwrap()).unwrap();
        kill_process(pid, signal).unwrap();
        terminal.wait_for("\x1b[?2004l");
        assert!(!terminal.said_until("the same").contains("?1049l"), "{signal:?}");
        terminal.end();
    }
}

#[test]
fn a_terminal_that_can_only_print_lines_is_refused_the_full_screen() {
    let home = tempfile::tempdir().unwrap();
    let mut terminal =
        Terminal::start_as("dumb", VIMC4, &["console", "imc4", "--screen"], &root(), home.path());
    terminal.wait_for("TERM says that this terminal can only print lines");
    assert_eq!(terminal.end(), 2);
}

// --- elsewhere ---

/// What the API answers to a request of a method, with its head.
fn request(url: &str, method: &str, path: &str, body: &str) -> String {
    let address = url.trim_start_matches("http://").trim_end_matches('/');
    let mut stream = process::connect(address);
    let request = format!(
        "{method} {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\
         Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

/// What a console here and one on a controller elsewhere print and say of the same lines. In instant
/// time both begin at nothing, and nothing happens but what the lines do.
fn here_and_elsewhere(folder: &Path, lines: &str) -> [(i32, String, String); 2] {
    let (_serve, ready) = Process::serve(
        folder,
        &["--machine", "mill", "--pty", "none", "--time", "instant", "--web"],
    );
    fs::write(folder.join("script.txt"), lines).unwrap();
    let url = ready["http"].as_str().unwrap();
    let here = ["--machine", "mill", "--pty", "none", "--tcp", "127.0.0.1:0", "--time", "instant"];
    [&here[..], &["--connect", url]].map(|place| {
        let outcome = run(folder, &[&["console", "--script", "script.txt"], place].concat());
        let (code, out, err) = outcome;
        // Where it listens.
        let out =
            out.lines().filter(|line| !line.starts_with("tcp ")).map(|line| line.to_owned() + "\n");
        (code, out.collect(), err)
    })
}

#[test]
fn a_controller_elsewhere_is_debugged_in_the_same_words() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("more.txt"), "print x\nassert x = 0\n").unwrap();
    let [here, elsewhere] = here_and_elsewhere(
        folder,
        "# a comment\n\nwhere\nsend @01\nsend @0A5000,900\nstep command\nstep command\ncontinue 1s\n\
         print x\nback command\nsource more.txt\nwhy\nwhat if press stop\nhelp step\ncontroller\nhelp\n",
    );
    assert_eq!(here.0, 0, "{}", here.2);
    assert!(here.1.contains("> print x\n898\n"), "{}", here.1);
    // What needs the terminal of the controller's own program is not offered.
    let local = |line: &&str| line.starts_with("  screen ") || line.starts_with("  picture ");
    assert_eq!(here.1.lines().filter(local).count(), 2);
    let lines: Vec<&str> = here.1.lines().filter(|line| !local(line)).collect();
    assert_eq!(lines, elsewhere.1.lines().collect::<Vec<_>>());
    assert_eq!((here.0, here.2), (elsewhere.0, elsewhere.2));
    for wrong in [
        "where\nassert x = 1\nprint x\n",
        "frobnicate\n",
        "print 1 +\n",
        "source none.txt\n",
        "controller 2\n",
        "take now\n",
    ] {
        let [here, elsewhere] = here_and_elsewhere(folder, wrong);
        assert_eq!(here.0, 1);
        assert_eq!(here, elsewhere);
    }
}

#[test]
fn a_controller_elsewhere_goes_on_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let given = ["--machine", "mill", "--pty", "none", "--time", "100x", "--web", "--count", "2"];
    let (mut serve, ready) = Process::serve(folder, &given);
    let url = ready["http"].as_str().unwrap();
    let clock =
        |number: &str| run(folder, &["ctl", "--url", url, "--controller", number, "clock"]).1;
    let begin = |arguments: &[&str]| {
        let mut command = vimc4(folder, &["console", "--connect", url]);
        Process::start(command.args(arguments))
    };
    let mut console = begin(&["--controller", "2"]);
    console.give("controller\ncontroller 1\n");
    assert_eq!(console.line(), "> controller");
    assert_eq!(console.line(), "2");
    assert_eq!(console.line(), "> controller 1");
    assert!(console.line().contains("idle"));
    for number in ["1", "2"] {
        assert!(clock(number).contains("paused by the API"), "{}", clock(number));
    }
    console.give("quit\n");
    assert_eq!(console.ended().code(), Some(0));
    for number in ["1", "2"] {
        assert!(!clock(number).contains("paused"));
    }
    // Ctrl-C ends what runs, and an end from outside lets go, too.
    let mut console = begin(&["--controller", "1"]);
    console.give("where\n");
    assert_eq!(console.line(), "> where");
    assert!(console.line().contains("idle"));
    console.give("continue\n");
    process::limits::until("it runs", || !clock("1").contains("paused"));
    console.signal(rustix::process::Signal::INT);
    assert_eq!(console.line(), "> continue");
    assert!(clock("1").contains("paused"));
    console.signal(rustix::process::Signal::TERM);
    assert_eq!(console.ended().code(), Some(143));
    process::limits::until("it is let go", || !clock("1").contains("paused"));
    // Whoever is killed lets go, too.
    let mut console = begin(&["--controller", "1"]);
    console.give("where\n");
    assert_eq!(console.line(), "> where");
    assert!(console.line().contains("idle"));
    assert!(clock("1").contains("paused"));
    console.signal(rustix::process::Signal::KILL);
    process::limits::until("it is let go", || !clock("1").contains("paused"));
    // Nobody else has it meanwhile; requests share it, and may close it.
    let mut console = begin(&["--controller", "1"]);
    console.give("where\n");
    assert_eq!(console.line(), "> where");
    assert!(console.line().contains("idle"));
    let (code, _, said) = run(folder, &["console", "--connect", url, "--controller", "1"]);
    let who = format!("process {} (vimc4 console) has the debugger", console.child.id());
    assert!(code == 1 && said.contains(&who), "{code} {said}");
    let path = "/v1/controllers/1/debugger";
    assert!(request(url, "POST", path, r#"{"line":"where"}"#).contains("idle"));
    assert!(clock("1").contains("paused"));
    assert!(request(url, "DELETE", path, "").contains("200 OK"));
    assert!(!clock("1").contains("paused"));
    process::limits::until("it is heard", || {
        let _ = console.input.as_mut().unwrap().write_all(b"where\n");
        console.child.try_wait().unwrap().is_some()
    });
    let (code, said) = console.end();
    assert!(code == Some(1) && said.contains("somebody else has closed"), "{code:?} {said}");
    // A console beside requests leaves them the debugger.
    assert!(request(url, "POST", path, r#"{"line":"where"}"#).contains("idle"));
    let mut console = begin(&["--controller", "1"]);
    console.give("where\nquit\n");
    assert_eq!(console.ended().code(), Some(0));
    assert!(clock("1").contains("paused"));
    assert!(request(url, "DELETE", path, "").contains("200 OK"));
    // The line says no number in a request, whose address has it.
    let said = request(url, "POST", path, r#"{"line":"controller 2"}"#);
    assert!(said.contains("the address says which controller it is"), "{said}");
    assert!(request(url, "DELETE", path, "").contains("200 OK"));
    // Nothing is begun where there is nothing.
    let serial = ready["controllers"][0]["tcp"].as_str().unwrap_or_default();
    for (arguments, right) in [
        (&["--connect", url][..], "give --controller, 1 to 2"),
        (&["--connect", url, "--controller", "3"], "there is no controller `3`"),
        (&["--connect", "http://127.0.0.1:1"], "is `vimc4 serve --http` running there?"),
        (&["--connect", url, "--machine", "mill"], "cannot be used with"),
        (&["--connect", url, "--fresh-clients"], "cannot be used with"),
        (&["--controller", "1"], "--connect"),
        (&["--token", "none.txt"], "--connect"),
        (&["imc4", "--token", "none.txt"], "cannot be used with"),
        (&["imc4", "--controller", "1"], "cannot be used with"),
        (&["--connect", serial], "no API of vimc4 answers at"),
    ] {
        let (code, _, said) = run(folder, &[&["console"], arguments].concat());
        assert!(code == 2 && said.contains(right), "{arguments:?}: {code} {said}");
    }
    // A server that ends is no client that has closed the debugger.
    let mut console = begin(&["--controller", "1"]);
    console.give("where\n");
    assert_eq!(console.line(), "> where");
    assert!(console.line().contains("idle"));
    serve.signal(rustix::process::Signal::KILL);
    serve.ended();
    process::limits::until("it is noticed", || {
        let _ = console.input.as_mut().unwrap().write_all(b"where\n");
        console.child.try_wait().unwrap().is_some()
    });
    let (code, said) = console.end();
    assert!(code == Some(1) && said.contains("running there?"), "{code:?} {said}");
}

#[test]
fn a_script_that_waits_for_a_host_says_so_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("script.txt");
    let lines = "continue\nsend @01\nsend @0A1000,900\ncontinue\nassert x = 1000\n";
    fs::write(&script, format!("continue 1ms\nbreak command @0P\n{lines}")).unwrap();
    let arguments = ["console", "imc4", "--pty", "none", "--tcp", "127.0.0.1:0", "--script"];
    let mut command = vimc4(folder.path(), &[&arguments[..], &[script.to_str().unwrap()]].concat());
    let mut child = command.start().unwrap();
    let out = Timed::new("standard output", child.stdout.take().unwrap());
    let mut out = std::io::BufReader::new(out);
    let err = Timed::new("standard error", child.stderr.take().unwrap());
    let mut err = std::io::BufReader::new(err);
    let line = |from: &mut dyn BufRead| {
        let mut line = String::new();
        from.read_line(&mut line).unwrap();
        line
    };
    let address = line(&mut out);
    let address = address.trim().strip_prefix("tcp ").unwrap();
    let waits = line(&mut err);
    assert!(
        waits.starts_with("nothing is under way: the controller waits for what a host"),
        "{waits}"
    );
    let mut host = connect(address);
    host.write_all(b"@0P\r").unwrap();
    // Something is under way, and then nothing.
    let rests = line(&mut err);
    assert!(rests.starts_with("it rests at ") && rests.contains("what a host sends;"), "{rests}");
    host.write_all(b"@0P\r").unwrap();
    let mut rest = String::new();
    out.read_to_string(&mut rest).unwrap();
    err.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait_in_time().unwrap().code(), Some(0), "{rest}");
}
