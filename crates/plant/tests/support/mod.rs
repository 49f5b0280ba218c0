//! What the tests of random cases share, whatever controller they try.

#![allow(dead_code, reason = "each test binary uses its own part")]

pub(crate) mod contract;
pub(crate) mod walk;

use vimc4_device::{Device, Event, Input, Output, Time};

/// How many random cases to try: `VIMC4_CASES`, or `default`.
#[expect(clippy::disallowed_methods, reason = "a test may be asked for more cases")]
pub(crate) fn cases(default: u64) -> u64 {
    std::env::var("VIMC4_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Random numbers that are the same everywhere (splitmix64). A failing case names its seed.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number from `low` to `high`, both included.
    pub(crate) fn range(&mut self, low: i64, high: i64) -> i64 {
        low + (self.next() % (high - low + 1) as u64) as i64
    }

    /// Whether something with these odds, one in `n`, happens.
    pub(crate) fn one_in(&mut self, n: u64) -> bool {
        self.next().is_multiple_of(n)
    }

    pub(crate) fn pick<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[(self.next() % items.len() as u64) as usize]
    }
}

/// Everything a controller has put out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Record {
    pub(crate) said: Vec<(Time, u8)>,
    pub(crate) flash: Vec<(Time, Vec<u8>)>,
    pub(crate) events: Vec<(Time, Event)>,
}

impl Record {
    /// What was said, as text.
    pub(crate) fn text(&self) -> String {
        self.said.iter().map(|&(_, byte)| char::from(byte)).collect()
    }
}

/// Takes everything that waits, and says when to wake the controller.
pub(crate) fn drain(controller: &mut impl Device, record: &mut Record) -> Option<Time> {
    loop {
        match controller.poll_output() {
            Output::Bytes(at, bytes) => record.said.extend(bytes.iter().map(|&b| (at, b))),
            Output::Flash(at, change) => {
                record.flash.push((at, format!("{change:?}").into_bytes()))
            }
            Output::Event(at, event) => record.events.push((at, event)),
            Output::Wake(wake) => return wake,
        }
    }
}

/// Runs a controller up to a time, waking it exactly when it asks for it.
pub(crate) fn run_to(controller: &mut impl Device, record: &mut Record, at: Time) {
    while let Some(wake) = drain(controller, record).filter(|&wake| wake <= at) {
        controller.handle(Input::Wake, wake);
    }
}

/// Runs until nothing is due any more, at most `limit` causes.
pub(crate) fn run_out(controller: &mut impl Device, record: &mut Record, limit: u32) {
    for _ in 0..limit {
        let Some(wake) = drain(controller, record) else { return };
        controller.handle(Input::Wake, wake);
    }
    drain(controller, record);
}

/// Tries the cases one after the other. A failing one names its seed.
pub(crate) fn try_all(default: u64, try_case: impl Fn(u64) + std::panic::RefUnwindSafe) {
    for seed in 0..cases(default) {
        if let Err(reason) = std::panic::catch_unwind(|| try_case(seed)) {
            eprintln!("seed {seed}");
            std::panic::resume_unwind(reason);
        }
    }
}
