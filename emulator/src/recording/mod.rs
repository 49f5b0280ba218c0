//! Recordings: `vimc4 record`, `replay`, `diff`, `cut` and `minimise`.

mod bridge;
mod card;
mod client;
pub(crate) mod controller;
pub(crate) mod diff;
pub(crate) mod drawn;
pub(crate) mod file;
pub(crate) mod history;
pub(crate) mod less;
#[cfg(feature = "api")]
pub(crate) mod page;
pub(crate) mod replay;
pub(crate) mod served;
pub(crate) mod tap;
#[cfg(test)]
mod tests;

use std::panic::{self, UnwindSafe};

use crate::failure::Failure;

/// Plays foreign recordings. A state that was changed by hand can be readable and still be
/// impossible for a controller; if it cannot go on from there, that is reported.
pub(crate) fn guarded<T>(
    work: impl FnOnce() -> Result<T, Failure> + UnwindSafe,
) -> Result<T, Failure> {
    let usual = panic::take_hook();
    // The panic is reported below, once.
    panic::set_hook(Box::new(|_| {}));
    let done = panic::catch_unwind(work);
    panic::set_hook(usual);
    done.unwrap_or_else(|_| {
        Err(Failure::midway(
            "the recording leads the controller to where none can be; a state in it was changed: \
             take it as it was written, or, if nobody has changed it, report a fault of this program",
        ))
    })
}
