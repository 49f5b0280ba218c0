//! What went wrong, for a caller that knows no errors but numbers.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// Why a call has failed, for people.
#[derive(Debug)]
pub(crate) struct Failure(pub(crate) String);

impl Failure {
    pub(crate) fn new(text: &str) -> Failure {
        Failure(text.to_owned())
    }

    pub(crate) fn of(error: impl Display) -> Failure {
        Failure(error.to_string())
    }
}

impl From<vimc4::Error> for Failure {
    fn from(error: vimc4::Error) -> Failure {
        Failure::of(error)
    }
}

/// Does what a function of the interface is to do, and keeps what went wrong. A panic, which must not
/// reach C, is a failure too.
pub(crate) fn guarded<T>(failed: T, does: impl FnOnce() -> Result<T, Failure>) -> T {
    let done = catch_unwind(AssertUnwindSafe(does));
    let done = done.unwrap_or_else(|_| Err(Failure::new("a defect of vimc4; see standard error")));
    done.unwrap_or_else(|Failure(mut text)| {
        text.retain(|c| c != '\0');
        LAST.set(CString::new(text).unwrap_or_default());
        failed
    })
}

/// Why the last call of this thread that has failed did so; an empty text if none has. It is good until the
/// next call that fails.
#[unsafe(no_mangle)]
pub extern "C" fn vimc4_last_error() -> *const c_char {
    LAST.with_borrow(|last| CStr::as_ptr(last))
}
