//! Recordings: `vimc4 record`, `replay`, `diff`, `cut` and `minimise`.

mod bridge;
mod card;
mod client;
pub(crate) mod controller;
pub(crate) mod diff;
pub(crate) mod file;
pub(crate) mod less;
pub(crate) mod replay;
pub(crate) mod tap;
