//! Times as people write them: a number with a unit, or seconds without one.

use std::time::Duration;

/// Units with their seconds; the first that ends the text counts.
const UNITS: [(&str, f64); 6] =
    [("ms", 1e-3), ("min", 60.0), ("s", 1.0), ("m", 60.0), ("h", 3600.0), ("", 1.0)];

/// Returns the seconds of a time such as `1.5`, `2s`, `500ms`, `5m` or `2h`; `None` for other text.
pub fn seconds(text: &str) -> Option<f64> {
    let text = text.trim();
    let (number, unit) = UNITS.into_iter().find_map(|(unit, of)| Some((text.strip_suffix(unit)?, of)))?;
    let number: f64 = number.trim().parse().ok()?;
    Some(number * unit).filter(|seconds| seconds.is_finite())
}

/// Parses a time of at least 0.
///
/// # Errors
///
/// The form that is expected, for other text.
pub fn parse_time(text: &str) -> Result<Duration, String> {
    let time = seconds(text).and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| "write it as 5 or 5s for seconds, 500ms, 1.5m or 2h".to_owned())
}

/// Parses a time above 0.
///
/// # Errors
///
/// The form that is expected, for other text and for 0.
pub fn parse_positive_time(text: &str) -> Result<Duration, String> {
    let time = parse_time(text)?;
    if time > Duration::ZERO { Ok(time) } else { Err("must be above 0".to_owned()) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn times_have_units_or_are_seconds() {
        for (text, want) in [
            ("5", 5000),
            ("5s", 5000),
            ("1.5 m", 90_000),
            ("2min", 120_000),
            ("2h", 7_200_000),
            ("500ms", 500),
            (" .5 ", 500),
            ("0", 0),
        ] {
            assert_eq!(parse_time(text), Ok(Duration::from_millis(want)), "{text}");
        }
        for bad in ["", "-1s", "-1", "s", "nan", "nans", "infs", "1e99h", "5x", "5 5", "1h30m", "256spp"] {
            let said = parse_time(bad).unwrap_err();
            assert!(said.contains("5s for seconds"), "{bad}: {said}");
        }
        assert_eq!(seconds("-1.5"), Some(-1.5));
        assert!(parse_positive_time("0s").is_err() && parse_positive_time("1ms").is_ok());
    }
}
