//! What ends the hosts of a sweep that was killed.
//!
//! A process of its own, outside the group of the sweep, knows the groups of processes that are
//! running. When its standard input ends, the sweep has ended, in whatever way, and what is left of them
//! is killed. On Linux it also finds those of which it was not told in time, by a mark in their
//! environment.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, BufRead, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, ExitCode, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rustix::process::{Pid, Signal, kill_process, kill_process_group};

/// The variable that has the mark of a sweep.
const MARK: &str = "VIMC4_SWEEP";

/// So often the guard looks for processes with the mark, and waits so long in between: one that is just
/// being started shows it a little later.
const LOOKS: u32 = 5;
const PAUSE: Duration = Duration::from_millis(20);

/// The guard of a sweep.
pub(super) struct Guard {
    mark: String,
    child: Child,
    input: Mutex<Option<ChildStdin>>,
}

impl Guard {
    pub(super) fn start() -> io::Result<Guard> {
        let began = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let mark = format!("{}-{}", std::process::id(), began.as_nanos());
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["sweep", "guard", &mark]).process_group(0);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn()?;
        let input = Mutex::new(child.stdin.take());
        Ok(Guard { mark, child, input })
    }

    /// Marks a command that will be started.
    pub(super) fn mark(&self, command: &mut Command) {
        command.env(MARK, &self.mark);
    }

    /// A group of processes is running.
    pub(super) fn begins(&self, group: Pid) {
        self.tell(format!("+{}\n", group.as_raw_nonzero()));
    }

    /// It is not any more.
    pub(super) fn ends(&self, group: Pid) {
        self.tell(format!("-{}\n", group.as_raw_nonzero()));
    }

    fn tell(&self, line: String) {
        let mut input = self.input.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(input) = input.as_mut() {
            // Without a guard there is nobody to tell.
            let _ = input.write_all(line.as_bytes());
        }
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        drop(self.input.lock().unwrap_or_else(PoisonError::into_inner).take());
        let _ = self.child.wait();
    }
}

/// The guard itself.
pub(super) fn run(mark: &str) -> ExitCode {
    let mut groups = BTreeSet::new();
    for line in io::stdin().lock().lines().map_while(Result::ok) {
        let Some((sign, number)) = line.split_at_checked(1) else { continue };
        let Ok(group) = number.parse::<i32>() else { continue };
        match sign {
            "+" => drop(groups.insert(group)),
            _ => drop(groups.remove(&group)),
        }
    }
    for group in groups.into_iter().filter_map(Pid::from_raw) {
        // It may have ended meanwhile.
        let _ = kill_process_group(group, Signal::KILL);
    }
    let marked = format!("{MARK}={mark}");
    for _ in 0..LOOKS {
        for process in with_variable(marked.as_bytes()) {
            let _ = kill_process(process, Signal::KILL);
        }
        thread::sleep(PAUSE);
    }
    ExitCode::SUCCESS
}

/// The processes that have this in their environment; none where the system does not tell.
fn with_variable(variable: &[u8]) -> Vec<Pid> {
    let has = |pid: &Pid| {
        let environment = fs::read(format!("/proc/{}/environ", pid.as_raw_nonzero()));
        environment.is_ok_and(|all| all.split(|byte| *byte == 0).any(|one| one == variable))
    };
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    let names = entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    names.filter_map(Pid::from_raw).filter(has).collect()
}
