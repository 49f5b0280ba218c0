//! The words for what a controller tells.

use std::fmt;

use vimc4_device::{CommandNumber, Event, Kinds, Time, Warning};
use vimc4_journal::words::{self, Excerpt, Words};

use crate::report::{BreakpointId, EventFilter, LineEvent, Report, ReportKind};

/// Who is told of a conversation, line by line.
pub trait Teller {
    /// A line, without its time.
    fn line(&mut self, at: Time, text: fmt::Arguments<'_>);

    /// A line that may be one of very many: `kind` says in words of what, `about` at which transport, and
    /// `bytes` how many bytes it is about.
    fn warn(
        &mut self,
        at: Time,
        kind: &'static str,
        about: &str,
        bytes: u64,
        text: fmt::Arguments<'_>,
    ) {
        let _ = (kind, about, bytes);
        self.line(at, text);
    }
}

/// How much a [`Talk`] tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Refused clients, and what was lost or assumed.
    Warnings,
    /// The same, and clients that come and go, and every command with its answer.
    Conversation,
}

/// Puts reports into words, each after those before it:
///
/// ```text
///     1.250000 s  @0A 5000,900  relative move X +5,000 steps at 900 Hz
///     6.850000 s  0  after 5.6 s
/// ```
#[derive(Debug)]
pub struct Talk {
    verbosity: Verbosity,
    words: Words,
    /// On which transport is spoken, as far as that is known.
    speaker: String,
}

impl Talk {
    /// Tells so much.
    #[must_use]
    pub fn new(verbosity: Verbosity) -> Talk {
        Talk { verbosity, words: Words::default(), speaker: String::new() }
    }

    /// How much it tells.
    #[must_use]
    pub fn verbosity(&self) -> Verbosity {
        self.verbosity
    }

    /// The reports that it puts into words.
    #[must_use]
    pub fn wants(&self) -> EventFilter {
        let kinds = match self.verbosity {
            Verbosity::Warnings => Kinds::WARNING,
            Verbosity::Conversation => Kinds::COMMAND
                .and(Kinds::ANSWER)
                .and(Kinds::FLASH)
                .and(Kinds::LINE)
                .and(Kinds::FAULT)
                .and(Kinds::WARNING),
        };
        EventFilter { kinds, ..EventFilter::default() }
    }

    /// Tells what a report says, if it is to be told. `explain` puts a command in the words people use.
    pub fn tell(
        &mut self,
        report: &Report,
        explain: &dyn Fn(&[u8]) -> String,
        to: &mut impl Teller,
    ) {
        let at = report.at;
        match &report.what {
            ReportKind::Event { command, event } => self.event(at, *command, event, explain, to),
            ReportKind::News(news) => self.news(at, news, explain, to),
            _ => {}
        }
    }

    /// Takes note of a command that was told elsewhere, so that its answer is shown with it.
    pub fn heard(&mut self, report: &Report) {
        if let ReportKind::Event { command: Some(number), event: Event::Command { bytes, .. } } =
            &report.what
        {
            self.words.heard(report.at, *number, bytes);
        }
    }

    fn event(
        &mut self,
        at: Time,
        command: Option<CommandNumber>,
        event: &Event,
        explain: &dyn Fn(&[u8]) -> String,
        to: &mut impl Teller,
    ) {
        match event {
            // That nobody listens is part of a conversation, or of its absence: a program that
            // sends characters to nobody would fill the terminal with it.
            Event::Warning(Warning::NobodyListens { .. })
                if self.verbosity == Verbosity::Warnings => {}
            Event::Warning(warning) => {
                let text = format_args!("warning: {warning}");
                let in_conversation = self.verbosity == Verbosity::Conversation
                    && matches!(warning, Warning::NoEffect { .. } | Warning::OffCircle { .. });
                match kind_of(warning) {
                    // It belongs to a command, and of those all are told.
                    _ if in_conversation => to.line(at, text),
                    Some((kind, bytes)) => {
                        to.warn(at, kind, &self.speaker, bytes, text);
                    }
                    None => to.line(at, text),
                }
            }
            event => {
                if let Some(text) = self.words.event(at, command, event, explain) {
                    to.line(at, format_args!("{text}"));
                }
            }
        }
    }

    #[expect(clippy::too_many_lines, reason = "it has a message for each kind of report")]
    fn news(
        &mut self,
        at: Time,
        news: &LineEvent,
        explain: &dyn Fn(&[u8]) -> String,
        to: &mut impl Teller,
    ) {
        if let LineEvent::Opened { transport, .. } | LineEvent::Speaks { transport, .. } = news {
            transport.as_ref().clone_into(&mut self.speaker);
        }
        match news {
            LineEvent::Deed { .. } | LineEvent::NoEffect { .. } | LineEvent::Speaks { .. }
                if self.verbosity == Verbosity::Warnings => {}
            LineEvent::Deed { by, deed } => {
                let text = words::deed(by, deed, explain);
                to.line(at, format_args!("{text}"));
            }
            LineEvent::NoEffect { why: Some(why), .. } => {
                to.line(at, format_args!("        no effect: {why}"));
            }
            LineEvent::NoEffect { why: None, .. } => to.line(at, format_args!("        no effect")),
            LineEvent::Speaks { transport, client } => {
                to.line(at, format_args!("{transport}: {client} speaks"));
            }
            LineEvent::Opened { transport, client, observes }
                if self.verbosity == Verbosity::Conversation =>
            {
                let observing = observing(*observes);
                to.line(at, format_args!("{transport}: {client}{observing} opened the line"));
            }
            LineEvent::Closed { transport, client, observes, taken_by }
                if self.verbosity == Verbosity::Conversation =>
            {
                let text = match taken_by {
                    Some(by) => format!("{by} takes the line over from {client}"),
                    None => format!("{client}{} closed the line", observing(*observes)),
                };
                to.line(at, format_args!("{transport}: {text}"));
            }
            LineEvent::HostLine { transport, line, on }
                if self.verbosity == Verbosity::Conversation =>
            {
                let state = if *on { "on" } else { "off" };
                to.line(at, format_args!("{transport}: the host has switched {line} {state}"));
            }
            LineEvent::Ends if self.verbosity == Verbosity::Conversation => {
                to.line(at, format_args!("the controller ends, as if its power were switched off"));
            }
            LineEvent::Opened { .. }
            | LineEvent::Closed { .. }
            | LineEvent::HostLine { .. }
            | LineEvent::Ends => {}
            LineEvent::Refused { transport, client, holder } => to.warn(
                at,
                "clients that were refused",
                transport,
                0,
                format_args!("{transport}: refused {client}, because {holder} holds the line"),
            ),
            LineEvent::Unheard { transport, client } => to.warn(
                at,
                "observers that have sent something",
                transport,
                0,
                format_args!("{transport}: {client} only observes, what it sends is ignored"),
            ),
            LineEvent::Lost { transport, bytes } => to.warn(
                at,
                "answers that were not read",
                transport,
                *bytes,
                format_args!("{transport}: {} lost, the client does not read", count(*bytes)),
            ),
            LineEvent::WrongSpeed { transport, client, line, noise } => {
                let heard = match noise {
                    true => "it hears noise, and so does the client",
                    false => "a real one would hear noise",
                };
                to.warn(
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
            LineEvent::WrongParity { transport, parity } => to.warn(
                at,
                "changes of the parity",
                transport,
                0,
                format_args!(
                    "{transport}: the client has set {parity} parity, the controller has none; a \
                     real one would hear noise"
                ),
            ),
            LineEvent::WrongDataBits { transport, bits } => to.warn(
                at,
                "changes of the data bits",
                transport,
                0,
                format_args!(
                    "{transport}: the client has set {bits} data bits, the controller has 8; a \
                     real one would hear noise"
                ),
            ),
            LineEvent::Shared { transport, programs } => to.warn(
                at,
                "programs at one port",
                transport,
                0,
                format_args!(
                    "{transport}: {programs} have it open at once and take the answers from each \
                     other; close all but one"
                ),
            ),
            LineEvent::HalfLine { transport, half, spoils: false } => to.warn(
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
            LineEvent::HalfLine { transport, half, spoils: true } => to.warn(
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
            LineEvent::LineFeed { transport, right } => to.warn(
                at,
                "clients that end their lines with LF alone",
                transport,
                0,
                format_args!("{transport}: LF alone ends no command; {right}"),
            ),
            LineEvent::Gone { transport, error } => to.line(
                at,
                format_args!("{transport} is gone ({error}); it is opened again when it is back"),
            ),
            LineEvent::Back { transport } => to.line(at, format_args!("{transport} is back")),
            LineEvent::PowerWasOff { bytes } => to.line(
                at,
                format_args!("the power was off: {} lost, nobody heard what came", count(*bytes)),
            ),
            LineEvent::Paused { by: Some(by), .. } => {
                to.line(at, format_args!("{by}: time is paused"));
            }
            LineEvent::Paused { by: None, breakpoints } => {
                for BreakpointId(number) in breakpoints {
                    to.line(at, format_args!("time is paused at breakpoint {number}"));
                }
            }
            LineEvent::Resumed { by } => to.line(at, format_args!("{by}: time goes on")),
            LineEvent::FlashMended { file, what } => {
                to.line(at, format_args!("flash file {file}: {what}"));
            }
        }
    }
}

/// What is left out when there are many, in words, and how many bytes it is about. Of what happens to the machine or to a program
/// nothing is left out: each is another event, and time on the wall is none of the controller's.
fn kind_of(warning: &Warning) -> Option<(&'static str, u64)> {
    match warning {
        Warning::ReceiveOverflow { lost } => Some(("overflows of the receive buffer", *lost)),
        Warning::NobodyListens { lost } => Some(("answers while nobody had the line open", *lost)),
        Warning::NoEffect { .. } => Some(("commands without effect", 0)),
        Warning::OffCircle { .. } => Some(("arcs that end off their circle", 0)),
        _ => None,
    }
}

fn count(bytes: u64) -> String {
    if bytes == 1 { "1 byte was".to_owned() } else { format!("{bytes} bytes were") }
}

/// What is said of a client that only hears what others are answered.
fn observing(observes: bool) -> &'static str {
    if observes { " (observing)" } else { "" }
}
