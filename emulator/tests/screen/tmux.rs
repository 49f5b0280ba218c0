//! A terminal that is looked at: tmux, with a shell in it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::process::limits::{InTime, LIMIT};

pub(crate) const VIMC4: &str = env!("CARGO_BIN_EXE_vimc4");

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A terminal with a shell in it.
pub(crate) struct Tmux {
    pub(crate) folder: TempDir,
}

impl Tmux {
    pub(crate) fn start(width: u16, height: u16) -> Tmux {
        let tmux = Tmux { folder: tempfile::tempdir().unwrap() };
        let (width, height) = (width.to_string(), height.to_string());
        let home = format!("HOME={}", tmux.folder.path().display());
        tmux.run(&[
            "-f",
            "/dev/null",
            "new-session",
            "-d",
            "-s",
            "t",
            "-x",
            &width,
            "-y",
            &height,
            "-e",
            &home,
            "-c",
            root().to_str().unwrap(),
            "sh",
        ]);
        // As it is typed it is not what is waited for.
        tmux.command("PS1='shell''> '");
        tmux.wait("the prompt", |screen| {
            screen.lines().any(|line| line.trim().ends_with("shell>"))
        });
        tmux
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        let socket = self.folder.path().join("socket");
        let output = Command::new("tmux")
            .arg("-S")
            .arg(socket)
            .args(arguments)
            .env_remove("TMUX")
            .env_remove("NO_COLOR")
            .env("LC_ALL", "C.UTF-8")
            .output_in_time()
            .unwrap();
        assert!(
            output.status.success(),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        output
    }

    /// Types text as it is.
    pub(crate) fn type_(&self, text: &str) {
        self.run(&["send-keys", "-t", "t", "-l", text]);
    }

    /// Presses keys by their names.
    pub(crate) fn press(&self, keys: &[&str]) {
        self.run(&[&["send-keys", "-t", "t"], keys].concat());
    }

    pub(crate) fn command(&self, line: &str) {
        self.type_(line);
        self.press(&["Enter"]);
    }

    pub(crate) fn screen(&self) -> String {
        String::from_utf8(self.run(&["capture-pane", "-p", "-t", "t"]).stdout).unwrap()
    }

    pub(crate) fn screen_with_attributes(&self) -> String {
        String::from_utf8(self.run(&["capture-pane", "-e", "-p", "-t", "t"]).stdout).unwrap()
    }

    /// Waits until this is seen, and returns the screen.
    pub(crate) fn wait_for(&self, text: &str) -> String {
        self.wait(text, |screen| screen.contains(text))
    }

    pub(crate) fn wait(&self, what: &str, mut is_so: impl FnMut(&str) -> bool) -> String {
        let begin = Instant::now();
        loop {
            let screen = self.screen();
            if is_so(&screen) {
                return screen;
            }
            assert!(begin.elapsed() < LIMIT, "{what:?} is not seen:\n{screen}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Starts the console on a file, in its full screen.
    pub(crate) fn console(&self, arguments: &str) {
        self.command(&format!("{VIMC4} console {arguments} --screen; echo ended $?"));
        self.wait_for(": command");
    }

    /// The program's number.
    pub(crate) fn process(&self) -> u32 {
        let shell = self.run(&["display-message", "-p", "-t", "t", "#{pane_pid}"]);
        let shell = String::from_utf8(shell.stdout).unwrap().trim().to_owned();
        let children = Command::new("pgrep").args(["-P", &shell]).output_in_time().unwrap();
        String::from_utf8(children.stdout).unwrap().trim().parse().unwrap()
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        let socket = self.folder.path().join("socket");
        let _ = Command::new("tmux").arg("-S").arg(socket).arg("kill-server").output_in_time();
    }
}

/// Why there is no such terminal here, if so.
pub(crate) fn missing() -> Option<&'static str> {
    let has = |program: &str, option: &str| {
        Command::new(program)
            .arg(option)
            .output_in_time()
            .is_ok_and(|output| output.status.success())
    };
    if !has("tmux", "-V") {
        Some("needs tmux")
    } else if !has("pgrep", "--version") {
        Some("needs pgrep")
    } else {
        None
    }
}
