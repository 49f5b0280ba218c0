//! A hostile world around the command: names that are taken, disks that are full, pipes that
//! close, files without an end, text that gives orders to terminals.

#![expect(clippy::too_many_lines, reason = "one test is one story")]
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::Signal;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, LIMIT, Timed, until};
use process::{
    Chatter, Process, VIMC4, ask, connect, pseudo_terminal, rest_of, tcp, terminal, vimc4,
};

/// Runs it to its end, or until it counts as hanging: code, standard output, standard error.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    Process::start(&mut vimc4(folder, arguments)).finish()
}

/// The same in a shell, with no more memory than so many KiB.
fn run_within(kib: u32, folder: &Path, line: &str) -> (Option<i32>, String, String) {
    let line = format!("ulimit -v {kib}; {line}");
    in_shell(folder, &line).finish()
}

/// What a line starts in a shell.
fn in_shell(folder: &Path, line: &str) -> Process {
    let mut shell = Command::new("sh");
    Process::start(shell.args(["-c", line]).current_dir(folder).stderr(Stdio::piped()))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

// --- starting and ending ---

#[test]
fn a_late_start_that_fails_says_so_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("vimc4-400.pty"), "precious").unwrap();
    let many = ["serve", "--count", "400", "--tcp"];
    for (tcp, word) in [("none", "vimc4-400.pty exists"), ("127.0.0.1:65200", "not enough ports")] {
        let (code, out, errors) = run(folder.path(), &[&many[..], &[tcp]].concat());
        assert_eq!((code, out.as_str()), (Some(2), ""), "{errors}");
        assert!(errors.contains(word), "{errors}");
        assert_eq!(names(folder.path()), ["vimc4-400.pty"]);
    }
}

#[test]
fn a_start_that_takes_long_can_be_given_up() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["serve", "--count", "1000", "--tcp", "none"];
    let mut serve = Process::start(&mut vimc4(folder.path(), &arguments));
    until("nothing begins", || names(folder.path()).len() >= 10);
    serve.signal(Signal::INT);
    let (code, out, errors) = serve.finish();
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    assert!(!out.contains("ready"), "it was started to its end");
    assert_eq!(names(folder.path()).len(), 0);
}

#[test]
fn an_ignored_hang_up_stays_ignored() {
    for (trap, survives) in [("trap '' HUP;", true), ("", false)] {
        let folder = tempfile::tempdir().unwrap();
        let line = format!("{trap} exec {VIMC4} serve --tcp none");
        let mut serve = in_shell(folder.path(), &line);
        while serve.line() != "ready" {}
        serve.signal(Signal::HUP);
        if survives {
            thread::sleep(Duration::from_millis(100));
            assert_eq!(serve.child.try_wait().unwrap(), None);
            serve.signal(Signal::TERM);
        }
        assert_eq!(serve.end(), (Some(0), String::new()));
        assert_eq!(names(folder.path()).len(), 0);
    }
}

#[test]
fn it_ends_with_its_input_if_it_is_told_to() {
    let folder = tempfile::tempdir().unwrap();
    let (mut serve, places) = Process::serve(folder.path(), &["--until-stdin-closes"]);
    assert_eq!(ask(&mut connect(tcp(&places, 0)), "@07\r", 1), "0");
    assert_eq!(names(folder.path()).len(), 1);
    drop(serve.input.take());
    assert_eq!(serve.end(), (Some(0), String::new()));
    assert_eq!(names(folder.path()).len(), 0);
}

#[test]
fn a_link_in_use_is_taken_only_with_force() {
    let folder = tempfile::tempdir().unwrap();
    let (first, places) = Process::serve(folder.path(), &[]);
    let link = folder.path().join("vimc4.pty");
    let to = fs::read_link(&link).unwrap();
    let (code, _, errors) = run(folder.path(), &["serve", "--tcp", "none"]);
    assert_eq!(code, Some(2));
    let holder = format!("vimc4 (process {})", first.child.id());
    assert!(errors.contains(&holder) && errors.contains("--replace"), "{errors}");
    // The first one has noticed nothing.
    assert_eq!(fs::read_link(&link).unwrap(), to);
    let mut port = terminal(&link);
    assert_eq!(ask(&mut port, "@07\r", 1), "0");
    let (second, _) = Process::serve(folder.path(), &["--replace"]);
    assert_ne!(fs::read_link(&link).unwrap(), to);
    assert_eq!(ask(&mut connect(tcp(&places, 0)), "@07\r", 1), "0");
    // Who has lost the name does not take it along.
    drop(first);
    let mut port = terminal(&link);
    assert_eq!(ask(&mut port, "@07\r", 1), "0");
    // A killed one has no name any more, and a number that a terminal window has got since is
    // not an emulator's.
    drop(second);
    let (_near, window) = pseudo_terminal();
    fs::remove_file(&link).unwrap();
    symlink(window, &link).unwrap();
    let (mut third, _) = Process::serve(folder.path(), &[]);
    // Nor is one that another emulator has got.
    third.signal(Signal::KILL);
    third.ended();
    let number = fs::read_link(&link).unwrap();
    let others: Vec<_> = (0..20).map(|_| tempfile::tempdir().unwrap()).collect();
    let others: Vec<_> = others.iter().map(|folder| Process::serve(folder.path(), &[])).collect();
    let (_fourth, _) = Process::serve(folder.path(), &[]);
    assert!(others.len() == 20 && number.starts_with("/dev/pts"));
}

#[test]
fn an_address_for_everybody_is_said_to_be_one() {
    let folder = tempfile::tempdir().unwrap();
    for (address, said) in [("0.0.0.0:0", true), ("127.0.0.1:0", false)] {
        let (mut serve, _) = Process::serve(folder.path(), &["--tcp", address]);
        serve.signal(Signal::TERM);
        let (_, errors) = serve.end();
        assert_eq!(errors.contains("open to everybody"), said, "{errors}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_low_limit_of_memory_is_told_in_figures_that_are_right() {
    let folder = tempfile::tempdir().unwrap();
    let line = format!(
        "exec {VIMC4} serve --tcp 127.0.0.1:0 --pty none --web --http 127.0.0.1:0 --csv /dev/null \
         --until-stdin-closes"
    );
    let mut needed = None;
    for kib in (4_000..1_000_000).step_by(1_000) {
        let (code, _, errors) = run_within(kib, folder.path(), &line);
        match code {
            // The system cannot even load the program.
            Some(127 | 139) | None => {}
            Some(0) => break,
            code => {
                assert_eq!(code, Some(2), "{kib}: {errors}");
                assert_eq!(errors.trim().lines().count(), 2, "{errors}");
                let (_, figure) = errors.split_once("raise it (ulimit -v ").unwrap();
                needed = figure.split(')').next().unwrap().parse::<u32>().ok();
            }
        }
    }
    assert_eq!(run_within(needed.unwrap() + 4_096, folder.path(), &line).0, Some(0));
}

#[test]
fn a_low_limit_of_open_files_is_told_in_figures_that_are_right() {
    let folder = tempfile::tempdir().unwrap();
    let serve = |files: u32, count: &str| {
        let line =
            format!("ulimit -n {files}; exec {VIMC4} serve --tcp 127.0.0.1:0 --count {count}");
        in_shell(folder.path(), &line)
    };
    let number = |text: &str, before: &str| -> u32 {
        let rest = text.split_once(before).unwrap_or_else(|| panic!("{text}")).1;
        rest.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()
    };
    let (code, _, errors) = serve(20, "1").finish();
    assert_eq!(code, Some(2), "{errors}");
    assert!(errors.contains("1 controller needs") && !errors.contains("--count"), "{errors}");
    // What it asks for is enough, with a client.
    let needed = number(&errors, "controller needs ");
    let mut enough = serve(needed, "1");
    let tcp = {
        enough.line();
        enough.line()
    };
    assert_eq!(enough.line(), "ready");
    let mut client = connect(tcp.strip_prefix("tcp ").unwrap());
    assert_eq!(ask(&mut client, "@07\r", 1), "0");
    drop(enough);
    // And what it offers fits.
    let (_, _, errors) = serve(100, "50").finish();
    let fit = number(&errors, "no more than ").to_string();
    let mut fitting = serve(100, &fit);
    while fitting.line() != "ready" {}
}

// --- where things are written to ---

#[test]
fn a_full_disk_is_one_error_and_a_closed_pipe_a_quiet_end() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.ncp"), "IMF_PBL_V1.0\nFASTABS X1000;\nPROGEND\n").unwrap();
    fs::write(folder.path().join("list"), "@01\n@0A100,900\n").unwrap();
    for command in [
        "completions bash",
        "models",
        "machines",
        "models show imc4",
        "--help",
        "--version",
        "help serve",
        "conform --list",
        "conform --list --json",
        "circle --radius 200 --from 135 --to 225 --ccw --speed 1500",
        "ncp check job.ncp",
        "ncp check job.ncp --format json",
        "ncp run job.ncp --no-ref",
        "run list",
        "run list --json",
    ] {
        let arguments: Vec<_> = command.split(' ').collect();
        let full = || OpenOptions::new().write(true).open("/dev/full").unwrap();
        let Output { status, stderr, .. } = vimc4(folder.path(), &arguments)
            .stdout(full())
            .start()
            .unwrap()
            .output_in_time()
            .unwrap();
        let errors = String::from_utf8(stderr).unwrap();
        assert_eq!(status.code(), Some(2), "{command}: {errors}");
        assert_eq!(
            errors.matches("cannot write to standard output").count(),
            1,
            "{command}: {errors}"
        );
        assert!(errors.contains("No space left"), "{command}: {errors}");
        // A pipe whose reader is gone before anything is said.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let Output { status, stderr, .. } = vimc4(folder.path(), &arguments)
            .stdout(writer)
            .start()
            .unwrap()
            .output_in_time()
            .unwrap();
        let errors = String::from_utf8(stderr).unwrap();
        assert!(matches!(status.code(), Some(0 | 1)), "{command}: {status} {errors}");
        assert!(!errors.contains("panicked") && !errors.contains("cannot write"), "{errors}");
        // And nobody who could be told.
        let status =
            vimc4(folder.path(), &arguments).stdout(full()).stderr(full()).status_in_time();
        assert_eq!(status.unwrap().code(), Some(2), "{command}");
    }
    // A table of steps is no less than standard output. The file has a name, whatever is typed for it.
    let mut run = vimc4(folder.path(), &["run", "-", "--trace", "/dev/full"]);
    let list = fs::File::open(folder.path().join("list")).unwrap();
    let Output { status, stderr, .. } = run.stdin(list).start().unwrap().output_in_time().unwrap();
    let errors = String::from_utf8(stderr).unwrap();
    assert_eq!(status.code(), Some(2), "{errors}");
    assert!(errors.contains("cannot write /dev/full: No space left"), "{errors}");
    let mut run = vimc4(folder.path(), &["run", "-"]);
    let Output { stderr, .. } = run.stdin(Stdio::null()).output_in_time().unwrap();
    let errors = String::from_utf8(stderr).unwrap();
    assert!(errors.contains("standard input holds no command"), "{errors}");
}

#[test]
fn controllers_run_on_when_nothing_can_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let full = || OpenOptions::new().write(true).open("/dev/full").unwrap();
    let arguments = ["serve", "--tcp", "none", "--pty", "port", "-v", "--log", "/dev/full"];
    let mut command = vimc4(folder.path(), &arguments);
    let child = command.stdin(Stdio::piped()).stdout(full()).stderr(Stdio::piped()).start();
    let mut serve = Process::of(child.unwrap());
    let link = folder.path().join("port");
    until("it does not start", || link.is_symlink());
    let mut port = terminal(&link);
    for _ in 0..50 {
        assert_eq!(ask(&mut port, "@07\r", 1), "0");
    }
    // What is told is written by a thread of its own, for which an end does not wait long.
    let lines = serve.errors();
    let complaints = ["cannot write to standard output", "cannot write the log /dev/full"];
    let mut said = String::new();
    while !complaints.iter().all(|words| said.contains(words)) {
        said += &lines.recv_timeout(LIMIT).unwrap();
    }
    serve.signal(Signal::TERM);
    assert_eq!(serve.ended().code(), Some(0));
    said += &rest_of(&lines);
    for words in complaints {
        assert_eq!(said.matches(words).count(), 1, "{said}");
    }
    assert_eq!(names(folder.path()).len(), 0);
}

// --- what is read ---

#[test]
fn nothing_from_a_file_gives_orders_to_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let evil = "\x1B]0;owned\x07\x1B[2J\u{9B}31m";
    let name = format!("job{evil}.ncp");
    let text = format!("IMF_PBL_V1.0\n; {evil}\nFASTABS X{evil}1000;\n{evil}\nPROGEND\n");
    fs::write(folder.path().join(&name), text).unwrap();
    let list = format!("list{evil}");
    fs::write(folder.path().join(&list), format!("@01\n@0A{evil},900\n")).unwrap();
    fs::write(folder.path().join("evil.toml"), format!("name = \"{evil}\n")).unwrap();
    let missing = format!("none{evil}");
    for arguments in [
        vec!["ncp", "check", &name],
        vec!["ncp", "check", &name, "--format", "short"],
        vec!["ncp", "check", &name, "--lenient"],
        vec!["ncp", "run", &name],
        vec!["ncp", "run", &name, "--lenient", "--no-ref"],
        vec!["ncp", "compile", &name, "--lenient"],
        vec!["ncp", "check", &missing],
        vec!["run", &list],
        vec!["run", &list, "-v"],
        vec!["run", &missing],
        vec!["models", "show", &missing],
        vec!["serve", "--tcp", &missing],
        vec!["serve", "--model", "evil.toml"],
        vec!["serve", "--model", &missing],
        vec!["serve", "--log", "none/\x1B[2J"],
        vec!["conform", &missing],
        vec!["conform", "--list", &missing],
    ] {
        let (code, out, errors) = run(folder.path(), &arguments);
        assert!(matches!(code, Some(0..=2)), "{arguments:?}");
        for said in [&out, &errors] {
            let order = said.chars().find(|c| c.is_control() && *c != '\n');
            assert_eq!(order, None, "{arguments:?}: {said:?}");
        }
        assert!(!out.is_empty() || !errors.is_empty(), "{arguments:?}");
    }
}

#[test]
fn files_without_an_end_are_refused_in_bounded_memory() {
    let folder = tempfile::tempdir().unwrap();
    let sparse = folder.path().join("sparse");
    File::create(&sparse).unwrap().set_len(8 << 30).unwrap();
    symlink("/dev/zero", folder.path().join("zero")).unwrap();
    for arguments in [["run", "zero"], ["run", "sparse"], ["run", "/dev/zero"]]
        .iter()
        .map(|all| all.to_vec())
        .chain(["check", "run", "compile"].map(|what| vec!["ncp", what, "zero"]))
        .chain([vec!["ncp", "check", "sparse"], vec!["conform", "--list", "--sessions", "zero"]])
        .chain([vec!["serve", "--model", "zero"], vec!["serve", "--machine", "sparse"]])
    {
        // Less memory than it would take to read on.
        let line = format!("exec {VIMC4} {}", arguments.join(" "));
        let (code, _, errors) = run_within(1_500_000, folder.path(), &line);
        assert_eq!(code, Some(2), "{arguments:?}: {errors}");
        assert!(!errors.contains("alloc"), "{arguments:?}: {errors}");
    }
    // A pipe has no size that could be looked at.
    let line = format!("cat /dev/zero | {VIMC4} run -");
    let (code, _, errors) = run_within(1_500_000, folder.path(), &line);
    assert_eq!(code, Some(2), "{errors}");
    assert!(errors.contains("is larger than"), "{errors}");
}

#[test]
fn a_line_of_ten_megabytes_is_quoted_in_a_few_words() {
    let folder = tempfile::tempdir().unwrap();
    let long = "9".repeat(10_000_000);
    fs::write(folder.path().join("list"), format!("@01\n@0A{long},900\n")).unwrap();
    fs::write(folder.path().join("job.ncp"), format!("IMF_PBL_V1.0\nFASTABS X{long};\nPROGEND\n"))
        .unwrap();
    for arguments in [
        vec!["run", "list"],
        vec!["run", "list", "-v"],
        vec!["ncp", "check", "job.ncp"],
        vec!["ncp", "check", "job.ncp", "--format", "short"],
        vec!["ncp", "run", "job.ncp"],
    ] {
        let (code, out, errors) = run(folder.path(), &arguments);
        assert_eq!(code, Some(1), "{arguments:?}");
        for said in [out, errors] {
            let longest = said.lines().map(|line| line.chars().count()).max().unwrap_or_default();
            assert!(longest < 1_000, "{arguments:?}: a line of {longest} characters");
        }
    }
}

#[test]
fn a_flash_file_with_other_line_ends_is_read_and_a_torn_one_is_said_to_be() {
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    let arguments = ["--model", "imc-s8", "--flash", "flash", "--pty", "none"];
    {
        let (_serve, places) = Process::serve(folder.path(), &arguments);
        let mut client = connect(tcp(&places, 0));
        assert_eq!(ask(&mut client, "@01\r@0i\r0100,900\r0200,900\r9\r", 5), "00000");
    }
    let whole = fs::read_to_string(&flash).unwrap();
    let crlf = whole.replace('\n', "\r\n");
    for (held, words) in [
        (crlf, "line ends"),
        (format!("{whole}half a rec"), "10 bytes at its end"),
        (whole.clone(), ""),
    ] {
        fs::write(&flash, held).unwrap();
        let (mut serve, places) = Process::serve(folder.path(), &arguments);
        assert_eq!(ask(&mut connect(tcp(&places, 0)), "@07\r", 1), "0");
        serve.signal(Signal::TERM);
        let (_, errors) = serve.end();
        assert!(errors.contains(words), "{errors}");
        assert_eq!(errors.is_empty(), words.is_empty(), "{errors}");
        assert_eq!(fs::read_to_string(&flash).unwrap(), whole);
    }
}

// --- what comes over the line ---

#[test]
fn an_endless_stream_is_no_controller() {
    let folder = tempfile::tempdir().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            thread::spawn(move || while stream.write_all(&[b'0'; 65_536]).is_ok() {});
        }
    });
    let line = format!("exec {VIMC4} conform {address}");
    let (code, _, errors) = run_within(800_000, folder.path(), &line);
    assert_eq!(code, Some(2), "{errors}");
    assert!(errors.contains("never falls silent"), "{errors}");
}

#[test]
fn a_serial_port_that_was_unplugged_is_opened_again() {
    let folder = tempfile::tempdir().unwrap();
    let cable = folder.path().join("cable");
    let plug = || {
        let (near, far) = pseudo_terminal();
        let fresh = folder.path().join("fresh");
        symlink(far, &fresh).unwrap();
        fs::rename(&fresh, &cable).unwrap();
        File::from(near)
    };
    let mut host = plug();
    let arguments = ["--serial", "cable", "--pty", "none"];
    let (mut serve, _) = Process::serve(folder.path(), &arguments);
    assert_eq!(ask(&mut host, "@07\r", 1), "0");
    drop(host);
    fs::remove_file(&cable).unwrap();
    let lines = serve.errors();
    assert!(lines.recv_timeout(LIMIT).unwrap().contains("is gone"));
    let mut host = plug();
    assert!(lines.recv_timeout(LIMIT).unwrap().contains("is back"));
    assert_eq!(ask(&mut host, "@0P\r", 19), "0000000000000000000");
    serve.signal(Signal::TERM);
    assert_eq!(serve.ended().code(), Some(0));
}

/// What a verbose controller says on standard error, waited for.
struct Said {
    lines: Receiver<String>,
    all: String,
}

impl Said {
    fn of(serve: &mut Process) -> Said {
        Said { lines: serve.errors(), all: String::new() }
    }

    /// Waits for these words, whether they come or have come.
    fn until(&mut self, words: &str) {
        while !self.all.contains(words) {
            self.next(words);
        }
    }

    /// Waits for the next line, which may have these words.
    fn next(&mut self, words: &str) {
        let next = self.lines.recv_timeout(LIMIT);
        self.all += &next.unwrap_or_else(|_| panic!("{words}: {}", self.all));
    }
}

/// Two clients one after the other, with and without `--fresh-clients`: the first leaves half a line,
/// the second is told, or it is forgotten.
fn half_lines(
    half: &str,
    clients: impl Fn(Timed<File>, &dyn Fn() -> TcpStream, &mut Said) -> String,
) {
    let folder = tempfile::tempdir().unwrap();
    for fresh in [false, true] {
        let arguments = if fresh { &["-v", "--fresh-clients"][..] } else { &["-v"] };
        let (mut serve, places) = Process::serve(folder.path(), arguments);
        let mut said = Said::of(&mut serve);
        let port = terminal(folder.path().join("vimc4.pty"));
        let answer = clients(port, &|| connect(tcp(&places, 0)), &mut said);
        assert_eq!(answer == "0", fresh, "{answer}");
        for words in ["an earlier client left half a line,", "continues the half line"] {
            let told = said.all.matches(&format!("{words} `{half}`")).count();
            assert_eq!(told, usize::from(!fresh), "{}", said.all);
        }
        serve.signal(Signal::TERM);
        assert_eq!(serve.ended().code(), Some(0));
    }
}

#[test]
fn a_half_line_is_told_of_or_forgotten() {
    half_lines("@0A1", |mut port, connect, said| {
        assert_eq!(ask(&mut port, "@07\r", 1), "0");
        port.write_all(b"@0A1").unwrap();
        drop(port);
        said.until("pty: a client closed the line");
        let mut client = connect();
        let answer = ask(&mut client, "@07\r", 1);
        assert_eq!(ask(&mut client, "@07\r", 1), "0");
        // Everything before it has been told then.
        let name = client.local_addr().unwrap();
        drop(client);
        said.until(&format!("{name} closed the line"));
        answer
    });
}

/// The last of several quick clients sends a line in two parts, and is blamed for nothing.
#[cfg(target_os = "linux")]
#[test]
fn a_line_of_a_quick_client_is_its_own() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["-v", "--fresh-clients"][..], &["-v"]] {
        let (mut serve, _) = Process::serve(folder.path(), arguments);
        let mut said = Said::of(&mut serve);
        // Plain files: each is closed before the next one is opened.
        let open = || {
            let terminal = folder.path().join("vimc4.pty");
            OpenOptions::new().read(true).write(true).open(terminal).unwrap()
        };
        for number in 1..=20 {
            for _ in 0..3 {
                assert_eq!(ask(&mut open(), "@07\r", 1), "0");
            }
            let mut client = open();
            client.write_all(b"@0").unwrap();
            // Four clients have come and three gone.
            let opened = |said: &Said| said.all.matches("pty: a client opened").count();
            while opened(&said) < 4 * number {
                said.next("a client opened");
            }
            assert_eq!(ask(&mut client, "7\r", 1), "0", "{arguments:?}: {}", said.all);
        }
        assert!(!said.all.contains("half a line"), "{}", said.all);
        serve.signal(Signal::TERM);
        assert_eq!(serve.ended().code(), Some(0));
    }
}

#[test]
fn a_half_line_is_told_of_to_who_stays() {
    half_lines("@0A5", |mut port, connect, said| {
        assert_eq!(ask(&mut port, "@01\r", 1), "0");
        let mut client = connect();
        client.write_all(b"@0A5").unwrap();
        let name = client.local_addr().unwrap();
        drop(client);
        said.until(&format!("{name} closed the line"));
        let answer = ask(&mut port, "@0A1,900\r", 1);
        said.until("pty: a client speaks");
        drop(port);
        said.until("pty: a client closed the line");
        answer
    });
}

#[test]
fn the_log_says_who_takes_the_line_and_who_only_observes() {
    let folder = tempfile::tempdir().unwrap();
    for (policy, words) in [
        ("takeover", "NEW takes the line over from OLD"),
        ("observe", "NEW only observes, what it sends is ignored"),
    ] {
        let arguments = ["-v", "--tcp-clients", policy];
        let (mut serve, places) = Process::serve(folder.path(), &arguments);
        let mut said = Said::of(&mut serve);
        let mut client = connect(tcp(&places, 0));
        assert_eq!(ask(&mut client, "@07\r", 1), "0");
        let mut other = connect(tcp(&places, 0));
        other.write_all(b"@0P\r@0P\r").unwrap();
        let name = |client: &TcpStream| client.local_addr().unwrap().to_string();
        let words = words.replace("NEW", &name(&other)).replace("OLD", &name(&client));
        said.until(&words);
        serve.signal(Signal::TERM);
        assert_eq!(serve.ended().code(), Some(0));
    }
}

/// A shell, a terminal or a program that ends its lines with LF alone waits for ever, on a real
/// controller too. Each such client is told so once; who sends CR LF is not, and leaves no half line.
#[test]
fn who_sends_no_cr_is_told_how_to() {
    for (model, machine, line, words) in [
        ("imc4", "bench", "@07", "LF alone ends no command; CR does: printf '@07\\r'"),
        ("smcu", "board-plotter", "!ON0", "LF alone ends no command; CR and ; do: printf 'PU;'"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["--model", model, "--machine", machine, "--time", "instant"];
        let (mut serve, places) = Process::serve(folder.path(), &arguments);
        // The answer to what comes last shows that everything before it has been looked at.
        for (ends, told) in [("\r\n", 0), ("\n", 1)] {
            for _ in 0..2 {
                let mut client = connect(tcp(&places, 0));
                let text = format!("{line}{ends}").repeat(3);
                client.write_all(text.as_bytes()).unwrap();
                client.write_all(format!("\r{line}\r").as_bytes()).unwrap();
                let mut answer = [0];
                client.read_exact(&mut answer).unwrap();
                drop(client);
                // Of a kind no more than one is told in a second.
                thread::sleep(Duration::from_millis(1_100 * told));
            }
        }
        serve.signal(Signal::TERM);
        let (_, errors) = serve.end();
        assert_eq!(errors.matches(words).count(), 2, "{model}: {errors}");
        assert!(!errors.contains("half"), "{model}: {errors}");
    }
    // Where the profile says that LF ends a command nobody waits.
    let folder = tempfile::tempdir().unwrap();
    let (code, profile, _) = run(folder.path(), &["models", "show", "smcu"]);
    assert_eq!(code, Some(0));
    let profile = profile.replace("line_feed = \"separate\"", "line_feed = \"end\"");
    fs::write(folder.path().join("older.toml"), profile).unwrap();
    let arguments = ["--model", "older.toml", "--machine", "board-plotter", "--time", "instant"];
    let (mut serve, places) = Process::serve(folder.path(), &arguments);
    let mut client = connect(tcp(&places, 0));
    client.write_all(b"!ON0\n").unwrap();
    client.read_exact(&mut [0; 8]).unwrap();
    serve.signal(Signal::TERM);
    let (_, errors) = serve.end();
    assert!(!errors.contains("LF alone"), "{errors}");
}

// --- finding out ---

#[test]
fn the_doctor_says_what_a_program_will_find_and_moves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let doctor = |port: &str, code: i32, words: &[&str]| {
        let (ended, out, errors) = run(folder.path(), &["doctor", port]);
        assert_eq!(ended, Some(code), "{port}: {out}{errors}");
        for word in words {
            assert!(out.contains(word) || errors.contains(word), "{word}: {out}{errors}");
        }
    };
    let (mut serve, places) = Process::serve(folder.path(), &["-v"]);
    let link = folder.path().join("vimc4.pty");
    let holder = format!("vimc4 (process {}) answers", serve.child.id());
    let target = fs::read_link(&link).unwrap().display().to_string();
    let found = [
        format!("leads to {target}"),
        holder,
        "no other program has it open".to_owned(),
        "19200 baud, 8N1".to_owned(),
        "`vimc4 lines".to_owned(),
        "X 0, Y 0, Z 0".to_owned(),
        "IMC4 (virtual)".to_owned(),
    ];
    doctor("./vimc4.pty", 0, &found.each_ref().map(String::as_str));
    // A client that has it open, and the half line it has left.
    let mut port = terminal(&link);
    port.write_all(b"@0A1000,900").unwrap();
    let me = format!("(process {}) has it open", std::process::id());
    doctor("./vimc4.pty", 1, &[&me, "-> two programs take the answers", "not asked"]);
    drop(port);
    let tcp = tcp(&places, 0);
    doctor(tcp, 0, &["something listens", "X 0, Y 0, Z 0", "half a line"]);
    let client = connect(tcp);
    doctor(tcp, 1, &["has gone", "-> one client holds the line"]);
    drop(client);
    serve.signal(Signal::TERM);
    let (_, errors) = serve.end();
    for order in ["@0A", "@0M", "@0R", "move"] {
        let lines = errors.lines().filter(|line| line.contains(order));
        // The half line, which was an error.
        assert!(lines.clone().all(|line| line.contains("@0A1000,900")), "{errors}");
    }
    doctor("./vimc4.pty", 2, &["cannot open ./vimc4.pty"]);
    doctor(tcp, 2, &["nothing listens there"]);
    symlink("/dev/pts/none", &link).unwrap();
    doctor("./vimc4.pty", 2, &["leads nowhere"]);
    // A terminal at which nobody is a controller.
    let raw = |far: &str| {
        let far = terminal(far);
        let mut settings = rustix::termios::tcgetattr(far.get_ref()).unwrap();
        settings.make_raw();
        rustix::termios::tcsetattr(far.get_ref(), rustix::termios::OptionalActions::Now, &settings)
            .unwrap();
    };
    let (_near, far) = pseudo_terminal();
    raw(&far);
    doctor(&far, 1, &["no emulator holds the other end", "nothing answers"]);
    // Somebody's terminal window, to which an old link leads, is left alone.
    let (near, far) = pseudo_terminal();
    fs::remove_file(&link).unwrap();
    symlink(&far, &link).unwrap();
    doctor("./vimc4.pty", 1, &["no emulator holds", "not asked", "what leads here is stale"]);
    assert!(fs::File::from(near).read(&mut [0]).is_err());
    // One that says something and closes.
    let says: Serving = |mut stream| {
        stream.read_exact(&mut [0; 4])?;
        stream.write_all(b"HTTP/1.1 400 Bad Request")
    };
    doctor(&server(says), 1, &["after it said `HTTP/1.1 400 Bad Request`"]);
    // One that goes away when it is asked.
    let (near, far) = pseudo_terminal();
    raw(&far);
    let asks = vimc4(folder.path(), &["doctor", &far]).stdout(Stdio::piped()).start().unwrap();
    // Nothing can be read before it has opened the port.
    let mut question = fs::File::from(near);
    until("it asks", || question.read_exact(&mut [0]).is_ok());
    drop(question);
    let said = String::from_utf8(asks.output_in_time().unwrap().stdout).unwrap();
    assert!(said.contains("the emulator has ended") && !said.contains("one client"), "{said}");
    // The other family.
    let arguments = ["--model", "smcu", "--machine", "board-plotter", "--pty", "plotter"];
    let (_serve, places) = Process::serve(folder.path(), &arguments);
    doctor("./plotter", 0, &["X 0, Y 0", "S310"]);
    doctor(places["controllers"][0]["tcp"].as_str().unwrap(), 0, &["X 0, Y 0"]);
}

/// What a server does with a client.
type Serving = fn(TcpStream) -> std::io::Result<()>;

/// A server that does this with each client, and its address.
fn server(does: Serving) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || {
        for stream in listener.incoming() {
            thread::spawn(move || does(stream.unwrap()));
        }
    });
    address
}

/// Answers each line in this way.
fn answers(mut stream: TcpStream, answer: fn(&[u8]) -> Vec<u8>) -> std::io::Result<()> {
    let mut lines = BufReader::new(stream.try_clone()?);
    let mut line = Vec::new();
    while lines.read_until(b'\r', &mut line)? > 0 {
        stream.write_all(&answer(&std::mem::take(&mut line)))?;
    }
    Ok(())
}

#[test]
fn the_doctor_takes_nothing_for_a_controller_that_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let silent = "whichever program has the port open then";
    let endless = "what never falls silent has no answers";
    let noise = "makes no sense";
    let servers: [(&str, &str, Serving); 7] = [
        ("mute", silent, |mut stream| stream.read_to_end(&mut Vec::new()).map(drop)),
        ("gone", "the other end has gone", |_| Ok(())),
        ("a banner", "`SSH-2.0-x\\r\\n`", |mut stream| {
            stream.write_all(b"SSH-2.0-x\r\n")?;
            stream.read_to_end(&mut Vec::new()).map(drop)
        }),
        ("Telnet", "it speaks Telnet", |mut stream| {
            stream.write_all(b"\xFF\xFD\x2C\xFF\xFB\x2C")?;
            stream.read_to_end(&mut Vec::new()).map(drop)
        }),
        ("endless", endless, |mut stream| {
            loop {
                stream.write_all(&[b'0'; 4_096])?;
            }
        }),
        ("an echo", noise, |stream| answers(stream, |line| line.to_vec())),
        ("yes to everything", noise, |stream| answers(stream, |_| b"0".to_vec())),
    ];
    for (name, words, does) in servers {
        let (code, out, errors) = run(folder.path(), &["doctor", &server(does)]);
        assert_eq!(code, Some(1), "{name}: {out}{errors}");
        assert!(out.contains(words) && !out.contains("one of isel"), "{name}: {out}{errors}");
    }
    // What comes within an answer's time would look like one.
    Chatter::new(false).at(|address| {
        let (code, out, errors) = run(folder.path(), &["doctor", address]);
        let seen = code == Some(1) && out.contains(endless) && !out.contains("one of isel");
        seen.then_some(()).ok_or_else(|| format!("chatter: {out}{errors}"))
    });
    fs::write(folder.path().join("file"), "text").unwrap();
    for name in ["file", ".", "/dev/null"] {
        let (code, out, errors) = run(folder.path(), &["doctor", name]);
        assert_eq!(code, Some(2), "{name}: {out}{errors}");
        assert!(
            errors.contains("is not a serial port and no pseudo-terminal"),
            "{name}: {out}{errors}"
        );
        assert!(!(out + &errors).contains("typewriter"), "{name}");
    }
    let (code, _, errors) = run(folder.path(), &["doctor", "socket://127.0.0.1:4004"]);
    assert_eq!(code, Some(2));
    assert!(errors.contains("host:port alone"), "{errors}");
    for name in ["127.0.0.1:99999", ":", "localhost:", ":4004", "127.0.0.1:x"] {
        let (code, _, errors) = run(folder.path(), &["doctor", name]);
        assert_eq!(code, Some(2));
        let right = "write HOST:PORT, the port from 1 to 65535, as in 127.0.0.1:4004";
        assert!(errors.contains(right) && !errors.contains("No such file"), "{name}: {errors}");
    }
}

#[test]
fn the_doctor_disturbs_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let doctor = |tcp: &str, code: i32, words: &str| {
        let (ended, out, errors) = run(folder.path(), &["doctor", tcp]);
        assert_eq!(ended, Some(code), "{out}{errors}");
        assert!(out.contains(words), "{words}: {out}{errors}");
    };
    let arguments = ["--pty", "port", "--time", "manual"];
    let (mut serve, places) = Process::serve(folder.path(), &arguments);
    let tcp = tcp(&places, 0);
    let mut orders = serve.input.take().unwrap();
    let link = folder.path().join("port");
    let open = || terminal(&link);
    // In the midst of a move it is deaf, and what was asked changes nothing afterwards.
    let mut port = open();
    assert_eq!(ask(&mut port, "@01\r", 1), "0");
    port.write_all(b"@0A20000,1000\r").unwrap();
    doctor(tcp, 1, "when it has come to rest");
    orders.write_all(b"advance 60s\n").unwrap();
    // The answers to the doctor's questions go to whoever listens.
    let answers = "0000004E20000000000000".len();
    let mut heard = vec![0; answers];
    port.read_exact(&mut heard).unwrap();
    assert!(heard.starts_with(b"00004E20"), "{}", heard.escape_ascii());
}

#[test]
fn the_doctor_knows_cards_that_tell_of_configured_axes_only() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--model", "c142", "-v"];
    let (mut serve, places) = Process::serve(folder.path(), &arguments);
    let tcp = tcp(&places, 0);
    for (axes, words) in [
        (None, "answers; no axis is configured"),
        (Some("@02\r"), "the configured axes are at 0"),
        (Some("@03\r"), "the configured axes are at 0, 0"),
        (Some("@07\r"), "X 0, Y 0, Z 0"),
    ] {
        if let Some(axes) = axes {
            assert_eq!(ask(&mut connect(tcp), axes, 1), "0");
        }
        for port in [tcp, "./vimc4.pty"] {
            let (code, out, errors) = run(folder.path(), &["doctor", port]);
            assert_eq!(code, Some(0), "{out}{errors}");
            assert!(out.contains(words) && out.contains("isel C142"), "{words}: {out}{errors}");
        }
    }
    serve.signal(Signal::TERM);
    let (_, errors) = serve.end();
    assert!(!errors.contains("baud"), "it has changed the speed: {errors}");
}

// --- everything at once ---

/// Random numbers that a seed repeats.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % sides
    }

    fn bytes(&mut self, most: u64) -> Vec<u8> {
        const WORDS: &[u8] = b"@@00AMRIPVSifz7,,,---0123456789\r\r\r\x1B\n";
        (0..self.roll(most))
            .map(|_| match self.roll(8) {
                0 => u8::try_from(self.roll(256)).unwrap(),
                _ => WORDS[usize::try_from(self.roll(WORDS.len() as u64)).unwrap()],
            })
            .collect()
    }
}

/// The memory that a process takes, in KiB, and how many files it has open.
fn size(process: u32) -> (u64, usize) {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let memory = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    let memory = memory.trim().trim_end_matches(" kB").parse().unwrap();
    (memory, fs::read_dir(format!("/proc/{process}/fd")).unwrap().count())
}

/// One attack on a controller. Whatever it is, nothing of it may be left.
fn attack(dice: &mut Dice, folder: &Path, tcp: &str, serve: &Process) {
    let link = folder.join("vimc4.pty");
    match dice.roll(11) {
        // Noise over TCP, with all ways to leave.
        0 | 1 => {
            let Ok(mut client) = TcpStream::connect(tcp) else { return };
            let _ = client.set_nonblocking(true);
            for _ in 0..dice.roll(20) {
                let _ = client.write(&dice.bytes(400));
            }
            if dice.roll(2) == 0 {
                let _ = client.shutdown(std::net::Shutdown::Write);
                thread::sleep(Duration::from_millis(dice.roll(5)));
            }
        }
        // Noise over the terminal, with settings that a client may make.
        2 | 3 => {
            use std::os::unix::fs::OpenOptionsExt;

            use rustix::termios::{Action, OptionalActions, tcflow, tcgetattr, tcsetattr};
            let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
            let flags = i32::try_from(flags.bits()).unwrap();
            let open = OpenOptions::new().read(true).write(true).custom_flags(flags).open(&link);
            let Ok(mut port) = open else { return };
            if let (0, Ok(mut settings)) = (dice.roll(2), tcgetattr(&port)) {
                let bits = u32::try_from(dice.roll(1 << 16)).unwrap();
                settings.local_modes = rustix::termios::LocalModes::from_bits_retain(bits);
                settings.input_modes = rustix::termios::InputModes::from_bits_retain(bits >> 3);
                let _ = tcsetattr(&port, OptionalActions::Now, &settings);
            }
            for _ in 0..dice.roll(20) {
                let _ = port.write(&dice.bytes(400));
            }
            if dice.roll(3) == 0 {
                let _ = tcflow(&port, Action::OOff);
            }
        }
        // A crowd.
        4 => drop((0..dice.roll(30)).map(|_| TcpStream::connect(tcp)).collect::<Vec<_>>()),
        // Somebody who asks and never listens.
        5 => {
            let Ok(mut client) = TcpStream::connect(tcp) else { return };
            let _ = client.set_nonblocking(true);
            for _ in 0..dice.roll(50) {
                let _ = client.write(&b"@0P\r".repeat(500));
            }
        }
        // Another emulator that wants the same name.
        6 => {
            let (code, _, errors) = run(folder, &["serve", "--tcp", "none"]);
            assert_eq!(code, Some(2), "{errors}");
        }
        // Somebody who only asks, in whatever state the others have left it.
        7 => {
            let port = if dice.roll(2) == 0 { tcp } else { "./vimc4.pty" };
            let (code, out, errors) = run(folder, &["doctor", port]);
            assert!(matches!(code, Some(0..=2)), "{code:?} {out} {errors}");
            assert!(!errors.contains("panicked"), "{errors}");
        }
        // It loses its processor for a while.
        8 => {
            serve.signal(Signal::STOP);
            thread::sleep(Duration::from_millis(dice.roll(100)));
            serve.signal(Signal::CONT);
        }
        // A program with modem lines that ends, or whose supervisor is killed.
        9 => {
            let script = "exec 3<>vimc4.pty; sleep 0.2; exit 3";
            let mut lines =
                Process::start(&mut vimc4(folder, &["lines", "--", "sh", "-c", script]));
            if dice.roll(2) == 0 {
                thread::sleep(Duration::from_millis(dice.roll(150)));
                lines.signal(Signal::KILL);
                assert_eq!(lines.ended().code(), None);
            } else {
                let (code, errors) = lines.end();
                assert_eq!(code, Some(3), "{errors}");
            }
        }
        // A file of nonsense for the other commands.
        _ => {
            let mut job = b"IMF_PBL_V1.0\n".to_vec();
            job.extend(dice.bytes(4_000));
            fs::write(folder.join("job"), &job).unwrap();
            let commands: [&[&str]; 4] = [
                &["ncp", "check", "job"],
                &["ncp", "run", "job", "--lenient"],
                &["run", "job"],
                &["ncp", "compile", "job", "--lenient"],
            ];
            let command = commands[usize::try_from(dice.roll(4)).unwrap()];
            let (code, out, errors) = run(folder, command);
            assert!(matches!(code, Some(0..=3)), "{command:?}: {code:?} {errors}");
            let order = out.chars().chain(errors.chars()).find(|c| c.is_control() && *c != '\n');
            assert_eq!(order, None, "{command:?}: {out:?} {errors:?}");
        }
    }
}

/// A few seconds, or as many as `VIMC4_HOSTILE_SECONDS` says; `VIMC4_HOSTILE_SEED` repeats a run.
#[test]
fn random_attacks_leave_nothing() {
    let variable = |name| std::env::var(name).ok().and_then(|value| value.parse::<u64>().ok());
    let seconds = Duration::from_secs(variable("VIMC4_HOSTILE_SECONDS").unwrap_or(4));
    let seed = variable("VIMC4_HOSTILE_SEED").unwrap_or_else(|| u64::from(std::process::id()) | 1);
    // Shown when it fails.
    println!("VIMC4_HOSTILE_SEED={seed}");
    let mut dice = Dice(seed.max(1));
    let began = Instant::now();
    while began.elapsed() < seconds {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["--time", "instant", "--log", "/dev/null"];
        let (mut serve, places) = Process::serve(folder.path(), &arguments);
        let said = serve.errors();
        let tcp = places["controllers"][0]["tcp"].as_str().unwrap().to_owned();
        let mut before = None;
        let round = Instant::now();
        for attacks in 1.. {
            attack(&mut dice, folder.path(), &tcp, &serve);
            if attacks == 20 {
                before = Some(size(serve.child.id()));
            }
            if attacks > 30 && (began.elapsed() > seconds || round.elapsed().as_secs() > 60) {
                break;
            }
        }
        // It lives, and is reached both ways: a reset, and it answers as ever.
        let wait = Instant::now();
        loop {
            let mut client = connect(&tcp);
            client.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
            let mut answer = [0; 1];
            let _ = client.write_all(b"\xFE");
            thread::sleep(Duration::from_millis(50));
            let _ = client.write_all(b"\r@07\r");
            while client.read_exact(&mut answer).is_ok() && answer != *b"0" {}
            if answer == *b"0" {
                break;
            }
            assert!(wait.elapsed() < LIMIT, "it does not answer any more");
        }
        let before = before.unwrap();
        until("it keeps files open", || size(serve.child.id()).1 <= before.1.max(16));
        let grown = size(serve.child.id()).0.saturating_sub(before.0);
        assert!(grown < 20_000, "it has grown by {grown} KiB");
        let signals = [Signal::INT, Signal::TERM, Signal::HUP];
        serve.signal(signals[usize::try_from(dice.roll(signals.len() as u64)).unwrap()]);
        assert_eq!(serve.ended().code(), Some(0));
        let said = rest_of(&said);
        assert!(!said.contains("panicked"), "{said}");
        assert!(!folder.path().join("vimc4.pty").is_symlink());
    }
}
