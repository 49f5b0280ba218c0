//! What of the house can be published: that `cargo install vimc4-emulator` finds all that it needs, and that
//! each package has all that it is built from.

#![expect(clippy::expect_used, reason = "a test that cannot read the metadata has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::camino::{Utf8Path, Utf8PathBuf};
use cargo_metadata::{Metadata, MetadataCommand, Package};

/// What people install or depend on; the others are there because these need them.
const WANTED: [&str; 2] = ["vimc4-emulator", "vimc4"];

#[test]
fn what_is_published_is_what_people_want_and_what_that_is_built_from() {
    let metadata = metadata();
    let ours: BTreeMap<&str, &Package> =
        metadata.workspace_packages().into_iter().map(|own| (own.name.as_str(), own)).collect();
    let mut needed: BTreeSet<&str> = WANTED.into();
    let mut ways: Vec<&str> = WANTED.into();
    while let Some(name) = ways.pop() {
        // What its tests need is looked for in the registry, too.
        let uses = ours[name].dependencies.iter().map(|used| used.name.as_str());
        ways.extend(uses.filter(|used| ours.contains_key(used) && needed.insert(used)));
    }
    let published: BTreeSet<&str> = published(&metadata).map(|own| own.name.as_str()).collect();
    assert_eq!(published, needed, "those that are published, and those that have to be");
}

#[test]
fn each_says_what_it_is_and_wants_the_others_as_they_are() {
    let metadata = metadata();
    let ours: BTreeSet<&str> =
        metadata.workspace_packages().into_iter().map(|own| own.name.as_str()).collect();
    let mut wrong = Vec::new();
    for package in published(&metadata) {
        let name = &package.name;
        let is_told = [
            ("description", package.description.is_some()),
            ("license", package.license.as_deref() == Some("MIT OR Apache-2.0")),
            ("readme", package.readme().is_some_and(|path| path.exists())),
            ("rust-version", package.rust_version.is_some()),
            ("keywords, of which there may be five", (1..=5).contains(&package.keywords.len())),
            ("categories, of which there may be five", (1..=5).contains(&package.categories.len())),
        ];
        wrong.extend(is_told.iter().filter(|(_, is)| !is).map(|(key, _)| format!("{name}: {key}")));
        let exactly = format!("={}", package.version);
        let own = package.dependencies.iter().filter(|used| ours.contains(used.name.as_str()));
        for used in own.filter(|used| used.req.to_string() != exactly) {
            wrong.push(format!("{name} wants {} {}, not {exactly}", used.name, used.req));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What the compiler reads beside a file of Rust, up to the path.
const READS: [&str; 4] = ["include_str!(\"", "include_bytes!(\"", "include!(\"", "#[path = \""];

#[test]
fn nothing_is_built_from_files_outside_of_its_package() {
    let mut wrong = Vec::new();
    for package in published(&metadata()) {
        let root = package.manifest_path.parent().expect("a package has a folder");
        let mut files = rust_files(&root.join("src"));
        files.extend(Some(root.join("build.rs")).filter(|path| path.exists()));
        for file in files {
            let text = std::fs::read_to_string(&file).expect("text");
            let folder = file.parent().expect("a file is in a folder");
            for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
                let read = READS.iter().find_map(|read| Some(line.split_once(read)?.1));
                let path = read.and_then(|rest| rest.split('"').next());
                let found = path.map(|path| folder.join(path).canonicalize_utf8());
                let is_outside =
                    found.is_some_and(|path| !path.is_ok_and(|path| path.starts_with(root)));
                if is_outside || line.contains("CARGO_MANIFEST_DIR\"), \"/..") {
                    wrong.push(format!("{file}: {}", line.trim()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The oldest Rust that is promised is not at hand everywhere. That our own code asks no more of the standard
/// library is what clippy's `incompatible_msrv` looks at; here are the crates of others.
#[test]
fn no_crate_of_others_asks_for_a_newer_rust_than_ours() {
    let metadata = metadata();
    let ours = metadata.workspace_packages();
    let promised = ours[0].rust_version.clone().expect("a promise");
    assert!(ours.iter().all(|own| own.rust_version.as_ref() == Some(&promised)));
    let newer =
        |package: &&Package| package.rust_version.as_ref().is_some_and(|rust| *rust > promised);
    let newer: Vec<String> = metadata
        .packages
        .iter()
        .filter(newer)
        .filter_map(|it| Some(format!("{} {}: {}", it.name, it.version, it.rust_version.as_ref()?)))
        .collect();
    assert!(newer.is_empty(), "newer than {promised}:\n{}", newer.join("\n"));
}

fn metadata() -> Metadata {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    MetadataCommand::new().manifest_path(manifest).exec().expect("cargo metadata works")
}

/// The packages of the workspace that a registry may have.
fn published(metadata: &Metadata) -> impl Iterator<Item = &Package> {
    let kept = |package: &&Package| package.publish.as_ref().is_some_and(Vec::is_empty);
    metadata.workspace_packages().into_iter().filter(move |package| !kept(package))
}

/// The Rust files in a folder and all that are in it.
fn rust_files(folder: &Utf8Path) -> Vec<Utf8PathBuf> {
    let mut found = Vec::new();
    for entry in folder.read_dir_utf8().expect("a folder") {
        let path = entry.expect("a file").into_path();
        match path.is_dir() {
            true => found.extend(rust_files(&path)),
            false => found.extend(Some(path).filter(|path| path.extension() == Some("rs"))),
        }
    }
    found
}
