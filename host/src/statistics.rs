//! Intervals and tests for what few repetitions show.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// What intervals cover, unless something else is said.
pub const CONFIDENCE: f64 = 0.95;

/// An estimate and the interval that covers the truth in [`CONFIDENCE`] of all cases.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// Where the interval begins.
    pub low: f64,
    /// Where it ends.
    pub high: f64,
}

impl Interval {
    /// Of an estimate with its standard error and degrees of freedom, by Student's distribution.
    pub fn of(value: f64, error: f64, freedom: f64) -> Self {
        let half = quantile(CONFIDENCE, freedom) * error;
        Self { value, low: value - half, high: value + half }
    }

    /// Of the mean of values that are drawn alike. With one it is as wide as can be.
    pub fn of_mean(values: &[f64]) -> Self {
        let (mean, error) = mean_and_error(values);
        Self::of(mean, error, values.len() as f64 - 1.0)
    }

    /// The same of another measure: `map` must be monotonic.
    pub fn map(self, map: impl Fn(f64) -> f64) -> Self {
        let (a, b) = (map(self.low), map(self.high));
        Self { value: map(self.value), low: a.min(b), high: a.max(b) }
    }

    /// Whether a value is in it.
    pub fn covers(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Half the width, in standard errors, of what covers `confidence` of Student's distribution; infinite without degrees of freedom.
pub fn quantile(confidence: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(distribution) if freedom.is_finite() => distribution.inverse_cdf(0.5 + 0.5 * confidence),
        // More than a million degrees are as good as all.
        _ if freedom.is_infinite() => quantile(confidence, 1e6),
        _ => f64::INFINITY,
    }
}

/// The mean, and its standard error: the deviation over the root of the number. Infinite for fewer than two values.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let error = if values.len() < 2 { f64::INFINITY } else { (squares / (n - 1.0) / n).sqrt() };
    (mean, error)
}

/// The standard error of an estimate from `n` repetitions, by what it is without each of them (Tukey's jackknife).
pub fn jackknife_error(without: &[f64]) -> f64 {
    let n = without.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
    if without.len() < 2 { f64::INFINITY } else { ((n - 1.0) / n * squares).sqrt() }
}

/// What Welch's test found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Welch {
    /// Difference of the means over its standard error.
    pub t: f64,
    /// Degrees of freedom (Welch and Satterthwaite).
    pub freedom: f64,
    /// The chance of a difference as great, if both means are the same.
    pub p: f64,
}

/// Whether two means differ, each with its standard error and degrees of freedom (Welch, "The Generalization of Student's Problem when Several
/// Different Population Variances are Involved", Biometrika 34, 1947). Where neither has any error, means that are equal are the same, and others are not.
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

/// The chance of a value as far from 0, by Student's distribution.
fn two_sided(t: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom.clamp(1e-3, 1e6)) {
        Ok(distribution) => 2.0 * distribution.cdf(-t.abs()),
        Err(_) => 1.0,
    }
}

/// The chance of the least of `count` independent p being as small (Šidák, 1967).
pub fn sidak(least: f64, count: usize) -> f64 {
    // 1 - (1 - p)^n without the loss of digits.
    -f64::exp_m1(count as f64 * f64::ln_1p(-least.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Student's table: 12.706 for one degree, 2.365 for seven, 1.960 for all.
    #[test]
    fn the_table() {
        for (freedom, want) in [(1.0, 12.706), (7.0, 2.365), (f64::INFINITY, 1.960)] {
            assert!((quantile(0.95, freedom) - want).abs() < 1e-3);
        }
        assert_eq!(quantile(0.95, 0.0), f64::INFINITY);
        let interval = Interval::of_mean(&[1.0, 2.0, 3.0]);
        // t of two degrees is 4.303, the error 1/sqrt(3).
        assert!((interval.high - (2.0 + 4.303 / 3f64.sqrt())).abs() < 1e-3 && interval.covers(2.0));
        assert!(Interval::of_mean(&[1.0]).covers(1e300));
    }

    /// R: t.test(c(30.02, 29.99, 30.11, 29.97, 30.01, 29.99), c(29.89, 29.93, 29.72, 29.98, 30.02, 29.98)): t = 1.959, df = 7.03, p = 0.0908.
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

    /// Of a mean, the jackknife's error is the usual one.
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
