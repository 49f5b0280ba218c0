//! The files of the panel, which are part of the program.

/// Each file: where it is asked for, its type, and what is in it.
pub(crate) static FILES: &[(&str, &str, &[u8])] =
    &[("/", "text/html; charset=utf-8", include_bytes!("../web/dist/index.html"))];
