//! The clients that have a controller's line open.

use std::borrow::Cow;
use std::sync::Arc;

use bytes::Bytes;

use crate::line_feeds::LineFeeds;
use crate::partial_line::PartialLine;
use crate::{LineEvent, Source};

/// The clients of a line, as far as their transports report them, and the partial line of one of
/// them.
#[derive(Debug, Default)]
pub(crate) struct LineClients {
    /// The clients that have the line open and may send.
    open: Vec<Source>,
    /// The client that sent last, where there are several.
    speaker: Option<Source>,
    partial: PartialLine,
    feeds: LineFeeds,
}

impl LineClients {
    /// Sets the bytes that end a line, and whether a partial line is discarded when its client leaves.
    pub(crate) fn set_lines(&mut self, ends: &'static [u8], fresh: bool) {
        self.partial = PartialLine::new(ends, fresh);
    }

    /// Sets the bytes that end a line, also in words, where LF does not end one.
    pub(crate) fn set_line_feeds(&mut self, ends: &'static [u8], right: &'static str) {
        self.feeds = LineFeeds::new(ends, right);
    }

    /// The client that sends on a transport.
    pub(crate) fn source(&self, label: &str) -> Source {
        let of = |source: &&Source| match source {
            Source::Client { transport, .. } => **transport == *label,
            Source::Controls(_) => false,
        };
        let known = self.open.iter().rfind(of).cloned();
        known.unwrap_or_else(|| Source::Client { transport: label.into(), client: None })
    }

    /// Whether a client other than the last speaker may be sending.
    pub(crate) fn are_several(&self) -> bool {
        self.open.len() > 1 || self.speaker.is_some()
    }

    /// A client sends on a transport. Returns the event for it, if another client sent before.
    pub(crate) fn speaks(&mut self, label: &Arc<str>) -> Option<LineEvent> {
        let source = self.source(label);
        if self.speaker.as_ref() == Some(&source) {
            return None;
        }
        let news = match &source {
            Source::Client { client, .. } => {
                let client = client.as_deref().unwrap_or("a client").to_owned();
                Some(LineEvent::Speaks { transport: Arc::clone(label), client })
            }
            Source::Controls(_) => None,
        };
        self.speaker = Some(source);
        news
    }

    /// A client opens or closes the line. Returns the event for the partial line left behind.
    pub(crate) fn open_or_close(&mut self, news: &LineEvent) -> Option<LineEvent> {
        let source = |transport: &Arc<str>, client: &String| Source::Client {
            transport: Arc::clone(transport),
            client: Some(client.as_str().into()),
        };
        let (transport, half) = match news {
            // An observer sends nothing.
            LineEvent::Opened { observes: true, .. } | LineEvent::Closed { observes: true, .. } => {
                return None;
            }
            LineEvent::Opened { transport, client, .. } => {
                self.feeds.begin();
                let half = self.partial.client_opens(transport, &self.open);
                self.open.push(source(transport, client));
                (transport, half)
            }
            LineEvent::Closed { transport, client, .. } => {
                let gone = source(transport, client);
                if let Some(place) = self.open.iter().position(|source| *source == gone) {
                    self.open.remove(place);
                }
                if self.open.is_empty() {
                    // The next client is the only one that can send.
                    self.speaker = None;
                }
                (transport, self.partial.client_closes(&gone, &self.open))
            }
            _ => return None,
        };
        let transport = Arc::clone(transport);
        half.map(|half| LineEvent::HalfLine { transport, half, spoils: false })
    }

    // --- lines ---

    /// Whether lines are tracked.
    pub(crate) fn track_lines(&self) -> bool {
        !self.partial.is_off()
    }

    /// The client that has sent `bytes` on a transport, if a partial line comes before or after them.
    pub(crate) fn source_of_partial(&self, label: &str, bytes: &[u8]) -> Option<Source> {
        let is_partial = self.partial.is_begun() || !self.partial.is_whole(bytes);
        is_partial.then(|| self.source(label))
    }

    /// A client sends. Returns another client's partial line that it continues.
    pub(crate) fn continued_partial(&mut self, by: &Source) -> Option<Bytes> {
        self.partial.continued_by(by, &self.open)
    }

    /// Takes bytes that arrive, and returns the bytes that the device gets now.
    pub(crate) fn take<'a>(&mut self, bytes: &'a [u8], by: Option<Source>) -> Cow<'a, [u8]> {
        self.partial.take(bytes, by)
    }

    /// The partial line of a client whose last bytes arrived after it had closed the line.
    pub(crate) fn late_partial(&mut self) -> Option<Bytes> {
        if self.open.is_empty() { None } else { self.partial.arrives_late(&self.open) }
    }

    /// The partial line that was held back from the device, when no more bytes will come.
    pub(crate) fn held_back(&mut self) -> Option<Vec<u8>> {
        self.partial.take_held_back(&self.open)
    }

    /// How lines end, in words, if the client has ended one with LF alone.
    pub(crate) fn wrong_line_end(&mut self, bytes: &[u8]) -> Option<&'static str> {
        self.feeds.wrong(bytes)
    }
}
