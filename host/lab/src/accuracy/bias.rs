//! Names a bias in words that agree with the figures printed beside them.

use super::errors::Errors;
use std::fmt;

/// Bias that the repetitions show, at the three decimals of a percentage that are printed.
///
/// A bias has a size only if the interval of that size does not contain 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bias {
    /// No bias beyond chance.
    NotSeen,
    /// A significant bias that is smaller than the printed decimals.
    Tiny,
    /// Parts of the image differ by more than chance, but the intervals of the squared bias and of
    /// the brightness contain 0: the size of the bias, if there is one, is unknown.
    Suspected,
    /// A bias of this relative root mean square.
    Size(f64),
    /// A bias of the image's mean by this share. Its relative root mean square is smaller than the
    /// printed decimals, or its interval contains 0.
    Brightness(f64),
}

/// Percentages below this are printed as 0.000.
const MIN_PERCENT: f64 = 0.0005;

impl Bias {
    /// Returns whether the bias is known well enough, and is large enough, to be called one.
    pub fn is_seen(self) -> bool {
        matches!(self, Self::Size(_) | Self::Brightness(_))
    }
}

impl fmt::Display for Bias {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotSeen => to.write_str("no bias seen"),
            Self::Tiny => to.write_str("bias below 0.001 %"),
            Self::Suspected => to.write_str("a bias of parts of the image is suspected"),
            Self::Size(size) => write!(to, "bias {:.3} %", 100.0 * size),
            Self::Brightness(share) => write!(to, "bias {:+.3} % of the brightness", 100.0 * share),
        }
    }
}

impl Errors {
    /// Returns the bias that was seen.
    pub(crate) fn bias(&self) -> Bias {
        let size = self.squared_bias.value.max(0.0).sqrt();
        let shows = |share: f64| 100.0 * share.abs() >= MIN_PERCENT;
        let brightness = self.brightness;
        match self.is_significant() {
            false => Bias::NotSeen,
            true if self.squared_bias.low > 0.0 && shows(size) => Bias::Size(size),
            true if !brightness.covers(0.0) && shows(brightness.value) => Bias::Brightness(brightness.value),
            true if shows(size) || shows(brightness.value) => Bias::Suspected,
            true => Bias::Tiny,
        }
    }
}
