//! Programs that are run, and what they say.

use std::fs::File;
use std::io::Read as _;
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

/// A program for Linux, started by QEMU where it is for another processor than this one.
pub(crate) fn program(path: &Path) -> Outcome<Command> {
    Ok(match emulator_for(path)? {
        None => Command::new(path),
        Some(emulator) => {
            let mut command = Command::new(emulator);
            command.arg(path);
            command
        }
    })
}

/// QEMU's emulator for a program of another processor, as one file that needs no other.
pub(crate) fn emulator_for(program: &Path) -> Outcome<Option<PathBuf>> {
    let mut head = [0; 20];
    File::open(program)
        .and_then(|mut file| file.read_exact(&mut head))
        .map_err(|error| format!("{}: {error}", program.display()))?;
    // Here an ELF file says which processor it is for.
    let processor = match (&head[..4], u16::from_le_bytes([head[18], head[19]])) {
        (b"\x7fELF", 62) => "x86_64",
        (b"\x7fELF", 183) => "aarch64",
        _ => return Ok(None),
    };
    if processor == std::env::consts::ARCH {
        return Ok(None);
    }
    let name = format!("qemu-{processor}-static");
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let mut places = std::env::split_paths(&paths).map(|folder| folder.join(&name));
    places.find(|path| path.is_file()).map(Some).ok_or_else(|| {
        format!(
            "{} is for {processor}, and {name} is not here; `apt install qemu-user-static` brings it",
            program.display()
        )
    })
}

/// The text of a file.
pub(crate) fn text(path: &Path) -> Outcome<String> {
    std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What the beginning of a program says of its processor, and what is made of that.
    fn emulator(magic: &[u8; 4], machine: u8) -> Outcome<Option<PathBuf>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("vimc4");
        let mut head = [0; 64];
        head[..4].copy_from_slice(magic);
        head[18] = machine;
        std::fs::write(&path, head).unwrap();
        emulator_for(&path)
    }

    #[test]
    fn only_a_program_of_another_processor_needs_an_emulator() {
        for (machine, processor) in [(62, "x86_64"), (183, "aarch64")] {
            let emulator = emulator(b"\x7fELF", machine);
            if processor == std::env::consts::ARCH {
                assert_eq!(emulator, Ok(None));
                continue;
            }
            match emulator {
                Ok(path) => assert!(path.unwrap().ends_with(format!("qemu-{processor}-static"))),
                Err(error) => assert!(error.contains("apt install qemu-user-static"), "{error}"),
            }
        }
        assert_eq!(emulator(b"MZ\0\0", 0), Ok(None));
    }

    #[test]
    fn a_program_is_started_as_it_is_or_by_its_emulator() {
        let own = std::env::current_exe().unwrap();
        assert_eq!(program(&own).unwrap().get_program(), own.as_os_str());
        let error = program(Path::new("nowhere/vimc4")).unwrap_err();
        assert!(error.starts_with("nowhere/vimc4: "), "{error}");
    }
}
