//! Panoramas of other layouts, resampled by latitude and longitude.

use super::super::budget;
use super::super::source_location::SourceLocation;
use super::Assembly;
use crate::description::Sky;
use crate::error::SceneError;
use glam::{DAffine3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;
use trisect_image::Image;

/// Maximum height of a panorama that is resampled to twice as many rows, which blurs it less.
const MAX_SMALL: u32 = 512;

/// Samples of a texel along each side.
const SAMPLES: u32 = 2;

/// Radiance of an image towards a direction in the light's own coordinates.
pub type Lookup = fn(&Image, DVec3) -> DVec3;

impl Assembly<'_> {
    /// Makes an image the light from infinity. `to_world` maps the light's coordinates to the
    /// file's world.
    pub fn set_panorama(
        &mut self,
        image: &Image,
        lookup: Lookup,
        (scale, to_world): (f64, DAffine3),
        site: &SourceLocation,
    ) -> Result<(), SceneError> {
        if self.scene.sky.is_some() {
            self.unsupported("a second light from infinity", "left out", site);
            return Ok(());
        }
        if !(0.0..=crate::values::MAX_MAGNITUDE).contains(&scale) {
            return Err(site.malformed(format!("its scale is {scale}"), "it must be from 0 to 1e18"));
        }
        let from_world = (self.world * to_world).inverse();
        if !from_world.is_finite() {
            return Err(site.malformed("its transform flattens it", "it must be invertible"));
        }
        let rows = if image.height <= MAX_SMALL { 2 * image.height } else { image.height };
        // A narrow image has no more details than it has texels.
        let most = (2.0 * f64::from(image.width) * f64::from(image.height)).sqrt().ceil();
        let rows = rows.min(most as u32).max(1);
        budget::fits(2 * 12 * u64::from(rows) * u64::from(rows), site)?;
        let resampled = resample(rows, |direction| {
            lookup(image, from_world.transform_vector3(direction).normalize_or(DVec3::Y))
        });
        self.scene.sky = Some(Sky::Image { image: Arc::new(resampled), scale, rotation: 0.0 });
        Ok(())
    }
}

/// Returns the panorama of `rows` rows and twice as many columns whose radiance `radiance` gives by
/// direction: each texel is a mean over its area.
pub fn resample(rows: u32, radiance: impl Fn(DVec3) -> DVec3) -> Image {
    let (width, height) = (2 * rows, rows);
    let (across, down) = (TAU / f64::from(width * SAMPLES), PI / f64::from(height * SAMPLES));
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for row in 0..height {
        for column in 0..width {
            let mut sum = DVec3::ZERO;
            for y in 0..SAMPLES {
                let (sine, cosine) = (f64::from(row * SAMPLES + y) * down + 0.5 * down).sin_cos();
                for x in 0..SAMPLES {
                    let angle = f64::from(column * SAMPLES + x) * across + 0.5 * across - PI;
                    sum += radiance(DVec3::new(sine * angle.sin(), cosine, -sine * angle.cos()));
                }
            }
            pixels.push((sum / f64::from(SAMPLES * SAMPLES)).as_vec3().into());
        }
    }
    Image { width, height, pixels }
}

/// Returns a texel; coordinates beyond the border are those of the border, or wrap around.
fn texel(image: &Image, x: i64, y: i64, wraps: bool) -> DVec3 {
    let (width, height) = (i64::from(image.width), i64::from(image.height));
    let x = if wraps { x.rem_euclid(width.max(1)) } else { x.clamp(0, width - 1) };
    let index = y.clamp(0, height - 1) * width + x;
    image
        .pixels
        .get(usize::try_from(index).unwrap_or(0))
        .map_or(DVec3::ZERO, |p| DVec3::from(p.map(f64::from)))
}

/// Interpolates between the texels around a place, in texels from the centre of the first one.
fn bilinear(image: &Image, x: f64, y: f64, wraps: bool) -> DVec3 {
    let (left, top) = (x.floor(), y.floor());
    let (right_share, low_share) = (x - left, y - top);
    let (left, top) = (left as i64, top as i64);
    let row = |y: i64| {
        texel(image, left, y, wraps) * (1.0 - right_share) + texel(image, left + 1, y, wraps) * right_share
    };
    row(top) * (1.0 - low_share) + row(top + 1) * low_share
}

/// Looks up Mitsuba's panorama by latitude and longitude: the rows at its top and bottom are the
/// poles ±y, and its middle column is at +z.
pub fn spherical(image: &Image, direction: DVec3) -> DVec3 {
    let u = direction.x.atan2(-direction.z) / TAU;
    let v = direction.y.clamp(-1.0, 1.0).acos() / PI;
    bilinear(image, u * f64::from(image.width) - 0.5, v * f64::from(image.height.max(1) - 1), true)
}

/// Looks up pbrt's square panorama: the octahedral map of equal areas by Clarberg, "Fast Equal-Area
/// Mapping of the (Hemi)Sphere using SIMD", Journal of Graphics Tools 13(3), 2008.
pub fn octahedral(image: &Image, direction: DVec3) -> DVec3 {
    let [x, y, z] = direction.abs().to_array();
    let radius = (1.0 - z).max(0.0).sqrt();
    let angle = y.atan2(x) / FRAC_PI_2;
    let (mut u, mut v) = (radius - angle * radius, angle * radius);
    if direction.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    let place = |t: f64, sign: f64, size: u32| (0.5 + 0.5 * t.copysign(sign)) * f64::from(size) - 0.5;
    bilinear(image, place(u, direction.x, image.width), place(v, direction.y, image.height), false)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of columns and rows: red is the column, green the row.
    fn numbered(width: u32, height: u32) -> Image {
        let pixel = |i: u32| [(i % width) as f32, (i / width) as f32, 1.0];
        Image { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    /// Radiance that Mitsuba 3.9.1 gives for an image of 8 x 4 texels.
    #[test]
    fn spherical_maps_are_those_of_mitsuba() {
        let image = numbered(8, 4);
        for (direction, want) in [
            (DVec3::Z, [3.5, 1.5]),
            (DVec3::X, [1.5, 1.5]),
            (DVec3::NEG_X, [5.5, 1.5]),
            (DVec3::NEG_Z, [3.5, 1.5]),
            (DVec3::Y, [3.5, 0.0]),
            (DVec3::NEG_Y, [3.5, 3.0]),
        ] {
            let found = spherical(&image, direction);
            // At the poles every column is right.
            let same_column = direction.y.abs() == 1.0 || (found.x - want[0]).abs() < 1e-9;
            assert!(same_column && (found.y - want[1]).abs() < 1e-9, "{direction}: {found}");
        }
    }

    #[test]
    fn octahedral_maps_have_equal_areas() {
        let image = numbered(64, 64);
        // +z is the centre, -z the corners, +x the middle of the right side.
        assert!((octahedral(&image, DVec3::Z) - DVec3::new(31.5, 31.5, 1.0)).length() < 1e-9);
        assert!((octahedral(&image, DVec3::X) - DVec3::new(63.0, 31.5, 1.0)).length() < 1e-9);
        assert!((octahedral(&image, DVec3::NEG_Y) - DVec3::new(31.5, 0.0, 1.0)).length() < 1e-9);
        // The mean over the sphere is the mean of the texels.
        let panorama = resample(64, |direction| octahedral(&image, direction));
        let (mut sum, mut weights) = (0.0, 0.0);
        for (index, pixel) in panorama.pixels.iter().enumerate() {
            let row = index / panorama.width as usize;
            let weight = ((row as f64 + 0.5) / 64.0 * PI).sin();
            sum += weight * f64::from(pixel[0]);
            weights += weight;
        }
        assert!((sum / weights - 31.5).abs() < 0.05, "{}", sum / weights);
    }

    #[test]
    fn resampling_keeps_directions() {
        let panorama = resample(64, |direction| direction + 1.0);
        let pixel = |column: usize, row: usize| panorama.pixels[row * 128 + column];
        assert!((pixel(64, 32)[2] - 0.0).abs() < 0.05 && (pixel(96, 32)[0] - 2.0).abs() < 0.05);
        assert!((pixel(0, 0)[1] - 2.0).abs() < 0.05);
    }
}
