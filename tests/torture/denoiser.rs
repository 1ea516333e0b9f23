//! The denoiser: what it must keep, what it must not spread, and where it helps (37 to 40).

use glam::Vec3;
use trisect::denoise::{DenoiseSettings, Filter};
use trisect::film::{Film, SampleBlock};
use trisect::image::Image;
use trisect::metrics::{ImageView, compare};
use trisect::render::{Renderer, Sampler, Settings};
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::film::PixelSums;
use trisect_shared::rng::PathKey;
use trisect_tests::renders::{cpu, independent};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

/// The two filters with their default settings.
const FILTERS: [DenoiseSettings; 2] =
    [DenoiseSettings::new(Filter::Atrous), DenoiseSettings::new(Filter::Svgf)];

/// An image of a plane of this albedo that faces the camera at a distance of 5, with one sample per
/// pixel.
struct Wall {
    width: u32,
    height: u32,
    albedo: Vec3,
    radiance: Vec<Vec3>,
}

impl Wall {
    fn new(width: u32, height: u32, radiance: impl Fn(u32) -> Vec3) -> Self {
        let radiance = (0..width * height).map(radiance).collect();
        Self { width, height, albedo: Vec3::splat(0.5), radiance }
    }

    fn settings(&self) -> Settings {
        let scene = scene("three_spheres.ron");
        Settings { width: self.width, height: self.height, samples: 1, ..independent(&scene) }
    }

    fn film(&self, renderer: &Renderer, settings: &Settings) -> Film {
        let camera = renderer.camera(settings);
        let axis = camera.step_x.cross(camera.step_y).normalize();
        let sums = |radiance: &Vec3| PixelSums {
            radiance: *radiance,
            // A kernel's firewall leaves out samples that are not finite.
            samples: u32::from(radiance.is_finite()),
            squares: *radiance * *radiance,
            segments: 1,
        };
        let guides = |pixel: u32| {
            let (x, y) = (pixel % self.width, pixel / self.width);
            let target = camera.corner + camera.step_x * (x as f32 + 0.5) + camera.step_y * (y as f32 + 0.5);
            AovSums {
                normal: -axis,
                hits: 1,
                albedo: self.albedo,
                primitive: NO_PRIMITIVE,
                position: camera.origin + target * (5.0 / target.dot(axis)),
                ..AovSums::ZERO
            }
        };
        let mut film = Film::with_aovs(self.width, self.height);
        let part = SampleBlock { rows: 0..self.height, samples: 0..1 };
        film.merge(&part, &self.radiance.iter().map(sums).collect::<Vec<_>>()).unwrap();
        film.merge_aovs(&part, &(0..self.width * self.height).map(guides).collect::<Vec<_>>()).unwrap();
        film
    }

    fn denoised(&self, renderer: &mut Renderer, denoise: &DenoiseSettings) -> Image {
        let settings = self.settings();
        let film = self.film(renderer, &settings);
        let image = renderer.denoise(&film, &settings, denoise).unwrap().0;
        assert_eq!((image.width, image.height), (self.width, self.height));
        image
    }
}

/// Opens one renderer for a whole test, because a driver may fail after it has opened many.
fn open(subject: BackendUnderTest) -> Option<Renderer> {
    subject.renderer(&scene("three_spheres.ron"))
}

/// Returns random radiance between 0 and 2 for a pixel.
fn noise(pixel: u32) -> Vec3 {
    let words = PathKey { seed: 37, pixel, sample: 0 }.words(0);
    Vec3::new(words.x as f32, words.y as f32, words.z as f32) * 2.0f32.powi(-31)
}

/// A constant image of any size has the bits of a constant image of one pixel.
fn t37_constant_image(subject: BackendUnderTest) {
    let light = |_| Vec3::new(0.7, 0.1, 3.3);
    let Some(renderer) = &mut open(subject) else { return };
    let sizes = [(1, 1), (1, 9), (9, 1), (2, 2), (3, 3), (5, 4), (33, 17)];
    for denoise in FILTERS {
        let one = Wall::new(1, 1, light).denoised(renderer, &denoise);
        for (width, height) in sizes {
            let image = Wall::new(width, height, light).denoised(renderer, &denoise);
            assert!(image.pixels.iter().all(|&pixel| pixel == one.pixels[0]), "{denoise:?} {width}x{height}");
        }
        // Multiplying by the albedo after dividing by it rounds twice.
        let off = one.pixels[0].iter().zip(light(0).to_array()).map(|(a, b)| (a / b - 1.0).abs());
        assert!(off.fold(0.0, f32::max) <= 2.0 * f32::EPSILON);
    }
    // Negative control: a pixel that is brighter by a hundredth shows in its neighbours.
    let spot = |pixel| light(pixel) * if pixel == 40 { 1.01 } else { 1.0 };
    let image = Wall::new(9, 9, spot).denoised(renderer, &FILTERS[0]);
    assert_ne!(image.pixels[41], image.pixels[0], "a filter that does nothing");
    report(
        37,
        subject,
        Outcome::Passed,
        format!("{} sizes from 1x1, both filters: the same bits", sizes.len()),
    );
}

/// Returns the à-trous transform without edge stopping, in f64.
fn blurred(wall: &Wall, levels: u32) -> Vec<[f64; 3]> {
    let (width, height) = (wall.width as i64, wall.height as i64);
    let mut image: Vec<[f64; 3]> = wall.radiance.iter().map(|r| r.to_array().map(f64::from)).collect();
    for level in 0..levels {
        let next = |pixel: usize| {
            let (x, y) = (pixel as i64 % width, pixel as i64 / width);
            let (mut sum, mut total) = ([0.0; 3], 0.0);
            for (i, j) in (-2i64..=2).flat_map(|j| (-2i64..=2).map(move |i| (i, j))) {
                let (u, v) = (x + (i << level), y + (j << level));
                if (0..width).contains(&u) && (0..height).contains(&v) {
                    let b3 = [0.375, 0.25, 0.0625];
                    let weight = b3[i.unsigned_abs() as usize] * b3[j.unsigned_abs() as usize];
                    (0..3).for_each(|c| sum[c] += weight * image[(v * width + u) as usize][c]);
                    total += weight;
                }
            }
            sum.map(|s| s / total)
        };
        image = (0..image.len()).map(next).collect();
    }
    image
}

/// Edge stopping of 0 leaves the image as it is; infinite edge stopping leaves the plain B3 spline.
fn t38_stops(subject: BackendUnderTest) {
    let Some(renderer) = &mut open(subject) else { return };
    let wall = Wall::new(41, 29, noise);
    let mut worst = 0.0f64;
    for denoise in FILTERS {
        let shut = DenoiseSettings { color: 0.0, normal: 0.0, depth: 0.0, ..denoise };
        let same = wall.denoised(renderer, &shut);
        let off = |(a, b): (&[f32; 3], &Vec3)| (Vec3::from(*a) - *b).abs().max_element();
        let change = same.pixels.iter().zip(&wall.radiance).map(off).fold(0.0, f32::max);
        assert!(change <= 4.0 * f32::EPSILON, "{denoise:?}: sigma 0 changes by {change}");

        let open =
            DenoiseSettings { color: f32::INFINITY, normal: f32::INFINITY, depth: f32::INFINITY, ..denoise };
        let open = wall.denoised(renderer, &open);
        let want = blurred(&wall, denoise.levels);
        for (got, want) in open.pixels.iter().zip(&want) {
            (0..3).for_each(|c| worst = worst.max((f64::from(got[c]) - want[c]).abs()));
        }
        // Negative controls: the blurred image differs from the input, and from a blur of one level
        // less.
        assert!(open.pixels.iter().zip(&wall.radiance).map(off).fold(0.0, f32::max) > 0.1);
        let less = blurred(&wall, denoise.levels - 1);
        let apart = want.iter().zip(&less).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f64::max);
        assert!(apart > 1e-2);
    }
    // Five levels of 25 sums of numbers up to 2, each off by half a unit in the last place: 125 *
    // 1.2e-7. A tenth of that occurs.
    assert!(worst < 1.5e-5, "{worst}");
    report(38, subject, Outcome::Passed, format!("0: as it was; infinite: B3 within {worst:.1e}"));
}

/// NaN, infinity, fireflies of 1e30 and black albedo neither spread nor give NaN.
fn t39_what_is_no_light(subject: BackendUnderTest) {
    const AT: u32 = 20 * 41 + 17;
    let Some(renderer) = &mut open(subject) else { return };
    let distant = |pixel: u32| {
        let (x, y) = (pixel % 41, pixel / 41);
        x.abs_diff(17) > 2 || y.abs_diff(20) > 2
    };
    let calm = |pixel| Vec3::splat(0.5) + noise(pixel) * 0.01;
    for denoise in FILTERS {
        for value in [f32::NAN, f32::INFINITY] {
            let hole = |pixel| if pixel == AT { Vec3::splat(value) } else { calm(pixel) };
            let wall = Wall::new(41, 31, hole);
            let image = wall.denoised(renderer, &denoise);
            // The hole is filled from its neighbours, and does not affect other pixels.
            for pixel in image.pixels.iter().flatten() {
                assert!((0.49..0.53).contains(pixel), "{denoise:?} {value}: {pixel}");
            }
            // Negative control: the film holds the value.
            let raw = wall.film(renderer, &wall.settings()).image().pixels;
            assert!(!raw[AT as usize][0].is_finite() && raw[0][0].is_finite());
        }
        let firefly = |pixel| if pixel == AT { Vec3::splat(1e30) } else { calm(pixel) };
        let image = Wall::new(41, 31, firefly).denoised(renderer, &denoise);
        assert!(image.pixels.iter().flatten().all(|value| value.is_finite()), "{denoise:?}: firefly");
        if denoise.filter == Filter::Atrous {
            let others = (0..).zip(&image.pixels).filter(|(pixel, _)| *pixel != AT && distant(*pixel));
            assert!(others.map(|(_, p)| p[0]).all(|p| (0.49..0.53).contains(&p)), "{denoise:?}: it spreads");
        }
        // A black albedo reflects nothing and stays black, without a division by 0.
        let black = Wall { albedo: Vec3::ZERO, ..Wall::new(41, 31, |_| Vec3::ZERO) };
        let image = black.denoised(renderer, &denoise);
        assert!(image.pixels.iter().flatten().all(|&value| value == 0.0), "{denoise:?}: black");
        // Light on a black albedo, as from rounding, stays finite.
        let lit = Wall { albedo: Vec3::ZERO, ..Wall::new(41, 31, calm) };
        let image = lit.denoised(renderer, &denoise);
        assert!(image.pixels.iter().flatten().all(|value| (0.4..0.6).contains(value)), "{denoise:?}: dark");
        // A film without any valid sample.
        let nothing = Wall::new(5, 4, |_| Vec3::NAN);
        let image = nothing.denoised(renderer, &denoise);
        assert!(image.pixels.iter().flatten().all(|value| value.is_nan()), "{denoise:?}: invented");
    }
    let figure = "NaN and infinity are filled in and do not spread, 1e30 stays finite, black stays black";
    report(39, subject, Outcome::Passed, figure);
}

fn view(image: &Image) -> ImageView<'_> {
    ImageView::new(image.width as usize, image.height as usize, &image.pixels).unwrap()
}

/// The denoised image is nearer to the reference at few samples; the test reports from how many
/// samples on it is not.
fn t40_error_by_samples(subject: BackendUnderTest) {
    let scene = scene("cornell_box.ron");
    let size = Settings { width: 64, height: 64, samples: 1, seed: 5, guides: true, ..independent(&scene) };
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let sobol = Settings { samples: 2048, seed: 9, sampler: Sampler::Sobol, guides: false, ..size.clone() };
    let reference = cpu(&scene).render(&sobol).unwrap().film.image();
    let error = |image: &Image| compare(&view(image), &view(&reference)).unwrap().rel_mse;
    let spp: &[u32] = if subject.is_software() { &[1, 4] } else { &[1, 4, 16, 64, 256, 1024] };
    let mut figures = Vec::new();
    for denoise in FILTERS {
        let mut harms = None;
        let mut gain_at_1 = 0.0;
        for &samples in spp {
            let settings = Settings { samples, ..size.clone() };
            let film = renderer.render(&settings).unwrap().film;
            let image = renderer.denoise(&film, &settings, denoise).unwrap().0;
            let gain = error(&film.image()) / error(&image);
            if samples == 1 {
                gain_at_1 = gain;
            }
            if gain < 1.0 && harms.is_none() {
                harms = Some(samples);
            }
        }
        // `docs/notebook/torture-tests.md` has the gains. The negative control below, a closed
        // filter, gains 1.
        assert!(gain_at_1 > 2.0, "{denoise:?}: {gain_at_1}");
        let from = harms.map_or("no number of samples tried".to_owned(), |spp| format!("{spp} samples"));
        figures.push(format!(
            "{:?}: relMSE {gain_at_1:.1} times lower at 1 sample, harms from {from} on",
            denoise.filter
        ));
    }
    let settings = Settings { samples: 1, ..size };
    let film = renderer.render(&settings).unwrap().film;
    let shut = DenoiseSettings { color: 0.0, ..FILTERS[0] };
    let image = renderer.denoise(&film, &settings, shut).unwrap().0;
    let gain = error(&film.image()) / error(&image);
    assert!((gain - 1.0).abs() < 1e-3, "a closed filter gains {gain}");
    report(40, subject, Outcome::Passed, figures.join("; "));
}

for_each_route!(t37_constant_image, t38_stops, t39_what_is_no_light, t40_error_by_samples);
