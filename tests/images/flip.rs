//! LDR-FLIP against NVIDIA's C++ code (crate `nv-flip`), pixel by pixel.
//!
//! Both sides get the same 8-bit sRGB images; ours are decoded to linear with
//! the module's own transfer function.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::metrics::ImageView;
use trisect::metrics::flip::{DEFAULT_PIXELS_PER_DEGREE, FlipMap, flip_at};
use trisect::metrics::srgb::decode;

/// Maximum deviation of a pixel.
///
/// Both codes work in single precision and round in different places (weights, cube root, order of
/// sums). The feature difference d enters as √d, so where it vanishes, a rounding error of δ moves
/// the exponent of the colour error c by √(δ/√2), and the result by up to |c ln c| ≤ 1/e of that. A
/// response is a sum of 19 products of values up to 1, each rounded to 2⁻²⁴; with δ of 4 such
/// roundings the result moves by 1.5e-4. Elsewhere errors are near 1e-6.
const PIXEL_TOLERANCE: f32 = 1.5e-4;
/// Maximum deviation of the mean: a third of a pixel's. Averaging gains nothing on a uniform pair
/// of images, whose pixels all have the same rounding error.
const MEAN_TOLERANCE: f64 = 5e-5;

struct Pair {
    name: &'static str,
    width: usize,
    height: usize,
    image: Vec<[u8; 3]>,
    reference: Vec<[u8; 3]>,
}

impl Pair {
    fn new(
        name: &'static str,
        (width, height): (usize, usize),
        mut image: impl FnMut(usize, usize) -> [u8; 3],
        mut reference: impl FnMut(usize, usize) -> [u8; 3],
    ) -> Self {
        let grid = || (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
        let image = grid().map(|(x, y)| image(x, y)).collect();
        let reference = grid().map(|(x, y)| reference(x, y)).collect();
        Self { name, width, height, image, reference }
    }

    fn ours(&self, ppd: f32) -> FlipMap {
        let linear = |p: &[[u8; 3]]| -> Vec<[f32; 3]> {
            p.iter().map(|p| p.map(|v| decode(f32::from(v) / 255.0))).collect()
        };
        let (image, reference) = (linear(&self.image), linear(&self.reference));
        let image = ImageView::new(self.width, self.height, &image).unwrap();
        let reference = ImageView::new(self.width, self.height, &reference).unwrap();
        flip_at(&image, &reference, ppd).unwrap()
    }

    fn theirs(&self, ppd: f32) -> Vec<f32> {
        let (w, h) = (self.width as u32, self.height as u32);
        let view = |p: &[[u8; 3]]| nv_flip::FlipImageRgb8::with_data(w, h, p.as_flattened());
        nv_flip::flip(view(&self.reference), view(&self.image), ppd).to_vec()
    }
}

/// Returns the maximum deviation of a pixel, and the deviation of the mean.
fn deviations(ours: &FlipMap, theirs: &[f32]) -> (f32, f64) {
    assert_eq!(ours.errors.len(), theirs.len());
    let pixels = ours.errors.iter().zip(theirs).map(|(a, b)| (a - b).abs());
    let mean = theirs.iter().map(|&e| f64::from(e)).sum::<f64>() / theirs.len() as f64;
    (pixels.fold(0.0, f32::max), (ours.mean - mean).abs())
}

fn agrees((pixel, mean): (f32, f64)) -> bool {
    pixel <= PIXEL_TOLERANCE && mean <= MEAN_TOLERANCE
}

/// Returns a generator of uniform 8-bit noise (xorshift).
fn noise(seed: u32) -> impl FnMut() -> u8 {
    let mut state = seed;
    move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state >> 16) as u8
    }
}

fn noise_image(seed: u32) -> impl FnMut(usize, usize) -> [u8; 3] {
    let mut next = noise(seed);
    move |_, _| [next(), next(), next()]
}

fn gradient(x: usize, y: usize) -> [u8; 3] {
    [(2 * x).min(255) as u8, (3 * y).min(255) as u8, (x + y).min(255) as u8]
}

fn checker(x: usize, y: usize) -> [u8; 3] {
    if (x / 9 + y / 7).is_multiple_of(2) { [250, 240, 20] } else { [10, 30, 90] }
}

/// Returns noise on a coarse grid, interpolated bilinearly.
fn blurred_noise(seed: u32) -> impl FnMut(usize, usize) -> [u8; 3] {
    const CELL: usize = 6;
    const GRID: usize = 32;
    let mut next = noise(seed);
    let knots: Vec<[u8; 3]> = (0..GRID * GRID).map(|_| [next(), next(), next()]).collect();
    move |x, y| {
        let (i, j) = (x / CELL, y / CELL);
        let (s, t) = ((x % CELL) as f32 / CELL as f32, (y % CELL) as f32 / CELL as f32);
        std::array::from_fn(|c| {
            let knot = |i: usize, j: usize| f32::from(knots[j * GRID + i][c]);
            let top = knot(i, j) * (1.0 - s) + knot(i + 1, j) * s;
            let bottom = knot(i, j + 1) * (1.0 - s) + knot(i + 1, j + 1) * s;
            (top * (1.0 - t) + bottom * t) as u8
        })
    }
}

fn grey(level: u8) -> impl FnMut(usize, usize) -> [u8; 3] {
    move |_, _| [level; 3]
}

fn noisy_gradient(seed: u32) -> impl FnMut(usize, usize) -> [u8; 3] {
    let mut next = noise(seed);
    move |x, y| gradient(x, y).map(|v| v.saturating_add(next() / 32))
}

fn pairs() -> Vec<Pair> {
    let small = (64, 48);
    let odd = (131, 77);
    let rotated = |x, y| {
        let [r, g, b] = gradient(x, y);
        [g, b, r]
    };
    let brighter = |x, y| checker(x, y).map(|v| v.saturating_add(3));
    let mut blurred = blurred_noise(11);
    let off_by_one = move |x, y| blurred(x, y).map(|v| v.saturating_add(1));
    vec![
        Pair::new("noise, independent", small, noise_image(1), noise_image(2)),
        Pair::new("noise, independent, odd size", odd, noise_image(3), noise_image(4)),
        Pair::new("gradient, noisy", odd, noisy_gradient(5), gradient),
        Pair::new("gradient, channels rotated", small, rotated, gradient),
        Pair::new("edges, shifted", odd, |x, y| checker(x + 1, y + 1), checker),
        Pair::new("edges, brighter", small, brighter, checker),
        Pair::new("blurred noise, independent", odd, blurred_noise(7), blurred_noise(8)),
        Pair::new("blurred noise, unblurred", small, noise_image(9), blurred_noise(10)),
        Pair::new("blurred noise, one code up", small, off_by_one, blurred_noise(11)),
        Pair::new("black, white", small, grey(0), grey(255)),
        Pair::new("one pixel", (1, 1), grey(40), grey(90)),
        Pair::new("one row", (40, 1), noise_image(12), noise_image(13)),
        Pair::new("one column", (1, 40), noise_image(14), noise_image(15)),
    ]
}

#[test]
fn every_pixel_agrees_with_nvidias_code() {
    let (mut pixel, mut mean) = (0.0_f32, 0.0_f64);
    for pair in pairs() {
        for ppd in [DEFAULT_PIXELS_PER_DEGREE, 67.0, 30.0] {
            let deviation = deviations(&pair.ours(ppd), &pair.theirs(ppd));
            println!(
                "{:30} {ppd:7.3} px/deg: pixel {:.2e}, mean {:.2e}",
                pair.name, deviation.0, deviation.1
            );
            assert!(agrees(deviation), "{}: {deviation:?}", pair.name);
            (pixel, mean) = (pixel.max(deviation.0), mean.max(deviation.1));
        }
    }
    println!("greatest: pixel {pixel:.2e}, mean {mean:.2e}");
}

#[test]
fn identical_images_agree_exactly() {
    for mut pair in pairs() {
        pair.image.clone_from(&pair.reference);
        let ours = pair.ours(DEFAULT_PIXELS_PER_DEGREE);
        assert_eq!(ours.errors, pair.theirs(DEFAULT_PIXELS_PER_DEGREE), "{}", pair.name);
        assert_eq!(ours.mean, 0.0);
    }
}

/// Negative control: a viewing distance that is off by one pixel per degree is rejected wherever
/// the filters find detail.
#[test]
fn a_wrong_viewing_distance_is_rejected() {
    for pair in pairs().into_iter().filter(|p| !["black, white", "one pixel"].contains(&p.name)) {
        let deviation = deviations(&pair.ours(66.0), &pair.theirs(67.0));
        println!(
            "{:30} 66 against 67 px/deg: pixel {:.2e}, mean {:.2e}",
            pair.name, deviation.0, deviation.1
        );
        assert!(!agrees(deviation), "{}: {deviation:?}", pair.name);
    }
}

/// Negative control: one wrong pixel of the map exceeds the tolerance.
#[test]
fn one_wrong_pixel_is_rejected() {
    for pair in pairs() {
        let (mut ours, theirs) = (pair.ours(67.0), pair.theirs(67.0));
        let middle = ours.errors.len() / 2;
        ours.errors[middle] += 3.0 * PIXEL_TOLERANCE;
        assert!(!agrees(deviations(&ours, &theirs)), "{}", pair.name);
    }
}

/// Negative control: one channel of one input pixel that is off by four codes exceeds the
/// tolerance.
#[test]
fn one_wrong_input_pixel_is_rejected() {
    for mut pair in pairs() {
        let theirs = pair.theirs(67.0);
        let middle = pair.image.len() / 2;
        pair.image[middle][1] ^= 4;
        assert!(!agrees(deviations(&pair.ours(67.0), &theirs)), "{}", pair.name);
    }
}
