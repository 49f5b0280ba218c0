//! Round numbers along an axis.

/// Round numbers from `low` to `high`, about so many, each as people write it.
pub(crate) fn ticks(low: f64, high: f64, about: usize) -> Vec<(f64, String)> {
    let (step, decimals) = round_step((high - low) / about.max(1) as f64);
    let first = (low / step).ceil();
    let numbers = (0..1_000).map(|number| (first + f64::from(number)) * step);
    let until = numbers.take_while(|value| *value <= high + step * 1e-9);
    // Without a sign where nothing is left of a number.
    until.map(|value| (value, format!("{:.decimals$}", value + 0.0))).collect()
}

/// The nearest step above that is 1, 2 or 5 times a power of ten, and the decimals that its multiples
/// have.
pub(crate) fn round_step(least: f64) -> (f64, usize) {
    let least = if least.is_finite() && least > 0.0 { least.clamp(1e-9, 1e15) } else { 1.0 };
    let (mut power, mut decimals) = (1.0_f64, 0_usize);
    while power > least {
        decimals += 1;
        power = 1.0 / tens(decimals);
    }
    let mut tens_up = 0;
    while decimals == 0 && tens(tens_up + 1) <= least {
        tens_up += 1;
        power = tens(tens_up);
    }
    for factor in [1.0, 2.0, 5.0] {
        if factor * power >= least * (1.0 - 1e-9) {
            return (factor * power, decimals);
        }
    }
    (10.0 * power, decimals.saturating_sub(1))
}

fn tens(count: usize) -> f64 {
    (0..count).fold(1.0, |product, _| product * 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        for (least, step, decimals) in [
            (0.9, 1.0, 0),
            (1.0, 1.0, 0),
            (1.1, 2.0, 0),
            (2.0, 2.0, 0),
            (3.0, 5.0, 0),
            (7.0, 10.0, 0),
            (70.0, 100.0, 0),
            (0.11, 0.2, 1),
            (0.07, 0.1, 1),
            (0.03, 0.05, 2),
            (1_234.0, 2_000.0, 0),
        ] {
            let found = round_step(least);
            assert!((found.0 - step).abs() < 1e-12 && found.1 == decimals, "{least}: {found:?}");
        }
    }

    #[test]
    fn ticks_are_within_and_written_as_people_write_them() {
        let texts = |low, high, about| {
            ticks(low, high, about).into_iter().map(|(_, text)| text).collect::<Vec<_>>()
        };
        assert_eq!(texts(-11.0, 12.0, 4), ["-10", "0", "10"]);
        assert_eq!(texts(-0.1, 0.3, 4), ["-0.1", "0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(texts(5.0, 5.0, 4), ["5"]);
    }
}
