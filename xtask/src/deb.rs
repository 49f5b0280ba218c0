//! A Debian package: the program, what every package has, where Debian has it, and a note.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::archive::{Entry, ar, gz, tar_gz};
use crate::tool::{self, Outcome};

/// What Debian calls the processor of a target; none if it is not a target for Debian.
pub(crate) fn architecture(target: &str) -> Option<&'static str> {
    match target {
        "x86_64-unknown-linux-musl" => Some("amd64"),
        "aarch64-unknown-linux-musl" => Some("arm64"),
        _ => None,
    }
}

/// The package. The program needs no library, so the package depends on nothing.
pub(crate) fn package(
    root: &Path,
    version: &str,
    architecture: &str,
    program: Vec<u8>,
    shared: &[Entry],
    time: u64,
) -> Outcome<Vec<u8>> {
    let own = |name: &str| tool::text(&root.join("xtask/debian").join(name));
    let mut files = vec![Entry::program("./usr/bin/vimc4".to_owned(), program)];
    for entry in shared {
        let bytes = entry.bytes.as_slice();
        let doc = |name: &str| format!("./usr/share/doc/vimc4/{name}");
        files.extend(match entry.path.split_once('/') {
            Some(("man", page)) => {
                Some(Entry::file(format!("./usr/share/man/{page}.gz"), gz(bytes)?))
            }
            Some(("completions", "vimc4.ps1")) => None,
            Some(("completions", name)) => {
                let folder = match name {
                    "vimc4" => "bash-completion/completions",
                    "_vimc4" => "zsh/vendor-completions",
                    _ => "fish/vendor_completions.d",
                };
                Some(Entry::file(format!("./usr/share/{folder}/{name}"), bytes))
            }
            Some(("docs" | "examples", _)) => Some(Entry::file(doc(&entry.path), bytes)),
            Some(("ci", name)) => Some(entry.named(doc(&format!("examples/ci/{name}")))),
            _ if entry.path.starts_with("LICENSE") => None,
            _ if entry.path == "CHANGELOG.md" => Some(Entry::file(doc("NEWS.md.gz"), gz(bytes)?)),
            _ if entry.path == "THIRD-PARTY.txt" => {
                Some(Entry::file(doc("THIRD-PARTY.txt.gz"), gz(bytes)?))
            }
            _ => Some(Entry::file(doc(&entry.path), bytes)),
        });
    }
    let control = own("control")?;
    let maintainer = control.lines().find_map(|line| line.strip_prefix("Maintainer: "));
    let maintainer = maintainer.ok_or("xtask/debian/control names no maintainer")?;
    let date = tool::line(Command::new("date").args(["-u", "-R", "-d", &format!("@{time}")]))?;
    let changelog = format!(
        "vimc4 ({version}) unstable; urgency=medium\n\n  * Version {version}; NEWS.md says what is new.\n\n \
         -- {maintainer}  {date}\n"
    );
    let doc = "./usr/share/doc/vimc4";
    files.push(Entry::file(format!("{doc}/changelog.gz"), gz(changelog.as_bytes())?));
    files.push(Entry::file(format!("{doc}/copyright"), own("copyright")?));
    files.push(Entry::file(format!("{doc}/README.Debian"), own("README.Debian")?));
    files.push(Entry::file("./usr/share/applications/vimc4.desktop", own("vimc4.desktop")?));
    files.push(Entry::file("./usr/share/lintian/overrides/vimc4", own("lintian-overrides")?));
    files.sort_by(|a, b| a.path.cmp(&b.path));
    let kilobytes: usize = files.iter().map(|file| file.bytes.len().div_ceil(1024)).sum();
    let control = control
        .replace("VERSION", version)
        .replace("ARCHITECTURE", architecture)
        .replace("SIZE", &kilobytes.to_string());
    let sums = files
        .iter()
        .map(|file| Ok(format!("{}  {}\n", md5(&file.bytes)?, file.path.trim_start_matches("./"))));
    let sums = sums.collect::<Outcome<String>>()?;
    let control = [Entry::file("./control", control), Entry::file("./md5sums", sums)];
    let members = [
        ("debian-binary", b"2.0\n".to_vec()),
        ("control.tar.gz", tar_gz(&control, time)?),
        ("data.tar.gz", tar_gz(&files, time)?),
    ];
    Ok(ar(&members, time))
}

fn md5(bytes: &[u8]) -> Outcome<String> {
    let mut command = Command::new("md5sum");
    let child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut child = child.map_err(|error| format!("cannot run md5sum: {error}"))?;
    if let Some(mut stdin) = child.stdin.take() {
        stdin.write_all(bytes).map_err(|error| format!("md5sum: {error}"))?;
    }
    let output = child.wait_with_output().map_err(|error| format!("md5sum: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    Ok(text.split(' ').next().unwrap_or_default().to_owned())
}
