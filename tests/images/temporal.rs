//! Consecutive live frames: with a resting camera they are the plain mean; with a moving camera
//! they are better than single frames; and nothing of an earlier view stays where it does not
//! belong.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use glam::DVec3;
use trisect::denoise::{DenoiseSettings, Filter, TemporalSettings};
use trisect::image::Image;
use trisect::metrics::{ImageView, compare};
use trisect::render::{Renderer, Sampler, Settings};
use trisect::scene::{CameraPose, Scene};
use trisect::view::{ViewOptions, Viewer};
use trisect_tests::renders::{cpu, film, independent};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

const SVGF: DenoiseSettings = DenoiseSettings::new(Filter::Svgf);

/// Returns a scene with area lights. On software Vulkan it has spheres only, whose kernel is small.
fn lights(subject: BackendUnderTest) -> Scene {
    scene(if subject.is_software() { "rtiow_final.ron" } else { "cornell_box.ron" })
}

/// Returns spheres near the camera, dark from below, in front of a lit floor.
fn spheres() -> Scene {
    let text = r#"Scene(version: 1, image: (width: 48, height: 40),
        camera: (look_from: (0, 1.2, 6), look_at: (0, 0.8, 0), vertical_fov: 40),
        sky: Gradient(bottom: (0, 0, 0), top: (2, 2, 2)),
        materials: { "white": Lambertian(albedo: (0.8, 0.8, 0.8)) },
        objects: [
            Sphere(center: (0, -1000, 0), radius: 1000, material: "white"),
            Sphere(center: (-0.9, 1, 3), radius: 0.4, material: "white"),
            Sphere(center: (0.3, 1.4, 3), radius: 0.4, material: "white"),
            Sphere(center: (1.2, 0.8, 2.5), radius: 0.4, material: "white"),
        ])"#;
    Scene::parse(text, "spheres").unwrap()
}

fn settings(scene: &Scene, seed: u32) -> Settings {
    Settings { width: 48, height: 40, samples: 1, depth: 4, seed, ..independent(scene) }
}

/// Returns camera poses that move to the side, past objects in front of others.
fn path(start: CameraPose, step: f64, frames: u32) -> Vec<CameraPose> {
    let side = (start.look_at - start.look_from).cross(start.up).normalize();
    let distance = (start.look_at - start.look_from).length();
    let at = |frame: u32| -> DVec3 { side * (distance * step * f64::from(frame)) };
    (0..frames).map(|frame| CameraPose { look_from: start.look_from + at(frame), ..start }).collect()
}

/// Renders a frame from each pose, and returns the last `kept` frames.
fn follow(
    renderer: &mut Renderer,
    poses: &[CameraPose],
    settings: &Settings,
    denoise: Option<&DenoiseSettings>,
    history: &TemporalSettings,
    kept: usize,
) -> Vec<Image> {
    let mut images = Vec::new();
    for (index, pose) in poses.iter().enumerate() {
        renderer.set_camera(*pose).unwrap();
        let live = renderer.live(settings, denoise, Some(history)).unwrap();
        if index + kept >= poses.len() {
            images.push(renderer.read_live(&live).unwrap());
        }
    }
    images
}

/// Ends a series: the next frame has no history.
fn forget(renderer: &mut Renderer, settings: &Settings) {
    renderer.live(settings, None, None).unwrap();
}

fn error(image: &Image, reference: &Image) -> f64 {
    let view = |image| -> ImageView<'_> {
        let image: &Image = image;
        ImageView::new(image.width as usize, image.height as usize, &image.pixels).unwrap()
    };
    compare(&view(image), &view(reference)).unwrap().rel_mse
}

fn greatest_difference(a: &Image, b: &Image) -> f32 {
    let off = |(a, b): (&f32, &f32)| (a - b).abs() / (1.0 + b.abs());
    a.pixels.iter().flatten().zip(b.pixels.iter().flatten()).map(off).fold(0.0, f32::max)
}

/// A resting camera sees the mean of the same samples as a film, and nothing is left of its earlier
/// views.
fn rest_is_the_plain_mean(subject: BackendUnderTest) {
    let scene = lights(subject);
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene, 3);
    let many = vec![*renderer.pose(); 32];
    let live = follow(&mut renderer, &many, &settings, None, &TemporalSettings::DEFAULT, 2);
    let plain = film(&mut renderer, &Settings { samples: 32, guides: true, ..settings.clone() }).image();
    // 32 sums in f32 and a division by the albedo: about 40 roundings of 6e-8, of which a tenth
    // occurs.
    let off = greatest_difference(&live[1], &plain);
    assert!(off < 2e-6, "{off}");
    assert!(greatest_difference(&live[0], &plain) > 1e-3, "31 samples are not 32");
    let sobol = Settings { samples: 1024, seed: 9, sampler: Sampler::Sobol, ..settings.clone() };
    let reference = film(&mut cpu(&scene), &sobol).image();
    let (a, b) = (error(&live[1], &reference), error(&plain, &reference));
    println!("32 frames at rest: relMSE {a:.4e}, 32 samples: {b:.4e}");
    assert!((a / b - 1.0).abs() < 1e-4);

    // After a move, as many frames at rest as the history counts remove it, bit by bit.
    let history = TemporalSettings { frames: 6, ..TemporalSettings::DEFAULT };
    let mut poses = path(scene.camera, 0.002, 9);
    poses.extend(vec![poses[8]; 6]);
    let mut seen = |frames| {
        forget(&mut renderer, &settings);
        follow(&mut renderer, &poses, &settings, None, &TemporalSettings { frames, ..history }, 2)
    };
    let (with, without) = (seen(6), seen(0));
    assert!(with[1] == without[1], "history is left");
    assert!(with[0] != without[0], "negative control not detected");
}

/// Frames that run side by side are those that run one after another, also if their size changes.
fn frames_side_by_side_are_frames(subject: BackendUnderTest) {
    let scene = lights(subject);
    let Some(renderer) = subject.renderer(&scene) else { return };
    // The history no longer counts at the end of the rest, and is written when the camera moves.
    let history = TemporalSettings { frames: 2, ..TemporalSettings::DEFAULT };
    let look = ViewOptions { history, ..ViewOptions::new(settings(&scene, 5), Some(SVGF)) };
    let mut poses = path(scene.camera, 0.002, 4);
    poses.extend(vec![poses[3]; 6]);
    poses.extend(vec![poses[0]; 2]);
    let looks: Vec<ViewOptions> = (0..poses.len())
        .map(|frame| ViewOptions { scale: if frame < 2 { 0.5 } else { 1.0 }, ..look.clone() })
        .collect();
    let mut viewer = Viewer::new(renderer);
    let mut expected = Vec::new();
    for (look, pose) in looks.iter().zip(&poses) {
        let mut pixels = Vec::new();
        viewer.frame(look, pose, &mut pixels).unwrap();
        expected.push(pixels);
    }
    forget(viewer.renderer(), &look.settings);
    for most in [1, 2, 3] {
        let mut seen = Vec::new();
        let mut take = |viewer: &mut Viewer| seen.push(viewer.take().unwrap().unwrap().1.to_vec());
        for (look, pose) in looks.iter().zip(&poses) {
            viewer.start(look, pose).unwrap();
            if viewer.running() >= most {
                take(&mut viewer);
            }
        }
        while viewer.running() > 0 {
            take(&mut viewer);
        }
        assert!(seen == expected, "{most} at a time");
        assert!(viewer.take().unwrap().is_none());
        forget(viewer.renderer(), &look.settings);
    }
    assert!(expected[10] != expected[11], "negative control: two frames of the same pose");
}

/// With a moving camera the history reduces the error, compared with a history of no frames.
fn a_way_is_better_than_its_frames(subject: BackendUnderTest) {
    let scene = lights(subject);
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene, 4);
    let poses = path(scene.camera, 0.002, 10);
    let sobol = Settings { samples: 512, seed: 9, sampler: Sampler::Sobol, ..settings.clone() };
    let mut reference = cpu(&scene);
    reference.set_camera(poses[9]).unwrap();
    let reference = film(&mut reference, &sobol).image();
    // `docs/notebook/denoising.md` has the gains, which are smaller without lights: there edges are
    // most of the error.
    let least = if scene.flats.is_empty() { [1.3, 1.05] } else { [3.5, 1.2] };
    for (filter, gain) in [None, Some(&SVGF)].into_iter().zip(least) {
        let mut last = |frames| {
            forget(&mut renderer, &settings);
            let history = TemporalSettings { frames, ..TemporalSettings::DEFAULT };
            let images = follow(&mut renderer, &poses, &settings, filter, &history, 1);
            error(&images[0], &reference)
        };
        let (with, without) = (last(32), last(0));
        println!("{}: relMSE {with:.4e}, by itself {without:.4e}", filter.map_or("raw", |_| "svgf"));
        assert!(without / with > gain, "{without:.4e} / {with:.4e}");
    }
}

/// Returns the maximum mean error of a block of 4 x 4 pixels, relative to the block's radiance or
/// at least a fifth of the image's mean.
fn ghost(mean: &Image, reference: &Image) -> f64 {
    let (width, height) = (mean.width as usize, mean.height as usize);
    let sum = |image: &Image, x0: usize, y0: usize| -> f64 {
        let rows = (y0..y0 + 4).flat_map(|y| (x0..x0 + 4).map(move |x| y * width + x));
        rows.map(|pixel| image.pixels[pixel].iter().map(|&v| f64::from(v)).sum::<f64>()).sum()
    };
    let all: f64 = reference.pixels.iter().flatten().map(|&v| f64::from(v)).sum();
    let floor = 0.2 * all * 16.0 / (width * height) as f64;
    let mut worst = 0.0f64;
    for y in (0..height).step_by(4) {
        for x in (0..width).step_by(4) {
            let (got, want) = (sum(mean, x, y), sum(reference, x, y));
            worst = worst.max((got - want).abs() / want.max(floor));
        }
    }
    worst
}

/// Maximum error of a block that earlier views may leave, beyond noise.
const GHOST: f64 = 0.05;

/// The mean over many seeds has little noise left, so it shows what the history leaves in wrong
/// places.
fn no_ghosts(subject: BackendUnderTest) {
    let scene = spheres();
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let base = settings(&scene, 0);
    let poses = path(scene.camera, 0.02, 6);
    let sobol = Settings { samples: 2048, seed: 99, sampler: Sampler::Sobol, ..base.clone() };
    let mut reference = cpu(&scene);
    reference.set_camera(poses[5]).unwrap();
    let reference = film(&mut reference, &sobol).image();
    let seeds = if subject.is_software() { 24 } else { 48 };
    let mut mean = |denoise: Option<&DenoiseSettings>, history: &TemporalSettings| {
        let mut sum = Image { width: 48, height: 40, pixels: vec![[0.0; 3]; 48 * 40] };
        for seed in 0..seeds {
            let settings = Settings { seed, ..base.clone() };
            forget(&mut renderer, &settings);
            let images = follow(&mut renderer, &poses, &settings, denoise, history, 1);
            for (to, from) in sum.pixels.iter_mut().flatten().zip(images[0].pixels.iter().flatten()) {
                *to += from / seeds as f32;
            }
        }
        ghost(&sum, &reference)
    };
    let with = mean(None, &TemporalSettings::DEFAULT);
    let noise = mean(None, &TemporalSettings { frames: 0, ..TemporalSettings::DEFAULT });
    // Negative control: the history of one surface is accepted on any other (and the spatial filter
    // has no effect).
    let open = DenoiseSettings { levels: 1, color: 0.0, normal: f32::INFINITY, depth: f32::INFINITY, ..SVGF };
    let blind = mean(Some(&open), &TemporalSettings { clamp: f32::INFINITY, ..TemporalSettings::DEFAULT });
    println!("greatest error of a block: {with:.3}; without a past {noise:.3}; blind {blind:.3}");
    assert!(with < GHOST, "{with}");
    assert!(blind > 1.5 * GHOST, "negative control not detected: {blind}");
}

/// After a cut to a view that shares nothing with the last one, the history has no effect.
fn a_cut_forgets(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene, 5);
    let start = scene.camera;
    let away = CameraPose { look_at: start.look_from * 2.0 - start.look_at, ..start };
    let mut last = |frames, poses: &[CameraPose]| {
        forget(&mut renderer, &settings);
        let history = TemporalSettings { frames, ..TemporalSettings::DEFAULT };
        follow(&mut renderer, poses, &settings, Some(&SVGF), &history, 1).remove(0)
    };
    assert!(last(32, &[start, away]) == last(0, &[start, away]));
    let near = path(start, 0.002, 2);
    assert!(last(32, &near) != last(0, &near), "negative control not detected");
}

/// A series of frames has the CPU's bits on CUDA and on software Vulkan. Hardware may be off in
/// divisions there: some paths hit something else, and a neighbour may count on one device only.
fn they_are_the_cpus(subject: BackendUnderTest) {
    let scene = lights(subject);
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene, 6);
    let mut poses = path(scene.camera, 0.004, 4);
    poses.extend([poses[3]; 3]);
    let series = |renderer: &mut Renderer, history| {
        forget(renderer, &settings);
        follow(renderer, &poses, &settings, Some(&SVGF), &history, 4)
    };
    let want = series(&mut cpu(&scene), TemporalSettings::DEFAULT);
    // naga's modules take other paths through the book's scene for some pixels.
    // `docs/notebook/denoising.md` has the counts of an H100.
    let (bound, most) = match subject {
        BackendUnderTest::Cpu | BackendUnderTest::Cuda => (0.0, 0),
        BackendUnderTest::Wgpu if subject.is_software() => (0.0, 0),
        _ if subject.is_software() => (1e-3, 40),
        _ => (1e-3, 1600),
    };
    let differ = |a: &[Image]| {
        let pairs = a.iter().zip(&want).flat_map(|(a, b)| a.pixels.iter().zip(&b.pixels));
        let off =
            |(a, b): &(&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > bound * (1.0 + b[c]));
        pairs.filter(off).count()
    };
    let off = differ(&series(&mut renderer, TemporalSettings::DEFAULT));
    let other = differ(&series(&mut renderer, TemporalSettings { frames: 2, ..TemporalSettings::DEFAULT }));
    println!("{off} of 7680 pixels differ by more than {bound}; with another history {other}");
    assert!(off <= most);
    assert!(other > 500 && other > 2 * most, "negative control not detected: {other}");
}

for_each_route!(
    rest_is_the_plain_mean,
    frames_side_by_side_are_frames,
    a_way_is_better_than_its_frames,
    no_ghosts,
    a_cut_forgets,
    they_are_the_cpus,
);
