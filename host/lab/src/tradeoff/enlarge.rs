//! Enlarges the image of a render at a lower resolution to the size of the reference.

use rayon::prelude::*;
use trisect::film::TASK;
use trisect::image::Image;

/// Returns the image at another size, interpolated linearly between the centres of pixels.
pub(super) fn enlarge(image: &Image, (width, height): (u32, u32)) -> Image {
    if image.pixels.is_empty() {
        return Image { width, height, pixels: vec![[0.0; 3]; width as usize * height as usize] };
    }
    let columns: Vec<_> = (0..width as usize).map(|x| between(x, image.width, width)).collect();
    let pixels = (0..width as usize * height as usize).into_par_iter().with_min_len(TASK).map(|index| {
        let (x, y) = (index % width as usize, index / width as usize);
        let (left, right, across) = columns[x];
        let (upper, lower, down) = between(y, image.height, height);
        let at = |x: usize, y: usize| &image.pixels[y * image.width as usize + x];
        let [[a, b], [c, d]] = [upper, lower].map(|y| [at(left, y), at(right, y)]);
        let mix = |a: f32, b: f32, share: f32| (1.0 - share) * a + share * b;
        std::array::from_fn(|i| mix(mix(a[i], b[i], across), mix(c[i], d[i], across), down))
    });
    Image { width, height, pixels: pixels.collect() }
}

/// Returns the two nearest pixels of the smaller image to a pixel of the larger one along an axis,
/// and the position between them, from 0 at the first to 1 at the second.
fn between(at: usize, from: u32, to: u32) -> (usize, usize, f32) {
    let last = from.saturating_sub(1);
    let at = ((at as f32 + 0.5) * (from as f32 / to as f32) - 0.5).clamp(0.0, last as f32);
    (at as usize, (at as usize + 1).min(last as usize), at.fract())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use image::{ImageBuffer, Rgb, imageops};
    use trisect_shared::rng::PathKey;

    /// Gives the result of the crate `image`, which takes no radiance above 1, for sizes that
    /// divide each other and sizes that do not.
    #[test]
    fn linear_between_centres() {
        for (from, to) in [((5, 3), (10, 6)), ((7, 4), (25, 13)), ((1, 1), (3, 2)), ((4, 9), (4, 9))] {
            let value = |i: u32| (PathKey { seed: 5, pixel: i, sample: 0 }.words(0).x % 1000) as f32 / 1000.0;
            let flat: Vec<f32> = (0..from.0 * from.1 * 3).map(value).collect();
            let pixels = flat.chunks(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
            let found = enlarge(&Image { width: from.0, height: from.1, pixels }, to);
            let buffer = ImageBuffer::<Rgb<f32>, Vec<f32>>::from_raw(from.0, from.1, flat.clone()).unwrap();
            let wanted = imageops::resize(&buffer, to.0, to.1, imageops::FilterType::Triangle);
            assert_eq!((found.width, found.height), to);
            let pairs = found.pixels.iter().flatten().zip(wanted.pixels().flat_map(|pixel| pixel.0));
            // Values up to 1, rounded a few times.
            let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart < 1e-6, "{from:?} {to:?}: {apart}");
            // Negative control: the nearest pixel gives a different image.
            let nearest = imageops::resize(&buffer, to.0, to.1, imageops::FilterType::Nearest);
            let pairs = found.pixels.iter().flatten().zip(nearest.pixels().flat_map(|pixel| pixel.0));
            assert!(
                from == to || from == (1, 1) || pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) > 0.1
            );
        }
    }
    /// Radiance above 1 is kept: light has no upper bound.
    #[test]
    fn a_lamp_stays_as_bright_as_it_is() {
        let lamp = Image { width: 2, height: 1, pixels: vec![[1000.0; 3], [0.0; 3]] };
        let larger = enlarge(&lamp, (4, 2));
        assert_eq!(larger.pixels[..4], [[1000.0; 3], [750.0; 3], [250.0; 3], [0.0; 3]]);
        assert_eq!(larger.pixels[4..], larger.pixels[..4]);
        assert_eq!(enlarge(&Image { width: 0, height: 0, pixels: Vec::new() }, (1, 1)).pixels, [[0.0; 3]]);
    }
}
