//! Images that Open Image Denoise reads, made from the sums of a film.

use crate::film::TASK;
use rayon::prelude::*;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// Maximum distance in pixels, along each axis, from which a pixel without light gets some.
const REACH: usize = 16;

/// Images of one size, row by row from the top. All values are finite.
pub(super) struct Inputs {
    /// Mean radiance. Pixels without a finite one have that of the nearest that have.
    pub color: Vec<[f32; 3]>,
    /// Mean albedo, from 0 to 1; of what emits, its radiance.
    pub albedo: Vec<[f32; 3]>,
    /// Mean of the unit normals; 0 where nothing is hit.
    pub normal: Vec<[f32; 3]>,
    /// Pixels without radiance of their own or near by.
    pub lost: Vec<usize>,
}

impl Inputs {
    /// Makes the images of sums that have a record for each pixel of an image `width` pixels wide.
    pub fn new(width: usize, sums: &[PixelSums], aovs: &[AovSums]) -> Self {
        let rows = sums.par_iter().with_min_len(TASK);
        let mut color: Vec<[f32; 3]> =
            rows.map(|sums| (sums.radiance / sums.samples as f32).to_array()).collect();
        let unknown: Vec<usize> = (0..color.len()).filter(|&pixel| !is_finite(&color[pixel])).collect();
        let filled: Vec<Option<[f32; 3]>> =
            unknown.par_iter().map(|&pixel| near(&color, width, pixel)).collect();
        let mut lost = Vec::new();
        for (&pixel, near) in unknown.iter().zip(&filled) {
            color[pixel] = near.unwrap_or([0.0; 3]);
            if near.is_none() {
                lost.push(pixel);
            }
        }
        let rows = aovs.par_iter().with_min_len(TASK);
        let (albedo, normal) = rows.map(|aovs| (albedo(aovs), normal(aovs))).unzip();
        Self { color, albedo, normal, lost }
    }
}

fn is_finite(color: &[f32; 3]) -> bool {
    color.iter().all(|value| value.is_finite())
}

/// Returns the mean of the finite pixels of the smallest square around a pixel that has any.
fn near(color: &[[f32; 3]], width: usize, pixel: usize) -> Option<[f32; 3]> {
    let (x, y, height) = (pixel % width, pixel / width, color.len() / width);
    (1..=REACH).find_map(|reach| {
        let (mut sum, mut count) = ([0.0f64; 3], 0.0);
        for y in y.saturating_sub(reach)..height.min(y + reach + 1) {
            for x in x.saturating_sub(reach)..width.min(x + reach + 1) {
                let of = color[y * width + x];
                if is_finite(&of) {
                    sum.iter_mut().zip(of).for_each(|(sum, value)| *sum += f64::from(value));
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum.map(|sum| (sum / count) as f32))
    })
}

/// Returns the mean albedo of a pixel's samples. Light and sky are their own edges, so their
/// radiance counts as albedo; the filter knows no albedo above 1.
fn albedo(aovs: &AovSums) -> [f32; 3] {
    let count = (aovs.hits + aovs.misses) as f32;
    let mean = (aovs.albedo + aovs.emission) / count;
    mean.to_array().map(|value| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) })
}

/// Returns the mean normal of a pixel's samples; those that hit nothing have the normal 0.
fn normal(aovs: &AovSums) -> [f32; 3] {
    let mean = (aovs.normal / (aovs.hits + aovs.misses) as f32).to_array();
    if is_finite(&mean) { mean.map(|value| value.clamp(-1.0, 1.0)) } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use glam::Vec3;

    /// Sums of one sample.
    fn sums(radiance: f32) -> PixelSums {
        PixelSums { radiance: Vec3::splat(radiance), samples: 1, ..Zeroable::zeroed() }
    }

    #[test]
    fn pixels_without_light_get_that_of_the_nearest() {
        let width = 40;
        let mut all = vec![sums(f32::NAN); 2 * width];
        all[0] = sums(1.0);
        all[width] = sums(3.0);
        all[3] = PixelSums { samples: 0, ..sums(0.0) };
        let inputs = Inputs::new(width, &all, &vec![AovSums::ZERO; all.len()]);
        assert_eq!((inputs.color[0], inputs.color[width]), ([1.0; 3], [3.0; 3]));
        let reached = (1..=REACH).flat_map(|x| [x, width + x]);
        assert!(reached.into_iter().all(|pixel| inputs.color[pixel] == [2.0; 3]));
        assert_eq!(inputs.lost.len(), 2 * (width - REACH - 1));
        assert!(inputs.lost.iter().all(|&pixel| inputs.color[pixel] == [0.0; 3]));
        assert!(inputs.albedo.iter().chain(&inputs.normal).all(|of| *of == [0.0; 3]));
    }

    #[test]
    fn features_are_in_their_ranges() {
        let of = |albedo: f32, emission: f32, normal: f32| AovSums {
            hits: 1,
            misses: 1,
            albedo: Vec3::splat(albedo),
            emission: Vec3::splat(emission),
            normal: Vec3::splat(normal),
            ..AovSums::ZERO
        };
        assert_eq!((albedo(&of(1.0, 0.0, 0.0)), normal(&of(0.0, 0.0, -1.0))), ([0.5; 3], [-0.5; 3]));
        assert_eq!(albedo(&of(1.0, 99.0, 0.0)), [1.0; 3]);
        assert_eq!(albedo(&of(0.0, f32::INFINITY, 0.0)), [1.0; 3]);
        assert_eq!(albedo(&of(f32::NAN, 0.0, 0.0)), [0.0; 3]);
        assert_eq!(normal(&of(0.0, 0.0, f32::NAN)), [0.0; 3]);
        assert_eq!(normal(&of(0.0, 0.0, 9.0)), [1.0; 3]);
    }
}
