//! A process that is killed while it writes its flash file.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{ExitCode, Stdio};
use std::thread;
use std::time::Duration;

use vimc4::isel::ProgramStatus;
use vimc4::{Clock, Emulator};

use crate::limits::{EndsInTime, InTime, Timed};
use crate::tools::{ask, in_role};

pub(crate) const TESTS: &[(&str, fn())] =
    &[("kill: what was answered 0 survives a kill at any moment", killed_while_storing)];

pub(crate) const ROLE: &str = "store until killed";

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

/// Stores programs and settings one after the other until it is killed, and says what was
/// answered `0`.
pub(crate) fn store_until_killed() -> ExitCode {
    let flash = std::env::var_os(FLASH).unwrap();
    let attempt = std::env::var(ATTEMPT).unwrap().parse().unwrap();
    let emulator = with_flash(Path::new(&flash));
    let mut port = emulator.connect().unwrap();
    let say = |what: String| std::io::stderr().write_all(what.as_bytes()).unwrap();
    assert_eq!(ask(&mut port, "@07", 1), "0");
    for round in 0.. {
        assert_eq!(ask(&mut port, &format!("@0IU{}", name(attempt, round)), 1), "0");
        say(format!("name {round}\n"));
        assert_eq!(ask(&mut port, "@0IW", 1), "0");
        say(format!("named {round}\n"));
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
    ExitCode::SUCCESS
}

/// What the user calls the controller, which is kept with the settings.
fn name(attempt: usize, round: usize) -> String {
    format!("bench {attempt} {round}")
}

/// What the controller says that it is called.
fn name_of(emulator: &Emulator) -> String {
    let mut port = emulator.connect().unwrap();
    let mut said = ask(&mut port, "@0U", 1);
    while !said.ends_with('\n') {
        let mut byte = [0];
        port.read_exact(&mut byte).unwrap();
        said.push(char::from(byte[0]));
    }
    said
}

/// What the flash file must hold.
#[derive(Debug, Default)]
struct Promise {
    lines: Vec<String>,
    /// The name that was written, and the one that was under way.
    name: Option<String>,
    next_name: Option<String>,
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
        self.next_name = None;
        self.erasing = false;
        let mut round = 0;
        for line in said.lines() {
            let (word, number) = line.split_once(' ').unwrap_or((line, "0"));
            let number: usize = number.parse().unwrap();
            match word {
                "name" => self.next_name = Some(name(attempt, number)),
                "named" => self.name = self.next_name.take(),
                "erase" => self.erasing = true,
                "empty" => {
                    round = number;
                    let name = self.name.take();
                    *self = Promise { name, ..Promise::default() };
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

    fn check(&self, held: &[String], status: Option<ProgramStatus>, called: &str) {
        let is = |name: &Option<String>| name.as_ref().is_some_and(|name| called.contains(name));
        assert!(
            is(&self.name) || is(&self.next_name) || self.name.is_none(),
            "it is called {called:?} and not {:?}",
            self.name
        );
        if self.erasing && held.is_empty() {
            return;
        }
        let (kept, beyond) = held.split_at_checked(self.lines.len()).unwrap_or((held, &[]));
        assert_eq!(kept, self.lines, "what was answered 0 is lost");
        assert!(beyond.len() <= 1, "{beyond:?}");
        assert_eq!(beyond.first().or(self.next.as_ref()), self.next.as_ref());
        let valid = status == Some(ProgramStatus::Valid);
        assert!(!self.closed || valid, "the end of the program is lost: {status:?}");
    }
}

fn killed_while_storing() {
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    let mut promise = Promise::default();
    let mut stored = 0;
    for attempt in 1..=200 {
        let mut child = in_role(ROLE)
            .env(FLASH, &flash)
            .env(ATTEMPT, attempt.to_string())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .start()
            .unwrap();
        let mut errors = BufReader::new(Timed::new("standard error", child.stderr.take().unwrap()));
        let mut said = String::new();
        // Most are killed at work, some while they begin.
        if attempt % 5 != 0 {
            errors.read_line(&mut said).unwrap();
        }
        // Moments spread over 1 to 60 ms, in no order; where in its work they hit is chance.
        let moment = 1_000 + attempt * 21_911 % 59_000;
        thread::sleep(Duration::from_micros(u64::try_from(moment).unwrap()));
        child.kill().unwrap();
        let status = child.wait_in_time().unwrap();
        errors.read_to_string(&mut said).unwrap();
        assert_eq!(status.signal(), Some(9), "it ended by itself: {said}");
        stored += said.lines().filter(|line| line.starts_with("stored")).count();
        promise.note(attempt, &said);
        let emulator = with_flash(&flash);
        let program = emulator.view().unwrap().details.program().cloned();
        let status = program.as_ref().map(|program| program.status);
        let held = program.map(|program| program.lines).unwrap_or_default();
        let called = name_of(&emulator);
        promise.check(&held, status, &called);
        // What is held now is what the next one begins with.
        promise.closed = status == Some(ProgramStatus::Valid);
        promise.lines = held;
        if let Some(next) = promise.next_name.take().filter(|next| called.contains(next)) {
            promise.name = Some(next);
        }
    }
    assert!(stored > 0, "all were killed too early to tell anything");
}
