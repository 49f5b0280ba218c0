//! What the system allows a process.

use crate::failure::Failure;

/// How many files a controller has open: both ends of its pseudo terminal, its listening socket,
/// its timer, its flash file, a serial port and two clients.
#[cfg(unix)]
const FILES: u64 = 8;

/// How many the program itself needs.
#[cfg(unix)]
const OWN_FILES: u64 = 64;

/// Raises the limit of open files as far as so many controllers need it.
#[cfg(unix)]
pub(crate) fn allow_open_files(controllers: u16) -> Result<(), Failure> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

    let needed = u64::from(controllers) * FILES + OWN_FILES;
    let limit = getrlimit(Resource::Nofile);
    // No limit is a limit above everything.
    if limit.current.is_none_or(|current| current >= needed) {
        return Ok(());
    }
    let raised = Rlimit { current: Some(needed), maximum: limit.maximum };
    setrlimit(Resource::Nofile, raised).map_err(|_| {
        let allowed = limit.maximum.or(limit.current).unwrap_or_default();
        let fit = allowed.saturating_sub(OWN_FILES) / FILES;
        Failure::usage(format!(
            "{controllers} controllers need {needed} open files, and this process may have \
             {allowed}; raise the hard limit (ulimit -Hn {needed}, as root), or start no more \
             than {fit} with --count"
        ))
    })
}

/// Elsewhere there is no limit that could be raised.
#[cfg(not(unix))]
pub(crate) fn allow_open_files(_controllers: u16) -> Result<(), Failure> {
    Ok(())
}
