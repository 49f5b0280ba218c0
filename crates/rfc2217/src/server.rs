//! The serving side as one piece.

use std::collections::VecDeque;

use crate::negotiation::{BINARY, COM_PORT, Negotiation};
use crate::port::{Port, Request};
use crate::telnet::{Framing, IAC, SB, SE, Token, escape};

/// How many requests wait to be fetched. If a client floods and nothing fetches, the oldest are
/// lost.
const MOST_REQUESTS: usize = 256;

/// How many bytes of answers wait to be fetched. A client that asks and never reads gets no more
/// answers, which would fill the memory.
const MOST_REPLIES: usize = 64 * 1024;

/// The serving side of one connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Server {
    framing: Framing,
    negotiation: Negotiation,
    port: Port,
    requests: VecDeque<Request>,
    replies: Vec<u8>,
}

impl Server {
    /// A new connection. `signature` is the answer to a client that asks what it talks to; `baud`
    /// is the speed of the port, in bits per second, until the client sets one.
    #[must_use]
    pub fn new(signature: &str, baud: u32) -> Server {
        let mut replies = Vec::new();
        let mut negotiation = Negotiation::default();
        negotiation.begin(|verb, option| replies.extend([IAC, verb.code(), option]));
        Server {
            framing: Framing::default(),
            negotiation,
            port: Port::new(signature, baud),
            requests: VecDeque::new(),
            replies,
        }
    }

    /// Takes what the client has sent, in pieces of any size, and moves the bytes for the device to
    /// its beginning. Returns how many these are; never more than came.
    pub fn receive(&mut self, bytes: &mut [u8]) -> usize {
        let mut count = 0;
        for at in 0..bytes.len() {
            let binary = self.negotiation.theirs(BINARY);
            match self.framing.take(bytes[at], binary) {
                None => {}
                Some(Token::Data(byte)) => {
                    bytes[count] = byte;
                    count += 1;
                }
                Some(Token::Option(verb, option)) => {
                    let knew = self.has_port();
                    if let Some(answer) = self.negotiation.hear(verb, option) {
                        self.reply(&[IAC, answer.code(), option]);
                    }
                    if self.has_port() && !knew {
                        // Some clients wait for it without asking.
                        let state = self.port.modem_state(0);
                        self.subnegotiate(&state);
                    }
                }
                Some(Token::Subnegotiation(text)) => {
                    if let [COM_PORT, request @ ..] = &text[..] {
                        self.hear(request);
                    }
                }
                Some(Token::Break) => self.request(Request::BreakKey),
            }
        }
        count
    }

    fn hear(&mut self, request: &[u8]) {
        let (mut requests, mut answers) = (Vec::new(), Vec::new());
        self.port.hear(
            request,
            |request| requests.push(request),
            |answer| answers.push(answer.to_vec()),
        );
        for request in requests {
            self.request(request);
        }
        for answer in answers {
            self.subnegotiate(&answer);
        }
    }

    fn request(&mut self, request: Request) {
        if self.requests.len() == MOST_REQUESTS {
            self.requests.pop_front();
        }
        self.requests.push_back(request);
    }

    fn reply(&mut self, bytes: &[u8]) {
        if self.replies.len() + bytes.len() <= MOST_REPLIES {
            self.replies.extend(bytes);
        }
    }

    fn subnegotiate(&mut self, text: &[u8]) {
        let mut whole = vec![IAC, SB, COM_PORT];
        escape(text, true, &mut whole);
        whole.extend([IAC, SE]);
        self.reply(&whole);
    }

    /// Whether the client has agreed to RFC 2217; otherwise it speaks plain Telnet, or neither.
    #[must_use]
    pub fn has_port(&self) -> bool {
        self.negotiation.theirs(COM_PORT) || self.negotiation.ours(COM_PORT)
    }

    /// Appends a device's bytes in the form in which they are sent to the client.
    pub fn send(&self, bytes: &[u8], out: &mut Vec<u8>) {
        escape(bytes, self.negotiation.ours(BINARY), out);
    }

    /// A line of the device, such as [`CTS`](crate::CTS), is on or off now; a client that wants to know
    /// is told. CTS and DSR are on at first, DCD and RI are off.
    pub fn set_line(&mut self, line: u8, on: bool) {
        if let Some(state) = self.port.set_line(line, on)
            && self.has_port()
        {
            self.subnegotiate(&state);
        }
    }

    /// The client's next request, in its order.
    pub fn next_request(&mut self) -> Option<Request> {
        self.requests.pop_front()
    }

    /// Replies of the Telnet protocol itself that are to be sent to the client.
    pub fn take_replies(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.replies)
    }
}
