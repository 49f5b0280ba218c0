//! `cargo xtask`: what a release hands out, and a try of it where nothing else is installed.
#![forbid(unsafe_code)]

mod archive;
mod compile;
mod contents;
mod deb;
mod foreign;
mod room;
mod runtimes;
mod tool;
mod weigh;
mod wheel;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use flate2::Compression;
use flate2::write::GzEncoder;

use archive::Entry;
use tool::Outcome;

/// What is done around the program, and not by it.
#[derive(Parser)]
#[command(bin_name = "cargo xtask")]
enum Task {
    /// Build and pack what a release hands out: archives, a Debian package, a bill of materials, the
    /// licences of others, checksums
    #[command(after_long_help = "\
Examples:
  cargo xtask dist
  cargo xtask dist --target aarch64-unknown-linux-musl --target x86_64-pc-windows-gnu

What a target needs that is not there is said, with what installs it. The time of the files is that of
the commit, or SOURCE_DATE_EPOCH.")]
    Dist {
        /// For which system, as rustc names it; once for each
        #[arg(long = "target", default_value = "x86_64-unknown-linux-musl")]
        targets: Vec<String>,
        /// The profile to build with
        #[arg(long, default_value = "dist")]
        profile: String,
        /// Make wheels for Python, too; needs maturin, and zig for Linux
        #[arg(long)]
        wheels: bool,
        /// The folder for what is packed
        #[arg(long, default_value = "target/packages")]
        out: PathBuf,
    },
    /// Build the controllers of the page, as WebAssembly
    #[command(after_long_help = "\
Example:
  cargo xtask page

`npm run playground` in `web` then makes the page.")]
    Page {
        /// The folder for them
        #[arg(long, default_value = "target/page")]
        out: PathBuf,
    },
    /// Unpack packages where there is nothing else, start them there, and await the first answer
    #[command(after_long_help = "\
Examples:
  cargo xtask try target/packages/*.tar.gz target/packages/*.deb

It needs Linux with `unshare` and `mount`, and for a Debian package root and `dpkg`. What is for another
processor is run by QEMU, of Debian's `qemu-user-static`.")]
    Try {
        /// Archives (.tar.gz) and Debian packages (.deb) for Linux
        #[arg(required = true)]
        packages: Vec<PathBuf>,
    },
    /// Measure code, documents and dependencies; fail where a figure grew by more than 2 % over
    /// `xtask/weight.toml`
    Weigh {
        /// Write the figures to `xtask/weight.toml`
        #[arg(long)]
        update: bool,
        /// List long functions and repeated names
        #[arg(long)]
        details: bool,
    },
}

fn main() -> ExitCode {
    let done = match Task::parse() {
        Task::Dist { targets, profile, wheels, out } => dist(&targets, &profile, wheels, &out),
        Task::Page { out } => page(&out),
        Task::Try { packages } => packages.iter().try_for_each(|package| room::visit(package)),
        Task::Weigh { update, details } => weigh::weigh(update, details),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("xtask: {what}");
            ExitCode::FAILURE
        }
    }
}

fn page(out: &Path) -> Outcome<()> {
    for (name, is_whole) in [("vimc4_first.wasm", false), ("vimc4_page.wasm", true)] {
        let built = compile::page(&tool::root(), is_whole)?;
        let module = fs::read(&built).map_err(|error| format!("{}: {error}", built.display()))?;
        let mut packed = GzEncoder::new(Vec::new(), Compression::best());
        let packed = packed.write_all(&module).and_then(|()| packed.finish());
        let packed = packed.map_err(|error| format!("cannot compress it: {error}"))?;
        let path = out.join(name);
        let written = fs::create_dir_all(out).and_then(|()| fs::write(&path, &module));
        written.map_err(|error| format!("{}: {error}", path.display()))?;
        println!("{}: {} bytes, {} with gzip", path.display(), module.len(), packed.len());
    }
    Ok(())
}

fn dist(targets: &[String], profile: &str, wheels: bool, out: &Path) -> Outcome<()> {
    let out = std::path::absolute(out).map_err(|error| format!("{}: {error}", out.display()))?;
    let root = tool::root();
    let mut programs = Vec::new();
    for target in targets {
        println!("building {target}");
        programs.push((target, compile::program(&root, target, profile)?));
    }
    let version = env!("CARGO_PKG_VERSION");
    let time = tool::time_of_release(&root)?;
    let shared = contents::shared(&root, &programs)?;
    fs::create_dir_all(&out).map_err(|error| format!("{}: {error}", out.display()))?;
    let put = |name: &str, bytes: Vec<u8>| {
        println!("{:>11} bytes  {name}", bytes.len());
        let path = out.join(name);
        fs::write(&path, bytes).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok::<String, String>(format!("{}  {name}\n", tool::sha256(&path)?))
    };
    let mut sums = String::new();
    for (target, path) in &programs {
        let program = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let name = format!("vimc4-{version}-{target}");
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let crates = foreign::Crates::of_the_program(&root, target)?;
        let mut beside = shared.clone();
        beside.push(Entry::file("THIRD-PARTY.txt", crates.licences()?));
        beside.sort_by(|a, b| a.path.cmp(&b.path));
        let mut entries = vec![Entry::program(format!("{name}/{file}"), program.clone())];
        entries.extend(beside.iter().map(|entry| entry.named(format!("{name}/{}", entry.path))));
        sums += &match target.contains("windows") {
            true => put(&format!("{name}.zip"), archive::zip(&entries, time)?)?,
            false => put(&format!("{name}.tar.gz"), archive::tar_gz(&entries, time)?)?,
        };
        let bill = crates.bill_of_materials(version, time);
        sums += &put(&format!("{name}.cdx.json"), bill)?;
        if let Some(architecture) = deb::architecture(target) {
            let package = deb::package(&root, version, architecture, program, &beside, time)?;
            sums += &put(&format!("vimc4_{version}_{architecture}.deb"), package)?;
        }
        if wheels {
            let (name, wheel) = wheel::build(&root, target, path, time)?;
            sums += &put(&name, wheel)?;
        }
    }
    // What was packed before, for other systems, lies beside it.
    let before = fs::read_to_string(out.join("SHA256SUMS")).unwrap_or_default();
    sums = added(&before, &sums, |name| out.join(name).is_file());
    put("SHA256SUMS", sums.into_bytes())?;
    println!("in {}", out.display());
    Ok(())
}

/// Check sums beside those of before, of what is still there and was not made anew, by the names.
fn added(before: &str, new: &str, is_there: impl Fn(&str) -> bool) -> String {
    fn name(line: &str) -> &str {
        line.split_once("  ").map_or(line, |(_, name)| name)
    }
    let is_new = |line: &str| new.lines().any(|own| name(own) == name(line));
    let kept = before.lines().filter(|line| is_there(name(line)) && !is_new(line));
    let mut lines: Vec<&str> = kept.chain(new.lines()).collect();
    lines.sort_by_key(|line| name(line));
    lines.iter().flat_map(|line| [line, "\n"]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_packed_for_other_systems_keeps_its_sum() {
        let there = |name: &str| name != "gone.zip";
        assert_eq!(
            added("1  b.zip\n2  gone.zip\n3  c.deb\n", "4  c.deb\n5  a.tar.gz\n", there),
            "5  a.tar.gz\n1  b.zip\n4  c.deb\n"
        );
        assert_eq!(added("", "1  a\n", there), "1  a\n");
    }
}
