//! The clients that have a controller's line open: which one speaks, and what they leave behind.

use std::borrow::Cow;
use std::sync::Arc;

use bytes::Bytes;

use crate::half_line::HalfLine;
use crate::line_feeds::LineFeeds;
use crate::{News, Source};

/// The clients of a line as far as their transports tell of them, and the line that one of them
/// has begun.
#[derive(Default)]
pub(crate) struct ClientsOfLine {
    /// The clients that have the line open and may send.
    open: Vec<Source>,
    /// The client that sent last, where there are several.
    speaker: Option<Source>,
    half: HalfLine,
    feeds: LineFeeds,
}

impl ClientsOfLine {
    /// Says what ends a line, and whether a half one is forgotten when its client leaves.
    pub(crate) fn set_lines(&mut self, ends: &'static [u8], fresh: bool) {
        self.half = HalfLine::new(ends, fresh);
    }

    /// Says what ends a line, as bytes and in words, where LF does not.
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

    /// Whether another client than before could be speaking now.
    pub(crate) fn are_several(&self) -> bool {
        self.open.len() > 1 || self.speaker.is_some()
    }

    /// A client sends on a transport: names it, if another one sent before.
    pub(crate) fn speaks(&mut self, label: &Arc<str>) -> Option<News> {
        let source = self.source(label);
        if self.speaker.as_ref() == Some(&source) {
            return None;
        }
        let news = match &source {
            Source::Client { client, .. } => {
                let client = client.as_deref().unwrap_or("a client").to_owned();
                Some(News::Speaks { transport: Arc::clone(label), client })
            }
            Source::Controls(_) => None,
        };
        self.speaker = Some(source);
        news
    }

    /// A client that may send comes or goes, with the half line that it has left.
    pub(crate) fn come_or_go(&mut self, news: &News) -> Option<News> {
        let source = |transport: &Arc<str>, client: &String| Source::Client {
            transport: Arc::clone(transport),
            client: Some(client.as_str().into()),
        };
        let (transport, half) = match news {
            // An observer sends nothing.
            News::Opened { observes: true, .. } | News::Closed { observes: true, .. } => {
                return None;
            }
            News::Opened { transport, client, .. } => {
                self.feeds.begin();
                let half = self.half.comes(transport, &self.open);
                self.open.push(source(transport, client));
                (transport, half)
            }
            News::Closed { transport, client, .. } => {
                let gone = source(transport, client);
                if let Some(place) = self.open.iter().position(|source| *source == gone) {
                    self.open.remove(place);
                }
                if self.open.is_empty() {
                    // The next client is the only one that can send.
                    self.speaker = None;
                }
                (transport, self.half.goes(&gone, &self.open))
            }
            _ => return None,
        };
        let transport = Arc::clone(transport);
        half.map(|half| News::HalfLine { transport, half, spoils: false })
    }

    // --- lines ---

    /// Whether anything is known of lines.
    pub(crate) fn know_lines(&self) -> bool {
        !self.half.is_off()
    }

    /// The client that has sent this on a transport, if a line is under way before or after it.
    pub(crate) fn source_of_half(&self, label: &str, bytes: &[u8]) -> Option<Source> {
        let half = self.half.is_begun() || !self.half.is_whole(bytes);
        half.then(|| self.source(label))
    }

    /// A client sends: the half line of another one that it ends.
    pub(crate) fn spoilt_half(&mut self, by: &Source) -> Option<Bytes> {
        self.half.spoils(by, &self.open)
    }

    /// Takes in what arrives, and returns what of it the device gets now.
    pub(crate) fn take<'a>(&mut self, bytes: &'a [u8], by: Option<Source>) -> Cow<'a, [u8]> {
        self.half.take(bytes, by)
    }

    /// The last bytes of a client may come in only after it has gone: the half line
    /// that it leaves to the others.
    pub(crate) fn late_half(&mut self) -> Option<Bytes> {
        if self.open.is_empty() { None } else { self.half.comes_late(&self.open) }
    }

    /// The half line that the device has not had yet, when no more will come of it.
    pub(crate) fn kept_back(&mut self) -> Option<Vec<u8>> {
        self.half.take_kept_back(&self.open)
    }

    /// How lines end, where a client has ended one in another way.
    pub(crate) fn wrong_end(&mut self, bytes: &[u8]) -> Option<&'static str> {
        self.feeds.wrong(bytes)
    }
}
