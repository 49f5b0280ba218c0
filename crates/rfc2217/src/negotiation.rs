//! What both sides have agreed on (RFC 855). Nothing is sent twice, so that two sides cannot go on
//! agreeing for ever (RFC 1143).

use crate::telnet::Verb;

/// Data is not text (RFC 856).
pub(crate) const BINARY: u8 = 0;
/// There is no half-duplex line to be turned around (RFC 858).
const SUPPRESS_GO_AHEAD: u8 = 3;
/// A serial port (RFC 2217).
pub(crate) const COM_PORT: u8 = 44;

/// All options that are known.
const KNOWN: [u8; 3] = [BINARY, SUPPRESS_GO_AHEAD, COM_PORT];

/// One option on one side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Side {
    on: bool,
    /// It was asked for, and what comes next is the answer.
    asked: bool,
}

/// The options on both sides.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Negotiation {
    ours: [Side; KNOWN.len()],
    theirs: [Side; KNOWN.len()],
}

fn place(option: u8) -> Option<usize> {
    KNOWN.iter().position(|known| *known == option)
}

impl Negotiation {
    /// What is offered and asked for at the beginning.
    pub(crate) fn begin(&mut self, mut say: impl FnMut(Verb, u8)) {
        for option in [BINARY, SUPPRESS_GO_AHEAD] {
            if let Some(at) = place(option) {
                self.ours[at].asked = true;
                say(Verb::Will, option);
            }
        }
        for option in [BINARY, COM_PORT] {
            if let Some(at) = place(option) {
                self.theirs[at].asked = true;
                say(Verb::Do, option);
            }
        }
    }

    /// The client says something about an option. Returns the answer.
    pub(crate) fn hear(&mut self, verb: Verb, option: u8) -> Option<Verb> {
        let (sides, wants, yes, no) = match verb {
            Verb::Will => (&mut self.theirs, true, Verb::Do, Verb::Dont),
            Verb::Wont => (&mut self.theirs, false, Verb::Do, Verb::Dont),
            Verb::Do => (&mut self.ours, true, Verb::Will, Verb::Wont),
            Verb::Dont => (&mut self.ours, false, Verb::Will, Verb::Wont),
        };
        let Some(at) = place(option) else { return wants.then_some(no) };
        let was = std::mem::replace(&mut sides[at], Side { on: wants, asked: false });
        (!was.asked && was.on != wants).then_some(if wants { yes } else { no })
    }

    /// Whether this side has agreed to use the option.
    pub(crate) fn ours(&self, option: u8) -> bool {
        place(option).is_some_and(|at| self.ours[at].on)
    }

    /// Whether the client has.
    pub(crate) fn theirs(&self, option: u8) -> bool {
        place(option).is_some_and(|at| self.theirs[at].on)
    }
}
