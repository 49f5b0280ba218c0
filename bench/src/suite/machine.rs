//! What the figures were measured on.

use std::fmt;
use std::fs;
use std::process::Command;
use std::thread;

use rustix::system::uname;

/// The machine, its software, and the state of the sources.
pub(crate) struct Machine {
    processor: String,
    cores: usize,
    kernel: String,
    compiler: String,
    commit: String,
}

impl Machine {
    /// This one. What cannot be found out is `unknown`.
    pub(crate) fn here() -> Machine {
        let unknown = || "unknown".to_owned();
        let processors = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let processor = processors
            .lines()
            .find(|line| line.starts_with("model name"))
            .and_then(|line| Some(line.split_once(':')?.1.trim().to_owned()));
        let commit =
            ["-C", env!("CARGO_MANIFEST_DIR"), "describe", "--always", "--dirty=, changed"];
        Machine {
            processor: processor.unwrap_or_else(unknown),
            cores: thread::available_parallelism().map_or(1, usize::from),
            kernel: uname().release().to_string_lossy().into_owned(),
            compiler: output("rustc", &["--version"]).unwrap_or_else(unknown),
            commit: output("git", &commit).unwrap_or_else(unknown),
        }
    }
}

/// What a program prints, if it succeeds.
fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Machine { processor, cores, kernel, compiler, commit } = self;
        write!(f, "{processor}, {cores} cores, Linux {kernel}, {compiler}, commit {commit}")
    }
}
