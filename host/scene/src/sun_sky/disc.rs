//! The sun's disc on the texels of a panorama.
//!
//! The panorama is read bilinearly, so each texel spreads over its neighbours. The disc is made
//! smaller by as much: shadows have penumbras of the sun's width, and the irradiance is exact.

use super::grid::Grid;
use glam::DVec3;
use std::f64::consts::PI;

/// Number of samples of the disc in a texel, across and down.
const SAMPLES: u32 = 16;

/// The sun's disc.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    /// Unit vector towards its centre, over -z.
    pub toward: DVec3,
    /// Angular radius in radians.
    pub radius: f64,
    /// Irradiance of a surface that faces it, of the whole disc.
    pub irradiance: DVec3,
}

impl Disc {
    /// Returns the share of the disc that is above the horizon.
    pub fn visible_share(&self) -> f64 {
        let height = (libm::asin(self.toward.y.clamp(-1.0, 1.0)) / self.radius).clamp(-1.0, 1.0);
        1.0 - (libm::acos(height) - height * (1.0 - height * height).sqrt()) / PI
    }

    /// Returns the irradiance of a surface that faces the disc, of what is above the horizon.
    pub fn visible_irradiance(&self) -> DVec3 {
        self.irradiance * self.visible_share()
    }

    /// Returns the radiance that the disc adds to texels of a panorama, with their indices. The
    /// irradiance of the interpolated texels is that of the disc.
    pub fn texels(&self, grid: Grid) -> Vec<(usize, DVec3)> {
        let mut covered = Vec::new();
        let mut solid_angle = 0.0;
        let (across, up) = self.axes(grid);
        // Rows and columns beyond these have none of the disc.
        let (height, step) = (libm::asin(self.toward.y.clamp(-1.0, 1.0)), PI / f64::from(grid.height));
        let row = |polar: f64| (polar / step).floor().clamp(0.0, f64::from(grid.height / 2 - 1)) as u32;
        let rows = row(0.5 * PI - height - self.radius)..=row(0.5 * PI - height + self.radius);
        for y in rows {
            let weight = grid.solid_angle(y);
            for x in 0..grid.width / 2 {
                let share = self.coverage(grid, x, y, [across, up]);
                if share > 0.0 {
                    // The left half mirrors the right one.
                    for x in [x, grid.width - 1 - x] {
                        covered.push(((y * grid.width + x) as usize, share));
                        solid_angle += share * weight;
                    }
                }
            }
        }
        let radiance = self.visible_irradiance() / solid_angle;
        covered.into_iter().map(|(index, share)| (index, radiance * share)).collect()
    }

    /// Returns the half axes across and up, in radians, of the ellipse that has the disc's width
    /// once texels have spread it: by the variance of a texel and of the interpolation, 1/12 + 1/6
    /// of a texel squared, and that of a disc is a quarter of its radius squared.
    fn axes(&self, grid: Grid) -> (f64, f64) {
        let texel = PI / f64::from(grid.height);
        let spread = |share: f64| (self.radius * self.radius - share * texel * texel).max(0.0).sqrt();
        let cosine = (1.0 - self.toward.y * self.toward.y).max(0.0).sqrt();
        if cosine < 2.0 * libm::sin(self.radius) {
            // Round the zenith rows are circles: they spread it along radii, and outward, by the
            // more, the nearer its centre is to the zenith.
            let off = libm::asin(cosine) / self.radius;
            let circle = spread(0.5 + 0.5 * (1.0 - off * off).max(0.0));
            (circle, circle)
        } else {
            (spread(cosine * cosine), spread(1.0))
        }
    }

    /// Returns the share of a texel that the disc above the horizon covers.
    fn coverage(&self, grid: Grid, x: u32, y: u32, [across, up]: [f64; 2]) -> f64 {
        let centre = grid.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let reach = 2.0 * self.radius + 2.0 * PI / f64::from(grid.height);
        if centre.dot(self.toward) < libm::cos(reach.min(PI)) {
            return 0.0;
        }
        let above = DVec3::new(0.0, (1.0 - self.toward.y * self.toward.y).max(0.0).sqrt(), self.toward.y);
        let mut inside = 0;
        for i in 0..SAMPLES {
            for j in 0..SAMPLES {
                let place = |k: u32| (f64::from(k) + 0.5) / f64::from(SAMPLES);
                let d = grid.direction(f64::from(x) + place(i), f64::from(y) + place(j));
                // The sun is over -z, so the axis across it is x.
                let (u, v) = (libm::asin(d.x) / across, libm::asin(d.dot(above).clamp(-1.0, 1.0)) / up);
                if d.y > 0.0 && d.dot(self.toward) > 0.0 && u * u + v * v <= 1.0 {
                    inside += 1;
                }
            }
        }
        f64::from(inside) / f64::from(SAMPLES * SAMPLES)
    }
}
