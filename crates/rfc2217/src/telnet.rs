//! Telnet's framing: what is data, and what is said about the connection (RFC 854, RFC 855).

/// Begins everything that is no data; twice it is a byte of data.
pub(crate) const IAC: u8 = 255;
/// Ends a subnegotiation.
pub(crate) const SE: u8 = 240;
/// The client's break key.
const BREAK: u8 = 243;
/// Begins a subnegotiation.
pub(crate) const SB: u8 = 250;

const CR: u8 = b'\r';
const NUL: u8 = 0;

/// How long a subnegotiation may be, in bytes. All known ones fit; a longer one is skipped, so that
/// a client cannot fill the memory.
const LONGEST: usize = 1_024;

/// What is said of an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verb {
    Will,
    Wont,
    Do,
    Dont,
}

impl Verb {
    pub(crate) fn code(self) -> u8 {
        match self {
            Verb::Will => 251,
            Verb::Wont => 252,
            Verb::Do => 253,
            Verb::Dont => 254,
        }
    }

    fn of(code: u8) -> Option<Verb> {
        [Verb::Will, Verb::Wont, Verb::Do, Verb::Dont].into_iter().find(|verb| verb.code() == code)
    }
}

/// What a byte has completed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Token {
    /// A byte for the device.
    Data(u8),
    /// Something of an option.
    Option(Verb, u8),
    /// A subnegotiation, from the option on.
    Subnegotiation(Vec<u8>),
    /// The break key.
    Break,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Data,
    /// After a CR, which a NUL that is no data may follow.
    AfterCr,
    Iac,
    Verb(Verb),
    Sub,
    SubIac,
}

/// The state of the parser in the stream.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Framing {
    state: State,
    sub: Vec<u8>,
}

impl Framing {
    /// Takes a byte. `binary` says that the client does not send text, in which a NUL may follow a
    /// CR.
    pub(crate) fn take(&mut self, byte: u8, binary: bool) -> Option<Token> {
        let (state, token) = match std::mem::take(&mut self.state) {
            State::AfterCr if byte == NUL => (State::Data, None),
            State::Data | State::AfterCr => match byte {
                IAC => (State::Iac, None),
                CR if !binary => (State::AfterCr, Some(Token::Data(CR))),
                byte => (State::Data, Some(Token::Data(byte))),
            },
            State::Iac => match byte {
                IAC => (State::Data, Some(Token::Data(IAC))),
                SB => {
                    self.sub.clear();
                    (State::Sub, None)
                }
                BREAK => (State::Data, Some(Token::Break)),
                // The others concern nothing that a serial port has.
                byte => (Verb::of(byte).map_or(State::Data, State::Verb), None),
            },
            State::Verb(verb) => (State::Data, Some(Token::Option(verb, byte))),
            State::Sub if byte == IAC => (State::SubIac, None),
            State::Sub => {
                self.keep(byte);
                (State::Sub, None)
            }
            State::SubIac => match byte {
                IAC => {
                    self.keep(IAC);
                    (State::Sub, None)
                }
                SE => {
                    let sub = std::mem::take(&mut self.sub);
                    let whole = (sub.len() <= LONGEST).then_some(Token::Subnegotiation(sub));
                    (State::Data, whole)
                }
                // Anything else is an error of the client's. As what follows may be more of the same, all
                // of it is left out, like a subnegotiation that is too long.
                _ => {
                    self.sub.resize(LONGEST + 1, 0);
                    (State::Sub, None)
                }
            },
        };
        self.state = state;
        token
    }

    fn keep(&mut self, byte: u8) {
        if self.sub.len() <= LONGEST {
            self.sub.push(byte);
        }
    }
}

/// Writes data so that it arrives unchanged. `binary` says that it is not text.
pub(crate) fn escape(bytes: &[u8], binary: bool, out: &mut Vec<u8>) {
    for &byte in bytes {
        out.push(byte);
        match byte {
            IAC => out.push(IAC),
            CR if !binary => out.push(NUL),
            _ => {}
        }
    }
}
