//! How much anybody may ask for.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// So many bytes of a controller are recorded for a client.
pub(crate) const RECORDING: u64 = 64 * 1024 * 1024;

/// The largest message of a client on a WebSocket, bytes.
pub(crate) const MESSAGE: usize = 16 * 1024;

/// So many connections are open at once; further ones wait.
pub(crate) const CONNECTIONS: usize = 256;

/// So many of them may be WebSockets.
pub(crate) const SOCKETS: usize = 64;

/// So many requests, of all clients together, are taken in a second.
pub(crate) const REQUESTS: u32 = 2_000;

/// So many requests may wait for time to pass.
pub(crate) const JOURNEYS: usize = 100;

/// The past of a controller is kept in two parts, each of so many inputs at most,
pub(crate) const PAST_INPUTS: usize = 50_000;

/// of so many bytes,
pub(crate) const PAST_BYTES: usize = 16 * 1024 * 1024;

/// and of so many rounds in which everything was done that was due.
pub(crate) const PAST_ROUNDS: u64 = 500_000;

/// A recording as a page has so many entries, the last ones,
pub(crate) const FILM_ENTRIES: usize = 100_000;

/// and so many moments at which everything is known.
pub(crate) const FILM_VIEWS: usize = 20_000;

/// How long a client has to say on a WebSocket what it wants, and to take what it is sent.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// Lets so many pass in a second, and as many at once after a rest.
#[derive(Debug)]
pub(crate) struct Rate(Mutex<(f64, Option<Instant>)>);

impl Rate {
    pub(crate) fn new() -> Rate {
        Rate(Mutex::new((f64::from(REQUESTS), None)))
    }

    /// Whether one more may pass at this moment.
    pub(crate) fn passes(&self, now: Instant) -> bool {
        let mut rate = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (left, last) = *rate;
        let rest = last.map_or(Duration::ZERO, |last| now.saturating_duration_since(last));
        let most = f64::from(REQUESTS);
        let left = (left + rest.as_secs_f64() * most).min(most);
        let passes = left >= 1.0;
        *rate = (if passes { left - 1.0 } else { left }, Some(now));
        passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_pass_in_a_second_and_no_more() {
        let (rate, begin) = (Rate::new(), Instant::now());
        let at = |millis| begin + Duration::from_millis(millis);
        let passed = |millis| (0..3 * REQUESTS).filter(|_| rate.passes(at(millis))).count();
        assert_eq!(passed(0), REQUESTS as usize);
        assert_eq!(passed(0), 0);
        assert_eq!(passed(500), REQUESTS as usize / 2);
        // A long rest counts for no more than a second.
        assert_eq!(passed(9_000), REQUESTS as usize);
    }
}
