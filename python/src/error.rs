//! The errors of the library as exceptions of `vimc4._errors`, with the same words.

use std::sync::OnceLock;
use std::thread::{self, ThreadId};

use pyo3::exceptions::{PyRuntimeError, PySystemExit};
use pyo3::prelude::*;
use vimc4::ControlError;

use crate::convert::plain;

/// An exception of the package by its name.
pub(crate) fn raise(py: Python<'_>, name: &str, text: String) -> PyErr {
    raise_with(py, name, (text,))
}

fn raise_with<'py, A>(py: Python<'py>, name: &str, arguments: A) -> PyErr
where
    A: pyo3::call::PyCallArgs<'py>,
{
    let made = py.import("vimc4._errors").and_then(|errors| errors.getattr(name));
    match made.and_then(|class| class.call1(arguments)) {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

/// What an emulator does not do, or does not start.
pub(crate) fn of(py: Python<'_>, error: &vimc4::Error) -> PyErr {
    use vimc4::Error::{
        Address, Control, Fault, File, Flash, FlashFile, Mistake, NoPty, Profile, Recording, Run,
        Serial, Start, Tcp, Unknown, Unmet,
    };
    let name = match error {
        Control(error) => return of_control(py, error),
        Unmet(failure) => return unmet(py, failure),
        Unknown { .. } | File { .. } | Profile(_) => "ProfileError",
        Address { .. } | Tcp(_) | Serial(_) | NoPty => "PortError",
        #[cfg(unix)]
        vimc4::Error::Pty(_) | vimc4::Error::Link(_) => "PortError",
        FlashFile(_) | Flash { .. } => "FlashError",
        Recording(_) => "RecordingError",
        Fault(_) => "FaultError",
        Mistake(_) => "Mistake",
        Run(_) | Start(_) => "Error",
        _ => "Error",
    };
    raise(py, name, error.to_string())
}

/// An expectation that is not met.
pub(crate) fn unmet(py: Python<'_>, failure: &vimc4::Failure) -> PyErr {
    match plain(py, failure) {
        Ok(told) => raise_with(py, "Unmet", (failure.to_string(), told)),
        Err(error) => error,
    }
}

/// A file of coverage that cannot be used.
pub(crate) fn of_coverage_file(py: Python<'_>, error: &vimc4::CoverageFileError) -> PyErr {
    let name = match error {
        vimc4::CoverageFileError::File { .. } => "CoverageFileError",
        _ => "CoverageError",
    };
    raise(py, name, error.to_string())
}

/// What a running emulator does not do.
pub(crate) fn of_control(py: Python<'_>, error: &ControlError) -> PyErr {
    let name = match error {
        ControlError::Ended => return ended(py, error.to_string()),
        ControlError::Deed(_) | ControlError::NoCommand { .. } => "DeedError",
        ControlError::Never | ControlError::Unforeseen { .. } => "Never",
        ControlError::Late(_) => "Late",
        ControlError::Cancelled { at } => {
            return raise_with(py, "Cancelled", (error.to_string(), at.as_nanos()));
        }
        _ => "ControlError",
    };
    raise(py, name, error.to_string())
}

/// The thread in which the program is ending.
static LEAVING: OnceLock<ThreadId> = OnceLock::new();

/// The program is ending in this thread. Others that are still there are daemons.
pub(crate) fn leave() {
    LEAVING.get_or_init(|| thread::current().id());
}

/// It runs no longer. A daemon that was left behind with it ends in silence, as it would with a real
/// port: nobody can do anything about that any more.
pub(crate) fn ended(py: Python<'_>, text: String) -> PyErr {
    match LEAVING.get() {
        Some(leaving) if *leaving != thread::current().id() => PySystemExit::new_err(()),
        _ => raise(py, "Ended", text),
    }
}

/// What was waited for was not there in time.
pub(crate) fn late(py: Python<'_>, seconds: f64) -> PyErr {
    let text = format!("nothing within {seconds} s; it may come later, or never");
    raise(py, "Late", text)
}

/// Something that cannot be: a mistake in this package.
pub(crate) fn broken(text: &str) -> PyErr {
    PyRuntimeError::new_err(text.to_owned())
}
