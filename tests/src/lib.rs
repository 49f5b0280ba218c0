//! What the tests of the whole house share.
//!
//! [`behaviour`] makes the behaviour document from the fixture sessions, [`shown`] says what
//! they show, [`fuzzing`] has what the fuzz targets do, [`jobs`] reads the fixture jobs,
//! [`mishaps`] makes random sessions in which much goes wrong, [`moments`] looks at what conditions
//! are about, [`ncp_reference`] makes the reference of job files, [`pieces`] has movements that
//! take several motions, and [`plain`] finds messages that are not in words. The sessions themselves are read and played by `vimc4-conform`.
#![forbid(unsafe_code)]

pub mod behaviour;
pub mod fuzzing;
pub mod jobs;
pub mod mishaps;
pub mod moments;
pub mod ncp_reference;
pub mod pieces;
pub mod plain;
pub mod shown;

/// What the pages on faults and scenarios show in Rust is so, and what the library's page in the registry
/// shows.
#[cfg(doctest)]
mod shown_in_documents {
    #[doc = include_str!("../../docs/faults.md")]
    struct Faults;
    #[doc = include_str!("../../docs/scenarios.md")]
    struct Scenarios;
    #[doc = include_str!("../../crates/vimc4/README.md")]
    struct Library;
}
