//! Measures the error of each sampler by the number of samples: relMSE, and the same of the error
//! image after a Gaussian filter, which noise without low frequencies over the screen loses in.
//!
//! ```text
//! cargo run --release -p trisect --example screen_error -- \
//!     WIDTH REFERENCE_SPP MAX_SPP SEEDS CLAMP SCENE...
//! ```
//!
//! The reference is two images of REFERENCE_SPP samples each, whose own errors cancel in the mean.
//! CLAMP limits the samples of all images, so that rare bright paths do not hide everything else.

use std::path::Path;
use std::time::Instant;
use trisect::prelude::*;

/// Standard deviation of the filter, in pixels.
const SIGMA: f64 = 1.5;

/// Seed of the first image of the reference; no other image has it.
const REFERENCE_SEED: u32 = 0x7e57;

type Pixels = Vec<[f64; 3]>;

fn render(renderer: &mut Renderer, settings: &Settings) -> Result<Pixels> {
    let image = renderer.render(settings)?.film.image();
    Ok(image.pixels.iter().map(|pixel| pixel.map(f64::from)).collect())
}

/// Returns the image filtered along x with `across`, else along y. At the border the weights are
/// those of the pixels that exist.
fn filtered_along(image: &Pixels, (width, height): (usize, usize), across: bool) -> Pixels {
    let radius = (3.0 * SIGMA).ceil() as isize;
    let step = if across { 1 } else { width };
    let mut filtered = Vec::with_capacity(image.len());
    for index in 0..image.len() {
        let (place, end) = if across { (index % width, width) } else { (index / width, height) };
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for offset in -radius..=radius {
            let Some(other) = place.checked_add_signed(offset).filter(|other| *other < end) else { continue };
            let weight = (-0.5 * (offset as f64 / SIGMA).powi(2)).exp();
            let pixel = image[index - place * step + other * step];
            (0..3).for_each(|c| sum[c] += weight * pixel[c]);
            weights += weight;
        }
        filtered.push(sum.map(|value| value / weights));
    }
    filtered
}

fn filtered(image: &Pixels, size: (usize, usize)) -> Pixels {
    filtered_along(&filtered_along(image, size, true), size, false)
}

fn product(a: &Pixels, b: &Pixels) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (0..3).map(|c| a[c] * b[c]).sum::<f64>()).sum();
    sum / (3 * a.len()) as f64
}

fn measure(scene: &Path, [width, reference, most, seeds]: [u32; 4], clamp: f32) -> Result<()> {
    let loaded = Scene::load(scene)?;
    let base = Settings::of(&loaded);
    let height = (f64::from(base.height) * f64::from(width) / f64::from(base.width)).round() as u32;
    let base = Settings { clamp: Some(clamp), ..base }.size(width, height);
    let size = (width as usize, height as usize);
    let mut renderer = Renderer::new(Device::of(Choice::Cpu)?, &loaded)?;
    let mut images = Vec::new();
    for seed in 0..2 {
        images.push(render(&mut renderer, &base.clone().spp(reference).seed(REFERENCE_SEED + seed))?);
    }
    let mut weights = images[0].clone();
    for (weight, other) in weights.iter_mut().zip(&images[1]) {
        (0..3).for_each(|c| weight[c] = (0.25 * (weight[c] + other[c]).powi(2) + 0.01).sqrt().recip());
    }
    let error = |image: &Pixels, reference: &Pixels| -> Pixels {
        let pixels = image.iter().zip(reference).zip(&weights);
        pixels.map(|((a, b), weight)| std::array::from_fn(|c| (a[c] - b[c]) * weight[c])).collect()
    };
    println!("{} {width}x{height}", scene.display());
    println!("  spp  sampler      relMSE     filtered   seconds");
    for spp in [1, 2, 4, 8, 16, 64, 256, 1024].into_iter().filter(|spp| *spp <= most) {
        for sampler in [Sampler::Independent, Sampler::Sobol] {
            let (mut plain, mut smooth, mut seconds) = (0.0, 0.0, 0.0);
            for seed in 0..seeds {
                let settings = Settings { sampler, ..base.clone() }.spp(spp).seed(seed);
                let start = Instant::now();
                let image = render(&mut renderer, &settings)?;
                seconds += start.elapsed().as_secs_f64() / f64::from(seeds);
                let (a, b) = (error(&image, &images[0]), error(&image, &images[1]));
                plain += product(&a, &b) / f64::from(seeds);
                smooth += product(&filtered(&a, size), &filtered(&b, size)) / f64::from(seeds);
            }
            println!("{spp:5}  {sampler:<12?} {plain:.3e}  {smooth:.3e}  {seconds:.4}");
        }
    }
    Ok(())
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize| arguments.get(index).and_then(|text| text.parse::<f32>().ok());
    let counts = [0, 1, 2, 3].map(|index| number(index).unwrap_or(0.0) as u32);
    let (Some(clamp), false) = (number(4), counts.contains(&0)) else {
        eprintln!("usage: screen_error WIDTH REFERENCE_SPP MAX_SPP SEEDS CLAMP SCENE...");
        std::process::exit(2);
    };
    arguments[5..].iter().try_for_each(|scene| measure(Path::new(scene), counts, clamp))
}
