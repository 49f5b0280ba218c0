//! An answer that lasts: it ends with what it is about, and that ends when nobody reads it any more.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use hyper::body::{Body, Bytes, Frame};
use tokio::sync::oneshot;

/// The body of such an answer. It has no bytes.
#[derive(Debug)]
pub(crate) struct Holding {
    /// Nothing is sent there: what is at the other end goes, and this ends.
    lasts: oneshot::Receiver<Infallible>,
    /// Goes with this.
    _reader: oneshot::Sender<Infallible>,
}

/// The other ends of an answer.
#[derive(Debug)]
pub(crate) struct Ends {
    /// Ends the answer when it goes.
    pub(crate) held: oneshot::Sender<Infallible>,
    /// Resolves when nobody reads the answer any more.
    pub(crate) reads: oneshot::Receiver<Infallible>,
}

impl Holding {
    pub(crate) fn new() -> (Holding, Ends) {
        let (held, lasts) = oneshot::channel();
        let (reader, reads) = oneshot::channel();
        (Holding { lasts, _reader: reader }, Ends { held, reads })
    }
}

impl Body for Holding {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        Pin::new(&mut self.lasts).poll(context).map(|_| None)
    }
}
