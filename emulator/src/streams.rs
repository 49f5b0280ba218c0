//! Which streams a path leads to, however it is written: those that are open already, and what is no file.

use std::fs::{self, File};
use std::io;
#[cfg(unix)]
use std::os::fd::OwnedFd;
use std::path::Path;

/// A stream that is open already. What is written there goes behind what stands there.
#[cfg(unix)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stream {
    Output,
    Error,
    /// Another one: of this process that with a number, or of another process.
    Other(Option<i32>),
}

/// How many links a path may lead through, as systems have it.
#[cfg(unix)]
const LINKS: usize = 40;

#[cfg(unix)]
impl Stream {
    /// The stream that a path means, if it means one. Links are followed one by one, for the last of
    /// them, that of the system, may lead to a file like any other.
    fn named(path: &Path) -> Option<Stream> {
        let mut path = path.to_owned();
        for _ in 0..LINKS {
            let folder = path.parent().filter(|folder| *folder != Path::new(""));
            let folder = folder.unwrap_or(Path::new("."));
            let whole = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
            let named = Stream::at(&whole, path.file_name()?.to_str().unwrap_or_default());
            if named.is_some() {
                return named;
            }
            path = whole.join(fs::read_link(whole.join(path.file_name()?)).ok()?);
        }
        None
    }

    /// The stream that a system gives this name in a folder.
    fn at(folder: &Path, name: &str) -> Option<Stream> {
        let is_own = |folder: &Path| {
            folder == Path::new("/dev/fd")
                || fs::canonicalize("/proc/self/fd").is_ok_and(|own| own == folder)
        };
        let number = || name.parse::<i32>().ok().filter(|number| *number >= 0);
        match name {
            "stdin" | "stdout" | "stderr" if folder == Path::new("/dev") => Some(match name {
                "stdout" => Stream::Output,
                "stderr" => Stream::Error,
                _ => Stream::Other(Some(0)),
            }),
            _ if is_own(folder) => Some(match number()? {
                1 => Stream::Output,
                2 => Stream::Error,
                number => Stream::Other(Some(number)),
            }),
            _ if folder.starts_with("/proc") && folder.ends_with("fd") => {
                number().map(|_| Stream::Other(None))
            }
            _ => None,
        }
    }
}

/// Whether a path means a stream that is open already, where what else is written is to stay.
#[cfg(unix)]
pub(crate) fn is_stream(path: &Path) -> bool {
    Stream::named(path).is_some()
}

#[cfg(not(unix))]
pub(crate) fn is_stream(_: &Path) -> bool {
    false
}

/// Whether a path means standard output or standard error.
#[cfg(unix)]
pub(crate) fn is_standard(path: &Path) -> bool {
    matches!(Stream::named(path), Some(Stream::Output | Stream::Error))
}

#[cfg(not(unix))]
pub(crate) fn is_standard(_: &Path) -> bool {
    false
}

/// The stream that is open already, if that is what a path means, so that what else is written there comes
/// before or after.
#[cfg(unix)]
pub(crate) fn open(path: &Path) -> Option<io::Result<File>> {
    use std::io::Write as _;
    use std::os::fd::AsFd as _;
    Some(match Stream::named(path)? {
        Stream::Output => {
            let flushed = io::stdout().flush();
            flushed.and_then(|()| io::stdout().as_fd().try_clone_to_owned()).map(File::from)
        }
        Stream::Error => io::stderr().as_fd().try_clone_to_owned().map(File::from),
        Stream::Other(number) => own(number).map_or_else(
            || fs::OpenOptions::new().append(true).open(path),
            |own| Ok(File::from(own)),
        ),
    })
}

/// The descriptor of this process with this number once more, so that both go on at the same place.
#[cfg(target_os = "linux")]
fn own(number: Option<i32>) -> Option<OwnedFd> {
    use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};
    let process = pidfd_open(getpid(), PidfdFlags::empty()).ok()?;
    pidfd_getfd(process, number?, PidfdGetfdFlags::empty()).ok()
}

#[cfg(all(unix, not(target_os = "linux")))]
fn own(_: Option<i32>) -> Option<OwnedFd> {
    None
}

#[cfg(not(unix))]
pub(crate) fn open(_: &Path) -> Option<io::Result<File>> {
    None
}

/// Whether a path leads to where everything is lost.
pub(crate) fn is_null(path: &Path) -> bool {
    fs::canonicalize(path).is_ok_and(|path| path == Path::new("/dev/null"))
}

/// Whether a path leads to a file, or to where one can be made: what is written there can be gone back in,
/// and something can be put beside it.
pub(crate) fn is_file(path: &Path) -> bool {
    path != Path::new("-")
        && !is_stream(path)
        && fs::metadata(path).map_or(true, |there| there.is_file() || there.is_dir())
}
