//! A room with nothing in it but a package, in which it must start and answer.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::tool::{self, Outcome};

/// How long anything may take before it counts as never.
const PATIENCE: Duration = Duration::from_secs(60);

/// Unpacks a package where there is nothing else, starts it, and awaits its first answer.
pub(crate) fn visit(package: &Path) -> Outcome<()> {
    let room = tempfile::tempdir().map_err(|error| error.to_string())?;
    let room = room.path();
    let begin = Instant::now();
    let is_deb = package.extension().is_some_and(|extension| extension == "deb");
    let folder = match is_deb {
        true => install(package, room)?,
        false => unpack(package, room)?,
    };
    let (first, version) = first_answer(room, &folder)?;
    let size = fs::metadata(room.join(&folder).join("vimc4")).map(|file| file.len());
    println!("{}: {version}", package.display());
    println!(
        "  {} bytes, the program {}; from the package to the first answer {} ms, from the start {} ms",
        fs::metadata(package).map_err(|error| error.to_string())?.len(),
        size.map_err(|error| error.to_string())?,
        begin.elapsed().as_millis(),
        first.as_millis(),
    );
    if is_deb {
        remove(room)?;
        println!("  removed, and nothing of it is left");
    }
    Ok(())
}

/// Unpacks an archive and says in which folder of the room the program is.
fn unpack(package: &Path, room: &Path) -> Outcome<String> {
    tool::run(Command::new("tar").arg("-xzf").arg(package).arg("-C").arg(room))?;
    let mut folders = fs::read_dir(room).map_err(|error| error.to_string())?;
    let folder =
        folders.next().ok_or("the archive is empty")?.map_err(|error| error.to_string())?;
    Ok(folder.file_name().to_string_lossy().into_owned())
}

// --- a Debian package, in a system that has no other ---

fn dpkg(room: &Path) -> Command {
    let mut dpkg = Command::new("dpkg");
    dpkg.arg(format!("--root={}", room.display()));
    // The package may be for another processor, which is emulated.
    dpkg.args(["--log=/dev/null", "--force-script-chrootless", "--force-architecture"]);
    dpkg
}

fn install(package: &Path, room: &Path) -> Outcome<String> {
    let admin = room.join("var/lib/dpkg");
    for folder in ["info", "updates", "triggers"] {
        fs::create_dir_all(admin.join(folder)).map_err(|error| error.to_string())?;
    }
    fs::write(admin.join("status"), "").map_err(|error| error.to_string())?;
    tool::run(dpkg(room).arg("--install").arg(package))?;
    Ok("usr/bin".to_owned())
}

fn remove(room: &Path) -> Outcome<()> {
    tool::run(dpkg(room).args(["--purge", "vimc4"]))?;
    match room.join("usr").exists() {
        true => Err("the package leaves files behind".to_owned()),
        false => Ok(()),
    }
}

// --- the first answer ---

/// A program that ends with whoever has started it.
struct Started(Child);

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A shell of root's, with the kernel's files in the room and the room as its whole world. What it
/// mounts goes with it, and so does all that runs in it.
fn inside(room: &Path, command: &str) -> Command {
    let room = room.display();
    let mut shell = Command::new("unshare");
    shell.args([
        "--user",
        "--map-root-user",
        "--mount",
        "--pid",
        "--fork",
        "--kill-child",
        "sh",
        "-c",
    ]);
    shell.arg(format!(
        "mkdir -p '{room}/dev' && mount --rbind /dev '{room}/dev' && exec chroot '{room}' {command}"
    ));
    shell.env_clear().envs(std::env::var_os("PATH").map(|path| ("PATH", path)));
    shell
}

/// Starts `serve`, asks for three axes, and gives the time to the answer, and the program's version.
fn first_answer(room: &Path, folder: &str) -> Outcome<(Duration, String)> {
    let mut program = format!("/{folder}/vimc4");
    let mut options = "serve --tcp 127.0.0.1:0";
    let emulator = tool::emulator_for(&room.join(folder).join("vimc4"))?;
    if let Some(emulator) = &emulator {
        let copied = fs::copy(emulator, room.join("emulator"));
        copied.map_err(|error| format!("{}: {error}", emulator.display()))?;
        program.insert_str(0, "/emulator ");
        // An emulator of programs does not know all that a pseudo-terminal needs.
        options = "serve --pty none --tcp 127.0.0.1:0";
    }
    let version = tool::line(&mut inside(room, &format!("{program} -V")))?;
    let begin = Instant::now();
    let mut serve = inside(room, &format!("{program} {options}"));
    let child = serve.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut child = Started(child.map_err(|error| format!("cannot run unshare: {error}"))?);
    let output = child.0.stdout.take().ok_or("serve has no output")?;
    let mut said = Vec::new();
    let mut lines = BufReader::new(output).lines();
    let address = loop {
        let line = lines.next().and_then(Result::ok);
        let line = line.ok_or_else(|| format!("serve ended before it was ready: {said:?}"))?;
        said.push(line.clone());
        if line == "ready" {
            let address = said.iter().find_map(|line| line.strip_prefix("tcp "));
            break address.ok_or("serve names no TCP port")?.to_owned();
        }
    };
    if emulator.is_none() && !said.iter().any(|line| line.starts_with("pty /")) {
        return Err(format!("serve has no pseudo-terminal: {said:?}"));
    }
    let mut port = TcpStream::connect(&address).map_err(|error| format!("{address}: {error}"))?;
    let mut answer = [0];
    let asked = port.set_read_timeout(Some(PATIENCE)).and_then(|()| port.write_all(b"@07\r"));
    asked
        .and_then(|()| port.read_exact(&mut answer))
        .map_err(|error| format!("no answer: {error}"))?;
    match answer {
        [b'0'] => Ok((begin.elapsed(), version)),
        [other] => Err(format!("the answer to @07 is {}, and not 0", char::from(other))),
    }
}
