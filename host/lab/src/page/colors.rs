//! Colour maps of errors and differences, and their legends.

use super::escape;
use crate::plot::number;
use std::fmt::Write;
use trisect::image::magma;

/// Colour of a pixel without a finite value.
pub(crate) const NOT_FINITE: [u8; 3] = [255, 0, 255];

/// Colours of values from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ramp {
    /// Colours in even steps, with colours between them interpolated.
    Even(&'static [[u8; 3]]),
    /// Matplotlib's "magma" in 256 steps.
    Magma,
}

/// Colours of FLIP errors: the map of FLIP's authors.
pub(crate) const MAGMA: Ramp = Ramp::Magma;

/// Colours of errors, evenly spaced in lightness: matplotlib's "inferno" (N. Smith and S. van der
/// Walt, 2015; CC0), sampled at ninths.
pub(crate) const INFERNO: Ramp = Ramp::Even(&[
    [0, 0, 4],
    [27, 12, 65],
    [74, 12, 107],
    [120, 28, 109],
    [165, 44, 96],
    [207, 68, 70],
    [237, 105, 37],
    [251, 155, 6],
    [247, 209, 61],
    [252, 255, 164],
]);

/// Colours of signed differences, white in the middle: ColorBrewer's "RdBu" (C. Brewer, 2002;
/// Apache 2.0), from blue to red.
pub(crate) const DIVERGING: Ramp = Ramp::Even(&[
    [5, 48, 97],
    [33, 102, 172],
    [67, 147, 195],
    [146, 197, 222],
    [209, 229, 240],
    [247, 247, 247],
    [253, 219, 199],
    [244, 165, 130],
    [214, 96, 77],
    [178, 24, 43],
    [103, 0, 31],
]);

impl Ramp {
    /// Returns the colour of a value, which is clamped to 0 to 1; [`NOT_FINITE`] for NaN.
    pub fn color(self, value: f64) -> [u8; 3] {
        if value.is_nan() {
            return NOT_FINITE;
        }
        let value = value.clamp(0.0, 1.0);
        match self {
            Self::Magma => magma::color(value),
            Self::Even(colors) => {
                let last = colors.len() - 1;
                let place = value * last as f64;
                let below = (place.floor() as usize).min(last - 1);
                let share = place - below as f64;
                let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
                std::array::from_fn(|c| mix(colors[below][c], colors[below + 1][c]))
            }
        }
    }

    /// Returns a legend: a bar of the colours between what the ends stand for. `name` must be
    /// unique on the page.
    pub fn legend(self, name: &str, [low, high]: [f64; 2], unit: &str) -> String {
        let mut stops = String::new();
        for step in 0..=16 {
            let share = f64::from(step) / 16.0;
            let [r, g, b] = self.color(share);
            let _ = write!(stops, "<stop offset=\"{share}\" stop-color=\"rgb({r},{g},{b})\"/>");
        }
        let unit = escape(unit);
        let (low, high) = (number(low), number(high));
        format!(
            "<div class=\"scale\"><span>{low}</span><svg viewBox=\"0 0 100 10\" preserveAspectRatio=\"none\" \
             role=\"img\" aria-label=\"Colours from {low} to {high}{unit}\"><defs><linearGradient id=\"{name}\">\
             {stops}</linearGradient></defs><rect width=\"100\" height=\"10\" fill=\"url(#{name})\"/></svg>\
             <span>{high}{unit}</span></div>"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_of_errors() {
        assert_eq!((INFERNO.color(0.0), INFERNO.color(1.0)), ([0, 0, 4], [252, 255, 164]));
        assert_eq!(INFERNO.color(0.5), [186, 56, 83]);
        assert_eq!(MAGMA.color(0.5), [183, 55, 121]);
        assert_eq!(DIVERGING.color(0.5), [247; 3]);
        assert_eq!((MAGMA.color(f64::NAN), DIVERGING.color(f64::NAN)), (NOT_FINITE, NOT_FINITE));
        assert_eq!((MAGMA.color(-3.0), MAGMA.color(7.0)), (MAGMA.color(0.0), MAGMA.color(1.0)));
    }
}
