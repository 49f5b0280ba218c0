//! What the tests of random cases share, whatever controller they try.

pub(crate) mod walk;

use vimc4_device::{Device, Harness};
use vimc4_plant::{Axis, Motor};

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

/// What a controller has said since that was last taken, as text.
pub(crate) fn text(harness: &mut Harness<impl Device>) -> String {
    harness.take_bytes().into_iter().map(char::from).collect()
}

/// Runs until nothing is due any more, at most `limit` causes.
pub(crate) fn run_out(harness: &mut Harness<impl Device>, limit: u32) {
    for _ in 0..limit {
        if harness.step().is_none() {
            return;
        }
    }
}

/// Tries `VIMC4_CASES` cases, or `default`, one after the other. A failing one names its seed.
#[expect(clippy::disallowed_methods, reason = "a test may be asked for more cases")]
pub(crate) fn try_all(default: u64, try_case: impl Fn(u64) + std::panic::RefUnwindSafe) {
    let asked = std::env::var("VIMC4_CASES").ok().and_then(|text| text.parse().ok());
    for seed in 0..asked.unwrap_or(default) {
        if let Err(reason) = std::panic::catch_unwind(|| try_case(seed)) {
            eprintln!("seed {seed}");
            std::panic::resume_unwind(reason);
        }
    }
}

/// Switches around where the carriage stands, or ends of the mechanics, play in the gear and contacts
/// that let go late.
pub(crate) fn mechanics(axis: &mut Axis, random: &mut Random) {
    axis.inverted = random.one_in(4);
    axis.start = 0;
    axis.negative_switch = (!random.one_in(3)).then(|| -random.range(1, 900));
    axis.positive_switch = (!random.one_in(3)).then(|| random.range(1, 900));
    // Where there is a switch the end is far beyond it.
    let end = |switch: Option<i64>, random: &mut Random| match switch {
        None if random.one_in(2) => Some(random.range(0, 700)),
        _ => None,
    };
    axis.lowest = end(axis.negative_switch, random).map(|end| -end);
    axis.highest = end(axis.positive_switch, random);
    if random.one_in(2) {
        axis.backlash = random.range(0, 40) as u32;
    }
    if random.one_in(3) {
        let (slow, fast) = (random.range(20, 5_000), random.range(5_001, 40_000));
        let pull = vec![(slow as u32, 500), (fast as u32, random.range(0, 300) as u32)];
        let start = random.one_in(2).then(|| random.range(1, 1_000) as u32);
        axis.motor = Some(Motor { start, pull, load: random.range(0, 200) as u32 });
    }
    if random.one_in(2) {
        axis.hysteresis = random.range(0, 30) as u32;
    }
}
