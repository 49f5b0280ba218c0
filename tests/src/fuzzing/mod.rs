//! What must hold whatever comes in: one function a fuzz target, which panics where something
//! does not hold.
//!
//! The targets in `fuzz/` call these functions, and so does the replay of the corpus in
//! `tests/corpus.rs`, so that a finding once made is looked for by every `cargo test`.
//! [`seeds`] makes the inputs to begin with from the command tables.

mod isel;
mod lpkf;
mod motions;
mod ncp;
mod operations;
mod profiles;
mod reached;
pub mod seeds;
mod twins;

pub use isel::{controller, flash, lexer, parser};
pub use lpkf::{language, lpkf};
pub use ncp::ncp;
pub use operations::{Operation, Operations, Setup};
pub use profiles::profiles;
pub use reached::Reached;

use std::path::PathBuf;
use std::time::Duration;
use std::{fs, io};

use vimc4_device::{Device, Input};

/// A fuzz target: its name, which is also that of its folder in the corpus, and what it checks.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
pub const TARGETS: [Target; 8] = [
    ("lexer", lexer),
    ("parser", parser),
    ("language", language),
    ("ncp", ncp),
    ("profiles", profiles),
    ("flash", flash),
    ("controller", |data| controller(data, &mut Reached::default())),
    ("lpkf", |data| lpkf(data, &mut Reached::default())),
];

/// Where the finds of fuzzing are kept, a folder for each target that has some.
fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/corpus"))
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

/// Numbers that look random and depend on the input alone, for what must make no difference.
struct Chance(u64);

impl Chance {
    fn of(data: &[u8]) -> Chance {
        // FNV-1a, then xorshift: enough to spread the inputs, and the same everywhere.
        let hash = data.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        });
        Chance(hash | 1)
    }

    /// A number from 0 up to, but not including, `end`; 0 if there is none.
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.checked_rem(end).unwrap_or(0)
    }
}

/// Has a controller do a little of everything for a little while: what its profile or its flash
/// memory says must not break it.
fn exercise(controller: &mut impl Device, inputs: &[Input<'_>]) {
    for input in inputs {
        controller.handle(*input, controller.now());
        for _ in 0..40 {
            while controller.poll_output().is_some() {}
            let Some(wake) = controller.wake() else { break };
            assert!(wake >= controller.now(), "wants to be woken in the past");
            let between = wake.nanos_since(controller.now()) / 2;
            let view = controller.view(controller.now().after_nanos(between));
            assert_eq!(view.timers.first().map(|timer| timer.due), Some(wake));
            // An hour at most: a reference run without a switch goes on for years.
            controller.handle(Input::Wake, wake.min(controller.now() + Duration::from_secs(3_600)));
        }
    }
}
