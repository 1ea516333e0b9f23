//! Tests spectra on errors whose frequencies are known.

use super::super::Errors;
use super::*;
use trisect_shared::math::unit_f32;
use trisect_shared::rng::PathKey;

/// Width and height, neither of which is a power of two.
const SIZE: (u32, u32) = (96, 70);

/// Returns an image of what a function says of each pixel.
fn image(of: impl Fn(u32, u32, usize) -> f64) -> Image {
    let (width, height) = SIZE;
    let pixel = |index: u32| std::array::from_fn(|c| of(index % width, index / width, c) as f32);
    Image { width, height, pixels: (0..width * height).map(pixel).collect() }
}

fn flat() -> Image {
    image(|x, _, c| 0.5 + 0.001 * f64::from(x) + 0.1 * c as f64)
}

/// Returns a random number of mean 0, from -1 to 1.
fn draw(seed: u32, x: u32, y: u32, c: usize) -> f64 {
    let word = PathKey { seed, pixel: y * SIZE.0 + x, sample: c as u32 }.words(5).x;
    2.0 * f64::from(unit_f32(word)) - 1.0
}

/// Returns an image of the truth with noise that squares of `edge` pixels share.
fn noisy(seed: u32, edge: u32) -> Image {
    let truth = flat();
    image(|x, y, c| {
        let value = f64::from(truth.pixels[(y * SIZE.0 + x) as usize][c]);
        value + 0.1 * draw(seed, x / edge, y / edge, c)
    })
}

/// Returns the spectrum of images against one reference, and their errors.
fn found(images: &[Image]) -> (Vec<SpectrumBand>, Errors) {
    let reference = flat();
    let variance = vec![[0.0; 3]; reference.pixels.len()];
    let truth = Truth::of_halves([&reference; 2], &variance, &reference, &[]).unwrap();
    (spectrum(images, &truth), Errors::of(images, &truth, &[]).unwrap())
}

/// The parts add up to relMSE; independent noise has the density 1 in each band, within twice what
/// the number of its frequencies explains.
#[test]
fn independent_noise_is_white() {
    let images: Vec<Image> = (0..8).map(|seed| noisy(seed, 1)).collect();
    let (bands, errors) = found(&images);
    let sum: f64 = bands.iter().map(|band| band.rel_mse.value).sum();
    assert!((sum / errors.rel_mse.value - 1.0).abs() < 1e-9, "{sum} {errors:?}");
    for band in &bands[2..] {
        assert!((band.density - 1.0).abs() < 0.1, "{band:?}");
    }
    // Negative control: noise that squares of 4 pixels share.
    let shared: Vec<Image> = (0..8).map(|seed| noisy(seed, 4)).collect();
    let (bands, _) = found(&shared);
    assert!(bands[2].density > 5.0 && bands[5].density < 0.5, "{bands:?}");
}

/// A wave is in the band of its frequency alone.
#[test]
fn a_wave_is_in_its_band() {
    for (cycles, place) in [(1, 0), (2, 1), (5, 2), (8, 3), (18, 4), (40, 5)] {
        let wave = |x: u32| (std::f64::consts::TAU * f64::from(cycles * x) / f64::from(SIZE.0)).cos();
        // Constant weights: the truth of this test has one value.
        let (truth, waved) = (image(|_, _, _| 0.5), image(|x, _, _| 0.5 + 0.1 * wave(x)));
        let variance = vec![[0.0; 3]; truth.pixels.len()];
        let truth = Truth::of_halves([&truth; 2], &variance, &truth, &[]).unwrap();
        let bands = spectrum(&[waved.clone(), waved], &truth);
        let all: f64 = bands.iter().map(|band| band.rel_mse.value).sum();
        assert_eq!(bands.len(), BANDS);
        assert!(bands[place].rel_mse.value > 0.999 * all, "{cycles}: {bands:?}");
    }
}

/// Noise of a reference of two halves adds nothing in the mean.
#[test]
fn noise_of_the_reference_is_not_counted() {
    let (a, b) = (noisy(100, 1), noisy(101, 1));
    let mean = super::super::mean_of(&a, &b);
    let variance = vec![[0.0; 3]; mean.pixels.len()];
    let images: Vec<Image> = (0..4).map(|_| flat()).collect();
    let halves = Truth::of_halves([&a, &b], &variance, &mean, &[]).unwrap();
    let one = Truth::of_halves([&mean; 2], &variance, &mean, &[]).unwrap();
    let sum = |truth: &Truth| -> f64 { spectrum(&images, truth).iter().map(|band| band.rel_mse.value).sum() };
    assert!(sum(&halves).abs() < 0.1 * sum(&one), "{} {}", sum(&halves), sum(&one));
}

/// Images of one pixel, one row or one column have the frequencies that there are.
#[test]
fn small_images_have_fewer_bands() {
    for (width, height) in [(1, 1), (1, 7), (64, 1), (3, 2)] {
        let of = |value: f32| Image { width, height, pixels: vec![[value; 3]; (width * height) as usize] };
        let truth = of(0.5);
        let variance = vec![[0.0; 3]; truth.pixels.len()];
        let truth = Truth::of_halves([&truth; 2], &variance, &truth, &[]).unwrap();
        let bands = spectrum(&[of(0.6), of(0.6)], &truth);
        let wanted = 0.1f64.powi(2) / (0.25 + EPSILON);
        assert_eq!(bands[0].from, 0.0);
        assert!((bands[0].rel_mse.value / wanted - 1.0).abs() < 1e-6, "{width}x{height}: {bands:?}");
        assert!(bands[1..].iter().all(|band| band.rel_mse.value.abs() < 1e-12), "{bands:?}");
    }
}
