//! The crates of others that the program is built from: a bill of materials, and their licences.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use cargo_metadata::{Metadata, MetadataCommand, Package, PackageId};
use serde_json::{Value, json};

use crate::tool::{self, Outcome};

/// What is linked that is no crate.
const RUNTIMES: &str = "\
The program is also linked with the standard library of Rust (MIT or Apache-2.0, the Rust Project
contributors), for Linux with musl (MIT, Rich Felker and others) and with LLVM's libunwind (Apache-2.0 with
the LLVM exception), for Windows with the runtime of MinGW-w64 (ZPL-2.1 and public domain) and with that of GCC (GPL-3
with the runtime library exception). Their texts are those of LICENSE-MIT, with these names in the place
of ours, and of LICENSE-APACHE.
";

/// What the program is built from, but for what runs only while it is built.
pub(crate) struct Crates {
    metadata: Metadata,
    chosen: BTreeSet<PackageId>,
    /// The SHA-256 of each package as the registry has it, by name and version.
    sums: BTreeMap<(String, String), String>,
}

impl Crates {
    pub(crate) fn of_the_program(root: &Path, targets: &[String]) -> Outcome<Crates> {
        let mut command = MetadataCommand::new();
        command.current_dir(root).other_options(vec!["--locked".to_owned()]);
        let metadata = command.exec().map_err(|error| error.to_string())?;
        let mut names = BTreeSet::new();
        for target in targets {
            let mut tree = Command::new("cargo");
            tree.current_dir(root).args(["tree", "--locked", "--package", "vimc4-emulator"]);
            tree.args(["--edges", "normal,no-proc-macro", "--prefix", "none", "--target", target]);
            let tree = tool::run(&mut tree)?;
            // NAME vVERSION, and for our own where they are.
            for line in String::from_utf8_lossy(&tree).lines() {
                if let [name, version, ..] = line.split(' ').collect::<Vec<_>>()[..] {
                    names.insert((name.to_owned(), version.trim_start_matches('v').to_owned()));
                }
            }
        }
        let chosen = metadata.packages.iter().filter(|package| {
            names.contains(&(package.name.to_string(), package.version.to_string()))
        });
        let chosen = chosen.map(|package| package.id.clone()).collect();
        let lock = fs::read_to_string(root.join("Cargo.lock"));
        let sums = sums(&lock.map_err(|error| format!("Cargo.lock: {error}"))?);
        Ok(Crates { metadata, chosen, sums })
    }

    fn packages(&self) -> impl Iterator<Item = &Package> {
        self.chosen.iter().map(|id| &self.metadata[id])
    }

    /// All licences, each text once, with the crates that it is of.
    pub(crate) fn licences(&self) -> Outcome<String> {
        let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut list = String::new();
        for package in self.packages().filter(|package| package.source.is_some()) {
            let name = format!("{} {}", package.name, package.version);
            let licence = package.license.as_deref().unwrap_or("see its text");
            list += &format!("{name}: {licence}\n");
            let Some(folder) = package.manifest_path.parent() else { continue };
            let files = folder.read_dir_utf8().map_err(|error| format!("{folder}: {error}"))?;
            let mut files: Vec<_> = files.flatten().map(|file| file.into_path()).collect();
            files.sort();
            let named = |path: &str| {
                let beginnings = ["licen", "copying", "copyright", "notice", "unlicense"];
                beginnings.iter().any(|name| path.to_lowercase().starts_with(name))
            };
            for file in files.iter().filter(|file| file.is_file()) {
                if file.file_name().is_some_and(named) {
                    let text = fs::read(file).map_err(|error| format!("{file}: {error}"))?;
                    let text = String::from_utf8_lossy(&text).replace("\r\n", "\n");
                    texts.entry(text.trim().to_owned()).or_default().push(name.clone());
                }
            }
        }
        let line = "-".repeat(100);
        let mut all = format!("{RUNTIMES}\nThe crates of others in the program:\n\n{list}");
        for (text, names) in texts {
            all += &format!("\n{line}\n{}\n{line}\n\n{text}\n", names.join(", "));
        }
        Ok(all)
    }

    /// A bill of materials as CycloneDX 1.5 has it.
    pub(crate) fn bill_of_materials(&self, version: &str) -> Vec<u8> {
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
            "metadata": { "component": {
                "type": "application",
                "bom-ref": program.map(reference),
                "name": "vimc4",
                "version": version,
                "licenses": [{ "expression": "MIT OR Apache-2.0" }],
            }},
            "components": self
                .packages()
                .filter(|package| package.name != "vimc4-emulator")
                .map(component)
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
