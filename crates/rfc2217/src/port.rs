//! What a client asks of a serial port, and the answers (RFC 2217, section 3).

/// What a client wants of the port.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Request {
    /// The client's side now runs at this many bits per second.
    Baud(u32),
    /// A character now has this many data bits, 5 to 8.
    DataBits(u8),
    /// What the parity bit is now.
    Parity(Parity),
    /// How long the stop bit is now.
    StopBits(StopBits),
    /// DTR is on or off now.
    Dtr(bool),
    /// RTS is on or off now.
    Rts(bool),
    /// A break begins or ends.
    Break(bool),
    /// The break key was pressed: a break of the usual length.
    BreakKey,
    /// Sending to the client is suspended, or resumed.
    Suspend(bool),
    /// Bytes that arrived and were not read are to be discarded: those from the device, from the
    /// client, or from both.
    Purge {
        /// From the device.
        received: bool,
        /// From the client.
        sent: bool,
    },
    /// The client names itself, in bytes of its choice.
    Signature(Vec<u8>),
}

/// The parity bit of a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parity {
    /// There is none.
    #[default]
    None,
    /// An odd number of ones.
    Odd,
    /// An even number of ones.
    Even,
    /// Always a one.
    Mark,
    /// Always a zero.
    Space,
}

impl Parity {
    const ALL: [Parity; 5] = [Parity::None, Parity::Odd, Parity::Even, Parity::Mark, Parity::Space];

    /// Its name, in lower case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Parity::None => "none",
            Parity::Odd => "odd",
            Parity::Even => "even",
            Parity::Mark => "mark",
            Parity::Space => "space",
        }
    }
}

/// The length of a stop bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StopBits {
    /// One bit.
    #[default]
    One,
    /// Two bits.
    Two,
    /// One and a half bits.
    OneAndHalf,
}

impl StopBits {
    const ALL: [StopBits; 3] = [StopBits::One, StopBits::Two, StopBits::OneAndHalf];
}

/// The number that stands for one of several values; they count from 1.
fn number<T: PartialEq>(all: &[T], value: &T) -> u8 {
    let at = all.iter().position(|one| one == value).unwrap_or_default();
    u8::try_from(at + 1).unwrap_or(u8::MAX)
}

/// The value that a number stands for; 0 asks for the present one.
fn value<T: Copy>(all: &[T], number: u8) -> Option<T> {
    usize::from(number).checked_sub(1).and_then(|at| all.get(at)).copied()
}

/// The number of an answer is that of its request plus this.
const ANSWER: u8 = 100;

/// The speeds that are accepted, in bits per second. Others are answered with the present one.
const SPEEDS: std::ops::RangeInclusive<u32> = 50..=4_000_000;

/// Clear to send, a bit of the modem state as the others are.
pub const CTS: u8 = 0x10;
/// Data set ready.
pub const DSR: u8 = 0x20;
/// Ring indicator.
pub const RI: u8 = 0x40;
/// Data carrier detect.
pub const DCD: u8 = 0x80;
/// A bit of the modem state has changed; its value is the bit four places higher.
const DELTA: u8 = 4;

/// Bits of the line state: there is room to send.
const ROOM: u8 = 0x60;

/// The port as a client has set it, and what the client was last told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Port {
    signature: Box<[u8]>,
    baud: u32,
    data_bits: u8,
    parity: Parity,
    stop_bits: StopBits,
    dtr: bool,
    rts: bool,
    in_break: bool,
    /// Flow control to the device and from it, as the client wants it.
    outbound: u8,
    inbound: u8,
    line_mask: u8,
    modem_mask: u8,
    modem: u8,
}

impl Port {
    pub(crate) fn new(signature: &str, baud: u32) -> Port {
        Port {
            signature: signature.as_bytes().into(),
            baud,
            data_bits: 8,
            parity: Parity::None,
            stop_bits: StopBits::One,
            dtr: true,
            rts: true,
            in_break: false,
            outbound: 1,
            inbound: 14,
            line_mask: 0,
            modem_mask: 0xff,
            modem: CTS | DSR,
        }
    }

    /// A line of the device is on or off now. Returns the notice for the client, if it wants one.
    pub(crate) fn set_line(&mut self, line: u8, on: bool) -> Option<[u8; 2]> {
        let before = self.modem;
        self.modem = if on { before | line } else { before & !line };
        let changed = (before ^ self.modem) & self.modem_mask;
        (changed != 0).then(|| self.modem_state(changed >> DELTA))
    }

    /// What the client is told of the modem lines.
    pub(crate) fn modem_state(&self, deltas: u8) -> [u8; 2] {
        [ANSWER + 7, (self.modem | deltas) & self.modem_mask]
    }

    /// A subnegotiation without its option. Returns what to do and what to answer.
    pub(crate) fn hear(
        &mut self,
        request: &[u8],
        mut tell: impl FnMut(Request),
        mut answer: impl FnMut(&[u8]),
    ) {
        let Some((&code, rest)) = request.split_first() else { return };
        let reply = |value: u8| [ANSWER.wrapping_add(code), value];
        match (code, rest) {
            (0, []) => answer(&[&[ANSWER], &self.signature[..]].concat()),
            (0, text) => tell(Request::Signature(text.to_vec())),
            (1, &[a, b, c, d]) => {
                let baud = u32::from_be_bytes([a, b, c, d]);
                if SPEEDS.contains(&baud) {
                    self.baud = baud;
                    tell(Request::Baud(baud));
                }
                answer(&[&[ANSWER + 1][..], &self.baud.to_be_bytes()].concat());
            }
            (2, &[bits]) => {
                if (5..=8).contains(&bits) {
                    self.data_bits = bits;
                    tell(Request::DataBits(bits));
                }
                answer(&reply(self.data_bits));
            }
            (3, &[number_of]) => {
                if let Some(parity) = value(&Parity::ALL, number_of) {
                    self.parity = parity;
                    tell(Request::Parity(parity));
                }
                answer(&reply(number(&Parity::ALL, &self.parity)));
            }
            (4, &[number_of]) => {
                if let Some(bits) = value(&StopBits::ALL, number_of) {
                    self.stop_bits = bits;
                    tell(Request::StopBits(bits));
                }
                answer(&reply(number(&StopBits::ALL, &self.stop_bits)));
            }
            (5, &[control]) => answer(&reply(self.control(control, tell))),
            (6, _) => answer(&reply(ROOM)),
            (7, _) => answer(&self.modem_state(0)),
            (8, _) => tell(Request::Suspend(true)),
            (9, _) => tell(Request::Suspend(false)),
            (10, &[mask]) => {
                self.line_mask = mask;
                answer(&reply(mask));
            }
            (11, &[mask]) => {
                self.modem_mask = mask;
                answer(&reply(mask));
                answer(&self.modem_state(0));
            }
            (12, &[what]) => {
                if (1..=3).contains(&what) {
                    tell(Request::Purge { received: what & 1 != 0, sent: what & 2 != 0 });
                }
                // A client may wait for this answer to any request.
                answer(&reply(what));
            }
            // Anything that is not a well-formed request of this protocol.
            _ => {}
        }
    }

    /// Flow control, break and the client's lines. Returns the present setting.
    fn control(&mut self, control: u8, mut tell: impl FnMut(Request)) -> u8 {
        match control {
            1..=3 | 17 | 19 => self.outbound = control,
            14..=16 | 18 => self.inbound = control,
            5 | 6 => {
                self.in_break = control == 5;
                tell(Request::Break(self.in_break));
            }
            8 | 9 => {
                self.dtr = control == 8;
                tell(Request::Dtr(self.dtr));
            }
            11 | 12 => {
                self.rts = control == 11;
                tell(Request::Rts(self.rts));
            }
            _ => {}
        }
        let either = |on: bool, yes: u8| if on { yes } else { yes + 1 };
        match control {
            0..=3 | 17 | 19 => self.outbound,
            4..=6 => either(self.in_break, 5),
            7..=9 => either(self.dtr, 8),
            10..=12 => either(self.rts, 11),
            13..=16 | 18 => self.inbound,
            unknown => unknown,
        }
    }
}
