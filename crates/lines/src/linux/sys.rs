//! The one place with unsafe code: the system calls for which there is no safe function.
//!
//! What goes in and comes out is typed and safe to use in any way; each block says why the call
//! in it is sound.
#![expect(unsafe_code, reason = "these system calls have no safe wrapper in rustix or std")]

use std::io;
use std::mem::{MaybeUninit, size_of};
use std::os::fd::{AsRawFd, BorrowedFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::ptr;
use std::time::Duration;

use libc::{c_int, c_ulong, c_void, iovec, siginfo_t, sigset_t};

use super::filter::Instruction;

// --- the filter ---

/// A filter in the form that the kernel takes.
pub(crate) struct Filter(Vec<libc::sock_filter>);

impl Filter {
    pub(crate) fn new(program: &[Instruction]) -> Filter {
        let native =
            |i: &Instruction| libc::sock_filter { code: i.code, jt: i.yes, jf: i.no, k: i.value };
        Filter(program.iter().map(native).collect())
    }

    /// Puts this thread, and whatever it executes or starts, under the filter for ever, and
    /// returns the descriptor on which the kernel asks. It makes system calls only, so it may be
    /// called between fork and exec.
    ///
    /// A call that has been asked about is then interrupted by nothing but the program's death,
    /// where the kernel can do that (5.19): so we never write into the memory of a program that has
    /// gone on to something else.
    pub(crate) fn install(&self) -> io::Result<OwnedFd> {
        let filter = libc::sock_fprog {
            len: u16::try_from(self.0.len()).map_err(|_| io::ErrorKind::InvalidInput)?,
            filter: self.0.as_ptr().cast_mut(),
        };
        let basic = libc::SECCOMP_FILTER_FLAG_NEW_LISTENER | libc::SECCOMP_FILTER_FLAG_SPEC_ALLOW;
        let set = |flags: c_ulong| {
            // SAFETY: `filter` points to `len` instructions, which live in `self` and which the
            // kernel copies and never writes to.
            unsafe {
                libc::syscall(
                    libc::SYS_seccomp,
                    libc::SECCOMP_SET_MODE_FILTER,
                    flags,
                    ptr::from_ref(&filter),
                )
            }
        };
        let mut descriptor = set(basic | libc::SECCOMP_FILTER_FLAG_WAIT_KILLABLE_RECV);
        if descriptor < 0 && io::Error::last_os_error().raw_os_error() == Some(libc::EINVAL) {
            descriptor = set(basic);
        }
        if descriptor < 0 {
            return Err(io::Error::last_os_error());
        }
        let descriptor = RawFd::try_from(descriptor).map_err(|_| io::ErrorKind::InvalidData)?;
        // SAFETY: the kernel has just made this descriptor for us and nothing else refers to it.
        Ok(unsafe { OwnedFd::from_raw_fd(descriptor) })
    }
}

/// Lets a child of the command do `prepare` between fork and exec.
///
/// `prepare` runs in a copy of this process that has one thread: it must make system calls only,
/// and neither allocate nor take locks. All that this crate hands over keeps to that.
pub(crate) fn before_exec(
    command: &mut Command,
    prepare: impl FnMut() -> io::Result<()> + Send + Sync + 'static,
) {
    // SAFETY: the only caller, `launch`, passes a closure that makes system calls through rustix
    // and this module and touches nothing that another thread could have left locked: it neither
    // allocates, nor panics, nor takes locks.
    unsafe { command.pre_exec(prepare) };
}

// --- the listener ---

/// The descriptor on which the kernel asks.
pub(crate) struct Listener(OwnedFd);

/// A call that the kernel asks about.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    /// The number to answer it by.
    pub(crate) id: u64,
    /// The thread, which waits; 0 if it cannot be seen from here.
    pub(crate) thread: u32,
    /// The architecture it called as.
    pub(crate) architecture: u32,
    /// The system call.
    pub(crate) number: u32,
    /// Its arguments.
    pub(crate) arguments: [u64; 6],
}

impl Listener {
    /// A descriptor from [`Filter::install`].
    pub(crate) fn new(descriptor: OwnedFd) -> Listener {
        Listener(descriptor)
    }

    /// Whether the kernel's structures are no larger than those that are known here, so that
    /// its questions can be received at all.
    pub(crate) fn is_understood() -> io::Result<bool> {
        let mut sizes =
            libc::seccomp_notif_sizes { seccomp_notif: 0, seccomp_notif_resp: 0, seccomp_data: 0 };
        // SAFETY: the kernel writes the three numbers of this structure and nothing beyond.
        let done = unsafe {
            libc::syscall(
                libc::SYS_seccomp,
                libc::SECCOMP_GET_NOTIF_SIZES,
                0,
                ptr::from_mut(&mut sizes),
            )
        };
        if done < 0 {
            return Err(io::Error::last_os_error());
        }
        Ok(usize::from(sizes.seccomp_notif) <= size_of::<libc::seccomp_notif>()
            && usize::from(sizes.seccomp_notif_resp) <= size_of::<libc::seccomp_notif_resp>())
    }

    pub(crate) fn descriptor(&self) -> &OwnedFd {
        &self.0
    }

    /// Asks the kernel to switch to the waiting side at once (6.6), which halves the time of a
    /// call. An older kernel refuses, and is merely slower.
    pub(crate) fn hurry(&self) {
        const SYNC_WAKE_UP: c_ulong = 1;
        // SAFETY: the argument of this request is a number, not a pointer.
        let _ = unsafe {
            libc::ioctl(self.0.as_raw_fd(), libc::SECCOMP_IOCTL_NOTIF_SET_FLAGS, SYNC_WAKE_UP)
        };
    }

    /// The next call. It waits for one, so ask `poll` first whether there is one.
    pub(crate) fn receive(&self) -> io::Result<Asked> {
        let mut asked = MaybeUninit::<libc::seccomp_notif>::zeroed();
        // SAFETY: the kernel writes one `seccomp_notif`, whose size is part of the request; it
        // wants the memory zeroed before, and it is.
        let done = unsafe {
            libc::ioctl(self.0.as_raw_fd(), libc::SECCOMP_IOCTL_NOTIF_RECV, asked.as_mut_ptr())
        };
        if done < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: the structure consists of integers, for which the zeroes were values already.
        let asked = unsafe { asked.assume_init() };
        Ok(Asked {
            id: asked.id,
            thread: asked.pid,
            architecture: asked.data.arch,
            number: asked.data.nr.cast_unsigned(),
            arguments: asked.data.args,
        })
    }

    /// Whether the thread still waits in this call. If it does not, its number may be another's.
    pub(crate) fn waits(&self, id: u64) -> bool {
        // The request as the first kernels defined it; all kernels understand it.
        const ID_VALID: libc::Ioctl = 0x8008_2102_u32 as libc::Ioctl;
        // SAFETY: the kernel reads one 64-bit number.
        unsafe { libc::ioctl(self.0.as_raw_fd(), ID_VALID, ptr::from_ref(&id)) == 0 }
    }

    /// The call returns this: 0, or an error.
    pub(crate) fn answer(&self, id: u64, error: c_int) {
        self.send(libc::seccomp_notif_resp { id, val: 0, error: -error, flags: 0 });
    }

    /// The kernel carries the call out as if it had not asked.
    pub(crate) fn go_on(&self, id: u64) {
        const CONTINUE: u32 = 1;
        self.send(libc::seccomp_notif_resp { id, val: 0, error: 0, flags: CONTINUE });
    }

    /// It fails if no thread waits for the answer any more, and then nothing is lost.
    fn send(&self, answer: libc::seccomp_notif_resp) {
        // SAFETY: the kernel reads one `seccomp_notif_resp`, whose size is part of the request.
        let _ = unsafe {
            let answer = ptr::from_ref(&answer);
            libc::ioctl(self.0.as_raw_fd(), libc::SECCOMP_IOCTL_NOTIF_SEND, answer)
        };
    }
}

// --- another program's memory ---

/// Reads from the memory of a thread's process, all of it or nothing.
pub(crate) fn read_memory(thread: u32, address: u64, buffer: &mut [u8]) -> io::Result<()> {
    let length = buffer.len();
    let (thread, far) = far_side(thread, address, length)?;
    let near = iovec { iov_base: buffer.as_mut_ptr().cast::<c_void>(), iov_len: length };
    // SAFETY: `near` is the buffer, which is ours to write to. `far` is an address in another
    // process: the kernel checks it there, and it is never followed here.
    let done = unsafe { libc::process_vm_readv(thread, &raw const near, 1, &raw const far, 1, 0) };
    all(done, length)
}

/// Writes to the memory of a thread's process, all of it or an error.
pub(crate) fn write_memory(thread: u32, address: u64, bytes: &[u8]) -> io::Result<()> {
    let (thread, far) = far_side(thread, address, bytes.len())?;
    let near = iovec { iov_base: bytes.as_ptr().cast_mut().cast::<c_void>(), iov_len: bytes.len() };
    // SAFETY: `near` is only read from, in spite of its type. `far` is an address in another
    // process: the kernel checks it there, and it is never followed here.
    let done = unsafe { libc::process_vm_writev(thread, &raw const near, 1, &raw const far, 1, 0) };
    all(done, bytes.len())
}

fn far_side(thread: u32, address: u64, length: usize) -> io::Result<(libc::pid_t, iovec)> {
    let fault = || io::Error::from_raw_os_error(libc::EFAULT);
    let address = usize::try_from(address).map_err(|_| fault())?;
    let thread = libc::pid_t::try_from(thread).map_err(|_| fault())?;
    let iov_base = ptr::without_provenance_mut::<c_void>(address);
    Ok((thread, iovec { iov_base, iov_len: length }))
}

/// A partial read or write counts as a fault, as it does for the kernel.
fn all(done: isize, length: usize) -> io::Result<()> {
    match usize::try_from(done) {
        Ok(done) if done == length => Ok(()),
        Ok(_) => Err(io::Error::from_raw_os_error(libc::EFAULT)),
        Err(_) => Err(io::Error::last_os_error()),
    }
}

// --- the line discipline ---

/// Gives a terminal this line discipline.
pub(crate) fn set_discipline(terminal: BorrowedFd<'_>, discipline: c_int) -> io::Result<()> {
    let discipline = ptr::from_ref(&discipline);
    // SAFETY: the kernel reads one integer, which outlives the call. On a descriptor that is not a
    // terminal the request means nothing else that would write.
    match unsafe { libc::ioctl(terminal.as_raw_fd(), libc::TIOCSETD, discipline) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

// --- signals ---

/// A set of signals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Signals(sigset_t);

/// A signal that has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Told {
    pub(crate) signal: c_int,
    /// The process that sent it, unless the kernel did: a key of the terminal, or its end.
    pub(crate) by: Option<libc::pid_t>,
}

impl Signals {
    pub(crate) fn of(signals: &[c_int]) -> Signals {
        let mut set = MaybeUninit::uninit();
        // SAFETY: it makes the set that the pointer leads to an empty one.
        let _ = unsafe { libc::sigemptyset(set.as_mut_ptr()) };
        // SAFETY: it was made just now, and that cannot fail.
        let mut set = unsafe { set.assume_init() };
        for &signal in signals {
            // SAFETY: the set is a valid one. A number that is not a signal is refused.
            let _ = unsafe { libc::sigaddset(&raw mut set, signal) };
        }
        Signals(set)
    }

    /// Blocks these signals for this thread and those that it starts, so that [`Signals::wait`]
    /// gets them. Returns what was blocked before.
    pub(crate) fn block(self) -> io::Result<Signals> {
        self.mask(libc::SIG_BLOCK)
    }

    /// Blocks exactly these signals for this thread.
    pub(crate) fn set(self) -> io::Result<Signals> {
        self.mask(libc::SIG_SETMASK)
    }

    fn mask(self, how: c_int) -> io::Result<Signals> {
        let mut old = Signals::of(&[]).0;
        // SAFETY: both sets are valid; one is read and one is written.
        let error = unsafe { libc::pthread_sigmask(how, &raw const self.0, &raw mut old) };
        if error == 0 { Ok(Signals(old)) } else { Err(io::Error::from_raw_os_error(error)) }
    }

    /// Waits for one of these, which must be blocked, for as long as this at most.
    pub(crate) fn wait(self, limit: Option<Duration>) -> io::Result<Option<Told>> {
        let mut about = MaybeUninit::<siginfo_t>::zeroed();
        let limit = limit.map(|limit| libc::timespec {
            tv_sec: i64::try_from(limit.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: limit.subsec_nanos().into(),
        });
        let limit = limit.as_ref().map_or(ptr::null(), ptr::from_ref);
        // SAFETY: the set is valid, the structure is ours to write to, and the limit is null or
        // leads to a time that outlives the call.
        let signal = unsafe { libc::sigtimedwait(&raw const self.0, about.as_mut_ptr(), limit) };
        if signal < 0 {
            let error = io::Error::last_os_error();
            return match error.raw_os_error() {
                Some(libc::EAGAIN | libc::EINTR) => Ok(None),
                _ => Err(error),
            };
        }
        // SAFETY: zeroes were a value of it already, and the kernel has filled it in.
        let about = unsafe { about.assume_init() };
        let by_process = [libc::SI_USER, libc::SI_QUEUE, libc::SI_TKILL].contains(&about.si_code);
        // SAFETY: for signals of these kinds the kernel has filled in who sent them, and for the
        // others the memory of this field is zero or another integer.
        let by = by_process.then(|| unsafe { about.si_pid() });
        Ok(Some(Told { signal, by }))
    }
}

/// Lets a signal do what it does by default. It makes one system call and may be called between
/// fork and exec.
pub(crate) fn take_default(signal: c_int) {
    // SAFETY: the default is not a function of ours. A number that is not a signal is refused.
    let _ = unsafe { libc::signal(signal, libc::SIG_DFL) };
}
