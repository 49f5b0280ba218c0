//! The end of the program that has started the server.
//!
//! An editor that ends closes the server's input, which ends the server too. One that is killed may
//! leave the input open in another process, and then the server would wait for ever.

/// Ends the program when the process of that number ends, if the system can tell without being
/// asked again and again.
#[cfg(target_os = "linux")]
pub(super) fn guard(process: u32) {
    use std::os::fd::OwnedFd;
    use std::thread;

    use rustix::event::{PollFd, PollFlags, poll};
    use rustix::io::Errno;
    use rustix::process::{Pid, PidfdFlags, pidfd_open};

    let ended = |process: &OwnedFd| {
        loop {
            match poll(&mut [PollFd::new(process, PollFlags::IN)], None) {
                Ok(_) => return true,
                Err(Errno::INTR) => {}
                Err(_) => return false,
            }
        }
    };
    let number = i32::try_from(process).ok().and_then(Pid::from_raw);
    let Some(number) = number else { return };
    match pidfd_open(number, PidfdFlags::empty()) {
        Ok(process) => {
            let wait = move || {
                if ended(&process) {
                    leave();
                }
            };
            // Without it the end of the input is all that ends the server.
            let _ = thread::Builder::new().name("parent".to_owned()).spawn(wait);
        }
        Err(Errno::SRCH) => leave(),
        // An old system cannot tell.
        Err(_) => {}
    }
}

#[cfg(target_os = "linux")]
fn leave() {
    // The client is gone, and pending output would wait for ever.
    std::process::exit(1);
}

/// The end of the input is all that ends the server here.
#[cfg(not(target_os = "linux"))]
pub(super) fn guard(_process: u32) {}
