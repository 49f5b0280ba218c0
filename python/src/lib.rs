//! The Python package `vimc4`, as far as it is Rust: the emulator in the process of a Python program.
//!
//! What Python programmers see is `vimc4/__init__.py` and its neighbours; this crate, which they see
//! as `vimc4._vimc4`, is the library `vimc4` put into words that Python understands. Two rules hold
//! everywhere:
//!
//! * Whatever waits lets go of Python's lock, and hears Ctrl-C: [`waiting`].
//! * No thread of an emulator ever enters Python. So no emulator waits for Python's lock, and none
//!   is in its way when the interpreter ends.
#![deny(unsafe_code)]

mod alarm;
mod bell;
mod convert;
mod coverage;
mod emulator;
mod error;
mod expect;
mod group;
mod harness;
mod journal;
mod pending;
mod port;
mod profiles;
mod reports;
mod sweep;
mod waiting;

use pyo3::prelude::*;

/// The emulator itself. Use the package `vimc4`, which makes it pleasant.
#[pymodule]
mod _vimc4 {
    #[pymodule_export]
    use super::bell::Bell;
    #[pymodule_export]
    use super::coverage::Coverage;
    #[pymodule_export]
    use super::emulator::{Core, Recording, Sink, Snapshot, Worker};
    #[pymodule_export]
    use super::expect::{
        Clauses, CommandClause, Expect, Expectation, Following, Must, Part, Sentence, Whenever,
    };
    #[pymodule_export]
    use super::group::{Group, GroupState, Member, World};
    #[pymodule_export]
    use super::harness::Harness;
    #[pymodule_export]
    use super::journal::Journal;
    #[pymodule_export]
    use super::pending::{Journey, Pending};
    #[pymodule_export]
    use super::port::Port;
    #[pymodule_export]
    use super::profiles::{Machine, Model, machine_profile, machines, model_profile, models};
    #[pymodule_export]
    use super::reports::Reports;
    #[pymodule_export]
    use super::sweep::{SweepResults, SweepSession};
    use super::*;

    /// The program is ending.
    #[pyfunction]
    fn leave() {
        error::leave();
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        // PyO3 finds out once, where it is first asked for Python from outside, that there is one. An error in
        // a daemon would be the first to ask while Python is ending, when there is none any more, and
        // would panic instead of ending in silence.
        module.py().detach(|| Python::attach(|_| ()));
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
