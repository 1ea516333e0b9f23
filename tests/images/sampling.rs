//! Adaptive sampling and goals: the same images on all backends, with the stated error, and without
//! bias.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use trisect::adaptive::{self, Adaptive, Free, Goal, Request, Sampled};
use trisect::device::DeviceKind;
use trisect::film::Film;
use trisect::metrics::{ImageView, compare};
use trisect::render::{RenderObserver, Renderer, Sampler, Settings, Summation};
use trisect::scene::Scene;
use trisect_lab::statistics::mean_and_error;
use trisect_tests::fault_injecting_backend::FaultInjectingBackend;
use trisect_tests::renders::{cpu, differing, film, independent};
use trisect_tests::statistics::{Blocks, GLOBAL_LIMIT};
use trisect_tests::{BackendUnderTest, for_each_backend, scene};

fn request(goal: Goal, adaptive: Adaptive) -> Request {
    Request { goal, adaptive, free: Free::default(), denoisers: Vec::new() }
}

fn sample(renderer: &mut Renderer, settings: &Settings, goal: Goal, adaptive: Adaptive) -> Sampled {
    adaptive::render(renderer, settings, &request(goal, adaptive), &mut ()).unwrap()
}

fn small(scene: &Scene) -> Settings {
    Settings { width: 40, height: 27, depth: 6, ..independent(scene) }
}

/// Returns whether the device divides as the CPU does; Vulkan allows 2.5 ULP.
fn has_exact_divisions(subject: BackendUnderTest, renderer: &Renderer) -> bool {
    match subject {
        BackendUnderTest::Cpu | BackendUnderTest::Cuda => true,
        BackendUnderTest::Wgpu | BackendUnderTest::WgpuNaga | BackendUnderTest::WgpuWgsl => {
            renderer.device().info().kind == DeviceKind::SoftwareGpu
        }
    }
}

/// Tiles take different numbers of samples, decided from earlier passes, and the result is the same
/// on each backend.
fn own_samples_are_the_cpus(subject: BackendUnderTest) {
    for (name, adaptive) in [("cornell_box.ron", Adaptive::On), ("rtiow_final.ron", Adaptive::Off)] {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let settings = small(&scene);
        // A maximum mean that gives no equal number of samples for all pixels.
        let goal = Goal::Error { target: 1e-6, max_samples: 53 };
        let mut own =
            |seed| sample(&mut renderer, &Settings { seed, ..settings.clone() }, goal, adaptive).film;
        let got = own(0);
        let want = sample(&mut cpu(&scene), &settings, goal, adaptive).film;
        let counts: Vec<u64> = want.pixels.iter().map(|pixel| pixel.samples).collect();
        assert!(counts.iter().min() < counts.iter().max(), "{name}: all pixels have as many samples");
        assert_eq!(got.counts().unwritten + got.counts().rejected, 0);
        let kind = renderer.device().info().kind;
        if subject == BackendUnderTest::Cuda
            || subject == BackendUnderTest::Wgpu && kind == DeviceKind::SoftwareGpu
        {
            assert_eq!(differing(&got, &want), 0, "{name}");
        } else {
            let test = Blocks::new(&got).compare(&Blocks::new(&want), 1e-4);
            assert!(test.whole < GLOBAL_LIMIT, "{name}: {test:?}");
        }
    }
    // Negative control: another seed.
    let scene = scene("cornell_box.ron");
    let goal = Goal::Error { target: 1e-6, max_samples: 24 };
    let of = |seed| sample(&mut cpu(&scene), &Settings { seed, ..small(&scene) }, goal, Adaptive::On).film;
    assert_ne!(differing(&of(0), &of(1)), 0, "negative control not detected");
}

/// Halves that add up on the device have the bits of those on the host, by noise and evenly, in
/// images whose last tiles are not whole.
fn halves_on_the_device(subject: BackendUnderTest) {
    for (name, adaptive, sampler, numbers) in [
        ("cornell_box.ron", Adaptive::On, Sampler::Independent, &[1, 3, 53, 700][..]),
        ("rtiow_final.ron", Adaptive::Off, Sampler::Sobol, &[1, 3, 53]),
        ("rtiow_final.ron", Adaptive::On, Sampler::Independent, &[53]),
        ("door_slit.ron", Adaptive::On, Sampler::Independent, &[53]),
        ("furnace.ron", Adaptive::On, Sampler::Independent, &[17]),
        ("light_punctual.ron", Adaptive::Auto, Sampler::Sobol, &[17]),
        ("gltf/features.glb", Adaptive::On, Sampler::Independent, &[17]),
    ] {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let host = Settings { sampler, sums: Summation::Host, ..small(&scene) };
        let device = Settings { sums: Summation::Device, ..host.clone() };
        for &max_samples in numbers {
            let goal = Goal::Error { target: 1e-6, max_samples };
            let want = sample(&mut renderer, &host, goal, adaptive);
            let got = sample(&mut renderer, &device, goal, adaptive);
            assert_eq!((want.stats.sums, got.stats.sums), (Summation::Host, Summation::Device));
            let noise = |of: &Sampled| of.stats.sampling.as_ref().unwrap().noise;
            if has_exact_divisions(subject, &renderer) {
                assert_eq!(differing(&got.film, &want.film), 0, "{name}, {max_samples}");
                assert_eq!(got.film.counts(), want.film.counts());
                assert_eq!(got.image.pixels, want.image.pixels);
                assert_eq!(noise(&got), noise(&want), "{name}, {max_samples}");
            } else {
                // A tile's noise may differ in its last bits, and so a tile's samples by one.
                let all = |of: &Sampled| of.film.counts().samples as f64;
                assert!((all(&got) / all(&want) - 1.0).abs() < 1e-3, "{name}, {max_samples}");
                let ratio = noise(&got).error / noise(&want).error;
                assert!((ratio - 1.0).abs() < 1e-2, "{name}, {max_samples}: {ratio}");
            }
        }
    }
    // Negative control: another seed.
    let scene = scene("cornell_box.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let goal = Goal::Error { target: 1e-6, max_samples: 24 };
    let mut of = |seed, sums| {
        sample(&mut renderer, &Settings { seed, sums, ..small(&scene) }, goal, Adaptive::On).film
    };
    let (a, b) = (of(0, Summation::Host), of(1, Summation::Device));
    assert_ne!(differing(&a, &b), 0, "negative control not detected");
}

/// A clamp scales brighter samples down with the same bits on each backend; a clamp above all
/// samples changes nothing.
fn a_clamp_is_the_cpus(subject: BackendUnderTest) {
    let scene = scene("cornell_box.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { samples: 4, ..small(&scene) };
    let clamped = |clamp| Settings { clamp, ..settings.clone() };
    let (free, high, low) = (
        film(&mut renderer, &clamped(None)),
        film(&mut renderer, &clamped(Some(1e6))),
        film(&mut renderer, &clamped(Some(1.0))),
    );
    assert_eq!(differing(&free, &high), 0);
    assert_ne!(differing(&free, &low), 0, "negative control not detected");
    let most = |film: &Film| film.pixels.iter().flat_map(|pixel| pixel.mean()).fold(0.0, f64::max);
    assert!(most(&low) <= 1.0 + 1e-6 && most(&free) > 2.0, "{} {}", most(&low), most(&free));
    let kind = renderer.device().info().kind;
    let want = film(&mut cpu(&scene), &clamped(Some(1.0)));
    if subject == BackendUnderTest::Cuda
        || subject == BackendUnderTest::Wgpu && kind == DeviceKind::SoftwareGpu
    {
        assert_eq!(differing(&low, &want), 0);
    } else {
        assert!(Blocks::new(&low).compare(&Blocks::new(&want), 1e-4).whole < GLOBAL_LIMIT);
    }
}

for_each_backend!(own_samples_are_the_cpus, halves_on_the_device, a_clamp_is_the_cpus);

/// Returns the root of the relMSE of a film against one of many samples.
fn error(film: &Film, reference: &Film) -> f64 {
    let (image, reference) = (film.image(), reference.image());
    let view = |image: &trisect::image::Image| -> Vec<[f32; 3]> { image.pixels.clone() };
    let (a, b) = (view(&image), view(&reference));
    let (width, height) = (image.width as usize, image.height as usize);
    let of = |pixels| ImageView::new(width, height, pixels).unwrap();
    compare(&of(&a), &of(&b)).unwrap().rel_mse.sqrt()
}

/// The mean error of four seeds is within a fifth of the target.
#[test]
fn the_error_is_what_was_asked_for() {
    for (name, target, adaptive, sampler) in [
        ("rtiow_final.ron", 0.1, Adaptive::Off, Sampler::Independent),
        ("cornell_box.ron", 0.1, Adaptive::On, Sampler::Independent),
        ("rtiow_final.ron", 0.1, Adaptive::Auto, Sampler::Sobol),
        ("next_week.ron", 0.2, Adaptive::On, Sampler::Independent),
    ] {
        let scene = scene(name);
        let mut renderer = cpu(&scene);
        let settings = Settings { sampler, ..small(&scene) };
        let samples = Settings { samples: 4096, seed: 77, sampler: Sampler::Sobol, ..settings.clone() };
        let reference = film(&mut renderer, &samples);
        let mut errors = Vec::new();
        for seed in 0..4 {
            let goal = Goal::Error { target, max_samples: 4096 };
            let got = sample(&mut renderer, &Settings { seed, ..settings.clone() }, goal, adaptive);
            let sampling = got.stats.sampling.unwrap();
            assert!(sampling.met && sampling.noise.error <= target);
            errors.push(error(&got.film, &reference));
        }
        let mean = errors.iter().sum::<f64>() / 4.0;
        eprintln!("{name}: {errors:?} for {target}");
        assert!((mean / target - 1.0).abs() < 0.2, "{name}: {mean} for {target}");
        // Negative control: half the error is not within a fifth.
        let goal = Goal::Error { target: 0.5 * target, max_samples: 4096 };
        let off = error(&sample(&mut renderer, &settings, goal, adaptive).film, &reference) / target - 1.0;
        assert!(off.abs() > 0.2, "{name}: negative control not detected: {off}");
    }
}

/// Stopping at an estimated error, with samples where the noise is, adds no bias. The mean of 128
/// such images equals that of 128 renders with equal samples for all pixels within 4 sigma, each
/// 0.2 to 0.3 %. So a bias is below 1.2 %, where the images have 15 % of noise.
#[test]
fn stopping_adds_no_bias() {
    for name in ["cornell_box.ron", "rtiow_final.ron"] {
        let scene = scene(name);
        let mut renderer = cpu(&scene);
        // With a clamp, because the few samples that see the lamp would hide everything else.
        let settings = Settings { width: 24, height: 16, depth: 5, clamp: Some(2.0), ..independent(&scene) };
        let mut means = [Vec::new(), Vec::new()];
        for seed in 0..128 {
            let settings = Settings { seed: 10 * seed + 5, ..settings.clone() };
            let goal = Goal::Error { target: 0.15, max_samples: 4096 };
            let adaptive = sample(&mut renderer, &settings, goal, Adaptive::On).film;
            let plain = film(&mut renderer, &Settings { samples: 48, seed: 10 * seed + 7, ..settings });
            for (means, film) in means.iter_mut().zip([adaptive, plain]) {
                let sum: f64 = film.pixels.iter().flat_map(|pixel| pixel.mean()).sum();
                means.push(sum / (3 * film.pixels.len()) as f64);
            }
        }
        let ((a, ea), (b, eb)) = (mean_and_error(&means[0]), mean_and_error(&means[1]));
        let sigma = ea.hypot(eb);
        eprintln!(
            "{name}: {a} with stopping, {b} without: {:.2} sigma of {:.3} %",
            (a - b) / sigma,
            100.0 * sigma / b
        );
        assert!((a - b).abs() < 4.0 * sigma);
        assert!(sigma / b < 0.003, "{sigma}: too wide to see a bias");
        // Negative control: a bias of 2 % would be detected.
        assert!((a * 1.02 - b).abs() > 4.0 * sigma, "negative control not detected");
    }
}

/// With few samples, too, they go where the noise is, and their mean does not exceed the maximum.
#[test]
fn few_samples() {
    let scene = scene("cornell_box.ron");
    for most in [2, 4, 8, 16] {
        let goal = Goal::Error { target: 1e-6, max_samples: most };
        let got = sample(&mut cpu(&scene), &small(&scene), goal, Adaptive::On);
        let sampling = got.stats.sampling.unwrap();
        // Fractions of samples are rounded at random.
        assert!(sampling.mean_samples < f64::from(most) + 0.2, "{most}: {}", sampling.mean_samples);
        let differ = sampling.least_samples < sampling.most_samples;
        assert_eq!(differ && sampling.adaptive, most >= 8, "{most}: {sampling:?}");
    }
}

/// Invalid goals are errors, and a goal that is not reached is reported.
#[test]
fn goals() {
    let scene = scene("three_spheres.ron");
    let mut renderer = cpu(&scene);
    let settings = Settings { width: 16, height: 9, depth: 4, ..independent(&scene) };
    for target in [0.0, -1.0, 1.0, f64::NAN] {
        let bad = request(Goal::Error { target, max_samples: 1 }, Adaptive::Auto);
        let error = adaptive::render(&mut renderer, &settings, &bad, &mut ()).err().unwrap();
        assert!(error.to_string().contains("`target_error`"), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
    let none = request(Goal::Time(Duration::ZERO), Adaptive::Auto);
    assert!(adaptive::render(&mut renderer, &settings, &none, &mut ()).is_err());
    let few = sample(&mut renderer, &settings, Goal::Error { target: 1e-9, max_samples: 20 }, Adaptive::Auto);
    let sampling = few.stats.sampling.unwrap();
    assert!(!sampling.met && (sampling.mean_samples - 20.0).abs() < 0.1, "{sampling:?}");
    assert!(sampling.warning().unwrap().contains("`max_spp`"));
    // A film of two halves with equal numbers of samples is their sum.
    assert_eq!(few.film.counts().samples, few.stats.samples);
}

/// An observer can cancel the render.
#[test]
fn it_can_be_cancelled() {
    struct No;
    impl RenderObserver for No {
        fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
            ControlFlow::Break(())
        }
    }
    let scene = scene("three_spheres.ron");
    let request = request(Goal::Error { target: 0.01, max_samples: 100 }, Adaptive::Auto);
    let settings = Settings { width: 16, height: 9, ..independent(&scene) };
    let ended = adaptive::render(&mut cpu(&scene), &settings, &request, &mut No);
    assert!(matches!(ended, Err(trisect::Error::Cancelled)));
}

/// A render that is asked to stop in its second pass still completes the pass, unless that takes
/// longer than the grace period. Then it discards the running work, and returns the image without
/// it.
#[test]
fn the_end_is_not_waited_for_long() {
    struct EndsLater<'a>(&'a AtomicBool);
    impl RenderObserver for EndsLater<'_> {
        fn progress(&mut self, done: u64, _: u64) -> ControlFlow<()> {
            if done > 0 {
                self.0.store(true, Ordering::Relaxed);
            }
            ControlFlow::Continue(())
        }

        fn should_continue(&self) -> bool {
            !self.0.load(Ordering::Relaxed)
        }
    }
    let scene = scene("rtiow_final.ron");
    let settings = Settings { width: 640, height: 360, depth: 6, ..independent(&scene) };
    let pixels = settings.pixels() as f64;
    for (adaptive, is_gpu) in [(Adaptive::Off, false), (Adaptive::Off, true), (Adaptive::On, false)] {
        let mean_samples = |slow: bool| {
            let ended = Arc::new(AtomicBool::new(false));
            let (asked, mut launches) = (ended.clone(), 0);
            let after = move || {
                if slow && asked.load(Ordering::Relaxed) {
                    launches += 1;
                    // The grace period is 5 s.
                    assert!(launches < 4, "no stop");
                    std::thread::sleep(Duration::from_secs(3));
                }
                Ok(())
            };
            let device = if is_gpu {
                FaultInjectingBackend::new(after).as_gpu()
            } else {
                FaultInjectingBackend::new(after)
            };
            let mut renderer = Renderer::new(device, &scene).unwrap();
            renderer.limit_submissions(Some(100_000));
            let request = request(Goal::Error { target: 0.05, max_samples: 100_000 }, adaptive);
            let found = adaptive::render(&mut renderer, &settings, &request, &mut EndsLater(&ended)).unwrap();
            let sampling = found.stats.sampling.unwrap();
            assert!(sampling.ended && found.image.pixels.iter().flatten().all(|v| v.is_finite()));
            let counts = found.film.counts();
            assert_eq!(counts.unwritten, 0);
            assert_eq!(counts.samples + counts.rejected, (sampling.mean_samples * pixels).round() as u64);
            sampling.mean_samples
        };
        // The first pass has 8 samples in each half. Of the second, one half may be complete.
        let (given_up, waited) = (mean_samples(true), mean_samples(false));
        assert!(given_up >= 16.0 && waited > given_up, "{adaptive:?}: {given_up} {waited}");
    }
}
