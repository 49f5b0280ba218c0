//! Names the commit, the target and the features for `vimc4 --version`. The commit is that of the
//! checkout; in a package of the registry cargo has noted it. Otherwise it is unknown.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

fn main() {
    // A package may lie in somebody else's repository.
    let commit = if Path::new(PACKAGED).exists() {
        packaged()
    } else {
        git(&["rev-parse", "--short=10", "HEAD"])
    };
    let commit = commit.unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=VIMC4_COMMIT={commit}");
    println!("cargo::rustc-env=VIMC4_TARGET={}", env::var("TARGET").unwrap_or_default());
    let features = ["api"]
        .into_iter()
        .filter(|name| env::var_os(format!("CARGO_FEATURE_{}", name.to_uppercase())).is_some());
    let features = features.collect::<Vec<_>>().join(", ");
    let features = if features.is_empty() { "none" } else { &features };
    println!("cargo::rustc-env=VIMC4_FEATURES={features}");
    println!("cargo::rerun-if-changed=build.rs");
    // The log of HEAD grows with every commit and every checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"])
        && Path::new(&log).exists()
    {
        println!("cargo::rerun-if-changed={log}");
    }
}

/// Where cargo notes what it has packed.
const PACKAGED: &str = ".cargo_vcs_info.json";

/// The commit that was packed.
fn packaged() -> Option<String> {
    let note = fs::read_to_string(PACKAGED).ok()?;
    let (_, rest) = note.split_once("\"sha1\"")?;
    let commit: String = rest.chars().filter(char::is_ascii_hexdigit).take(10).collect();
    (commit.len() == 10).then_some(commit)
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    (output.status.success() && !text.trim().is_empty()).then(|| text.trim().to_owned())
}
