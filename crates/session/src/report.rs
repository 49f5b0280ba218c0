//! What can be watched from outside.

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;
use std::task::{Context, Poll};

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::{CommandNumber, Event, Kinds, OwnedInput, Time};

pub use vimc4_device::Deed;

/// Something that went into a running controller, came out of it or happened on its line.
///
/// Each can be written down and read again. The [states](ReportKind::State) and [inputs](ReportKind::Input) of a
/// controller, in their order, are a recording: a device that is put into the state and is given
/// the inputs at their times does all the rest again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The controller, by its name in this process.
    pub controller: Arc<str>,
    /// The model time. What goes in has the one time at which it was handled.
    pub at: Time,
    /// What.
    pub what: ReportKind,
}

/// What a [`Report`] tells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ReportKind {
    /// Something goes into the device. The passing of time is reported where it was ordered, once
    /// it has passed.
    Input {
        /// Where it came from.
        by: Source,
        /// What.
        input: OwnedInput,
    },
    /// The device is in this state: reported once to a sink that begins to watch the inputs, and
    /// whenever the device is put back into an earlier state. Its time goes on from there.
    State {
        /// The source that put it into the state; `None` for a sink that begins to watch.
        by: Option<Source>,
        /// The device's [state](vimc4_device::Device::State), as it is written down.
        state: serde_json::Value,
    },
    /// The device is led cause by cause, because its time is [paused](LineEvent::Paused) or may be by a
    /// breakpoint, and has come so far: everything is done that was due before, and of what is due at
    /// this very instant so many causes, counted from the last of these reports, inputs or states at
    /// it; `None` if all of it is. It is told whenever something has been done. What else is due is
    /// done when something later is, or never, if another state is put in.
    Stands {
        /// How many causes.
        causes: Option<u32>,
    },
    /// The device is no longer led cause by cause: all that is due by now is done.
    Goes,
    /// Bytes left on the line.
    Sent {
        /// What.
        bytes: Bytes,
    },
    /// Something happened inside the device.
    Event {
        /// The command that it belongs to, if there is one.
        command: Option<CommandNumber>,
        /// What.
        event: Event,
    },
    /// Somebody came or went, or bytes were lost on the way.
    News(LineEvent),
    /// This watcher was too slow: so many reports, of this and later times, are missing here.
    Missed {
        /// How many.
        reports: u64,
    },
}

impl Report {
    /// The event of the device that it tells of.
    #[must_use]
    pub fn event(&self) -> Option<&Event> {
        match &self.what {
            ReportKind::Event { event, .. } => Some(event),
            _ => None,
        }
    }

    /// The news that it tells.
    #[must_use]
    pub fn news(&self) -> Option<&LineEvent> {
        match &self.what {
            ReportKind::News(news) => Some(news),
            _ => None,
        }
    }
}

/// Where an input or action came from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// A client of the line.
    Client {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client, as far as it is known.
        client: Option<Arc<str>>,
    },
    /// The holder of a handle, by the name that the handle was given.
    Controls(Arc<str>),
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Source::Client { transport, client: Some(client) } => {
                write!(f, "{transport}: {client}")
            }
            Source::Client { transport: name, client: None } | Source::Controls(name) => {
                f.write_str(name)
            }
        }
    }
}

/// What happens at the transports of a line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum LineEvent {
    /// A client opened the line.
    Opened {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client, as far as it is known.
        client: String,
        /// Whether it only hears what others are answered.
        observes: bool,
    },
    /// A client closed the line or vanished, or it was taken from it.
    Closed {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client, as far as it is known.
        client: String,
        /// Whether it only heard what others were answered.
        observes: bool,
        /// The client that has taken the line over from it.
        taken_by: Option<String>,
    },
    /// A client that only observes has sent something, which the device does not get. Reported once
    /// for each such client.
    Unheard {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client.
        client: String,
    },
    /// A client was turned away because another one holds the line.
    Refused {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client that was turned away.
        client: String,
        /// The client that holds the line.
        holder: String,
    },
    /// Something other than a command is done to the device. Its effects follow. Reported to sinks
    /// that want commands.
    Deed {
        /// The source of the action.
        by: Source,
        /// What.
        deed: Deed,
    },
    /// An action has changed nothing.
    NoEffect {
        /// The source of the action.
        by: Source,
        /// What.
        deed: Deed,
        /// Why, as far as that is known.
        why: Option<Cow<'static, str>>,
    },
    /// Several clients have the line open, and what comes from now on comes from this one.
    Speaks {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client, as far as it is known.
        client: String,
    },
    /// A client that does not read lost its copy of what the controller sent.
    Lost {
        /// The transport, by its label.
        transport: Arc<str>,
        /// How many bytes.
        bytes: u64,
    },
    /// A client has set its port to another speed than the device's line has. It is understood
    /// all the same; a real device would hear noise.
    WrongSpeed {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client's speed in bits per second.
        client: u32,
        /// The speed of the device's line in bits per second.
        line: u32,
        /// Whether the device does hear noise, because the line has its physics.
        noise: bool,
    },
    /// A client has set its port to a parity, which no device's line here has. It is understood
    /// all the same; a real device would hear noise. Of even parity, and of 7 bits, a
    /// pseudo-terminal tells nothing.
    WrongParity {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client's parity: `odd`, `mark` or `space`.
        parity: Cow<'static, str>,
    },
    /// A client has set its port to characters of another length than the device's line has, which
    /// is 8 bits. It is understood all the same; a real device would hear noise.
    WrongDataBits {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The data bits of the client's characters, 5 to 7.
        bits: u8,
    },
    /// A client has switched one of its handshake lines, or begun or ended a break.
    HostLine {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The line: `DTR`, `RTS` or `BREAK`.
        line: Cow<'static, str>,
        /// Whether it is on now.
        on: bool,
    },
    /// Several programs have the line open, and what the controller sends goes to one of them,
    /// a part here and a part there.
    Shared {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The programs, as far as they can be seen.
        programs: String,
    },
    /// A client that has left has begun a line and not ended it. As on a real cable the next
    /// client's first command becomes the rest of it.
    HalfLine {
        /// The transport of the client that has left, if others are still there; else that of the
        /// next client, or of the client that spoils it.
        transport: Arc<str>,
        /// The half line.
        half: Bytes,
        /// The next client has sent something; else it has only come.
        spoils: bool,
    },
    /// A client ends its lines with LF alone, which ends nothing here: it waits in vain, as with a
    /// real device. Reported once for each client.
    LineFeed {
        /// The transport, by its label.
        transport: Arc<str>,
        /// What ends a line, and how it is sent.
        right: Cow<'static, str>,
    },
    /// A port is gone, most likely unplugged. It is served again when it is back.
    Gone {
        /// The transport, by its label.
        transport: Arc<str>,
        /// What the operating system says.
        error: String,
    },
    /// A port that was gone is served again.
    Back {
        /// The transport, by its label.
        transport: Arc<str>,
    },
    /// Bytes came while the power was off, and were lost. Reported when the power comes on, or when
    /// the controller ends.
    PowerWasOff {
        /// How many bytes.
        bytes: u64,
    },
    /// The controller's time stands still from now on, and nothing is read from its line.
    Paused {
        /// The source of the pause; `None` if it was a breakpoint that is listed here.
        by: Option<Source>,
        /// The breakpoints that were met just now: also those that are met step by step.
        breakpoints: Vec<BreakpointId>,
    },
    /// The controller's time goes on.
    Resumed {
        /// The source that resumed it.
        by: Source,
    },
    /// The controller ends, and its line with it. Whatever that cuts short follows.
    Ends,
    /// The flash file was not as the device would have left it, and is now.
    FlashMended {
        /// The file.
        file: String,
        /// What was wrong with it.
        what: String,
    },
}

/// The reports that a sink wants, besides the news. Reports that no sink wants are not produced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EventFilter {
    /// Kinds of events of the device.
    pub kinds: Kinds,
    /// What goes in, and the states from which that begins.
    pub inputs: bool,
    /// The bytes that leave on the line.
    pub sent: bool,
}

impl EventFilter {
    /// Everything.
    pub const ALL: EventFilter = EventFilter { kinds: Kinds::ALL, inputs: true, sent: true };
    /// Everything needed to repeat a run, and nothing that follows from it.
    pub const INPUTS: EventFilter = EventFilter { kinds: Kinds::NONE, inputs: true, sent: false };

    /// Whether a report is wanted. Events of the line always are.
    #[must_use]
    pub fn include(&self, what: &ReportKind) -> bool {
        match what {
            ReportKind::Input { .. }
            | ReportKind::State { .. }
            | ReportKind::Stands { .. }
            | ReportKind::Goes => self.inputs,
            ReportKind::Sent { .. } => self.sent,
            ReportKind::Event { event, .. } => self.kinds.contain(event.kind()),
            ReportKind::News(_) | ReportKind::Missed { .. } => true,
        }
    }

    /// Everything that at least one of the two wants.
    #[must_use]
    pub fn and(self, other: EventFilter) -> EventFilter {
        EventFilter {
            kinds: self.kinds.and(other.kinds),
            inputs: self.inputs || other.inputs,
            sent: self.sent || other.sent,
        }
    }
}

/// Watches a running controller.
///
/// It is called by the task that runs the controller, between a command and its answer: it must
/// neither block nor take long. For consumers that take their time there are
/// queues.
pub trait Sink: Send {
    /// The reports it wants; asked once.
    fn wants(&self) -> EventFilter;

    /// Something happened. `explain` puts a command in the words people use, see
    /// [`Device::explain`](vimc4_device::Device::explain).
    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String);

    /// Everything that followed from an input, or from the passing of time, has been reported.
    /// Called for a sink that wants inputs; at its end too. `state` writes the device's present
    /// state down, which takes a while.
    fn settled(&mut self, _at: Time, _state: &dyn Fn() -> serde_json::Value) {}

    /// When it wants to be told that [time has passed](Sink::passes), if nothing is told before; asked
    /// after each report, and when somebody says that this has changed.
    /// It has no influence on what happens: time that does not pass by itself does not pass for a sink.
    fn due(&self) -> Option<Time> {
        None
    }

    /// Time has passed up to then, and everything that was due has been told. It wants to be told of a
    /// later time from now on, or of none.
    fn passes(&mut self, _at: Time) {}

    /// Whether it can take more reports, for sinks with a slower reader behind them. Until it can, the
    /// controller reads nothing from its clients, and time that jumps stands still. The sink wakes the
    /// task when it can take more.
    fn poll_ready(&mut self, _cx: &mut Context<'_>) -> Poll<()> {
        Poll::Ready(())
    }

    /// Whether it has seen enough; asked after each report. If so, it is
    /// detached.
    fn has_enough(&self) -> bool {
        false
    }
}

/// The number of a breakpoint, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct BreakpointId(pub u64);

impl BreakpointId {
    /// A breakpoint of the debugger itself, which is not listed.
    pub const INTERNAL: BreakpointId = BreakpointId(0);
}

impl fmt::Display for BreakpointId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
