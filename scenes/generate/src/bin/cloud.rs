//! Writes the densities of a cloud: a ball whose surface is folded by Perlin-like noise.
//!
//! ```text
//! cargo generate-scene cloud scenes/textures/cloud.vol
//! ```

use std::error::Error;
use trisect::glam::{DVec3, dvec3};
use trisect::scene::medium::DensityGrid;

/// Voxels along each axis.
const SIZE: u32 = 32;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("usage: cloud FILE.vol")?;
    let mut densities = Vec::new();
    for z in 0..SIZE {
        for y in 0..SIZE {
            for x in 0..SIZE {
                let at = |i: u32| (f64::from(i) + 0.5) / f64::from(SIZE) * 2.0 - 1.0;
                densities.push(density(dvec3(at(x), at(y), at(z))) as f32);
            }
        }
    }
    std::fs::write(file, DensityGrid::new([SIZE; 3], densities)?.to_bytes())?;
    Ok(())
}

/// Returns the density at a place of the cube from -1 to 1: multiples of 1/64, from 0 to 1.
fn density(p: DVec3) -> f64 {
    let height = 0.75 - p.length()
        + 0.45
            * (0..4)
                .map(|octave| {
                    let scale = f64::from(1 << octave);
                    noise(p * 2.1 * scale) / scale
                })
                .sum::<f64>();
    ((height * 3.0).clamp(0.0, 1.0) * 64.0).round() / 64.0
}

/// Returns a smooth number from -1 to 1: values at whole numbers, interpolated.
fn noise(p: DVec3) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (3.0 - 2.0 * f);
    let corner = |x: f64, y: f64, z: f64| value(cell + dvec3(x, y, z));
    let along = |y: f64, z: f64| corner(0.0, y, z) * (1.0 - f.x) + corner(1.0, y, z) * f.x;
    let across = |z: f64| along(0.0, z) * (1.0 - f.y) + along(1.0, z) * f.y;
    across(0.0) * (1.0 - f.z) + across(1.0) * f.z
}

/// Returns a number from -1 to 1 that belongs to a point of whole numbers.
fn value(p: DVec3) -> f64 {
    let mut bits = [p.x, p.y, p.z].iter().fold(0x9e37_79b9u32, |bits, &c| {
        (bits ^ (c as i32) as u32).wrapping_mul(0x85eb_ca6b).rotate_left(13)
    });
    bits ^= bits >> 16;
    bits = bits.wrapping_mul(0xc2b2_ae35);
    bits ^= bits >> 13;
    f64::from(bits) / f64::from(u32::MAX) * 2.0 - 1.0
}
