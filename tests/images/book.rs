//! On each backend, the image of the book's scene is that of an independent program in double
//! precision (`tests/reference`).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::film::{Film, PixelTotals};
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::independent;
use trisect_tests::statistics::ZTest;
use trisect_tests::{BackendUnderTest, for_each_route, root, scene};

/// Samples per pixel of the reference.
const SAMPLES: f64 = 30_000.0;

/// Returns the reference as a film, with sums and squares that give its mean and the variance of
/// the mean.
fn reference() -> Film {
    let read = |name: &str| -> Vec<f64> {
        let folder = [root().join("tests/reference"), root().join("reference")]; // the second in a bundle
        let folder = folder.iter().find(|folder| folder.exists()).expect("tests/reference");
        let bytes = std::fs::read(folder.join(name)).unwrap();
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    };
    let (means, variances) = (read("rtiow_80x45_mean.f64"), read("rtiow_80x45_variance.f64"));
    assert_eq!((means.len(), variances.len()), (80 * 45 * 3, 80 * 45 * 3));
    let pixel = |(mean, variance): (&[f64], &[f64])| PixelTotals {
        radiance: std::array::from_fn(|c| (mean[c] * SAMPLES).into()),
        squares: std::array::from_fn(|c| {
            ((variance[c] * (SAMPLES - 1.0) + mean[c] * mean[c]) * SAMPLES).into()
        }),
        samples: SAMPLES as u64,
        rejected: 0,
        segments: 0,
        unwritten: 0,
    };
    let mut film = Film::new(80, 45);
    let pixels = means.chunks_exact(3).zip(variances.chunks_exact(3)).map(pixel);
    film.pixels = pixels.collect::<Vec<_>>().as_slice().into();
    film
}

fn the_image_is_the_books(subject: BackendUnderTest) {
    let good = scene("rtiow_final.ron");
    let reference = reference();
    let test = |scene: &Scene| {
        let mut renderer = subject.renderer(scene)?;
        let settings = Settings { width: 80, height: 45, samples: 1024, seed: 41, ..independent(scene) };
        Some(ZTest::new(&renderer.render(&settings).unwrap().film, &reference))
    };
    // The global mean must agree within 0.1 %, several times its noise at these samples.
    let agrees = |test: &ZTest| test.passes() && test.relative.iter().all(|r| r.abs() < 1e-3);
    let Some(result) = test(&good) else { return };
    eprintln!("{subject:?}: {result:?}");
    assert!(agrees(&result), "{result:?}");

    // Negative controls: 1 % more albedo, half the lens, another index of refraction, no fuzz.
    let faults: [fn(&mut Scene); 4] = [
        |scene| scene.materials.iter_mut().for_each(|material| material.albedo *= 1.01),
        |scene| scene.camera.defocus_angle *= 0.5,
        |scene| scene.materials.iter_mut().for_each(|material| material.ior *= 0.97),
        |scene| scene.materials.iter_mut().for_each(|material| material.fuzz = 0.0),
    ];
    // Only on the CPU: what the comparison detects does not depend on the backend.
    for (i, plant) in faults.into_iter().enumerate().filter(|_| subject == BackendUnderTest::Cpu) {
        let mut scene = good.clone();
        plant(&mut scene);
        let result = test(&scene).unwrap();
        assert!(!agrees(&result), "fault {i} went unnoticed: {result:?}");
    }
}

for_each_route!(the_image_is_the_books);
