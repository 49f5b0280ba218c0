//! `m` steps spread evenly over `n` clock steps, `m ≤ n`, rounding to nearest.
//!
//! This is the whole of a straight line, and what ties the third axis of a helix to its circle.

/// Products of two numbers below this fit 64 bits with room for the factor 2.
const NARROW: u64 = 1 << 31;

/// How many of the `m` steps are made after `k` of the `n` clock steps:
/// `floor((2·k·m + n) / (2·n))`. 0 if `n` is 0.
pub(crate) fn made(k: u64, m: u64, n: u64) -> u64 {
    if m == n || m == 0 {
        return if m == 0 { 0 } else { k };
    }
    if n < NARROW {
        (2 * k * m + n) / (2 * n)
    } else {
        // The quotient is at most m, so it fits again.
        let (k, m, n) = (u128::from(k), u128::from(m), u128::from(n));
        ((2 * k * m + n) / (2 * n)) as u64
    }
}

/// The first clock step after which `j` steps are made, for `j` from 1 to `m`.
///
/// `made(k) ≥ j` means `2·k·m ≥ n·(2·j - 1)`; this is the least such `k`.
pub(crate) fn clock_of(j: u64, m: u64, n: u64) -> u64 {
    if n < NARROW {
        (n * (2 * j - 1)).div_ceil(2 * m)
    } else {
        let (j, m, n) = (u128::from(j), u128::from(m), u128::from(n));
        (n * (2 * j - 1)).div_ceil(2 * m) as u64
    }
}

/// The same spread as a step interrupt does it: an error accumulator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spread {
    /// How much is missing until a step is due, as a negative number.
    error: i64,
    increment: i64,
    decrement: i64,
}

impl Spread {
    /// `m` steps over `n` clock steps, of which `done` are behind us; `n` is below 2⁶¹. With
    /// nothing done half a step is missing, which is what rounds to nearest.
    pub(crate) fn new(done: u64, m: u64, n: u64) -> Spread {
        let whole = 2 * u128::from(n).max(1);
        let part = (2 * u128::from(done) * u128::from(m) + u128::from(n)) % whole;
        Spread {
            error: part as i64 - whole as i64,
            increment: 2 * m as i64,
            decrement: whole as i64,
        }
    }

    /// One clock step; -1 if a step is due, else 0: a mask, because a branch here would be taken
    /// at random as far as a processor can tell.
    #[inline]
    pub(crate) fn tick(&mut self) -> i64 {
        self.error += self.increment;
        let due = !(self.error >> 63);
        self.error -= self.decrement & due;
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_is_rounded_up() {
        // 1 step over 2: after the first clock step exactly half a step is due.
        assert_eq!([0, 1, 2].map(|k| made(k, 1, 2)), [0, 1, 1]);
        // 2 steps over 5: 0.4, 0.8, 1.2, 1.6, 2.
        assert_eq!([0, 1, 2, 3, 4, 5].map(|k| made(k, 2, 5)), [0, 0, 1, 1, 2, 2]);
    }

    #[test]
    fn closed_form_inverse_and_accumulator_agree() {
        for n in 1..40 {
            for m in 0..=n {
                let mut spread = Spread::new(0, m, n);
                let mut count = 0;
                for k in 1..=n {
                    let due = spread.tick() != 0;
                    count += u64::from(due);
                    assert_eq!(made(k, m, n), count, "{k} of {m} over {n}");
                    if due {
                        assert_eq!(clock_of(count, m, n), k);
                    }
                }
                assert_eq!(count, m);
            }
        }
    }

    #[test]
    fn wide_and_narrow_arithmetic_meet() {
        // The same ratio a factor 2^12 apart runs through the other branch.
        for (k, m, n) in [(7, 3, 1 << 30), (1 << 29, 77_777, 1 << 30), (999_999, 999_998, 1 << 30)]
        {
            let wide = (2 * k as u128 * m as u128 + n as u128) / (2 * n as u128);
            assert_eq!(u128::from(made(k, m, n)), wide);
            assert_eq!(made(k << 12, m, n << 12), made(k, m, n));
        }
    }
}
