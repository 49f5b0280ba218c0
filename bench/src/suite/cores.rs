//! Which core does what.

use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use super::failure::{Doing, Outcome};

/// Where servers and clients run when they must not disturb each other: always the same core
/// for either, so that the emulator and its baseline have the same caches and the same
/// neighbours.
pub(crate) struct Cores {
    /// The core of the server that is measured.
    pub(crate) server: Core,
    /// The core of the measuring client.
    pub(crate) client: Core,
}

/// One core of this machine.
#[derive(Clone, Copy)]
pub(crate) struct Core(usize);

impl Cores {
    /// The first and the last core that this process may use; with a single one, that.
    pub(crate) fn find() -> Outcome<Cores> {
        let allowed = sched_getaffinity(None).doing("ask for the cores that may be used")?;
        let mut cores = (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core)).map(Core);
        let server = cores.next().doing("find a core that may be used")?;
        let client = cores.next_back().unwrap_or(server);
        Ok(Cores { server, client })
    }
}

impl Core {
    /// Does something on this core only. Processes and threads that are started meanwhile stay
    /// there.
    pub(crate) fn run<T>(self, work: impl FnOnce() -> Outcome<T>) -> Outcome<T> {
        let before = sched_getaffinity(None).doing("ask for the cores that may be used")?;
        let mut only = CpuSet::new();
        only.set(self.0);
        sched_setaffinity(None, &only).doing(format!("move to core {}", self.0))?;
        let done = work();
        sched_setaffinity(None, &before).doing("move back to all cores")?;
        done
    }
}
