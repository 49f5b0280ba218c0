//! What can be watched from outside.

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::{CommandNumber, Event, Kinds, OwnedInput, Time};

pub use vimc4_device::Deed;

/// Something that went into a running controller, came out of it or happened on its line.
///
/// Each can be written down and read again. The [states](What::State) and [inputs](What::Input) of a
/// controller, in their order, are a recording: a device that is put into the state and is given
/// the inputs at their times does all the rest again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Which controller, by the [name](crate::Runner::named) that it has in this process.
    pub controller: Arc<str>,
    /// The model time. What goes in has the one time at which it was handled.
    pub at: Time,
    /// What.
    pub what: What,
}

/// What a [`Report`] tells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum What {
    /// Something goes into the device. That time passes is told where somebody has ordered it,
    /// when it has passed.
    Input {
        /// Who has done it.
        by: Source,
        /// What.
        input: OwnedInput,
    },
    /// The device is in this state: told once to a sink that begins to watch what goes in, and whenever
    /// somebody puts it back into an earlier one. Its time goes on from there.
    State {
        /// Who has put it into the state; `None` for a sink that begins to watch.
        by: Option<Source>,
        /// The device's [state](vimc4_device::Device::State), as it is written down.
        state: serde_json::Value,
    },
    /// The device is led cause by cause, because its time is [paused](News::Paused) or may be by a
    /// breakpoint, and has come so far: everything is done that was due before, and of what is due at
    /// this very instant so many causes, counted from the last of these reports, inputs or states at
    /// it; `None` if all of it is. It is told whenever something has been done. What else is due is
    /// done when something later is, or never, if another state is put in.
    Stands {
        /// How many causes.
        causes: Option<u32>,
    },
    /// The device is not led cause by cause any more: all that is due by now is done.
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
    News(News),
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
            What::Event { event, .. } => Some(event),
            _ => None,
        }
    }

    /// The news that it tells.
    #[must_use]
    pub fn news(&self) -> Option<&News> {
        match &self.what {
            What::News(news) => Some(news),
            _ => None,
        }
    }
}

/// Who has done something.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// A client of the line.
    Client {
        /// The transport, by its label.
        transport: Arc<str>,
        /// Who, as far as that is known.
        client: Option<Arc<str>>,
    },
    /// Somebody at the [`Handle`](crate::Handle), by the name that it was given.
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

/// What came of something that was done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Something is not as it was before, or was said.
    Something,
    /// The device is as it was.
    Nothing {
        /// Why, as far as that is known.
        why: Option<&'static str>,
    },
}

/// What happens at the transports of a line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum News {
    /// A client opened the line.
    Opened {
        /// The transport, by its label.
        transport: Arc<str>,
        /// Who, as far as that is known.
        client: String,
        /// Whether it only hears what others are answered.
        observes: bool,
    },
    /// A client closed the line or vanished, or it was taken from it.
    Closed {
        /// The transport, by its label.
        transport: Arc<str>,
        /// Who, as far as that is known.
        client: String,
        /// Whether it only heard what others were answered.
        observes: bool,
        /// Who has taken the line over from it.
        taken_by: Option<String>,
    },
    /// A client that only observes has sent something, which the device does not get. It is told
    /// once for each.
    Unheard {
        /// The transport, by its label.
        transport: Arc<str>,
        /// Who.
        client: String,
    },
    /// A client was turned away because another one holds the line.
    Refused {
        /// The transport, by its label.
        transport: Arc<str>,
        /// Who was turned away.
        client: String,
        /// Who holds the line.
        holder: String,
    },
    /// Somebody does something to the device that is not a command. What comes of it follows. It is
    /// told where commands are wanted.
    Deed {
        /// Who.
        by: Source,
        /// What.
        deed: Deed,
    },
    /// What was done has changed nothing.
    NoEffect {
        /// Who did it.
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
        /// Who, as far as that is known.
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
        /// The transport of the client that has left if others are still there, of the next one
        /// else; and of who spoils it.
        transport: Arc<str>,
        /// The half line.
        half: Bytes,
        /// The next client has sent something; else it has only come.
        spoils: bool,
    },
    /// A client ends its lines with LF alone, which ends nothing here: it waits in vain, as with a
    /// real device. It is told once for each client.
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
    /// So much has come while the power was off, and nobody heard it. It is told when the power
    /// comes on, or when the controller ends.
    PowerWasOff {
        /// How many bytes.
        bytes: u64,
    },
    /// The controller's time stands still from now on, and nothing is read from its line.
    Paused {
        /// Who has paused it; `None` if it was a breakpoint.
        by: Option<Source>,
        /// The breakpoints that were met just now: also those that are met step by step.
        breakpoints: Vec<BreakpointId>,
    },
    /// The controller's time goes on.
    Resumed {
        /// Who has it go on.
        by: Source,
    },
    /// The controller ends, and its line with it. What that cuts short follows.
    Ends,
    /// The flash file was not as the device would have left it, and is now.
    FlashMended {
        /// The file.
        file: String,
        /// What was wrong with it.
        what: String,
    },
}

/// What a sink wants to see, besides the news. What no sink wants is not produced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wants {
    /// Kinds of events of the device.
    pub kinds: Kinds,
    /// What goes in, and the states from which that begins.
    pub inputs: bool,
    /// The bytes that leave on the line.
    pub sent: bool,
}

impl Wants {
    /// Everything.
    pub const ALL: Wants = Wants { kinds: Kinds::ALL, inputs: true, sent: true };
    /// All that is needed to do everything again, and nothing that comes of it.
    pub const INPUTS: Wants = Wants { kinds: Kinds::NONE, inputs: true, sent: false };

    /// What either wants.
    #[must_use]
    pub fn and(self, other: Wants) -> Wants {
        Wants {
            kinds: self.kinds.and(other.kinds),
            inputs: self.inputs || other.inputs,
            sent: self.sent || other.sent,
        }
    }
}

/// Watches a running controller.
///
/// It is called by the task that runs the controller, between a command and its answer: it must
/// neither block nor take long. [`Reports`](crate::Reports) are for those who want to take their
/// time.
pub trait Sink: Send {
    /// What it wants to see; asked once.
    fn wants(&self) -> Wants;

    /// Something happened. `explain` puts a command in the words people use, see
    /// [`Device::explain`](vimc4_device::Device::explain).
    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String);

    /// All that came of an input, or of some time, has been told, to a sink that wants to see what
    /// goes in; at its end too. `state` writes the device's present state down, which takes a while.
    fn settled(&mut self, _at: Time, _state: &dyn Fn() -> serde_json::Value) {}

    /// When it wants to be told that [time has passed](Sink::passes), if nothing is told before; asked
    /// after each report, and when somebody says that this [has changed](crate::Runner::look_again).
    /// It has no influence on what happens: time that does not pass by itself does not pass for a sink.
    fn due(&self) -> Option<Time> {
        None
    }

    /// Time has passed up to then, and everything that was due has been told. It wants to be told of a
    /// later time from now on, or of none.
    fn passes(&mut self, _at: Time) {}

    /// Whether it has seen enough; asked after each report. It is let go of then, as if somebody
    /// had [detached](crate::Handle::detach) it.
    fn has_enough(&self) -> bool {
        false
    }
}

/// The number of a breakpoint of a running controller, see
/// [`Handle::break_when`](crate::Handle::break_when).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct BreakpointId(pub u64);

/// A sink that watches, by which it can be [detached](crate::Handle::detach).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SinkId(pub(crate) u64);
