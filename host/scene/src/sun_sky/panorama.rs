//! Panorama of a clear sky with the sun over -z.

use super::SunSky;
use super::disc::Disc;
use super::grid::Grid;
use super::radiance::ClearSky;
use glam::DVec3;
use std::f64::consts::PI;
use trisect_image::Image;

/// Height of the panorama in texels without the disc; it is twice as wide. Interpolation is within
/// 1 % of the model, and within 0.1 % away from the horizon.
const HEIGHT: u32 = if cfg!(fuzzing) { 16 } else { 512 };
/// Height with a disc: the sun is three texels wide.
const HEIGHT_WITH_DISC: u32 = if cfg!(fuzzing) { 16 } else { 1024 };

/// Makes the panorama of a sky, with its scale but not its azimuth.
pub(super) fn build(sky: &SunSky) -> Image {
    let clear = ClearSky::new(sky);
    let height = if sky.sun_disc { HEIGHT_WITH_DISC } else { HEIGHT };
    let grid = Grid { width: 2 * height, height };
    let disc =
        Disc { toward: clear.sun(), radius: sky.sun_radius.to_radians(), irradiance: clear.sun_irradiance };
    let (width, half) = (grid.width as usize, grid.width as usize / 2);
    let mut texels = Vec::with_capacity(width * grid.height as usize);
    let mut irradiance = disc.visible_irradiance() * disc.toward.y;
    for y in 0..grid.height / 2 {
        let mut sum = DVec3::ZERO;
        let row = texels.len();
        for x in 0..half {
            let radiance = clear.radiance(grid.direction(x as f64 + 0.5, f64::from(y) + 0.5));
            sum += radiance;
            texels.push(radiance);
        }
        texels.extend_from_within(row..);
        texels[row + half..].reverse();
        let up = grid.direction(0.0, f64::from(y) + 0.5).y;
        irradiance += sum * (2.0 * up * grid.solid_angle(y));
    }
    let ground = irradiance * (sky.ground_albedo / PI);
    texels.resize(width * grid.height as usize, ground);
    if sky.sun_disc {
        for (index, radiance) in disc.texels(grid) {
            texels[index] += radiance;
        }
    }
    Image {
        width: grid.width,
        height: grid.height,
        pixels: texels.iter().map(|radiance| radiance.as_vec3().to_array()).collect(),
    }
}
