//! AOV sums that render kernels write: normals, albedos, positions and emission. They do not change
//! the image, and they are those of the first hits, the same on each backend.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::denoise::{DenoiseSettings, Filter};
use trisect::film::{AovTotals, Film, SampleBlock};
use trisect::render::{Renderer, Sampler, Schedule, Settings};
use trisect::scene::Scene;
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_tests::renders::{cpu, differing, film};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

/// A scene for each kernel with AOV sums.
const SCENES: [(&str, Sampler); 4] = [
    ("rtiow_final.ron", Sampler::Independent),
    ("cornell_box.ron", Sampler::Independent),
    ("next_week.ron", Sampler::Sobol),
    ("materials.ron", Sampler::Independent),
];

fn settings(scene: &Scene, sampler: Sampler, samples: u32) -> Settings {
    Settings {
        width: 40,
        height: 30,
        samples,
        depth: 4,
        seed: 11,
        sampler,
        guides: true,
        ..Settings::of(scene)
    }
}

/// AOV sums are stored beside the film's radiance, whose bits are those of a render without them.
fn the_image_does_not_change(subject: BackendUnderTest) {
    for (name, sampler) in SCENES {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let with = settings(&scene, sampler, 3);
        let without = Settings { guides: false, ..with.clone() };
        let (a, b) = (film(&mut renderer, &with), film(&mut renderer, &without));
        assert_eq!((a.aovs.len(), b.aovs.len()), (40 * 30, 0));
        // With AOV sums it is another kernel, whose divisions a Vulkan driver may round
        // differently.
        let same = differing(&a, &b) == 0;
        assert!(same || subject.name() == "wgpu", "{name}: {} pixels differ", differing(&a, &b));
        let other = Settings { seed: 12, ..with };
        assert!(differing(&a, &film(&mut renderer, &other)) > 0, "{name}: negative control not detected");
    }
}

/// At one sample the AOV sums are those of [`Renderer::first_hits`], which has its own kernel.
fn they_are_of_the_first_hit(subject: BackendUnderTest) {
    for name in ["rtiow_final.ron", "cornell_box.ron"] {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let settings = settings(&scene, Sampler::Independent, 1);
        let film = film(&mut renderer, &settings);
        let hits = renderer.first_hits(&settings, 0).unwrap();
        let mut missed = 0;
        for (guides, hit) in film.aovs.iter().zip(&hits) {
            let primitive = (hit.primitive != NO_PRIMITIVE).then_some(hit.primitive);
            missed += u32::from(primitive.is_none());
            assert_eq!((guides.primitive(), guides.hits + guides.misses), (primitive, 1), "{name}");
            let along: f64 = (0..3).map(|c| guides.normal()[c] * f64::from(hit.normal[c])).sum();
            let want = if primitive.is_some() { 1.0 } else { 0.0 };
            assert!((along.abs() - want).abs() < 1e-5, "{name}: {along}");
        }
        // Negative control: another sample hits other primitives.
        let other = renderer.first_hits(&settings, 1).unwrap();
        let differ = hits.iter().zip(&other).filter(|(a, b)| a.primitive != b.primitive).count();
        assert!(differ > 0 && missed < hits.len() as u32, "{name}");
    }
}

/// AOV sums are the same on each backend: bit by bit on CUDA; on Vulkan except for a few pixels,
/// whose ray hits another primitive there.
fn they_are_the_cpus(subject: BackendUnderTest) {
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-4 * (1.0 + b[c].abs()));
    let same = |a: &AovTotals, b: &AovTotals| {
        a.primitive() == b.primitive()
            && near(a.normal(), b.normal())
            && near(a.albedo(), b.albedo())
            && near(a.position(), b.position())
            && near(a.emission(), b.emission())
    };
    for (name, sampler) in SCENES {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let settings = settings(&scene, sampler, 2);
        let (got, want) = (film(&mut renderer, &settings), film(&mut cpu(&scene), &settings));
        if subject == BackendUnderTest::Cuda {
            assert_eq!(got.aovs, want.aovs, "{name}");
        }
        let count = |film: &Film| film.aovs.iter().zip(&want.aovs).filter(|(a, b)| !same(a, b)).count();
        // `docs/notebook/torture-tests.md` has the counts of an H100 and of lavapipe.
        assert!(count(&got) <= 24, "{name}: {} of 1200 pixels differ", count(&got));
        let shifted = film(&mut renderer, &Settings { seed: 12, ..settings });
        assert!(count(&shifted) > 240, "{name}: negative control not detected");
    }
}

/// Parts of rows and samples, and submissions of any size, add up to the same AOV sums.
fn parts_add_up(subject: BackendUnderTest) {
    let scene = scene("cornell_box.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 12, height: 9, ..settings(&scene, Sampler::Independent, 300) };
    let settings = Settings { schedule: Some(Schedule::Regenerate), ..settings };
    let whole = film(&mut renderer, &settings);
    renderer.limit_submissions(Some(1000));
    let part = |renderer: &mut Renderer, rows, samples| {
        renderer.render_part(&settings, &SampleBlock { rows, samples }, &mut ()).unwrap().film
    };
    let mut sum = part(&mut renderer, 5..9, 0..300);
    sum.add(&part(&mut renderer, 0..5, 256..300)).unwrap();
    assert_ne!(sum, whole, "a part is missing");
    sum.add(&part(&mut renderer, 0..5, 0..256)).unwrap();
    assert_eq!(sum.aovs, whole.aovs);
    assert!(sum == whole);
    let plain = Settings { guides: false, ..settings };
    let other = film(&mut renderer, &plain);
    assert!(sum.add(&other).is_err(), "films with and without guides were added");
}

/// A film that each backend denoises has the CPU's bits on CUDA and on software Vulkan. Hardware
/// may be off by 2.5 ULP in divisions there, which a weight passes on to neighbours.
fn the_denoised_image_is_the_cpus(subject: BackendUnderTest) {
    for (name, filter) in [("rtiow_final.ron", Filter::Svgf), ("cornell_box.ron", Filter::Atrous)] {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let mut reference = cpu(&scene);
        let settings = settings(&scene, Sampler::Independent, 2);
        let film = film(&mut reference, &settings);
        let denoise = DenoiseSettings::new(filter);
        let image = |renderer: &mut Renderer, denoise| {
            renderer.denoise(&film, &settings, denoise).unwrap().0.pixels.into_flattened()
        };
        let (got, want) = (image(&mut renderer, &denoise), image(&mut reference, &denoise));
        let exact = subject == BackendUnderTest::Cuda || subject.is_software();
        let bound = if exact { 0.0 } else { 1e-3 };
        let differ =
            |a: &[f32]| a.iter().zip(&want).filter(|(a, b)| (*a - *b).abs() > bound * (1.0 + *b)).count();
        assert_eq!(differ(&got), 0, "{name}");
        // Negative control: one level less.
        let less = DenoiseSettings { levels: denoise.levels - 1, ..denoise };
        assert!(differ(&image(&mut renderer, &less)) > 100, "{name}: negative control not detected");
    }
}

/// A live frame, which stays on the device, is the frame that would be written to a file.
fn a_live_frame_is_the_same(subject: BackendUnderTest) {
    let scene = scene("cornell_box.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene, Sampler::Independent, 3);
    let denoise = DenoiseSettings::new(Filter::Svgf);
    let film = film(&mut renderer, &settings);
    let want = renderer.denoise(&film, &settings, denoise).unwrap().0;
    for samples_a_submission in [None, Some(700)] {
        renderer.limit_submissions(samples_a_submission);
        for _ in 0..2 {
            let live = renderer.live(&settings, Some(&denoise), None).unwrap();
            assert!(renderer.read_live(&live).unwrap() == want);
        }
    }
    let other = renderer.live(&Settings { seed: 12, ..settings.clone() }, Some(&denoise), None).unwrap();
    assert!(renderer.read_live(&other).unwrap() != want, "negative control not detected");
    let small = renderer.live(&Settings { width: 8, height: 8, ..settings }, Some(&denoise), None).unwrap();
    assert_eq!(renderer.read_live(&small).unwrap().pixels.len(), 64);
}

/// A hidden sky adds nothing to camera rays, and all other rays see it: pixels whose samples all
/// hit something keep their bits.
fn a_hidden_sky_is_black_to_camera_rays_alone(subject: BackendUnderTest) {
    for name in ["rtiow_final.ron", "a ball under the studio"] {
        let scene = if name == "rtiow_final.ron" { scene(name) } else { ball_under_studio() };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let shown = settings(&scene, Sampler::Independent, 4);
        let hidden = Settings { hidden_sky: true, ..shown.clone() };
        let (a, b) = (film(&mut renderer, &shown), film(&mut renderer, &hidden));
        let alpha = b.alpha().unwrap();
        assert_eq!(a.alpha().unwrap(), alpha, "{name}");
        let (mut skies, mut bodies) = (0, 0);
        for ((shown, hidden), alpha) in a.pixels.iter().zip(b.pixels.iter()).zip(alpha) {
            if alpha == 0.0 {
                assert_eq!(hidden.mean(), [0.0; 3], "{name}");
                assert!(shown.mean()[1] > 0.0, "{name}: negative control not detected");
                skies += 1;
            } else if alpha == 1.0 {
                assert_eq!(hidden.mean(), shown.mean(), "{name}");
                bodies += u32::from(shown.mean()[1] > 0.0);
            }
        }
        assert!(skies > 50 && bodies > 50, "{name}: {skies} {bodies}");
    }
}

/// Returns a ball under the panorama of the studio.
fn ball_under_studio() -> Scene {
    let text = "Scene(version: 1, image: (width: 40, height: 30), sky: Studio(), \
        camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 40), \
        materials: { \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }, \
        objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"a\")])";
    Scene::parse(text, "studio").unwrap()
}

for_each_route!(
    the_image_does_not_change,
    a_hidden_sky_is_black_to_camera_rays_alone,
    they_are_of_the_first_hit,
    they_are_the_cpus,
    parts_add_up,
    the_denoised_image_is_the_cpus,
    a_live_frame_is_the_same,
);
