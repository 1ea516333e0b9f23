//! Images that Open Image Denoise makes of films: nearer to the converged image, finite, and with
//! the edges of the features. They are skipped where the library is missing.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use glam::Vec3;
use trisect::denoise::Denoiser;
use trisect::image::Image;
use trisect::metrics::{ImageView, compare};
use trisect::render::{Renderer, Sampler, Settings};
use trisect::scene::Scene;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;
use trisect_tests::oidn::available;
use trisect_tests::renders::{cpu, independent};
use trisect_tests::scene;

fn rel_mse(image: &Image, reference: &Image) -> f64 {
    fn view(image: &Image) -> ImageView<'_> {
        ImageView::new(image.width as usize, image.height as usize, &image.pixels).unwrap()
    }
    compare(&view(image), &view(reference)).unwrap().rel_mse
}

fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|value| value.is_finite())
}

/// Denoises the sums that `fill` writes.
fn denoised(
    renderer: &mut Renderer,
    (width, height): (u32, u32),
    fill: &dyn Fn(&mut [PixelSums], &mut [AovSums]),
) -> Image {
    let settings = Settings::new(width, height);
    let image = renderer.denoise_sums(fill, &settings, &Denoiser::Oidn).unwrap().0;
    assert_eq!((image.width, image.height, image.pixels.len()), (width, height, (width * height) as usize));
    image
}

/// At 4 samples the error falls to a third or less; another seed alone, the negative control, does
/// not lower it.
#[test]
fn noise_falls() {
    if !available() {
        return;
    }
    for name in ["cornell_box.ron", "rtiow_final.ron"] {
        let scene = scene(name);
        let mut renderer = cpu(&scene);
        let settings = independent(&scene).size(128, 96);
        let settings = Settings { depth: 8, ..settings };
        let exact = Settings { sampler: Sampler::Sobol, ..settings.clone() }.spp(1024).seed(9);
        let exact = renderer.render(&exact).unwrap().image();
        let frame = renderer.render(&settings.clone().spp(4).denoise(Denoiser::Oidn)).unwrap();
        let (raw, denoised) = (rel_mse(&frame.film.image(), &exact), rel_mse(&frame.image(), &exact));
        println!("{name}: relMSE {raw:.2e}, denoised {denoised:.2e}");
        assert!(denoised * 3.0 < raw, "{name}: {raw} {denoised}");
        let other = renderer.render(&settings.spp(4).seed(3)).unwrap().image();
        assert!(rel_mse(&other, &exact) * 3.0 > raw, "{name}: negative control not detected");
    }
}

/// Fills sums of 4 samples of a grey surface in white light.
fn grey(sums: &mut [PixelSums], aovs: &mut [AovSums]) {
    let color = Vec3::splat(0.5);
    for (sums, aovs) in sums.iter_mut().zip(aovs) {
        *sums = bytemuck::Zeroable::zeroed();
        (sums.samples, sums.radiance) = (4, 4.0 * color);
        (aovs.hits, aovs.albedo, aovs.normal) = (4, 4.0 * color, 4.0 * Vec3::Z);
        (aovs.misses, aovs.emission) = (0, Vec3::ZERO);
    }
}

/// Images of any size come out whole, and a constant one stays nearly constant.
#[test]
fn any_size() {
    if !available() {
        return;
    }
    let mut renderer = cpu(&Scene::hello_world().unwrap());
    for size in [(1, 1), (1, 37), (37, 1), (61, 35), (3, 2)] {
        let image = denoised(&mut renderer, size, &grey);
        let is_grey = |pixel: &[f32; 3]| pixel.iter().all(|value| (value - 0.5).abs() < 0.02);
        assert!(image.pixels.iter().all(is_grey), "{size:?}: {:?}", image.pixels[0]);
    }
}

/// Pixels without a finite sample get light from their neighbours, and do not spread. Those that
/// are far from all light stay unknown.
#[test]
fn nan_does_not_spread() {
    if !available() {
        return;
    }
    let mut renderer = cpu(&Scene::hello_world().unwrap());
    let (width, height) = (96, 64);
    let lose = |lost: &dyn Fn(usize, usize) -> bool, sums: &mut [PixelSums], aovs: &mut [AovSums]| {
        grey(sums, aovs);
        for (pixel, (sums, aovs)) in sums.iter_mut().zip(aovs).enumerate() {
            if lost(pixel % width, pixel / width) {
                sums.radiance = [Vec3::NAN, Vec3::INFINITY, Vec3::splat(-f32::INFINITY)][pixel % 3];
                (aovs.albedo, aovs.normal) = (Vec3::NAN, Vec3::INFINITY);
            }
        }
    };
    let size = (width as u32, height as u32);
    let few = |x: usize, y: usize| (x * 7 + y * 13).is_multiple_of(31);
    let image = denoised(&mut renderer, size, &|sums, aovs| lose(&few, sums, aovs));
    let is_near = |pixel: &[f32; 3]| pixel.iter().all(|value| (value - 0.5).abs() < 0.15);
    assert!(image.pixels.iter().all(is_near));
    // The left half is lost: unknown beyond 16 pixels from the right one.
    let half = |x: usize, _: usize| x < width / 2;
    let image = denoised(&mut renderer, size, &|sums, aovs| lose(&half, sums, aovs));
    for (index, pixel) in image.pixels.iter().enumerate() {
        let is_known = index % width >= width / 2 - 16;
        assert_eq!(is_finite(pixel), is_known, "column {}", index % width);
    }
    let image = denoised(&mut renderer, size, &|sums, aovs| lose(&|_, _| true, sums, aovs));
    assert!(image.pixels.iter().flatten().all(|value| value.is_nan()));
    // A film without samples has 0 / 0.
    let image = denoised(&mut renderer, size, &|sums, aovs| {
        grey(sums, aovs);
        sums.iter_mut().for_each(|sums| (sums.samples, sums.radiance) = (0, Vec3::ZERO));
    });
    assert!(image.pixels.iter().flatten().all(|value| value.is_nan()));
}

/// Fine stripes under strong noise are kept by the albedo and by the normal. Without either, the
/// negative control, they are lost in the noise.
#[test]
fn features_keep_edges() {
    if !available() {
        return;
    }
    let mut renderer = cpu(&Scene::hello_world().unwrap());
    let (width, height) = (128, 96);
    let stripe = |pixel: usize| if (pixel % width / 3).is_multiple_of(2) { 0.3 } else { 0.6 };
    // Mean 1, between 0 and 2.
    let noise = |pixel: usize| {
        let hash = (pixel as u32).wrapping_mul(0x9E37_79B9) ^ (pixel as u32 >> 3).wrapping_mul(0x85EB_CA6B);
        2.0 * (hash.wrapping_mul(0xC2B2_AE35) >> 8) as f32 / (1u32 << 24) as f32
    };
    let mut error = |albedo: bool, normal: bool| {
        let image = denoised(&mut renderer, (width as u32, height as u32), &|sums, aovs| {
            grey(sums, aovs);
            for (pixel, (sums, aovs)) in sums.iter_mut().zip(aovs).enumerate() {
                let value = stripe(pixel);
                sums.radiance = Vec3::splat(4.0 * value * noise(pixel));
                if albedo {
                    aovs.albedo = Vec3::splat(4.0 * value);
                }
                if normal && value > 0.5 {
                    aovs.normal = 4.0 * Vec3::X;
                }
            }
        });
        let square = |(pixel, of): (usize, &[f32; 3])| f64::from(of[1] - stripe(pixel)).powi(2);
        (image.pixels.iter().enumerate().map(square).sum::<f64>() / image.pixels.len() as f64).sqrt()
    };
    let (neither, albedo, normal) = (error(false, false), error(true, false), error(false, true));
    println!("root mean square error: no feature {neither:.4}, albedo {albedo:.4}, normal {normal:.4}");
    assert!(albedo < 0.5 * neither && normal < 0.7 * neither, "{neither} {albedo} {normal}");
}

/// The library's image is that of the same film by another call, and the film stays as it is.
#[test]
fn the_film_stays() {
    if !available() {
        return;
    }
    let scene = scene("cornell_box.ron");
    let mut renderer = cpu(&scene);
    let settings = independent(&scene).size(33, 21).spp(2);
    let plain = renderer.render(&Settings { guides: true, ..settings.clone() }).unwrap().film;
    let frame = renderer.render(&settings.clone().denoise(Denoiser::Oidn)).unwrap();
    assert_eq!(frame.film, plain);
    let (again, times) = renderer.denoise(&plain, &settings, Denoiser::Oidn).unwrap();
    assert_eq!(times.len(), 3);
    assert!(rel_mse(&again, &frame.image()) < 1e-6 && frame.image() != plain.image());
}
