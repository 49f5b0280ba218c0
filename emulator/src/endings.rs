//! How a program is asked to end.

#[cfg(unix)]
use std::future::poll_fn;
#[cfg(unix)]
use std::task::Poll;

/// Ctrl-C, and the other ways in which a terminal, the system or a service manager asks for an
/// end.
#[cfg(unix)]
pub(crate) struct Endings(Vec<tokio::signal::unix::Signal>);

#[cfg(unix)]
impl Endings {
    pub(crate) fn listen() -> Endings {
        use tokio::signal::unix::{SignalKind, signal};
        let kinds = [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()];
        Endings(kinds.into_iter().filter_map(|kind| signal(kind).ok()).collect())
    }

    pub(crate) async fn told(&mut self) {
        poll_fn(|cx| {
            let told = self.0.iter_mut().any(|signal| signal.poll_recv(cx).is_ready());
            if told { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }
}

#[cfg(not(unix))]
pub(crate) struct Endings;

#[cfg(not(unix))]
impl Endings {
    pub(crate) fn listen() -> Endings {
        Endings
    }

    pub(crate) async fn told(&mut self) {
        let _ = tokio::signal::ctrl_c().await;
    }
}
