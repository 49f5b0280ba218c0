//! The client of a controller at a port: resetting, asking, playing.

use std::time::{Duration, Instant};

use vimc4_catalogue::Handling;
use vimc4_conform::choice::Row;
use vimc4_conform::player::{Miss, Next, Player, Timing};
use vimc4_device::{Point, Time, escape};

use crate::failure::Failure;
use crate::port::{Port, PortError};

/// How long a controller may be unresponsive after a reset, beyond its profile's time.
const DEAF: Duration = Duration::from_secs(3);
/// How long an answer to a question may take.
const ANSWER: Duration = Duration::from_millis(400);
/// How long nothing must come until a line counts as quiet.
const PAUSE: Duration = Duration::from_millis(60);
/// How long to wait for a line to become quiet.
const NOISE: Duration = Duration::from_secs(2);

/// More than any controller sends without a pause, in bytes.
const LONGEST: usize = 1 << 20;
/// How much of meaningless input is shown.
const EXCERPT: usize = 24;

/// Why nothing more can be played.
#[derive(Debug)]
pub(super) enum ClientError {
    /// Nothing answers.
    Silent,
    /// What answers is not a controller.
    Garbage(Vec<u8>),
    /// What is sent comes back.
    Echo,
    /// It sends without a pause, such as this.
    Endless(Vec<u8>),
    /// Its counters do not match its position: the axes are here.
    Elsewhere(Vec<i64>),
    /// The port is gone, or an end was requested.
    Port(PortError),
}

impl From<PortError> for ClientError {
    fn from(error: PortError) -> ClientError {
        ClientError::Port(error)
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
    pub(super) fn find(&mut self) -> Result<Option<u32>, ClientError> {
        let found = self.find_speed()?;
        if self.handling.homing.is_some()
            && let Some(places) = self.places()?
            && places.iter().any(|place| *place != 0)
        {
            return Err(ClientError::Elsewhere(places));
        }
        Ok(found)
    }

    fn find_speed(&mut self) -> Result<Option<u32>, ClientError> {
        let first = match self.reset_within(Duration::ZERO) {
            Err(first @ (ClientError::Silent | ClientError::Garbage(_))) => first,
            other => return other.map(|()| None),
        };
        let Some(given) = self.port.baud() else { return Err(first) };
        for speed in self.handling.speeds.iter().copied().filter(|speed| *speed != given) {
            self.port.set_baud(speed)?;
            match self.reset_within(Duration::ZERO) {
                Ok(()) => return Ok(Some(speed)),
                Err(ClientError::Silent | ClientError::Garbage(_)) => {}
                Err(other) => return Err(other),
            }
        }
        Err(first)
    }

    /// Makes the controller as it is after power-on, as far as a reset does, and waits until it
    /// answers again.
    pub(super) fn reset(&mut self) -> Result<(), ClientError> {
        self.reset_within(self.handling.running)
    }

    /// Resets a controller that goes on with what it does for at most this time.
    fn reset_within(&mut self, running: Duration) -> Result<(), ClientError> {
        self.send(self.handling.reset)?;
        let deaf = Instant::now() + running + self.handling.boot + DEAF;
        self.quiet()?;
        let question = format!("{}\r", self.handling.position).into_bytes();
        let mut garbage = Vec::new();
        loop {
            let answer = self.ask(self.handling.position)?;
            if self.handling.read_position(&answer).is_some() {
                for line in self.handling.ready {
                    self.ask(line)?;
                }
                return Ok(());
            }
            if answer.starts_with(&question) {
                return Err(ClientError::Echo);
            }
            if !answer.is_empty() {
                garbage = answer;
                self.quiet()?;
            }
            if Instant::now() > deaf {
                return Err(match garbage.is_empty() {
                    true => ClientError::Silent,
                    false => ClientError::Garbage(garbage),
                });
            }
        }
    }

    /// Where the counters are; `None` if the controller does not say.
    pub(super) fn places(&mut self) -> Result<Option<Vec<i64>>, ClientError> {
        let answer = self.ask(self.handling.position)?;
        Ok(self.handling.read_position(&answer))
    }

    /// Sends lines that must each be carried out within `limit`; says whether they were.
    pub(super) fn obeys(&mut self, lines: &[&str], limit: Duration) -> Result<bool, ClientError> {
        for line in lines {
            self.send(format!("{line}\r").as_bytes())?;
            if self.answer(limit)? != self.handling.done {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Ends motions, as far as the line can.
    pub(super) fn abandon(&mut self, limit: Duration) -> Result<(), ClientError> {
        self.send(self.handling.abandon)?;
        self.answer(limit).map(drop)
    }

    /// Halts motions as the last act. A failure to send is ignored.
    pub(super) fn halt(&mut self) {
        let _ = self.port.send(self.handling.halt);
    }

    /// Moves the axes of a controller that has just been reset; says whether it did.
    pub(super) fn go(&mut self, by: Point, speed: u64) -> Result<bool, ClientError> {
        let lines = self.handling.moving(by, speed);
        let longest = by.iter().map(|way| way.unsigned_abs()).max().unwrap_or_default();
        // The partial moves follow one another, and each has its ramp.
        let limit = Duration::from_millis(4 * 1_000 * longest / speed.max(1)) + DEAF;
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        self.obeys(&lines, limit)
    }

    /// Plays a row.
    pub(super) fn play(&mut self, row: &Row) -> Result<Result<(), Miss>, ClientError> {
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
    fn ask(&mut self, line: &str) -> Result<Vec<u8>, ClientError> {
        self.send(format!("{line}\r").as_bytes())?;
        self.answer(ANSWER)
    }

    /// What comes, up to the first pause.
    fn answer(&mut self, limit: Duration) -> Result<Vec<u8>, ClientError> {
        let mut answer = Vec::new();
        let mut until = Instant::now() + limit;
        let end = until + NOISE;
        while let Some((_, bytes)) = self.next(until)? {
            answer.extend_from_slice(&bytes);
            let now = Instant::now();
            if now > end || answer.len() > LONGEST {
                answer.truncate(EXCERPT);
                return Err(ClientError::Endless(answer));
            }
            until = (now + PAUSE).min(end);
        }
        Ok(answer)
    }

    /// Discards everything that still arrives.
    fn quiet(&mut self) -> Result<(), ClientError> {
        self.answer(PAUSE).map(drop)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), ClientError> {
        if self.verbose {
            self.tell(Instant::now(), '>', bytes);
        }
        Ok(self.port.send(bytes)?)
    }

    fn next(&mut self, until: Instant) -> Result<Option<(Instant, Vec<u8>)>, ClientError> {
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

impl ClientError {
    /// What a person can do about it. `last` is the session that was being played.
    pub(super) fn failure(self, client: &Client, last: Option<&str>) -> Failure {
        let Client { port, handling, .. } = client;
        let (name, maker) = (port.name(), handling.model().family());

        let during = last.map_or_else(String::new, |last| format!(", during {last}"));
        let speed = port.baud().map_or_else(String::new, |_| {
            let speeds: Vec<String> = handling.speeds.iter().map(u32::to_string).collect();
            format!(" at {} baud", speeds.join(", "))
        });
        Failure::usage(match self {
            ClientError::Silent if last.is_some() => format!(
                "the controller at {name} has stopped answering{during}; it may be off, or hang: \
                 switch it off and on, and begin again with that session's name as filter"
            ),
            ClientError::Silent => format!(
                "nothing answers at {name}{speed}; check that it is the right port, that the \
                 controller is on, and that the cable is the right one: a crossed (null modem) \
                 cable where the controller needs it, with nobody else on it"
            ),
            ClientError::Garbage(bytes) => {
                let bytes = escape(bytes.get(..EXCERPT).unwrap_or(&bytes));
                match port.baud() {
                    Some(_) => format!(
                        "what answers at {name} makes no sense{during}: `{bytes}`; tried were \
                         {}: set the rate of the controller's jumper with --baud, and check that \
                         it is an {maker} controller",
                        speed.trim_start_matches(" at ")
                    ),
                    None => format!(
                        "what answers at {name} makes no sense{during}: `{bytes}`; it is no \
                         {maker} controller, or a serial line behind it has the wrong baud rate: \
                         try another rate ({}) where that line is opened",
                        handling.speeds.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
                    ),
                }
            }
            ClientError::Echo => format!(
                "{name} sends back what it is sent; switch the local echo of the adapter or the \
                 terminal server off, or remove the loop-back plug"
            ),
            ClientError::Endless(bytes) => format!(
                "what is at {name} never falls silent{during}: `{}` and so on; it is no {maker} \
                 controller, or runs a program that sends all the time, which STOP at its panel \
                 ends",
                escape(bytes.get(..EXCERPT).unwrap_or(&bytes)),
            ),
            ClientError::Port(PortError::Gone(why)) if last.is_none() => format!(
                "{name} was closed before anything was answered: {why}; another client may hold \
                 it, so close that one and try again"
            ),
            ClientError::Port(PortError::Gone(why)) => format!(
                "{name} is gone{during}: {why}; plug it in or start it again, and go on with that \
                 session's name as filter"
            ),
            ClientError::Elsewhere(places) => {
                let axes = handling.model().axis_names().iter().zip(&places);
                let places: Vec<String> =
                    axes.map(|(axis, place)| format!("{axis} {place}")).collect();
                format!(
                    "the axes of the controller at {name} are at {}, and the sessions count from \
                     0; bring them there with {}, and begin again",
                    places.join(", "),
                    handling.homing.unwrap_or_default()
                )
            }
            ClientError::Port(PortError::Interrupted) => {
                format!("interrupted{during}; {}", handling.halting)
            }
        })
    }
}
