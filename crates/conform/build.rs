//! Lists the fixture files, so that the sessions are part of the library and an installed
//! program needs no checkout.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    // Asked for when it runs: a build folder that was copied must not read the first checkout.
    let crate_folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let fixtures = crate_folder.join("../../fixtures").canonicalize()?;
    let mut text = String::from("&[\n");
    for path in files(&fixtures.join("sessions"))? {
        let folder = |path: &Path| -> String {
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        };
        let topic = path.parent().unwrap_or(&path);
        let (family, topic) = (topic.parent().map(folder).unwrap_or_default(), folder(topic));
        let shown = path.strip_prefix(&fixtures).unwrap_or(&path).display();
        let _ = writeln!(
            text,
            "    ({family:?}, {topic:?}, {:?}, include_str!({path:?})),",
            format!("fixtures/{shown}").replace('\\', "/")
        );
    }
    text.push_str("]\n");
    write("sessions.rs", &text)?;
    let mut text = String::from("&[\n");
    for path in files(&fixtures.join("programs"))? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let _ = writeln!(text, "    ({name:?}, include_str!({path:?})),");
    }
    text.push_str("]\n");
    write("programs.rs", &text)
}

/// The files below a folder, sorted by name. The editor's hidden files are not.
fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')) {
            continue;
        }
        if path.is_dir() { paths.extend(files(&path)?) } else { paths.push(path) }
    }
    paths.sort();
    Ok(paths)
}

#[expect(clippy::disallowed_methods, reason = "a build script writes what it has made")]
fn write(name: &str, text: &str) -> io::Result<()> {
    let folder = env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?;
    fs::write(Path::new(&folder).join(name), text)
}
