//! Confidence intervals and tests for a small number of repetitions.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};
pub use trisect::adaptive::mean_and_error;

/// Coverage of confidence intervals, unless another is stated.
pub const CONFIDENCE: f64 = 0.95;

/// Degrees of freedom that stand for more of them. With 1e10, statrs does not end.
const MANY: f64 = 1e6;

/// Estimate with the interval that covers the truth in [`CONFIDENCE`] of all cases.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Interval {
    /// Estimate.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl Interval {
    /// Returns the interval of an estimate with this standard error and degrees of freedom, by
    /// Student's distribution.
    pub fn of(value: f64, error: f64, freedom: f64) -> Self {
        let half = quantile(CONFIDENCE, freedom) * error;
        Self { value, low: value - half, high: value + half }
    }

    /// Returns the interval of the mean of independent values of one distribution. For a single
    /// value it is infinite.
    pub fn of_mean(values: &[f64]) -> Self {
        let (mean, error) = mean_and_error(values);
        Self::of(mean, error, values.len() as f64 - 1.0)
    }

    /// Returns estimate and interval of a function of the quantity. `map` must be monotonic.
    pub fn map(self, map: impl Fn(f64) -> f64) -> Self {
        let (a, b) = (map(self.low), map(self.high));
        Self { value: map(self.value), low: a.min(b), high: a.max(b) }
    }

    /// Returns the roots of an interval of squared shares, in percent, for people.
    pub fn root_percent(self) -> String {
        let root = self.map(|value| 100.0 * value.max(0.0).sqrt());
        format!("{:.3} % ({:.3} to {:.3})", root.value, root.low, root.high)
    }

    /// Returns whether the interval contains a value.
    pub fn covers(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Returns half the width, in standard errors, of the interval that covers `confidence` of
/// Student's distribution; infinity without degrees of freedom.
pub fn quantile(confidence: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom.min(MANY)) {
        Ok(distribution) if !freedom.is_nan() => distribution.inverse_cdf(0.5 + 0.5 * confidence),
        _ => f64::INFINITY,
    }
}

/// Returns the standard error of an estimate from `n` repetitions, from the estimates without each
/// of them (Tukey's jackknife).
pub fn jackknife_error(without: &[f64]) -> f64 {
    let n = without.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
    if without.len() < 2 { f64::INFINITY } else { ((n - 1.0) / n * squares).sqrt() }
}

/// Result of Welch's test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Welch {
    /// Difference of the means over its standard error.
    pub t: f64,
    /// Degrees of freedom (Welch and Satterthwaite).
    pub freedom: f64,
    /// Probability of a difference at least as large if both means are equal.
    pub p: f64,
}

/// Tests whether two means differ, each given with its standard error and degrees of freedom
/// (Welch, "The Generalization of Student's Problem when Several Different Population Variances are
/// Involved", Biometrika 34, 1947). If neither has an error, equal means give p = 1 and others p =
/// 0.
pub fn welch(a: (f64, f64, f64), b: (f64, f64, f64)) -> Welch {
    let (va, vb) = (a.1 * a.1, b.1 * b.1);
    let variance = va + vb;
    if variance == 0.0 || !variance.is_finite() {
        let same = a.0 == b.0 || !variance.is_finite();
        return Welch {
            t: if same { 0.0 } else { f64::INFINITY },
            freedom: f64::INFINITY,
            p: f64::from(u8::from(same)),
        };
    }
    let part = |v: f64, freedom: f64| if freedom.is_finite() { v * v / freedom.max(1e-9) } else { 0.0 };
    let freedom = variance * variance / (part(va, a.2) + part(vb, b.2));
    let t = (a.0 - b.0) / variance.sqrt();
    Welch { t, freedom, p: two_sided(t, freedom) }
}

/// Returns the probability of a value at least as far from 0, by Student's distribution.
fn two_sided(t: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom.clamp(1e-3, MANY)) {
        Ok(distribution) => 2.0 * distribution.cdf(-t.abs()),
        Err(_) => 1.0,
    }
}

/// Returns the probability that the smallest of `count` independent p-values is at most `least`
/// (Šidák, 1967).
pub fn sidak(least: f64, count: usize) -> f64 {
    // 1 - (1 - p)^n without loss of digits.
    -f64::exp_m1(count as f64 * f64::ln_1p(-least.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Student's table: 12.706 for one degree of freedom, 2.365 for seven, 1.960 for infinitely
    /// many.
    #[test]
    fn the_table() {
        for (freedom, want) in [(1.0, 12.706), (7.0, 2.365), (f64::INFINITY, 1.960)] {
            assert!((quantile(0.95, freedom) - want).abs() < 1e-3);
        }
        assert_eq!(quantile(0.95, 0.0), f64::INFINITY);
        assert_eq!(quantile(0.95, f64::NAN), f64::INFINITY);
        for many in [1e6, 8_809_818_621.345_17, 1e300] {
            assert_eq!(quantile(0.95, many), quantile(0.95, f64::INFINITY));
        }
        let interval = Interval::of_mean(&[1.0, 2.0, 3.0]);
        // t of two degrees of freedom is 4.303, the error 1/sqrt(3).
        assert!((interval.high - (2.0 + 4.303 / 3f64.sqrt())).abs() < 1e-3 && interval.covers(2.0));
        assert!(Interval::of_mean(&[1.0]).covers(1e300));
    }

    /// R gives t = 1.959, df = 7.03, p = 0.0908 for t.test(c(30.02, 29.99, 30.11, 29.97, 30.01,
    /// 29.99), c(29.89, 29.93, 29.72, 29.98, 30.02, 29.98)).
    #[test]
    fn as_r_has_it() {
        let of = |values: &[f64]| {
            let (mean, error) = mean_and_error(values);
            (mean, error, values.len() as f64 - 1.0)
        };
        let a = of(&[30.02, 29.99, 30.11, 29.97, 30.01, 29.99]);
        let b = of(&[29.89, 29.93, 29.72, 29.98, 30.02, 29.98]);
        let found = welch(a, b);
        assert!((found.t - 1.959).abs() < 1e-3 && (found.freedom - 7.03).abs() < 1e-2, "{found:?}");
        assert!((found.p - 0.0908).abs() < 1e-3, "{found:?}");
        assert_eq!(welch((1.0, 0.0, 3.0), (1.0, 0.0, 3.0)).p, 1.0);
        assert_eq!(welch((1.0, 0.0, 3.0), (2.0, 0.0, 3.0)).p, 0.0);
    }

    /// The jackknife's error of a mean is the usual standard error.
    #[test]
    fn jackknife_of_a_mean() {
        let values = [1.0, 4.0, 2.0, 8.0];
        let without: Vec<f64> =
            values.iter().map(|value| (values.iter().sum::<f64>() - value) / 3.0).collect();
        assert!((jackknife_error(&without) - mean_and_error(&values).1).abs() < 1e-12);
    }

    #[test]
    fn many_tests() {
        assert!((sidak(0.05, 1) - 0.05).abs() < 1e-12);
        assert!((sidak(1e-6, 1000) - 1e-3).abs() < 1e-6);
    }
}
