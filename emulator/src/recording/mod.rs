//! Recordings: `vimc4 record`, `replay`, `diff`, `cut` and `minimise`.

mod bridge;
mod card;
mod client;
mod controller;
pub(crate) mod diff;
mod file;
pub(crate) mod less;
pub(crate) mod replay;
pub(crate) mod tap;
