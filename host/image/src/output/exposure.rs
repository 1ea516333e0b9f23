//! Exposure of image files: the number of stops by which they are brighter than the rendered
//! radiance.
//!
//! A film always holds radiance; the exposure is applied when an image is written or shown.

use super::Format;
use crate::Image;
use glam::Vec3;
use std::fmt;
use std::ops::RangeInclusive;
use std::path::Path;
use trisect_shared::math::luminance;

/// Maximum exposure in stops, and its negative the minimum: 2^64 times a radiance of 1e18 is finite
/// in `f32`.
pub const MAX_STOPS: f32 = 64.0;

/// Median luminances that are shown unchanged under light of a known level: a sky of radiance 1
/// gives a surface its albedo.
const SHOWN_AS_IS: RangeInclusive<f32> = 1.0 / 16.0..=1.0;

/// Luminance to which a median far outside the range that is shown unchanged is brought: middle
/// grey, 46 % of the range of sRGB.
const MIDDLE_GREY: f32 = 0.18;

/// Factor beyond the range that is shown unchanged from which on a median is brought to middle
/// grey. In between, the shown luminance is interpolated geometrically from the range's end to
/// middle grey, so that the exposure has no step that noise could cross.
const TRANSITION: f32 = 8.0;

/// Background radiances of a model without a scene file: black, or the sky that the program adds.
const BACKGROUNDS: [[f32; 3]; 2] = [[0.0; 3], [1.0; 3]];

/// Choice of the exposure of an image file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Exposure from the median luminance, in files for a display; formats of linear radiance are
    /// unchanged.
    Automatic(LightLevel),
    /// Number of stops, in files of any format; each doubles the radiance.
    Stops(f32),
}

/// Level of the light of a scene whose exposure is automatic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightLevel {
    /// A white surface in the open has a radiance of about 1: dark images are of dark surfaces, and
    /// keep a median of 1/16 or more.
    #[default]
    Unit,
    /// Any other, such as that of daylight or of a panorama: a median below middle grey is brought
    /// to it.
    Other,
}

/// Exposure of one image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposed {
    /// Number of stops; each doubles the radiance.
    pub stops: f32,
    /// Origin of an automatic exposure, else `None`.
    pub automatic: Option<Automatic>,
}

/// Exposure from the median luminance of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Automatic {
    /// Number of stops: a multiple of 0.1, 0 for a median that is shown unchanged.
    pub stops: f32,
    /// Median luminance of the pixels that show more than a background; `None` if there are none.
    pub median: Option<f32>,
    /// True if all pixels are black.
    pub is_black: bool,
}

impl Exposure {
    /// Returns the exposure of `image` in a file at `path`.
    pub fn of(self, image: &Image, path: &Path) -> Exposed {
        match self {
            Self::Stops(stops) => Exposed { stops, automatic: None },
            Self::Automatic(level) if Format::of(path).is_ok_and(Format::is_display) => {
                let automatic = Automatic::of(image, level);
                Exposed { stops: automatic.stops, automatic: Some(automatic) }
            }
            Self::Automatic(_) => Exposed { stops: 0.0, automatic: None },
        }
    }

    /// Returns whether the exposure leaves every image unchanged.
    pub fn is_none(self) -> bool {
        self == Self::Stops(0.0)
    }
}

impl LightLevel {
    /// Returns the median luminances that are shown unchanged.
    fn shown_as_is(self) -> RangeInclusive<f32> {
        match self {
            Self::Unit => SHOWN_AS_IS,
            Self::Other => MIDDLE_GREY..=*SHOWN_AS_IS.end(),
        }
    }
}

impl Exposed {
    /// Multiplies an image by 2 to the power of the stops.
    pub fn apply(&self, image: &mut Image) {
        if self.stops != 0.0 {
            let factor = self.stops.exp2();
            image.pixels.iter_mut().flatten().for_each(|channel| *channel *= factor);
        }
    }
}

impl Automatic {
    /// Returns the exposure for an image of a model without a scene file, under light of a level.
    /// It does not depend on the order of the pixels.
    pub fn of(image: &Image, level: LightLevel) -> Self {
        let shows = |pixel: &&[f32; 3]| {
            pixel.iter().all(|channel| channel.is_finite()) && !BACKGROUNDS.contains(pixel)
        };
        let mut values: Vec<f32> =
            image.pixels.iter().filter(shows).map(|&pixel| luminance(Vec3::from(pixel))).collect();
        values.retain(|value| *value > 0.0 && value.is_finite());
        let is_black = image.pixels.iter().all(|pixel| *pixel == [0.0; 3]);
        if values.is_empty() {
            return Self { stops: 0.0, median: None, is_black };
        }
        let middle = values.len() / 2;
        let median = *values.select_nth_unstable_by(middle, f32::total_cmp).1;
        let stops = (shown(median, level.shown_as_is()) / median).log2();
        // Rounded as it is printed, so that `--exposure` with that number gives the same image.
        let stops = (stops.clamp(-MAX_STOPS, MAX_STOPS) * 10.0).round() / 10.0;
        Self { stops, median: Some(median), is_black }
    }
}

/// Returns the luminance to which a median is exposed; those in `as_is` are shown unchanged.
fn shown(median: f32, as_is: RangeInclusive<f32>) -> f32 {
    let end = median.clamp(*as_is.start(), *as_is.end());
    // 0 within the range, 1 beyond the transition.
    let share = ((median / end).log2().abs() / TRANSITION.log2()).min(1.0);
    if share == 0.0 { median } else { end * (MIDDLE_GREY / end).powf(share) }
}

impl fmt::Display for Automatic {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        match self.median {
            Some(median) if self.stops == 0.0 => {
                write!(formatter, "exposure 0 EV (the median luminance, {median:.2}, needs none)")
            }
            Some(_) => write!(
                formatter,
                "exposure {:.1} EV (from the median luminance; `exposure` 0 for none)",
                self.stops
            ),
            None if self.is_black => formatter.write_str(
                "exposure 0 EV (the image is black: no light reaches what is seen; add lights or a sky in a scene file; \
                 `precision::write` makes one of a model)",
            ),
            None => formatter.write_str("exposure 0 EV (nothing but background is seen)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> Image {
        Image {
            width: values.len() as u32,
            height: 1,
            pixels: values.iter().map(|&value| [value; 3]).collect(),
        }
    }

    #[test]
    fn a_median_beyond_a_display_becomes_middle_grey() {
        for (median, stops) in [(20_000.0, -16.8), (0.18e-3, 10.0), (8.1, -5.5), (1.0 / 130.0, 4.5)] {
            let mut image = grey(&[0.0, 0.5 * median, median, 3.0 * median, 1.0, 1.0, 0.0, f32::NAN]);
            let found = Automatic::of(&image, LightLevel::Unit);
            assert!((found.stops - stops).abs() < 1e-5, "{median}: {found:?}");
            assert!(found.to_string().contains("from the median luminance"), "{found}");
            let exposed = Exposure::Automatic(LightLevel::Unit).of(&image, Path::new("a.png"));
            exposed.apply(&mut image);
            assert!((image.pixels[2][0] / MIDDLE_GREY).log2().abs() < 0.051, "{image:?}");
        }
        // Background pixels do not count; with them the medians would be 0 and 1.
        assert_eq!(Automatic::of(&grey(&[0.0, 0.0, 0.0, 1e5]), LightLevel::Unit).stops, -19.1);
        assert_eq!(Automatic::of(&grey(&[1.0, 1.0, 1.0, 1e5]), LightLevel::Unit).stops, -19.1);
    }

    /// Checks that a change of the median by a few percent, as by noise, changes the exposure by at
    /// most two tenths of a stop.
    #[test]
    fn exposure_has_no_steps() {
        for level in [LightLevel::Unit, LightLevel::Other] {
            let of = |median: f32| Automatic::of(&grey(&[median]), level).stops;
            let mut median = 1e-4;
            while median < 1e4 {
                assert!((of(median * 1.02) - of(median)).abs() < 0.21, "{level:?}: {median}");
                median *= 1.02;
            }
            // Negative control: without the transition, the exposure would jump by more than two
            // stops.
            assert!((MIDDLE_GREY / 1.01).log2() < -2.0 && of(1.01).abs() < 0.11);
        }
    }

    /// Under light of another level a dark image says nothing about its surfaces.
    #[test]
    fn dark_images_of_another_light_become_middle_grey() {
        for (median, stops) in [(0.08, 1.2), (0.01, 4.2), (0.179, 0.0), (0.5, 0.0), (8.1, -5.5)] {
            let found = Automatic::of(&grey(&[median]), LightLevel::Other);
            assert!((found.stops - stops).abs() < 1e-5, "{median}: {found:?}");
        }
        assert_eq!(Automatic::of(&grey(&[0.08]), LightLevel::Unit).stops, 0.0);
    }

    #[test]
    fn black_is_said() {
        let said = |values: &[f32]| Automatic::of(&grey(values), LightLevel::Unit).to_string();
        assert!(said(&[0.0, 0.0]).contains("the image is black"));
        assert!(said(&[0.0, 1.0]).contains("nothing but background"));
    }

    #[test]
    fn an_image_for_a_display_stays_as_it_is() {
        for values in [&[0.07f32, 0.2][..], &[0.9, 0.99], &[0.0, 1.0], &[], &[f32::NAN], &[f32::INFINITY]] {
            let found = Automatic::of(&grey(values), LightLevel::Unit);
            assert_eq!(found.stops, 0.0, "{values:?}");
            assert!(found.to_string().starts_with("exposure 0 EV"), "{found}");
        }
        assert!(Automatic::of(&grey(&[1e30]), LightLevel::Unit).stops >= -MAX_STOPS);
    }

    #[test]
    fn linear_formats_change_by_a_number_only() {
        let image = grey(&[8.0, 9.0]);
        for name in ["a.exr", "a.hdr", "a.pfm"] {
            assert_eq!(Exposure::Automatic(LightLevel::Unit).of(&image, Path::new(name)).stops, 0.0);
            let exposed = Exposure::Stops(-2.0).of(&image, Path::new(name));
            let mut darker = image.clone();
            exposed.apply(&mut darker);
            assert_eq!(darker, grey(&[2.0, 2.25]));
        }
        assert!(Exposure::Stops(0.0).is_none() && !Exposure::Automatic(LightLevel::Other).is_none());
    }
}
