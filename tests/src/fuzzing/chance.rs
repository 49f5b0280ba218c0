//! Chance that is no chance.

/// Numbers that look random and depend on the beginning alone, for what must make no difference.
#[derive(Clone, Debug)]
pub struct Chance(u64);

impl Chance {
    /// The numbers that go with some bytes.
    #[must_use]
    pub fn of(data: &[u8]) -> Chance {
        // FNV-1a, then xorshift: enough to spread the inputs, and the same everywhere.
        let hash = data.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        });
        Chance(hash | 1)
    }

    /// A number from 0 up to, but not including, `end`; 0 if there is none.
    pub fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.checked_rem(end).unwrap_or(0)
    }

    /// One of several.
    pub fn pick<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len() as u64) as usize]
    }

    /// Another one, for another thread.
    #[must_use]
    pub fn other(&mut self) -> Chance {
        Chance::of(&self.below(u64::MAX).to_le_bytes())
    }
}
