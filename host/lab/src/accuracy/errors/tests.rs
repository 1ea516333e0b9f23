//! Tests the lab on images whose truth is known.

use super::super::means::{Means, difference};
use super::super::{mean_of, view};
use super::*;
use trisect_shared::math::unit_f32;
use trisect_shared::rng::PathKey;

const SIZE: u32 = 32;

/// Returns the true value of a pixel.
fn truth(pixel: u32) -> [f64; 3] {
    let (x, y) = (f64::from(pixel % SIZE), f64::from(pixel / SIZE));
    [0.2 + 0.02 * x, 0.5 + 0.3 * (0.4 * y).sin(), 0.05 + 0.001 * x * y]
}

/// Returns a random number of mean 0 and variance 1, skewed as light is: exponential, less its
/// mean.
fn draw(seed: u32, pixel: u32, channel: u32) -> f64 {
    let word = PathKey { seed, pixel, sample: channel }.words(7).x;
    -(1.0 - f64::from(unit_f32(word))).max(1e-9).ln() - 1.0
}

/// Returns an image whose mean is `factor` times the truth, with noise of standard deviation
/// `noise` relative to the truth.
fn image(seed: u32, noise: f64, factor: f64) -> Image {
    let pixel = |pixel: u32| {
        let truth = truth(pixel);
        std::array::from_fn(|c| (truth[c] * (factor + noise * draw(seed, pixel, c as u32))) as f32)
    };
    Image { width: SIZE, height: SIZE, pixels: (0..SIZE * SIZE).map(pixel).collect() }
}

/// Two halves, and the variance of their mean.
struct Reference {
    halves: [Image; 2],
    variance: Vec<[f32; 3]>,
}

/// Returns a reference whose halves have noise of relative standard deviation `noise`.
fn reference(seed: u32, noise: f64) -> Reference {
    let halves = [image(seed, noise, 1.0), image(seed + 1, noise, 1.0)];
    let variance = |pixel: u32| truth(pixel).map(|value| ((value * noise).powi(2) / 2.0) as f32);
    Reference { halves, variance: (0..SIZE * SIZE).map(variance).collect() }
}

/// Returns the mean over pixels and channels of truth² / (truth² + 0.01): the relMSE of an image
/// that is wrong by 100 %.
fn weight() -> f64 {
    let of = |pixel: u32| truth(pixel).iter().map(|v| v * v / (v * v + EPSILON)).sum::<f64>() / 3.0;
    (0..SIZE * SIZE).map(of).sum::<f64>() / f64::from(SIZE * SIZE)
}

fn errors_of(images: &[Image], reference: &Reference, flips: usize) -> Result<Errors, MetricsError> {
    let [a, b] = &reference.halves;
    let image = mean_of(a, b);
    let truth = Truth::of_halves([a, b], &reference.variance, &image, &[])?;
    let of = |image: &Image| truth.seen.flip(&view(image)).map(|map| map.mean);
    let flips: Vec<f64> = images.iter().take(flips).map(of).collect::<Result<_, _>>()?;
    Errors::of(images, &truth, &flips)
}

fn errors(run: u32, noise: f64, factor: f64) -> Errors {
    let first = 1000 * run;
    let images: Vec<Image> = (0..8).map(|s| image(first + s, noise, factor)).collect();
    errors_of(&images, &reference(first + 500, 0.02), 2).unwrap()
}

/// In 200 runs with 20 % noise and no bias each interval covers the truth in 90 of 100 runs or
/// more, and one run in a thousand is called biased.
#[test]
fn intervals_cover_the_truth() {
    let (noise, weight) = (0.2, weight());
    let runs: Vec<Errors> = (0..200).map(|run| errors(run, noise, 1.0)).collect();
    let covered = |of: &dyn Fn(&Errors) -> bool| runs.iter().filter(|errors| of(errors)).count();
    let truth = noise * noise * weight;
    let counts = [
        ("relMSE", covered(&|e| e.rel_mse.covers(truth))),
        ("variance", covered(&|e| e.variance.covers(truth))),
        ("squared bias", covered(&|e| e.squared_bias.covers(0.0))),
        ("brightness", covered(&|e| e.brightness.covers(0.0))),
    ];
    eprintln!("of 200: {counts:?}, weight {weight}");
    assert!(counts.iter().all(|(_, count)| *count >= 180), "{counts:?}");
    let biased = covered(&|e| e.biased);
    assert!(biased <= 2, "{biased} of 200 without bias are called biased");
    // Negative control: a truth that is 5 % off is not covered.
    assert!(covered(&|e| e.rel_mse.covers(1.05 * truth)) < 180);
}

/// In 200 runs with 20 % noise and a bias the intervals cover the truth in 90 of 100 runs or more,
/// including that of the squared bias.
#[test]
fn intervals_cover_a_bias() {
    let (noise, bias, weight) = (0.2, 0.03, weight());
    let runs: Vec<Errors> = (0..200).map(|run| errors(5000 + run, noise, 1.0 + bias)).collect();
    let covered = |of: &dyn Fn(&Errors) -> bool| runs.iter().filter(|errors| of(errors)).count();
    let squared = bias * bias * weight;
    let counts = [
        ("relMSE", covered(&|e| e.rel_mse.covers(squared + noise * noise * weight))),
        ("squared bias", covered(&|e| e.squared_bias.covers(squared))),
        ("variance", covered(&|e| e.variance.covers(noise * noise * weight))),
        ("brightness", covered(&|e| e.brightness.covers(bias))),
    ];
    eprintln!("of 200: {counts:?}");
    assert!(counts.iter().all(|(_, count)| *count >= 180), "{counts:?}");
    assert_eq!(covered(&|e| e.biased), 200);
}

/// A bias of 1 % of the brightness is found under 10 % noise.
#[test]
fn a_planted_bias_is_detected() {
    for run in 0..20 {
        let found = errors(20_000 + run, 0.1, 1.01);
        assert!(found.biased, "{found:?}");
        assert!(found.brightness.low > 0.0 && found.brightness.high < 0.02, "{found:?}");
    }
}

/// The error of a reference that is noisier than the images is not called a bias. (Much more noise
/// of the reference would be: the weights depend on the reference, too, and noise of 30 % adds 0.5
/// % to the squared bias.)
#[test]
fn a_noisy_reference_is_no_bias() {
    let (mut called, mut covered, mut without) = (0, 0, 0);
    for run in 0..40 {
        let first = 200_000 + 1000 * run;
        let images: Vec<Image> = (0..8).map(|s| image(first + s, 0.03, 1.0)).collect();
        let noisy = reference(first + 500, 0.1);
        let found = errors_of(&images, &noisy, 0).unwrap();
        called += u32::from(found.biased);
        covered += u32::from(found.squared_bias.covers(0.0));
        // Negative control: a reference that claims to have no noise.
        let variance = vec![[0.0; 3]; noisy.variance.len()];
        without += u32::from(errors_of(&images, &Reference { variance, ..noisy }, 0).unwrap().biased);
    }
    assert!(called <= 1 && covered >= 36, "{called} of 40 called biased, {covered} covered");
    assert!(without >= 20, "{without}: a comparison that cannot fail");
}

/// Four times the variance is called noise, not bias.
#[test]
fn a_planted_variance_is_not_called_bias() {
    let weight = weight();
    for run in 0..20 {
        let (plain, noisy) = (errors(30_000 + run, 0.2, 1.0), errors(30_000 + run, 0.4, 1.0));
        assert!(!noisy.biased, "{noisy:?}");
        assert!(noisy.differs(&plain).p < 1e-6);
        assert!((noisy.variance.value / (0.16 * weight) - 1.0).abs() < 0.1, "{noisy:?}");
    }
}

/// Two configurations are compared without a reference: equal means are not called different, and
/// means 1 % apart are.
#[test]
fn two_ways_are_compared_without_a_reference() {
    let means = |first: u32, noise, factor| {
        Means::of(&(0..8).map(|s| image(first + s, noise, factor)).collect::<Vec<_>>())
    };
    let mut called = 0;
    for run in 0..50 {
        let first = 100_000 + 100 * run;
        let (_, same) = difference(&means(first, 0.2, 1.0), &means(first + 50, 0.4, 1.0));
        called += u32::from(same < SIGNIFICANCE);
        let (brightness, other) = difference(&means(first, 0.1, 1.01), &means(first + 50, 0.1, 1.0));
        assert!(other < SIGNIFICANCE && brightness.low > 0.0, "{other} {brightness:?}");
    }
    assert!(called <= 1, "{called} of 50 that are the same are called different");
}

#[test]
fn other_sizes_are_refused() {
    let small = Image { width: 1, height: 1, pixels: vec![[0.0; 3]] };
    assert!(errors_of(&[small], &reference(1, 0.1), 1).is_err());
}
