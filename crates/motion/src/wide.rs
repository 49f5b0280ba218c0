//! Numbers of 256 bits, for products and squares that 128 bits do not hold, and the way back.
//!
//! A number is its high and its low 128 bits, which compare in this order. Where the high ones are
//! zero everything is as fast as plain arithmetic.

/// A number of 256 bits.
pub(crate) type Wide = (u128, u128);

const HALF: u128 = u64::MAX as u128;

/// As 64 bits; a number that does not fit becomes the largest, which as a time means never.
pub(crate) fn saturated(value: u128) -> u64 {
    u64::try_from(value).unwrap_or(u64::MAX)
}

/// The product of two numbers.
pub(crate) fn product(a: u128, b: u128) -> Wide {
    let (a_high, a_low, b_high, b_low) = (a >> 64, a & HALF, b >> 64, b & HALF);
    let (low, cross, other) = (a_low * b_low, a_high * b_low, a_low * b_high);
    let middle = (low >> 64) + (cross & HALF) + (other & HALF);
    let high = a_high * b_high + (cross >> 64) + (other >> 64) + (middle >> 64);
    (high, (middle << 64) | (low & HALF))
}

/// The square of a number.
pub(crate) fn square(a: u128) -> Wide {
    product(a, a)
}

/// The sum; it must be less than 2²⁵⁶.
pub(crate) fn sum(a: Wide, b: Wide) -> Wide {
    let (low, carry) = a.1.overflowing_add(b.1);
    (a.0 + b.0 + u128::from(carry), low)
}

/// `a` less `b`, or 0 if `b` is more.
pub(crate) fn difference(a: Wide, b: Wide) -> Wide {
    if a < b {
        return (0, 0);
    }
    let (low, borrow) = a.1.overflowing_sub(b.1);
    (a.0 - b.0 - u128::from(borrow), low)
}

/// The quotient, rounded down; `divisor` is not 0 and less than 2¹²⁷, and a quotient that does not
/// fit is cut to the largest.
pub(crate) fn quotient(dividend: Wide, divisor: u128) -> u128 {
    let (mut rest, low) = dividend;
    if rest == 0 {
        return low / divisor;
    }
    if rest >= divisor {
        return u128::MAX;
    }
    // Long division, bit by bit.
    let mut quotient = 0;
    for bit in (0..128).rev() {
        rest = (rest << 1) | ((low >> bit) & 1);
        let fits = rest >= divisor;
        rest -= if fits { divisor } else { 0 };
        quotient = (quotient << 1) | u128::from(fits);
    }
    quotient
}

/// The square root, rounded down.
///
/// The root of the upper half gives the upper half of the root, and one division the rest of it,
/// but for one unit (Zimmermann, Karatsuba Square Root, 1999).
pub(crate) fn root(square_of: Wide) -> u128 {
    let (high, low) = square_of;
    if high == 0 {
        return low.isqrt();
    }
    // By an even number of bits, so that the root is shifted by half of it.
    let shift = high.leading_zeros() & !1;
    let (high, low) = match shift {
        0 => (high, low),
        _ => ((high << shift) | (low >> (128 - shift)), low << shift),
    };
    let upper = high.isqrt();
    let rest = high - upper * upper;
    let lower = ((rest << 63) | (low >> 65)) / upper;
    let root = (upper << 64).saturating_add(lower);
    let above = square(root) > (high, low);
    (root - u128::from(above)) >> (shift / 2)
}

/// The square root, rounded up; it is less than 2¹²⁸.
pub(crate) fn ceil_root(square_of: Wide) -> u128 {
    let root = root(square_of);
    root + u128::from(square(root) < square_of)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers of every length.
    fn numbers() -> impl Strategy<Value = u128> {
        (any::<u128>(), 0..128u32).prop_map(|(number, shift)| number >> shift)
    }

    #[test]
    fn products() {
        let (a, b) = (0xfedc_ba98_7654_3210_0f1e_2d3c_4b5a_6978, u128::MAX);
        // a·(2¹²⁸ - 1) = (a - 1)·2¹²⁸ + (2¹²⁸ - a)
        assert_eq!(product(a, b), (a - 1, a.wrapping_neg()));
        assert_eq!(product(b, a), (a - 1, a.wrapping_neg()));
        assert_eq!(square(u128::MAX), (u128::MAX - 1, 1));
        assert_eq!(square(1 << 64), (1, 0));
    }

    #[test]
    fn roots_at_the_ends() {
        assert_eq!(root((u128::MAX, u128::MAX)), u128::MAX);
        assert_eq!(root((u128::MAX - 1, 1)), u128::MAX);
        assert_eq!(root((u128::MAX - 1, 0)), u128::MAX - 1);
        assert_eq!((root((0, 0)), root((1, 0)), ceil_root((1, 1))), (0, 1 << 64, (1 << 64) + 1));
    }

    proptest! {
        #[test]
        fn quotients(a in numbers(), b in 1..u128::MAX >> 1, rest in numbers()) {
            let rest = rest % b;
            prop_assert_eq!(quotient(sum(product(a, b), (0, rest)), b), a);
            prop_assert_eq!(difference(sum(product(a, b), (0, rest)), (0, rest)), product(a, b));
        }

        #[test]
        fn roots(number in numbers(), more in numbers()) {
            let wide = sum(square(number), (0, more.min(number)));
            prop_assert_eq!(root(wide), number);
            prop_assert_eq!(ceil_root(wide), number + u128::from(more.min(number) > 0));
            // One less than the square of the next.
            prop_assert_eq!(root(sum(square(number), product(2, number))), number);
        }

        #[test]
        fn roots_of_anything(high in numbers(), low in numbers()) {
            let root = root((high, low));
            prop_assert!(square(root) <= (high, low));
            prop_assert!(root == u128::MAX || square(root + 1) > (high, low));
        }
    }
}
