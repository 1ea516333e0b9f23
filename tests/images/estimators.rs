//! Different estimators give the same mean: with and without light sampling, with each sampler,
//! with and without roulette, and with any features of the kernel.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::device::DeviceKind;
use trisect::film::Film;
use trisect::render::{KernelFeatures, Sampler, Settings};
use trisect::scene::Scene;
use trisect_shared::bsdf;
use trisect_shared::features::{Features, NAMES, NEEDS, RARE, of_material};
use trisect_tests::renders::{differing, film, independent, lit};
use trisect_tests::statistics::{BlockTest, Blocks, GLOBAL_LIMIT};
use trisect_tests::{BackendUnderTest, for_each_backend, scene};

/// A scene with small settings, and the CPU's samples per pixel with and without light sampling.
struct Case {
    name: &'static str,
    scene: Scene,
    settings: Settings,
    samples: (u32, u32),
}

fn case(name: &'static str, samples: (u32, u32)) -> Case {
    let scene = scene(name);
    let settings = Settings { width: 32, height: 24, depth: 4, ..independent(&scene) };
    Case { name, scene, settings, samples }
}

fn cases() -> Vec<Case> {
    let mut cases = vec![
        case("cornell_box.ron", (128, 1024)),
        case("materials.ron", (128, 512)),
        case("next_week.ron", (128, 1024)),
        case("gltf/features.gltf", (128, 512)),
        case("light_sphere.ron", (128, 1024)),
        case("veach_mis.ron", (128, 512)),
    ];
    // Without light sampling, paths never find lights without extent.
    cases[3].scene.lights.clear();
    // One path in ten thousand finds the small lights of this scene by chance.
    cases[5].scene.spheres.retain(|s| s.radius > 0.2);
    // An environment map as the only light.
    let mut panorama = case("materials.ron", (128, 256));
    panorama.name = "materials.ron without its area light";
    panorama.scene.flats.retain(|flat| panorama.scene.materials[flat.material as usize].emission.x == 0.0);
    cases.push(panorama);
    cases
}

/// Reduces pixels and samples on all backends but the CPU, because their device may be a slow
/// software adapter. Returns whether the case is tested on this backend.
fn smaller(subject: BackendUnderTest, case: &mut Case) -> bool {
    if subject != BackendUnderTest::Cpu {
        (case.settings.width, case.settings.height) = (16, 12);
        case.samples = (case.samples.0 / 16, case.samples.1 / 32);
    }
    subject == BackendUnderTest::Cpu
        || ["cornell_box.ron", "materials.ron", "gltf/features.gltf"].contains(&case.name)
}

/// Compares blocks and the whole of `with`, rendered with light sampling, and of the case's scene,
/// rendered without.
fn compare(subject: BackendUnderTest, case: &Case, with: &Scene) -> Option<BlockTest> {
    let render = |scene: &Scene, light_sampling, samples, seed| {
        let settings = Settings { samples, light_sampling, seed, ..case.settings.clone() };
        Some(Blocks::new(&film(&mut subject.renderer(scene)?, &settings)))
    };
    let without = render(&case.scene, false, case.samples.1, 1)?;
    Some(render(with, true, case.samples.0, 2)?.compare(&without, 1e-5))
}

/// Next-event estimation with multiple importance sampling changes the noise, not the mean.
fn light_sampling_keeps_the_mean(subject: BackendUnderTest) {
    for mut case in cases() {
        if !smaller(subject, &mut case) {
            continue;
        }
        let Some(test) = compare(subject, &case, &case.scene) else { return };
        eprintln!("{}: {test:?}", case.name);
        assert!(test.whole < GLOBAL_LIMIT, "{}: {test:?}", case.name);
        if subject != BackendUnderTest::Cpu {
            continue;
        }
        assert!(test.passes(), "{}: {test:?}", case.name);
    }
}

/// Negative control: weights that are 2 % off, represented by brighter lights.
#[test]
fn negative_control_wrong_weights_are_found() {
    let case = case("light_sphere.ron", (256, 4096));
    let test = compare(BackendUnderTest::Cpu, &case, &lit(&case.scene, 1.02)).unwrap();
    assert!(test.whole > GLOBAL_LIMIT, "negative control not detected: {test:?}");
}

/// Sobol samples and independent samples, and roulette from the first or a later segment, give the
/// same mean. (The variance that a film estimates from Sobol samples is that of independent
/// samples, which is larger, so the test is less strict for them.)
fn samplers_and_roulette_keep_the_mean(subject: BackendUnderTest) {
    let names = ["cornell_box.ron", "materials.ron", "rtiow_final.ron"];
    for name in names.into_iter().take(if subject == BackendUnderTest::Cpu { 3 } else { 1 }) {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let samples = if subject == BackendUnderTest::Cpu { 256 } else { 4 };
        let (width, height) = if subject == BackendUnderTest::Cpu { (32, 24) } else { (16, 12) };
        let plain = Settings { width, height, samples, depth: 12, seed: 1, ..independent(&scene) };
        let want = Blocks::new(&film(&mut renderer, &plain));
        let sobol = Settings { sampler: Sampler::Sobol, seed: 2, ..plain.clone() };
        let others = [
            ("sobol", sobol.clone()),
            ("roulette", Settings { roulette: true, seed: 3, ..plain.clone() }),
            ("late roulette", Settings { roulette: true, roulette_depth: 4, seed: 4, ..plain.clone() }),
            ("sobol and roulette", Settings { roulette: true, seed: 5, ..sobol.clone() }),
        ];
        for (way, settings) in others {
            let got = film(&mut renderer, &settings);
            let test = Blocks::new(&got).compare(&want, 1e-5);
            eprintln!("{name}, {way}: {test:?}");
            assert!(test.whole < GLOBAL_LIMIT, "{name}, {way}: {test:?}");
            assert!(subject != BackendUnderTest::Cpu || test.share > 0.99, "{name}, {way}: {test:?}");
        }
        // Negative control: lights that are brighter by 5 %.
        if subject == BackendUnderTest::Cpu && name != "cornell_box.ron" {
            let got = film(&mut subject.renderer(&lit(&scene, 1.05)).unwrap(), &sobol);
            let test = Blocks::new(&got).compare(&want, 1e-5);
            assert!(test.whole > GLOBAL_LIMIT, "{name}: negative control not detected: {test:?}");
        }
    }
}

/// A kernel that has more features than the scene needs renders the same film: each feature by
/// itself, and all of them. On a software adapter, which takes seconds to compile a kernel, the
/// features that are not rare are added by halves, and the others only all together. A GPU's Vulkan
/// driver may round a kernel's divisions in another way than another kernel's; a twentieth of the
/// pixels may differ there. Through naga, which writes no `NoContraction`, it may also contract
/// other sums, which any pixel may show; all but a twentieth are the same within rounding, and all
/// of a software adapter's.
fn more_features_change_no_bit(subject: BackendUnderTest) {
    for name in ["three_spheres.ron", "cornell_box.ron", "next_week.ron", "gltf/features.glb"] {
        let scene = scene(name);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let info = renderer.device().info();
        let is_software = info.kind == DeviceKind::SoftwareGpu;
        let by_vulkan = info.backend == "wgpu" && info.kind == DeviceKind::Gpu;
        let needed = Settings { width: 32, height: 18, samples: 2, ..independent(&scene) };
        let want = film(&mut renderer, &needed);
        let changed = |got: &Film| differing(got, &want);
        let allowed = if by_vulkan { needed.pixels() as usize / 20 } else { 0 };
        let materials = bsdf::NAMES.iter().map(|(kind, _)| of_material(*kind));
        let single = NAMES.iter().map(|(feature, _)| *feature).chain(materials);
        let mut sets: Vec<Features> = single.filter(|feature| feature & NEEDS != 0).collect();
        match (name, is_software) {
            ("three_spheres.ron", true) => {
                let half = |from| sets.iter().skip(from).step_by(2).fold(0, |all, feature| all | feature);
                sets = [half(0), half(1)].map(|half| half & !RARE).to_vec();
            }
            ("three_spheres.ron", false) => {}
            _ => sets.clear(),
        }
        for features in sets.into_iter().chain([NEEDS]) {
            let more = Settings { features: KernelFeatures::Also(features), ..needed.clone() };
            let count = changed(&film(&mut renderer, &more));
            assert!(count <= allowed, "{name}, {}: {count} pixels differ", more.features);
        }
        let other = Settings { seed: 1, features: KernelFeatures::Also(NEEDS), ..needed };
        assert!(changed(&film(&mut renderer, &other)) > allowed, "negative control not detected");
    }
}

for_each_backend!(
    light_sampling_keeps_the_mean,
    samplers_and_roulette_keep_the_mean,
    more_features_change_no_bit
);

/// Kernels of few and of many features share their arithmetic: an emissive material that no object
/// uses changes the kernel, and not the film.
#[test]
fn an_unused_material_changes_no_bit() {
    for name in ["three_spheres.ron", "rtiow_final.ron"] {
        let scene = scene(name);
        let mut general = scene.clone();
        let mut lamp = general.materials[0];
        (lamp.emission, lamp.light_pdf) = (glam::Vec3::ONE, 1.0);
        general.materials.push(lamp);
        let (mut simple, mut all) = (
            BackendUnderTest::Cpu.renderer(&scene).unwrap(),
            BackendUnderTest::Cpu.renderer(&general).unwrap(),
        );
        for sampler in [Sampler::Independent, Sampler::Sobol] {
            for roulette in [false, true] {
                let settings = Settings {
                    width: 160,
                    height: 90,
                    samples: 16,
                    sampler,
                    roulette,
                    ..independent(&scene)
                };
                let want = film(&mut simple, &settings);
                let count = differing(&film(&mut all, &settings), &want);
                assert_eq!(count, 0, "{name} {sampler:?} {roulette}");
                let other = Settings { seed: 1, ..settings };
                assert_ne!(differing(&film(&mut all, &other), &want), 0, "negative control not detected");
            }
        }
    }
}
