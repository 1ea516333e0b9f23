//! Tests the evaluation on images whose truth is known.

mod files;

use super::*;
use crate::statistics::Interval;
use trisect::image::Image;
use trisect::metrics::REL_MSE_EPSILON;
use trisect_shared::math::unit_f32;
use trisect_shared::rng::PathKey;

const SIZE: u32 = 32;

/// Evaluations of a test, each with other random numbers.
const RUNS: u32 = 100;

/// Returns the true value of a pixel.
fn true_value(pixel: u32) -> [f64; 3] {
    let (x, y) = (f64::from(pixel % SIZE), f64::from(pixel / SIZE));
    [0.3 + 0.03 * y, 0.4 + 0.2 * (0.3 * x).cos(), 0.02 + 0.002 * x * y]
}

/// Returns a random number of mean 0 and variance 1, skewed as light is.
fn draw(seed: u32, pixel: u32, channel: u32) -> f64 {
    let word = PathKey { seed, pixel, sample: channel }.words(9).x;
    -(1.0 - f64::from(unit_f32(word))).max(1e-9).ln() - 1.0
}

/// Returns an image whose mean is `factor` times the truth, with noise of standard deviation
/// `noise` relative to the truth. `share` pixels beside each other, a power of two, have the same
/// random number.
fn image_of(seed: u32, noise: f64, factor: f64, share: u32) -> Image {
    let pixel = |pixel: u32| {
        let truth = true_value(pixel);
        let number = |c: usize| draw(seed, pixel / share, c as u32);
        std::array::from_fn(|c| (truth[c] * (factor + noise * number(c))) as f32)
    };
    Image { width: SIZE, height: SIZE, pixels: (0..SIZE * SIZE).map(pixel).collect() }
}

fn images_of(first: u32, count: u32, noise: f64, factor: f64) -> Vec<Image> {
    (0..count).map(|seed| image_of(first + seed, noise, factor, 1)).collect()
}

/// Returns the relMSE and the squared error of an image that is wrong by 100 %.
fn weights() -> (f64, f64) {
    let (mut relative, mut plain) = (0.0, 0.0);
    for value in (0..SIZE * SIZE).flat_map(true_value) {
        relative += value * value / (value * value + REL_MSE_EPSILON);
        plain += value * value;
    }
    let count = f64::from(3 * SIZE * SIZE);
    (relative / count, plain / count)
}

/// Evaluates one set against reference images.
fn row(images: Vec<Image>, reference: Vec<Image>) -> Row {
    let times = Times { seconds: vec![4.0], ..Times::default() };
    let reference = ReferenceImages::new(reference, &[]).unwrap();
    evaluate(&[ImageSet::new("set", images, times)], &reference).unwrap().rows.remove(0)
}

/// Returns evaluations of sets of eight images with 20 % noise and this bias, against `count`
/// reference images with this noise.
fn runs(first: u32, bias: f64, count: u32, reference_noise: f64) -> Vec<Row> {
    let run = |run: u32| {
        let first = first + 100 * run;
        row(images_of(first, 8, 0.2, 1.0 + bias), images_of(first + 50, count, reference_noise, 1.0))
    };
    (0..RUNS).map(run).collect()
}

/// Returns by quantity how many intervals cover the truth of images with 20 % noise and a bias.
fn covered(runs: &[Row], bias: f64) -> [(&'static str, usize); 6] {
    let (relative, plain) = weights();
    let (variance, squared) = (0.2 * 0.2, bias * bias);
    let count =
        |of: &dyn Fn(&Row) -> Interval, truth: f64| runs.iter().filter(|row| of(row).covers(truth)).count();
    [
        ("relMSE", count(&|row| row.errors.rel_mse, relative * (variance + squared))),
        ("RMSE", count(&|row| row.errors.rmse, (plain * (variance + squared)).sqrt())),
        ("noise", count(&|row| row.errors.variance, relative * variance)),
        ("squared bias", count(&|row| row.errors.squared_bias, relative * squared)),
        ("brightness", count(&|row| row.errors.brightness, bias)),
        ("at 1 s", count(&|row| row.noise_at_one_second.unwrap(), (relative * variance * 4.0).sqrt())),
    ]
}

/// Each interval covers the truth in 90 of 100 evaluations or more: for references of few and of
/// many images, with an own error of up to 4 %, and with and without a bias.
#[test]
fn intervals_cover_the_truth() {
    for (first, bias, count, noise) in [
        (100_000, 0.0, 8, 0.1),
        (200_000, 0.0, 2, 0.05),
        (300_000, 0.03, 8, 0.1),
        (400_000, 0.03, 3, 0.05),
        (500_000, 0.1, 16, 0.1),
    ] {
        let runs = runs(first, bias, count, noise);
        let counts = covered(&runs, bias);
        eprintln!("bias {bias}, {count} reference images of noise {noise}: {counts:?} of {RUNS}");
        assert!(counts.iter().all(|(_, count)| *count >= 90), "{counts:?}");
    }
}

/// A bias is found in all evaluations, and in none or one without it.
#[test]
fn a_bias_is_found() {
    let biased = |runs: &[Row]| runs.iter().filter(|row| row.errors.biased).count();
    let (with, without) = (biased(&runs(600_000, 0.03, 8, 0.1)), biased(&runs(700_000, 0.0, 8, 0.1)));
    eprintln!("called biased: {with} with a bias of 3 %, {without} without, of {RUNS} each");
    assert_eq!(with, RUNS as usize);
    assert!(without <= 1, "{without}");
}

/// Negative control: against a reference that is 5 % too bright, intervals miss the truth, and
/// images without a bias are called biased.
#[test]
fn a_wrong_reference_is_seen() {
    let run = |run: u32| {
        let first = 800_000 + 100 * run;
        row(images_of(first, 8, 0.2, 1.0), images_of(first + 50, 8, 0.1, 1.05))
    };
    let runs: Vec<Row> = (0..RUNS).map(run).collect();
    let counts = covered(&runs, 0.0);
    eprintln!("reference 5 % too bright: {counts:?}");
    for (name, count) in counts {
        assert!(count < 90 || !matches!(name, "squared bias" | "brightness"), "{name}: {count}");
    }
    assert!(runs.iter().all(|row| row.errors.biased));
}

/// The noise of a reference of one image is unknown: it counts as bias, and the result says so.
/// Several images of the same noise are no bias.
#[test]
fn one_reference_image() {
    let noise = 0.03;
    let one = ReferenceImages::new(images_of(900_050, 1, noise, 1.0), &[]).unwrap();
    assert_eq!((one.error(), one.count()), (None, 1));
    let set = ImageSet::new("set", images_of(900_000, 8, 0.2, 1.0), Times::default());
    let found = evaluate(std::slice::from_ref(&set), &one).unwrap();
    let bias = found.rows[0].errors.squared_bias;
    assert!(bias.low > 0.0 && (bias.value / (noise * noise * weights().0) - 1.0).abs() < 0.3, "{bias:?}");
    assert!(found.table().contains("own noise is unknown") && found.table().contains("difference"));
    let more = ReferenceImages::new(images_of(900_050, 8, noise, 1.0), &[]).unwrap();
    let expected = noise * (weights().0 / 8.0).sqrt();
    assert!((more.error().unwrap() / expected - 1.0).abs() < 0.1, "{:?}", more.error());
    let found = evaluate(&[set], &more).unwrap();
    assert!(found.rows[0].errors.squared_bias.covers(0.0) && !found.rows[0].errors.biased);
    assert!(found.table().contains("no bias seen"), "{}", found.table());
}

/// Noise that neighbouring pixels share does not look like a bias of blocks, because the noise of
/// the reference is taken from the means of its images.
#[test]
fn shared_noise_is_no_bias() {
    let shared = |first: u32, count: u32, noise: f64| -> Vec<Image> {
        (0..count).map(|seed| image_of(first + seed, noise, 1.0, 16)).collect()
    };
    let significant = |row: &Row| row.errors.means_p < 1e-3;
    let (mut with, mut without) = (0, 0);
    for run in 0..RUNS {
        let first = 1_000_000 + 100 * run;
        let (images, reference) = (shared(first, 8, 0.02), shared(first + 50, 8, 0.1));
        with += usize::from(significant(&row(images.clone(), reference.clone())));
        // Negative control: the mean of that reference as one image without noise.
        let mean = ReferenceImages::new(reference, &[]).unwrap().image().clone();
        without += usize::from(significant(&row(images, vec![mean])));
    }
    eprintln!("means differ significantly: {with} of {RUNS}, {without} without the reference's noise");
    assert!(with <= 1 && without >= 20, "{with}, {without}");
}

/// Times are those of each image, of all, or unknown.
#[test]
fn times_decide_the_efficiency() {
    let reference = ReferenceImages::new(images_of(1_100_050, 4, 0.05, 1.0), &[]).unwrap();
    let images = || images_of(1_100_000, 4, 0.2, 1.0);
    let of = |seconds: &[f64]| {
        let times = Times { seconds: seconds.to_vec(), ..Times::default() };
        evaluate(&[ImageSet::new("set", images(), times)], &reference).map(|mut found| found.rows.remove(0))
    };
    let row = of(&[1.0, 2.0, 2.0, 9.0]).unwrap();
    assert_eq!(row.seconds.unwrap().median, 2.0);
    let efficiency = 1.0 / (2.0 * row.errors.rel_mse.value);
    assert!((row.efficiency.unwrap().value / efficiency - 1.0).abs() < 1e-12);
    assert_eq!(of(&[2.0]).unwrap().efficiency.unwrap().value, row.efficiency.unwrap().value);
    let none = of(&[]).unwrap();
    assert!(none.seconds.is_none() && none.efficiency.is_none() && none.noise_at_one_second.is_none());
    for bad in [vec![1.0, 2.0], vec![0.0], vec![f64::NAN], vec![-1.0; 4]] {
        assert!(matches!(of(&bad), Err(EvaluateError::Times { .. })), "{bad:?}");
    }
}
