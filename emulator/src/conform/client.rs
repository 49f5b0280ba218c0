//! The client of a controller at a port: resetting, asking, playing.

use std::time::{Duration, Instant};

use vimc4::{Handling, Point, Time, escape};
use vimc4_conform::choice::Row;
use vimc4_conform::player::{Miss, Next, Player, Timing};

use crate::failure::Failure;
use crate::port::{Port, PortError};

/// How long a controller may be deaf after a reset, beyond what its profile says.
const DEAF: Duration = Duration::from_secs(3);
/// How long an answer to a question may take.
const ANSWER: Duration = Duration::from_millis(400);
/// How long nothing may come until a line counts as quiet.
const PAUSE: Duration = Duration::from_millis(60);
/// How long a line is waited for to become quiet.
const NOISE: Duration = Duration::from_secs(2);
/// The speeds that are tried where the one that was given does not work.
const SPEEDS: [u32; 3] = [19_200, 9_600, 38_400];

/// Why nothing more can be played.
#[derive(Debug)]
pub(super) enum Trouble {
    /// Nothing answers.
    Silent,
    /// What answers is no controller.
    Garbage(Vec<u8>),
    /// What is sent comes back.
    Echo,
    /// The port is gone, or somebody has asked for an end.
    Port(PortError),
}

impl From<PortError> for Trouble {
    fn from(error: PortError) -> Trouble {
        Trouble::Port(error)
    }
}

/// A controller as a client sees it.
pub(super) struct Client {
    port: Port,
    handling: Handling,
    timing: Timing,
    began: Instant,
    verbose: bool,
}

impl Client {
    pub(super) fn new(port: Port, handling: Handling, timing: Timing, verbose: bool) -> Client {
        Client { port, handling, timing, began: Instant::now(), verbose }
    }

    pub(super) fn port(&self) -> &Port {
        &self.port
    }

    /// Finds the controller, if need be at another speed of the line. Says at which, if so.
    pub(super) fn find(&mut self) -> Result<Option<u32>, Trouble> {
        let first = match self.reset() {
            Err(first @ (Trouble::Silent | Trouble::Garbage(_))) => first,
            other => return other.map(|()| None),
        };
        let Some(given) = self.port.baud() else { return Err(first) };
        for speed in SPEEDS.into_iter().filter(|speed| *speed != given) {
            self.port.set_baud(speed)?;
            match self.reset() {
                Ok(()) => return Ok(Some(speed)),
                Err(Trouble::Silent | Trouble::Garbage(_)) => {}
                Err(other) => return Err(other),
            }
        }
        Err(first)
    }

    /// Makes the controller as it is after power-on, and waits until it answers again.
    pub(super) fn reset(&mut self) -> Result<(), Trouble> {
        self.send(&[self.handling.reset])?;
        let deaf = Instant::now() + self.handling.boot + DEAF;
        self.quiet()?;
        let question = format!("{}\r", self.handling.position).into_bytes();
        let mut garbage = Vec::new();
        loop {
            let answer = self.ask(self.handling.position)?;
            if self.handling.read_position(&answer).is_some() {
                return Ok(());
            }
            if answer.starts_with(&question) {
                return Err(Trouble::Echo);
            }
            if !answer.is_empty() {
                garbage = answer;
                self.quiet()?;
            }
            if Instant::now() > deaf {
                return Err(match garbage.is_empty() {
                    true => Trouble::Silent,
                    false => Trouble::Garbage(garbage),
                });
            }
        }
    }

    /// Where the counters are; `None` if the controller does not say.
    pub(super) fn places(&mut self) -> Result<Option<Vec<i64>>, Trouble> {
        let answer = self.ask(self.handling.position)?;
        Ok(self.handling.read_position(&answer))
    }

    /// Sends lines that must each be answered `0`, within `patience`; says whether they were.
    pub(super) fn obeys(&mut self, lines: &[&str], patience: Duration) -> Result<bool, Trouble> {
        for line in lines {
            self.send(format!("{line}\r").as_bytes())?;
            if self.answer(patience)? != b"0" {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Ends whatever still moves, along its ramp.
    pub(super) fn abandon(&mut self, patience: Duration) -> Result<(), Trouble> {
        self.send(&[self.handling.abandon])?;
        self.answer(patience).map(drop)
    }

    /// Halts whatever moves, as the last thing that is done. What cannot be sent cannot be.
    pub(super) fn halt(&mut self) {
        let _ = self.port.send(&[self.handling.halt]);
    }

    /// Moves the axes of a controller that has just been reset; says whether it did.
    pub(super) fn go(&mut self, by: Point, speed: u64) -> Result<bool, Trouble> {
        let lines = self.handling.moving(by, speed);
        let longest = by.iter().map(|way| way.unsigned_abs()).max().unwrap_or_default();
        // The partial moves follow one another, and each has its ramp.
        let patience = Duration::from_millis(4 * 1_000 * longest / speed.max(1)) + DEAF;
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        self.obeys(&lines, patience)
    }

    /// Plays a row.
    pub(super) fn play(&mut self, row: &Row) -> Result<Result<(), Miss>, Trouble> {
        let mut player = Player::new(&row.steps, self.timing);
        loop {
            match player.next(self.now()) {
                Next::Send(bytes) => {
                    self.send(bytes)?;
                    player.sent(self.now());
                }
                Next::Wait(until) => {
                    let until = self.began + Duration::from_nanos(until.as_nanos());
                    if let Some((at, bytes)) = self.next(until)? {
                        player.received(&bytes, self.time(at));
                    }
                }
                Next::Over => return Ok(player.outcome().map(drop)),
            }
        }
    }

    /// Asks something and says what comes.
    fn ask(&mut self, line: &str) -> Result<Vec<u8>, Trouble> {
        self.send(format!("{line}\r").as_bytes())?;
        self.answer(ANSWER)
    }

    /// What comes, up to the first pause.
    fn answer(&mut self, patience: Duration) -> Result<Vec<u8>, Trouble> {
        let mut answer = Vec::new();
        let mut until = Instant::now() + patience;
        let end = until + NOISE;
        while let Some((_, bytes)) = self.next(until)? {
            answer.extend_from_slice(&bytes);
            until = (Instant::now() + PAUSE).min(end);
        }
        Ok(answer)
    }

    /// Lets everything pass that still comes.
    fn quiet(&mut self) -> Result<(), Trouble> {
        self.answer(PAUSE).map(drop)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), Trouble> {
        if self.verbose {
            self.tell(Instant::now(), '>', bytes);
        }
        Ok(self.port.send(bytes)?)
    }

    fn next(&mut self, until: Instant) -> Result<Option<(Instant, Vec<u8>)>, Trouble> {
        let next = self.port.next(until)?;
        if let (true, Some((at, bytes))) = (self.verbose, &next) {
            self.tell(*at, '<', bytes);
        }
        Ok(next)
    }

    fn tell(&self, at: Instant, way: char, bytes: &[u8]) {
        let at = at.saturating_duration_since(self.began).as_secs_f64();
        eprintln!("{at:13.3} s  {way} {}", escape(bytes));
    }

    fn now(&self) -> Time {
        self.time(Instant::now())
    }

    fn time(&self, at: Instant) -> Time {
        Time::ZERO + at.saturating_duration_since(self.began)
    }
}

impl Trouble {
    /// What a person can do about it. `last` is the session that was being played.
    pub(super) fn failure(self, port: &Port, last: Option<&str>) -> Failure {
        let name = port.name();
        let during = last.map_or_else(String::new, |last| format!(", during {last}"));
        let speed = port.baud().map_or_else(String::new, |_| {
            let speeds = SPEEDS.map(|speed| speed.to_string()).join(", ");
            format!(" at {speeds} baud")
        });
        Failure::usage(match self {
            Trouble::Silent if last.is_some() => format!(
                "the controller at {name} has stopped answering{during}; it may be off, or hang: \
                 switch it off and on, and begin again with that session's name as filter"
            ),
            Trouble::Silent => format!(
                "nothing answers at {name}{speed}; check that it is the right port, that the \
                 controller is on, and that the cable is the right one: a crossed (null modem) \
                 cable where the controller needs it, with nobody else on it"
            ),
            Trouble::Garbage(bytes) => {
                let bytes = escape(bytes.get(..24).unwrap_or(&bytes));
                match port.baud() {
                    Some(_) => format!(
                        "what answers at {name} makes no sense{during}: `{bytes}`; tried were \
                         {}: set the rate of the controller's jumper with --baud, and check that \
                         it is an isel controller",
                        speed.trim_start_matches(" at ")
                    ),
                    None => format!(
                        "what answers at {name} makes no sense{during}: `{bytes}`; it is no isel \
                         controller, or a serial line behind it has the wrong baud rate: try the \
                         other rate (9600, 19200) where that line is opened"
                    ),
                }
            }
            Trouble::Echo => format!(
                "{name} sends back what it is sent; switch the local echo of the adapter or the \
                 terminal server off, or remove the loop-back plug"
            ),
            Trouble::Port(PortError::Gone(why)) if last.is_none() => format!(
                "{name} was closed before anything was answered: {why}; another client may hold \
                 it, so close that one and try again"
            ),
            Trouble::Port(PortError::Gone(why)) => format!(
                "{name} is gone{during}: {why}; plug it in or start it again, and go on with that \
                 session's name as filter"
            ),
            Trouble::Port(PortError::Interrupted) => format!(
                "interrupted{during}; 253 was sent, so that a motion brakes along its ramp: 254 \
                 or switching off makes the controller forget the rest of it"
            ),
        })
    }
}
