//! The settings of a terminal.

use std::io;
use std::os::fd::AsFd;

use rustix::termios::{
    ControlModes, InputModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcsetattr,
};

/// What shows of a parity that a client has asked for.
const PARITY: ControlModes = ControlModes::PARODD.union(STICKY);

/// The same bit in every byte.
#[cfg(target_os = "linux")]
const STICKY: ControlModes = ControlModes::CMSPAR;
#[cfg(not(target_os = "linux"))]
const STICKY: ControlModes = ControlModes::empty();

/// Raw mode at the given speed: every byte passes as it is, and reading waits for the first.
/// A client may change all of it; a speed that is not in the tables of the system is left as it
/// was.
pub(super) fn set_raw(terminal: impl AsFd, baud: u32) -> io::Result<()> {
    let mut settings: Termios = tcgetattr(&terminal)?;
    settings.make_raw();
    settings.special_codes[SpecialCodeIndex::VMIN] = 1;
    settings.special_codes[SpecialCodeIndex::VTIME] = 0;
    settings.input_modes = InputModes::empty();
    settings.control_modes.remove(ControlModes::CRTSCTS | ControlModes::CSTOPB | PARITY);
    settings.control_modes |= ControlModes::CREAD | ControlModes::CLOCAL;
    let _ = settings.set_speed(baud);
    tcsetattr(terminal, OptionalActions::Now, &settings)?;
    Ok(())
}

/// How a client has set its line, as far as a pseudo-terminal shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LineSettings {
    /// Bits per second.
    pub(super) baud: u32,
    /// The parity it has asked for, if that shows. The system keeps 8 bits without parity
    /// whatever is asked for; of even parity and of 7 bits nothing is left, and many a program is
    /// told that they are invalid.
    pub(super) parity: Option<&'static str>,
}

impl LineSettings {
    pub(super) fn of(terminal: impl AsFd) -> io::Result<LineSettings> {
        let settings = tcgetattr(terminal)?;
        let modes = settings.control_modes;
        Ok(LineSettings {
            baud: settings.output_speed(),
            parity: match (modes.intersects(STICKY), modes.contains(ControlModes::PARODD)) {
                (true, true) => Some("mark"),
                (true, false) => Some("space"),
                (false, true) => Some("odd"),
                (false, false) => None,
            },
        })
    }
}
