//! `cargo xtask weigh`: how heavy the project is, held against the committed figures.

mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};

use crate::tool::{self, Outcome};
use source::Source;

/// How much a figure may grow without an update of the file, in parts of 50.
const TOLERANCE: u64 = 1;

/// The committed figures.
const FILE: &str = "xtask/weight.toml";

/// Documents that a program writes; nobody reads them from end to end.
const GENERATED: [&str; 2] = ["behaviour.md", "ncp-reference.md"];

/// All figures. Less is better for each.
#[derive(Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields, default)]
struct Weight {
    /// Lines of product code, without blank lines and comments.
    product_lines: u64,
    /// Lines of test code.
    test_lines: u64,
    /// Words of documents that people write.
    document_words: u64,
    /// Packages that the program is built from, our own included.
    packages: u64,
    /// Functions of the product over 80 lines.
    long_functions: u64,
    /// Names of types that are defined more than three times.
    repeated_names: u64,
    /// Sleeps in tests.
    test_sleeps: u64,
    /// Lines of product code of each crate.
    crates: BTreeMap<String, u64>,
}

impl Weight {
    /// The figures that stand for the whole, each with its name.
    fn totals(&self) -> [(&'static str, u64); 7] {
        [
            ("product_lines", self.product_lines),
            ("test_lines", self.test_lines),
            ("document_words", self.document_words),
            ("packages", self.packages),
            ("long_functions", self.long_functions),
            ("repeated_names", self.repeated_names),
            ("test_sleeps", self.test_sleeps),
        ]
    }

    /// Figures that are more than 2 % over the committed ones.
    fn grown<'a>(&'a self, committed: &'a Self) -> impl Iterator<Item = String> + 'a {
        let pairs = self.totals().into_iter().zip(committed.totals());
        let grown = pairs.filter(|((_, now), (_, before))| *now > before + before * TOLERANCE / 50);
        grown.map(|((name, now), (_, before))| format!("{name} grew from {before} to {now}"))
    }
}

/// Measures, prints, and compares with the committed figures or replaces them.
pub(crate) fn weigh(update: bool, details: bool) -> Outcome<()> {
    let root = tool::root();
    let file = root.join(FILE);
    let sources = sources(&root)?;
    let weight = measure(&root, &sources)?;
    print!("{}", text(&weight)?);
    if details {
        print_details(&sources);
    }
    for (name, size) in artefacts(&root) {
        println!("# {name}: {size} bytes");
    }
    if update {
        return fs::write(&file, text(&weight)?).map_err(|error| format!("{FILE}: {error}"));
    }
    let committed =
        toml::from_str(&tool::text(&file)?).map_err(|error| format!("{FILE}: {error}"))?;
    let grown: Vec<String> = weight.grown(&committed).collect();
    match grown.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "{}; make it smaller, or run `cargo xtask weigh --update` and give the reason in the commit",
            grown.join("; ")
        )),
    }
}

fn text(weight: &Weight) -> Outcome<String> {
    toml::to_string(weight).map_err(|error| error.to_string())
}

/// All Rust sources of the product and its tests.
fn sources(root: &Path) -> Outcome<Vec<Source>> {
    let mut paths = Vec::new();
    for folder in ["crates", "emulator", "fixtures", "python", "tests"] {
        collect(
            &root.join(folder),
            &|path| path.extension().is_some_and(|end| end == "rs"),
            &mut paths,
        )?;
    }
    paths.sort();
    let read =
        |path: &PathBuf| Source::read(path.strip_prefix(root).unwrap_or(path), &tool::text(path)?);
    paths.iter().filter(|path| !path.ends_with("build.rs")).map(read).collect()
}

/// All wanted files below a folder, without those that a build makes.
fn collect(
    folder: &Path,
    is_wanted: &dyn Fn(&Path) -> bool,
    found: &mut Vec<PathBuf>,
) -> Outcome<()> {
    let failed = |error| format!("{}: {error}", folder.display());
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_dir() && !path.ends_with("target") && !path.ends_with("node_modules") {
            collect(&path, is_wanted, found)?;
        } else if path.is_file() && is_wanted(&path) {
            found.push(path);
        }
    }
    Ok(())
}

fn measure(root: &Path, sources: &[Source]) -> Outcome<Weight> {
    let mut weight = Weight {
        document_words: document_words(root)?,
        packages: packages(root)?,
        repeated_names: repeated_names(sources).len() as u64,
        ..Weight::default()
    };
    for source in sources {
        weight.product_lines += source.product_lines;
        weight.test_lines += source.test_lines;
        weight.test_sleeps += source.test_sleeps;
        weight.long_functions += source.long_functions.len() as u64;
        if source.product_lines > 0 {
            *weight.crates.entry(source.package.clone()).or_default() += source.product_lines;
        }
    }
    Ok(weight)
}

fn document_words(root: &Path) -> Outcome<u64> {
    let mut pages =
        ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root.join(name)).to_vec();
    let is_written = |path: &Path| {
        path.extension().is_some_and(|end| end == "md")
            && !GENERATED.iter().any(|name| path.ends_with(name))
    };
    collect(&root.join("docs"), &is_written, &mut pages)?;
    pages.iter().map(|page| Ok(tool::text(page)?.split_whitespace().count() as u64)).sum()
}

/// How many packages the program is built from here, tools of the build included.
fn packages(root: &Path) -> Outcome<u64> {
    let mut tree = Command::new("cargo");
    tree.current_dir(root).args(["tree", "--locked", "--package", "vimc4-emulator"]);
    let tree = tool::run(tree.args(["--edges", "no-dev", "--prefix", "none", "--format", "{p}"]))?;
    let tree = String::from_utf8_lossy(&tree);
    let names = tree.lines().map(|line| line.split_once(" (").map_or(line, |(name, _)| name));
    Ok(names.collect::<BTreeSet<_>>().len() as u64)
}

/// Names that stand for more than three types, each with the files that define it.
fn repeated_names(sources: &[Source]) -> BTreeMap<&str, Vec<&str>> {
    let mut files: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for source in sources {
        source.types.iter().for_each(|name| files.entry(name).or_default().push(&source.path));
    }
    files.retain(|_, files| files.len() > 3);
    files
}

fn print_details(sources: &[Source]) {
    for source in sources {
        for (name, lines) in &source.long_functions {
            println!("# {}: {name} has {lines} lines", source.path);
        }
    }
    for (name, files) in repeated_names(sources) {
        println!("# {name} is defined {} times: {}", files.len(), files.join(", "));
    }
}

/// The programs that have been built, and their sizes.
fn artefacts(root: &Path) -> impl Iterator<Item = (String, u64)> {
    let names = ["target/release/vimc4", "target/dist/vimc4"];
    let sizes =
        names.map(|name| (name.to_owned(), fs::metadata(root.join(name)).map(|file| file.len())));
    sizes.into_iter().filter_map(|(name, size)| Some((name, size.ok()?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_of_more_than_two_percent_is_reported() {
        let committed = Weight { product_lines: 1_000, packages: 10, ..Weight::default() };
        let grown = |weight: Weight| weight.grown(&committed).collect::<Vec<_>>();
        assert_eq!(
            grown(Weight { product_lines: 1_020, packages: 10, ..Weight::default() }),
            [""; 0]
        );
        assert_eq!(
            grown(Weight { product_lines: 1_021, packages: 11, ..Weight::default() }),
            ["product_lines grew from 1000 to 1021", "packages grew from 10 to 11"]
        );
    }
}
