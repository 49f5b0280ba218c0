//! A wheel for Python: the package in `python`, and the program as one of its scripts.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::compile::{Toolchain, remapped};
use crate::tool::{self, Outcome, works};

/// Makes the wheel for the system of a target, and gives its name and bytes.
pub(crate) fn build(
    root: &Path,
    target: &str,
    program: &Path,
    time: u64,
) -> Outcome<(String, Vec<u8>)> {
    if !works(Command::new("maturin").arg("--version")) {
        return Err("maturin is not here; `pip install maturin` brings it".to_owned());
    }
    let out = tempfile::tempdir().map_err(|error| error.to_string())?;
    let _data = Data::of(&root.join("python/vimc4._vimc4.data"), program)?;
    let mut maturin = Command::new("maturin");
    maturin.current_dir(root.join("python")).args(["build", "--release", "--locked", "--out"]);
    maturin.arg(out.path()).env("SOURCE_DATE_EPOCH", time.to_string());
    // Python loads libraries, which a program with musl inside cannot be: the extension is one for
    // glibc, of the oldest version that there are wheels for. The program runs there as everywhere.
    let extension = target.replace("-musl", "-gnu");
    maturin.args(["--target", &extension]);
    if target != extension {
        maturin.args(["--zig", "--compatibility", "manylinux2014"]);
    }
    let flags = match Toolchain::of(&extension)? {
        Toolchain::Own => Vec::new(),
        Toolchain::Debian => {
            maturin.args(["-Z", "build-std=std,panic_unwind"]);
            Toolchain::environment(&mut maturin)
        }
    };
    maturin.env("CARGO_ENCODED_RUSTFLAGS", [flags, remapped(root)].concat().join("\x1f"));
    tool::run(&mut maturin)?;
    let mut wheels = fs::read_dir(out.path()).map_err(|error| error.to_string())?;
    let wheel = wheels.next().ok_or("maturin has made no wheel")?;
    let wheel = wheel.map_err(|error| error.to_string())?;
    let bytes = fs::read(wheel.path()).map_err(|error| error.to_string())?;
    Ok((wheel.file_name().to_string_lossy().into_owned(), bytes))
}

/// The folder, named after the module, whose files maturin puts beside the package. It is there only
/// while a wheel is made, because a package that is built from a clone has no program.
struct Data(PathBuf);

impl Data {
    fn of(folder: &Path, program: &Path) -> Outcome<Data> {
        let data = Data(folder.to_owned());
        let scripts = folder.join("scripts");
        let copied = fs::create_dir_all(&scripts).and_then(|()| {
            fs::copy(program, scripts.join(program.file_name().unwrap_or_default()))
        });
        copied.map_err(|error| format!("{}: {error}", scripts.display()))?;
        Ok(data)
    }
}

impl Drop for Data {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
