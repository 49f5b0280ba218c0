//! Clients that end their lines with LF where LF ends nothing.

/// Detects a client that ends its lines with LF alone where LF does not end a line.
#[derive(Debug, Default)]
pub(crate) struct LineFeeds {
    /// The right line ends, as bytes and in words; `None` where LF is right.
    right: Option<(&'static [u8], &'static str)>,
    /// The last byte received.
    last: Option<u8>,
    /// This client has been reported.
    reported: bool,
}

impl LineFeeds {
    /// Lines end with these bytes, in words `right`, and not with LF.
    pub(crate) fn new(ends: &'static [u8], right: &'static str) -> LineFeeds {
        LineFeeds { right: Some((ends, right)), ..LineFeeds::default() }
    }

    /// Another client begins.
    pub(crate) fn begin(&mut self) {
        self.last = None;
        self.reported = false;
    }

    /// The right line end, where an LF follows text. Returned once for each client.
    pub(crate) fn wrong(&mut self, bytes: &[u8]) -> Option<&'static str> {
        let (ends, right) = self.right.filter(|_| !self.reported)?;
        let before = self.last;
        self.last = bytes.last().copied().or(before);
        let follows_text = |place: usize| {
            let before = place.checked_sub(1).map_or(before, |place| bytes.get(place).copied());
            before.is_some_and(|byte| byte != b'\n' && !ends.contains(&byte))
        };
        let mut feeds = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        self.reported = feeds.any(|(place, _)| follows_text(place));
        self.reported.then_some(right)
    }
}
