//! Mean of repeated measurements, with its standard error.

/// Returns the mean and its standard error: the standard deviation over the root of the number of
/// values. The error is infinite for fewer than two values.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let error = if values.len() < 2 { f64::INFINITY } else { (squares / (n - 1.0) / n).sqrt() };
    (mean, error)
}
