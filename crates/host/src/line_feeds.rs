//! Line feeds of clients that wait for an answer in vain.

/// Whether a client ends its lines with LF alone where that ends nothing.
#[derive(Debug, Default)]
pub(crate) struct LineFeeds {
    /// What ends a line, as bytes and in words; `None` where LF does.
    right: Option<(&'static [u8], &'static str)>,
    /// The last byte, if there was one.
    last: Option<u8>,
    /// This client has been told.
    told: bool,
}

impl LineFeeds {
    /// Lines end with these bytes, as the words say, and not with LF.
    pub(crate) fn new(ends: &'static [u8], right: &'static str) -> LineFeeds {
        LineFeeds { right: Some((ends, right)), ..LineFeeds::default() }
    }

    /// Another client begins.
    pub(crate) fn begin(&mut self) {
        self.last = None;
        self.told = false;
    }

    /// What would be right, where an LF ends a line that nothing has ended, once for each client.
    pub(crate) fn wrong(&mut self, bytes: &[u8]) -> Option<&'static str> {
        let (ends, right) = self.right.filter(|_| !self.told)?;
        let before = self.last;
        self.last = bytes.last().copied().or(before);
        let behind_text = |place: usize| {
            let before = place.checked_sub(1).map_or(before, |place| bytes.get(place).copied());
            before.is_some_and(|byte| byte != b'\n' && !ends.contains(&byte))
        };
        let mut feeds = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        self.told = feeds.any(|(place, _)| behind_text(place));
        self.told.then_some(right)
    }
}
