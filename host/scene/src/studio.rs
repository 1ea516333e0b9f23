//! The built-in panorama of a photographer's studio: a large soft key light, a dimmer fill light, a
//! strip behind and a soft box above, over a floor and walls of one grey.
//!
//! It is neutral, and as bright as a sky of radiance 1 for a surface that faces upward.

use crate::ground;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::LazyLock;
use trisect_image::Image;

/// Width in texels.
const WIDTH: u32 = 256;
/// Height in texels.
const HEIGHT: u32 = 128;
/// Irradiance on a surface that faces upward: that of a uniform sky of radiance 1.
const IRRADIANCE: f64 = PI;
/// Radiance of floor and walls up to the horizon: that of the ground under the studio's light.
const FLOOR: f64 = ground::ALBEDO;
/// Radiance straight up between the lights, relative to that at the horizon.
const CEILING: f64 = 0.25;
/// Height, as the y of a unit direction, at which the walls are as dim as the ceiling.
const WALLS: f64 = 0.5;
/// Height at which a soft box ends above the floor.
const SKIRTING: f64 = 0.12;

/// A soft box: a rectangle with blurred borders.
struct SoftBox {
    /// Direction of its centre.
    toward: DVec3,
    /// Tangents of half its angles across and up.
    half: [f64; 2],
    /// Radiance relative to that of the other boxes.
    radiance: f64,
}

/// The soft boxes. The camera of a model without a camera stands at +z, a little to the right.
const BOXES: [SoftBox; 4] = [
    SoftBox { toward: DVec3::new(-1.0, 1.1, 0.8), half: [0.38, 0.38], radiance: 10.0 },
    SoftBox { toward: DVec3::new(1.4, 0.7, 0.9), half: [0.4, 0.4], radiance: 1.2 },
    SoftBox { toward: DVec3::new(0.9, 0.8, -1.3), half: [0.5, 0.22], radiance: 5.0 },
    SoftBox { toward: DVec3::new(0.05, 1.0, -0.1), half: [0.7, 0.5], radiance: 0.6 },
];

/// Returns the panorama; see [`Sky::Image`](crate::description::Sky::Image) for its directions.
pub fn panorama() -> &'static Image {
    static PANORAMA: LazyLock<Image> = LazyLock::new(build);
    &PANORAMA
}

fn build() -> Image {
    let directions = || (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| direction(x, y)));
    let solid_angle = |d: DVec3| {
        let row = PI / f64::from(HEIGHT);
        row * 2.0 * PI / f64::from(WIDTH) * (1.0 - d.y * d.y).sqrt()
    };
    let upward = |radiance: fn(DVec3) -> f64| -> f64 {
        directions().filter(|d| d.y > 0.0).map(|d| radiance(d) * d.y * solid_angle(d)).sum()
    };
    let gain = (IRRADIANCE - upward(walls)) / upward(boxes);
    let pixels = directions().map(|d| [(walls(d) + gain * boxes(d)) as f32; 3]).collect();
    Image { width: WIDTH, height: HEIGHT, pixels }
}

/// Returns the direction in which the centre of a texel is seen.
fn direction(x: u32, y: u32) -> DVec3 {
    let polar = PI * (f64::from(y) + 0.5) / f64::from(HEIGHT);
    // The middle column is seen along -z, those right of it towards +x.
    let azimuth = 2.0 * PI * ((f64::from(x) + 0.5) / f64::from(WIDTH) - 0.5);
    let (across, up) = polar.sin_cos();
    DVec3::new(across * azimuth.sin(), up, -across * azimuth.cos())
}

/// Returns the radiance of floor, walls and ceiling.
fn walls(direction: DVec3) -> f64 {
    FLOOR * (1.0 - (1.0 - CEILING) * smooth_step(direction.y / WALLS))
}

/// Returns the radiance of the soft boxes, up to a common factor.
fn boxes(direction: DVec3) -> f64 {
    BOXES.iter().map(|soft_box| soft_box.radiance * soft_box.coverage(direction)).sum()
}

impl SoftBox {
    /// Returns 1 inside the box, 0 outside, and what is between at its border.
    fn coverage(&self, direction: DVec3) -> f64 {
        let axis = self.toward.normalize();
        let across = DVec3::Y.cross(axis).normalize();
        let (front, up) = (direction.dot(axis), axis.cross(across));
        if front <= 0.0 {
            return 0.0;
        }
        let inside = |side: DVec3, half: f64| {
            let place = (direction.dot(side) / front).abs() / half;
            1.0 - smooth_step((place - 0.75) / 0.5)
        };
        inside(across, self.half[0]) * inside(up, self.half[1]) * smooth_step(direction.y / SKIRTING)
    }
}

/// Returns Hermite's step from 0 at 0 to 1 at 1.
fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the irradiance on a surface with this normal, and what `weight` makes of it.
    fn irradiance(image: &Image, normal: DVec3) -> f64 {
        let texel = |i: usize| direction(i as u32 % image.width, i as u32 / image.width);
        let cell = 2.0 * PI * PI / f64::from(image.width * image.height);
        let one = |(i, pixel): (usize, &[f32; 3])| {
            let d = texel(i);
            f64::from(pixel[0]) * d.dot(normal).max(0.0) * (1.0 - d.y * d.y).sqrt() * cell
        };
        image.pixels.iter().enumerate().map(one).sum()
    }

    #[test]
    fn it_is_as_bright_as_a_uniform_sky_of_radiance_1() {
        let studio = panorama();
        assert!((irradiance(studio, DVec3::Y) / PI - 1.0).abs() < 1e-3, "{}", irradiance(studio, DVec3::Y));
        // Negative control: half of the radiance has half of the irradiance.
        let half = Image {
            pixels: studio.pixels.iter().map(|pixel| pixel.map(|c| 0.5 * c)).collect(),
            ..studio.clone()
        };
        assert!((irradiance(&half, DVec3::Y) / PI - 0.5).abs() < 1e-3);
    }

    /// The key light is at the camera's left, and no side is black.
    #[test]
    fn it_models_a_body() {
        let studio = panorama();
        let [left, right, front, back] =
            [DVec3::NEG_X, DVec3::X, DVec3::Z, DVec3::NEG_Z].map(|normal| irradiance(studio, normal));
        assert!(left > 1.2 * right && front > 1.1 * back, "{left} {right} {front} {back}");
        for side in [left, right, front, back, irradiance(studio, DVec3::NEG_Y)] {
            assert!((0.3 * PI..1.2 * PI).contains(&side), "{side}");
        }
    }

    #[test]
    fn it_is_neutral_and_the_floor_has_the_radiance_of_the_ground() {
        for (i, &[r, g, b]) in panorama().pixels.iter().enumerate() {
            assert!(r == g && g == b && r > 0.0);
            if direction(i as u32 % WIDTH, i as u32 / WIDTH).y < 0.0 {
                assert!((f64::from(r) - ground::ALBEDO).abs() < 0.02, "{r}");
            }
        }
    }
}
