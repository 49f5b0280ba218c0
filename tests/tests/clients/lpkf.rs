//! Clients of the LPKF controllers: streams that heed the buffer, and some that do not.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::thread;

use vimc4::{Clock, Emulator};

use super::limits::joined;
use super::{Port, tcp, terminal};

/// A controller on a machine without ends.
pub(crate) fn emulator(clock: Clock) -> Emulator {
    let builder = Emulator::builder().model("smcu").machine("bench");
    builder.time(clock).pty(true).tcp("127.0.0.1:0").start().expect("an emulator")
}

/// A controller on a machine with limit switches, which homes by itself.
pub(crate) fn plotter(clock: Clock) -> Emulator {
    let builder = Emulator::builder().model("smcu").machine("board-plotter");
    builder.time(clock).pty(true).tcp("127.0.0.1:0").start().expect("an emulator")
}

/// One answer, without its CR.
fn answer(port: &mut impl BufRead) -> String {
    let mut line = Vec::new();
    port.read_until(b'\r', &mut line).unwrap();
    assert_eq!(line.pop(), Some(b'\r'), "{line:?} has no end");
    String::from_utf8(line).unwrap()
}

/// A hundred thousand commands, as many on the way as the buffer takes: each is acknowledged
/// once, in order.
pub(crate) fn stream(open: fn(&Emulator) -> Box<dyn Port>) {
    const COMMANDS: u32 = 100_000;
    /// The buffer has 1,024 bytes.
    const ON_THE_WAY: usize = 1_000;
    let emulator = emulator(Clock::Instant);
    let mut port = BufReader::new(open(&emulator));
    let mut waiting: VecDeque<(usize, Option<u32>)> = VecDeque::new();
    let (mut on_the_way, mut sent, mut asked, mut done) = (0, 0, 0, 0);
    while done < COMMANDS {
        let mut piece = Vec::new();
        while sent < COMMANDS {
            let asks = sent % 2 == 1;
            let command: &[u8] = if asks { b"!ON1;" } else { b"PR1,0;" };
            if on_the_way + command.len() > ON_THE_WAY {
                break;
            }
            asked += u32::from(asks);
            on_the_way += command.len();
            waiting.push_back((command.len(), asks.then_some(asked)));
            piece.extend_from_slice(command);
            sent += 1;
        }
        port.get_mut().write_all(&piece).unwrap();
        let (length, place) = waiting.pop_front().unwrap();
        if let Some(place) = place {
            assert_eq!(answer(&mut port), format!("P{place}"));
        }
        assert_eq!(answer(&mut port), "C", "command {done}");
        on_the_way -= length;
        done += 1;
    }
    assert_eq!(emulator.position().unwrap()[0], i64::from(COMMANDS / 2));
}

/// Without flow control what the buffer cannot take is lost and said once; what it took is
/// done, and the controller works on.
pub(crate) fn overrun_on_a_terminal() {
    let emulator = emulator(Clock::Manual);
    let mut port = BufReader::new(terminal(&emulator));
    port.get_mut().write_all(&b"PR1,0;".repeat(500)).unwrap();
    assert_eq!(answer(&mut port), "E0F");
    emulator.run_until_idle().unwrap();
    let moved = emulator.position().unwrap()[0];
    assert!((100..500).contains(&moved), "{moved} of 500 were executed");
    for _ in 0..moved {
        assert_eq!(answer(&mut port), "C");
    }
    port.get_mut().write_all(b"!ON1;").unwrap();
    assert_eq!(answer(&mut port), format!("P{moved}"));
    assert_eq!(answer(&mut port), "C");
}

/// A host on TCP is held back as it would be by CTS, and loses nothing.
pub(crate) fn held_back_on_tcp() {
    const COMMANDS: usize = 20_000;
    let emulator = emulator(Clock::Instant);
    let stream: TcpStream = TcpStream::connect(emulator.tcp_addr().unwrap()).unwrap();
    let mut to = stream.try_clone().unwrap();
    let writer = thread::spawn(move || to.write_all(&b"PR1,0;".repeat(COMMANDS)).unwrap());
    let mut port = BufReader::new(stream);
    for _ in 0..COMMANDS {
        assert_eq!(answer(&mut port), "C");
    }
    joined("the end of the commands", writer);
    assert_eq!(emulator.position().unwrap()[0], COMMANDS as i64);
    // A command that is longer than what may wait is taken as long as nothing else is to be done.
    port.get_mut().write_all(&[b"PA", &b"1,2,"[..].repeat(500)[..], b"3,4;"].concat()).unwrap();
    assert_eq!(answer(&mut port), "C");
    assert_eq!(emulator.position().unwrap()[..2], [3, 4]);
    // While the controller is stopped, what lets it go on gets past what waits.
    port.get_mut().write_all(b"!ST;").unwrap();
    assert_eq!(answer(&mut port), "C");
    port.get_mut().write_all(&b"PR1,0;".repeat(140)).unwrap();
    port.get_mut().write_all(b"!GO;").unwrap();
    for _ in 0..141 {
        assert_eq!(answer(&mut port), "C");
    }
    // The same while time stands still: nothing is executed, so hardly anything is taken.
    let emulator = self::emulator(Clock::Manual);
    let mut port = BufReader::new(tcp(&emulator));
    port.get_mut().write_all(&b"PR1,0;".repeat(1_000)).unwrap();
    for done in 0..1_000 {
        // Each journey ends when what was taken is done.
        while emulator.position().unwrap()[0] <= done {
            emulator.run_until_idle().unwrap();
        }
        assert_eq!(answer(&mut port), "C");
    }
}
