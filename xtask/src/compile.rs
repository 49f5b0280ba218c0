//! The program for a target, built with what is here.
//!
//! Where the toolchain has the target's library, cargo builds as it always does. Where it has not, and
//! cannot fetch it, Debian's compiler builds one from its sources (`rustc-web`, `rust-web-src`), and zig,
//! which brings musl for every processor, links for Linux.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::tool::{self, Outcome, works};

/// The sources of the library and the compiler that they belong to, as Debian has them.
const SOURCES: &str = "/usr/lib/rustlib/src/rust/library";
const COMPILER: &str = "/usr/bin/rustc";

/// Builds the program and says where it is.
pub(crate) fn program(root: &Path, target: &str, profile: &str) -> Outcome<PathBuf> {
    let folder = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| root.join("target"));
    let mut cargo = Command::new("cargo");
    cargo.current_dir(root).args(["build", "--locked", "--package", "vimc4-emulator"]);
    cargo.args(["--target", target, "--profile", profile]);
    let mut flags = Vec::new();
    if !has_library(target) {
        if !Path::new(SOURCES).is_dir() {
            return Err(format!(
                "this toolchain has no library for {target}; `rustup target add {target}` brings it, or \
                 `apt install rustc-web rust-web-src` what builds one"
            ));
        }
        cargo.env("RUSTC", COMPILER).env("RUSTC_BOOTSTRAP", "1");
        cargo.arg("-Zbuild-std=std,panic_unwind");
        flags.push("-Clink-self-contained=no".to_owned());
        if let Some(linker) = zig(&folder, target)? {
            let variable = target.to_uppercase().replace('-', "_");
            cargo.env(format!("CARGO_TARGET_{variable}_LINKER"), linker);
        }
    }
    // Where it was built is nobody's business, and would make every build another.
    flags.push(format!("--remap-path-prefix={}=vimc4", root.display()));
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    flags.extend(home.map(|home| format!("--remap-path-prefix={}=cargo", home.display())));
    cargo.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"));
    tool::run(&mut cargo)?;
    let name = if target.contains("windows") { "vimc4.exe" } else { "vimc4" };
    // The folder of the profile `dev` has another name.
    let profile = if profile == "dev" { "debug" } else { profile };
    Ok(folder.join(target).join(profile).join(name))
}

fn has_library(target: &str) -> bool {
    let mut rustc = Command::new("rustc");
    let folder = tool::line(rustc.args(["--print", "target-libdir", "--target", target]));
    folder.is_ok_and(|folder| Path::new(&folder).is_dir())
}

/// A linker for musl, as a script, because cargo takes no arguments with one.
fn zig(folder: &Path, target: &str) -> Outcome<Option<PathBuf>> {
    let Some(processor) = target.strip_suffix("-unknown-linux-musl") else { return Ok(None) };
    let ways = ["zig", "python3 -m ziglang"];
    let there = |way: &&str| works(Command::new("sh").args(["-c", &format!("{way} version")]));
    let zig =
        ways.into_iter().find(there).ok_or("zig is not here; `pip install ziglang` brings it")?;
    let script = folder.join(format!("zig-{target}"));
    let text = format!("#!/bin/sh\nexec {zig} cc -target {processor}-linux-musl \"$@\"\n");
    let written = fs::create_dir_all(folder).and_then(|()| fs::write(&script, text));
    written.map_err(|error| format!("{}: {error}", script.display()))?;
    tool::run(Command::new("chmod").arg("755").arg(&script))?;
    Ok(Some(script))
}
