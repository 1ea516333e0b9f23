//! Tone maps of image files for a display: curves from radiance to the range that a display shows.

use super::Format;
use crate::{Image, ImageError};
use rayon::prelude::*;
use std::path::Path;

/// Curve from exposed radiance to light of a display, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Radiance above 1 is clipped.
    #[default]
    None,
    /// Hable's curve of "Uncharted 2" (Game Developers Conference, 2010), by channel, with white at
    /// 11.2 and an exposure bias of 2: contrast in the shadows, soft highlights.
    Filmic,
    /// Troy Sobotka's AgX (2022) without a look: bright colours lose their saturation, as film's.
    /// The sigmoid by which its tables are made, over 16.5 stops around middle grey.
    Agx,
    /// Fit by Stephen Hill of the Academy Color Encoding System's reference and output transforms
    /// for sRGB: strong contrast, bright colours bend towards white.
    Aces,
}

impl ToneMap {
    /// Tone maps with their names on the command line.
    pub const ALL: [(&'static str, Self); 4] =
        [("none", Self::None), ("filmic", Self::Filmic), ("agx", Self::Agx), ("aces", Self::Aces)];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, of)| *of == self).map_or("none", |(name, _)| name)
    }

    /// Checks that the format of an image is for a display.
    ///
    /// # Errors
    ///
    /// [`ImageError::NoDisplay`] for a format of linear radiance.
    pub fn check(self, path: &Path) -> Result<(), ImageError> {
        match self != Self::None && !Format::of(path)?.is_display() {
            true => Err(ImageError::NoDisplay { path: path.to_owned(), option: "tonemap" }),
            false => Ok(()),
        }
    }

    /// Maps an image, which is multiplied by `alpha` if that is given: colours are mapped as those
    /// of what covers the pixel.
    pub fn apply(self, image: &mut Image, alpha: Option<&[f32]>) {
        if self == Self::None {
            return;
        }
        image.pixels.par_iter_mut().enumerate().for_each(|(index, pixel)| {
            let alpha = alpha.and_then(|alpha| alpha.get(index)).copied().unwrap_or(1.0);
            // A filter may leave light where nothing covers the pixel.
            if alpha <= 0.0 {
                *pixel = [0.0; 3];
            } else {
                *pixel = self.color(pixel.map(|channel| channel / alpha)).map(|channel| channel * alpha);
            }
        });
    }

    /// Returns the light of a display, linear Rec. 709, for a radiance: from 0 to 1 by a curve. NaN
    /// stays NaN.
    pub fn color(self, radiance: [f32; 3]) -> [f32; 3] {
        // Unlike `min` and `max`, `clamp` keeps NaN.
        let bounded = radiance.map(|channel| channel.clamp(0.0, 1e6));
        match self {
            Self::None => radiance,
            Self::Filmic => bounded.map(|channel| (hable(2.0 * channel) / hable(11.2)).clamp(0.0, 1.0)),
            Self::Agx => agx(bounded),
            Self::Aces => aces(bounded),
        }
    }
}

/// Returns the product of a matrix, row by row, with a colour.
fn times(matrix: &[[f32; 3]; 3], color: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * color[0] + row[1] * color[1] + row[2] * color[2])
}

fn hable(x: f32) -> f32 {
    const SHOULDER: f32 = 0.15;
    const SLOPE: f32 = 0.5;
    const ANGLE: f32 = 0.1;
    const TOE: f32 = 0.2;
    const NUMERATOR: f32 = 0.02;
    const DENOMINATOR: f32 = 0.3;
    let above = x * (SHOULDER * x + ANGLE * SLOPE) + TOE * NUMERATOR;
    let below = x * (SHOULDER * x + SLOPE) + TOE * DENOMINATOR;
    above / below - NUMERATOR / DENOMINATOR
}

/// Rows of the matrix into AgX's primaries, which lie inside those of Rec. 709.
const AGX_INSET: [[f32; 3]; 3] =
    [[0.842_401, 0.078_436, 0.079_163], [0.042_401, 0.878_436, 0.079_163], [0.042_401, 0.078_436, 0.879_163]];
/// Rows of the inverse matrix.
const AGX_OUTSET: [[f32; 3]; 3] = [
    [1.196_999, -0.098_045, -0.098_954],
    [-0.053_001, 1.151_955, -0.098_954],
    [-0.053_001, -0.098_045, 1.151_046],
];
/// Stops below and above middle grey, 0.18.
const AGX_STOPS: (f32, f32) = (-10.0, 6.5);
/// Exponent of a display for which AgX's values are encoded.
const AGX_GAMMA: f32 = 2.2;

fn agx(color: [f32; 3]) -> [f32; 3] {
    let (low, high) = AGX_STOPS;
    let curve = |channel: f32| {
        let stops = (channel.clamp(1e-10, 1e30) / 0.18).log2();
        sigmoid(((stops - low) / (high - low)).clamp(0.0, 1.0))
    };
    times(&AGX_OUTSET, times(&AGX_INSET, color).map(curve))
        .map(|encoded| encoded.clamp(0.0, 1.0).powf(AGX_GAMMA))
}

/// AgX's sigmoid: middle grey becomes 0.5, with a slope of 2.
fn sigmoid(x: f32) -> f32 {
    const PIVOT: f32 = 20.0 / 33.0;
    let (scale, power) = if x < PIVOT { (59.507_88, 3.0) } else { (69.862_79, 3.25) };
    0.5 + 2.0 * (x - PIVOT) / (1.0 + scale * (x - PIVOT).abs().powf(power)).powf(1.0 / power)
}

/// Rows of the matrix to the working space of the reference transform.
const ACES_INPUT: [[f32; 3]; 3] =
    [[0.59719, 0.35458, 0.04823], [0.076, 0.90834, 0.01566], [0.0284, 0.13383, 0.83777]];
/// Rows of the matrix back to Rec. 709.
const ACES_OUTPUT: [[f32; 3]; 3] =
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];

fn aces(color: [f32; 3]) -> [f32; 3] {
    let curve =
        |x: f32| (x * (x + 0.024_578_6) - 0.000_090_537) / (x * (0.983_729 * x + 0.432_951) + 0.238_081);
    times(&ACES_OUTPUT, times(&ACES_INPUT, color).map(curve)).map(|channel| channel.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [ToneMap; 3] = [ToneMap::Filmic, ToneMap::Agx, ToneMap::Aces];

    /// Published values: Hable's curve at its white, AgX's middle grey and its white, and the fit
    /// of the Academy's transforms at middle grey, in f64.
    #[test]
    fn curves_have_their_published_values() {
        let grey = |of: ToneMap, x: f32| of.color([x; 3])[1];
        assert!((grey(ToneMap::Filmic, 5.6) - 1.0).abs() < 1e-6);
        assert!((grey(ToneMap::Agx, 0.18) - 0.5f32.powf(2.2)).abs() < 1e-4, "{}", grey(ToneMap::Agx, 0.18));
        assert!((grey(ToneMap::Agx, 0.18 * 6.5f32.exp2()) - 1.0).abs() < 0.02);
        let x = 0.18f64;
        let fit = (x * (x + 0.024_578_6) - 0.000_090_537) / (x * (0.983_729 * x + 0.432_951) + 0.238_081);
        assert!((f64::from(grey(ToneMap::Aces, 0.18)) - fit).abs() < 1e-3, "{fit}");
        assert_eq!(ToneMap::None.color([0.5, 7.0, -1.0]), [0.5, 7.0, -1.0]);
    }

    /// Each curve rises, keeps grey grey within its matrices' rounding, and stays within a display.
    #[test]
    fn curves_rise_within_the_display() {
        for of in CURVES {
            let mut before = -1.0;
            for step in -160..160 {
                let x = (f32::from(step as i16) / 8.0).exp2();
                let [red, green, blue] = of.color([x; 3]);
                assert!((0.0..=1.0).contains(&red) && green >= before, "{of:?} at {x}: {green}");
                assert!((red - green).abs() < 2e-3 && (blue - green).abs() < 2e-3, "{of:?} at {x}");
                before = green;
            }
            assert!(before > 0.98, "{of:?}: white is {before}");
            for extreme in [[0.0; 3], [f32::INFINITY; 3], [1e38, 0.0, 0.0], [-1.0, 0.5, f32::MIN]] {
                let color = of.color(extreme);
                assert!(color.iter().all(|channel| (0.0..=1.0).contains(channel)), "{of:?}: {color:?}");
            }
            assert!(of.color([f32::NAN, 0.5, 0.5])[0].is_nan(), "{of:?} hides NaN");
        }
    }

    /// A half covered pixel has half the light of its colour, mapped.
    #[test]
    fn colours_are_mapped_without_their_alpha() {
        for of in CURVES {
            let whole = of.color([2.0, 1.0, 0.5]);
            let mut image = Image { width: 2, height: 1, pixels: vec![[1.0, 0.5, 0.25], [0.2; 3]] };
            of.apply(&mut image, Some(&[0.5, 0.0]));
            assert_eq!(image.pixels, [whole.map(|channel| channel * 0.5), [0.0; 3]]);
        }
    }
}
