//! The line that a client has begun and not ended.

use std::borrow::Cow;
use std::sync::Arc;

use bytes::Bytes;

use crate::Source;

/// Keeps the line that a client has begun, to report it when another client ends it.
///
/// The device has one line, and all clients share it. Connected clients see each other's bytes. No
/// client knows of a partial line that a former client left behind. The partial line is reported
/// when its client leaves, if others are connected. Otherwise it is reported when the next client
/// opens the line, and again when that client sends.
#[derive(Debug, Default)]
pub(crate) struct PartialLine {
    /// The bytes that end a line. Without any, nothing is tracked.
    ends: &'static [u8],
    /// Hold a partial line back until it is complete, and discard it when its client leaves.
    fresh: bool,
    bytes: Vec<u8>,
    /// The client that sent the last of the bytes.
    owner: Option<Source>,
    /// The transport whose client has left last, until another client opens it.
    deserted: Option<Arc<str>>,
    /// The partial line was reported to a new client, but not yet to one that sends.
    left: bool,
}

impl PartialLine {
    /// The most bytes that are kept.
    const LONGEST: usize = 4_096;

    pub(crate) fn new(ends: &'static [u8], fresh: bool) -> PartialLine {
        PartialLine { ends, fresh, ..PartialLine::default() }
    }

    /// Whether lines are not tracked.
    pub(crate) fn is_off(&self) -> bool {
        self.ends.is_empty()
    }

    /// Whether a line is begun. The LF of a CR LF does not count.
    pub(crate) fn is_begun(&self) -> bool {
        !self.bytes.trim_ascii().is_empty()
    }

    /// Whether `bytes` ends with a complete line.
    pub(crate) fn is_whole(&self, bytes: &[u8]) -> bool {
        self.end(bytes) == bytes.len()
    }

    /// A client opens the line. Returns the partial line of a client that has left.
    pub(crate) fn client_opens(&mut self, transport: &str, clients: &[Source]) -> Option<Bytes> {
        let gone = self.owner.as_ref().is_some_and(|owner| self.is_gone(owner, clients));
        if self.deserted.as_deref() == Some(transport) {
            self.deserted = None;
        }
        self.leave(gone)
    }

    /// A client closes the line. Returns the partial line that it leaves to connected clients.
    pub(crate) fn client_closes(&mut self, gone: &Source, clients: &[Source]) -> Option<Bytes> {
        if let Source::Client { transport, .. } = gone {
            self.deserted = Some(transport.clone());
        }
        // A client that connects later gets its report then.
        let left = self.owner.as_ref() == Some(gone) && !clients.is_empty();
        self.leave(left && !self.left)
    }

    /// Bytes have arrived. Returns the partial line if its client has left already: the last bytes
    /// of a client may arrive after the event that it has closed the line.
    pub(crate) fn arrives_late(&mut self, clients: &[Source]) -> Option<Bytes> {
        let gone = self.owner.as_ref().is_some_and(|owner| self.is_gone(owner, clients));
        self.leave(gone && !self.left)
    }

    /// Whether a client has left. On a port that reports no clients it counts as connected.
    fn is_gone(&self, owner: &Source, clients: &[Source]) -> bool {
        match owner {
            Source::Client { client: Some(_), .. } => !clients.contains(owner),
            Source::Client { transport, client: None } => self.deserted.as_ref() == Some(transport),
            Source::Controls(_) => false,
        }
    }

    fn leave(&mut self, left: bool) -> Option<Bytes> {
        if !left || !self.is_begun() {
            return None;
        }
        if self.fresh {
            self.discard();
            return None;
        }
        self.left = true;
        Some(Bytes::copy_from_slice(&self.bytes))
    }

    /// A client sends. Returns the partial line that it continues, the first time.
    pub(crate) fn continued_by(&mut self, by: &Source, clients: &[Source]) -> Option<Bytes> {
        let left = !self.is_gone(by, clients) && std::mem::take(&mut self.left);
        left.then(|| Bytes::copy_from_slice(&self.bytes))
    }

    /// Takes bytes from a client, and returns the bytes that the device gets now.
    pub(crate) fn take<'a>(&mut self, bytes: &'a [u8], by: Option<Source>) -> Cow<'a, [u8]> {
        let end = self.end(bytes);
        let (whole, rest) = bytes.split_at(end);
        let given = if self.fresh { self.hold_back(whole, rest).into() } else { bytes.into() };
        if !self.fresh {
            if end > 0 {
                self.bytes.clear();
            }
            let room = Self::LONGEST.saturating_sub(self.bytes.len());
            self.bytes.extend(rest.iter().take(room));
        }
        self.owner = by.filter(|_| !self.bytes.is_empty());
        given
    }

    fn hold_back(&mut self, whole: &[u8], rest: &[u8]) -> Vec<u8> {
        let mut given = Vec::new();
        if !whole.is_empty() {
            given = std::mem::take(&mut self.bytes);
        }
        given.extend_from_slice(whole);
        self.bytes.extend_from_slice(rest);
        if self.bytes.len() > Self::LONGEST {
            given.append(&mut self.bytes);
        }
        given
    }

    /// The bytes held back of a connected client, when no more bytes will complete the line.
    pub(crate) fn take_held_back(&mut self, clients: &[Source]) -> Option<Vec<u8>> {
        if self.owner.as_ref().is_some_and(|owner| self.is_gone(owner, clients)) {
            self.discard();
        }
        (self.fresh && self.is_begun()).then(|| std::mem::take(&mut self.bytes))
    }

    fn discard(&mut self) {
        self.bytes.clear();
        self.owner = None;
    }

    /// The length of the complete lines at the beginning of `bytes`.
    fn end(&self, bytes: &[u8]) -> usize {
        bytes.iter().rposition(|byte| self.ends.contains(byte)).map_or(0, |end| end + 1)
    }
}
