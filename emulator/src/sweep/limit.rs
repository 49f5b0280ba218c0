//! How long a host may take.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::slots::Slot;

/// So many times longer than the slowest that has ended by itself a host may take, if the limit grows: the
/// processors may be busy with something else.
const SLOWER: u32 = 3;

/// A host that has taken so large a part of its limit seems to wait.
const SEEMS_TO_WAIT: u32 = 4;

/// How long a host may take.
pub(super) struct Limit {
    least: Duration,
    grows: bool,
    /// How many milliseconds the slowest has taken.
    slowest: AtomicU64,
}

impl Limit {
    /// Always so long.
    pub(super) fn new(limit: Duration) -> Limit {
        Limit { least: limit, grows: false, slowest: AtomicU64::new(0) }
    }

    /// So long, or longer while all are slow.
    pub(super) fn growing(least: Duration) -> Limit {
        Limit { grows: true, ..Limit::new(least) }
    }

    /// How long that is at present.
    pub(super) fn now(&self) -> Duration {
        let slowest = Duration::from_millis(self.slowest.load(Ordering::Relaxed));
        self.least.max(slowest.saturating_mul(SLOWER))
    }

    /// Waits for the end of a host. When it seems to wait, another may have its place.
    pub(super) fn wait<T>(
        &self,
        ends: &Receiver<T>,
        slot: Slot<'_>,
    ) -> Result<T, RecvTimeoutError> {
        let (began, mut slot) = (Instant::now(), Some(slot));
        let mut until = self.now() / SEEMS_TO_WAIT;
        loop {
            match ends.recv_timeout(until.saturating_sub(began.elapsed())) {
                Err(RecvTimeoutError::Timeout) if slot.take().is_some() || until < self.now() => {
                    until = self.now();
                }
                ended => {
                    if self.grows && ended.is_ok() {
                        let took = u64::try_from(began.elapsed().as_millis()).unwrap_or(u64::MAX);
                        self.slowest.fetch_max(took, Ordering::Relaxed);
                    }
                    return ended;
                }
            }
        }
    }
}
