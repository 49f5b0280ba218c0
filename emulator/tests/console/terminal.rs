//! A program at a pseudo-terminal, and somebody who types.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use rustix::fs::OFlags;

use super::process::limits::{EndsInTime, InTime, LIMIT};
use super::process::pseudo_terminal;

pub(super) struct Terminal {
    child: Child,
    screen: File,
    said: Receiver<Vec<u8>>,
    seen: String,
}

impl Terminal {
    pub(super) fn start(program: &str, arguments: &[&str], folder: &Path, home: &Path) -> Terminal {
        Terminal::start_as("xterm", program, arguments, folder, home)
    }

    pub(super) fn start_as(
        kind: &str,
        program: &str,
        arguments: &[&str],
        folder: &Path,
        home: &Path,
    ) -> Terminal {
        let (screen, name) = pseudo_terminal();
        let open = || -> OwnedFd {
            let flags = OFlags::RDWR | OFlags::NOCTTY;
            rustix::fs::open(name.as_str(), flags, rustix::fs::Mode::empty()).unwrap()
        };
        // It is the terminal of a session of its own, so that Ctrl-C is heard there.
        let child = Command::new("setsid")
            .args(["--ctty", "--wait", program])
            .args(arguments)
            .current_dir(folder)
            .env("TERM", kind)
            .env("HOME", home)
            .env_remove("XDG_STATE_HOME")
            .env_remove("NO_COLOR")
            .stdin(Stdio::from(open()))
            .stdout(Stdio::from(open()))
            .stderr(Stdio::from(open()))
            .start()
            .unwrap();
        let screen = File::from(screen);
        let mut reader = screen.try_clone().unwrap();
        let (sender, said) = channel();
        thread::spawn(move || {
            let mut buffer = [0; 4_096];
            while let Ok(count @ 1..) = reader.read(&mut buffer) {
                if sender.send(buffer[..count].to_vec()).is_err() {
                    return;
                }
            }
        });
        Terminal { child, screen, said, seen: String::new() }
    }

    pub(super) fn type_(&mut self, keys: &str) {
        self.screen.write_all(keys.as_bytes()).unwrap();
    }

    /// Waits until this appears behind what was waited for before.
    pub(super) fn wait_for(&mut self, text: &str) {
        let place = self.place_of(text);
        self.seen.drain(..place + text.len());
    }

    /// Waits until this appears, and returns what came before it.
    pub(super) fn said_until(&mut self, text: &str) -> String {
        self.place_of(text);
        self.seen.clone()
    }

    fn place_of(&mut self, text: &str) -> usize {
        loop {
            if let Some(place) = self.seen.find(text) {
                return place;
            }
            let Ok(more) = self.said.recv_timeout(LIMIT) else {
                panic!("waited {} s for {text:?}; what came is {:?}", LIMIT.as_secs(), self.seen)
            };
            self.seen.push_str(&String::from_utf8_lossy(&more));
        }
    }

    /// Waits for the end and returns the exit code.
    pub(super) fn end(mut self) -> i32 {
        self.child.wait_in_time().unwrap().code().unwrap()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait_in_time();
    }
}
