//! What must hold whatever comes in: one function a fuzz target, which panics where something
//! does not hold.
//!
//! The targets in `fuzz/` call these functions, and so does the replay of the corpus in
//! `tests/corpus.rs`, so that a finding once made is looked for by every `cargo test`.
//! [`seeds`] makes the inputs to begin with from the sessions.

mod adapter;
mod chance;
mod conditions;
mod debugging;
mod exercise;
mod histories;
mod isel;
mod lpkf;
mod motions;
mod ncp;
mod operations;
mod profiles;
mod recordings;
pub mod seeds;
mod telnet;
mod twins;

pub use adapter::adapter;
pub use chance::Chance;
pub use conditions::{condition, fault, scenario};
pub use debugging::{back_and_forward, console, walk};
pub use histories::history;
pub use isel::{controller, flash, lexer, parser};
pub use lpkf::{language, lpkf};
pub use ncp::ncp;
pub use operations::{Operation, Operations, Setup};
pub use profiles::profiles;
pub use recordings::recording;
pub use telnet::rfc2217;

use std::path::PathBuf;
use std::{fs, io};

/// A fuzz target: its name, which is also that of its folder in the corpus, and what it checks.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
pub const TARGETS: [Target; 17] = [
    ("lexer", lexer),
    ("parser", parser),
    ("language", language),
    ("ncp", ncp),
    ("profiles", profiles),
    ("condition", condition),
    ("fault", fault),
    ("scenario", scenario),
    ("flash", flash),
    ("recording", recording),
    ("controller", controller),
    ("lpkf", lpkf),
    ("history", history),
    ("walk", walk),
    ("console", console),
    ("adapter", adapter),
    ("rfc2217", rfc2217),
];

/// Where the finds of fuzzing are kept, a folder for each target that has some.
fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/corpus"))
}

/// The beginning of each input with the end of another one: other commands in other states.
pub fn mixed(inputs: &[(String, Vec<u8>)]) -> impl Iterator<Item = (String, Vec<u8>)> {
    inputs.iter().enumerate().map(|(number, (name, data))| {
        let (end, other) = &inputs[(number * 7 + 13) % inputs.len()];
        let mixed = [&data[..data.len() / 2], &other[other.len() / 2..]].concat();
        (format!("{name}, then {end}"), mixed)
    })
}

/// The inputs of a target by name: its seeds, and what fuzzing has found.
///
/// # Errors
///
/// If the finds cannot be read.
pub fn corpus(target: &str) -> io::Result<Vec<(String, Vec<u8>)>> {
    let seeds = seeds::seeds().into_iter().filter(|seed| seed.target == target);
    let mut inputs: Vec<_> = seeds.map(|seed| (format!("seed {}", seed.name), seed.data)).collect();
    let finds = match fs::read_dir(folder().join(target)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(inputs),
        finds => finds?,
    };
    for entry in finds {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        inputs.push((name, fs::read(entry.path())?));
    }
    inputs.sort();
    Ok(inputs)
}
