//! Which of a program's descriptors lead to the terminal.

use std::fs;
use std::path::{Path, PathBuf, absolute};

use rustix::fs::{FileType, lstat, major, minor, stat};

/// The terminal that has modem lines, by a name that may later lead elsewhere: the program that
/// owns the link may have been restarted.
#[derive(Debug)]
pub(crate) struct Terminal(PathBuf);

/// The terminal that the name leads to at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Identity {
    device: u64,
    /// The file system and the file, where the device number alone is not enough: every instance
    /// of devpts, one for each container, counts its terminals from 0.
    file: Option<(u64, u64)>,
}

/// What a descriptor has to do with a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Held {
    /// Nothing, as far as can be seen.
    Not,
    /// It is open for use.
    Open,
    /// It only names the file, and the kernel takes no requests on it.
    Named,
}

/// `/dev/tty`, which is whatever terminal controls a process.
const CONTROLLING: (u32, u32) = (5, 0);

impl Terminal {
    pub(crate) fn new(path: &Path) -> std::io::Result<Terminal> {
        Ok(Terminal(absolute(path)?))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// What the name leads to now.
    pub(crate) fn identity(&self) -> Option<Identity> {
        Identity::of(&stat(&self.0).ok()?)
    }
}

impl Identity {
    fn of(file: &rustix::fs::Stat) -> Option<Identity> {
        if FileType::from_raw_mode(file.st_mode) != FileType::CharacterDevice {
            return None;
        }
        let device = file.st_rdev;
        let pseudo = (136..=143).contains(&major(device));
        Some(Identity { device, file: pseudo.then_some((file.st_dev, file.st_ino)) })
    }

    /// Whether it is a pseudo-terminal, which has no lines of its own.
    pub(crate) fn is_pseudo(self) -> bool {
        self.file.is_some()
    }

    /// What a descriptor of a thread has to do with this terminal.
    pub(crate) fn held_as(self, thread: u32, descriptor: u32) -> Held {
        let link = format!("/proc/{thread}/fd/{descriptor}");
        let Some(other) = stat(&link).ok().and_then(|file| Identity::of(&file)) else {
            return Held::Not;
        };
        let alias = (major(other.device), minor(other.device)) == CONTROLLING;
        if other != self && !(alias && self.controls(thread)) {
            return Held::Not;
        }
        // The link has the rights of the descriptor. A descriptor without any either only names the
        // file or was opened for requests only; the latter is rare enough to be checked separately.
        match lstat(&link) {
            Ok(link) if link.st_mode & 0o600 != 0 => Held::Open,
            Ok(_) if names_only(thread, descriptor) => Held::Named,
            Ok(_) => Held::Open,
            Err(_) => Held::Not,
        }
    }

    /// Whether it is the controlling terminal of a thread's process.
    fn controls(self, thread: u32) -> bool {
        let Ok(status) = fs::read_to_string(format!("/proc/{thread}/stat")) else { return false };
        // The name in brackets may have anything in it. After it come the state, the parent, the
        // group, the session and the terminal.
        let fields = status.rsplit_once(')').map(|(_, fields)| fields);
        let terminal = fields.and_then(|fields| fields.split_ascii_whitespace().nth(4));
        let Some(Ok(number)) = terminal.map(str::parse::<i32>) else { return false };
        let number = number.cast_unsigned();
        let (high, low) = ((number >> 8) & 0xFFF, (number & 0xFF) | ((number >> 12) & 0xF_FF00));
        (high, low) == (major(self.device), minor(self.device))
    }
}

/// Whether a descriptor was opened with `O_PATH`.
fn names_only(thread: u32, descriptor: u32) -> bool {
    const O_PATH: u32 = 0o10_000_000;
    let Ok(about) = fs::read_to_string(format!("/proc/{thread}/fdinfo/{descriptor}")) else {
        return false;
    };
    let flags = about.lines().find_map(|line| line.strip_prefix("flags:"));
    flags
        .and_then(|flags| u32::from_str_radix(flags.trim(), 8).ok())
        .is_some_and(|f| f & O_PATH != 0)
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::os::fd::AsRawFd;

    use super::*;

    #[test]
    fn only_a_terminal_is_one() {
        let identity = |path: &str| Terminal::new(Path::new(path)).unwrap().identity();
        assert_eq!(identity("/"), None);
        assert_eq!(identity("/nowhere/at/all"), None);
        assert!(identity("/dev/null").is_some());
        assert_ne!(identity("/dev/null"), identity("/dev/zero"));
    }

    #[test]
    fn a_descriptor_is_known_by_its_device() {
        let null = Terminal::new(Path::new("/dev/null")).unwrap().identity().unwrap();
        let (file, zero) = (File::open("/dev/null").unwrap(), File::open("/dev/zero").unwrap());
        let named =
            rustix::fs::open("/dev/null", rustix::fs::OFlags::PATH, rustix::fs::Mode::empty());
        let named = named.unwrap();
        let held = |fd: i32| null.held_as(std::process::id(), fd.cast_unsigned());
        assert_eq!(held(file.as_raw_fd()), Held::Open);
        assert_eq!(held(zero.as_raw_fd()), Held::Not);
        assert_eq!(held(named.as_raw_fd()), Held::Named);
        assert_eq!(held(-1), Held::Not);
        assert_eq!(null.held_as(0, 0), Held::Not);
    }
}
