//! What a process costs, from /proc.

use std::fs;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

use super::failure::{Doing, Outcome};

/// Processor time and context switches of all threads of a process since it began.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Usage {
    /// Processor time.
    pub(crate) time: Duration,
    /// How often a thread was given a processor anew.
    pub(crate) switches: u64,
}

/// The memory of a process that is in RAM, bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory {
    /// All of it: also pages of the program's file.
    pub(crate) resident: f64,
    /// What is its own: heap, stacks, data it has changed.
    pub(crate) anonymous: f64,
}

impl Usage {
    /// Of the process with this number. The accounting of the scheduler counts nanoseconds,
    /// where `stat` counts ticks of a hundredth of a second.
    pub(crate) fn of(process: u32) -> Outcome<Usage> {
        let mut usage = Usage { time: Duration::ZERO, switches: 0 };
        let threads = format!("/proc/{process}/task");
        for thread in fs::read_dir(&threads).doing(format!("read {threads}"))?.flatten() {
            let read = |file: &str| {
                let path = thread.path().join(file);
                fs::read_to_string(&path).doing(format!("read {}", path.display()))
            };
            let accounts = read("schedstat")?;
            let nanos = accounts.split_whitespace().next().and_then(|field| field.parse().ok());
            usage.time +=
                Duration::from_nanos(nanos.doing("read processor time; the kernel counts none")?);
            let status = read("status")?;
            usage.switches += ["voluntary_ctxt_switches", "nonvoluntary_ctxt_switches"]
                .iter()
                .filter_map(|name| field(&status, name))
                .sum::<u64>();
        }
        Ok(usage)
    }

    /// What was used since an earlier look.
    pub(crate) fn since(self, earlier: Usage) -> Usage {
        Usage {
            time: self.time.saturating_sub(earlier.time),
            switches: self.switches.saturating_sub(earlier.switches),
        }
    }
}

impl Memory {
    /// Of the process with this number.
    pub(crate) fn of(process: u32) -> Outcome<Memory> {
        let path = format!("/proc/{process}/status");
        let status = fs::read_to_string(&path).doing(format!("read {path}"))?;
        let bytes = |name: &str| {
            let kibibytes = field(&status, name).doing(format!("find {name} in {path}"))?;
            Ok(kibibytes as f64 * 1024.0)
        };
        Ok(Memory { resident: bytes("VmRSS")?, anonymous: bytes("RssAnon")? })
    }
}

/// The most memory that the process with this number has had in RAM so far, bytes; `None` if it is
/// over.
pub(crate) fn peak(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    Some(field(&status, "VmHWM")? as f64 * 1024.0)
}

/// The number in a line `name:  number …`.
fn field(status: &str, name: &str) -> Option<u64> {
    let values = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    values.split_whitespace().next()?.parse().ok()
}

/// The processor time that something takes on this thread, nanoseconds. What other programs
/// do meanwhile is not in it.
pub(crate) fn processor_time(work: impl FnOnce()) -> f64 {
    let now = || {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        time.tv_sec as f64 * 1e9 + time.tv_nsec as f64
    };
    let began = now();
    work();
    now() - began
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_found_by_its_whole_name() {
        let status = "VmRSS:\t    4468 kB\nRssAnon:\t     512 kB\nvoluntary_ctxt_switches:\t7\n";
        assert_eq!(field(status, "RssAnon"), Some(512));
        assert_eq!(field(status, "voluntary_ctxt_switches"), Some(7));
        assert_eq!(field(status, "Rss"), None);
    }
}
