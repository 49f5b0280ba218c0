//! Who may use whom, read from `cargo metadata`.

#![expect(clippy::expect_used, reason = "a test that cannot read the metadata has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::{DependencyKind, MetadataCommand, Package};

/// What each room of the house may use of the others.
const ALLOWED: [(&str, &[&str]); 16] = [
    ("vimc4-motion", &[]),
    ("vimc4-isel-wire", &[]),
    ("vimc4-device", &["vimc4-motion"]),
    ("vimc4-plant", &["vimc4-device", "vimc4-motion"]),
    ("vimc4-isel", &["vimc4-device", "vimc4-isel-wire", "vimc4-motion", "vimc4-plant"]),
    ("vimc4-lpkf", &["vimc4-device", "vimc4-motion", "vimc4-plant"]),
    ("vimc4-ncp", &["vimc4-motion", "vimc4-isel-wire", "vimc4-plant"]),
    ("vimc4-session", &["vimc4-device", "vimc4-motion"]),
    ("vimc4-debug", &["vimc4-device", "vimc4-session"]),
    ("vimc4-host", &["vimc4-device", "vimc4-lines", "vimc4-session"]),
    (
        "vimc4",
        // The façade hands out types of the contract, which come from device and motion.
        &[
            "vimc4-host",
            "vimc4-isel",
            "vimc4-lpkf",
            "vimc4-plant",
            "vimc4-session",
            "vimc4-device",
            "vimc4-motion",
        ],
    ),
    // Modem lines are the business of an operating system and of no controller.
    ("vimc4-lines", &[]),
    ("vimc4-python", &["vimc4"]),
    ("vimc4-conform", &["vimc4", "vimc4-device"]),
    (
        "vimc4-emulator",
        &["vimc4", "vimc4-conform", "vimc4-debug", "vimc4-lines", "vimc4-ncp", "vimc4-motion"],
    ),
    // Host software knows nothing of virtual controllers; only its tests do.
    ("example-driver", &[]),
];

/// Those that look at the house as a whole may use all.
const WHOLE: [&str; 2] = ["vimc4-tests", "vimc4-bench"];

/// Where clocks, sockets, threads of an executor and serial ports may live.
const OUTER: [&str; 8] = [
    "vimc4-host",
    "vimc4-lines",
    "vimc4",
    "vimc4-python",
    "vimc4-emulator",
    "vimc4-tests",
    "vimc4-bench",
    "example-driver",
];

/// Crates that are about the outer world.
const WORLDLY: [&str; 8] =
    ["tokio", "tokio-serial", "serialport", "socket2", "rustix", "nix", "mio", "libc"];

#[test]
fn every_crate_uses_only_what_it_may() {
    let packages = packages();
    let ours: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    let allowed: BTreeMap<&str, &[&str]> = ALLOWED.into_iter().collect();
    let mut wrong = Vec::new();
    for package in packages.iter().filter(|package| !WHOLE.contains(&package.name.as_str())) {
        let name = package.name.as_str();
        let Some(allowed) = allowed.get(name) else {
            wrong.push(format!("{name} has no place in the rules; add it to docs and this list"));
            continue;
        };
        for used in uses(package).filter(|used| ours.contains(used)) {
            if !allowed.contains(&used) {
                wrong.push(format!("{name} uses {used}; it may use {}", allowed.join(", ")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_outer_rooms_know_the_world() {
    let mut wrong = Vec::new();
    for package in packages().iter().filter(|package| !OUTER.contains(&package.name.as_str())) {
        for used in uses(package).filter(|used| WORLDLY.contains(used)) {
            wrong.push(format!("{} uses {used}", package.name));
        }
        let folder = package.manifest_path.parent().expect("a package has a folder");
        let clippy = folder.join("clippy.toml");
        if !std::fs::read_to_string(&clippy).is_ok_and(|text| text.contains("Instant::now")) {
            wrong.push(format!("{} has no clippy.toml that forbids Instant::now", package.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The one room that may have unsafe code, and only in the module that says why.
const UNSAFE: (&str, &str) = ("vimc4-lines", "linux/sys.rs");

#[test]
fn unsafe_code_is_in_one_place() {
    let mut wrong = Vec::new();
    for package in packages() {
        let (name, manifest) = (package.name.as_str(), &package.manifest_path);
        let text = std::fs::read_to_string(manifest).expect("a package has a manifest");
        let shared = text.contains("[lints]\nworkspace = true");
        if shared == (name == UNSAFE.0) {
            wrong.push(format!("{name} does not keep to the lints of the workspace"));
        }
        if shared {
            continue;
        }
        let sources = manifest.parent().expect("a package has a folder").join("src");
        let mut folders = vec![sources.clone()];
        while let Some(folder) = folders.pop() {
            for file in folder.read_dir_utf8().expect("a folder").map(|file| file.expect("a file"))
            {
                let path = file.path();
                if path.is_dir() {
                    folders.push(path.to_owned());
                } else if path != sources.join(UNSAFE.1)
                    && std::fs::read_to_string(path).expect("text").contains("unsafe {")
                {
                    wrong.push(format!("{path} has unsafe code"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn packages() -> Vec<Package> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let mut command = MetadataCommand::new();
    let metadata = command.manifest_path(manifest).no_deps().exec().expect("cargo metadata works");
    metadata.packages
}

/// The crates a package is built from; what only its tests use is its own business.
fn uses(package: &Package) -> impl Iterator<Item = &str> {
    let normal = package.dependencies.iter().filter(|d| d.kind != DependencyKind::Development);
    normal.map(|dependency| dependency.name.as_str())
}
