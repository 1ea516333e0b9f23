//! Statistics of repeated measurements.

use serde::{Deserialize, Serialize};

/// Order statistics of measurements. They assume no distribution, and an outlier moves the median
/// and the quartiles little.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Summary {
    /// Number of values.
    pub count: usize,
    /// Median: half of the values are below.
    pub median: f64,
    /// Minimum.
    pub least: f64,
    /// Maximum.
    pub greatest: f64,
    /// Lower quartile: a quarter of the values is below.
    pub lower_quartile: f64,
    /// Upper quartile: three quarters of the values are below.
    pub upper_quartile: f64,
}

impl Summary {
    /// Summary of no values.
    pub const NOTHING: Self = Self {
        count: 0,
        median: f64::NAN,
        least: f64::NAN,
        greatest: f64::NAN,
        lower_quartile: f64::NAN,
        upper_quartile: f64::NAN,
    };

    /// Summarises values, in any order. `None` if there are none, or one is NaN or infinite.
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.is_empty() || values.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            count: sorted.len(),
            median: quantile(&sorted, 0.5),
            least: quantile(&sorted, 0.0),
            greatest: quantile(&sorted, 1.0),
            lower_quartile: quantile(&sorted, 0.25),
            upper_quartile: quantile(&sorted, 0.75),
        })
    }

    /// Returns the interquartile range, within which the middle half of the values lies.
    pub fn spread(&self) -> f64 {
        self.upper_quartile - self.lower_quartile
    }
}

/// Returns the quantile at `share` of sorted values, interpolated linearly between them (Hyndman
/// and Fan, "Sample Quantiles in Statistical Packages", 1996, definition 7).
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    let weight = place - below as f64;
    sorted[below] + weight * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    /// Quartiles as R computes them: quantile(c(9, 1, 4, 16), type = 7).
    #[test]
    fn known_quartiles() {
        let summary = Summary::of(&[9.0, 1.0, 4.0, 16.0]).unwrap();
        assert_eq!((summary.count, summary.least, summary.greatest), (4, 1.0, 16.0));
        assert_eq!((summary.lower_quartile, summary.median, summary.upper_quartile), (3.25, 6.5, 10.75));
        assert_eq!(summary.spread(), 7.5);
        let one = Summary::of(&[2.5]).unwrap();
        assert_eq!((one.least, one.median, one.greatest, one.spread()), (2.5, 2.5, 2.5, 0.0));
    }

    /// One slow frame in ten changes neither median nor spread, but the mean and the maximum.
    #[test]
    fn robust() {
        let mut values = vec![1.0; 10];
        values[3] = 100.0;
        let summary = Summary::of(&values).unwrap();
        assert_eq!((summary.median, summary.spread(), summary.greatest), (1.0, 0.0, 100.0));
    }

    #[test]
    fn nothing_to_say() {
        for values in [&[][..], &[1.0, f64::NAN], &[f64::INFINITY]] {
            assert_eq!(Summary::of(values), None);
        }
    }
}
