//! Plays what a session sends through a port, and checks what comes back.
//!
//! Like a device, the [`Player`] knows neither the port nor a clock. The code that drives it asks
//! [`next`](Player::next) what to do, sends what is to be sent, and hands in what has arrived,
//! with the time. `rehearsal` drives it with a simulated port, `vimc4 conform` with a real one.

use vimc4_device::{Time, show_nanos};

use crate::play::{matches, show_expected};
use crate::script::{Expected, escape};

/// One thing to do or to see at a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortStep {
    /// The step of the session that it stands for.
    pub step: usize,
    /// What to do or see.
    pub act: Act,
    /// How long a controller needs for it, ns.
    pub takes: u64,
}

/// What is done or seen at a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Act {
    /// These bytes are sent; with `true` they start the stopwatch.
    Send(Vec<u8>, bool),
    /// This must come next. A time in it is checked with the [`Timing`]'s tolerance.
    Expect(Expected),
    /// Nothing comes for this time, ns, and nothing is left over from before.
    Quiet(u64),
    /// Time passes, ns.
    Wait(u64),
    /// Starts the stopwatch.
    Mark,
}

/// How long a player waits and how exact it is. A port is reached through cables, adapters and an
/// operating system, each of which may hold a byte for some milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// After this long without a byte, ns, nothing more will come.
    pub quiet: u64,
    /// How much longer than it needs a controller may take for an answer, ns.
    pub grace: u64,
    /// How much earlier or later than written an answer may come, ns.
    pub tolerance: u64,
}

impl Default for Timing {
    fn default() -> Timing {
        Timing { quiet: 100_000_000, grace: 2_000_000_000, tolerance: 50_000_000 }
    }
}

impl Timing {
    /// How much earlier or later than `at` nanoseconds something may come: a hundredth of the time
    /// is allowed for the crystal, which is generous.
    #[must_use]
    pub fn around(&self, at: u64) -> u64 {
        self.tolerance.max(at / 100)
    }
}

/// What the code that drives a player has to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next<'a> {
    /// Send these bytes and call [`Player::sent`].
    Send(&'a [u8]),
    /// Wait until this time, or until something has arrived; then ask again.
    Wait(Time),
    /// It is over: [`Player::outcome`] says how.
    Over,
}

/// What came instead of what was expected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Miss {
    /// The step of the session.
    pub step: usize,
    /// What must have come, for people.
    pub expected: String,
    /// What has come, for people.
    pub got: String,
    /// The bytes that have come and were not yet accounted for.
    pub bytes: Vec<u8>,
    /// When the right bytes came, ns on the stopwatch, if only their time is wrong.
    pub late: Option<u64>,
}

/// Plays one row of a session. See the [module](self).
#[derive(Clone, Debug)]
pub struct Player<'a> {
    steps: &'a [PortStep],
    timing: Timing,
    at: usize,
    /// When the present step began.
    began: Option<Time>,
    stopwatch: Time,
    received: Vec<(Time, u8)>,
    /// When the last byte came.
    last: Option<Time>,
    /// What is wrong, while the rest of what comes is still collected.
    wrong: Option<(String, Time)>,
    missed: Option<Miss>,
    /// When each expected reply was complete, by step of the session, ns on the stopwatch.
    times: Vec<(usize, u64)>,
}

impl<'a> Player<'a> {
    /// Plays these steps.
    #[must_use]
    pub fn new(steps: &'a [PortStep], timing: Timing) -> Player<'a> {
        Player {
            steps,
            timing,
            at: 0,
            began: None,
            stopwatch: Time::ZERO,
            received: Vec::new(),
            last: None,
            wrong: None,
            missed: None,
            times: Vec::new(),
        }
    }

    /// What is to be done now.
    pub fn next(&mut self, now: Time) -> Next<'a> {
        let steps = self.steps;
        loop {
            let Some(step) = steps.get(self.at).filter(|_| self.missed.is_none()) else {
                return Next::Over;
            };
            let began = *self.began.get_or_insert(now);
            if let Some((expected, since)) = &self.wrong {
                // What comes after the first wrong byte may say what it was.
                let quiet = self.last.unwrap_or(*since).max(*since).after_nanos(self.timing.quiet);
                if now < quiet && self.received.len() < MOST {
                    return Next::Wait(quiet);
                }
                self.miss(step.step, expected.clone(), None);
                continue;
            }
            let seen = match &step.act {
                Act::Send(bytes, _) => return Next::Send(bytes),
                Act::Mark => {
                    self.stopwatch = now;
                    Seen::Right(0)
                }
                Act::Wait(nanos) => match began.after_nanos(*nanos) {
                    until if now < until => Seen::NotYet(until),
                    _ => Seen::Right(0),
                },
                Act::Quiet(nanos) => match began.after_nanos(*nanos) {
                    _ if !self.received.is_empty() => Seen::Wrong("nothing more".to_owned()),
                    until if now < until => Seen::NotYet(until),
                    _ => Seen::Right(0),
                },
                Act::Expect(expected) => self.see(expected, step, began, now),
            };
            match seen {
                Seen::NotYet(until) => return Next::Wait(until),
                Seen::Right(length) => {
                    self.received.drain(..length);
                    self.advance();
                }
                Seen::Wrong(expected) => self.wrong = Some((expected, now)),
                Seen::Late(expected, at) => self.miss(step.step, expected, Some(at)),
            }
        }
    }

    /// The bytes of [`Next::Send`] have been sent.
    pub fn sent(&mut self, now: Time) {
        if let Some(PortStep { act: Act::Send(_, true), .. }) = self.steps.get(self.at) {
            self.stopwatch = now;
        }
        self.advance();
    }

    /// Bytes have arrived.
    pub fn received(&mut self, bytes: &[u8], at: Time) {
        self.received.extend(bytes.iter().map(|&byte| (at, byte)));
        if !bytes.is_empty() {
            self.last = Some(at);
        }
    }

    /// How it went: when each expected reply was complete, as step of the session and
    /// nanoseconds on the stopwatch.
    ///
    /// # Errors
    ///
    /// The first deviation.
    pub fn outcome(self) -> Result<Vec<(usize, u64)>, Miss> {
        match self.missed {
            None => Ok(self.times),
            Some(miss) => Err(miss),
        }
    }

    fn advance(&mut self) {
        self.at += 1;
        self.began = None;
    }

    fn see(&mut self, expected: &Expected, step: &PortStep, began: Time, now: Time) -> Seen {
        let bytes: Vec<u8> = self.received.iter().map(|(_, byte)| *byte).collect();
        let deadline = began.after_nanos(step.takes + step.takes / 20 + self.timing.grace);
        let length = match expected.parts.as_slice() {
            [literal] => {
                let length = literal.len().min(bytes.len());
                if literal[..length] != bytes[..length] {
                    return Seen::Wrong(show_expected(expected));
                }
                if length < literal.len() {
                    return match now < deadline {
                        true => Seen::NotYet(deadline),
                        false => Seen::Wrong(show_expected(expected)),
                    };
                }
                length
            }
            // The dots stand for anything, so only silence shows that it is complete.
            parts => {
                let from = began.after_nanos(step.takes);
                let quiet = self.last.map_or(from, |last| last.max(from));
                let quiet = quiet.after_nanos(self.timing.quiet);
                if now < quiet {
                    return Seen::NotYet(quiet);
                }
                if !matches(parts, &bytes) {
                    return match bytes.is_empty() && now < deadline {
                        true => Seen::NotYet(deadline),
                        false => Seen::Wrong(show_expected(expected)),
                    };
                }
                bytes.len()
            }
        };
        if expected.max.is_some_and(|max| length > max) {
            return Seen::Wrong(show_expected(expected));
        }
        let at = length.checked_sub(1).and_then(|last| self.received.get(last));
        let at = at.map_or(0, |(time, _)| time.nanos_since(self.stopwatch));
        self.times.push((step.step, at));
        match expected.at {
            Some((wanted, off)) if at.abs_diff(wanted) > off + self.timing.around(wanted) => {
                let tolerance = show_nanos(self.timing.around(wanted));
                let text = format!("{}, to {tolerance} on a port", show_expected(expected));
                Seen::Late(text, at)
            }
            _ => Seen::Right(length),
        }
    }

    fn miss(&mut self, step: usize, expected: String, late: Option<u64>) {
        let bytes: Vec<u8> = self.received.iter().map(|(_, byte)| *byte).collect();
        let got = match (late, self.received.first()) {
            (Some(at), _) => format!("{} at {}", escape(&bytes), rounded(at)),
            (None, Some((first, _))) => {
                let at = first.nanos_since(self.stopwatch);
                format!("{} at {}", escape(&bytes), rounded(at))
            }
            (None, None) => "nothing".to_owned(),
        };
        self.missed = Some(Miss { step, expected, got, bytes, late });
    }
}

/// More than this is not an answer but a stream.
const MOST: usize = 4_096;

/// What has come of a step.
enum Seen {
    /// It takes more time, up to this one.
    NotYet(Time),
    /// This many bytes are as expected.
    Right(usize),
    /// This must have come.
    Wrong(String),
    /// This must have come, and came at another time, ns on the stopwatch.
    Late(String, u64),
}

/// To the millisecond: a port shows no more.
fn rounded(nanos: u64) -> String {
    show_nanos(nanos / 1_000_000 * 1_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::script::{Action, parse_line};

    /// The steps of a script at a port.
    fn steps(script: &str) -> Vec<PortStep> {
        let actions = script.lines().flat_map(|line| parse_line(line).unwrap());
        let act = |action| match action {
            Action::Send(bytes) => Act::Send(bytes, true),
            Action::Expect(expected) => Act::Expect(expected),
            Action::Wait(nanos) => Act::Wait(nanos),
            Action::Silent(nanos) => Act::Quiet(nanos),
            other => panic!("{other:?} is not for a port"),
        };
        let steps = actions.enumerate();
        steps.map(|(step, action)| PortStep { step, act: act(action), takes: 0 }).collect()
    }

    /// Plays against a peer that sends these bytes at these times, ms, whatever is asked.
    fn play(script: &str, sent: &[(u64, &str)]) -> Result<Vec<(usize, u64)>, Miss> {
        let steps = steps(script);
        let mut player = Player::new(&steps, Timing::default());
        let mut sent = sent.iter().map(|(at, bytes)| (Time::from_millis(*at), bytes)).peekable();
        let mut now = Time::ZERO;
        loop {
            match player.next(now) {
                Next::Send(_) => player.sent(now),
                Next::Wait(until) => {
                    assert!(until > now, "it would go round and round");
                    now = match sent.next_if(|(at, _)| *at <= until) {
                        Some((at, bytes)) => {
                            player.received(bytes.as_bytes(), at);
                            at
                        }
                        None => until,
                    };
                }
                Next::Over => return player.outcome(),
            }
        }
    }

    #[test]
    fn an_answer_may_come_in_pieces_and_a_little_late() {
        let script = "> @0P -> 000 at 1s\n< 0";
        let played = play(script, &[(990, "0"), (1_000, "0"), (1_049, "00")]);
        assert_eq!(played, Ok(vec![(1, 1_049_000_000), (2, 1_049_000_000)]));
        let late = play(script, &[(1_060, "0000")]).unwrap_err();
        assert_eq!((late.step, late.late), (1, Some(1_060_000_000)));
        assert_eq!(late.expected, "000 at 1s, to 50ms on a port");
        assert_eq!(late.got, "0000 at 1.06s");
    }

    #[test]
    fn a_wrong_answer_is_shown_whole_and_none_at_all_is_said() {
        let wrong = play("> @01 -> 0", &[(3, "5"), (60, "?!")]).unwrap_err();
        assert_eq!((wrong.bytes.as_slice(), wrong.got.as_str()), (&b"5?!"[..], "5?! at 3ms"));
        let missing = play("> @0P -> 000", &[(3, "00")]).unwrap_err();
        assert_eq!((missing.bytes.as_slice(), missing.late), (&b"00"[..], None));
        assert_eq!(play("> @01 -> 0", &[]).unwrap_err().got, "nothing");
    }

    #[test]
    fn silence_is_broken_by_what_comes_and_by_what_was_left_over() {
        assert!(play("> @01 -> 0\nsilent 200ms", &[(3, "0"), (204, "0")]).is_ok());
        let more = play("> @01 -> 0\nsilent 200ms", &[(3, "0"), (202, "0")]).unwrap_err();
        assert_eq!((more.step, more.expected.as_str()), (2, "nothing more"));
        assert_eq!(play("> @01 -> 0\nsilent 1ms", &[(3, "00")]).unwrap_err().bytes, b"0");
    }

    #[test]
    fn dots_take_what_comes_until_nothing_does() {
        let script = "> @0V -> ...\\r\\n0 max 20";
        assert!(play(script, &[(3, "one\r\n"), (90, "two\r\n0")]).is_ok());
        assert_eq!(play(script, &[(3, "one\r\n0"), (90, "x")]).unwrap_err().bytes, b"one\r\n0x");
        assert!(play(script, &[(3, "one, which is too long\r\n0")]).is_err());
        assert!(play("> @0V -> ...", &[]).is_ok());
    }
}
