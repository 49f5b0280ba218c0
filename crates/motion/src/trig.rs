//! Sine, cosine and the angle of a direction, in integers: the same on every platform.
//!
//! The working fractions are in units of 2⁻⁶². Ten rounded terms leave an error of less than 2⁻⁵⁷, and sine and
//! cosine are rounded to 2⁻⁵⁶, by which 0, ½ and 1 come out exactly.

/// Billionths of a degree in a quarter turn.
pub(crate) const QUARTER: u64 = 90_000_000_000;

/// Binary places of an angle in radians.
pub(crate) const RADIAN_BITS: u32 = 62;

/// Binary places of a sine or cosine.
pub(crate) const SINE_BITS: u32 = 56;

const ONE: i128 = 1 << RADIAN_BITS;

/// π·2⁸⁸, rounded.
const PI_88: i128 = 972_275_833_250_902_676_681_726_346;

/// A quarter turn, 2⁻⁶² radians.
pub(crate) const HALF_PI: i128 = (PI_88 >> 26) / 2;

/// An angle of up to 2⁴⁹ billionths of a degree in units of 2⁻⁶² radians, rounded down.
pub(crate) fn radians(billionths: u64) -> i128 {
    // Whole quarters first, so that no product is too large.
    let (quarters, rest) = (billionths / QUARTER, billionths % QUARTER);
    i128::from(quarters) * HALF_PI + ((PI_88 * i128::from(rest) / (2 * i128::from(QUARTER))) >> 26)
}

/// Sine and cosine of an angle from 0 to a quarter turn, in units of 2⁻⁵⁶.
pub(crate) fn sine_and_cosine(billionths: u64) -> (i64, i64) {
    // Up to an eighth; beyond it the two change places.
    let mirrored = billionths > QUARTER / 2;
    let angle = radians(if mirrored { QUARTER - billionths } else { billionths });
    let rounded = |value: i128| {
        let dropped = RADIAN_BITS - SINE_BITS;
        ((value + (1 << (dropped - 1))) >> dropped) as i64
    };
    let (sine, cosine) = (rounded(sine(angle)), rounded(cosine(angle)));
    if mirrored { (cosine, sine) } else { (sine, cosine) }
}

/// The angle of the direction (`x`, `y`), neither negative nor both zero, both less than 2⁶⁰, from
/// 0 to a quarter turn, in units of 2⁻⁶² radians.
pub(crate) fn angle(x: i64, y: i64) -> i128 {
    if y > x {
        return HALF_PI - angle(y, x);
    }
    // As long as possible, so that its rounded length is as good as the length.
    let shift = x.leading_zeros().saturating_sub(4);
    let (x, y) = (i128::from(x << shift), i128::from(y << shift));
    // Turned back by what is known of the angle, the direction shows the sine of what is not,
    // which is nearly that itself: the error e becomes e³/6, from at most an eighth turn.
    let length = ((x * x + y * y) as u128).isqrt().max(1) as i128;
    let mut known = HALF_PI / 4;
    for _ in 0..5 {
        known += (y * cosine(known) - x * sine(known)) / length;
    }
    known.max(0)
}

/// Taylor's series from its last term; `square` is that of the angle.
fn series(square: i128, first_divisor: i128) -> i128 {
    (0..10).rev().fold(ONE, |tail, term| {
        let divisor = 2 * term + first_divisor;
        ONE - ((square * tail) >> RADIAN_BITS) / (divisor * (divisor + 1))
    })
}

/// The sine of an angle of up to an eighth turn and a hair.
fn sine(angle: i128) -> i128 {
    (angle * series((angle * angle) >> RADIAN_BITS, 2)) >> RADIAN_BITS
}

/// The cosine, likewise.
fn cosine(angle: i128) -> i128 {
    series((angle * angle) >> RADIAN_BITS, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: f64 = (1u64 << SINE_BITS) as f64;

    #[test]
    fn known_values() {
        let (half, one) = (1 << (SINE_BITS - 1), 1 << SINE_BITS);
        // √½ and √¾ in units of 2⁻⁵⁶, rounded to the nearest.
        let nearest = |square: u128| {
            let doubled = (4 * square).isqrt();
            doubled.div_ceil(2) as i64
        };
        let root_half = nearest(1 << 111);
        let root_three_quarters = nearest(3 << 110);
        for (degrees, sine, cosine) in [
            (0, 0, one),
            (30, half, root_three_quarters),
            (45, root_half, root_half),
            (60, root_three_quarters, half),
            (90, one, 0),
        ] {
            assert_eq!(sine_and_cosine(degrees * QUARTER / 90), (sine, cosine), "{degrees}°");
        }
    }

    #[test]
    fn all_the_quarter() {
        for step in 0..=36_000u64 {
            let billionths = QUARTER / 36_000 * step;
            let (sine, cosine) = sine_and_cosine(billionths);
            let angle = (billionths as f64 / 1e9).to_radians();
            assert!((sine as f64 / UNIT - angle.sin()).abs() < 1e-12, "{billionths}");
            assert!((cosine as f64 / UNIT - angle.cos()).abs() < 1e-12, "{billionths}");
            // On the unit circle within the rounding of both: f64 could not see it.
            let (s, c) = (i128::from(sine), i128::from(cosine));
            assert!((s * s + c * c - (1i128 << 112)).abs() <= 1 << 57, "{billionths}");
        }
    }

    #[test]
    fn angles_of_directions() {
        assert_eq!((angle(5, 0), angle(0, 5), angle(1 << 59, 0)), (0, HALF_PI, 0));
        assert!((angle(7, 7) - HALF_PI / 2).abs() < 1 << 6);
        for (x, y) in [(1, 2), (3, 4), (1_000_000, 1), (1, 1 << 59), (999, 1_000), (12, 5)] {
            let there = angle(x, y) as f64 / ONE as f64;
            assert!((there - (y as f64).atan2(x as f64)).abs() < 1e-12, "{x}, {y}");
            assert!((angle(x, y) + angle(y, x) - HALF_PI).abs() <= 1);
        }
    }

    #[test]
    fn radians_of_many_turns() {
        let turns = radians(4_000 * QUARTER) as f64 / ONE as f64;
        assert!((turns - 1_000.0 * std::f64::consts::TAU).abs() < 1e-9);
        assert_eq!(radians(0), 0);
        assert_eq!(radians(QUARTER), HALF_PI);
    }
}
