//! What of others the program is built from: a bill of materials, and the licences.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use cargo_metadata::{Metadata, MetadataCommand, Package, PackageId};
use serde_json::{Value, json};

use crate::archive;
use crate::runtimes::{self, Runtime};
use crate::tool::{self, Outcome};

/// What is no longer than that, in bytes, only says where the text of a licence can be read.
const NOTICE: usize = 500;

/// What the program is built from, but for what runs only while it is built.
pub(crate) struct Crates {
    metadata: Metadata,
    chosen: BTreeSet<PackageId>,
    /// The SHA-256 of each package as the registry has it, by name and version.
    sums: BTreeMap<(String, String), String>,
    runtimes: Vec<&'static Runtime>,
    panel: Panel,
}

/// What is embedded with the panel: three.js.
struct Panel {
    version: String,
    licence: String,
}

impl Panel {
    fn of(root: &Path) -> Outcome<Panel> {
        let read = |name: &str| tool::text(&root.join(name));
        let package: Value = serde_json::from_str(&read("web/package.json")?)
            .map_err(|error| format!("web/package.json: {error}"))?;
        let version = package["devDependencies"]["three"].as_str();
        let version = version.ok_or("web/package.json names no version of three")?.to_owned();
        Ok(Panel { version, licence: read("crates/api/web/dist/licences.txt")? })
    }

    fn component(&self) -> Value {
        let reference = format!("pkg:npm/three@{}", self.version);
        json!({
            "type": "library",
            "bom-ref": reference,
            "name": "three",
            "version": self.version,
            "purl": reference,
            "licenses": [{ "expression": "MIT" }],
        })
    }
}

impl Crates {
    pub(crate) fn of_the_program(root: &Path, target: &str) -> Outcome<Crates> {
        let mut command = MetadataCommand::new();
        command.current_dir(root).other_options(vec!["--locked".to_owned()]);
        let metadata = command.exec().map_err(|error| error.to_string())?;
        let mut tree = Command::new("cargo");
        tree.current_dir(root).args(["tree", "--locked", "--package", "vimc4-emulator"]);
        tree.args(["--edges", "normal,no-proc-macro", "--prefix", "none", "--target", target]);
        let tree = tool::run(&mut tree)?;
        let tree = String::from_utf8_lossy(&tree);
        // NAME vVERSION, and for our own where they are.
        let names = tree.lines().filter_map(|line| {
            let (name, rest) = line.split_once(" v")?;
            Some((name, rest.split(' ').next()?))
        });
        let names: BTreeSet<(&str, &str)> = names.collect();
        let chosen = metadata.packages.iter().filter(|package| {
            names.contains(&(package.name.as_str(), package.version.to_string().as_str()))
        });
        let chosen = chosen.map(|package| package.id.clone()).collect();
        Ok(Crates {
            metadata,
            chosen,
            sums: sums(&tool::text(&root.join("Cargo.lock"))?),
            runtimes: runtimes::linked(target).collect(),
            panel: Panel::of(root)?,
        })
    }

    fn packages(&self) -> impl Iterator<Item = &Package> {
        self.chosen.iter().map(|id| &self.metadata[id])
    }

    /// All licences, each text once, with what it is of.
    pub(crate) fn licences(&self) -> Outcome<String> {
        let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut add = |text: &str, name: &str| {
            let names = texts.entry(text.replace("\r\n", "\n").trim().to_owned()).or_default();
            names.push(name.to_owned());
        };
        let mut all = "The program is linked with:\n\n".to_owned();
        for runtime in &self.runtimes {
            all += &format!("{}: {}\n", runtime.name, runtime.licence);
            runtime.texts.iter().for_each(|text| add(text, runtime.name));
        }
        all += &format!("\nIts panel contains:\n\nthree.js {}: MIT\n", self.panel.version);
        add(&self.panel.licence, "three.js");
        all += "\nThe crates of others in the program:\n\n";
        for package in self.packages().filter(|package| package.source.is_some()) {
            let name = format!("{} {}", package.name, package.version);
            let licence = package.license.as_deref().unwrap_or("see its text");
            all += &format!("{name}: {licence}");
            if licence.contains("MPL") {
                let place = format!("crates.io/crates/{}/{}", package.name, package.version);
                all += &format!("; its source is at https://{place}");
            }
            all += "\n";
            let Some(folder) = package.manifest_path.parent() else { continue };
            let files = folder.read_dir_utf8().map_err(|error| format!("{folder}: {error}"))?;
            let mut files: Vec<_> = files.flatten().map(|file| file.into_path()).collect();
            files.sort();
            let mut has_whole_text = false;
            let named = |path: &str| {
                let beginnings = ["licen", "copying", "copyright", "notice", "unlicense"];
                beginnings.iter().any(|name| path.to_lowercase().starts_with(name))
            };
            for file in files.iter().filter(|file| file.is_file()) {
                if file.file_name().is_some_and(named) {
                    let text = fs::read(file).map_err(|error| format!("{file}: {error}"))?;
                    has_whole_text |= text.len() > NOTICE;
                    add(&String::from_utf8_lossy(&text), &name);
                }
            }
            if !has_whole_text && let Some(text) = runtimes::referred_to(licence) {
                add(text, &name);
            }
        }
        let line = "-".repeat(100);
        for (text, names) in texts {
            all += &format!("\n{line}\n{}\n{line}\n\n{text}\n", names.join(", "));
        }
        Ok(all)
    }

    /// A bill of materials as CycloneDX 1.5 has it, of a time in seconds since 1970.
    pub(crate) fn bill_of_materials(&self, version: &str, time: u64) -> Vec<u8> {
        let reference =
            |package: &Package| format!("pkg:cargo/{}@{}", package.name, package.version);
        let program = self.packages().find(|package| package.name == "vimc4-emulator");
        let component = |package: &Package| -> Value {
            let mut component = json!({
                "type": "library",
                "bom-ref": reference(package),
                "name": package.name.as_str(),
                "version": package.version.to_string(),
                "purl": reference(package),
            });
            if let Some(licence) = &package.license {
                // The older way of writing a choice.
                let licence = licence.replace('/', " OR ");
                component["licenses"] = json!([{ "expression": licence }]);
            }
            let name = (package.name.to_string(), package.version.to_string());
            if let Some(sum) = self.sums.get(&name) {
                component["hashes"] = json!([{ "alg": "SHA-256", "content": sum }]);
            }
            component
        };
        let nodes = self.metadata.resolve.iter().flat_map(|resolve| &resolve.nodes);
        let dependencies = nodes.filter(|node| self.chosen.contains(&node.id)).map(|node| {
            let used = node.deps.iter().filter(|used| self.chosen.contains(&used.pkg));
            let used: BTreeSet<String> =
                used.map(|used| reference(&self.metadata[&used.pkg])).collect();
            json!({ "ref": reference(&self.metadata[&node.id]), "dependsOn": used })
        });
        let bill = json!({
            "bomFormat": "CycloneDX",
            "specVersion": "1.5",
            "version": 1,
            "metadata": {
                "timestamp": archive::moment(time),
                "component": {
                    "type": "application",
                    "bom-ref": program.map(reference),
                    "name": "vimc4",
                    "version": version,
                    "licenses": [{ "expression": "MIT OR Apache-2.0" }],
                },
            },
            "components": self
                .packages()
                .filter(|package| package.name != "vimc4-emulator")
                .map(component)
                .chain([self.panel.component()])
                .collect::<Vec<_>>(),
            "dependencies": dependencies.collect::<Vec<_>>(),
        });
        format!("{bill:#}\n").into_bytes()
    }
}

/// The sums that Cargo.lock has, by name and version.
fn sums(lock: &str) -> BTreeMap<(String, String), String> {
    let value = |block: &str, key: &str| {
        let line = block.lines().find_map(|line| line.strip_prefix(&format!("{key} = ")))?;
        Some(line.trim_matches('"').to_owned())
    };
    let of = |block| {
        Some(((value(block, "name")?, value(block, "version")?), value(block, "checksum")?))
    };
    lock.split("[[package]]").filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(target: &str) -> Crates {
        Crates::of_the_program(&tool::root(), target).unwrap()
    }

    #[test]
    fn the_licences_of_a_program_have_the_text_of_all_that_it_is_linked_with() {
        let windows = of("x86_64-pc-windows-gnu").licences().unwrap();
        let linux = of("x86_64-unknown-linux-musl").licences().unwrap();
        let everywhere = [
            "Mozilla Public License Version 2.0\n",
            "3.2. Distribution of Executable Form",
            "MPL-2.0; its source is at https://crates.io/crates/serialport/",
            "Copyright (c) The Rust Project Contributors",
            "three.js authors",
        ];
        for text in everywhere {
            assert!(windows.contains(text) && linux.contains(text), "{text}");
        }
        for text in ["GNU GENERAL PUBLIC LICENSE", "GCC RUNTIME LIBRARY EXCEPTION", "Zope Public"] {
            assert!(windows.contains(text) && !linux.contains(text), "{text}");
        }
        for text in ["musl as a whole", "under the Apache License v2.0 with LLVM Exceptions"] {
            assert!(linux.contains(text) && !windows.contains(text), "{text}");
        }
        // It leads to no file of ours, which Debian's packages do not have.
        for licences in [windows, linux] {
            let (ours, _) = licences.split_once("-----").unwrap();
            assert!(!ours.contains("LICENSE"), "{ours}");
        }
    }

    #[test]
    fn every_crate_that_is_listed_has_a_text() {
        for target in ["x86_64-unknown-linux-musl", "x86_64-pc-windows-gnu"] {
            let licences = of(target).licences().unwrap();
            let (_, list) = licences.split_once("crates of others in the program:\n\n").unwrap();
            let (list, texts) = list.split_once("\n\n").unwrap();
            let headings = texts.lines().collect::<Vec<_>>();
            let without = list.lines().filter_map(|line| {
                let (name, _) = line.split_once(": ")?;
                let named = |line: &&str| line.split(", ").any(|other| other == name);
                (!headings.iter().any(named)).then_some(name)
            });
            assert_eq!(without.collect::<Vec<_>>(), Vec::<&str>::new(), "{target}");
        }
    }

    #[test]
    fn the_bill_of_materials_has_its_time_and_what_the_panel_contains() {
        let bill = of("x86_64-unknown-linux-musl").bill_of_materials("1.2.3", 1_700_000_000);
        let bill: Value = serde_json::from_slice(&bill).unwrap();
        assert_eq!(bill["metadata"]["timestamp"], "2023-11-14T22:13:20Z");
        let three =
            bill["components"].as_array().unwrap().iter().find(|one| one["name"] == "three");
        let purl = three.unwrap()["purl"].as_str().unwrap();
        assert!(purl.starts_with("pkg:npm/three@0."), "{purl}");
    }
}
