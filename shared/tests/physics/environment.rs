//! Environment map: sampled directions follow their pdf, lookups agree with samples, rotation,
//! energy.

use crate::materials::NO_SCENE;
use crate::statistics::{Mean, chi_square, sidak, words};
use bytemuck::Zeroable;
use core::f64::consts::{PI, TAU};
use glam::Vec3;
use trisect_shared::environment::{EnvironmentTexel, radiance, sample};
use trisect_shared::math::luminance;
use trisect_shared::params::RenderParams;
use trisect_shared::scene::Scene;

const WIDTH: usize = 16;
const HEIGHT: usize = 8;

/// Returns an environment map whose texels are chosen by `weights`, with Vose's alias table.
fn panorama(colors: &[Vec3], weights: &[f64]) -> Vec<EnvironmentTexel> {
    let n = weights.len();
    let sum: f64 = weights.iter().sum();
    let mut left: Vec<f64> = weights.iter().map(|w| w * n as f64 / sum).collect();
    let mut texels: Vec<EnvironmentTexel> = (0..n)
        .map(|i| EnvironmentTexel {
            radiance: colors[i],
            pdf: left[i] as f32,
            threshold: u32::MAX,
            alias: i as u32,
            pad: [0; 2],
        })
        .collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| left[i] < 1.0);
    while let (Some(taker), Some(&giver)) = (small.pop(), large.last()) {
        texels[taker].threshold = (left[taker] * 4_294_967_296.0) as u32;
        texels[taker].alias = giver as u32;
        left[giver] -= 1.0 - left[taker];
        if left[giver] < 1.0 {
            large.pop();
            small.push(giver);
        }
    }
    texels
}

fn params(rotation: f64) -> RenderParams {
    let mut params = RenderParams::zeroed();
    (params.environment_width, params.environment_height) = (WIDTH as u32, HEIGHT as u32);
    (params.environment_sin, params.environment_cos) = (rotation.sin() as f32, rotation.cos() as f32);
    params
}

/// Returns colours of very different brightness, and weights; some texels are never chosen.
fn random() -> (Vec<Vec3>, Vec<f64>) {
    let colors: Vec<Vec3> = (0..WIDTH * HEIGHT)
        .map(|i| {
            let w = words(3, i as u32);
            let strength = ((w.x >> 29) as f32).exp2() / 16.0;
            Vec3::new(1.0, 0.5, 0.25) * strength + Vec3::splat(w.y as f32 / 1e10)
        })
        .collect();
    let weights =
        colors.iter().enumerate().map(|(i, &c)| if i % 11 == 5 { 0.0 } else { f64::from(luminance(c)) });
    let weights = weights.collect();
    (colors, weights)
}

/// Returns the texel that a direction points at, in double precision.
fn texel_of(d: Vec3, rotation: f64) -> usize {
    let d = d.as_dvec3();
    let clockwise = d.x.atan2(-d.z); // from -z, seen from above; the map is turned the other way
    let u = (0.5 + (clockwise + rotation) / TAU).rem_euclid(1.0);
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
    index(v, HEIGHT) * WIDTH + index(u, WIDTH)
}

/// Returns the p-value of a chi-square test of directions sampled from `texels` against `weights`,
/// for a map turned by `rotation` and judged as if turned by `judged`, in radians.
fn p(texels: &[EnvironmentTexel], weights: &[f64], rotation: f64, judged: f64) -> f64 {
    let scene = Scene { environment: texels, ..NO_SCENE };
    let params = params(rotation);
    let n = 400_000u32;
    let mut observed = vec![0.0; weights.len()];
    for i in 0..n {
        // SAFETY: the map has the size that the parameters name.
        let light = unsafe { sample(&params, scene, words(4, i)) };
        observed[texel_of(light.direction, judged)] += 1.0;
    }
    let sum: f64 = weights.iter().sum();
    let expected: Vec<f64> = weights.iter().map(|w| w / sum * f64::from(n)).collect();
    chi_square(&observed, &expected)
}

#[test]
fn directions_follow_the_weights() {
    let (colors, weights) = random();
    let texels = panorama(&colors, &weights);
    for rotation in [0.0, 0.7, 4.0] {
        let p = p(&texels, &weights, rotation, rotation);
        assert!(p > sidak(3), "{rotation}: {p}");
    }
    // Negative controls: another rotation, and one texel whose weight is a fifth higher than when
    // it was sampled.
    assert!(p(&texels, &weights, 0.7, 0.6) < 1e-9);
    let mut other = weights.clone();
    let brightest = (0..other.len()).max_by(|&a, &b| other[a].total_cmp(&other[b])).unwrap();
    other[brightest] *= 1.2;
    assert!(p(&texels, &other, 0.7, 0.7) < 1e-3);
}

/// Lookups agree with samples; the mean of 1 / pdf is the solid angle of the directions that can be
/// chosen; the mean of radiance over pdf is the radiance's integral.
#[test]
fn densities_and_energy() {
    let (colors, mut weights) = random();
    let texels = panorama(&colors, &weights);
    let scene = Scene { environment: &texels, ..NO_SCENE };
    let params = params(0.7);
    // SAFETY: as above.
    let look = |d: Vec3| unsafe { radiance(&params, scene, d) };
    let (mut covered, mut disagreeing) = (Mean::default(), 0);
    let n = 400_000u32;
    for i in 0..n {
        // SAFETY: as above.
        let light = unsafe { sample(&params, scene, words(6, i)) };
        assert!((light.direction.length() - 1.0).abs() < 1e-6 && light.pdf > 0.0);
        covered.add(1.0 / f64::from(light.pdf));
        let found = look(light.direction);
        // Rounding moves one sample in some ten thousand across the border of two texels, where the
        // radiance changes only a little.
        disagreeing += u32::from((found.pdf / light.pdf - 1.0).abs() > 1e-4);
        let error = (found.radiance - light.radiance).abs().max_element();
        assert!(error < 1e-4 * light.radiance.max_element() + 1e-4, "{found:?} {light:?}");
    }
    assert!(disagreeing < n / 2000, "{disagreeing} of {n}");
    let of_row = |row: usize| {
        let edge = |row: usize| (PI * row as f64 / HEIGHT as f64).cos();
        TAU / WIDTH as f64 * (edge(row) - edge(row + 1))
    };
    let want: f64 = (0..weights.len()).filter(|&i| weights[i] > 0.0).map(|i| of_row(i / WIDTH)).sum();
    assert!(covered.is(want, 1e-4), "{covered:?} for {want}");
    assert!(!covered.is(want * 1.02, 1e-4), "{covered:?}");

    // Energy, with each texel chosen.
    weights.iter_mut().for_each(|w| *w += 1.0);
    let texels = panorama(&colors, &weights);
    let scene = Scene { environment: &texels, ..NO_SCENE };
    let mut mean = Mean::default();
    for i in 0..n {
        // SAFETY: as above.
        let light = unsafe { sample(&params, scene, words(7, i)) };
        mean.add(f64::from(light.radiance.x) / f64::from(light.pdf));
    }
    let (rows, columns) = (HEIGHT * 16, WIDTH * 16);
    let mut integral = 0.0;
    for i in 0..rows * columns {
        let (v, u) =
            (((i / columns) as f64 + 0.5) / rows as f64, ((i % columns) as f64 + 0.5) / columns as f64);
        let ((sine, cosine), (s, c)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
        let d = Vec3::new((sine * c) as f32, cosine as f32, (sine * s) as f32);
        integral += f64::from(look(d).radiance.x) * sine * PI * TAU / (rows * columns) as f64;
    }
    assert!(mean.is(integral, 1e-3 * integral), "{mean:?} for {integral}");
    assert!(!mean.is(integral * 1.03, 1e-3 * integral), "{mean:?} for {integral}");
}

/// The middle column is seen along -z, the columns right of it towards +x; turned by 90 degrees,
/// the middle column is seen along -x.
#[test]
fn where_the_columns_are() {
    let bright = |column: usize| {
        let mut colors = vec![Vec3::ZERO; WIDTH * HEIGHT];
        (0..HEIGHT).for_each(|row| {
            colors[row * WIDTH + column] = Vec3::ONE;
            colors[row * WIDTH + column - 1] = Vec3::ONE;
        });
        panorama(&colors, &vec![1.0; WIDTH * HEIGHT])
    };
    let seen = |column, degrees: f64, d: Vec3| {
        let texels = bright(column);
        let scene = Scene { environment: &texels, ..NO_SCENE };
        // SAFETY: as above.
        unsafe { radiance(&params(degrees.to_radians()), scene, d) }.radiance.x
    };
    let (middle, quarter) = (WIDTH / 2, WIDTH * 3 / 4);
    assert!(seen(middle, 0.0, Vec3::NEG_Z) > 0.99 && seen(middle, 0.0, Vec3::Z) < 0.01);
    assert!(seen(quarter, 0.0, Vec3::X) > 0.99 && seen(quarter, 0.0, Vec3::NEG_X) < 0.01);
    assert!(seen(middle, 90.0, Vec3::NEG_X) > 0.99 && seen(middle, 90.0, Vec3::X) < 0.01);
}
