//! A client that has settings and lines as at a serial port: RFC 2217.

use std::collections::VecDeque;
use std::sync::Arc;

use vimc4_device::ModemLine;
use vimc4_rfc2217::{Parity, Request, Server};

use crate::LineEvent;

/// How a client has set its port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Settings {
    baud: u32,
    data_bits: u8,
    parity: Parity,
}

/// One client's side of the port.
#[derive(Debug)]
pub(super) struct Telnet {
    server: Server,
    settings: Settings,
    /// Those that were compared with the device's line already.
    compared: Option<(Settings, u32)>,
    dtr: bool,
    rts: bool,
    /// Nothing is to be sent to the client.
    suspended: bool,
    /// What goes out, made ready.
    scratch: Vec<u8>,
}

impl Telnet {
    /// A client that has just come to a line of this speed, in bits per second.
    pub(super) fn new(baud: u32) -> Telnet {
        Telnet {
            server: Server::new("vimc4", baud),
            settings: Settings { baud, data_bits: 8, parity: Parity::None },
            compared: None,
            dtr: true,
            rts: true,
            suspended: false,
            scratch: Vec::new(),
        }
    }

    /// Takes what has come, leaves at its beginning what is for the device, and says how much that is.
    pub(super) fn receive(
        &mut self,
        bytes: &mut [u8],
        line: u32,
        label: &Arc<str>,
        news: &mut VecDeque<LineEvent>,
    ) -> usize {
        let count = self.server.receive(bytes);
        let mut switched = |line: &'static str, on| {
            let transport = Arc::clone(label);
            news.push_back(LineEvent::HostLine { transport, line: line.into(), on });
        };
        while let Some(request) = self.server.next_request() {
            match request {
                Request::Baud(baud) => self.settings.baud = baud,
                Request::DataBits(bits) => self.settings.data_bits = bits,
                Request::Parity(parity) => self.settings.parity = parity,
                // A client says what its lines are whenever it opens the port.
                Request::Dtr(on) if on != self.dtr => {
                    self.dtr = on;
                    switched("DTR", on);
                }
                Request::Rts(on) if on != self.rts => {
                    self.rts = on;
                    switched("RTS", on);
                }
                Request::Break(on) => switched("BREAK", on),
                Request::BreakKey => {
                    switched("BREAK", true);
                    switched("BREAK", false);
                }
                Request::Suspend(on) => self.suspended = on,
                // A second stop bit is heard as a pause. Between the network and the device nothing is
                // kept that could be forgotten.
                _ => {}
            }
        }
        if count > 0 {
            self.compare(line, label, news);
        }
        count
    }

    /// Looks, once for each way it is set, whether the client talks as the device does.
    fn compare(&mut self, line: u32, label: &Arc<str>, news: &mut VecDeque<LineEvent>) {
        if self.compared.replace((self.settings, line)) == Some((self.settings, line)) {
            return;
        }
        let Settings { baud, data_bits, parity } = self.settings;
        let transport = || Arc::clone(label);
        if baud != line {
            news.push_back(LineEvent::WrongSpeed {
                transport: transport(),
                client: baud,
                line,
                noise: false,
            });
        }
        if parity != Parity::None {
            let parity = parity.name().into();
            news.push_back(LineEvent::WrongParity { transport: transport(), parity });
        }
        if data_bits != 8 {
            news.push_back(LineEvent::WrongDataBits { transport: transport(), bits: data_bits });
        }
    }

    /// A line of the device is on or off now.
    pub(super) fn set_line(&mut self, line: ModemLine, on: bool) {
        let line = match line {
            ModemLine::Cts => vimc4_rfc2217::CTS,
            ModemLine::Dsr => vimc4_rfc2217::DSR,
            ModemLine::Dcd => vimc4_rfc2217::DCD,
            ModemLine::Ri => vimc4_rfc2217::RI,
        };
        self.server.set_line(line, on);
    }

    /// The speed to which the client has set its port.
    pub(super) fn baud(&self) -> u32 {
        self.settings.baud
    }

    /// What the client does not want to be sent now.
    pub(super) fn is_suspended(&self) -> bool {
        self.suspended
    }

    /// What is to be sent on behalf of the protocol itself.
    pub(super) fn take_replies(&mut self) -> Vec<u8> {
        self.server.take_replies()
    }

    /// What a device says, as it has to be sent.
    pub(super) fn escaped(&mut self, bytes: &[u8]) -> &[u8] {
        self.scratch.clear();
        self.server.send(bytes, &mut self.scratch);
        &self.scratch
    }
}
