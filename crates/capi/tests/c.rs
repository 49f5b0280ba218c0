//! The interface as C sees it: the header is that of the sources, and a program in C uses it.

use std::env;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_header_is_that_of_the_sources() -> Outcome {
    let bindings = cbindgen::Builder::new()
        .with_src(root().join("src/emulator.rs"))
        .with_src(root().join("src/error.rs"))
        .with_src(root().join("src/text.rs"))
        .with_src(root().join("src/line.rs"))
        .with_config(cbindgen::Config::from_file(root().join("cbindgen.toml"))?)
        .generate()?;
    let mut made = Vec::new();
    bindings.write(&mut made);
    let path = root().join("include/vimc4.h");
    if env::var_os("VIMC4_WRITE").is_some() {
        fs::write(&path, &made)?;
    }
    let made = String::from_utf8(made)?;
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        made == kept,
        "include/vimc4.h is not that of the sources; VIMC4_WRITE=1 cargo test -p vimc4-capi writes it\n{made}"
    );
    Ok(())
}

/// The folder with the libraries, which are made beside this test.
fn libraries() -> Result<PathBuf, Box<dyn std::error::Error>> {
    let test = env::current_exe()?;
    let folder = test.parent().ok_or("no folder above the test")?;
    Ok(folder.to_owned())
}

fn run(program: impl AsRef<OsStr>, arguments: &[&OsStr]) -> Result<Output, std::io::Error> {
    Command::new(program).args(arguments).output()
}

/// Compiles a program in C against the header, links it with the library, and runs it. Returns what it
/// prints.
fn runs(source: &str, linked: &[&str]) -> Result<String, Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (program, include) = (folder.path().join("program"), root().join("include"));
    let (source, libraries) = (root().join(source), libraries()?);
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"]).arg(include);
    compiler.arg(source).arg("-o").arg(&program).arg("-L").arg(&libraries).args(linked);
    let compiled = compiler.output()?;
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let mut program = Command::new(program);
    let ran = program.env("LD_LIBRARY_PATH", libraries).current_dir(folder.path()).output()?;
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{said}{}", String::from_utf8_lossy(&ran.stdout));
    Ok(String::from_utf8(ran.stdout)?)
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_in_c_uses_the_shared_library() -> Outcome {
    assert_eq!(runs("tests/program.c", &["-lvimc4_c"])?, "2500\n");
    Ok(())
}

/// What `vimc4.pc` has a program link that wants no shared library.
#[cfg(target_os = "linux")]
#[test]
fn a_program_in_c_uses_the_static_library() -> Outcome {
    let description = fs::read_to_string(root().join("vimc4.pc"))?;
    let private = description.lines().find_map(|line| line.strip_prefix("Libs.private: "));
    let private: Vec<&str> = private.ok_or("no private libraries")?.split(' ').collect();
    let library = ["-Wl,-Bstatic", "-lvimc4_c", "-Wl,-Bdynamic"];
    assert_eq!(runs("tests/program.c", &[&library[..], &private].concat())?, "2500\n");
    let version = format!("\nVersion: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(description.contains(&version), "vimc4.pc has another version");
    Ok(())
}

#[cfg(target_os = "linux")]
#[test]
fn the_example_stops_at_step_2500() -> Outcome {
    let printed = runs("../../examples/c/stop.c", &["-lvimc4_c"])?;
    assert_eq!(printed, "answers 0F at step 2503\n");
    Ok(())
}

/// Mono is asked for on Linux only, and not by everybody.
#[cfg(target_os = "linux")]
#[test]
fn the_example_in_csharp_does_so_too() -> Outcome {
    if run("mcs", &[OsStr::new("--version")]).is_err() {
        assert!(env::var_os("VIMC4_REQUIRE_TOOLS").is_none(), "needs mono-mcs");
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    let (program, source) =
        (folder.path().join("stop.exe"), root().join("../../examples/csharp/stop.cs"));
    let out = format!("-out:{}", program.display());
    let compiled = run("mcs", &[OsStr::new("-warnaserror"), OsStr::new(&out), source.as_os_str()])?;
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let mut mono = Command::new("mono");
    let ran = mono.arg(&program).env("LD_LIBRARY_PATH", libraries()?).output()?;
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(String::from_utf8_lossy(&ran.stdout), "answers 0F at step 2503\n", "{said}");
    assert!(ran.status.success(), "{said}");
    Ok(())
}

#[test]
fn cxx_takes_the_header_too() -> Outcome {
    let Ok(version) = run("c++", &[OsStr::new("--version")]) else { return Ok(()) };
    assert!(version.status.success());
    let folder = tempfile::tempdir()?;
    let source = folder.path().join("header.cpp");
    fs::write(&source, "#include \"vimc4.h\"\nint main() { return vimc4_start(0) == 0; }\n")?;
    let include = root().join("include");
    let arguments = ["-Wall", "-Werror", "-fsyntax-only", "-I"].map(OsStr::new);
    let compiled =
        run("c++", &[&arguments[..], &[include.as_os_str(), source.as_os_str()]].concat())?;
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    Ok(())
}
