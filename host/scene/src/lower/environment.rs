//! Lowers a panorama (environment map) to texels with an alias table.

use super::super::Environment;
use crate::alias;
use glam::Vec3;
use trisect_image::Image;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::math::luminance;
use trisect_system::memory;

/// Bytes per texel while the table is built: radiance, luminance, weights, the table's own memory
/// and the records.
const BYTES_PER_TEXEL: u64 = 72;

/// Builds the records of a panorama. Each texel is sampled with a probability proportional to the
/// luminance of the interpolated panorama times the texel's solid angle, so that each direction
/// with radiance can be sampled.
pub(super) fn lower(image: &Image, scale: f64, rotation: f64) -> Result<Environment, String> {
    let (width, height) = (image.width as usize, image.height as usize);
    if width == 0 || height == 0 || image.pixels.len() != width * height || image.pixels.len() > 1 << 30 {
        return Err(format!("a panorama of {width}x{height} texels; it may have 1 to 2^30"));
    }
    let needed = BYTES_PER_TEXEL * image.pixels.len() as u64;
    if let Some(free) = memory::lacking(needed) {
        let (needed, free) = (memory::display(needed), memory::display(free));
        return Err(format!(
            "a panorama of {width}x{height} texels needs {needed} of memory, and {free} are available; use a smaller one"
        ));
    }
    let mut radiance = Vec::with_capacity(image.pixels.len());
    for (i, pixel) in image.pixels.iter().enumerate() {
        let scaled = pixel.map(|c| (f64::from(c) * scale) as f32);
        if scaled.iter().any(|c| !c.is_finite() || *c < 0.0 || *c > 1e18) {
            return Err(format!(
                "the panorama's texel ({}, {}) is {pixel:?}, times its scale {scaled:?}; each must be 0 to 1e18",
                i % width,
                i / width
            ));
        }
        radiance.push(Vec3::from(scaled));
    }
    let lum: Vec<f64> = radiance.iter().map(|&c| f64::from(luminance(c))).collect();
    let mut weights = Vec::with_capacity(lum.len());
    for y in 0..height {
        let angle = std::f64::consts::PI * (y as f64 + 0.5) / height as f64;
        for x in 0..width {
            // Mean of the bilinear interpolation over a texel: 3/4 of its own value, 1/8 of each
            // neighbour's, in both directions.
            let across = |row: usize| {
                let at = |column: usize| lum[row * width + column];
                0.75 * at(x) + 0.125 * (at((x + width - 1) % width) + at((x + 1) % width))
            };
            let down =
                0.75 * across(y) + 0.125 * (across(y.saturating_sub(1)) + across((y + 1).min(height - 1)));
            weights.push(down * angle.sin());
        }
    }
    let sum: f64 = weights.iter().sum();
    let rows = alias::table(&weights);
    let texels =
        radiance.iter().zip(&weights).enumerate().map(|(i, (&radiance, &weight))| EnvironmentTexel {
            radiance,
            pdf: if rows.is_some() { (weight / sum * weights.len() as f64) as f32 } else { 0.0 },
            threshold: rows.as_ref().map_or(u32::MAX, |rows| rows[i].threshold),
            alias: rows.as_ref().map_or(0, |rows| rows[i].alias),
            pad: [0; 2],
        });
    Ok(Environment { width: image.width, height: image.height, rotation, texels: texels.collect() })
}

impl Environment {
    /// Returns whether the panorama has no radiance.
    pub fn is_black(&self) -> bool {
        self.texels.iter().all(|texel| texel.pdf == 0.0)
    }
}
