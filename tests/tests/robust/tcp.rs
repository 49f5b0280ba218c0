//! Clients over TCP.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::process::{Command, ExitCode};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use socket2::SockRef;
use vimc4::{Clock, Condition, Emulator};

use crate::limits::InTime;
use crate::tools::{Counts, ask, at, connect, in_role, wait_until};

pub(crate) const TESTS: &[(&str, fn())] = &[
    ("tcp: a thousand clients one after the other are all served", a_thousand_clients),
    ("tcp: a client that resets does not stop the move", a_client_resets),
    ("tcp: garbage is answered line by line while the neighbour works", a_client_floods),
    ("tcp: a client that does not read for long keeps the line and hears again", a_client_rests),
    ("tcp: a client that asks on and on hears the answers", a_client_asks_on_and_on),
];

fn a_thousand_clients() {
    let emulator = Emulator::builder().time(Clock::Instant).tcp("127.0.0.1:0").start().unwrap();
    assert_eq!(ask(&mut connect(&emulator), "@01", 1), "0");
    for n in 1..=1_000 {
        let mut client = connect(&emulator);
        assert_eq!(ask(&mut client, "@0A1,900", 1), "0");
        assert_eq!(ask(&mut client, "@0P", 7), format!("0{n:06X}"));
    }
}

fn a_client_resets() {
    let emulator = Emulator::builder().time(Clock::Manual).tcp("127.0.0.1:0").start().unwrap();
    for round in 1..=20 {
        let mut client = connect(&emulator);
        assert_eq!(ask(&mut client, "@07", 1), "0");
        client.write_all(b"@0A1000,900,0,900,0,900,0,900\r").unwrap();
        let place = round * 1_000 - 500;
        // The controller need not have seen the command yet.
        wait_until("the move", || {
            emulator.run_until(&Condition::AxisAt { axis: 0, position: place }).is_ok()
        });
        SockRef::from(&client).set_linger(Some(Duration::ZERO)).unwrap();
        drop(client);
        emulator.run_until_idle().unwrap();
        assert_eq!(emulator.position().unwrap(), [round * 1_000, 0, 0, 0]);
        // The answer to the move was for the one who is gone.
        let mut next = connect(&emulator);
        assert_eq!(ask(&mut next, "@0P", 19), at(usize::try_from(round).unwrap() * 1_000));
    }
}

fn a_client_floods() {
    // The answers fit into what is kept for a client that reads slowly.
    const LINES: usize = 50_000;
    let start = || Emulator::builder().time(Clock::Instant).tcp("127.0.0.1:0").start().unwrap();
    let (flooded, neighbour) = (start(), start());
    let mut client = connect(&flooded);
    let mut other = connect(&neighbour);
    assert_eq!(ask(&mut client, "@07", 1), "0");
    assert_eq!(ask(&mut other, "@01", 1), "0");
    // Printable nonsense of changing letters, without what ends a line or begins a command.
    let mut flood = Vec::new();
    for line in 0..LINES {
        flood.push(b'x');
        flood.extend((0..98).map(|n| b'#' + u8::try_from((line * 31 + n * 7) % 29).unwrap()));
        flood.push(b'\r');
    }
    assert_eq!(flood.len(), 5_000_000);
    let over = AtomicBool::new(false);
    let (answers, asked) = thread::scope(|scope| {
        let mut writer = client.try_clone().unwrap();
        scope.spawn(move || writer.write_all(&flood).unwrap());
        let neighbour = scope.spawn(|| {
            let mut asked = 0;
            while !over.load(Ordering::Relaxed) {
                assert_eq!(ask(&mut other, "@0A1,900", 1), "0");
                asked += 1;
            }
            asked
        });
        let mut answers = Vec::new();
        let mut some = [0; 256];
        while answers.len() < LINES {
            let n = client.read(&mut some).unwrap();
            assert!(n > 0, "hung up after {} answers", answers.len());
            answers.extend_from_slice(&some[..n]);
            thread::sleep(Duration::from_millis(2));
        }
        over.store(true, Ordering::Relaxed);
        (answers, neighbour.join().unwrap())
    });
    assert_eq!(answers.len(), LINES);
    assert_eq!(answers.iter().find(|&&answer| answer != b'5'), None);
    assert!(asked > 0);
    assert_eq!(neighbour.position().unwrap(), [asked, 0, 0, 0]);
    // It has neither moved nor lost its thread.
    assert_eq!(ask(&mut client, "@0P", 19), at(0));
}

/// A client that has asked until nothing more of the answers was taken: neither by its system, nor
/// by ours.
fn stuffed(counts: &Counts) -> (Emulator, TcpStream) {
    let builder = Emulator::builder().time(Clock::Instant).tcp("127.0.0.1:0").sink(counts.clone());
    let emulator = builder.start().unwrap();
    let mut client = connect(&emulator);
    assert_eq!(ask(&mut client, "@07", 1), "0");
    let question = b"@0P\r".repeat(1_000);
    while counts.lost.load(Ordering::SeqCst) == 0 {
        client.write_all(&question).unwrap();
    }
    (emulator, client)
}

/// Longer than any client may be silent.
const LONG: Duration = Duration::from_secs(20);

fn a_client_rests() {
    let counts = Counts::default();
    let (_emulator, mut client) = stuffed(&counts);
    thread::sleep(LONG);
    assert_eq!(counts.closed.load(Ordering::SeqCst), 0, "it was cut off");
    // What it was not too late for comes in whole answers.
    client.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    let mut answers = 0;
    let mut answer = [0; 19];
    while client.read_exact(&mut answer).is_ok() {
        assert_eq!(answer, at(0).as_bytes());
        answers += 1;
    }
    assert!(answers > 1_000, "{answers}");
    assert_eq!(ask(&mut client, "@0P", 19), at(0));
}

/// Answers that could not leave at once leave as soon as they can, also while it goes on asking.
fn a_client_asks_on_and_on() {
    const ANSWERS: usize = 100_000;
    let (_emulator, mut client) = stuffed(&Counts::default());
    let mut asking = client.try_clone().unwrap();
    thread::scope(|scope| {
        scope.spawn(|| {
            let question = b"@0P\r".repeat(1_000);
            // In the end the line is closed, which need not be said here.
            while asking.write_all(&question).is_ok() {}
        });
        let mut heard = 0;
        let mut answer = [0; 19];
        while heard < ANSWERS && client.read_exact(&mut answer).is_ok() {
            assert_eq!(answer, at(0).as_bytes());
            heard += 1;
        }
        client.shutdown(Shutdown::Both).unwrap();
        assert_eq!(heard, ANSWERS);
    });
}

// --- a network that goes away ---

pub(crate) const ROLE: &str = "lose the network";

/// The client's computer loses its power, or somebody pulls the plug: nothing comes any more,
/// not even the news of that.
pub(crate) fn a_client_vanishes() {
    let lost = in_role(ROLE);
    let status = Command::new("unshare")
        .args(["-rn"])
        .arg(lost.get_program())
        .envs(lost.get_envs().filter_map(|(key, value)| Some((key, value?))))
        .status_in_time()
        .unwrap();
    assert!(status.success());
}

/// Runs in a network of its own, which can be switched off.
pub(crate) fn lose_the_network() -> ExitCode {
    let network = |state| {
        let status =
            Command::new("ip").args(["link", "set", "lo", state]).status_in_time().unwrap();
        assert!(status.success());
    };
    network("up");
    let counts = Counts::default();
    let builder = Emulator::builder().tcp("127.0.0.1:0").sink(counts.clone());
    let emulator = builder.start().unwrap();
    // And one that has not read for a while, so that nothing is under way to it.
    let full = Counts::default();
    let mut client = connect(&emulator);
    assert_eq!(ask(&mut client, "@07", 1), "0");
    let (other_emulator, _other) = stuffed(&full);
    thread::sleep(LONG);
    assert_eq!(full.closed.load(Ordering::SeqCst), 0, "it was cut off");
    network("down");
    let began = Instant::now();
    let gone = |counts: &Counts, within| {
        while counts.closed.load(Ordering::SeqCst) == 0 {
            assert!(began.elapsed() < within, "it still holds the line");
            thread::sleep(Duration::from_millis(10));
        }
    };
    gone(&counts, Duration::from_secs(15));
    gone(&full, Duration::from_secs(25));
    network("up");
    assert_eq!(ask(&mut connect(&emulator), "@0P", 19), at(0));
    assert_eq!(ask(&mut connect(&other_emulator), "@0P", 19), at(0));
    ExitCode::SUCCESS
}
