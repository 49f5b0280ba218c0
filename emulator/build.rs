//! Names the commit, the target and the features for `vimc4 --version`. Without git, or outside a
//! checkout, the commit is unknown.

use std::env;
use std::path::Path;
use std::process::Command;

fn main() {
    let commit = git(&["rev-parse", "--short=10", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
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

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    (output.status.success() && !text.trim().is_empty()).then(|| text.trim().to_owned())
}
