//! What the control API is asked and what it answers, without a server: the [routes](table), the fields of
//! a request, problem documents, what happened as entries, and what is seen of a controller.
//!
//! The server answers so over HTTP, and a page that runs controllers by itself answers the same. Nothing
//! here knows a clock, a port or a thread.
#![forbid(unsafe_code)]

pub mod entry;
pub mod feed;
pub mod fields;
pub mod limits;
pub mod log;
pub mod news;
pub mod past;
pub mod problem;
pub mod profiles;
pub mod seen;
pub mod table;
