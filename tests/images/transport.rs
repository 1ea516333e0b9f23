//! Light transport with known answers: lights over a plane. (Furnaces and enclosures are among the
//! torture tests.)
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::film::Film;
use trisect::render::Settings;
use trisect_tests::renders::{film, independent, lit};
use trisect_tests::statistics::Known;
use trisect_tests::{BackendUnderTest, for_each_route, scene};

/// Returns the samples per pixel: `cpu` on the CPU, where the negative controls run, else `others`.
fn samples(subject: BackendUnderTest, cpu: u32, others: u32) -> u32 {
    if subject == BackendUnderTest::Cpu { cpu } else { others }
}

/// Returns whether the film's mean is `want`, within 4 sigma and the rounding of 256 sums in f32.
fn is(film: &Film, want: f64) -> bool {
    let known = Known::of(&film.pixels, want);
    eprintln!("{known:?} for {want}");
    known.holds()
}

/// The image's mean is the radiance of the lit plane that each scene file derives.
fn radiance_is_known(subject: BackendUnderTest) {
    let cases = [
        ("light_disc.ron", 0.4),
        ("light_sphere.ron", 0.375),
        ("light_quad.ron", 0.554_126_4),
        ("light_punctual.ron", 0.557_042_3),
    ];
    for (name, want) in cases {
        let scene = scene(name);
        // The random choice of one of three lights adds noise.
        let many = if name == "light_punctual.ron" { 4096 } else { 512 };
        let settings = Settings { samples: samples(subject, many, 8), ..independent(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        assert!(is(&film(&mut renderer, &settings), want), "{name}");
        if subject == BackendUnderTest::Cpu {
            let mut renderer = subject.renderer(&lit(&scene, 1.01)).unwrap();
            assert!(!is(&film(&mut renderer, &settings), want), "{name}: negative control not detected");
        }
    }
}

for_each_route!(radiance_is_known);
