//! A hundred emulators at once.

use std::fs;
use std::thread;

use vimc4::{Clock, Emulator, Worker};

use crate::tools::{Terminal, ask, at, connect, descriptors, wait_until};

pub(crate) const TESTS: &[(&str, fn())] = &[
    ("crowd: a hundred emulators leave nothing behind", || side_by_side(100, None)),
    ("crowd: a hundred on one thread leave nothing behind", || {
        side_by_side(100, Some(Worker::start("vimc4").unwrap()));
    }),
];

/// How many threads of this process belong to an emulator.
fn emulator_threads() -> usize {
    let tasks = fs::read_dir("/proc/self/task").unwrap().flatten();
    // A thread may end between the two looks.
    let names = tasks.filter_map(|task| fs::read_to_string(task.path().join("comm")).ok());
    names.filter(|name| name.starts_with("vimc4")).count()
}

/// Does the same with all of them at once, each in a thread of its own.
fn together<T: Send, R: Send>(
    all: impl IntoIterator<Item = T>,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    thread::scope(|scope| {
        let work = &work;
        let threads: Vec<_> = all.into_iter().map(|one| scope.spawn(move || work(one))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}

fn side_by_side(crowd: usize, shared: Option<Worker>) {
    // What the first pseudo-terminal makes for all that follow stays.
    drop(Emulator::builder().pty(true).tcp("127.0.0.1:0").start().unwrap());
    let threads = if shared.is_some() { 1 } else { crowd };
    let idle_threads = usize::from(shared.is_some());
    wait_until("a quiet start", || emulator_threads() == idle_threads);
    let before = descriptors();
    let folder = tempfile::tempdir().unwrap();
    let start = |n: usize| {
        let mut builder = Emulator::builder().time(Clock::Instant).tcp("127.0.0.1:0");
        if let Some(worker) = &shared {
            builder = builder.on(worker);
        }
        builder.pty(folder.path().join(format!("port{n}"))).start().unwrap()
    };
    let emulators: Vec<_> = together(1..=crowd, start);
    // Each drives to a place of its own by one line and is asked by the other.
    together(emulators.iter().zip(1..), |(emulator, n)| {
        let drive = format!("@0A{n},900,0,900,0,900,0,900");
        let mut stream = connect(emulator);
        assert_eq!(ask(&mut stream, "@07", 1), "0");
        assert_eq!(ask(&mut stream, &drive, 1), "0");
        let mut terminal = Terminal::open(emulator.port().unwrap());
        assert_eq!(ask(&mut terminal, "@0P", 19), at(n));
        assert_eq!(ask(&mut terminal, &drive, 1), "0");
    });
    together(emulators.iter().zip(1..), |(emulator, n)| {
        assert_eq!(ask(&mut connect(emulator), "@0P", 19), at(2 * n));
    });
    assert_eq!(emulator_threads(), threads);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), crowd);
    let mut addresses: Vec<_> = emulators.iter().map(|e| e.tcp_addr().unwrap()).collect();
    addresses.sort_unstable();
    addresses.dedup();
    assert_eq!(addresses.len(), crowd, "two listen at the same address");
    together(emulators, drop);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "links are left");
    // A joined thread is shown a moment longer.
    wait_until("the end of all threads", || emulator_threads() == idle_threads);
    wait_until("the end of all descriptors", || descriptors() == before);
}
