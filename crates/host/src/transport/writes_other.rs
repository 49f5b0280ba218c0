//! Whether clients wrote to a terminal before or after the last of them closed it: systems other than
//! Linux do not tell.

use std::path::Path;

/// The order of writes and closings of one terminal.
#[derive(Debug)]
pub(super) struct Writes;

/// Whose bytes wait after a client has closed the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Writer {
    /// The client that has closed it.
    #[expect(dead_code, reason = "only Linux tells")]
    Former,
    /// The next client, or both of them.
    #[expect(dead_code, reason = "only Linux tells")]
    Next,
    /// No client: everything has been read.
    #[expect(dead_code, reason = "only Linux tells")]
    Nobody,
    /// Nobody can tell.
    Unknown,
}

impl Writes {
    pub(super) fn new(_: &Path) -> Writes {
        Writes
    }

    pub(super) fn look(&mut self) -> bool {
        false
    }

    pub(super) fn are_read(&mut self) {}

    pub(super) fn has_left(&mut self) {}

    pub(super) fn writer(&mut self) -> Writer {
        Writer::Unknown
    }
}
