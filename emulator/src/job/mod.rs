//! Jobs: reading them, carrying them out on a controller, in virtual time or at a port.

pub(crate) mod channel;
pub(crate) mod file;
pub(crate) mod operator;
pub(crate) mod perform;
pub(crate) mod source;
mod spindle;
mod typing;
pub(crate) mod unit;
pub(crate) mod virtual_time;
