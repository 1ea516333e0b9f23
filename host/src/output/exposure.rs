//! Exposure of image files: by how many stops they are brighter than the radiance that was
//! rendered.
//!
//! A film holds radiance, whatever the exposure: it is a matter of writing alone.

use super::Format;
use crate::image::Image;
use glam::Vec3;
use std::fmt;
use std::path::Path;
use trisect_shared::math::luminance;

/// Greatest exposure, and least when negative, in stops: 2^64 times radiance of 1e18 is finite in
/// `f32`.
pub const MAX_STOPS: f32 = 64.0;

/// Median luminances that are shown as they are: a sky of radiance 1 gives a surface its albedo.
const SHOWN_AS_IS: std::ops::RangeInclusive<f32> = 1.0 / 16.0..=1.0;

/// Luminance that a median far from those is brought to: middle grey, 46 % of the range of sRGB.
const MIDDLE_GREY: f32 = 0.18;

/// How far beyond [`SHOWN_AS_IS`] a median is brought to middle grey, as a factor. In between, the
/// luminance that is shown goes from the range's end to middle grey by powers, so that the exposure
/// has no step for noise to cross.
const TRANSITION: f32 = 8.0;

/// Radiance of the background of a model by itself: black, or the sky that it is given.
const BACKGROUNDS: [[f32; 3]; 2] = [[0.0; 3], [1.0; 3]];

/// Choice of the exposure of an image file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// By the median luminance of a model, in files that a display shows as they are (PNG); formats
    /// of linear radiance keep it.
    Automatic,
    /// By a number of stops, in files of any format: each stop doubles the light.
    Stops(f32),
}

/// The exposure of one image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposed {
    /// Each of them doubles the light.
    pub stops: f32,
    /// How they were found, if they were.
    pub automatic: Option<Automatic>,
}

/// An exposure by the median luminance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Automatic {
    /// A multiple of 0.1, 0 for a median between 1/16 and 1.
    pub stops: f32,
    /// Median luminance of the pixels that show more than a background; `None` if there are none.
    pub median: Option<f32>,
    /// True if all pixels are black.
    pub is_black: bool,
}

impl Exposure {
    /// Returns the exposure for a file with this image.
    pub fn of(self, image: &Image, path: &Path) -> Exposed {
        match self {
            Self::Stops(stops) => Exposed { stops, automatic: None },
            Self::Automatic if matches!(Format::of(path), Ok(Format::Png)) => {
                let automatic = Automatic::of(image);
                Exposed { stops: automatic.stops, automatic: Some(automatic) }
            }
            Self::Automatic => Exposed { stops: 0.0, automatic: None },
        }
    }

    /// Returns whether it leaves every image as it is.
    pub fn is_none(self) -> bool {
        self == Self::Stops(0.0)
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
    /// Returns the exposure for an image of a model by itself: the same for the same pixels, in any
    /// order.
    pub fn of(image: &Image) -> Self {
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
        let stops = (shown(median) / median).log2();
        // What is printed gives the same image as `--exposure`.
        let stops = (stops.clamp(-MAX_STOPS, MAX_STOPS) * 10.0).round() / 10.0;
        Self { stops, median: Some(median), is_black }
    }
}

/// Returns the luminance that a median is shown with.
fn shown(median: f32) -> f32 {
    let end = median.clamp(*SHOWN_AS_IS.start(), *SHOWN_AS_IS.end());
    // 0 at the end of the range, 1 from the transition's other end on.
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
                "exposure {:.1} EV (from the median luminance; --exposure 0 for none)",
                self.stops
            ),
            None if self.is_black => formatter.write_str(
                "exposure 0 EV (the image is black: no light reaches what is seen; add lights or a sky in a scene file: \
                 trisect check MODEL --write SCENE.ron)",
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
            let found = Automatic::of(&image);
            assert!((found.stops - stops).abs() < 1e-5, "{median}: {found:?}");
            assert!(found.to_string().contains("from the median luminance"), "{found}");
            let exposed = Exposure::Automatic.of(&image, Path::new("a.png"));
            exposed.apply(&mut image);
            assert!((image.pixels[2][0] / MIDDLE_GREY).log2().abs() < 0.051, "{image:?}");
        }
        // Backgrounds are no part of the model: with them the first would be black, the second as
        // it should be.
        assert_eq!(Automatic::of(&grey(&[0.0, 0.0, 0.0, 1e5])).stops, -19.1);
        assert_eq!(Automatic::of(&grey(&[1.0, 1.0, 1.0, 1e5])).stops, -19.1);
    }

    /// Noise moves a median by some percent, and the exposure by a tenth of a stop or two.
    #[test]
    fn exposure_has_no_steps() {
        let of = |median: f32| Automatic::of(&grey(&[median])).stops;
        let mut median = 1e-4;
        while median < 1e4 {
            assert!((of(median * 1.02) - of(median)).abs() < 0.21, "{median}");
            median *= 1.02;
        }
        // Negative control: all beyond the range to middle grey.
        assert!((MIDDLE_GREY / 1.01).log2() < -2.0 && of(1.01).abs() < 0.11);
    }

    #[test]
    fn black_is_said() {
        let said = |values: &[f32]| Automatic::of(&grey(values)).to_string();
        assert!(said(&[0.0, 0.0]).contains("the image is black"));
        assert!(said(&[0.0, 1.0]).contains("nothing but background"));
    }

    #[test]
    fn an_image_for_a_display_stays_as_it_is() {
        for values in [&[0.07f32, 0.2][..], &[0.9, 0.99], &[0.0, 1.0], &[], &[f32::NAN], &[f32::INFINITY]] {
            let found = Automatic::of(&grey(values));
            assert_eq!(found.stops, 0.0, "{values:?}");
            assert!(found.to_string().starts_with("exposure 0 EV"), "{found}");
        }
        assert!(Automatic::of(&grey(&[1e30])).stops >= -MAX_STOPS);
    }

    #[test]
    fn linear_formats_change_by_a_number_only() {
        let image = grey(&[8.0, 9.0]);
        for name in ["a.exr", "a.hdr", "a.pfm"] {
            assert_eq!(Exposure::Automatic.of(&image, Path::new(name)).stops, 0.0);
            let exposed = Exposure::Stops(-2.0).of(&image, Path::new(name));
            let mut darker = image.clone();
            exposed.apply(&mut darker);
            assert_eq!(darker, grey(&[2.0, 2.25]));
        }
        assert!(Exposure::Stops(0.0).is_none() && !Exposure::Automatic.is_none());
    }
}
