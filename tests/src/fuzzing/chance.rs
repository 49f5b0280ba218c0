//! Chance that is no chance.

/// Numbers that look random and depend on the input alone, for what must make no difference.
pub(super) struct Chance(u64);

impl Chance {
    pub(super) fn of(data: &[u8]) -> Chance {
        // FNV-1a, then xorshift: enough to spread the inputs, and the same everywhere.
        let hash = data.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        });
        Chance(hash | 1)
    }

    /// A number from 0 up to, but not including, `end`; 0 if there is none.
    pub(super) fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.checked_rem(end).unwrap_or(0)
    }
}
