//! What every package has beside the program: manual pages, completions, documents, examples, our licences.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::archive::Entry;
use crate::compile;
use crate::tool::{self, Outcome, works};

/// The shells, and the names that their files of completions have.
const SHELLS: [(&str, &str); 4] =
    [("bash", "vimc4"), ("zsh", "_vimc4"), ("fish", "vimc4.fish"), ("powershell", "vimc4.ps1")];

/// Texts of the project that every package has.
const TEXTS: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];

/// Files as they lie in an archive. The program itself writes its manual and completions: one of those
/// that were built, or where none runs here one for this system.
pub(crate) fn shared(root: &Path, programs: &[(&String, PathBuf)]) -> Outcome<Vec<Entry>> {
    let runs = |path: &&PathBuf| {
        tool::program(path).is_ok_and(|mut program| works(program.arg("--version")))
    };
    let program = match programs.iter().map(|(_, path)| path).find(runs) {
        Some(path) => path.clone(),
        None => {
            let mut cargo = Command::new("cargo");
            tool::run(cargo.current_dir(root).args(["build", "--package", "vimc4-emulator"]))?;
            compile::folder(root).join("debug/vimc4")
        }
    };
    let mut entries = Vec::new();
    for name in TEXTS {
        entries.push(Entry::file(name, read(&root.join(name))?));
    }
    let files = ["ls-files", "docs", "examples", "ci/serv*.sh", "ci/finish.sh"];
    let files = tool::run(Command::new("git").current_dir(root).args(files))?;
    for name in String::from_utf8_lossy(&files).lines() {
        let bytes = read(&root.join(name))?;
        entries.push(match name.ends_with(".sh") {
            true => Entry::program(name.to_owned(), bytes),
            false => Entry::file(name, bytes),
        });
    }
    for (shell, name) in SHELLS {
        let script = tool::run(tool::program(&program)?.args(["completions", shell]))?;
        entries.push(Entry::file(format!("completions/{name}"), script));
    }
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    tool::run(tool::program(&program)?.arg("man").arg(folder.path()))?;
    let pages = fs::read_dir(folder.path()).map_err(|error| error.to_string())?;
    for page in pages {
        let page = page.map_err(|error| error.to_string())?;
        let name = format!("man/man1/{}", page.file_name().to_string_lossy());
        entries.push(Entry::file(name, read(&page.path())?));
    }
    Ok(entries)
}

fn read(path: &Path) -> Outcome<Vec<u8>> {
    fs::read(path).map_err(|error| format!("cannot read {}: {error}", path.display()))
}
