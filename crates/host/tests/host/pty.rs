//! Pseudo-terminals, end to end.

use std::fs::{self, File, OpenOptions};
use std::future::poll_fn;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, poll};
use rustix::termios::{
    ControlModes, InputModes, LocalModes, OptionalActions, SpecialCodeIndex, ioctl_tiocexcl,
    tcgetattr, tcsetattr,
};
use vimc4_host::{Clock, LineEvent, Pty, Received, Report, ReportKind, Transport};

use crate::fake::{Diary, Fake, Running};

fn serve(clock: Clock) -> (Running<Fake>, PathBuf) {
    Running::with(Fake::new(b""), clock, || {
        let pty = Pty::open(19_200).unwrap();
        let path = pty.path().to_owned();
        (pty, path)
    })
}

fn open(path: &Path) -> File {
    let flags = i32::try_from(rustix::fs::OFlags::NOCTTY.bits()).unwrap();
    OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).unwrap()
}

/// What arrives within a while, up to `count` bytes.
fn read(mut port: &File, count: usize, millis: u64) -> Vec<u8> {
    let deadline = Instant::now() + Duration::from_millis(millis);
    let mut bytes = Vec::new();
    while bytes.len() < count {
        let left = deadline.saturating_duration_since(Instant::now());
        let left = rustix::time::Timespec::try_from(left).unwrap();
        if poll(&mut [PollFd::new(port, PollFlags::IN)], Some(&left)).unwrap() == 0 {
            break;
        }
        let mut some = vec![0; count - bytes.len()];
        let n = port.read(&mut some).unwrap();
        bytes.extend_from_slice(&some[..n]);
    }
    bytes
}

fn ask(mut port: &File, line: &str, count: usize) -> String {
    port.write_all(line.as_bytes()).unwrap();
    String::from_utf8(read(port, count, 5_000)).unwrap()
}

/// The processor time, in hundredths of a second, of the threads of this process whose names
/// begin so.
fn processor_time(name: &str) -> u64 {
    let mut ticks = 0;
    for task in fs::read_dir("/proc/self/task").unwrap().flatten() {
        // A thread of another test may end meanwhile.
        let Ok(stat) = fs::read_to_string(task.path().join("stat")) else { continue };
        let (head, fields) = stat.rsplit_once(") ").unwrap();
        if head.split_once(" (").unwrap().1.starts_with(name) {
            let fields: Vec<_> = fields.split(' ').collect();
            ticks += fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap();
        }
    }
    ticks
}

#[test]
fn clients_come_and_go() {
    let (running, path) = serve(Clock::Real);
    for n in 0..100 {
        let port = open(&path);
        assert_eq!(ask(&port, &format!("e{n:03}\r"), 3), format!("{n:03}"));
    }
    running.end().unwrap();
}

#[test]
fn who_comes_and_goes_unseen_is_told_of() {
    let diary = Diary::default();
    let (running, path) = serve(Clock::Real);
    running.handle.watch(diary.clone()).wait().unwrap();
    for n in 1..=200 {
        drop(open(&path));
        diary.wait_for_all("the visit", |reports| {
            let count = |fits: fn(&Report) -> bool| reports.iter().filter(|&r| fits(r)).count();
            count(|report| matches!(report.news(), Some(LineEvent::Opened { .. }))) == n
                && count(|report| matches!(report.news(), Some(LineEvent::Closed { .. }))) == n
        });
    }
    running.end().unwrap();
}

#[test]
fn it_is_a_raw_terminal_at_the_speed_of_the_line() {
    let (running, path) = serve(Clock::Real);
    let mut port = open(&path);
    assert_eq!(tcgetattr(&port).unwrap().output_speed(), 19_200);
    // What a cooked terminal would swallow, change or echo.
    port.write_all(b"e\x03\x04\x11\x13\n\xFF\x00\r").unwrap();
    assert_eq!(read(&port, 7, 5_000), b"\x03\x04\x11\x13\n\xFF\x00");
    running.end().unwrap();
}

#[test]
fn settings_end_with_their_client() {
    let diary = Diary::default();
    let (running, path) = serve(Clock::Real);
    running.handle.watch(diary.clone()).wait().unwrap();
    let first = open(&path);
    // A line that echoes, edits, waits for nothing and is too slow.
    let mut settings = tcgetattr(&first).unwrap();
    settings.local_modes |= LocalModes::ECHO | LocalModes::ICANON;
    settings.input_modes |= InputModes::ICRNL;
    settings.special_codes[SpecialCodeIndex::VMIN] = 0;
    settings.set_speed(9_600).unwrap();
    tcsetattr(&first, OptionalActions::Now, &settings).unwrap();
    (&first).write_all(b"e\r").unwrap();
    diary.wait_for("a warning", |report| {
        matches!(report.news(), Some(LineEvent::WrongSpeed { client: 9_600, line: 19_200, .. }))
    });
    drop(first);
    diary.wait_for("the end", |report| matches!(report.news(), Some(LineEvent::Closed { .. })));
    let second = open(&path);
    let settings = tcgetattr(&second).unwrap();
    assert_eq!(settings.output_speed(), 19_200);
    assert_eq!(settings.special_codes[SpecialCodeIndex::VMIN], 1);
    assert_eq!(ask(&second, "etwo\r", 3), "two");
    assert_eq!(read(&second, 1, 20), b"", "an echo");
    running.end().unwrap();
}

#[test]
fn a_parity_is_told_of_once_and_ends_with_its_client() {
    let (odd, sticky) = (ControlModes::PARODD, ControlModes::CMSPAR);
    for (modes, words) in [(odd, "odd"), (sticky, "space"), (sticky | odd, "mark")] {
        let diary = Diary::default();
        let (running, path) = serve(Clock::Real);
        running.handle.watch(diary.clone()).wait().unwrap();
        let client = open(&path);
        let mut settings = tcgetattr(&client).unwrap();
        // The system drops the parity, and not its kind.
        settings.control_modes |= modes | ControlModes::PARENB;
        tcsetattr(&client, OptionalActions::Now, &settings).unwrap();
        for _ in 0..3 {
            assert_eq!(ask(&client, "eone\r", 3), "one");
        }
        drop(client);
        diary.wait_for("the end", |report| matches!(report.news(), Some(LineEvent::Closed { .. })));
        let next = open(&path);
        assert!(!tcgetattr(&next).unwrap().control_modes.intersects(sticky | odd));
        assert_eq!(ask(&next, "etwo\r", 3), "two");
        let told = |report: &Report| match report.news() {
            Some(LineEvent::WrongParity { parity, .. }) => Some(parity.clone()),
            _ => None,
        };
        assert_eq!(diary.all(told), [words]);
        running.end().unwrap();
    }
}

#[test]
fn the_next_client_reads_nothing_stale() {
    let diary = Diary::default();
    let (running, path) = serve(Clock::Manual);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut first = open(&path);
    // It leaves without reading its first answer, and before its second.
    first.write_all(b"estale\rw10\r").unwrap();
    running.handle.now().wait().unwrap();
    drop(first);
    running.handle.advance(Duration::from_millis(10)).wait().unwrap();
    assert_eq!(diary.unheard(), 1);
    let second = open(&path);
    assert_eq!(read(&second, 10, 50), b"");
    assert_eq!(ask(&second, "efresh\r", 5), "fresh");
    running.end().unwrap();
}

#[test]
fn what_was_written_before_closing_arrives() {
    let diary = Diary::default();
    let (running, path) = serve(Clock::Real);
    running.handle.watch(diary.clone()).wait().unwrap();
    fs::write(&path, b"ehello\r").unwrap();
    diary.wait_for(
        "the command",
        |report| matches!(&report.what, ReportKind::Sent { bytes } if &bytes[..] == b"hello"),
    );
    running.end().unwrap();
}

/// Whether it is seen first that somebody came and went, or what was sent.
#[test]
fn what_was_written_comes_before_the_news_of_the_closing() {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut pty = Pty::open(19_200).unwrap();
        let mut buffer = [0; 16];
        for number in 0..100 {
            let mut port = open(pty.path());
            port.write_all(b"e1\r").unwrap();
            drop(port);
            let mut told = Vec::new();
            while told.last() != Some(&"closed") {
                let received = poll_fn(|cx| pty.poll_receive(cx, &mut buffer)).await;
                told.push(match received {
                    Received::News(LineEvent::Opened { .. }) => "opened",
                    Received::News(LineEvent::Closed { .. }) => "closed",
                    Received::Bytes(3) => "bytes",
                    received => panic!("{received:?}"),
                });
            }
            assert_eq!(told, ["opened", "bytes", "closed"], "{number}");
        }
    });
}

/// Nothing of it is left to the next client, which is there already.
#[test]
fn what_was_written_comes_before_the_next_client() {
    const WRITTEN: usize = 3_000;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut pty = Pty::open(19_200).unwrap();
        let mut buffer = [0; 16];
        for number in 0..50 {
            let mut port = Some(open(pty.path()));
            let mut arrived = 0;
            loop {
                match poll_fn(|cx| pty.poll_receive(cx, &mut buffer)).await {
                    Received::News(LineEvent::Opened { .. }) => {
                        port.take().unwrap().write_all(&[b'x'; WRITTEN]).unwrap();
                        port = Some(open(pty.path()));
                    }
                    Received::News(LineEvent::Closed { .. }) => break,
                    Received::Bytes(count) => arrived += count,
                    received => panic!("{received:?}"),
                }
            }
            assert_eq!(arrived, WRITTEN, "{number}");
            drop(port);
            loop {
                let received = poll_fn(|cx| pty.poll_receive(cx, &mut buffer)).await;
                if matches!(received, Received::News(LineEvent::Closed { .. })) {
                    break;
                }
            }
        }
    });
}

/// Clients follow each other at once, and what waits to be read was written by the second: it comes behind
/// the news that the first has gone.
#[cfg(target_os = "linux")]
#[test]
fn bytes_belong_to_the_client_that_wrote_them() {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut pty = Pty::open(19_200).unwrap();
        let mut buffer = [0; 16];
        for number in 0..50 {
            let mut first = open(pty.path());
            first.write_all(b"@0").unwrap();
            let mut told = Vec::new();
            while told.last() != Some(&"2 bytes") {
                told.push(next_of(&mut pty, &mut buffer).await);
            }
            drop(first);
            let mut second = open(pty.path());
            second.write_all(b"@07\r").unwrap();
            while told.last() != Some(&"4 bytes") {
                told.push(next_of(&mut pty, &mut buffer).await);
            }
            drop(second);
            told.push(next_of(&mut pty, &mut buffer).await);
            let expected = ["opened", "2 bytes", "closed", "opened", "4 bytes", "closed"];
            assert_eq!(told, expected, "{number}");
        }
    });
}

#[cfg(target_os = "linux")]
async fn next_of(pty: &mut Pty, buffer: &mut [u8]) -> &'static str {
    match poll_fn(|cx| pty.poll_receive(cx, buffer)).await {
        Received::News(LineEvent::Opened { .. }) => "opened",
        Received::News(LineEvent::Closed { .. }) => "closed",
        Received::Bytes(2) => "2 bytes",
        Received::Bytes(4) => "4 bytes",
        received => panic!("{received:?}"),
    }
}

#[test]
fn exclusive_use_ends_with_its_client() {
    let diary = Diary::default();
    let (running, path) = serve(Clock::Real);
    running.handle.watch(diary.clone()).wait().unwrap();
    let first = open(&path);
    ioctl_tiocexcl(&first).unwrap();
    assert_eq!(ask(&first, "eone\r", 3), "one");
    // Closing it is all the kernel does for a client that is killed.
    drop(first);
    diary.wait_for("the end", |report| matches!(report.news(), Some(LineEvent::Closed { .. })));
    // Root may open an exclusive terminal anyway, so somebody else has to try.
    if rustix::process::geteuid().is_root() {
        fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o666)).unwrap();
        let tried = Command::new("setpriv")
            .args(["--reuid=65534", "--clear-groups", "sh", "-c", "exec 3<>\"$0\""])
            .arg(&path)
            .status();
        match tried {
            Ok(status) => assert!(status.success(), "the terminal is still locked"),
            Err(error) => assert_eq!(error.kind(), ErrorKind::NotFound),
        }
    }
    let second = open(&path);
    assert_eq!(ask(&second, "etwo\r", 3), "two");
    running.end().unwrap();
}

#[test]
fn a_killed_client_is_noticed() {
    let diary = Diary::default();
    let (running, path) = serve(Clock::Real);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut client = Command::new("sh")
        .args(["-c", "exec 3<>\"$0\"; echo; read -r _"])
        .arg(&path)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    client.stdout.as_mut().unwrap().read_exact(&mut [0]).unwrap();
    diary.wait_for("its coming", |report| matches!(report.news(), Some(LineEvent::Opened { .. })));
    client.kill().unwrap();
    client.wait().unwrap();
    diary.wait_for("its end", |report| matches!(report.news(), Some(LineEvent::Closed { .. })));
    running.end().unwrap();
}

#[test]
fn two_openings_are_one_line_until_both_are_closed() {
    let (running, path) = serve(Clock::Real);
    // At once, so that the events are merged; one reads, one writes.
    for _ in 0..50 {
        let reader = OpenOptions::new().read(true).open(&path).unwrap();
        let writer = OpenOptions::new().write(true).open(&path).unwrap();
        let third = open(&path);
        drop(third);
        (&writer).write_all(b"eabc\r").unwrap();
        assert_eq!(read(&reader, 3, 5_000), b"abc");
    }
    running.end().unwrap();
}

#[test]
fn one_of_two_handles_that_is_closed_is_no_client_that_leaves() {
    let (running, path) = serve(Clock::Manual);
    for _ in 0..20 {
        let diary = Diary::default();
        let id = running.handle.watch(diary.clone()).wait().unwrap();
        let told = |report: &Report| match report.news() {
            Some(LineEvent::Opened { .. }) => Some("opened"),
            Some(LineEvent::Closed { .. }) => Some("closed"),
            _ => None,
        };
        // As programs do that look whether a port is there, or that use one handle to write.
        let first = open(&path);
        let second = open(&path);
        (&second).write_all(b"ekept\r").unwrap();
        running.handle.now().wait().unwrap();
        drop(first);
        // What it has not read yet is not thrown away.
        assert_eq!(read(&second, 4, 5_000), b"kept");
        assert_eq!(ask(&second, "eabc\r", 3), "abc");
        let third = open(&path);
        drop(second);
        assert_eq!(ask(&third, "edef\r", 3), "def");
        drop(third);
        diary.wait_for("its end", |report| matches!(report.news(), Some(LineEvent::Closed { .. })));
        running.handle.now().wait().unwrap();
        assert_eq!(diary.all(told), ["opened", "closed"]);
        assert_eq!(running.handle.detach(id).wait(), Ok(true));
    }
    running.end().unwrap();
}

#[test]
fn a_client_that_never_reads_stops_nobody() {
    let diary = Diary::default();
    let (running, path) = serve(Clock::Real);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut lazy = open(&path);
    for _ in 0..10 {
        lazy.write_all(b"s30000\r").unwrap();
    }
    diary.wait_for("a loss", |report| matches!(report.news(), Some(LineEvent::Lost { .. })));
    // It may begin to read at any time, and what is whole arrives whole.
    let kept = read(&lazy, 300_000, 300);
    assert!(kept.len() >= 60_000 && kept.len().is_multiple_of(30_000), "{}", kept.len());
    assert_eq!(ask(&lazy, "ehello\r", 5), "hello");
    // And when it leaves instead, the next one starts afresh.
    for _ in 0..10 {
        lazy.write_all(b"s30000\r").unwrap();
    }
    running.handle.now().wait().unwrap();
    drop(lazy);
    // What it has not read is flushed when its closing is noticed, a moment later.
    diary.wait_for("its end", |report| matches!(report.news(), Some(LineEvent::Closed { .. })));
    let next = open(&path);
    assert_eq!(ask(&next, "ehello\r", 5), "hello");
    running.end().unwrap();
}

#[test]
fn an_idle_controller_costs_nothing() {
    let (running, path) = serve(Clock::Real);
    let port = open(&path);
    assert_eq!(ask(&port, "ehello\r", 5), "hello");
    drop(port);
    // The kernel keeps fifteen characters of the name.
    let before = processor_time("pty::an_idle_co");
    std::thread::sleep(Duration::from_millis(300));
    let spent = processor_time("pty::an_idle_co") - before;
    assert!(spent <= 3, "{spent} hundredths of a second in 0.3 s of doing nothing");
    running.end().unwrap();
}
