//! A fault of an emulator, which ends with its handle.

use vimc4_device::{Fault, FaultNumber, FaultStage, FaultView, LineFault};

use crate::control::Control;
use crate::error::Error;

/// A fault, or the words for one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnyFault {
    /// A fault.
    Fault(Fault),
    /// Words, as people type them: `drop to-host once after x > 1000`.
    Words(String),
}

impl From<Fault> for AnyFault {
    fn from(fault: Fault) -> AnyFault {
        AnyFault::Fault(fault)
    }
}

impl From<LineFault> for AnyFault {
    fn from(fault: LineFault) -> AnyFault {
        AnyFault::Fault(fault.into())
    }
}

impl From<&str> for AnyFault {
    fn from(words: &str) -> AnyFault {
        AnyFault::Words(words.to_owned())
    }
}

impl From<String> for AnyFault {
    fn from(words: String) -> AnyFault {
        AnyFault::Words(words)
    }
}

/// A fault that was begun by [`Emulator::fault`](crate::Emulator::fault). It ends when this is dropped.
#[derive(Debug)]
#[must_use = "the fault ends as soon as this is dropped; `let fault = …` keeps it"]
pub struct FaultHandle {
    control: Control,
    number: FaultNumber,
    stays: bool,
}

impl FaultHandle {
    pub(crate) fn new(control: Control, number: FaultNumber) -> FaultHandle {
        FaultHandle { control, number, stays: false }
    }

    /// Its number, by which everybody else can end it.
    #[must_use]
    pub fn number(&self) -> FaultNumber {
        self.number
    }

    /// How far it has come and how often it has struck; `None` if somebody else has ended it.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn view(&self) -> Result<Option<FaultView>, Error> {
        let faults = self.control.faults().wait()?;
        Ok(faults.into_iter().find(|view| view.number == self.number))
    }

    /// How often it has struck.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn struck(&self) -> Result<u64, Error> {
        Ok(self.view()?.map_or(0, |view| view.struck))
    }

    /// Whether it will not strike any more: it has struck as often as it was to, its time is over, or
    /// somebody has ended it.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn is_over(&self) -> Result<bool, Error> {
        Ok(self.view()?.is_none_or(|view| view.stage == FaultStage::Over))
    }

    /// Leaves the fault to itself: it is there until somebody ends it.
    pub fn keep(mut self) -> FaultNumber {
        self.stays = true;
        self.number
    }
}

impl Drop for FaultHandle {
    fn drop(&mut self) {
        if !self.stays {
            // Waited for, so that what comes after the drop finds it ended. An emulator that has ended
            // has no faults.
            let _ = self.control.end_fault(self.number).wait();
        }
    }
}
