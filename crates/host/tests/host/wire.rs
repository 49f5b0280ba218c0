//! The transports of a controller are one wire, and its flash is on disk before its answer.

use std::fs;
use std::io::{Read, Write};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use std::time::Duration;

use vimc4_device::OwnedInput;
use vimc4_host::{Clock, FlashFile, Memory, Received, ReportKind, Sent, Transport};

use crate::fake::{Diary, Fake, Running};

#[test]
fn everybody_hears_and_everybody_speaks() {
    let (running, (mut one, mut two)) =
        Running::start(Fake::new(b""), Clock::Real, |mut runner| {
            let (first, one) = Memory::pair();
            let (second, two) = Memory::pair();
            runner.attach(Box::new(first));
            runner.attach(Box::new(second));
            (runner, (one, two))
        });
    let mut answer = [0; 3];
    // The bytes of a command may come from both.
    one.write_all(b"ea").unwrap();
    running.handle.now().wait().unwrap();
    two.write_all(b"bc\r").unwrap();
    one.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"abc");
    two.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"abc");
    // One that leaves hurts nobody.
    drop(one);
    two.write_all(b"exyz\r").unwrap();
    two.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"xyz");
    running.end().unwrap();
}

#[test]
fn what_leaves_while_nobody_listens_is_lost_with_an_event() {
    let diary = Diary::default();
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    running.handle.watch(diary.clone()).wait().unwrap();
    port.write_all(b"ehello\rw10\r").unwrap();
    running.handle.now().wait().unwrap();
    assert_eq!(port.drain(), b"hello");
    drop(port);
    running.handle.advance(std::time::Duration::from_millis(10)).wait().unwrap();
    assert_eq!(diary.unheard(), 1);
    let (memory, mut next) = Memory::pair();
    running.handle.attach(memory).wait().unwrap();
    running.handle.now().wait().unwrap();
    assert_eq!(next.drain(), b"");
    let received = diary.0.lock().unwrap().iter().any(
        |report| matches!(&report.what, ReportKind::Input { input: OwnedInput::Bytes(bytes), .. } if &bytes[..] == b"ehello\rw10\r"),
    );
    assert!(received);
    running.end().unwrap();
}

#[test]
fn one_that_does_not_read_loses_its_own_copy_only() {
    let (running, (_lazy, mut eager)) =
        Running::start(Fake::new(b""), Clock::Real, |mut runner| {
            let (first, lazy) = Memory::pair();
            let (second, eager) = Memory::pair();
            runner.attach(Box::new(first));
            runner.attach(Box::new(second));
            (runner, (lazy, eager))
        });
    let mut answer = vec![0; 100_000];
    for _ in 0..30 {
        eager.write_all(b"s100000\r").unwrap();
        eager.read_exact(&mut answer).unwrap();
    }
    running.end().unwrap();
}

#[test]
fn what_was_answered_is_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flash");
    let (file, image) = FlashFile::open(&path).unwrap();
    let (running, mut port) = Running::start(Fake::new(b"fresh:"), Clock::Real, move |runner| {
        let mut runner = runner.with_flash(file, &image).unwrap();
        let (memory, port) = Memory::pair();
        runner.attach(Box::new(memory));
        (runner, port)
    });
    // The device reads an empty file as a fresh memory, and the file follows.
    assert_eq!(fs::read(&path).unwrap(), b"fresh:");
    for n in 0..10 {
        port.write_all(format!("f{n}\r").as_bytes()).unwrap();
        let mut answer = [0];
        port.read_exact(&mut answer).unwrap();
        let expected: String = (0..=n).map(|n| n.to_string()).collect();
        assert_eq!(fs::read_to_string(&path).unwrap(), format!("fresh:{expected}"));
    }
    // A state of before takes the memory back with it.
    let state = running.handle.state().wait().unwrap();
    port.write_all(b"fmore\r").unwrap();
    running.handle.restore(state).wait().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "fresh:0123456789");
    running.end().unwrap();
}

/// A line whose handshake nobody heeds, and what its handshake has shown.
struct Heedless {
    line: Memory,
    shown: Arc<Mutex<Vec<bool>>>,
}

impl Transport for Heedless {
    fn label(&self) -> &Arc<str> {
        self.line.label()
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received> {
        self.line.poll_receive(cx, buffer)
    }

    fn poll_send(&mut self, cx: &mut Context<'_>) {
        self.line.poll_send(cx);
    }

    fn send(&mut self, bytes: &[u8]) -> Sent {
        self.line.send(bytes)
    }

    fn has_handshake(&self) -> bool {
        false
    }

    fn set_ready(&mut self, ready: bool) {
        self.shown.lock().unwrap().push(ready);
    }
}

#[test]
fn who_heeds_the_handshake_waits() {
    let shown = Arc::new(Mutex::new(Vec::new()));
    let told = Arc::clone(&shown);
    let device = Fake::with_handshake();
    let (running, (mut heeds, mut heedless)) =
        Running::start(device, Clock::Manual, move |mut runner| {
            let (first, heeds) = Memory::pair();
            let (line, heedless) = Memory::pair();
            runner.attach(Box::new(first));
            runner.attach(Box::new(Heedless { line, shown: told }));
            (runner, (heeds, heedless))
        });
    let advance = |ms| running.handle.advance(Duration::from_millis(ms)).wait().unwrap();
    heeds.write_all(b"w10\r").unwrap();
    advance(1);
    assert_eq!(*shown.lock().unwrap(), [false]);
    // Both write while it moves; what the device took is executed first.
    heeds.write_all(b"elate,\r").unwrap();
    advance(1);
    heedless.write_all(b"eearly,\r").unwrap();
    advance(20);
    running.handle.now().wait().unwrap();
    assert_eq!(heeds.drain(), b"0early,late,");
    assert_eq!(*shown.lock().unwrap(), [false, true]);
    running.end().unwrap();
}

/// A line that knows how often something was taken from it while answers were waiting.
struct Crowded {
    line: Memory,
    waiting: bool,
    passed_over: Arc<AtomicUsize>,
}

impl Transport for Crowded {
    fn label(&self) -> &Arc<str> {
        self.line.label()
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received> {
        let received = self.line.poll_receive(cx, buffer);
        if self.waiting && matches!(received, Poll::Ready(Received::Bytes(_))) {
            self.passed_over.fetch_add(1, Ordering::Relaxed);
        }
        received
    }

    fn poll_send(&mut self, cx: &mut Context<'_>) {
        self.waiting = false;
        self.line.poll_send(cx);
    }

    fn send(&mut self, bytes: &[u8]) -> Sent {
        self.waiting = true;
        self.line.send(bytes)
    }
}

#[test]
fn answers_are_passed_on_before_more_is_taken_in() {
    let passed_over = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&passed_over);
    let (running, mut port) = Running::start(Fake::new(b""), Clock::Manual, move |mut runner| {
        let (line, port) = Memory::pair();
        runner.attach(Box::new(Crowded { line, waiting: false, passed_over: counted }));
        (runner, port)
    });
    // Whoever asks for the time has all taken in that was sent before.
    for _ in 0..20 {
        port.write_all(&b"eabcdefghij\r".repeat(2_000)).unwrap();
        running.handle.now().wait().unwrap();
        assert_eq!(port.drain(), b"abcdefghij".repeat(2_000));
    }
    assert_eq!(passed_over.load(Ordering::Relaxed), 0);
    running.end().unwrap();
}
