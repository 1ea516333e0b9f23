//! Ticks of axes, and formatting of numbers.

use super::chart::Scale;

/// Extent of an axis and the places of its ticks, both mapped: logarithms for [`Scale::Log`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ticks {
    pub low: f64,
    pub high: f64,
    pub places: Vec<f64>,
}

impl Scale {
    /// Returns the place of a value on the axis.
    pub(crate) fn map(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => value.log10(),
        }
    }

    /// Returns whether a value has a place on the axis.
    pub(crate) fn shows(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }

    /// Returns the ticks of an axis for the values that it can show; without any, of an axis from 0
    /// (or 1) on.
    pub(crate) fn ticks(self, values: impl Iterator<Item = f64>) -> Ticks {
        let shown: Vec<f64> =
            values.filter(|&value| self.shows(value)).map(|value| self.map(value)).collect();
        let least = shown.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = shown.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (least, greatest) = if shown.is_empty() { (0.0, 1.0) } else { (least, greatest) };
        match self {
            Self::Linear => linear(least.min(0.0), greatest.max(0.0)),
            Self::Log => decades(least, greatest),
        }
    }

    /// Returns the label of the tick at a place.
    pub(crate) fn label(self, place: f64) -> String {
        match self {
            Self::Linear => number(place),
            Self::Log => power(place),
        }
    }
}

/// Returns about six ticks, with steps of 1, 2 or 5 times a power of ten.
fn linear(low: f64, high: f64) -> Ticks {
    let span = if high > low { high - low } else { 1.0 };
    let rough = span / 6.0;
    let unit = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * unit).into_iter().find(|&step| step >= rough);
    let step = step.unwrap_or(10.0 * unit);
    let (first, last) = ((low / step).floor() as i64, ((low + span) / step).ceil() as i64);
    let places: Vec<f64> = (first..=last).map(|index| index as f64 * step).collect();
    Ticks { low: first as f64 * step, high: last as f64 * step, places }
}

/// Returns ticks at whole decades; also at twice and five times each where there are few.
fn decades(least: f64, greatest: f64) -> Ticks {
    // The logarithm of a power of ten may be an ulp off.
    let first = (least + 1e-9).floor() as i32;
    let last = ((greatest - 1e-9).ceil() as i32).max(first + 1);
    let mut places: Vec<f64> = (first..=last).map(f64::from).collect();
    if last - first <= 2 {
        let between =
            (first..last).flat_map(|decade| [2f64, 5.0].map(|factor| f64::from(decade) + factor.log10()));
        places.extend(between);
        places.sort_by(f64::total_cmp);
    }
    Ticks { low: f64::from(first), high: f64::from(last), places }
}

/// Formats a number with up to four significant digits, without an exponent if it needs at most
/// seven places.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e7).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = (3 - size.log10().floor() as i32).clamp(0, 7) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Formats 10 to the power of `place`: as a power from 10⁴ on if the exponent is an integer.
fn power(place: f64) -> String {
    let whole = place.round();
    if (place - whole).abs() < 1e-9 && (4.0..100.0).contains(&whole) {
        let superscripts = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
        let digits = (whole as usize).to_string();
        let digits = digits.bytes().filter_map(|digit| superscripts.get(usize::from(digit - b'0')));
        return format!("10{}", digits.collect::<String>());
    }
    number(10f64.powf(place))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, values: &[f64]) -> Vec<String> {
        scale.ticks(values.iter().copied()).places.into_iter().map(|place| scale.label(place)).collect()
    }

    #[test]
    fn marks_of_both_scales() {
        assert_eq!(labels(Scale::Linear, &[12.0, 480.0]), ["0", "100", "200", "300", "400", "500"]);
        assert_eq!(labels(Scale::Linear, &[0.0021, 0.013]), ["0", "0.005", "0.01", "0.015"]);
        assert_eq!(labels(Scale::Log, &[10.0, 1e6]), ["10", "100", "1000", "10⁴", "10⁵", "10⁶"]);
        assert_eq!(labels(Scale::Log, &[0.7, 3.0]), ["0.1", "0.2", "0.5", "1", "2", "5", "10"]);
    }

    /// Any values, even none, have an axis that contains them.
    #[test]
    fn any_values() {
        let sets: [&[f64]; 6] =
            [&[], &[0.0], &[5.0], &[-3.0, 1e-12], &[f64::NAN, 1e300], &[f64::INFINITY, 1e-300, 2e-300]];
        for scale in [Scale::Linear, Scale::Log] {
            for values in sets {
                let Ticks { low, high, places } = scale.ticks(values.iter().copied());
                assert!(low < high && (2..=700).contains(&places.len()), "{values:?}: {low} to {high}");
                for &value in values.iter().filter(|&&value| scale.shows(value)) {
                    let place = scale.map(value);
                    assert!(low <= place + 1e-9 && place - 1e-9 <= high, "{values:?}: {low} to {high}");
                }
            }
        }
    }

    #[test]
    fn numbers() {
        let pairs = [
            (0.0, "0"),
            (1.0, "1"),
            (0.12345, "0.1235"),
            (1234.5, "1234"),
            (-2.5, "-2.5"),
            (3e-7, "3.00e-7"),
        ];
        for (value, text) in pairs {
            assert_eq!(number(value), text);
        }
    }
}
