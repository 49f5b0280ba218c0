//! Medians and quantiles.

use super::failure::Outcome;

/// How often what is compared is measured, taking turns.
pub(crate) const ROUNDS: usize = 5;

/// Measurements of the same thing, in any unit.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sample(Vec<f64>);

impl Sample {
    /// Adds one.
    pub(crate) fn add(&mut self, value: f64) {
        self.0.push(value);
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// The value that a share of all, 0 to 1, is not above; the last one with 1. 0 for none.
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        let mut values = self.0.clone();
        values.sort_by(f64::total_cmp);
        let rank = (share * values.len() as f64).ceil() as usize;
        values.get(rank.saturating_sub(1)).copied().unwrap_or_default()
    }

    /// The median, the lower one of two.
    pub(crate) fn median(&self) -> f64 {
        self.quantile(0.5)
    }
}

impl FromIterator<f64> for Sample {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Sample {
        Sample(values.into_iter().collect())
    }
}

/// Two things that are compared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<T> {
    /// What we compare ours with.
    pub(crate) baseline: T,
    /// Ours.
    pub(crate) ours: T,
}

impl Pair<f64> {
    /// How many times the baseline ours is.
    pub(crate) fn ratio(self) -> f64 {
        self.ours / self.baseline
    }
}

/// The medians of two measurements that take turns, so that what changes on the machine in the
/// meantime changes both.
pub(crate) fn alternate(
    rounds: usize,
    mut baseline: impl FnMut() -> Outcome<f64>,
    mut ours: impl FnMut() -> Outcome<f64>,
) -> Outcome<Pair<f64>> {
    let mut samples = Pair { baseline: Sample::default(), ours: Sample::default() };
    for _ in 0..rounds {
        samples.baseline.add(baseline()?);
        samples.ours.add(ours()?);
    }
    Ok(Pair { baseline: samples.baseline.median(), ours: samples.ours.median() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_the_first_value_that_is_enough() {
        let sample: Sample = (1..=100).rev().map(f64::from).collect();
        assert_eq!(sample.median(), 50.0);
        assert_eq!(sample.quantile(0.99), 99.0);
        assert_eq!(sample.quantile(1.0), 100.0);
        assert_eq!(sample.quantile(0.0), 1.0);
        assert_eq!(Sample::default().median(), 0.0);
    }

    #[test]
    fn two_measurements_take_turns() {
        let order = std::cell::RefCell::new(String::new());
        let measure = |name: char, value: f64| {
            order.borrow_mut().push(name);
            Ok(value)
        };
        let pair = alternate(3, || measure('b', 4.0), || measure('o', 6.0)).unwrap();
        assert_eq!(order.into_inner(), "bobobo");
        assert_eq!(pair.ratio(), 1.5);
    }
}
