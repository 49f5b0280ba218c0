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
    let folder = folder(root);
    let mut cargo = Command::new("cargo");
    cargo.current_dir(root).args(["build", "--locked", "--package", "vimc4-emulator"]);
    cargo.args(["--target", target, "--profile", profile]);
    let mut flags = Vec::new();
    if Toolchain::of(target)? == Toolchain::Debian {
        cargo.arg("-Zbuild-std=std,panic_unwind");
        flags.extend(Toolchain::environment(&mut cargo));
        if let Some(linker) = zig(&folder, target)? {
            let variable = target.to_uppercase().replace('-', "_");
            cargo.env(format!("CARGO_TARGET_{variable}_LINKER"), linker);
        }
    }
    flags.extend(remapped(root));
    cargo.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"));
    tool::run(&mut cargo)?;
    let name = if target.contains("windows") { "vimc4.exe" } else { "vimc4" };
    // The folder of the profile `dev` has another name.
    let profile = if profile == "dev" { "debug" } else { profile };
    Ok(folder.join(target).join(profile).join(name))
}

/// Builds the controllers of a page, as WebAssembly, and says where they are: the whole module, or the one that
/// answers first.
pub(crate) fn page(root: &Path, is_whole: bool) -> Outcome<PathBuf> {
    const TARGET: &str = "wasm32-unknown-unknown";
    let folder = folder(root);
    let mut cargo = Command::new("cargo");
    // Of a crate that is a library for Rust at the same time the linker could leave out less.
    cargo.current_dir(root).args(["rustc", "--locked", "--package", "vimc4-page", "--lib"]);
    cargo.args(["--crate-type", "cdylib", "--target", TARGET, "--profile", "page"]);
    if !is_whole {
        cargo.arg("--no-default-features");
    }
    let mut flags = remapped(root);
    if Toolchain::of(TARGET)? == Toolchain::Debian {
        // A panic says nothing to JavaScript but that there was one: no words are kept for it.
        flags.extend(["-Zunstable-options".to_owned(), "-Cpanic=immediate-abort".to_owned()]);
        // Its linker is that of the toolchain that is here.
        let linkers =
            PathBuf::from(tool::line(Command::new("rustc").args(["--print", "target-libdir"]))?);
        let linkers = linkers.with_file_name("bin");
        let paths = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::env::split_paths(&paths).chain([linkers]).collect::<Vec<_>>();
        let paths = std::env::join_paths(paths).map_err(|error| error.to_string())?;
        cargo.env("PATH", paths).env("RUSTC", COMPILER).env("RUSTC_BOOTSTRAP", "1");
        cargo.arg("-Zbuild-std=std,panic_abort").arg("-Zbuild-std-features=optimize_for_size");
    }
    cargo.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"));
    tool::run(&mut cargo)?;
    Ok(folder.join(TARGET).join("page").join("vimc4_page.wasm"))
}

/// Where cargo puts what it builds.
pub(crate) fn folder(root: &Path) -> PathBuf {
    let folder = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    folder.unwrap_or_else(|| root.join("target"))
}

/// The compiler's options that make the same of the same sources, wherever these are: where it was
/// built is nobody's business, and would make every build another.
pub(crate) fn remapped(root: &Path) -> Vec<String> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let folders = [Some((root.to_owned(), "vimc4")), home.map(|home| (home, "cargo"))];
    let folders = folders.into_iter().flatten();
    folders.map(|(from, to)| format!("--remap-path-prefix={}={to}", from.display())).collect()
}

/// What compiles for a target.
#[derive(PartialEq)]
pub(crate) enum Toolchain {
    /// The toolchain that is here has the target's library.
    Own,
    /// Debian's compiler builds one.
    Debian,
}

impl Toolchain {
    pub(crate) fn of(target: &str) -> Outcome<Toolchain> {
        let mut rustc = Command::new("rustc");
        let folder = tool::line(rustc.args(["--print", "target-libdir", "--target", target]))?;
        match (Path::new(&folder).is_dir(), Path::new(SOURCES).is_dir()) {
            (true, _) => Ok(Toolchain::Own),
            (false, true) => Ok(Toolchain::Debian),
            (false, false) => Err(format!(
                "this toolchain has no library for {target}; `rustup target add {target}` brings it, or \
                 `apt install rustc-web rust-web-src` what builds one"
            )),
        }
    }

    /// Has Debian's compiler used, and says with which options.
    pub(crate) fn environment(command: &mut Command) -> Vec<String> {
        command.env("RUSTC", COMPILER).env("RUSTC_BOOTSTRAP", "1");
        vec!["-Clink-self-contained=no".to_owned()]
    }
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
