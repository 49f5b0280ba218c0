//! Lists the fixture files, so that the sessions are part of the library and an installed
//! program needs no checkout.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// From the folder of this package, in which build scripts run. A build folder may be copied to
/// another checkout, so nothing that is kept there may lead back to this one.
const FIXTURES: &str = "../../fixtures";

fn main() -> io::Result<()> {
    let mut text = String::from("&[\n");
    for path in files(&Path::new(FIXTURES).join("sessions"))? {
        let folder = |path: &Path| -> String {
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        };
        let topic = path.parent().unwrap_or(&path);
        let (family, topic) = (topic.parent().map(folder).unwrap_or_default(), folder(topic));
        let shown = path.strip_prefix(FIXTURES).unwrap_or(&path).display();
        let shown = format!("fixtures/{shown}").replace('\\', "/");
        let text_of = included(&path);
        let _ = writeln!(text, "    ({family:?}, {topic:?}, {shown:?}, {text_of}),");
    }
    text.push_str("]\n");
    write("sessions.rs", &text)?;
    let mut text = String::from("&[\n");
    for path in files(&Path::new(FIXTURES).join("programs"))? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let _ = writeln!(text, "    ({name:?}, {}),", included(&path));
    }
    text.push_str("]\n");
    write("programs.rs", &text)
}

/// The text of a file, as an expression.
fn included(path: &Path) -> String {
    let behind = format!("/{}", path.display());
    format!("include_str!(concat!(env!(\"CARGO_MANIFEST_DIR\"), {behind:?}))")
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
