//! Programs that are run, and what they say.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A result, or for people what is wrong and what would be right.
pub(crate) type Outcome<T> = Result<T, String>;

/// The folder of the workspace.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}

/// Runs a program to its end, its messages where ours are, and gives its output.
pub(crate) fn run(command: &mut Command) -> Outcome<Vec<u8>> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.stderr(Stdio::inherit()).output();
    let output = output.map_err(|error| format!("cannot run {name}: {error}"))?;
    match output.status.success() {
        true => Ok(output.stdout),
        false => Err(format!("{name} failed ({}): {command:?}", output.status)),
    }
}

/// The first line of a program's output.
pub(crate) fn line(command: &mut Command) -> Outcome<String> {
    let output = run(command)?;
    Ok(String::from_utf8_lossy(&output).lines().next().unwrap_or_default().to_owned())
}

/// Whether a program is there and ends well.
pub(crate) fn works(command: &mut Command) -> bool {
    let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// The time that all packed files get, in seconds since 1970: that of the commit, or what the
/// variable SOURCE_DATE_EPOCH says.
pub(crate) fn time_of_release(root: &Path) -> Outcome<u64> {
    let time = match std::env::var("SOURCE_DATE_EPOCH") {
        Ok(time) => time,
        Err(_) => line(Command::new("git").current_dir(root).args(["log", "-1", "--format=%ct"]))?,
    };
    time.parse().map_err(|_| format!("the time of the release is not in seconds: {time}"))
}

/// The SHA-256 of a file, in hexadecimal digits.
pub(crate) fn sha256(path: &Path) -> Outcome<String> {
    // The second is what macOS has.
    let line = line(Command::new("sha256sum").arg(path))
        .or_else(|_| line(Command::new("shasum").args(["-a", "256"]).arg(path)))?;
    Ok(line.split_whitespace().next().unwrap_or_default().to_owned())
}
