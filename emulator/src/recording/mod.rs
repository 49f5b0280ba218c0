//! Recordings: `vimc4 replay`, `diff`, `cut` and `minimise`.

mod card;
mod controller;
pub(crate) mod diff;
mod file;
pub(crate) mod less;
pub(crate) mod replay;
