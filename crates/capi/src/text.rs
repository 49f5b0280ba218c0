//! Texts from C and back.

use std::ffi::{CStr, CString, c_char};

use crate::error::{Failure, guarded};

/// A text of the caller's.
///
/// # Safety
///
/// It is NULL, or ends with a zero byte and stays as it is for `'a`.
pub(crate) unsafe fn of_caller<'a>(text: *const c_char, what: &str) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(Failure(format!("{what} is NULL")));
    }
    // SAFETY: it is not NULL, and the caller says that it ends with a zero byte and stays as it is.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|_| Failure(format!("{what} is not UTF-8")))
}

/// A text that the caller frees.
pub(crate) fn to_caller(mut text: String) -> Result<*mut c_char, Failure> {
    text.retain(|c| c != '\0');
    CString::new(text).map(CString::into_raw).map_err(Failure::of)
}

/// Frees a text that a function has returned to be freed. NULL is nothing to be freed.
///
/// # Safety
///
/// `text` is NULL, or was returned to be freed and was not freed yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_free(text: *mut c_char) {
    guarded((), || {
        if !text.is_null() {
            // SAFETY: the caller says that it came from `to_caller` and that nobody uses it any more.
            drop(unsafe { CString::from_raw(text) });
        }
        Ok(())
    });
}
