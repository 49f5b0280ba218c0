//! Why something was not done.

use std::time::Duration;

use thiserror::Error;
use vimc4_device::{DeedError, OtherController, Time};

/// Why a controller did not do what it was told.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ControlError {
    /// It is no longer running.
    #[error("the emulator has ended")]
    Ended,
    /// The deed is not possible: it has no such signal, or the signal no such value.
    #[error(transparent)]
    Deed(#[from] DeedError),
    /// Its time cannot be moved.
    #[error("time moves by itself with this clock; use the manual clock to move it")]
    RunsByItself,
    /// Its time stands still.
    #[error("time is paused; step, or resume it first")]
    Paused,
    /// Its time is not paused, and only a controller whose time is paused is led step by step.
    #[error("time is not paused; pause it first")]
    NotPaused,
    /// The state is of another model or machine.
    #[error(transparent)]
    OtherController(#[from] OtherController),
    /// No command of the model has this mnemonic.
    #[error("no command of the {model} has the mnemonic `{mnemonic}`; there are {known}")]
    NoCommand {
        /// The model.
        model: String,
        /// What was asked for.
        mnemonic: String,
        /// The mnemonics that there are.
        known: String,
    },
    /// It cannot do that, being what it is or as it was set up; the words say what to do instead.
    #[error("{0}")]
    Unsupported(&'static str),
    /// The journey through time was cancelled.
    #[error("given up at {at}; what would have happened later has not")]
    Cancelled {
        /// The controller's time then.
        at: Time,
    },
    /// The awaited event has not happened in this time.
    #[error("nothing within {0:?}; it may come later, or never")]
    Late(Duration),
    /// It runs on, perhaps without end, and the condition does not hold as far as was looked ahead:
    /// [`MAX_CAUSES`](vimc4_device::MAX_CAUSES) causes.
    #[error("not by {until}, as far as is looked ahead; `advance` goes further")]
    Unforeseen {
        /// The controller's time then.
        until: Time,
    },
    /// It comes to rest, and the condition never holds.
    #[error(
        "this never happens unless something else does first; give the command or the order that \
         leads there before"
    )]
    Never,
}
