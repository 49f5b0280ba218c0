//! The modem lines of one serial port: which side drives which line, and what a program is told.
//!
//! Nothing here knows a process or a kernel. The bits are those of `TIOCMGET`, which are the
//! same on every architecture that is served.

/// Data terminal ready, driven by the program.
pub const DTR: u32 = 0x002;
/// Request to send, driven by the program.
pub const RTS: u32 = 0x004;
/// Clear to send, driven by the far side.
pub const CTS: u32 = 0x020;
/// Data carrier detect, driven by the far side.
pub const DCD: u32 = 0x040;
/// Ring indicator, driven by the far side.
pub const RI: u32 = 0x080;
/// Data set ready, driven by the far side.
pub const DSR: u32 = 0x100;

/// The general purpose outputs of a UART, which go nowhere. A program reads back what it has set.
const OUT: u32 = 0x2000 | 0x4000;

/// What a program can set, as the kernel's serial ports have it.
const OUTPUTS: u32 = DTR | RTS | OUT;

/// The lines that the far side changes, which `TIOCMIWAIT` can wait for.
const INPUTS: u32 = CTS | DCD | RI | DSR;

/// What is at the far end of the handshake lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Far {
    /// A device that is switched on: DSR is on, and CTS is on while the device takes more.
    #[default]
    On,
    /// A plug that connects RTS with CTS and DTR with DSR, as most cables do that only imitate a
    /// handshake.
    Loop,
    /// Nothing: a cable of three wires. The program's own lines can still be set and read.
    None,
}

/// The device at the far side of the lines, which is told what the program does to its own lines.
///
/// It is called by the thread that answers: it must not take long.
pub trait Peer: Send {
    /// The program has switched one of its lines.
    fn hears(&mut self, line: HostLine, on: bool);

    /// Whether the device would take more now, counting everything that the program has written so
    /// far. `None` if nothing newer is known than what was last reported.
    fn takes_more(&mut self) -> Option<bool> {
        None
    }
}

/// A line that the program drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostLine {
    /// Data terminal ready.
    Dtr,
    /// Request to send.
    Rts,
}

/// The lines of a port, as its program sees them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lines {
    far: Far,
    dcd: bool,
    /// The far side takes more.
    ready: bool,
    /// A line on which the device shows something of its own, and whether it is on.
    own: Option<(u32, bool)>,
    outputs: u32,
    counts: Counts,
    settings: Settings,
}

/// How often the lines of the far side have changed, for `TIOCGICOUNT`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Changes of CTS.
    pub cts: u32,
    /// Changes of DSR.
    pub dsr: u32,
    /// Changes of RI.
    pub ri: u32,
    /// Changes of DCD.
    pub dcd: u32,
}

/// What `TIOCGSERIAL` shows and `TIOCSSERIAL` sets, as far as it means anything without a chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Flags such as low latency.
    pub flags: u32,
    /// Bits per second at a divisor of 1.
    pub baud_base: u32,
    /// The divisor for a speed of one's own.
    pub custom_divisor: u32,
    /// Hundredths of a second that closing takes.
    pub close_delay: u16,
    /// Hundredths of a second in which closing lets the output leave.
    pub closing_wait: u16,
}

impl Default for Settings {
    /// Those of the kernel for the usual chip.
    fn default() -> Settings {
        let (close_delay, closing_wait) = (50, 3_000);
        Settings { flags: 0, baud_base: 115_200, custom_divisor: 0, close_delay, closing_wait }
    }
}

/// What something did to the lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use = "whoever waits for a change must be told"]
pub struct Changed {
    bits: u32,
    levels: u32,
}

impl Changed {
    /// Whether it ends a `TIOCMIWAIT` for these lines.
    #[must_use]
    pub fn wakes(self, mask: u32) -> bool {
        self.bits & mask & INPUTS != 0
    }

    /// What the program did to its own lines.
    pub fn host(self) -> impl Iterator<Item = (HostLine, bool)> {
        [(HostLine::Dtr, DTR), (HostLine::Rts, RTS)]
            .into_iter()
            .filter(move |(_, bit)| self.bits & bit != 0)
            .map(move |(line, bit)| (line, self.levels & bit != 0))
    }
}

impl Lines {
    /// A port that is not open yet. `dcd` connects DCD like the other lines. Otherwise DCD stays
    /// off, because most devices other than modems leave it so, and DOS programs take a carrier for
    /// a caller.
    #[must_use]
    pub fn new(far: Far, dcd: bool) -> Lines {
        let (counts, settings) = (Counts::default(), Settings::default());
        Lines { far, dcd, ready: true, own: None, outputs: 0, counts, settings }
    }

    /// The levels of all lines, for `TIOCMGET`.
    #[must_use]
    pub fn levels(&self) -> u32 {
        let when = |on: bool, bit: u32| if on { bit } else { 0 };
        let inputs = match self.far {
            Far::None => 0,
            Far::On => {
                let others = when(self.ready, CTS) | DSR | when(self.dcd, DCD);
                self.own.map_or(others, |(line, on)| others & !line | when(on, line))
            }
            Far::Loop => {
                let dtr = self.outputs & DTR != 0;
                when(self.outputs & RTS != 0, CTS) | when(dtr, DSR) | when(dtr && self.dcd, DCD)
            }
        };
        self.outputs | inputs
    }

    /// How often the far side's lines have changed.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The settings of the port.
    #[must_use]
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// Takes over new settings.
    pub fn set_settings(&mut self, settings: Settings) {
        self.settings = settings;
    }

    /// The program sets its lines to this, for `TIOCMSET`.
    pub fn set(&mut self, bits: u32) -> Changed {
        self.change(|lines| lines.outputs = bits & OUTPUTS)
    }

    /// The program switches these lines on, for `TIOCMBIS`.
    pub fn switch_on(&mut self, bits: u32) -> Changed {
        self.change(|lines| lines.outputs |= bits & OUTPUTS)
    }

    /// The program switches these lines off, for `TIOCMBIC`.
    pub fn switch_off(&mut self, bits: u32) -> Changed {
        self.change(|lines| lines.outputs &= !bits)
    }

    /// A first program has opened the port: a serial port switches DTR and RTS on.
    pub fn opened(&mut self) -> Changed {
        self.switch_on(DTR | RTS)
    }

    /// The last program has closed it: both go off.
    pub fn closed(&mut self) -> Changed {
        self.switch_off(DTR | RTS)
    }

    /// The device at the far side takes more now, or does not.
    pub fn set_ready(&mut self, ready: bool) -> Changed {
        self.change(|lines| lines.ready = ready)
    }

    /// The device at the far side switches a line of its own, a bit of [`levels`](Lines::levels).
    pub fn set_line(&mut self, line: u32, on: bool) -> Changed {
        self.change(|lines| lines.own = Some((line & INPUTS, on)))
    }

    fn change(&mut self, change: impl FnOnce(&mut Lines)) -> Changed {
        let before = self.levels();
        change(self);
        let levels = self.levels();
        let bits = before ^ levels;
        let Counts { cts, dsr, ri, dcd } = &mut self.counts;
        for (count, bit) in [(cts, CTS), (dsr, DSR), (ri, RI), (dcd, DCD)] {
            if bits & bit != 0 {
                *count = count.wrapping_add(1);
            }
        }
        Changed { bits, levels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(far: Far, dcd: bool) -> Lines {
        let mut lines = Lines::new(far, dcd);
        let _ = lines.opened();
        lines
    }

    #[test]
    fn the_far_side_is_what_was_asked_for() {
        let both = DTR | RTS;
        assert_eq!(open(Far::On, false).levels(), both | CTS | DSR);
        assert_eq!(open(Far::On, true).levels(), both | CTS | DSR | DCD);
        assert_eq!(open(Far::Loop, false).levels(), both | CTS | DSR);
        assert_eq!(open(Far::Loop, true).levels(), both | CTS | DSR | DCD);
        assert_eq!(open(Far::None, true).levels(), both);
        // Before it is opened a port drives nothing.
        assert_eq!(Lines::new(Far::On, false).levels(), CTS | DSR);
        assert_eq!(Lines::new(Far::Loop, true).levels(), 0);
    }

    #[test]
    fn a_loop_follows_each_line() {
        let mut lines = open(Far::Loop, true);
        for (output, inputs) in [(RTS, CTS), (DTR, DSR | DCD)] {
            let off = lines.switch_off(output);
            assert_eq!(lines.levels() & (output | inputs), 0);
            assert!(off.wakes(inputs) && !off.wakes(INPUTS & !inputs));
            assert!(lines.switch_on(output).wakes(inputs));
            assert_eq!(lines.levels() & (output | inputs), output | inputs);
        }
        // Once when it was switched on at the opening, then off and on again.
        assert_eq!(lines.counts(), Counts { cts: 3, dsr: 3, ri: 0, dcd: 3 });
    }

    #[test]
    fn only_outputs_can_be_set_and_a_line_that_stays_is_no_change() {
        let mut lines = open(Far::None, false);
        let changed = lines.set(u32::MAX);
        assert_eq!(changed.host().count(), 0);
        assert!(!changed.wakes(u32::MAX));
        assert_eq!(lines.levels(), DTR | RTS | OUT);
        let _ = lines.switch_off(u32::MAX);
        assert_eq!(lines.levels(), 0);
        assert_eq!(lines.set(RTS).host().collect::<Vec<_>>(), [(HostLine::Rts, true)]);
        let closed = lines.closed();
        assert_eq!(closed.host().collect::<Vec<_>>(), [(HostLine::Rts, false)]);
        let opened = lines.opened().host().collect::<Vec<_>>();
        assert_eq!(opened, [(HostLine::Dtr, true), (HostLine::Rts, true)]);
    }

    #[test]
    fn a_buffer_shows_on_cts_where_a_device_drives_it() {
        for (far, moves) in [(Far::On, true), (Far::Loop, false), (Far::None, false)] {
            let mut lines = open(far, false);
            let before = lines.counts().cts;
            assert_eq!(lines.set_ready(false).wakes(CTS), moves);
            assert_eq!(lines.levels() & CTS != 0, far == Far::Loop);
            assert!(!lines.set_ready(false).wakes(CTS), "nothing has changed");
            assert_eq!(lines.set_ready(true).wakes(CTS), moves);
            assert_eq!(lines.counts().cts - before, if moves { 2 } else { 0 });
            // A line that was not asked about wakes no waiting thread.
            assert!(!lines.set_ready(false).wakes(DSR | DCD | RI | RTS));
        }
    }

    #[test]
    fn a_device_may_show_something_on_any_line() {
        for line in [CTS, DSR, DCD, RI] {
            let mut lines = open(Far::On, true);
            let others = lines.levels() & !line;
            let _ = lines.set_line(line, false);
            assert_eq!(lines.levels(), others);
            let pressed = lines.set_line(line, true);
            assert!(pressed.wakes(line) && !pressed.wakes(INPUTS & !line));
            assert_eq!(lines.levels(), others | line);
            // CTS no longer says whether the device takes more.
            assert!(!lines.set_ready(false).wakes(line));
        }
        // Where the far side is no device, it has no such line.
        for far in [Far::Loop, Far::None] {
            assert!(!open(far, false).set_line(RI, true).wakes(RI));
        }
    }
}
