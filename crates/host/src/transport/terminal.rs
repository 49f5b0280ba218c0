//! The settings of a terminal.

use std::io;
use std::os::fd::AsFd;

use rustix::termios::{
    ControlModes, InputModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcsetattr,
};

/// Raw mode at the given speed: every byte passes as it is, and reading waits for the first.
/// A client may change all of it; a speed that is not in the tables of the system is left as it
/// was.
pub(super) fn set_raw(terminal: impl AsFd, baud: u32) -> io::Result<()> {
    let mut settings: Termios = tcgetattr(&terminal)?;
    settings.make_raw();
    settings.special_codes[SpecialCodeIndex::VMIN] = 1;
    settings.special_codes[SpecialCodeIndex::VTIME] = 0;
    settings.input_modes.remove(InputModes::IXOFF | InputModes::IXANY);
    settings.control_modes.remove(ControlModes::CRTSCTS | ControlModes::CSTOPB);
    settings.control_modes |= ControlModes::CREAD | ControlModes::CLOCAL;
    let _ = settings.set_speed(baud);
    tcsetattr(terminal, OptionalActions::Now, &settings)?;
    Ok(())
}

/// The speed it is set to, in bits per second.
pub(super) fn speed(terminal: impl AsFd) -> io::Result<u32> {
    Ok(tcgetattr(terminal)?.output_speed())
}
