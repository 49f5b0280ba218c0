//! What the system allows a process.

use crate::failure::Failure;

/// How many files a controller has open at most: both ends of its pseudo-terminal and a watch over it,
/// its listening socket, its timer, a serial port, two clients, and its flash file, which is replaced by
/// another one.
#[cfg(unix)]
const FILES: u64 = 10;

/// How many the program itself needs: standard input, output and error, the event queues of its
/// threads with what wakes them, the log, and some more that are open for a moment.
#[cfg(unix)]
const OWN_FILES: u64 = 16;

/// And how many each thread needs.
#[cfg(unix)]
const THREAD_FILES: u64 = 3;

/// Raises the limit of open files as far as so many controllers, on so many threads, need it.
#[cfg(unix)]
pub(crate) fn allow_open_files(controllers: u16, threads: usize) -> Result<(), Failure> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

    let own = OWN_FILES + THREAD_FILES * u64::try_from(threads).unwrap_or(u64::MAX);
    let needed = u64::from(controllers) * FILES + own;
    let limit = getrlimit(Resource::Nofile);
    // No limit is a limit above everything.
    if limit.current.is_none_or(|current| current >= needed) {
        return Ok(());
    }
    let raised = Rlimit { current: Some(needed), maximum: limit.maximum };
    setrlimit(Resource::Nofile, raised).map_err(|_| {
        let allowed = limit.maximum.or(limit.current).unwrap_or_default();
        Failure::usage(too_few(controllers, needed, allowed, own))
    })
}

/// What is wrong, and what fits.
#[cfg(unix)]
fn too_few(controllers: u16, needed: u64, allowed: u64, own: u64) -> String {
    let (s, verb) = if controllers == 1 { ("", "needs") } else { ("s", "need") };
    let fewer = match allowed.saturating_sub(own) / FILES {
        0 => String::new(),
        fit => format!(", or start no more than {fit} with --count"),
    };
    format!(
        "{controllers} controller{s} {verb} {needed} open files, and this process may have \
         {allowed}; raise the hard limit (ulimit -Hn {needed}, as root){fewer}"
    )
}

/// Elsewhere there is no limit that could be raised.
#[cfg(not(unix))]
pub(crate) fn allow_open_files(_controllers: u16, _threads: usize) -> Result<(), Failure> {
    Ok(())
}

/// How many kB of memory the program needs beyond what it has when it begins, and how many each
/// controller.
#[cfg(target_os = "linux")]
const MEMORY: [u64; 2] = [32 << 10, 256];

/// Refuses to begin where the limit of memory (`ulimit -v`) leaves too little for so many controllers:
/// later there would be no way to say so.
#[cfg(target_os = "linux")]
pub(crate) fn check_memory(controllers: u16) -> Result<(), Failure> {
    use rustix::process::{Resource, getrlimit};

    let Some(limit) = getrlimit(Resource::As).current else { return Ok(()) };
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:"));
    let size = size.and_then(|size| size.split_whitespace().next()?.parse::<u64>().ok());
    let [own, each] = MEMORY;
    let needed = size.unwrap_or_default() + own + u64::from(controllers) * each;
    if limit >> 10 >= needed {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "the limit of memory is {} kB, and {needed} kB are needed; raise it (ulimit -v {needed})",
        limit >> 10
    )))
}

/// Elsewhere there is no such limit.
#[cfg(not(target_os = "linux"))]
pub(crate) fn check_memory(_controllers: u16) -> Result<(), Failure> {
    Ok(())
}
