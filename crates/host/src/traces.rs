//! What a controller reports, as traces.

use std::fmt;
use std::sync::Arc;

use tracing::dispatcher::{self, Dispatch};
use tracing::{Level, Span, enabled, error_span};
use vimc4_device::{Event, Kinds, Time, Warning, escape};

use crate::{EventFilter, LineEvent, Report, ReportKind, Sink};

/// A sink that turns reports into events of [`tracing`], all of the target `vimc4`:
///
/// | level | what |
/// |---|---|
/// | `warn` | what a person should know: clients that were refused, bytes that were lost, wrong speeds, lost steps |
/// | `info` | transports, clients that come and go, ports that are gone, pauses, the end |
/// | `debug` | the conversation: each command with its number, its bytes and what it means, each answer, what is done at the panel |
/// | `trace` | everything else: motions, switches, signals, programs, bytes that leave |
///
/// Each event stands in a span `controller` with the `name` of the controller, and what is about a
/// client also in its span `client`. The field `at_ns` is the model time in nanoseconds.
///
/// They go to the subscriber that is there when the sink is made, also if it is that of one thread only,
/// and no more is made of what happens than that subscriber wants then.
pub struct Traces {
    subscriber: Dispatch,
    wants: EventFilter,
    controller: Span,
    clients: Vec<Client>,
}

/// A client that has the line open.
struct Client {
    transport: Arc<str>,
    name: String,
    span: Span,
}

/// An event at a model time.
macro_rules! tell {
    ($level:ident, $span:expr, $at:expr, $($what:tt)+) => {
        tracing::event!(target: "vimc4", parent: $span, Level::$level, at_ns = $at.as_nanos(), $($what)+)
    };
}

impl Traces {
    /// A sink for the controller of this name; `None` if no subscriber wants to know anything of it.
    #[must_use]
    pub fn new(name: &str) -> Option<Traces> {
        let wants = wants()?;
        let subscriber = dispatcher::get_default(Dispatch::clone);
        let controller = error_span!(target: "vimc4", parent: None, "controller", name);
        Some(Traces { subscriber, wants, controller, clients: Vec::new() })
    }

    /// Tells that it begins, and what it is.
    pub fn begin(&self, model: &str, machine: &str, clock: &dyn fmt::Display) {
        dispatcher::with_default(&self.subscriber, || {
            let (span, clock) = (&self.controller, tracing::field::display(clock));
            tracing::info!(target: "vimc4", parent: span, model, machine, clock, "begins");
        });
    }

    /// Tells of a way to its line: what sort it is, and where.
    pub fn transport(&self, sort: &str, place: &dyn fmt::Display) {
        dispatcher::with_default(&self.subscriber, || {
            let (span, place) = (&self.controller, tracing::field::display(place));
            tracing::info!(target: "vimc4", parent: span, sort, place, "transport open");
        });
    }

    /// The span of the client that has come last on a transport.
    fn client(&self, transport: &str) -> &Span {
        let mut clients = self.clients.iter().rev();
        let found = clients.find(|client| *client.transport == *transport);
        found.map_or(&self.controller, |client| &client.span)
    }

    fn comes(&mut self, transport: &Arc<str>, name: &str) {
        let (label, controller) = (&**transport, &self.controller);
        let span =
            error_span!(target: "vimc4", parent: controller, "client", transport = label, name);
        let (transport, name) = (Arc::clone(transport), name.to_owned());
        self.clients.push(Client { transport, name, span });
    }

    fn goes(&mut self, transport: &str, name: &str) -> Option<Client> {
        let is = |client: &Client| *client.transport == *transport && client.name == name;
        self.clients.iter().position(is).map(|place| self.clients.remove(place))
    }

    #[expect(clippy::cognitive_complexity, reason = "it has an event for each kind of report")]
    fn news(&mut self, at: Time, news: &LineEvent) {
        let whole = self.controller.clone();
        let of = |transport: &str| self.client(transport).clone();
        match news {
            LineEvent::Opened { transport, client, observes } => {
                self.comes(transport, client);
                tell!(INFO, self.client(transport), at, observes, "line opened");
            }
            LineEvent::Closed { transport, client, observes, taken_by } => {
                let gone = self.goes(transport, client);
                let span = gone.as_ref().map_or(&whole, |client| &client.span);
                let taken_by = taken_by.as_deref();
                tell!(INFO, span, at, observes, taken_by, "line closed");
            }
            LineEvent::Refused { transport, client, holder } => {
                let transport = &**transport;
                tell!(WARN, &whole, at, transport, client, holder, "client refused");
            }
            LineEvent::Unheard { transport, client } => {
                tell!(WARN, &of(transport), at, client, "an observer is not heard");
            }
            LineEvent::Lost { transport, bytes } => {
                tell!(WARN, &of(transport), at, bytes, "the client does not read: lost");
            }
            LineEvent::WrongSpeed { transport, client, line, .. } => {
                tell!(WARN, &of(transport), at, client, line, "wrong speed");
            }
            LineEvent::WrongParity { transport, parity } => {
                tell!(WARN, &of(transport), at, parity = &**parity, "wrong parity");
            }
            LineEvent::WrongDataBits { transport, bits } => {
                tell!(WARN, &of(transport), at, bits, "wrong data bits");
            }
            LineEvent::Shared { transport, programs } => {
                tell!(WARN, &of(transport), at, programs, "several programs have the line open");
            }
            LineEvent::HalfLine { transport, half, spoils } => {
                let half = escape(half);
                tell!(WARN, &of(transport), at, half, spoils, "half a line was left");
            }
            LineEvent::LineFeed { transport, right } => {
                tell!(WARN, &of(transport), at, right = &**right, "LF alone ends no command");
            }
            LineEvent::Gone { transport, error } => {
                tell!(WARN, &whole, at, transport = &**transport, error, "port gone");
            }
            LineEvent::Back { transport } => {
                tell!(INFO, &whole, at, transport = &**transport, "port back");
            }
            LineEvent::PowerWasOff { bytes } => {
                tell!(WARN, &whole, at, bytes, "the power was off: lost");
            }
            LineEvent::FlashMended { file, what } => {
                tell!(WARN, &whole, at, file, what, "flash file mended");
            }
            LineEvent::Paused { by, breakpoints } => {
                let by = by.as_ref().map(ToString::to_string);
                tell!(INFO, &whole, at, by, ?breakpoints, "time paused");
            }
            LineEvent::Resumed { by } => tell!(INFO, &whole, at, %by, "time resumed"),
            LineEvent::Ends => tell!(INFO, &whole, at, "ends"),
            LineEvent::HostLine { transport, line, on } => {
                tell!(DEBUG, &of(transport), at, line = &**line, on, "handshake line");
            }
            LineEvent::Speaks { transport, client } => {
                tell!(DEBUG, &of(transport), at, client, "speaks");
            }
            LineEvent::Deed { by, deed } => tell!(DEBUG, &whole, at, %by, %deed, "done"),
            LineEvent::NoEffect { by, deed, why } => {
                tell!(DEBUG, &whole, at, %by, %deed, why = why.as_deref(), "no effect");
            }
            news => tell!(DEBUG, &whole, at, ?news, "news"),
        }
    }

    fn event(
        &self,
        at: Time,
        command: Option<u64>,
        event: &Event,
        explain: &dyn Fn(&[u8]) -> String,
    ) {
        let span = &self.controller;
        match event {
            Event::Command { mnemonic, bytes } => {
                // It is put into words only for subscribers that want them.
                let (line, means) = (escape(bytes), tracing::field::display(Means(bytes, explain)));
                tell!(DEBUG, span, at, command, mnemonic = &**mnemonic, line, means, "command");
            }
            Event::Answer { mnemonic, bytes, why } => {
                let (mnemonic, answer, why) = (&**mnemonic, escape(bytes), why.as_deref());
                tell!(DEBUG, span, at, command, mnemonic, answer, why, "answer");
            }
            Event::CutShort { mnemonic, why } => {
                tell!(DEBUG, span, at, command, mnemonic = &**mnemonic, why = &**why, "cut short");
            }
            Event::Ignored { bytes, why } => {
                tell!(DEBUG, span, at, line = escape(bytes), why = &**why, "ignored");
            }
            // Part of a conversation, or of its absence.
            Event::Warning(Warning::NobodyListens { lost }) => {
                tell!(DEBUG, span, at, bytes = lost, "nobody listens");
            }
            Event::Warning(warning) => tell!(WARN, span, at, command, "{warning}"),
            other => tell!(TRACE, span, at, command, event = ?other, "event"),
        }
    }
}

/// A command in the words people use.
struct Means<'a>(&'a [u8], &'a dyn Fn(&[u8]) -> String);

impl fmt::Display for Means<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Means(bytes, explain) = self;
        f.write_str(&explain(bytes))
    }
}

/// What the present subscriber wants; `None` if it wants nothing, or if there is none.
fn wants() -> Option<EventFilter> {
    let none = EventFilter::default();
    if enabled!(target: "vimc4", Level::TRACE) {
        Some(EventFilter { kinds: Kinds::ALL, sent: true, ..none })
    } else if enabled!(target: "vimc4", Level::DEBUG) {
        Some(EventFilter { kinds: Kinds::COMMAND.and(Kinds::ANSWER).and(Kinds::WARNING), ..none })
    } else if enabled!(target: "vimc4", Level::WARN) {
        Some(EventFilter { kinds: Kinds::WARNING, ..none })
    } else {
        None
    }
}

impl Sink for Traces {
    fn wants(&self) -> EventFilter {
        self.wants
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        let subscriber = self.subscriber.clone();
        dispatcher::with_default(&subscriber, || match &report.what {
            ReportKind::News(news) => self.news(report.at, news),
            ReportKind::Event { command, event } => {
                self.event(report.at, command.map(|command| command.0.get()), event, explain);
            }
            ReportKind::Sent { bytes } => {
                tell!(TRACE, &self.controller, report.at, bytes = escape(bytes), "sent");
            }
            _ => {}
        });
    }
}

impl fmt::Debug for Traces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Traces").field("controller", &self.controller).finish_non_exhaustive()
    }
}
