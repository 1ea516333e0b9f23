//! HDR-FLIP: the difference seen at the exposure at which it is largest.
//!
//! Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors in Rendered High Dynamic
//! Range Images", Eurographics 2021, short papers. Both images are exposed and tone mapped, from
//! the exposure that shows the brightest pixel of the reference to the one that shows the median
//! one. The error of a pixel is the maximum of LDR-FLIP over the exposures.

use super::flip::{FlipMap, FlipReference};
use super::{ImageView, MetricsError, check_pair};
use rayon::prelude::*;

/// Coefficients of the tone map, Narkowicz' fit of the ACES curve with an exposure of 0.6: (a x² +
/// b x) / (c x² + d x + e).
const ACES: [f32; 5] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

/// Tone-mapped value to which exposures bring the brightest and the median luminance.
const SHOWN: f64 = 0.85;

/// Minimum luminance for which an exposure is computed: the images may be black.
const MIN_LUMINANCE: f32 = f32::EPSILON;

/// Minimum number of exposures.
const MIN_EXPOSURES: u32 = 2;

/// Computes HDR-FLIP of linear images for a viewer at `pixels_per_degree`, each against the
/// reference. Values below 0 count as 0. Pixels that are not finite are treated as
/// [`flip_at`](super::flip::flip_at) does.
///
/// # Errors
///
/// Errors of [`flip_at`](super::flip::flip_at).
pub fn hdr_flip(
    images: &[ImageView],
    reference: &ImageView,
    pixels_per_degree: f32,
) -> Result<Vec<FlipMap>, MetricsError> {
    reference.check()?;
    images.iter().try_for_each(|image| check_pair(image, reference))?;
    let (width, height) = (reference.width, reference.height);
    let mut maps: Vec<Vec<f32>> = images.iter().map(|_| vec![0.0; width * height]).collect();
    for stops in exposures(reference) {
        let pixels = mapped(reference, stops);
        let shown = ImageView { width, height, pixels: &pixels };
        let prepared = FlipReference::new(&shown, pixels_per_degree)?;
        for (image, errors) in images.iter().zip(&mut maps) {
            let pixels = mapped(image, stops);
            let found = prepared.flip(&ImageView { width, height, pixels: &pixels })?;
            errors.iter_mut().zip(found.errors).for_each(|(error, found)| *error = error.max(found));
        }
    }
    let map = |errors: Vec<f32>| {
        let mean = errors.iter().map(|&error| f64::from(error)).sum::<f64>() / errors.len() as f64;
        FlipMap { width, height, errors, mean }
    };
    Ok(maps.into_iter().map(map).collect())
}

/// Returns the exposures in stops, ascending.
fn exposures(reference: &ImageView) -> Vec<f32> {
    let finite = reference.pixels.iter().filter(|pixel| pixel.iter().all(|value| value.is_finite()));
    let mut luminances: Vec<f32> = finite
        .map(|pixel| {
            let [r, g, b] = pixel.map(non_negative);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        })
        .collect();
    luminances.sort_by(f32::total_cmp);
    let at = |place: usize| luminances.get(place).copied().unwrap_or_default().max(MIN_LUMINANCE);
    let shown = shown_value();
    let [start, end] = [at(luminances.len().saturating_sub(1)), at(luminances.len() / 2)]
        .map(|luminance| (shown / f64::from(luminance)).log2());
    let count = ((end - start).ceil() as u32).max(MIN_EXPOSURES);
    let step = (end - start) / f64::from(count - 1);
    (0..count).map(|index| (start + f64::from(index) * step) as f32).collect()
}

/// Returns the value that the tone map brings to [`SHOWN`].
fn shown_value() -> f64 {
    let [a, b, c, d, e] = ACES.map(f64::from);
    // (a − s c) x² + (b − s d) x − s e = 0.
    let half = -0.5 * (b - SHOWN * d) / (a - SHOWN * c);
    half + (half * half + SHOWN * e / (a - SHOWN * c)).sqrt()
}

/// Returns the pixels with an exposure in stops, tone mapped and clamped to 0 to 1. NaN and
/// infinity become NaN.
fn mapped(view: &ImageView, stops: f32) -> Vec<[f32; 3]> {
    let factor = stops.exp2();
    let [a, b, c, d, e] = ACES;
    let value = |value: f32| {
        let x = factor * non_negative(value);
        ((x * x * a + x * b) / (x * x * c + x * d + e)).clamp(0.0, 1.0)
    };
    // A finite value whose square is infinite is as bright as any.
    let finite = |pixel: f32| if pixel.is_finite() { value(pixel.min(1e15 / factor)) } else { f32::NAN };
    view.pixels.par_iter().map(|pixel| pixel.map(finite)).collect()
}

/// Returns 0 for values below 0; NaN stays.
fn non_negative(value: f32) -> f32 {
    if value < 0.0 { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::super::flip::DEFAULT_PIXELS_PER_DEGREE;
    use super::*;

    /// Returns a number with few bits, so that every language has it exactly: up to 2⁵ or, for one
    /// in nine, 2⁻⁵.
    fn value(index: u32, salt: u32) -> f32 {
        let mut hash = index.wrapping_mul(747_796_405).wrapping_add(salt.wrapping_mul(2_891_336_453));
        hash ^= hash >> 15;
        hash = hash.wrapping_mul(277_803_737);
        hash ^= hash >> 16;
        ((hash % 256 + 1) as f32 / 256.0) * ((hash >> 8) % 9) as f32 * 0.5f32.powi((hash >> 12) as i32 % 5)
    }

    /// Returns an image and a reference; `shift` moves the image, `factor` changes its brightness.
    fn pair((width, height): (usize, usize), salt: u32, factor: f32) -> [Vec<[f32; 3]>; 2] {
        let size = (width * height) as u32;
        let smooth = |i: u32, c: u32| value(i / 7, 3 * salt + c) * 4.0;
        let reference = (0..size).map(|i| std::array::from_fn(|c| smooth(i, c as u32))).collect();
        let noisy = |i: u32, c: u32| factor * smooth(i, c) + value(i, 100 + 3 * salt + c) * 0.25;
        [(0..size).map(|i| std::array::from_fn(|c| noisy(i, c as u32))).collect(), reference]
    }

    fn mean(size: (usize, usize), image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
        let view = |pixels| ImageView::new(size.0, size.1, pixels).unwrap();
        hdr_flip(&[view(image)], &view(reference), DEFAULT_PIXELS_PER_DEGREE).unwrap()[0].mean
    }

    /// Sizes, salts and factors of pairs, and the means that flip-evaluator 1.7 from PyPI gives
    /// with `evaluate(reference, image, "HDR")`.
    #[test]
    fn means_are_those_of_flip_evaluator() {
        for (size, salt, factor, wanted) in [
            ((48, 32), 1, 1.0, 0.252_514_47),
            ((31, 17), 2, 1.0, 0.348_340_46),
            ((40, 40), 3, 1.25, 0.324_617_41),
            ((64, 24), 4, 0.5, 0.416_663_93),
        ] {
            let [image, reference] = pair(size, salt, factor);
            let found = mean(size, &image, &reference);
            eprintln!("{size:?}: {found:.6}, theirs {wanted:.6}");
            assert!((found - wanted).abs() < 1e-4, "{size:?}: {found}, not {wanted}");
            // Negative control: another brightness has another error.
            let brighter: Vec<[f32; 3]> = image.iter().map(|pixel| pixel.map(|v| 1.1 * v)).collect();
            assert!((mean(size, &brighter, &reference) - wanted).abs() > 1e-4);
        }
    }

    /// Equal images differ nowhere, black ones too; a pixel that is not finite has an error of 1.
    #[test]
    fn special_images() {
        let [image, reference] = pair((8, 6), 5, 1.0);
        assert_eq!(mean((8, 6), &reference, &reference), 0.0);
        let black = vec![[0.0; 3]; 48];
        assert_eq!(mean((8, 6), &black, &black), 0.0);
        assert!(mean((8, 6), &image, &black) > 0.5);
        let mut holes = reference.clone();
        (holes[3][1], holes[40][0]) = (f32::NAN, f32::INFINITY);
        let view = |pixels| ImageView::new(8, 6, pixels).unwrap();
        let map = hdr_flip(&[view(&holes)], &view(&reference), DEFAULT_PIXELS_PER_DEGREE).unwrap();
        assert_eq!((map[0].errors[3], map[0].errors[40]), (1.0, 1.0));
        // A value as large as any, and one below 0, have an error within the range.
        let mut extreme = image;
        (extreme[0], extreme[1]) = ([f32::MAX; 3], [-1.0; 3]);
        assert!(mean((8, 6), &extreme, &reference) <= 1.0);
        let wide = ImageView::new(6, 8, &reference).unwrap();
        assert!(hdr_flip(&[wide], &view(&reference), DEFAULT_PIXELS_PER_DEGREE).is_err());
    }
}
