//! Movements that a controller makes in pieces, and what that costs.

use vimc4_ncp::geometry::Delay;
use vimc4_ncp::job::{Options, Target, delays};

/// Movements that no controller, or not every one, makes at once, with what they are for people.
pub const MOVEMENTS: [(&str, &str); 7] = [
    ("helix, radius 10 mm, 0.5 mm down, 10 mm/s", "VEL 10000\nCWHLXREL I-10000 Z-500"),
    ("helix, radius 10 mm, 0.5 mm down, 50 mm/s", "VEL 50000\nCWHLXREL I-10000 Z-500"),
    ("helix, radius 10 mm, 5 mm down, 50 mm/s", "VEL 50000\nCWHLXREL I-10000 Z-5000"),
    ("circle in XZ, radius 10 mm, 20 mm/s", "VEL 20000\nPLANE XZ\nCWREL I-10000"),
    ("100 mm and 10° of A, 20 mm/s", "VEL 20000\nMOVEREL X100000 A36000"),
    ("100 mm and 0.5° of A, 20 mm/s", "VEL 20000\nMOVEREL X100000 A1800"),
    ("100 mm and 0.5° of A, 3 mm/s", "VEL 3000\nMOVEREL X100000 A1800"),
];

/// The machines they are made on.
pub const MACHINES: [&str; 4] = ["bench", "mill-4axis", "stage", "traverse"];

/// A job whose last line is a movement, somewhere within the machine's travel.
#[must_use]
pub fn job(movement: &str, target: &Target) -> String {
    let z = if target.travel[2].1 == Some(0) { -50_000 } else { 50_000 };
    format!("IMF_PBL_V1.0\nREF XYZA\nMOVEABS X100000 Y100000 Z{z}\n{movement}\n")
}

/// What the last movement costs; nothing if it is one motion.
#[must_use]
pub fn cost(text: &str, target: &Target) -> Option<Delay> {
    let last = text.lines().count() as u32;
    let mut found = None;
    delays(text, target, Options::default(), &mut |line, delay| {
        found = Some(delay).filter(|_| line == last);
    });
    found
}
