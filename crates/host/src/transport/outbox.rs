//! What a client has still to fetch.

use std::collections::VecDeque;
use std::io;

/// How much waits for a client that does not read, beyond what the operating system keeps.
const LIMIT: usize = 64 * 1024;

/// A bounded queue in front of a writer that never blocks.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    queue: VecDeque<u8>,
}

impl Outbox {
    /// Writes what can be written at once and keeps the rest. Bytes that do not fit are lost
    /// together, never in part: half an answer would be worse than none. Returns how many were
    /// lost.
    pub(super) fn send(
        &mut self,
        bytes: &[u8],
        mut write: impl FnMut(&[u8]) -> io::Result<usize>,
    ) -> io::Result<u64> {
        let mut rest = bytes;
        if self.queue.is_empty() {
            while !rest.is_empty() {
                match write(rest) {
                    Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                    Ok(n) => rest = &rest[n..],
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(error) => return Err(error),
                }
            }
        } else if self.queue.len() + rest.len() > LIMIT {
            return Ok(u64::try_from(rest.len()).unwrap_or(u64::MAX));
        }
        self.queue.extend(rest);
        Ok(0)
    }

    /// Writes on until the queue is empty or the writer is full.
    pub(super) fn flush(
        &mut self,
        mut write: impl FnMut(&[u8]) -> io::Result<usize>,
    ) -> io::Result<()> {
        while !self.queue.is_empty() {
            match write(self.queue.as_slices().0) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(n) => drop(self.queue.drain(..n)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Forgets what waits and says how much it was.
    pub(super) fn clear(&mut self) -> u64 {
        let lost = self.queue.len();
        self.queue.clear();
        u64::try_from(lost).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_lost_whole_and_the_rest_stays_in_order() {
        let mut outbox = Outbox::default();
        let mut taken = Vec::new();
        // The operating system takes three bytes and no more.
        let mut room = 3;
        let mut write = |bytes: &[u8]| {
            let n = room.min(bytes.len());
            room -= n;
            taken.extend_from_slice(&bytes[..n]);
            if n == 0 { Err(io::ErrorKind::WouldBlock.into()) } else { Ok(n) }
        };
        assert_eq!(outbox.send(b"abcde", &mut write).unwrap(), 0);
        assert_eq!(outbox.send(&vec![b'x'; LIMIT - 1], &mut write).unwrap(), LIMIT as u64 - 1);
        assert_eq!(outbox.send(b"f", &mut write).unwrap(), 0);
        assert_eq!(taken, b"abc");
        let mut fetched = Vec::new();
        outbox
            .flush(|bytes| {
                fetched.extend_from_slice(bytes);
                Ok(bytes.len())
            })
            .unwrap();
        assert_eq!(fetched, b"def");
        assert!(outbox.is_empty());
    }

    #[test]
    fn an_endless_answer_needs_bounded_memory() {
        let mut outbox = Outbox::default();
        let mut lost = 0;
        for _ in 0..1_000 {
            lost += outbox.send(&[0; 1_000], |_| Err(io::ErrorKind::WouldBlock.into())).unwrap();
        }
        assert!(outbox.queue.len() <= LIMIT + 1_000);
        assert_eq!(lost + outbox.clear(), 1_000_000);
    }
}
