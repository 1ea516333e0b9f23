//! Media: scattered directions against their pdf, and flights against the transmittance, in a
//! homogeneous medium and in a grid.

use crate::chart::{CELLS, Chart};
use crate::materials::NO_SCENE;
use crate::statistics::{Mean, SLOW, chi_square, samples, sidak, words};
use glam::{Vec3, Vec4};
use trisect_shared::medium::{CELL, COLLIDES, Flight, HAS_GRID, Medium, fly};
use trisect_shared::medium::{phase_function, sample_phase_function};
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::scene::Scene;
use trisect_shared::texture::Texel;

const ANISOTROPIES: [f32; 7] = [-0.99, -0.9, -0.3, 0.0, 0.3, 0.9, 0.99];

/// Returns the integral over all directions of a function of the cosine, by substitution of the
/// inverse distribution's form, which is steep where the phase function is.
fn integral(g: f32, f: impl Fn(f64) -> f64) -> f64 {
    let (n, g) = (20_000, f64::from(g));
    let sum: f64 = (0..n)
        .map(|i| {
            // 1 + g² - 2 g cos = x², so that dcos = -x dx / g; of g = 0 the cosine itself.
            let u = (f64::from(i) + 0.5) / f64::from(n);
            if g == 0.0 {
                return f(2.0 * u - 1.0) * 2.0;
            }
            let (low, high) = (1.0 - g.abs(), 1.0 + g.abs());
            // And x = low (high / low)^u.
            let x = low * (high / low).powf(u);
            let cos = ((1.0 + g * g - x * x) / (2.0 * g)).clamp(-1.0, 1.0);
            f(cos) * x / g.abs() * x * (high / low).ln()
        })
        .sum();
    2.0 * std::f64::consts::PI * sum / f64::from(n)
}

#[test]
fn the_phase_function_is_a_pdf() {
    for g in ANISOTROPIES {
        let value = |cos: f64| f64::from(phase_function(g, cos as f32));
        let (total, mean) = (integral(g, value), integral(g, |cos| cos * value(cos)));
        // Near the peak of the steepest function the rounding of the cosine is 0.1 % of its width.
        let allowed = if g.abs() > 0.9 { 1e-3 } else { 1e-5 };
        assert!((total - 1.0).abs() < allowed, "{g}: {total}");
        assert!((mean - f64::from(g)).abs() < allowed, "{g}: {mean}");
    }
}

/// Returns the p-value of the samples of `g` for the phase function of `by`.
fn directions(g: f32, by: f32) -> f64 {
    let incoming = Vec3::new(0.48, -0.6, 0.64);
    let chart = Chart::new(incoming);
    let other = Chart::new(-incoming);
    let mut observed = vec![0.0; 2 * CELLS];
    let n = samples(400_000);
    for i in 0..n {
        let w = words(17, i);
        let direction = sample_phase_function(g, incoming, w.x, w.y);
        assert!((direction.length() - 1.0).abs() < 1e-6);
        let back = direction.dot(incoming) < 0.0;
        let cell = if back { CELLS + other.cell(direction) } else { chart.cell(direction) };
        observed[cell] += 1.0;
    }
    let mut expected = Vec::new();
    for (chart, back) in [(&chart, false), (&other, true)] {
        let pdf = |d: Vec3| {
            let cos = d.dot(incoming);
            if (cos < 0.0) == back { f64::from(phase_function(by, cos)) } else { 0.0 }
        };
        expected.extend((0..CELLS).map(|cell| chart.integral(cell, if SLOW { 4 } else { 12 }, pdf)));
    }
    let scale = f64::from(n) / expected.iter().sum::<f64>();
    expected.iter_mut().for_each(|e| *e *= scale);
    chi_square(&observed, &expected)
}

#[test]
fn directions_have_their_pdf() {
    for g in [-0.9f32, -0.5, 0.0, 0.5, 0.9] {
        let p = directions(g, g);
        assert!(p > sidak(5), "{g}: {p}");
    }
    // Negative control: the other sign.
    assert!(directions(0.5, -0.5) < 1e-6);
}

/// Returns the half-precision bits of a number that has such.
fn half(x: f32) -> u32 {
    if x == 0.0 { 0 } else { (x.to_bits() >> 13) - (112 << 10) }
}

/// Number of voxels of the grid along x; it has one along y and z.
const VOXELS: u32 = 20;

/// Density of voxel `i`: empty cells beside dense ones.
fn density(i: u32) -> f32 {
    match i {
        0..=7 => 0.0,
        8..=15 => (i - 7) as f32 / 8.0,
        _ => 0.25,
    }
}

/// Returns the density at `x`, in voxels.
fn density_at(x: f64) -> f64 {
    let p = (x - 0.5).clamp(0.0, f64::from(VOXELS - 1));
    let i = p.floor() as u32;
    let at = |i: u32| f64::from(density(i.min(VOXELS - 1)));
    at(i) * (1.0 - p.fract()) + at(i + 1) * p.fract()
}

/// Returns the texels of the grid: densities, then majorants.
fn texels() -> Vec<Texel> {
    let voxel = |i: u32| {
        let pair = half(density(i)) | half(density((i + 1).min(VOXELS - 1))) << 16;
        Texel { red_green: pair, blue_alpha: pair }
    };
    let mut texels: Vec<Texel> = (0..VOXELS).map(voxel).collect();
    for cell in 0..VOXELS.div_ceil(CELL) {
        let (first, last) = ((cell * CELL).saturating_sub(1), ((cell + 1) * CELL).min(VOXELS - 1));
        let majorant = (first..=last).map(density).fold(0.0, f32::max);
        texels.push(Texel { red_green: majorant.to_bits(), blue_alpha: 0 });
    }
    texels
}

/// Returns a medium; with a grid, a voxel is a unit long.
fn medium(extinction: Vec3, has_grid: bool) -> Medium {
    let flags = COLLIDES | if has_grid { HAS_GRID } else { 0 };
    Medium {
        extinction,
        albedo: Vec3::ONE,
        flags,
        x: Vec4::X,
        y: Vec4::Y,
        z: Vec4::Z,
        width: VOXELS,
        height: 1,
        depth: 1,
        first_majorant: VOXELS,
        ..Medium::CLEAR
    }
}

/// Flies `distance` along x, or back, and returns what happens.
fn flight(medium: &Medium, distance: f32, carries: Vec3, only: bool, stream: u32, i: u32) -> Flight {
    let texels = texels();
    let scene = Scene { texels: &texels, ..NO_SCENE };
    let ray = Ray::in_world(Vec3::new(-1.0, 0.5, 0.5), Vec3::X, OriginPrimitive::NONE);
    // SAFETY: the medium's texels are those of the scene.
    unsafe { fly(scene, medium, ray, distance, carries, only, words(stream, i)) }
}

/// Returns the optical depth of the first `distance` of that way, for an extinction of 1.
fn optical_depth(has_grid: bool, distance: f64) -> f64 {
    if !has_grid {
        return distance;
    }
    let n = 20_000;
    let end = (distance - 1.0).clamp(0.0, f64::from(VOXELS));
    (0..n).map(|i| density_at(end * (f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() * end / f64::from(n)
}

/// Escapes and collisions have the weights of the transmittance and of the rest in each channel,
/// whatever the path carries. The channels' probabilities weigh each flight by 1.
#[test]
fn flights_agree_with_the_transmittance() {
    let extinction = Vec3::new(0.125, 0.5, 2.0);
    for has_grid in [false, true] {
        for carries in [Vec3::ONE, Vec3::new(1.0, 0.25, 0.0625), Vec3::new(0.3, 0.5, 3.0)] {
            for distance in [2.0f32, 12.5, 30.0] {
                let medium = medium(extinction, has_grid);
                let depth = optical_depth(has_grid, distance.into());
                // Of each channel: escapes, collisions, shadow rays.
                let mut sums = [[Mean::default(); 3]; 3];
                for i in 0..samples(200_000) {
                    let free = flight(&medium, distance, carries, false, 3, i);
                    let shadow = flight(&medium, distance, carries, true, 4, i);
                    let balance = carries.dot(free.weight) / (carries.x + carries.y + carries.z);
                    assert!((balance - 1.0).abs() < 1e-4, "{balance}");
                    assert!(!shadow.collided && free.distance <= distance);
                    for (c, [escapes, collisions, shadows]) in sums.iter_mut().enumerate() {
                        let weight = f64::from(free.weight[c]);
                        escapes.add(if free.collided { 0.0 } else { weight });
                        collisions.add(if free.collided { weight } else { 0.0 });
                        shadows.add(f64::from(shadow.weight[c]));
                    }
                }
                for (c, [escapes, collisions, shadows]) in sums.iter().enumerate() {
                    let want = (-f64::from(extinction[c]) * depth).exp();
                    let name = format!("{has_grid} {carries} {distance} channel {c}: {want} {sums:?}");
                    assert!(escapes.is(want, 2e-5), "{name}");
                    assert!(collisions.is(1.0 - want, 2e-5), "{name}");
                    assert!(shadows.is(want, 2e-5), "{name}");
                    // Negative control: 5 % more extinction, where that is more than noise.
                    let other = (-1.05 * f64::from(extinction[c]) * depth).exp();
                    let is_noise = (other - want).abs() < 10.0 * escapes.error() + 1e-4;
                    assert!(is_noise || !escapes.is(other, 2e-5), "{name}");
                }
            }
        }
    }
}

/// Distances of collisions have the density of extinction times transmittance.
#[test]
fn distances_have_their_pdf() {
    for has_grid in [false, true] {
        let medium = medium(Vec3::splat(0.3), has_grid);
        let (bins, length) = (64, 22.0f64);
        let (mut observed, n) = (vec![0.0; bins + 1], samples(200_000));
        for i in 0..n {
            let flight = flight(&medium, length as f32, Vec3::ONE, false, 5, i);
            let bin = (f64::from(flight.distance) / length * bins as f64) as usize;
            observed[if flight.collided { bin.min(bins - 1) } else { bins }] += 1.0;
        }
        let escapes = |bin: usize| {
            (-0.3 * optical_depth(has_grid, length * bin as f64 / bins as f64)).exp() * f64::from(n)
        };
        let mut expected: Vec<f64> = (0..bins).map(|bin| escapes(bin) - escapes(bin + 1)).collect();
        expected.push(escapes(bins));
        let pairs = observed.iter().zip(&expected);
        assert!(pairs.clone().all(|(&o, &e)| e > 1e-3 || o == 0.0), "{has_grid}: {observed:?}");
        let p = chi_square(&observed, &expected);
        assert!(p > sidak(2), "{has_grid}: {p}");
    }
}
