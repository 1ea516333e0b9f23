//! Errors in units in the last place (ULP) of an f32.

/// Returns the distance between the f32 numbers around `x`: 2⁻¹⁴⁹ below the smallest normal number.
pub fn ulp(x: f64) -> f64 {
    let x = x.abs();
    if x < f64::from(f32::MIN_POSITIVE) {
        return 2f64.powi(-149);
    }
    let exponent = ((x.to_bits() >> 52) as i32 - 1023).min(127);
    2f64.powi(exponent - 23)
}

/// Returns the error of `got` in ULP: at most 0.5 where it is correctly rounded; 0 for the right
/// infinity or NaN; infinite for any other pair of which one is not finite.
pub fn error(got: f32, want: f64) -> f64 {
    let rounded = want as f32;
    if got.to_bits() == rounded.to_bits() || got.is_nan() && rounded.is_nan() || got == rounded {
        return if rounded.is_finite() { (f64::from(got) - want).abs() / ulp(want) } else { 0.0 };
    }
    if got.is_finite() && rounded.is_finite() {
        (f64::from(got) - want).abs() / ulp(want)
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units() {
        assert_eq!(ulp(1.0), f64::from(f32::EPSILON));
        assert_eq!(ulp(1.5), ulp(1.0));
        assert_eq!(ulp(0.75), ulp(1.0) / 2.0);
        assert_eq!(ulp(1e-40), 2f64.powi(-149));
        assert_eq!(error(1.0, 1.0), 0.0);
        assert_eq!(error(1.0f32.next_up(), 1.0), 1.0);
        assert_eq!(error(f32::NAN, f64::NAN), 0.0);
        assert_eq!(error(f32::NAN, 1.0), f64::INFINITY);
        assert_eq!(error(f32::INFINITY, 1e39), 0.0);
    }
}
