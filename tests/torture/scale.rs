//! Scenes at other scales and places (8, 29, 42).

use glam::DVec3;
use std::path::Path;
use trisect::render::Settings;
use trisect::scene::{Rebase, Scene};
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::path::FirstHit;
use trisect_tests::program::folder;
use trisect_tests::renders::{differing, film, independent, scene_files};
use trisect_tests::report::{Outcome, report};
use trisect_tests::statistics::Blocks;
use trisect_tests::{BackendUnderTest, for_each_route, root};

fn scaled(path: &Path, k: i32) -> Scene {
    Scene::load_in(path, Rebase { origin: DVec3::ZERO, scale: 2f64.powi(k) }).unwrap()
}

/// Returns the exponents of the powers of two for a scene: all for one scene, some for the others,
/// and few for wgpu, which compiles the kernel for each image.
fn powers(subject: BackendUnderTest, name: &str, index: usize) -> Vec<i32> {
    let first = name == "three_spheres.ron";
    match subject {
        BackendUnderTest::Cpu | BackendUnderTest::Cuda if name == "mesh.ron" => vec![-20, 20], // 1.3 million triangles
        BackendUnderTest::Cpu | BackendUnderTest::Cuda if first => (-20..=20).filter(|&k| k != 0).collect(),
        BackendUnderTest::Cpu | BackendUnderTest::Cuda => vec![-20, -13, -7, -1, 1, 7, 13, 20],
        _ if first => vec![-20, -7, 7, 20],
        BackendUnderTest::WgpuNaga if name != "cornell_box.ron" => vec![],
        _ => vec![if index.is_multiple_of(2) { -20 } else { 20 }],
    }
}

/// Returns whether the image of a square of two triangles changes when the scene is multiplied by
/// 2^-20 or 2^20. The square extends by `half` to each side. Where the image changes, the loader
/// must have warned of a dropped triangle, as it does for edges below 3e-10 or above 4e9.
fn square_changes(subject: BackendUnderTest, half: f64) -> Option<bool> {
    let folder = folder("torture", &format!("{}-{half:e}", subject.label()));
    let points = [(-half, -half), (half, -half), (half, half), (-half, half)];
    let vertices: String = points.iter().map(|(x, z)| format!("{x} 0 {z}\n")).collect();
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    std::fs::write(folder.join("square.ply"), format!("{header}{vertices}3 0 2 1\n3 0 3 2\n")).unwrap();
    let path = folder.join("square.ron");
    let text = format!(
        "Scene(version: 1, image: (width: 12, height: 8, samples: 2, depth: 3), \
         camera: (look_from: (0, {half}, {half}), look_at: (0, 0, 0), vertical_fov: 60), \
         sky: Gradient(bottom: (1, 1, 1), top: (0, 0, 0)), \
         materials: {{ \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }}, objects: [Mesh(file: \"square.ply\", material: \"a\")])"
    );
    std::fs::write(&path, text).unwrap();
    let image = |scene: &Scene| Some(film(&mut subject.renderer(scene)?, &independent(scene)));
    let want = image(&Scene::load(&path).unwrap())?;
    let mut dropped = false;
    for k in [-20, 20] {
        let scene = scaled(&path, k);
        let changed = differing(&image(&scene)?, &want) > 0;
        let says_so = scene.warnings.iter().any(|warning| warning.contains("dropped"));
        assert_eq!(changed, says_so, "{half:e} times 2^{k}: {:?}", scene.warnings);
        dropped |= changed;
    }
    std::fs::remove_dir_all(folder).unwrap();
    Some(dropped)
}

/// A scene times 2^k has the same image, bit by bit. No number leaves f32's range, so each
/// operation scales exactly, and there is no absolute epsilon. (Vulkan may flush denormals and
/// round differently, but does so alike at each scale.)
fn t08_scaled_by_powers_of_two(subject: BackendUnderTest) {
    let (mut images, mut scenes) = (0, 0);
    let mut faults = Vec::new();
    for (index, path) in scene_files().iter().enumerate() {
        let name = path.file_name().unwrap().display().to_string();
        let powers = powers(subject, &name, index);
        if powers.is_empty() {
            continue;
        }
        let scene = Scene::load(path).unwrap();
        let (width, height, samples) = if subject.is_software() { (12, 8, 2) } else { (32, 24, 8) };
        let settings = Settings { width, height, samples, seed: 8, ..independent(&scene) };
        let image = |scene: &Scene| Some(film(&mut subject.renderer(scene)?, &settings));
        let Some(want) = image(&scene) else { return };
        let changed = |scene: &Scene| differing(&image(scene).expect("the backend opened before"), &want);
        for &k in &powers {
            let changed = changed(&scaled(path, k));
            if changed > 0 {
                faults.push(format!("{name} times 2^{k}: {changed} of {} pixels", want.pixels.len()));
            }
            images += 1;
        }
        scenes += 1;
        if name == "three_spheres.ron" {
            // Negative controls: a factor that rounds; an eye that is moved by an absolute 1e-4.
            let by_three = Scene::load_in(path, Rebase { origin: DVec3::ZERO, scale: 3.0 }).unwrap();
            assert!(changed(&by_three) > 0, "negative control not detected");
            let mut faulty = scaled(path, -7);
            faulty.camera.look_from += 1e-4;
            assert!(changed(&faulty) > 0, "negative control not detected");
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
    let figure = format!("{images} images of {scenes} scenes times 2^k, k from -20 to 20: the same bits");
    assert_eq!(square_changes(subject, 1.0), Some(false));
    let bounded =
        [5e-5, 2500.0].map(|half| square_changes(subject, half).expect("the backend opened before"));
    if bounded == [false; 2] {
        report(8, subject, Outcome::Passed, &figure);
    } else {
        let why = "triangles whose edges leave 3e-10 to 4e9 there are dropped, with a warning";
        report(8, subject, Outcome::Bounded, format!("{figure}; {why}"));
    }
}

/// Changes of the first hits of a moved scene.
struct Moved {
    /// Fraction of the pixels that show another primitive.
    changed: f64,
    /// Median relative error of the distance, over the other pixels.
    median: f64,
    /// Maximum relative error of the distance, over the other pixels.
    greatest: f64,
}

fn compare(hits: &[FirstHit], wanted: &[FirstHit]) -> Moved {
    let pairs = || hits.iter().zip(wanted);
    let changed = pairs().filter(|(a, b)| a.primitive != b.primitive).count();
    let same = pairs().filter(|(a, b)| a.primitive == b.primitive && b.primitive != NO_PRIMITIVE);
    let error = |(a, b): (&FirstHit, &FirstHit)| (f64::from(a.distance) / f64::from(b.distance) - 1.0).abs();
    let mut errors: Vec<f64> = same.map(error).collect();
    errors.sort_by(f64::total_cmp);
    let median = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
    Moved {
        changed: changed as f64 / wanted.len() as f64,
        median,
        greatest: errors.last().copied().unwrap_or(f64::NAN),
    }
}

/// Radius of the small spheres.
const FEATURE: f64 = 0.5;

/// The errors of first hits grow as predicted when three spheres are moved by 2^k along each axis.
/// Coordinates there are multiples of 2^(k - 23), so that the eye and each centre are off by at
/// most 2^(k - 24) per axis, and so are hits, except at grazing angles.
fn t29_translated_by_powers_of_two(subject: BackendUnderTest) {
    let path = root().join("scenes/three_spheres.ron");
    let scene = Scene::load(&path).unwrap();
    let (width, height) = if subject.is_software() { (48, 27) } else { (160, 90) };
    let settings = Settings { width, height, samples: 2, depth: 8, ..independent(&scene) };
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let wanted = renderer.first_hits(&settings, 0).unwrap();
    let mut table = "   k  pixels changed  median error  greatest error  predicted".to_owned();
    let mut medians = Vec::new();
    for k in (0..=24).step_by(if subject.is_software() { 4 } else { 1 }) {
        let space = Rebase { origin: DVec3::splat(-2f64.powi(k)), scale: 1.0 };
        let mut renderer = subject.renderer(&Scene::load_in(&path, space).unwrap()).expect("opened before");
        let moved = compare(&renderer.first_hits(&settings, 0).unwrap(), &wanted);
        // Six roundings, of the coordinates of the eye and of a centre, over the distance between
        // the eye and the spheres. Each is at most half a unit in the last place, so the median
        // stays below twice this.
        let predicted = 2f64.powi(k - 24) * 6f64.sqrt() / 4.0;
        table += &format!(
            "\n{k:4} {:15.4} {:13.1e} {:15.1e} {predicted:10.1e}",
            moved.changed, moved.median, moved.greatest
        );
        let counts = film(&mut renderer, &settings).counts();
        assert_eq!(counts.samples, settings.total_samples(), "2^{k}: {counts:?}");
        if k <= 20 {
            assert!(moved.median <= 2.0 * predicted + 1e-6, "2^{k}: {:e} for {predicted:e}", moved.median);
            // Pixels at edges change. Their share is the error over the spheres' size, times the
            // length of the edges in the picture.
            let limit = 4.0 * 2f64.powi(k - 23) / FEATURE + 0.001;
            assert!(moved.changed <= limit, "2^{k}: {} beyond {limit}", moved.changed);
        }
        medians.push((k, moved.median, moved.changed));
    }
    eprintln!("{}\n{table}", subject.label());
    // The error grows as predicted, within a factor of 8: 2^8 times the error for 2^8 times the
    // distance.
    let at = |k: i32| medians.iter().find(|m| m.0 == k).map_or(f64::NAN, |m| m.1);
    let growth = at(20) / at(12);
    assert!((32.0..2048.0).contains(&growth), "{growth}");
    // The knee is where coordinates are multiples of the spheres' radius, 2^(k - 23) = 0.5 at k =
    // 22. It is also the negative control: errors that do not grow would show no knee.
    let knee = medians.iter().find(|m| m.2 > 0.2).map_or(i32::MAX, |m| m.0);
    assert!((22..=24).contains(&knee), "{knee}");
    let figure = format!(
        "median error of a distance {:.0e} at 2^8, {:.0e} at 2^16, {:.0e} at 2^20; the knee at 2^{knee} for 2^22; no NaN, no crash",
        at(8),
        at(16),
        at(20)
    );
    report(29, subject, Outcome::Passed, &figure);
}

/// Scenes of 1e-20 units are refused at load with the reason, before a backend gets them, and the
/// smallest scene in range renders right.
fn t42_denormal_scene(subject: BackendUnderTest) {
    let parse = |object: &str, scale: f64| {
        let text = format!(
            "Scene(version: 1, image: (width: 16, height: 16, samples: 1, depth: 5), \
             camera: (look_from: (0, 0, 4e-20), look_at: (0, 0, 0), vertical_fov: 40), \
             sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)), \
             materials: {{ \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }}, objects: [{object}])"
        );
        Scene::parse_in(&text, "denormal", Rebase { origin: DVec3::ZERO, scale })
    };
    let tiny = [
        ("Sphere(center: (0, 0, 0), radius: 1e-20, material: \"a\")", "length"),
        ("Disc(center: (0, 0, 0), normal: (0, 0, 1), radius: 1e-20, material: \"a\")", "length"),
        ("Quad(corner: (0, 0, 0), u: (1e-20, 0, 0), v: (0, 1e-20, 0), material: \"a\")", "1e-18"),
        ("Box(min: (0, 0, 0), max: (1e-20, 1e-20, 1e-20), material: \"a\")", "1e-18"),
    ];
    for (object, reason) in tiny {
        let refusal = parse(object, 1.0).map(|_| ()).unwrap_err().to_string();
        assert!(refusal.contains(reason), "{object}: {refusal}");
    }
    for name in ["three_spheres.ron", "cornell_box.ron", "gltf/features.gltf"] {
        let path = root().join("scenes").join(name);
        let refusal = Scene::load_in(&path, Rebase { origin: DVec3::ZERO, scale: 1e-20 });
        assert!(refusal.is_err(), "{name}");
    }
    // The smallest scene in range: the smallest radius is 1.7e-18 at 2^-58. Its square, 2^-118, is
    // a normal number. Squares of offsets from the centre are denormal there. On the CPU and CUDA
    // they are multiples of 2^-149, which is 2^-31 of the radius's square. Where Vulkan flushes
    // denormals, as it may, those up to 2^-8 of it are 0, and the image differs within its noise.
    let path = root().join("scenes/three_spheres.ron");
    let scene = Scene::load(&path).unwrap();
    let settings = Settings { width: 24, height: 14, samples: 4, depth: 8, seed: 8, ..independent(&scene) };
    let image = |scene: &Scene| Some(film(&mut subject.renderer(scene)?, &settings));
    let Some(want) = image(&scene) else { return };
    let changed = |scene: &Scene| differing(&image(scene).expect("the backend opened before"), &want);
    let pixels = want.pixels.len();
    for k in [-30, -50] {
        assert_eq!(changed(&scaled(&path, k)), 0, "2^{k}");
    }
    let smallest = image(&scaled(&path, -58)).expect("the backend opened before");
    let lost = differing(&smallest, &want);
    if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
        assert!(lost * 100 <= pixels, "{lost} of {pixels}");
    } else {
        let test = Blocks::new(&smallest).compare(&Blocks::new(&want), 1e-5);
        assert!(test.passes(), "{test:?}");
    }
    let rounded = Scene::load_in(&path, Rebase { origin: DVec3::ZERO, scale: 3.0 * 2f64.powi(-50) }).unwrap();
    assert!(changed(&rounded) > 0, "negative control not detected");
    let outcome = if lost == 0 { Outcome::Passed } else { Outcome::Bounded };
    let figure =
        format!("1e-20 units are refused with the reason; at 2^-58, {lost} of {pixels} pixels differ");
    report(42, subject, outcome, &figure);
}

for_each_route!(t08_scaled_by_powers_of_two, t29_translated_by_powers_of_two, t42_denormal_scene);
