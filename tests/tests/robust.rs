//! Rough treatment, end to end: crowds, clients that reset, flood and reconnect without end, and
//! a process that is killed while it writes its flash file.
//!
//! Linux shows a process its threads and descriptors as files, which is how these tests see
//! that nothing is left behind.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use socket2::SockRef;
use vimc4::{Clock, Condition, Emulator, Kinds, News, Report, Sink, Wants};

/// How long is waited for what must come. Only a failing test waits as long.
const PATIENCE: Duration = Duration::from_secs(10);

/// The tests take turns: two of them count what belongs to the whole process, and all of them
/// put a small computer to work.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn connect(emulator: &Emulator) -> TcpStream {
    let stream = TcpStream::connect(emulator.tcp_addr().unwrap()).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// A client on a pseudo terminal that does not wait for ever.
struct Terminal(File);

impl Terminal {
    fn open(path: &Path) -> Terminal {
        Terminal(OpenOptions::new().read(true).write(true).open(path).unwrap())
    }

    /// Whether something can be read within this time.
    fn hears(&self, within: Duration) -> bool {
        let within = Timespec::try_from(within).unwrap();
        poll(&mut [PollFd::new(&self.0, PollFlags::IN)], Some(&within)).unwrap() > 0
    }
}

impl Read for Terminal {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        assert!(self.hears(PATIENCE), "the controller does not answer");
        self.0.read(buffer)
    }
}

impl Write for Terminal {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

/// Sends a line and reads `count` bytes.
fn ask(port: &mut (impl Read + Write), line: &str, count: usize) -> String {
    port.write_all(format!("{line}\r").as_bytes()).unwrap();
    let mut answer = vec![0; count];
    port.read_exact(&mut answer).unwrap();
    String::from_utf8(answer).unwrap()
}

/// X as `@0P` reports it, with the other axes at zero.
fn at(x: usize) -> String {
    format!("0{x:06X}000000000000")
}

fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !holds() {
        assert!(Instant::now() < deadline, "{what} never came");
        thread::sleep(Duration::from_millis(1));
    }
}

// --- a hundred at once ---

/// How many threads of this process belong to an emulator.
fn emulator_threads() -> usize {
    let tasks = fs::read_dir("/proc/self/task").unwrap().flatten();
    // A thread may end between the two looks.
    let names = tasks.filter_map(|task| fs::read_to_string(task.path().join("comm")).ok());
    names.filter(|name| name.starts_with("vimc4")).count()
}

fn descriptors() -> usize {
    fs::read_dir("/proc/self/fd").unwrap().count()
}

/// Does the same with all of them at once, each in a thread of its own.
fn together<T: Send, R: Send>(
    all: impl IntoIterator<Item = T>,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    thread::scope(|scope| {
        let work = &work;
        let threads: Vec<_> = all.into_iter().map(|one| scope.spawn(move || work(one))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}

#[test]
fn a_hundred_emulators_live_side_by_side_and_leave_nothing_behind() {
    const CROWD: usize = 100;
    let _turn = alone();
    // What the first pseudo terminal makes for all that follow stays.
    drop(Emulator::builder().pty(true).tcp("127.0.0.1:0").start().unwrap());
    wait_until("a quiet start", || emulator_threads() == 0);
    let before = descriptors();
    let folder = tempfile::tempdir().unwrap();
    let start = |n: usize| {
        let builder = Emulator::builder().time(Clock::Instant).tcp("127.0.0.1:0");
        builder.pty(folder.path().join(format!("port{n}"))).start().unwrap()
    };
    let emulators: Vec<_> = together(1..=CROWD, start);
    // Each drives to a place of its own by one line and is asked by the other.
    together(emulators.iter().zip(1..), |(emulator, n)| {
        let drive = format!("@0A{n},900,0,900,0,900,0,900");
        let mut stream = connect(emulator);
        assert_eq!(ask(&mut stream, "@07", 1), "0");
        assert_eq!(ask(&mut stream, &drive, 1), "0");
        // One line has the answer a moment before the other; who opens that one in between
        // would hear it again.
        emulator.now().unwrap();
        let mut terminal = Terminal::open(emulator.port().unwrap());
        assert_eq!(ask(&mut terminal, "@0P", 19), at(n));
        assert_eq!(ask(&mut terminal, &drive, 1), "0");
        emulator.now().unwrap();
    });
    together(emulators.iter().zip(1..), |(emulator, n)| {
        assert_eq!(ask(&mut connect(emulator), "@0P", 19), at(2 * n));
    });
    assert_eq!(emulator_threads(), CROWD);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), CROWD);
    let mut addresses: Vec<_> = emulators.iter().map(|e| e.tcp_addr().unwrap()).collect();
    addresses.sort_unstable();
    addresses.dedup();
    assert_eq!(addresses.len(), CROWD, "two listen at the same address");
    together(emulators, drop);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "links are left");
    // A joined thread is shown a moment longer.
    wait_until("the end of all threads", || emulator_threads() == 0);
    wait_until("the end of all descriptors", || descriptors() == before);
}

// --- TCP ---

#[test]
fn a_thousand_clients_one_after_the_other_are_all_served() {
    let _turn = alone();
    let emulator = Emulator::builder().time(Clock::Instant).tcp("127.0.0.1:0").start().unwrap();
    assert_eq!(ask(&mut connect(&emulator), "@01", 1), "0");
    for n in 1..=1_000 {
        let mut client = connect(&emulator);
        assert_eq!(ask(&mut client, "@0A1,900", 1), "0");
        assert_eq!(ask(&mut client, "@0P", 7), format!("0{n:06X}"));
    }
}

#[test]
fn a_client_that_resets_does_not_stop_the_move() {
    let _turn = alone();
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

#[test]
fn five_megabytes_of_garbage_are_answered_line_by_line_while_the_neighbour_works() {
    // The answers fit into what is kept for a client that reads slowly.
    const LINES: usize = 50_000;
    let _turn = alone();
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

// --- pseudo terminal ---

/// Counts the clients that have left.
#[derive(Clone, Default)]
struct Departures(Arc<AtomicUsize>);

impl Sink for Departures {
    fn wants(&self) -> Wants {
        Wants { kinds: Kinds::ALL, bytes: false }
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        if matches!(report, Report::News(_, News::Closed { .. })) {
            self.0.fetch_add(1, Ordering::SeqCst);
        }
    }
}

#[test]
fn three_hundred_openings_of_a_terminal_read_nothing_stale() {
    let _turn = alone();
    let departures = Departures::default();
    let builder = Emulator::builder().time(Clock::Instant).pty(true).sink(departures.clone());
    let emulator = builder.start().unwrap();
    let path = emulator.port().unwrap().to_owned();
    assert_eq!(ask(&mut Terminal::open(&path), "@07", 1), "0");
    for n in 1..=300 {
        let mut client = Terminal::open(&path);
        assert_eq!(ask(&mut client, "@0A1,900,0,900,0,900,0,900", 1), "0");
        if n % 3 != 0 {
            assert_eq!(ask(&mut client, "@0P", 19), at(n));
            continue;
        }
        // Every third one asks and leaves without listening. Its successor might be faster
        // than the news of that, which is known and not what is looked for here.
        client.write_all(b"@0P\r").unwrap();
        assert!(client.hears(PATIENCE));
        let left = departures.0.load(Ordering::SeqCst);
        drop(client);
        wait_until("the news of the leaving", || departures.0.load(Ordering::SeqCst) > left);
        assert!(!Terminal::open(&path).hears(Duration::ZERO), "opening {n} hears its predecessor");
    }
}

// --- power failure ---

/// Names the flash file to the process that is going to be killed, and the attempt.
const FLASH: &str = "VIMC4_ROBUST_FLASH";
const ATTEMPT: &str = "VIMC4_ROBUST_ATTEMPT";
const PROGRAM: usize = 10;

fn program_line(attempt: usize, round: usize, n: usize) -> String {
    format!("0{attempt},900,{round},900,{n},900,0,900")
}

/// An IMC-S8, whose host can erase the program: an IMC4 wants a person for that.
fn with_flash(flash: &Path) -> Emulator {
    Emulator::builder().model("imc-s8").time(Clock::Instant).flash(flash).start().unwrap()
}

/// Stores programs one after the other until it is killed, and says what was answered `0`.
#[test]
#[ignore = "the test below starts it in a process of its own"]
fn stores_until_it_is_killed() {
    let flash = std::env::var_os(FLASH).unwrap();
    let attempt = std::env::var(ATTEMPT).unwrap().parse().unwrap();
    let emulator = with_flash(Path::new(&flash));
    let mut port = emulator.connect().unwrap();
    // The output of a test is captured unless it is written like this.
    let mut said = std::io::stderr();
    let mut say = |what: String| said.write_all(what.as_bytes()).unwrap();
    assert_eq!(ask(&mut port, "@07", 1), "0");
    for round in 0.. {
        say(format!("erase {round}\n"));
        assert_eq!(ask(&mut port, "@0k", 1), "0");
        assert_eq!(ask(&mut port, "@0i", 1), "0");
        say(format!("empty {round}\n"));
        for n in 0..PROGRAM {
            assert_eq!(ask(&mut port, &program_line(attempt, round, n), 1), "0");
            say(format!("stored {n}\n"));
        }
        assert_eq!(ask(&mut port, "9", 1), "0");
        say("closed\n".to_owned());
    }
}

/// What the flash file must hold.
#[derive(Debug, Default)]
struct Promise {
    lines: Vec<String>,
    /// The line that was under way when the process was killed.
    next: Option<String>,
    /// The erasure was under way, so that nothing at all may be left as well.
    erasing: bool,
    closed: bool,
}

impl Promise {
    /// Takes what the killed process has said into account.
    fn note(&mut self, attempt: usize, said: &str) {
        self.next = None;
        self.erasing = false;
        let mut round = 0;
        for line in said.lines() {
            let (word, number) = line.split_once(' ').unwrap_or((line, "0"));
            let number: usize = number.parse().unwrap();
            match word {
                "erase" => self.erasing = true,
                "empty" => {
                    round = number;
                    *self = Promise::default();
                    self.next = Some(program_line(attempt, round, 0));
                }
                "stored" => {
                    assert_eq!(number, self.lines.len());
                    self.lines.push(program_line(attempt, round, number));
                    let more = number + 1 < PROGRAM;
                    self.next = more.then(|| program_line(attempt, round, number + 1));
                }
                "closed" => self.closed = true,
                _ => assert_eq!(line, "", "the killed process failed"),
            }
        }
    }

    fn check(&self, held: &[String], status: &str) {
        if self.erasing && held.is_empty() {
            return;
        }
        let (kept, beyond) = held.split_at_checked(self.lines.len()).unwrap_or((held, &[]));
        assert_eq!(kept, self.lines, "what was answered 0 is lost");
        assert!(beyond.len() <= 1, "{beyond:?}");
        assert_eq!(beyond.first().or(self.next.as_ref()), self.next.as_ref());
        assert!(!self.closed || status == "valid", "the end of the program is lost: {status}");
    }
}

#[test]
fn what_was_answered_survives_a_kill_at_any_moment() {
    let _turn = alone();
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    let mut promise = Promise::default();
    let mut stored = 0;
    for attempt in 1..=40 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "stores_until_it_is_killed", "--ignored", "--nocapture"])
            .env(FLASH, &flash)
            .env(ATTEMPT, attempt.to_string())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut errors = BufReader::new(child.stderr.take().unwrap());
        let mut said = String::new();
        // Most are killed at work, some while they begin.
        if attempt % 5 != 0 {
            errors.read_line(&mut said).unwrap();
        }
        // Moments spread over 1 to 60 ms, in no order; where in its work they hit is chance.
        let moment = 1_000 + attempt * 21_911 % 59_000;
        thread::sleep(Duration::from_micros(u64::try_from(moment).unwrap()));
        child.kill().unwrap();
        let status = child.wait().unwrap();
        errors.read_to_string(&mut said).unwrap();
        assert_eq!(status.signal(), Some(9), "it ended by itself: {said}");
        stored += said.lines().filter(|line| line.starts_with("stored")).count();
        promise.note(attempt, &said);
        let emulator = with_flash(&flash);
        let (held, status) = match emulator.view().unwrap().program {
            Some(program) => (program.lines, program.status),
            None => (Vec::new(), "none".to_owned()),
        };
        promise.check(&held, &status);
        // What is held now is what the next one begins with.
        promise.closed = status == "valid";
        promise.lines = held;
    }
    assert!(stored > 0, "all were killed too early to tell anything");
}
