//! A small driver for isel controllers, as any project may have one. It knows nothing of virtual
//! controllers: whatever reads and writes bytes is its port.
#![forbid(unsafe_code)]

use std::io::{self, Read, Write};

use thiserror::Error;

/// Why the controller did not do what it was asked for.
#[derive(Debug, Error)]
pub enum Error {
    /// `2`
    #[error("a limit switch was reached; make a reference run before the next move")]
    LimitSwitch,
    /// `4`
    #[error("the controller knows no axes, as after a power failure; open it again")]
    NoAxes,
    /// `9`
    #[error("the power stage is off; release the emergency stop, press ON and open it again")]
    PowerStageOff,
    /// `F`
    #[error("somebody pressed STOP; resume to finish the move")]
    Stopped,
    /// `H`
    #[error("the cover is open; close it")]
    CoverOpen,
    /// Any other answer.
    #[error("the controller answered {0:?}; see its manual")]
    Refused(char),
    /// The port failed, or nothing came in time: then the motion may still be under way, and
    /// one may wait again.
    #[error("the port failed: {0}")]
    Port(#[from] io::Error),
}

/// A controller with the axes X, Y and Z.
///
/// Whatever moves the machine returns at once, so that a program can do something else
/// meanwhile. [`wait`](Stepper::wait) waits for the end; so does the next command.
#[derive(Debug)]
pub struct Stepper<P> {
    port: P,
    /// Whether a command was sent whose answer has not come yet.
    busy: bool,
}

impl<P: Read + Write> Stepper<P> {
    /// Sets the axes of the controller behind a port, whose timeout is that of every answer.
    pub fn open(port: P) -> Result<Stepper<P>, Error> {
        let mut stepper = Stepper { port, busy: false };
        stepper.send("@07")?;
        stepper.wait()?;
        Ok(stepper)
    }

    /// Drives all axes to their reference switches; there is their zero.
    pub fn reference(&mut self) -> Result<(), Error> {
        self.send("@0R7")
    }

    /// Moves the axes by so many steps, with this many steps a second.
    pub fn move_by(&mut self, [x, y, z]: [i32; 3], speed: u32) -> Result<(), Error> {
        self.send(&format!("@0A{x},{speed},{y},{speed},{z},{speed},0,{speed}"))
    }

    /// Finishes a move that was stopped.
    pub fn resume(&mut self) -> Result<(), Error> {
        self.send("@0S")
    }

    /// Waits until the motion has ended.
    pub fn wait(&mut self) -> Result<(), Error> {
        if self.busy {
            let [answer] = self.read()?;
            self.busy = false;
            match answer {
                b'0' => {}
                b'2' => return Err(Error::LimitSwitch),
                b'4' => return Err(Error::NoAxes),
                b'9' => return Err(Error::PowerStageOff),
                b'F' => return Err(Error::Stopped),
                b'H' => return Err(Error::CoverOpen),
                other => return Err(Error::Refused(char::from(other))),
            }
        }
        Ok(())
    }

    /// Switches the spindle on or off.
    pub fn spindle(&mut self, on: bool) -> Result<(), Error> {
        self.send(&format!("@0B2,{}", u8::from(on)))
    }

    /// Where the axes are, in steps. Waits until the motion has ended.
    pub fn position(&mut self) -> Result<[i32; 3], Error> {
        self.send("@0P")?;
        self.wait()?;
        let digits: [u8; 18] = self.read()?;
        let garbled = |_| io::Error::new(io::ErrorKind::InvalidData, "a position is 18 hex digits");
        let mut position = [0; 3];
        for (axis, digits) in position.iter_mut().zip(digits.chunks_exact(6)) {
            let value = i32::from_str_radix(&String::from_utf8_lossy(digits), 16);
            // 24 bits in two's complement: the shifts copy the sign.
            *axis = (value.map_err(garbled)? << 8) >> 8;
        }
        Ok(position)
    }

    fn send(&mut self, command: &str) -> Result<(), Error> {
        self.wait()?;
        self.port.write_all(format!("{command}\r").as_bytes())?;
        self.port.flush()?;
        self.busy = true;
        Ok(())
    }

    fn read<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let mut bytes = [0; N];
        self.port.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}
