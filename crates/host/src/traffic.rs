//! The conversation as people read it.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use vimc4_device::{Grouped, Time};
use vimc4_journal::words;
use vimc4_session::{Talk, Teller};

use crate::{EventFilter, LineEvent, Report, Sink, Verbosity};

/// A sink that writes lines of text:
///
/// ```text
///     1.250000 s  @0A 5000,900  relative move X +5,000 steps at 900 Hz
///     6.850000 s  0  after 5.6 s
/// ```
///
/// The lines go to a function, one at a time and without their ends; it must not block.
pub struct Traffic<F> {
    talk: Talk,
    pen: Pen<F>,
}

/// Writes every line, but of a flood of warnings only a few.
struct Pen<F> {
    write: F,
    floods: SuppressedWarnings,
    /// How long a warning stands for those of its kind.
    respite: Duration,
}

/// The warnings that a [`Traffic`] leaves out. It says how many with the next one or when a client closes;
/// who looks here when it is time says it then.
#[derive(Clone, Debug, Default)]
pub struct SuppressedWarnings(Arc<Mutex<Vec<Flood>>>);

impl SuppressedWarnings {
    /// How long after a line about a warning to look here.
    pub const DELAY: Duration = Duration::from_millis(1_500);

    /// By kind and transport. A panic elsewhere leaves them as they are.
    fn lock(&self) -> MutexGuard<'_, Vec<Flood>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The lines about those that no other one has followed, and when to look again; nothing if a line
    /// about a warning comes before.
    #[must_use]
    pub fn overdue(&self) -> (Vec<String>, Option<Instant>) {
        let (now, mut floods) = (Instant::now(), self.lock());
        let over = floods.iter_mut().filter(|flood| now >= flood.told + Self::DELAY);
        let lines = over.filter_map(|flood| {
            let text = flood.settle(now)?;
            Some(words::line(flood.at, format_args!("{text}")))
        });
        let lines = lines.collect();
        let due = floods.iter().map(|flood| flood.told + Self::DELAY);
        (lines, due.filter(|due| *due > now).min())
    }
}

/// Warnings of one kind about one transport that come one after the other.
#[derive(Clone, Debug)]
struct Flood {
    /// Of which kind they are, in words.
    kind: &'static str,
    /// The transport.
    about: String,
    /// When the last one was told, on the wall: the controller's time may stand still, or leap.
    told: Instant,
    /// When the last one came, by the controller's time.
    at: Time,
    /// How many were not told since then.
    left_out: u64,
    /// Of how many bytes those were that are about bytes.
    bytes: u64,
    /// When their number was told last although no other one came.
    settled: Option<Instant>,
}

/// Of each kind of warning about a transport no more than one is told in this time.
const RESPITE: Duration = Duration::from_secs(1);

impl Flood {
    /// How many were left out, of how many bytes: they are told now.
    fn take(&mut self) -> (u64, u64) {
        (std::mem::take(&mut self.left_out), std::mem::take(&mut self.bytes))
    }

    /// Says how many were left out, if any were.
    fn settle(&mut self, now: Instant) -> Option<String> {
        if self.left_out == 0 {
            return None;
        }
        self.settled = Some(now);
        let (many, bytes) = self.take();
        let Flood { kind, about, .. } = self;
        let about = if about.is_empty() { String::new() } else { format!("{about}: ") };
        let (bytes, were) = (of_bytes(bytes), if many == 1 { "was" } else { "were" });
        Some(format!("{about}{many} more{bytes} {were} left out: {kind}"))
    }
}

impl<F: FnMut(String) + Send> Traffic<F> {
    /// Writes the conversation by calling `write`.
    pub fn new(verbosity: Verbosity, write: F) -> Traffic<F> {
        let pen = Pen { write, floods: SuppressedWarnings::default(), respite: RESPITE };
        Traffic { talk: Talk::new(verbosity), pen }
    }

    /// What it leaves out, for who says so in time.
    pub fn suppressed(&self) -> SuppressedWarnings {
        self.pen.floods.clone()
    }
}

impl<F: FnMut(String) + Send> Teller for Pen<F> {
    fn line(&mut self, at: Time, text: fmt::Arguments<'_>) {
        (self.write)(words::line(at, text));
    }

    /// Tells a warning, unless one of its kind and about the same transport has just been told:
    /// then it is counted, with the bytes that it is about, and not even put into words.
    fn warn(
        &mut self,
        at: Time,
        kind: &'static str,
        transport: &str,
        bytes: u64,
        text: fmt::Arguments<'_>,
    ) {
        let now = Instant::now();
        let Pen { write, floods, respite } = self;
        let mut floods = floods.lock();
        let mut line = |text: fmt::Arguments<'_>| write(words::line(at, text));
        let place =
            floods.binary_search_by(|flood| (flood.kind, &*flood.about).cmp(&(kind, transport)));
        let flood = match place {
            Ok(place) => &mut floods[place],
            Err(place) => {
                let about = transport.to_owned();
                let flood =
                    Flood { kind, about, told: now, at, left_out: 0, bytes: 0, settled: None };
                floods.insert(place, flood);
                return line(text);
            }
        };
        if now.duration_since(flood.told) < *respite {
            flood.at = at;
            flood.left_out += 1;
            flood.bytes = flood.bytes.saturating_add(bytes);
            return;
        }
        flood.told = now;
        match flood.take() {
            (0, _) => line(text),
            (many, bytes) => {
                let (bytes, were) = (of_bytes(bytes), if many == 1 { "was" } else { "were" });
                line(format_args!("{text} ({many} of the kind{bytes} {were} left out before)"));
            }
        }
    }
}

impl<F: FnMut(String) + Send> Pen<F> {
    /// Says how many warnings about a transport were left out that nothing has been said of yet.
    /// A client that comes and goes all the time gets no more lines by that.
    fn settle(&mut self, at: Time, transport: &str) {
        let now = Instant::now();
        self.settle_if(at, |flood, respite| {
            let concerns = flood.about.is_empty() || flood.about == transport;
            concerns && flood.settled.is_none_or(|told| now.duration_since(told) >= respite)
        });
    }

    fn settle_if(&mut self, at: Time, which: impl Fn(&Flood, Duration) -> bool) {
        let Pen { write, floods, respite } = self;
        let now = Instant::now();
        for flood in floods.lock().iter_mut().filter(|flood| which(flood, *respite)) {
            if let Some(text) = flood.settle(now) {
                write(words::line(at, format_args!("{text}")));
            }
        }
    }
}

impl<F: FnMut(String) + Send> Sink for Traffic<F> {
    fn wants(&self) -> EventFilter {
        self.talk.wants()
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        match report.news() {
            Some(LineEvent::Closed { transport, .. }) => self.pen.settle(report.at, transport),
            Some(LineEvent::Ends) => self.pen.settle_if(report.at, |_, _| true),
            _ => {}
        }
        self.talk.tell(report, explain, &mut self.pen);
    }
}

impl<F> fmt::Debug for Traffic<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verbosity = self.talk.verbosity();
        f.debug_struct("Traffic").field("verbosity", &verbosity).finish_non_exhaustive()
    }
}

/// ` of 5 bytes`, where it is about bytes.
fn of_bytes(bytes: u64) -> String {
    match bytes {
        0 => String::new(),
        1 => " of 1 byte".to_owned(),
        bytes => format!(" of {} bytes", Grouped(i64::try_from(bytes).unwrap_or(i64::MAX))),
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::num::NonZeroU64;
    use std::sync::mpsc;

    use bytes::Bytes;
    use vimc4_device::{CommandNumber, Event, Warning};

    use super::*;
    use crate::ReportKind;

    fn happened(at: Time, event: Event) -> Report {
        let what = ReportKind::Event { command: None, event };
        Report { controller: "1".into(), at, what }
    }

    fn news(at: Time, news: LineEvent) -> Report {
        Report { controller: "1".into(), at, what: ReportKind::News(news) }
    }

    fn belongs(number: u64, at: Time, event: Event) -> Report {
        let command = NonZeroU64::new(number).map(CommandNumber);
        Report {
            what: ReportKind::Event { command, event },
            ..happened(at, Event::Baud { baud: 0 })
        }
    }

    #[test]
    fn an_answer_to_an_earlier_command_names_it() {
        let (sender, lines) = mpsc::channel();
        let mut traffic =
            Traffic::new(Verbosity::Conversation, move |line| sender.send(line).unwrap());
        let mut tell = |report| traffic.report(&report, &|_| "does".to_owned());
        let command = |number, ms, text: &'static str| {
            let bytes = Bytes::from_static(text.as_bytes());
            belongs(number, Time::from_millis(ms), Event::Command { mnemonic: "!".into(), bytes })
        };
        let answer = |number, ms, why: Option<&str>| {
            let bytes = Bytes::from_static(b"C\r");
            let why = why.map(Into::into);
            belongs(
                number,
                Time::from_millis(ms),
                Event::Answer { mnemonic: "!".into(), bytes, why },
            )
        };
        tell(command(1, 0, "!GB"));
        // However many are asked meanwhile.
        for number in 2..200 {
            tell(command(number, 1, "!ON0"));
            tell(answer(number, 1, None));
        }
        tell(answer(1, 200, None));
        tell(answer(1, 300, Some("late")));
        tell(answer(0, 400, Some("of no command")));
        let told: Vec<_> = lines.try_iter().map(|line| line[17..].to_owned()).collect();
        assert_eq!(
            told[told.len() - 4..],
            [
                "C\\r  at once",
                "C\\r  to !GB, after 200 ms",
                "C\\r  to !GB: late",
                "C\\r  of no command"
            ]
        );
    }

    #[test]
    fn a_conversation_reads_as_people_speak() {
        let (sender, lines) = mpsc::channel();
        let mut traffic =
            Traffic::new(Verbosity::Conversation, move |line| sender.send(line).unwrap());
        let explain = |_: &[u8]| "relative move X +5,000 steps at 900 Hz".to_owned();
        let mut tell = |report| traffic.report(&report, &explain);
        let began = Time::from_millis(1_250);
        tell(belongs(
            1,
            began,
            Event::Command { mnemonic: "@A".into(), bytes: Bytes::from_static(b"@0A 5000,900") },
        ));
        tell(belongs(
            1,
            began + Duration::from_millis(5_555),
            Event::Answer { mnemonic: "@A".into(), bytes: Bytes::from_static(b"0"), why: None },
        ));
        let (code, why) = (Bytes::from_static(b"2"), Some("limit switch X+ at step 24,001".into()));
        let refused = Event::Answer { mnemonic: "@A".into(), bytes: code, why };
        tell(belongs(1, Time::from_secs(7), refused.clone()));
        let command = Event::Command { mnemonic: "@A".into(), bytes: Bytes::from_static(b"@0A5") };
        tell(belongs(2, Time::from_secs(7), command));
        tell(belongs(2, Time::from_secs(7), refused));
        let echo =
            Event::Answer { mnemonic: "!ON".into(), bytes: Bytes::from_static(b"C"), why: None };
        tell(belongs(2, Time::from_secs(7), echo));
        tell(happened(Time::from_secs(7), Event::Warning(Warning::NobodyListens { lost: 1 })));
        assert_eq!(
            lines.try_iter().collect::<Vec<_>>(),
            [
                "     1.250000 s  @0A 5000,900  relative move X +5,000 steps at 900 Hz",
                "     6.805000 s  0  after 5.6 s",
                "     7.000000 s  2  limit switch X+ at step 24,001",
                "     7.000000 s  @0A5  relative move X +5,000 steps at 900 Hz",
                "     7.000000 s  2  at once: limit switch X+ at step 24,001",
                "     7.000000 s  C",
                "     7.000000 s  warning: nobody has the line open, 1 byte was lost",
            ]
        );
    }

    #[test]
    fn a_flood_is_one_line_and_a_number() {
        let (sender, lines) = mpsc::channel();
        let mut traffic = Traffic::new(Verbosity::Warnings, move |line| sender.send(line).unwrap());
        // However slow the computer is.
        traffic.pen.respite = Duration::from_secs(3_600);
        let explain = |_: &[u8]| String::new();
        let (transport, client) = (std::sync::Arc::from("pty"), "a client".to_owned());
        for ms in 0..2_000 {
            let at = Time::from_millis(ms);
            let warning = Warning::NoEffect { what: "half a turn".into() };
            traffic.report(&happened(at, Event::Warning(warning)), &explain);
        }
        let other = Warning::ReceiveOverflow { lost: 1 };
        traffic.report(&happened(Time::from_secs(3), Event::Warning(other)), &explain);
        let end = LineEvent::Closed { transport, client, observes: false, taken_by: None };
        traffic.report(&news(Time::from_secs(4), end), &explain);
        assert_eq!(
            lines.try_iter().collect::<Vec<_>>(),
            [
                "     0.000000 s  warning: no effect: half a turn",
                "     3.000000 s  warning: the receive buffer was full, 1 byte was lost",
                "     4.000000 s  1999 more were left out: commands without effect",
            ]
        );
    }

    #[test]
    fn what_is_left_out_is_not_put_into_words() {
        struct Words<'a>(&'a Cell<u32>);
        impl fmt::Display for Words<'_> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.set(self.0.get() + 1);
                f.write_str("words")
            }
        }
        let mut traffic = Traffic::new(Verbosity::Warnings, |_| {});
        traffic.pen.respite = Duration::from_secs(3_600);
        let made = Cell::new(0);
        for _ in 0..100 {
            traffic.pen.warn(Time::ZERO, "a kind", "pty", 0, format_args!("{}", Words(&made)));
        }
        assert_eq!(made.get(), 1);
    }

    #[test]
    fn what_came_while_the_power_was_off_is_said_at_any_verbosity() {
        for verbosity in [Verbosity::Warnings, Verbosity::Conversation] {
            let (sender, lines) = mpsc::channel();
            let mut traffic = Traffic::new(verbosity, move |line| sender.send(line).unwrap());
            for bytes in [1, 12] {
                let report = news(Time::from_secs(2), LineEvent::PowerWasOff { bytes });
                traffic.report(&report, &|_| String::new());
            }
            assert_eq!(
                lines.try_iter().collect::<Vec<_>>(),
                [
                    "     2.000000 s  the power was off: 1 byte was lost, nobody heard what came",
                    "     2.000000 s  the power was off: 12 bytes were lost, nobody heard what came",
                ]
            );
        }
    }

    #[test]
    fn nothing_that_happens_to_the_machine_or_a_program_is_left_out() {
        let (sender, lines) = mpsc::channel();
        let mut traffic = Traffic::new(Verbosity::Warnings, move |line| sender.send(line).unwrap());
        // However slow the computer is.
        traffic.pen.respite = Duration::from_secs(3_600);
        let lost = |axis, name: &'static str| Warning::StepsLost {
            axis,
            name: name.into(),
            steps: 1,
            um: None,
            how: vimc4_device::Loss::Overran,
        };
        let error = || Warning::ProgramError { code: '2', line: 1, why: "limit switch X+".into() };
        let false_one =
            |axis, name: &'static str| Warning::FalseReference { axis, name: name.into() };
        let warnings = [
            lost(0, "X"),
            lost(1, "Y"),
            lost(1, "Y"),
            error(),
            error(),
            false_one(0, "X"),
            false_one(2, "Z"),
        ];
        for warning in &warnings {
            let event = Event::Warning(warning.clone());
            traffic.report(&happened(Time::ZERO, event), &|_| String::new());
        }
        assert_eq!(
            lines.try_iter().map(|line| line[17..].to_owned()).collect::<Vec<_>>(),
            warnings.map(|warning| format!("warning: {warning}"))
        );
    }

    #[test]
    fn a_flood_of_one_client_hides_nothing_of_another() {
        let (sender, lines) = mpsc::channel();
        let mut traffic = Traffic::new(Verbosity::Warnings, move |line| sender.send(line).unwrap());
        // However slow the computer is.
        traffic.pen.respite = Duration::from_secs(3_600);
        let explain = |_: &[u8]| String::new();
        let mut tell = |report| traffic.report(&report, &explain);
        let label = |name: &str| std::sync::Arc::<str>::from(name);
        let client = || "a client".to_owned();
        let at = Time::ZERO;
        for _ in 0..500 {
            for name in ["pty", "tcp"] {
                tell(news(at, LineEvent::Speaks { transport: label(name), client: client() }));
                let what = format!("{name} says nothing").into();
                tell(happened(at, Event::Warning(Warning::NoEffect { what })));
                let (client, line) = (300, 19_200);
                tell(news(
                    at,
                    LineEvent::WrongSpeed { transport: label(name), client, line, noise: false },
                ));
            }
        }
        // A client that comes and goes gets no more lines by that.
        for _ in 0..500 {
            let (transport, taken_by) = (label("tcp"), None);
            tell(news(
                at,
                LineEvent::Closed { transport, client: client(), observes: false, taken_by },
            ));
            tell(news(
                at,
                LineEvent::Opened { transport: label("tcp"), client: client(), observes: false },
            ));
            let what = "more".into();
            tell(happened(at, Event::Warning(Warning::NoEffect { what })));
        }
        let told: Vec<_> = lines.try_iter().map(|line| line[17..].to_owned()).collect();
        let speed = "the client has set 300 baud, the controller has 19200; a real one would hear \
                     noise";
        assert_eq!(
            told,
            [
                "warning: no effect: pty says nothing",
                &format!("pty: {speed}"),
                "warning: no effect: tcp says nothing",
                &format!("tcp: {speed}"),
                "tcp: 499 more were left out: changes of the speed",
                "tcp: 499 more were left out: commands without effect",
            ]
        );
    }
}
