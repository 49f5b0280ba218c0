//! Paths as links have them, from the root of the repository, and files.

use std::fs;
use std::path::Path;

use crate::Outcome;

/// The path that a link in a file means; nothing if it leads out of the repository.
pub(crate) fn resolve(file: &str, link: &str) -> Option<String> {
    let folder = file.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in link.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// What went wrong with a file.
pub(crate) fn about(path: &Path, error: &std::io::Error) -> String {
    format!("{}: {error}", path.display())
}

pub(crate) fn read(path: &Path) -> Outcome<String> {
    fs::read_to_string(path).map_err(|error| about(path, &error))
}

/// Writes a file, and makes its folder if there is none.
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Outcome<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(|error| about(folder, &error))?;
    fs::write(path, bytes).map_err(|error| about(path, &error))
}

pub(crate) fn copy(from: &Path, to: &Path) -> Outcome<()> {
    write(to, fs::read(from).map_err(|error| about(from, &error))?)
}

/// Text as HTML has it.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_read_from_the_folder_of_its_file() {
        let of = |file, link| resolve(file, link);
        assert_eq!(of("docs/a.md", "b.md").as_deref(), Some("docs/b.md"));
        assert_eq!(of("docs/a.md", "../README.md").as_deref(), Some("README.md"));
        assert_eq!(of("README.md", "./docs/a.md").as_deref(), Some("docs/a.md"));
        assert_eq!(of("README.md", "../elsewhere"), None);
    }
}
