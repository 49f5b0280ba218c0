//! Whoever collects traces sees what an emulator did.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::fmt::Debug;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber, subscriber};
use vimc4::{Clients, Clock, Condition, Emulator};

/// Keeps every event as a line, with the spans that it stands in.
#[derive(Clone)]
struct Keeps {
    most: Level,
    kept: Arc<Mutex<Kept>>,
    last: Arc<AtomicU64>,
}

#[derive(Default)]
struct Kept {
    /// By their numbers: each with those around it.
    spans: Vec<(u64, String)>,
    open: i64,
    lines: Vec<String>,
}

impl Keeps {
    fn up_to(most: Level) -> Keeps {
        Keeps { most, kept: Arc::default(), last: Arc::default() }
    }

    fn lines(&self) -> Vec<String> {
        self.kept.lock().unwrap().lines.clone()
    }

    /// Waits until a line is there that has all of this in it.
    fn wait_for(&self, parts: &[&str]) -> String {
        for _ in 0..1_000 {
            let line = |line: &String| parts.iter().all(|part| line.contains(part));
            if let Some(line) = self.lines().into_iter().find(line) {
                return line;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("nothing has {parts:?}: {:#?}", self.lines());
    }
}

/// Fields as text.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.0 += &format!(" {}={value}", field.name());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.0 += &format!(" {}={value:?}", field.name());
    }
}

impl Subscriber for Keeps {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target() == "vimc4" && *metadata.level() <= self.most
    }

    fn new_span(&self, span: &Attributes<'_>) -> Id {
        let number = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        let mut kept = self.kept.lock().unwrap();
        let around = span.parent().map(|id| kept.name(id)).unwrap_or_default();
        let mut text = Text::default();
        span.record(&mut text);
        let name = format!("{around}{}{{{}}} ", span.metadata().name(), text.0.trim_start());
        kept.spans.push((number, name));
        kept.open += 1;
        Id::from_u64(number)
    }

    fn record(&self, _span: &Id, _values: &Record<'_>) {}

    fn record_follows_from(&self, _span: &Id, _follows: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut kept = self.kept.lock().unwrap();
        let around = event.parent().map(|id| kept.name(id)).unwrap_or_default();
        let mut text = Text::default();
        event.record(&mut text);
        kept.lines.push(format!("{} {around}{}", event.metadata().level(), text.0.trim_start()));
    }

    fn enter(&self, _span: &Id) {}

    fn exit(&self, _span: &Id) {}

    fn clone_span(&self, id: &Id) -> Id {
        self.kept.lock().unwrap().open += 1;
        id.clone()
    }

    fn try_close(&self, _id: Id) -> bool {
        self.kept.lock().unwrap().open -= 1;
        true
    }
}

impl Kept {
    fn name(&self, id: &Id) -> String {
        let is = |(number, _): &&(u64, String)| *number == id.into_u64();
        self.spans.iter().find(is).map(|(_, name)| name.clone()).unwrap_or_default()
    }
}

/// An emulator that has this subscriber, although no other thread has it.
fn start(keeps: &Keeps, name: &str) -> Emulator {
    subscriber::with_default(keeps.clone(), || {
        let builder = Emulator::builder().machine("mill").time(Clock::Manual).name(name);
        builder.tcp("127.0.0.1:0").tcp_clients(Clients::Takeover).start().unwrap()
    })
}

fn ask(port: &mut TcpStream, line: &str) -> u8 {
    port.write_all(line.as_bytes()).unwrap();
    let mut answer = [0];
    port.read_exact(&mut answer).unwrap();
    answer[0]
}

#[test]
fn a_subscriber_sees_clients_conversation_panel_and_warnings() {
    let keeps = Keeps::up_to(Level::DEBUG);
    let left = start(&keeps, "left");
    let right = start(&keeps, "right");
    let address = left.tcp_addr().unwrap();
    keeps.wait_for(&["INFO controller{name=left}", "model=imc4", "machine=mill", "begins"]);
    let place = format!("place={address}");
    keeps.wait_for(&["INFO controller{name=left}", "transport open", "sort=tcp", &place]);

    let mut port = TcpStream::connect(address).unwrap();
    let client = format!("name={}", port.local_addr().unwrap());
    assert_eq!(ask(&mut port, "@07\r"), b'0');
    let opened = keeps.wait_for(&["INFO", "line opened", &client]);
    assert!(opened.contains("controller{name=left} client{transport=tcp "), "{opened}");
    keeps.wait_for(&["DEBUG", "command=1", "mnemonic=@", "line=@07", "means=set axes X+Y+Z"]);
    keeps.wait_for(&["DEBUG", "command=1", "answer=0"]);
    assert_eq!(ask(&mut port, "@0A1,2,3\r"), b'7');
    keeps.wait_for(&["DEBUG", "command=2", "answer=7", "why="]);

    left.control().by("a person").press("start").wait().unwrap();
    keeps.wait_for(&["DEBUG controller{name=left}", "by=a person", "deed=press start", "done"]);

    // Onto the end of the axis, by time that is told in nanoseconds.
    port.write_all(b"@0A90000,4000,0,900,0,900,0,900\r").unwrap();
    left.run_until(&Condition::Idle).unwrap();
    keeps.wait_for(&["WARN controller{name=left}", "command=3", "steps"]);
    let at = format!("at_ns={}", left.now().unwrap().as_nanos());
    keeps.wait_for(&["DEBUG", &at, "answer=2"]);

    let second = TcpStream::connect(address).unwrap();
    let by = format!("taken_by={}", second.local_addr().unwrap());
    let closed = keeps.wait_for(&["INFO", "line closed", &by]);
    assert!(closed.contains(&client), "{closed}");
    drop((second, left, right));
    for name in ["left", "right"] {
        keeps.wait_for(&[&format!("INFO controller{{name={name}}}"), "ends"]);
    }
    // Nothing that only traces would show was asked for.
    assert!(keeps.lines().iter().all(|line| !line.starts_with("TRACE")));
    // Every span is closed.
    let mut left_open = 0;
    for _ in 0..1_000 {
        left_open = keeps.kept.lock().unwrap().open;
        if left_open == 0 {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(left_open, 0);
}

#[test]
fn a_subscriber_gets_no_more_than_it_wants() {
    let [warns, informs, traces] = [Level::WARN, Level::INFO, Level::TRACE].map(Keeps::up_to);
    for keeps in [&warns, &informs, &traces] {
        let emulator = start(keeps, "1");
        let mut port = emulator.connect().unwrap();
        port.write_all(b"@01\r@0A10,900\r").unwrap();
        emulator.run_until_idle().unwrap();
        emulator.pause().unwrap();
        drop(emulator);
    }
    assert_eq!(warns.lines(), [""; 0]);
    let lines = informs.lines();
    assert!(lines.iter().all(|line| line.starts_with("INFO")), "{lines:?}");
    informs.wait_for(&["time paused", "by=the library"]);
    traces.wait_for(&["TRACE", "Begins"]);
    traces.wait_for(&["TRACE", "sent", "bytes=0"]);
    traces.wait_for(&["DEBUG", "line=@0A10,900"]);
}
