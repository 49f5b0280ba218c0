//! Building and starting the emulator and its baselines.

use std::cell::Cell;
use std::env;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;

use super::baseline;
use super::failure::{Doing, Failure, Outcome};
use super::server::Server;

/// Starts the programs that are measured, in a folder of their own.
pub(crate) struct Launcher {
    vimc4: PathBuf,
    bench: PathBuf,
    folder: TempDir,
    started: Cell<u32>,
}

impl Launcher {
    /// Builds the emulator as it is handed out.
    pub(crate) fn build() -> Outcome<Launcher> {
        let cargo = env!("CARGO");
        let mut build = Command::new(cargo);
        build
            .args(["build", "--profile", "dist", "--package", "vimc4-emulator"])
            .args(["--message-format", "json-render-diagnostics"])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .stderr(Stdio::inherit());
        let output = build.output().doing(format!("run {cargo}"))?;
        if !output.status.success() {
            return Err(Failure::new("the emulator cannot be built; what cargo says is above"));
        }
        let messages = String::from_utf8_lossy(&output.stdout);
        let vimc4 =
            messages.lines().find_map(executable).doing("find the program that was built")?;
        Ok(Launcher {
            vimc4,
            bench: env::current_exe().doing("find this program")?,
            folder: TempDir::with_prefix("vimc4-bench-").doing("make a folder for links")?,
            started: Cell::new(0),
        })
    }

    /// Starts `vimc4 serve` with a pseudo-terminal and TCP at a free port, and more arguments.
    pub(crate) fn emulator(&self, more: &[&str]) -> Outcome<Server> {
        self.traced("off", more)
    }

    /// The same, with what happens as structured events on standard error up to a level.
    pub(crate) fn traced(&self, level: &str, more: &[&str]) -> Outcome<Server> {
        self.started.update(|started| started + 1);
        let link = self.folder.path().join(format!("{}.pty", self.started.get()));
        let mut command = Command::new(&self.vimc4);
        command.args(["serve", "--tcp", "127.0.0.1:0", "--pty"]).arg(link).args(more);
        command.env("VIMC4_LOG", level);
        Server::start(command)
    }

    /// The emulator's command, in the folder of links.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(&self.vimc4);
        command.current_dir(&self.folder);
        command
    }

    /// Writes a file into the folder of links.
    pub(crate) fn file(&self, name: &str, text: &str) -> Outcome<PathBuf> {
        let path = self.folder.path().join(name);
        fs::write(&path, text).doing(format!("write {}", path.display()))?;
        Ok(path)
    }

    /// Starts the baseline of this name.
    pub(crate) fn baseline(&self, which: &str) -> Outcome<Server> {
        let mut command = Command::new(&self.bench);
        command.args([baseline::COMMAND, which]);
        Server::start(command)
    }
}

/// The path in cargo's message that the program is built.
fn executable(message: &str) -> Option<PathBuf> {
    let message: Value = serde_json::from_str(message).ok()?;
    let built = message["reason"] == "compiler-artifact" && message["target"]["name"] == "vimc4";
    let path = message["executable"].as_str().filter(|_| built)?;
    Some(PathBuf::from(path))
}
