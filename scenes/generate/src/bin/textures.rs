//! Writes the texture images of the scenes into a folder.
//!
//! ```text
//! cargo generate-scene textures scenes/textures
//! ```
//!
//! * `planet.png`: 256x128, sRGB: seas, land and ice of a planet, for a sphere
//! * `marble.png`: 256x256, linear: veins of Perlin noise, as in "Ray Tracing: The Next Week"; has
//!   no seam when mirrored
//! * `checker.png`: 16x16, sRGB
//! * `sky.hdr`: 64x32: a panorama of a sky with a small bright sun

use glam::{DVec3, dvec3};
use image::codecs::hdr::HdrEncoder;
use image::{ImageBuffer, Luma, Rgb};
use std::error::Error;
use std::f64::consts::PI;
use std::fs::File;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: textures FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    planet().save(folder.join("planet.png"))?;
    marble().save(folder.join("marble.png"))?;
    checker().save(folder.join("checker.png"))?;
    let (width, height, sky) = sky();
    HdrEncoder::new(File::create(folder.join("sky.hdr"))?).encode(&sky, width, height)?;
    Ok(())
}

/// Returns the direction of a panorama's texel. The middle column is -z, right of it is +x; the top
/// row is up.
fn direction(x: u32, y: u32, width: u32, height: u32) -> DVec3 {
    let theta = (f64::from(y) + 0.5) / f64::from(height) * PI;
    let phi = ((f64::from(x) + 0.5) / f64::from(width) - 0.5) * 2.0 * PI;
    dvec3(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

fn planet() -> ImageBuffer<Rgb<u8>, Vec<u8>> {
    let (width, height) = (256, 128);
    ImageBuffer::from_fn(width, height, |x, y| {
        let d = direction(x, y, width, height);
        let level = turbulence(d * 2.2 + 11.0, 6, 0.55);
        let relief = turbulence(d * 9.0 + 5.0, 4, 0.5);
        let cold = d.y.abs() + 0.15 * relief;
        let color = if cold > 0.87 {
            dvec3(0.85, 0.88, 0.92)
        } else if level < 0.02 {
            dvec3(0.03, 0.1, 0.3) + dvec3(0.05, 0.2, 0.25) * (1.0 + level * 3.0).clamp(0.0, 1.0)
        } else {
            let dry = ((0.45 - d.y.abs()) * 2.0 + relief).clamp(0.0, 1.0);
            let land = dvec3(0.1, 0.3, 0.06).lerp(dvec3(0.55, 0.42, 0.2), dry);
            land.lerp(dvec3(0.45, 0.4, 0.36), ((level - 0.25) * 3.0).clamp(0.0, 1.0))
        };
        Rgb(color.to_array().map(|c| byte(srgb(c))))
    })
}

fn marble() -> ImageBuffer<Luma<u8>, Vec<u8>> {
    ImageBuffer::from_fn(256, 256, |x, y| {
        let p = dvec3(f64::from(x) + 0.5, f64::from(y) + 0.5, 0.0) / 32.0;
        let (mut sum, mut weight, mut q) = (0.0f64, 1.0, p + 3.0);
        for _ in 0..7 {
            sum += weight * noise(q);
            weight *= 0.5;
            q *= 2.0;
        }
        Luma([byte(0.5 * (1.0 + (4.0 * p.y + 10.0 * sum.abs()).sin()))])
    })
}

fn checker() -> ImageBuffer<Rgb<u8>, Vec<u8>> {
    let colors = [Rgb([200, 200, 196]), Rgb([70, 74, 80])];
    ImageBuffer::from_fn(16, 16, |x, y| colors[((x + y) % 2) as usize])
}

fn sky() -> (usize, usize, Vec<Rgb<f32>>) {
    let (width, height) = (64, 32);
    let sun = dvec3(-0.45, 0.6, -0.55).normalize();
    let texels = (0..width * height).map(|i| {
        let d = direction(i % width, i / width, width, height);
        let up = d.y.max(0.0).sqrt();
        let base = if d.y > 0.0 {
            dvec3(0.75, 0.8, 0.85).lerp(dvec3(0.18, 0.32, 0.65), up)
        } else {
            dvec3(0.22, 0.2, 0.18)
        };
        let near = d.dot(sun);
        // A disc of radius 5 degrees and its glow.
        let disc = if near > 0.9962 { dvec3(160.0, 145.0, 115.0) } else { DVec3::ZERO };
        let glow = dvec3(1.0, 0.85, 0.6) * (2.0 * ((near - 0.9) * 10.0).clamp(0.0, 1.0));
        Rgb((base + disc + glow).to_array().map(|c| c as f32))
    });
    (width as usize, height as usize, texels.collect())
}

fn byte(value: f64) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn srgb(linear: f64) -> f64 {
    if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn turbulence(mut point: DVec3, octaves: u32, gain: f64) -> f64 {
    let (mut sum, mut weight) = (0.0, 1.0);
    for _ in 0..octaves {
        sum += weight * noise(point);
        weight *= gain;
        point = point * 2.03 + 17.0;
    }
    sum
}

/// Returns gradient noise (Perlin 2002) from a hash, about -1 to 1.
fn noise(point: DVec3) -> f64 {
    let cell = point.floor();
    let f = point - cell;
    let s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let corner = |x: f64, y: f64, z: f64| {
        let offset = dvec3(x, y, z);
        let h = hash((cell + offset).as_ivec3().to_array());
        let d = f - offset;
        // The directions to the twelve edges of a cube.
        let (a, b) = [(d.x, d.y), (d.y, d.z), (d.z, d.x)][(h % 3) as usize];
        (if h & 0x10000 == 0 { a } else { -a }) + (if h & 0x20000 == 0 { b } else { -b })
    };
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    let edge = |y, z| mix(corner(0.0, y, z), corner(1.0, y, z), s.x);
    let side = |z| mix(edge(0.0, z), edge(1.0, z), s.y);
    mix(side(0.0), side(1.0), s.z)
}

fn hash([x, y, z]: [i32; 3]) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x8da6_b343)
        ^ (y as u32).wrapping_mul(0xd816_3841)
        ^ (z as u32).wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}
