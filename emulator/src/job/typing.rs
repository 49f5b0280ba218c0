//! What somebody types at a terminal: a line, and the lines that came with it.

#[cfg(not(unix))]
pub(super) use followed::Typing;
#[cfg(unix)]
pub(super) use looked_for::Typing;

/// Where the system tells whether there is more.
#[cfg(unix)]
mod looked_for {
    use std::io;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::Errno;

    /// How much pending terminal input is read, in bytes, before it is examined.
    const MOST_TYPED: usize = 1 << 16;

    /// Standard input, read by nobody else.
    pub(crate) struct Typing;

    impl Typing {
        pub(crate) fn begin() -> Typing {
            Typing
        }

        /// Waits for a typed line, and takes the lines that follow it by then: of lines that come at
        /// once only the first can answer the question. `None` when the input has ended.
        pub(crate) fn next(&mut self) -> Option<Vec<String>> {
            let stdin = io::stdin();
            let mut typed = Vec::new();
            loop {
                let mut buffer = [0; 4096];
                match rustix::io::read(&stdin, &mut buffer) {
                    Err(Errno::INTR) => continue,
                    Ok(0) | Err(_) if typed.is_empty() => return None,
                    Ok(0) | Err(_) => break,
                    Ok(count) => typed.extend_from_slice(&buffer[..count]),
                }
                let mut fds = [PollFd::new(&stdin, PollFlags::IN)];
                let more = matches!(poll(&mut fds, Some(&Timespec::default())), Ok(1..));
                if typed.ends_with(b"\n") && (!more || typed.len() > MOST_TYPED) {
                    break;
                }
            }
            Some(String::from_utf8_lossy(&typed).lines().map(str::to_owned).collect())
        }
    }
}

/// Where it does not: on Windows.
#[cfg(not(unix))]
mod followed {
    use std::io;
    use std::sync::mpsc::{Receiver, channel};
    use std::thread;
    use std::time::Duration;

    /// A line that comes so soon behind another was pasted with it.
    const TOGETHER: Duration = Duration::from_millis(5);

    /// Standard input, read by a thread line by line.
    pub(crate) struct Typing(Receiver<String>);

    impl Typing {
        pub(crate) fn begin() -> Typing {
            let (sender, lines) = channel();
            let read = move || {
                for line in io::stdin().lines() {
                    let Ok(line) = line else { return };
                    if sender.send(line).is_err() {
                        return;
                    }
                }
            };
            // Without the thread it is as if the input had ended.
            let _ = thread::Builder::new().name("typing".to_owned()).spawn(read);
            Typing(lines)
        }

        /// Waits for a typed line, and takes the lines that were pasted with it: of them only the first
        /// can answer the question. `None` when the input has ended.
        pub(crate) fn next(&mut self) -> Option<Vec<String>> {
            let mut typed = vec![self.0.recv().ok()?];
            while let Ok(line) = self.0.recv_timeout(TOGETHER) {
                typed.push(line);
            }
            Some(typed)
        }
    }
}
