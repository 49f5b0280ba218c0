//! What comes out of a device.

use bytes::Bytes;

use crate::{Event, Time};

/// What a device hands out, in the order in which it happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// Bytes leave on the line at this time. A late wake-up of the host shifts nothing: the
    /// time is the model's.
    Bytes(Time, Bytes),
    /// The non-volatile memory changes. It leaves before the answer it guards, so a host that
    /// writes it to disk before it passes on what follows never confirms what it could lose.
    Flash(Time, FlashChange),
    /// Something happened that somebody asked to see.
    Event(Time, Event),
}

/// A change of the non-volatile memory's image. The format of the image is the device's own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FlashChange {
    /// These bytes are added at the end of the image.
    Append(Bytes),
    /// The whole image is replaced by these bytes.
    Replace(Bytes),
}
