//! The line that a client has begun and not ended.

use std::sync::Arc;

use std::borrow::Cow;

use bytes::Bytes;

use crate::Source;

/// Keeps the line that a client has begun, so that it can be reported when another client ends it.
///
/// The device hears one line, whichever client sends. Clients that are connected at the same time share their
/// lines, and each sees what the other does. But no client knows of a half line that was left behind:
/// it is reported when its client goes, if others are there; otherwise when the next client comes,
/// and when the first of them sends something.
#[derive(Debug, Default)]
pub(crate) struct HalfLine {
    /// What ends a line. Nothing is known of lines without.
    ends: &'static [u8],
    /// It is kept back until it is whole, and forgotten when its client leaves.
    fresh: bool,
    bytes: Vec<u8>,
    /// The client that sent the last of it.
    owner: Option<Source>,
    /// The transport whose client has left last, until it has another.
    deserted: Option<Arc<str>>,
    /// Its client had gone when another came or went, and the next one to send has not been told yet.
    left: bool,
}

impl HalfLine {
    /// So much of it is kept.
    const LONGEST: usize = 4_096;

    pub(crate) fn new(ends: &'static [u8], fresh: bool) -> HalfLine {
        HalfLine { ends, fresh, ..HalfLine::default() }
    }

    /// Whether nothing is known of lines.
    pub(crate) fn is_off(&self) -> bool {
        self.ends.is_empty()
    }

    /// Whether anything has been begun: what CR LF leaves behind CR is nothing.
    pub(crate) fn is_begun(&self) -> bool {
        !self.bytes.trim_ascii().is_empty()
    }

    /// Whether what arrives ends with a line.
    pub(crate) fn is_whole(&self, bytes: &[u8]) -> bool {
        self.end(bytes) == bytes.len()
    }

    /// A client connects: the half line of one that has gone.
    pub(crate) fn comes(&mut self, transport: &str, clients: &[Source]) -> Option<Bytes> {
        let gone = self.owner.as_ref().is_some_and(|owner| self.is_gone(owner, clients));
        if self.deserted.as_deref() == Some(transport) {
            self.deserted = None;
        }
        self.leave(gone)
    }

    /// A client goes: the half line that it leaves to those that are still connected.
    pub(crate) fn goes(&mut self, gone: &Source, clients: &[Source]) -> Option<Bytes> {
        if let Source::Client { transport, .. } = gone {
            self.deserted = Some(transport.clone());
        }
        // A client that comes later is told then.
        let left = self.owner.as_ref() == Some(gone) && !clients.is_empty();
        self.leave(left && !self.left)
    }

    /// Something has arrived: the half line in it of a client that has gone already.
    /// Its last bytes may come in after the news that it has left.
    pub(crate) fn comes_late(&mut self, clients: &[Source]) -> Option<Bytes> {
        let gone = self.owner.as_ref().is_some_and(|owner| self.is_gone(owner, clients));
        self.leave(gone && !self.left)
    }

    /// Whether a client has gone. On a port that does not tell, it counts as connected for ever.
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
            self.forget();
            return None;
        }
        self.left = true;
        Some(Bytes::copy_from_slice(&self.bytes))
    }

    /// A client sends: the half line that it ends, if it is the first since that was left.
    pub(crate) fn spoils(&mut self, by: &Source, clients: &[Source]) -> Option<Bytes> {
        let left = !self.is_gone(by, clients) && std::mem::take(&mut self.left);
        left.then(|| Bytes::copy_from_slice(&self.bytes))
    }

    /// Takes in what arrives from a client, and returns what the device gets of it now.
    pub(crate) fn take<'a>(&mut self, bytes: &'a [u8], by: Option<Source>) -> Cow<'a, [u8]> {
        let end = self.end(bytes);
        let (whole, rest) = bytes.split_at(end);
        let given = if self.fresh { self.keep_back(whole, rest).into() } else { bytes.into() };
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

    fn keep_back(&mut self, whole: &[u8], rest: &[u8]) -> Vec<u8> {
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

    /// What has been kept back of a client that is still there, and that nothing will end any more.
    pub(crate) fn take_kept_back(&mut self, clients: &[Source]) -> Option<Vec<u8>> {
        if self.owner.as_ref().is_some_and(|owner| self.is_gone(owner, clients)) {
            self.forget();
        }
        (self.fresh && self.is_begun()).then(|| std::mem::take(&mut self.bytes))
    }

    fn forget(&mut self) {
        self.bytes.clear();
        self.owner = None;
    }

    /// How much of what arrives are whole lines, or the rest of one.
    fn end(&self, bytes: &[u8]) -> usize {
        bytes.iter().rposition(|byte| self.ends.contains(byte)).map_or(0, |end| end + 1)
    }
}
