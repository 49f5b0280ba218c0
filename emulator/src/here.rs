//! What texts name that not every system has.

/// Of two texts, or parts of one, the first where there are pseudo-terminals, and the second where
/// there are none: on Windows.
#[cfg(unix)]
macro_rules! here {
    ($with:expr, $without:expr) => {
        $with
    };
}
#[cfg(not(unix))]
macro_rules! here {
    ($with:expr, $without:expr) => {
        $without
    };
}

pub(crate) use here;
