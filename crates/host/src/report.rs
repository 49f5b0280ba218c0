//! What can be watched from outside.

use std::fmt;
use std::sync::Arc;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::{Event, Kinds, Stamp, Time};

/// Something that happened in a running controller or on its line, with its model time.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Report {
    /// Bytes arrived on the line.
    Received {
        /// When.
        at: Time,
        /// Over which transport, by its label.
        from: Arc<str>,
        /// What.
        bytes: Bytes,
    },
    /// Bytes left on the line.
    Sent {
        /// When.
        at: Time,
        /// What.
        bytes: Bytes,
    },
    /// Something happened inside the device.
    Event(Stamp, Event),
    /// Somebody came or went, or bytes were lost on the way.
    News(Time, News),
}

/// Who has done something.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// A client of the line.
    Client {
        /// The transport, by its label.
        transport: String,
        /// Who, as far as that is known.
        client: Option<String>,
    },
    /// Somebody at the [`Handle`](crate::Handle), by the name that it was given.
    Controls(String),
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

/// Something that was done to a device and is no command: a byte that acts at once, the panel, the
/// power. It is all that is needed to do it again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Deed {
    /// A byte came that acts at once, see
    /// [`Device::is_urgent`](vimc4_device::Device::is_urgent).
    Byte(u8),
    /// A button was pressed, and released at the same instant unless it latches.
    Press(String),
    /// A button was pressed.
    Hold(String),
    /// A button was released.
    Release(String),
    /// A switch was put into a position.
    Turn(String, String),
    /// A signal was set.
    Set(String, i32),
    /// Several signals were set at the same instant, in this order.
    Several {
        /// What that is in one word, such as `erase`.
        what: String,
        /// The signals.
        signals: Vec<(String, i32)>,
    },
    /// The power was taken away or given back.
    Power(bool),
    /// The device was put back into an earlier state.
    Restore,
}

/// As it is ordered.
impl fmt::Display for Deed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Deed::Byte(byte) => write!(f, "{byte}"),
            Deed::Press(button) => write!(f, "press {button}"),
            Deed::Hold(button) => write!(f, "hold {button}"),
            Deed::Release(button) => write!(f, "release {button}"),
            Deed::Turn(switch, position) => write!(f, "{switch} {position}"),
            Deed::Set(input, value) if input.starts_with("input ") => write!(f, "{input} {value}"),
            Deed::Set(signal, value) => write!(f, "set {signal} {value}"),
            Deed::Several { what, .. } => f.write_str(what),
            Deed::Power(true) => f.write_str("power on"),
            Deed::Power(false) => f.write_str("power off"),
            Deed::Restore => f.write_str("restore"),
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
#[derive(Clone, Debug, PartialEq, Eq)]
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
    /// Somebody does something to the device that is no command. What comes of it follows. It is
    /// told where commands are wanted.
    Input {
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
        why: Option<&'static str>,
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
    /// all the same; a real device would hear noise. Of even parity, and of 7 bits, a pseudo
    /// terminal tells nothing.
    WrongParity {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The client's parity: `odd`, `mark` or `space`.
        parity: &'static str,
    },
    /// A client has switched one of its handshake lines.
    HostLine {
        /// The transport, by its label.
        transport: Arc<str>,
        /// The line: `DTR` or `RTS`.
        line: &'static str,
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
        /// The transport of the next client, by its label.
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
        right: &'static str,
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
    /// The flash file was not as the device would have left it, and is now.
    FlashMended {
        /// The file.
        file: String,
        /// What was wrong with it.
        what: String,
    },
}

/// What a sink wants to see. What nobody wants is not made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wants {
    /// Kinds of events of the device.
    pub kinds: Kinds,
    /// The bytes on the line.
    pub bytes: bool,
}

/// Watches a running controller.
///
/// It is called by the task that runs the controller, between a command and its answer: it must
/// neither block nor take long.
pub trait Sink: Send {
    /// What it wants to see; asked once.
    fn wants(&self) -> Wants;

    /// Something happened. `explain` puts a command in the words people use, see
    /// [`Device::explain`](vimc4_device::Device::explain).
    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String);
}
