//! What must hold whatever comes in: one function a fuzz target, which panics where something
//! does not hold.
//!
//! The targets in `fuzz/` call these functions, and so does the replay of the corpus in
//! `tests/corpus.rs`, so that a finding once made is looked for by every `cargo test`.
//! [`seeds`] makes the inputs to begin with from the command tables.

mod answers;
mod controller;
mod flash;
mod lexer;
mod operations;
mod parser;
mod profiles;
pub mod seeds;

pub use answers::Reached;
pub use controller::controller;
pub use flash::flash;
pub use lexer::lexer;
pub use operations::{Operation, Operations, Setup};
pub use parser::parser;
pub use profiles::profiles;

use std::path::PathBuf;
use std::time::Duration;
use std::{fs, io};

use vimc4_device::{Device, Input, Output};
use vimc4_isel::Controller;
use vimc4_plant::PlantSignal;

/// A fuzz target: its name, which is also that of its folder in the corpus, and what it checks.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
pub const TARGETS: [Target; 5] = [
    ("lexer", lexer),
    ("parser", parser),
    ("profiles", profiles),
    ("flash", flash),
    ("controller", |data| controller(data, &mut Reached::default())),
];

/// Where the corpus is kept, a folder for each target.
#[must_use]
pub fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/corpus"))
}

/// The files of a target in the corpus, by name.
///
/// # Errors
///
/// If they cannot be read.
pub fn corpus(target: &str) -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder().join(target))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        files.push((name, fs::read(entry.path())?));
    }
    files.sort();
    Ok(files)
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
fn exercise(controller: &mut Controller) {
    let (start, stop) = (PlantSignal::Start.id(), PlantSignal::Stop.id());
    let (on, key) = (PlantSignal::On.id(), PlantSignal::Key.id());
    let inputs = [
        Input::Bytes(
            b"@07\r@0P\r@0V\r@0A100,900,-50,900,20,900,-20,900\r@0M1,900,2,900,3,900,0,0\r",
        ),
        Input::Bytes(b"@0R7\r@08\r@0R8\r@0F1\r@0y80,900,-5,10,0,-1,1\r@0H\r@0h\r@0U\r@0DS0\r"),
        Input::Bytes(&[253]),
        Input::Bytes(b"@0S\r@0b0\r@0b3\r@0B0,255\r@0i\r0100,900,100,900,0,900,0,900\r3 2,-1\r9\r"),
        Input::Signal(start, 1),
        Input::Signal(start, 0),
        Input::Bytes(b"@0S\r@0k\r@0IW\r@0IL\r"),
        Input::Signal(key, 0),
        Input::Signal(stop, 1),
        Input::Signal(on, 1),
        Input::Signal(key, 1),
        Input::Power(false),
        Input::Power(true),
        Input::Signal(start, 1),
        Input::Bytes(&[254]),
        Input::Bytes(b"@07\r@0d900,900,900\r@0P\r"),
    ];
    for input in inputs {
        controller.handle(input, controller.now());
        for _ in 0..40 {
            while !matches!(controller.poll_output(), Output::Wake(_)) {}
            let Some(wake) = controller.wake() else { break };
            assert!(wake >= controller.now(), "wants to be woken in the past");
            let between = wake.nanos_since(controller.now()) / 2;
            assert_eq!(controller.view(controller.now().after_nanos(between)).timers.len(), 1);
            // An hour at most: a reference run without a switch goes on for years.
            controller.handle(Input::Wake, wake.min(controller.now() + Duration::from_secs(3_600)));
        }
    }
}
