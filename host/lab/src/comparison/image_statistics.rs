//! Statistics of one image.

use trisect::image::Image;

/// Statistics of a channel. Minimum, mean and maximum are of the finite values, and NaN without
/// any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChannelStatistics {
    pub min: f64,
    pub mean: f64,
    pub max: f64,
    /// Number of values below 0, and above 1; infinite ones do not count.
    pub negative: usize,
    pub above_one: usize,
    pub nan: usize,
    pub infinite: usize,
}

/// Statistics of the channels of an image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ImageStatistics {
    /// Red, green and blue.
    pub channels: [ChannelStatistics; 3],
}

impl ImageStatistics {
    pub fn of(image: &Image) -> Self {
        Self { channels: [0, 1, 2].map(|c| ChannelStatistics::of(image.pixels.iter().map(|p| p[c]))) }
    }
}

impl ChannelStatistics {
    fn of(values: impl Iterator<Item = f32>) -> Self {
        let (mut min, mut max, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0usize);
        let (mut negative, mut above_one, mut nan, mut infinite) = (0, 0, 0, 0);
        for value in values {
            match value {
                value if value.is_nan() => nan += 1,
                value if value.is_infinite() => infinite += 1,
                value => {
                    let value = f64::from(value);
                    (min, max, sum, count) = (min.min(value), max.max(value), sum + value, count + 1);
                    negative += usize::from(value < 0.0);
                    above_one += usize::from(value > 1.0);
                }
            }
        }
        if count == 0 {
            (min, max) = (f64::NAN, f64::NAN);
        }
        Self { min, mean: sum / count as f64, max, negative, above_one, nan, infinite }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_counted_apart() {
        let values = [0.5, -1.0, 3.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        let found = ChannelStatistics::of(values.into_iter());
        assert_eq!((found.min, found.max), (-1.0, 3.0));
        assert!((found.mean - 2.5 / 3.0).abs() < 1e-12);
        assert_eq!((found.negative, found.above_one, found.nan, found.infinite), (1, 1, 1, 2));
        let none = ChannelStatistics::of([f32::NAN].into_iter());
        assert!(none.min.is_nan() && none.mean.is_nan() && none.max.is_nan() && none.nan == 1);
    }
}
