//! Whether a client that takes nothing is alive.
//!
//! What a client does not read stays with its system, then with ours, and then here, where what is
//! too much is lost. That may go on as long as it likes. But a client whose computer has gone takes
//! nothing either, and to it nothing must be held open. The kernel's own time limit for what is
//! not taken (`TCP_USER_TIMEOUT`) does not tell the two apart: it counts also while the client's
//! system answers "not now". So it guards only what is under way to a client that takes everything,
//! and where something is stuck it is looked whether the client's system answers: the kernel
//! shows how often it has asked in vain.

use std::fs;
use std::future::Future;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use socket2::SockRef;
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep};

use crate::wake_flag::WakeFlag;

/// How long a client may leave unanswered what it was asked.
pub(super) const SILENCE: Duration = Duration::from_secs(12);

/// This long after something was sent it is looked whether it is stuck.
const LATER: Duration = Duration::from_secs(4);

/// And while it is, this often.
const OFTEN: Duration = Duration::from_secs(2);

/// So long at most until a client that takes nothing is asked again. The kernel would take its
/// time, up to two minutes; the limit that it is given shortens its waits.
const ASKED: Duration = Duration::from_secs(6);

/// Watches over one connection, beginning with the next thing that is sent.
#[derive(Debug, Default)]
pub(super) struct Vigil {
    look: Option<Pin<Box<Sleep>>>,
    /// Rings when it is time to look.
    wake_flag: WakeFlag,
    /// Since when something is, or may be, stuck.
    since: Option<Instant>,
    /// Since when it does not answer.
    silent: Option<Instant>,
}

/// A connection that is made to tell when it has sent everything that it was given.
pub(super) fn prepare(stream: &TcpStream) {
    let socket = SockRef::from(stream);
    let _ = socket.set_tcp_user_timeout(Some(SILENCE));
    // Ready for more means from now on that nothing is left to be sent.
    let _ = socket.set_tcp_notsent_lowat(1);
}

impl Vigil {
    /// Something was sent.
    pub(super) fn begin(&mut self) {
        if self.look.is_none() {
            self.since = Some(Instant::now());
            self.look_after(LATER);
        }
    }

    fn look_after(&mut self, span: Duration) {
        self.look = Some(Box::pin(sleep(span)));
        self.wake_flag = WakeFlag::default();
    }

    /// Is ready when the client has vanished.
    pub(super) fn poll(&mut self, cx: &mut Context<'_>, stream: &TcpStream) -> Poll<()> {
        while let Some(look) = &mut self.look {
            if self.wake_flag.poll(cx, |cx| look.as_mut().poll(cx)).is_pending() {
                break;
            }
            let socket = SockRef::from(stream);
            if !is_stuck(stream) {
                let _ = socket.set_tcp_user_timeout(Some(SILENCE));
                *self = Vigil::default();
                break;
            }
            let now = Instant::now();
            match answers(stream) {
                false => {
                    let since = *self.silent.get_or_insert(now);
                    if now.duration_since(since) + ASKED >= SILENCE {
                        return Poll::Ready(());
                    }
                }
                true => self.silent = None,
            }
            let stuck = now.duration_since(self.since.unwrap_or(now));
            let _ = socket.set_tcp_user_timeout(Some(stuck + ASKED));
            self.look_after(OFTEN);
        }
        Poll::Pending
    }
}

/// Whether the kernel still has something to send that the client has not taken.
fn is_stuck(stream: &TcpStream) -> bool {
    let now = Timespec { tv_sec: 0, tv_nsec: 0 };
    let mut asked = [PollFd::new(stream, PollFlags::OUT)];
    poll(&mut asked, Some(&now)).is_ok_and(|ready| ready == 0)
}

/// Whether the client's system has answered everything that it was asked.
fn answers(stream: &TcpStream) -> bool {
    let (Ok(here), Ok(there)) = (stream.local_addr(), stream.peer_addr()) else { return false };
    let table = if here.is_ipv4() { "/proc/net/tcp" } else { "/proc/net/tcp6" };
    let table = fs::read_to_string(table).unwrap_or_default();
    let (here, there) = (in_table(here), in_table(there));
    let row = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let row = row
        .into_iter()
        .find(|row| row.get(1) == Some(&here.as_str()) && row.get(2) == Some(&there.as_str()));
    // How often it was sent again, and how often it was asked, without an answer.
    let in_vain = |column: usize| {
        let count = row.as_ref().and_then(|row| row.get(column)?.parse::<u32>().ok());
        count.unwrap_or_default()
    };
    let resent = row.as_ref().and_then(|row| u32::from_str_radix(row.get(6)?, 16).ok());
    resent.unwrap_or_default() == 0 && in_vain(8) == 0
}

/// An address as the kernel's table has it: the words of the address in the computer's own order
/// of bytes.
fn in_table(address: SocketAddr) -> String {
    let words = |bytes: &[u8]| -> String {
        let words = bytes.chunks(4).filter_map(|word| word.try_into().ok());
        words.map(|word| format!("{:08X}", u32::from_ne_bytes(word))).collect()
    };
    let ip = match address.ip() {
        IpAddr::V4(ip) => words(&ip.octets()),
        IpAddr::V6(ip) => words(&ip.octets()),
    };
    format!("{ip}:{:04X}", address.port())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_found_in_the_table() {
        assert_eq!(in_table("127.0.0.1:4004".parse().unwrap()), "0100007F:0FA4");
        let v6 = "00000000000000000000000001000000:0016";
        assert_eq!(in_table("[::1]:22".parse().unwrap()), v6);
    }
}
