//! Who may use whom, read from `cargo metadata`.

#![expect(clippy::expect_used, reason = "a test that cannot read the metadata has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::camino::{Utf8Path, Utf8PathBuf};
use cargo_metadata::{DepKindInfo, DependencyKind, MetadataCommand, Package, PackageId, Target};

/// What each room of the house may use of the others: downwards only. Rooms that are not built yet
/// have their place.
const ALLOWED: [(&str, &[&str]); 33] = [
    // Those that know no clock, socket, thread or file.
    ("vimc4-motion", &[]),
    ("vimc4-isel-wire", &[]),
    ("vimc4-device", &["vimc4-motion"]),
    ("vimc4-language", &["vimc4-device"]),
    ("vimc4-plant", &["vimc4-device", "vimc4-motion"]),
    ("vimc4-isel", &["vimc4-device", "vimc4-isel-wire", "vimc4-motion", "vimc4-plant"]),
    ("vimc4-lpkf", &["vimc4-device", "vimc4-motion", "vimc4-plant"]),
    ("vimc4-ncp", &["vimc4-isel-wire", "vimc4-motion", "vimc4-plant"]),
    (
        "vimc4-catalogue",
        &["vimc4-device", "vimc4-isel", "vimc4-language", "vimc4-lpkf", "vimc4-plant"],
    ),
    ("vimc4-timeline", &["vimc4-device", "vimc4-language"]),
    ("vimc4-journal", &["vimc4-device", "vimc4-language"]),
    (
        "vimc4-answers",
        &[
            "vimc4-catalogue",
            "vimc4-session",
            "vimc4-debug",
            "vimc4-device",
            "vimc4-journal",
            "vimc4-language",
            "vimc4-timeline",
        ],
    ),
    ("vimc4-session", &["vimc4-device", "vimc4-journal"]),
    ("vimc4-coverage", &["vimc4-catalogue", "vimc4-device"]),
    ("vimc4-sweep", &["vimc4-device"]),
    (
        "vimc4-debug",
        &["vimc4-catalogue", "vimc4-device", "vimc4-language", "vimc4-session", "vimc4-timeline"],
    ),
    (
        "vimc4-script",
        &["vimc4-catalogue", "vimc4-debug", "vimc4-device", "vimc4-motion", "vimc4-ncp"],
    ),
    (
        "vimc4-page",
        &[
            "vimc4-answers",
            "vimc4-catalogue",
            "vimc4-session",
            "vimc4-debug",
            "vimc4-device",
            "vimc4-journal",
            "vimc4-language",
            "vimc4-script",
            "vimc4-timeline",
        ],
    ),
    ("vimc4-dap", &["vimc4-catalogue", "vimc4-debug", "vimc4-device", "vimc4-timeline"]),
    ("vimc4-picture", &["vimc4-device", "vimc4-motion"]),
    ("vimc4-wave", &["vimc4-device", "vimc4-motion"]),
    // Texts, which know nothing.
    ("vimc4-fixtures", &[]),
    ("vimc4-conform", &["vimc4-catalogue", "vimc4-device", "vimc4-fixtures", "vimc4-language"]),
    // A protocol of the network is the business of no controller.
    ("vimc4-rfc2217", &[]),
    // Those outside. One call of the host to Linux is unsafe code, which has one room.
    (
        "vimc4-host",
        &["vimc4-session", "vimc4-device", "vimc4-journal", "vimc4-lines", "vimc4-rfc2217"],
    ),
    // Modem lines are the business of an operating system and of no controller.
    ("vimc4-lines", &[]),
    (
        "vimc4",
        // The façade hands out types of the contract; the families it knows by the catalogue only.
        &[
            "vimc4-catalogue",
            "vimc4-session",
            "vimc4-coverage",
            "vimc4-device",
            "vimc4-host",
            "vimc4-journal",
            "vimc4-language",
            "vimc4-sweep",
            "vimc4-timeline",
        ],
    ),
    ("vimc4-api", &["vimc4", "vimc4-answers", "vimc4-debug"]),
    ("vimc4-capi", &["vimc4"]),
    ("vimc4-python", &["vimc4"]),
    // Host software knows nothing of virtual controllers; only its tests do.
    ("example-driver", &[]),
    // A family is known by the catalogue.
    ("vimc4-emulator", EVERYTHING_BUT_FAMILIES),
    // What packs the program runs it, as anybody does.
    ("xtask", &[]),
];

/// What the command may use.
const EVERYTHING_BUT_FAMILIES: &[&str] = &[
    "vimc4",
    "vimc4-answers",
    "vimc4-api",
    "vimc4-catalogue",
    "vimc4-conform",
    "vimc4-coverage",
    "vimc4-dap",
    "vimc4-debug",
    "vimc4-device",
    "vimc4-language",
    "vimc4-lines",
    "vimc4-motion",
    "vimc4-ncp",
    "vimc4-picture",
    "vimc4-script",
    "vimc4-timeline",
    "vimc4-wave",
];

/// Those that look at the house as a whole may use all.
const WHOLE: [&str; 3] = ["vimc4-tests", "vimc4-bench", "vimc4-site"];

/// Where clocks, sockets, threads of an executor and serial ports may live.
const OUTER: [&str; 12] = [
    "vimc4-host",
    "vimc4-lines",
    "vimc4",
    "vimc4-api",
    "vimc4-capi",
    "vimc4-python",
    "vimc4-emulator",
    "vimc4-tests",
    "vimc4-bench",
    "vimc4-site",
    "example-driver",
    "xtask",
];

/// All that the inner rooms may be built from besides each other, down to the last: crates that
/// compute, and reach for nothing outside of themselves.
const PURE: [&str; 36] = [
    "adler2",
    "allocator-api2",
    "arrayref",
    "arrayvec",
    "bytemuck",
    "bytes",
    "cfg-if",
    "equivalent",
    "foldhash",
    "hashbrown",
    "indexmap",
    "itoa",
    "libm",
    "log",
    "lz4_flex",
    "memchr",
    "miniz_oxide",
    "nom",
    "serde",
    "serde_core",
    "serde_json",
    "serde_path_to_error",
    "serde_spanned",
    "simd-adler32",
    "strict-num",
    "strsim",
    "thiserror",
    "tiny-skia",
    "tiny-skia-path",
    "toml",
    "toml_datetime",
    "toml_parser",
    "toml_writer",
    "twox-hash",
    "winnow",
    "zmij",
];

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
    for package in packages().iter().filter(|package| is_inner(package)) {
        let folder = package.manifest_path.parent().expect("a package has a folder");
        let clippy = folder.join("clippy.toml");
        if !std::fs::read_to_string(&clippy).is_ok_and(|text| text.contains("Instant::now")) {
            wrong.push(format!("{} has no clippy.toml that forbids Instant::now", package.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Other people's crates count too, down to the last that is built on any system.
#[test]
fn no_inner_room_leads_to_the_world() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(manifest).exec().expect("cargo metadata");
    let resolved = metadata.resolve.as_ref().expect("what cargo has chosen");
    let uses = |id: &PackageId| {
        let node = resolved.nodes.iter().find(|node| node.id == *id).expect("a chosen package");
        let built = |kind: &DepKindInfo| kind.kind == DependencyKind::Normal;
        let built = node.deps.iter().filter(move |used| used.dep_kinds.iter().any(built));
        // What derives code runs in the compiler.
        let built =
            built.filter(|used| !metadata[&used.pkg].targets.iter().any(Target::is_proc_macro));
        built.map(|used| used.pkg.clone()).collect::<Vec<_>>()
    };
    let mut wrong = Vec::new();
    for package in metadata.workspace_packages().into_iter().filter(|package| is_inner(package)) {
        let mut reached: BTreeMap<PackageId, String> = BTreeMap::new();
        let mut ways = vec![(package.id.clone(), package.name.to_string())];
        while let Some((id, way)) = ways.pop() {
            if reached.contains_key(&id) {
                continue;
            }
            ways.extend(uses(&id).into_iter().map(|used| {
                let way = format!("{way} uses {}", metadata[&used].name);
                (used, way)
            }));
            reached.insert(id, way);
        }
        let ours = metadata.workspace_packages();
        let foreign = reached.iter().filter(|(id, _)| {
            let name = metadata[id].name.as_str();
            !PURE.contains(&name) && !ours.iter().any(|own| own.name == name)
        });
        wrong.extend(foreign.map(|(_, way)| way.clone()));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What of the standard library is about the outer world, or differs from one run to the next.
const WORLD: [&str; 14] = [
    "std::env",
    "std::fs",
    "std::io",
    "std::net",
    "std::os",
    "std::process",
    "std::thread",
    "Instant",
    "SystemTime",
    "HashMap",
    "HashSet",
    "print!(",
    "println!(",
    "dbg!(",
];

#[test]
fn no_inner_room_touches_files_sockets_or_threads() {
    let mut wrong = Vec::new();
    for package in packages().iter().filter(|package| is_inner(package)) {
        let folder = package.manifest_path.parent().expect("a package has a folder");
        let source = folder.join("src");
        // What only tests use is their own business.
        let is_built = |path: &Utf8Path| {
            let path = path.strip_prefix(&source).expect("a file of the folder");
            path.components().all(|part| part.as_str() != "tests")
        };
        for (path, text) in sources(&source).into_iter().filter(|(path, _)| is_built(path)) {
            for (line, number) in text.lines().zip(1..) {
                let is_said = line.trim_start().starts_with("//");
                // A clock may be called so; what the system has is not named by that.
                let line = line.replace("Clock::Instant", "").replace("    Instant,", "");
                let world = || WORLD.iter().any(|world| line.contains(world));
                if !is_said && (line.contains("use std::{") || world()) {
                    wrong.push(format!("{path}, line {number}: {}", line.trim()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The rooms that may have unsafe code, and the module that says why where it is one: what the kernel is
/// asked for, what C hands over, and what JavaScript calls.
const UNSAFE: [(&str, &str); 3] =
    [("vimc4-lines", "linux/sys.rs"), ("vimc4-capi", ""), ("vimc4-page", "wasm.rs")];

#[test]
fn unsafe_code_is_where_its_reason_is() {
    let mut wrong = Vec::new();
    for package in packages() {
        let (name, manifest) = (package.name.as_str(), &package.manifest_path);
        let text = std::fs::read_to_string(manifest).expect("a package has a manifest");
        let shared = text.contains("[lints]\nworkspace = true");
        let room = UNSAFE.iter().find(|room| room.0 == name);
        if shared == room.is_some() {
            wrong.push(format!("{name} does not keep to the lints of the workspace"));
        }
        let Some((_, module)) = room else { continue };
        let sources = manifest.parent().expect("a package has a folder").join("src");
        for (path, text) in self::sources(&sources) {
            if path != sources.join(module) && !module.is_empty() && text.contains("unsafe {") {
                wrong.push(format!("{path} has unsafe code"));
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

/// Whether it is a room that knows no world.
fn is_inner(package: &Package) -> bool {
    !OUTER.contains(&package.name.as_str())
}

/// The Rust files in a folder and all that are in it, with their text.
fn sources(folder: &Utf8Path) -> Vec<(Utf8PathBuf, String)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for file in folder.read_dir_utf8().expect("a folder").map(|file| file.expect("a file")) {
            let path = file.path().to_owned();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension() == Some("rs") {
                let text = std::fs::read_to_string(&path).expect("text");
                found.push((path, text));
            }
        }
    }
    found
}

/// The crates a package is built from; what only its tests use is its own business.
fn uses(package: &Package) -> impl Iterator<Item = &str> {
    let normal = package.dependencies.iter().filter(|d| d.kind != DependencyKind::Development);
    normal.map(|dependency| dependency.name.as_str())
}
