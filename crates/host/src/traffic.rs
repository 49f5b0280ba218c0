//! The conversation as people read it.

use std::fmt;
use std::time::{Duration, Instant};

use vimc4_device::{CommandNumber, Event, Grouped, Kinds, Time, Warning};
use vimc4_journal::words::{self, Excerpt, Words};

use crate::report::{BreakpointId, News, Report, Sink, Wants, What};

/// A sink that writes lines of text:
///
/// ```text
///     1.250000 s  @0A 5000,900  relative move X +5,000 steps at 900 Hz
///     6.850000 s  0  after 5.6 s
/// ```
///
/// The lines go to a function, one at a time and without their ends; it must not block.
pub struct Traffic<F> {
    write: F,
    verbosity: Verbosity,
    words: Words,
    /// By kind and transport.
    floods: Vec<Flood>,
    /// On which transport is spoken, as far as that is known.
    speaker: String,
    /// How long a warning stands for those of its kind.
    respite: Duration,
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
    /// How many were not since then.
    left_out: u64,
    /// Of how many bytes those were that are about bytes.
    bytes: u64,
    /// When their number was told last although no other one came.
    settled: Option<Instant>,
}

/// Of each kind of warning about a transport no more than one is told in this time.
const RESPITE: Duration = Duration::from_secs(1);

/// How much a [`Traffic`] sink tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Refused clients, and what was lost or assumed.
    Warnings,
    /// The same, and clients that come and go, and every command with its answer.
    Conversation,
}

impl Flood {
    /// How many were left out, of how many bytes: they are told now.
    fn take(&mut self) -> (u64, u64) {
        (std::mem::take(&mut self.left_out), std::mem::take(&mut self.bytes))
    }
}

impl<F: FnMut(String) + Send> Traffic<F> {
    /// Writes the conversation by calling `write`.
    pub fn new(verbosity: Verbosity, write: F) -> Traffic<F> {
        Traffic {
            write,
            verbosity,
            words: Words::default(),
            floods: Vec::new(),
            speaker: String::new(),
            respite: RESPITE,
        }
    }

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
        let place = self
            .floods
            .binary_search_by(|flood| (flood.kind, &*flood.about).cmp(&(kind, transport)));
        let flood = match place {
            Ok(place) => &mut self.floods[place],
            Err(place) => {
                let about = transport.to_owned();
                let flood = Flood { kind, about, told: now, left_out: 0, bytes: 0, settled: None };
                self.floods.insert(place, flood);
                return self.line(at, text);
            }
        };
        if now.duration_since(flood.told) < self.respite {
            flood.left_out += 1;
            flood.bytes = flood.bytes.saturating_add(bytes);
            return;
        }
        flood.told = now;
        match flood.take() {
            (0, _) => self.line(at, text),
            (many, bytes) => {
                let (bytes, were) = (of_bytes(bytes), if many == 1 { "was" } else { "were" });
                self.line(
                    at,
                    format_args!("{text} ({many} of the kind{bytes} {were} left out before)"),
                );
            }
        }
    }

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
        let mut lines = Vec::new();
        for flood in &mut self.floods {
            if flood.left_out > 0 && which(flood, self.respite) {
                flood.settled = Some(Instant::now());
                let (many, bytes) = flood.take();
                let Flood { kind, about, .. } = &*flood;
                let about = if about.is_empty() { String::new() } else { format!("{about}: ") };
                let (bytes, were) = (of_bytes(bytes), if many == 1 { "was" } else { "were" });
                lines.push(format!("{about}{many} more{bytes} {were} left out: {kind}"));
            }
        }
        for line in lines {
            self.line(at, format_args!("{line}"));
        }
    }

    fn event(
        &mut self,
        at: Time,
        command: Option<CommandNumber>,
        event: &Event,
        explain: &dyn Fn(&[u8]) -> String,
    ) {
        match event {
            // That nobody listens is part of a conversation, or of its absence: a program that
            // sends characters to nobody would fill the terminal with it.
            Event::Warning(Warning::NobodyListens { .. })
                if self.verbosity == Verbosity::Warnings => {}
            Event::Warning(warning) => {
                let text = format_args!("warning: {warning}");
                let in_conversation = self.verbosity == Verbosity::Conversation
                    && matches!(warning, Warning::NoEffect { .. });
                match kind_of(warning) {
                    // It belongs to a command, and of those all are told.
                    _ if in_conversation => self.line(at, text),
                    Some((kind, bytes)) => {
                        let speaker = std::mem::take(&mut self.speaker);
                        self.warn(at, kind, &speaker, bytes, text);
                        self.speaker = speaker;
                    }
                    None => self.line(at, text),
                }
            }
            event => {
                if let Some(text) = self.words.event(at, command, event, explain) {
                    self.line(at, format_args!("{text}"));
                }
            }
        }
    }

    fn news(&mut self, at: Time, news: &News, explain: &dyn Fn(&[u8]) -> String) {
        match news {
            News::Closed { transport, .. } => self.settle(at, transport),
            News::Ends => self.settle_if(at, |_, _| true),
            News::Opened { transport, .. } | News::Speaks { transport, .. } => {
                transport.as_ref().clone_into(&mut self.speaker);
            }
            _ => {}
        }
        match news {
            News::Deed { .. } | News::NoEffect { .. } | News::Speaks { .. }
                if self.verbosity == Verbosity::Warnings => {}
            News::Deed { by, deed } => {
                let text = words::deed(by, deed, explain);
                self.line(at, format_args!("{text}"));
            }
            News::NoEffect { why: Some(why), .. } => {
                self.line(at, format_args!("        no effect: {why}"));
            }
            News::NoEffect { why: None, .. } => self.line(at, format_args!("        no effect")),
            News::Speaks { transport, client } => {
                self.line(at, format_args!("{transport}: {client} speaks"));
            }
            News::Opened { transport, client, observes }
                if self.verbosity == Verbosity::Conversation =>
            {
                let observing = observing(*observes);
                self.line(at, format_args!("{transport}: {client}{observing} opened the line"));
            }
            News::Closed { transport, client, observes, taken_by }
                if self.verbosity == Verbosity::Conversation =>
            {
                let text = match taken_by {
                    Some(by) => format!("{by} takes the line over from {client}"),
                    None => format!("{client}{} closed the line", observing(*observes)),
                };
                self.line(at, format_args!("{transport}: {text}"));
            }
            News::HostLine { transport, line, on } if self.verbosity == Verbosity::Conversation => {
                let state = if *on { "on" } else { "off" };
                self.line(at, format_args!("{transport}: the host has switched {line} {state}"));
            }
            News::Ends if self.verbosity == Verbosity::Conversation => {
                self.line(
                    at,
                    format_args!("the controller ends, as if its power were switched off"),
                );
            }
            News::Opened { .. } | News::Closed { .. } | News::HostLine { .. } | News::Ends => {}
            News::Refused { transport, client, holder } => self.warn(
                at,
                "clients that were refused",
                transport,
                0,
                format_args!("{transport}: refused {client}, because {holder} holds the line"),
            ),
            News::Unheard { transport, client } => self.warn(
                at,
                "observers that have sent something",
                transport,
                0,
                format_args!("{transport}: {client} only observes, what it sends is ignored"),
            ),
            News::Lost { transport, bytes } => self.warn(
                at,
                "answers that were not read",
                transport,
                *bytes,
                format_args!("{transport}: {} lost, the client does not read", count(*bytes)),
            ),
            News::WrongSpeed { transport, client, line, noise } => {
                let heard = match noise {
                    true => "it hears noise, and so does the client",
                    false => "a real one would hear noise",
                };
                self.warn(
                    at,
                    "changes of the speed",
                    transport,
                    0,
                    format_args!(
                        "{transport}: the client has set {client} baud, the controller has {line}; \
                         {heard}"
                    ),
                );
            }
            News::WrongParity { transport, parity } => self.warn(
                at,
                "changes of the parity",
                transport,
                0,
                format_args!(
                    "{transport}: the client has set {parity} parity, the controller has none; a \
                     real one would hear noise"
                ),
            ),
            News::WrongDataBits { transport, bits } => self.warn(
                at,
                "changes of the data bits",
                transport,
                0,
                format_args!(
                    "{transport}: the client has set {bits} data bits, the controller has 8; a \
                     real one would hear noise"
                ),
            ),
            News::Shared { transport, programs } => self.warn(
                at,
                "programs at one port",
                transport,
                0,
                format_args!(
                    "{transport}: {programs} have it open at once and take the answers from each \
                     other; close all but one"
                ),
            ),
            News::HalfLine { transport, half, spoils: false } => self.warn(
                at,
                "half lines",
                transport,
                0,
                format_args!(
                    "{transport}: an earlier client left half a line, `{}`; the next command \
                     continues it, as on a real cable (--fresh-clients forgets it)",
                    Excerpt(half)
                ),
            ),
            News::HalfLine { transport, half, spoils: true } => self.warn(
                at,
                "commands after half lines",
                transport,
                0,
                format_args!(
                    "{transport}: this command continues the half line `{}` that an earlier client \
                     left",
                    Excerpt(half)
                ),
            ),
            News::LineFeed { transport, right } => self.warn(
                at,
                "clients that end their lines with LF alone",
                transport,
                0,
                format_args!("{transport}: LF alone ends no command; {right}"),
            ),
            News::Gone { transport, error } => self.line(
                at,
                format_args!("{transport} is gone ({error}); it is opened again when it is back"),
            ),
            News::Back { transport } => self.line(at, format_args!("{transport} is back")),
            News::PowerWasOff { bytes } => self.line(
                at,
                format_args!("the power was off: {} lost, nobody heard what came", count(*bytes)),
            ),
            News::Paused { by: Some(by), .. } => {
                self.line(at, format_args!("{by}: time is paused"));
            }
            News::Paused { by: None, breakpoints } => {
                for BreakpointId(number) in breakpoints {
                    self.line(at, format_args!("time is paused at breakpoint {number}"));
                }
            }
            News::Resumed { by } => self.line(at, format_args!("{by}: time goes on")),
            News::FlashMended { file, what } => {
                self.line(at, format_args!("flash file {file}: {what}"));
            }
        }
    }
}

impl<F: FnMut(String) + Send> Sink for Traffic<F> {
    fn wants(&self) -> Wants {
        let kinds = match self.verbosity {
            Verbosity::Warnings => Kinds::WARNING,
            Verbosity::Conversation => Kinds::COMMAND
                .and(Kinds::ANSWER)
                .and(Kinds::FLASH)
                .and(Kinds::LINE)
                .and(Kinds::FAULT)
                .and(Kinds::WARNING),
        };
        Wants { kinds, ..Wants::default() }
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        let at = report.at;
        match &report.what {
            What::Event { command, event } => self.event(at, *command, event, explain),
            What::News(news) => self.news(at, news, explain),
            _ => {}
        }
    }
}

impl<F> fmt::Debug for Traffic<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Traffic").field("verbosity", &self.verbosity).finish_non_exhaustive()
    }
}

/// What is left out when there are many, in words, and how many bytes it is about. Of what happens to the machine or to a program
/// nothing is left out: each is another event, and time on the wall is none of the controller's.
fn kind_of(warning: &Warning) -> Option<(&'static str, u64)> {
    match warning {
        Warning::ReceiveOverflow { lost } => Some(("overflows of the receive buffer", *lost)),
        Warning::NobodyListens { lost } => Some(("answers while nobody had the line open", *lost)),
        Warning::NoEffect { .. } => Some(("commands without effect", 0)),
        _ => None,
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

fn count(bytes: u64) -> String {
    if bytes == 1 { "1 byte was".to_owned() } else { format!("{bytes} bytes were") }
}

/// What is said of a client that only hears what others are answered.
fn observing(observes: bool) -> &'static str {
    if observes { " (observing)" } else { "" }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::num::NonZeroU64;
    use std::sync::mpsc;

    use bytes::Bytes;

    use super::*;

    fn happened(at: Time, event: Event) -> Report {
        let what = What::Event { command: None, event };
        Report { controller: "1".into(), at, what }
    }

    fn news(at: Time, news: News) -> Report {
        Report { controller: "1".into(), at, what: What::News(news) }
    }

    fn belongs(number: u64, at: Time, event: Event) -> Report {
        let command = NonZeroU64::new(number).map(CommandNumber);
        Report { what: What::Event { command, event }, ..happened(at, Event::Baud { baud: 0 }) }
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
        traffic.respite = Duration::from_secs(3_600);
        let explain = |_: &[u8]| String::new();
        let (transport, client) = (std::sync::Arc::from("pty"), "a client".to_owned());
        for ms in 0..2_000 {
            let at = Time::from_millis(ms);
            let warning = Warning::NoEffect { what: "half a turn".into() };
            traffic.report(&happened(at, Event::Warning(warning)), &explain);
        }
        let other = Warning::ReceiveOverflow { lost: 1 };
        traffic.report(&happened(Time::from_secs(3), Event::Warning(other)), &explain);
        let end = News::Closed { transport, client, observes: false, taken_by: None };
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
        traffic.respite = Duration::from_secs(3_600);
        let made = Cell::new(0);
        for _ in 0..100 {
            traffic.warn(Time::ZERO, "a kind", "pty", 0, format_args!("{}", Words(&made)));
        }
        assert_eq!(made.get(), 1);
    }

    #[test]
    fn what_came_while_the_power_was_off_is_said_at_any_verbosity() {
        for verbosity in [Verbosity::Warnings, Verbosity::Conversation] {
            let (sender, lines) = mpsc::channel();
            let mut traffic = Traffic::new(verbosity, move |line| sender.send(line).unwrap());
            for bytes in [1, 12] {
                let report = news(Time::from_secs(2), News::PowerWasOff { bytes });
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
        traffic.respite = Duration::from_secs(3_600);
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
        traffic.respite = Duration::from_secs(3_600);
        let explain = |_: &[u8]| String::new();
        let mut tell = |report| traffic.report(&report, &explain);
        let label = |name: &str| std::sync::Arc::<str>::from(name);
        let client = || "a client".to_owned();
        let at = Time::ZERO;
        for _ in 0..500 {
            for name in ["pty", "tcp"] {
                tell(news(at, News::Speaks { transport: label(name), client: client() }));
                let what = format!("{name} says nothing").into();
                tell(happened(at, Event::Warning(Warning::NoEffect { what })));
                let (client, line) = (300, 19_200);
                tell(news(
                    at,
                    News::WrongSpeed { transport: label(name), client, line, noise: false },
                ));
            }
        }
        // A client that comes and goes gets no more lines by that.
        for _ in 0..500 {
            let (transport, taken_by) = (label("tcp"), None);
            tell(news(at, News::Closed { transport, client: client(), observes: false, taken_by }));
            tell(news(
                at,
                News::Opened { transport: label("tcp"), client: client(), observes: false },
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
