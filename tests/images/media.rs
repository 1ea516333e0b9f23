//! Participating media against known answers: transmittance, emission, single scattering, energy;
//! light that is sampled against light that is found; on every backend.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use glam::{DAffine3, DVec3};
use std::f64::consts::PI;
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect::scene::builder::{Camera, Gradient, Interface, SceneBuilder};
use trisect::scene::description::PunctualLight;
use trisect::scene::medium::{DensityGrid, Medium};
use trisect_tests::renders::{cpu, differing, film};
use trisect_tests::statistics::{Known, ZTest};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Returns a scene that a far camera looks at along -z, in a sky of radiance 1.
fn scene(media: &str, materials: &str, objects: &str) -> Scene {
    let text = format!(
        "Scene(version: 1, image: (width: 8, height: 8, samples: 64, depth: 2000),
        camera: (look_from: (0, 0, 20), look_at: (0, 0, 0), vertical_fov: 0.1),
        sky: Uniform(radiance: (1, 1, 1)), media: {{ {media} }},
        materials: {{ {materials} }}, objects: [ {objects} ])"
    );
    Scene::parse(&text, "test").unwrap()
}

fn mean(film: &Film) -> DVec3 {
    let sum: DVec3 = film.pixels.iter().map(|pixel| DVec3::from(pixel.mean())).sum();
    sum / film.pixels.len() as f64
}

/// Returns the film, no sample of which was left out.
fn render(subject: BackendUnderTest, scene: &Scene, settings: &Settings) -> Option<Film> {
    let film = film(&mut subject.renderer(scene)?, settings);
    let counts = film.counts();
    assert_eq!((counts.rejected, counts.unwritten), (0, 0));
    Some(film)
}

/// Returns the number of samples: fewer where a GPU is a program.
fn samples(subject: BackendUnderTest, many: u32, few: u32) -> u32 {
    if subject.is_software() { few } else { many }
}

const BOX: &str = r#"Box(min: (-1, -1, -1), max: (1, 1, 1), material: "edge")"#;
const BALL: &str = r#"Sphere(center: (0, 0, 0), radius: 1, material: "edge")"#;
const EDGE: &str = r#""edge": Interface(medium: "smoke")"#;

/// Returns a grid of 20 x 12 x 10 voxels with empty parts, and a peak of 3.
fn grid() -> DensityGrid {
    let mut densities = Vec::new();
    for z in 0..10 {
        for y in 0..12 {
            for x in 0..20 {
                let inside = x > 9 || (y + z) % 5 == 0;
                densities.push(if inside { ((x * 7 + y * 3 + z * 5) % 13) as f32 * 0.25 } else { 0.0 });
            }
        }
    }
    DensityGrid::new([20, 12, 10], densities).unwrap()
}

/// Returns the interpolated density of the grid at a place of the unit cube.
fn density(grid: &DensityGrid, place: DVec3) -> f64 {
    let size = grid.size();
    let at: [(u32, u32, f64); 3] = std::array::from_fn(|axis| {
        let last = size[axis] - 1;
        let p = (place[axis] * f64::from(size[axis]) - 0.5).clamp(0.0, f64::from(last));
        (p as u32, (p as u32 + 1).min(last), p.fract())
    });
    let mut sum = 0.0;
    for corner in 0..8 {
        let [x, y, z]: [(u32, f64); 3] = std::array::from_fn(|axis| {
            let (low, high, f) = at[axis];
            if corner >> axis & 1 == 0 { (low, 1.0 - f) } else { (high, f) }
        });
        let index = (z.0 * size[1] + y.0) * size[0] + x.0;
        sum += f64::from(grid.densities()[index as usize]) * x.1 * y.1 * z.1;
    }
    sum
}

/// Returns the box from -1 to 1 filled with a medium with the grid, turned in the box.
fn grid_scene(medium: Medium) -> (Scene, DAffine3) {
    let map = DAffine3::from_rotation_y(0.4)
        * DAffine3::from_scale(DVec3::new(1.4, 1.5, 1.6))
        * DAffine3::from_translation(DVec3::splat(-0.5));
    let mut scene = SceneBuilder::new();
    let smoke = scene.medium(medium.grid(grid(), map));
    let edge = scene.filled(Interface {}, smoke);
    for (axis, side) in [(0, -1.2), (0, 1.2), (1, -1.2), (1, 1.2), (2, -1.2), (2, 1.2)] {
        let normal = DVec3::AXES[axis] * f64::signum(side);
        let (u, v) = (DVec3::AXES[(axis + 1) % 3] * 2.4, DVec3::AXES[(axis + 2) % 3] * 2.4);
        let (u, v) = if side < 0.0 { (v, u) } else { (u, v) };
        scene.quad(normal * 1.2 - (u + v) * 0.5, u, v, edge);
    }
    scene.sky(Gradient::new([1.0; 3], [1.0; 3]));
    scene.camera(Camera::look_at([0.1, -0.2, 20.0], [0.1, -0.2, 0.0]).fov_degrees(0.01));
    let mut scene = scene.build().unwrap();
    scene.image.depth = 2000;
    (scene, map)
}

/// Light through an absorbing box is weakened by Beer and Lambert's law, to the camera and to a
/// surface that a sun lights through the box.
fn absorption_is_beer_and_lamberts(subject: BackendUnderTest) {
    let sigma = DVec3::new(0.3, 0.8, 2.0);
    let smoke = r#""smoke": (extinction: (0.3, 0.8, 2))"#;
    let want = (-2.0 * sigma).exp();
    let seen = scene(smoke, EDGE, BOX);
    let Some(film) = render(subject, &seen, &Settings::of(&seen)) else { return };
    let found = mean(&film);
    assert!((found - want).abs().max_element() < 1e-4, "{found} for {want}");
    // Negative control: 1 % more.
    assert!((found - (-2.02 * sigma).exp()).abs().max_element() > 1e-3);

    // Within an inner medium that counts alone, and behind it the outer one again.
    let inner = r#""dense": (extinction: (1.5, 0.1, 0.4))"#;
    let core = r#""core": Interface(medium: "dense")"#;
    let ball = r#"Sphere(center: (0, 0, 0.2), radius: 0.5, material: "core")"#;
    let nested = scene(&format!("{smoke}, {inner}"), &format!("{EDGE}, {core}"), &format!("{BOX}, {ball}"));
    let Some(film) = render(subject, &nested, &Settings::of(&nested)) else { return };
    let (found, of_both) = (mean(&film), (-sigma - DVec3::new(1.5, 0.1, 0.4)).exp());
    assert!((found - of_both).abs().max_element() < 1e-3, "{found} for {of_both}");

    // The sun comes along -z through the box to a wall, which the camera sees beside it.
    let lit = |objects: &str| {
        let wall = r#""wall": Lambertian(albedo: (0.5, 0.5, 0.5))"#;
        let mut scene = scene(smoke, &format!("{EDGE}, {wall}"), objects);
        scene.sky = trisect_shared::sky::Sky { bottom: glam::Vec3::ZERO, top: glam::Vec3::ZERO, ..scene.sky };
        scene.camera.look_from = DVec3::new(9.0, 0.0, -1.5);
        scene.camera.look_at = DVec3::new(0.0, 0.0, -3.0);
        scene.lights.extend(sun().lights);
        scene
    };
    let wall = r#"Quad(corner: (-5, -5, -3), u: (10, 0, 0), v: (0, 10, 0), material: "wall")"#;
    let (clear, through) = (lit(wall), lit(&format!("{wall}, {BOX}")));
    let settings = Settings { depth: 2, samples: 16, ..Settings::of(&clear) };
    let Some(clear) = render(subject, &clear, &settings) else { return };
    let Some(through) = render(subject, &through, &settings) else { return };
    let ratio = mean(&through) / mean(&clear);
    assert!((ratio - want).abs().max_element() < 1e-4, "{ratio} for {want}");
}

/// Returns a scene with the sun.
fn sun() -> Scene {
    let mut scene = SceneBuilder::new();
    let direction = DVec3::NEG_Z;
    scene.light(PunctualLight::Directional { direction, irradiance: DVec3::ONE });
    scene.camera(Camera::look_at([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]));
    scene.build().unwrap()
}

/// The transmittance of a grid is that of the integral of its density.
fn grids_absorb_by_their_density(subject: BackendUnderTest) {
    let sigma = DVec3::new(0.2, 0.5, 1.5);
    let (scene, map) = grid_scene(Medium::new(sigma, [0.0; 3]));
    let (grid, back, n) = (grid(), map.inverse(), 200_000);
    let along = |i: u32| back.transform_point3(DVec3::new(0.1, -0.2, (f64::from(i) + 0.5) / 5e4 - 2.0));
    let places = (0..n).map(along).filter(|p| p.cmpgt(DVec3::ZERO).all() && p.cmplt(DVec3::ONE).all());
    let depth: f64 = places.map(|place| density(&grid, place)).sum::<f64>() / 5e4;
    let settings =
        Settings { width: 8, height: 8, samples: samples(subject, 1024, 256), ..Settings::of(&scene) };
    let Some(film) = render(subject, &scene, &settings) else { return };
    for (c, sigma) in sigma.to_array().into_iter().enumerate() {
        let count = film.pixels.len() as f64;
        let mean = film.pixels.iter().map(|p| p.mean()[c]).sum::<f64>() / count;
        let error = film.pixels.iter().map(|p| p.variance_of_mean()[c]).sum::<f64>().sqrt() / count;
        let want = (-sigma * depth).exp();
        assert!((mean - want).abs() < 4.5 * error + 1e-3 * want, "{c}: {mean} for {want}, error {error}");
        let wrong = (-1.1 * sigma * depth).exp();
        let is_found = (mean - wrong).abs() > 4.5 * error;
        assert!(is_found || subject.is_software(), "{c}: negative control: {mean} for {wrong}");
    }
}

/// A medium that scatters all light cannot be seen in a furnace, whatever its phase function, its
/// colour, its densities and its boundary, from outside and from inside.
fn media_of_albedo_1_vanish(subject: BackendUnderTest) {
    let smoke = |extinction: &str, g: f64| {
        format!(r#""smoke": (extinction: {extinction}, albedo: (1, 1, 1), anisotropy: {g})"#)
    };
    let glass = r#""edge": Dielectric(ior: 1.4, medium: "smoke")"#;
    let nested = r#"Sphere(center: (0, 0, 0), radius: 1, material: "edge"),
        Sphere(center: (0.2, 0, 0), radius: 0.5, material: "edge")"#;
    let mut cases = Vec::new();
    for g in [-0.9, 0.0, 0.9] {
        cases.push((scene(&smoke("(2, 2, 2)", g), EDGE, BALL), "grey"));
        cases.push((scene(&smoke("(0.5, 2, 6)", g), EDGE, BOX), "chromatic"));
        cases.push((grid_scene(Medium::new([1.0, 2.0, 0.0], [1.0; 3]).anisotropy(g)).0, "grid"));
    }
    cases.push((scene(&smoke("(1, 3, 2)", 0.3), glass, BALL), "glass"));
    cases.push((scene(&smoke("(1, 3, 2)", 0.3), EDGE, nested), "nested"));
    for (number, (scene, name)) in cases.into_iter().enumerate() {
        if subject.is_software() && number % 2 == 1 {
            continue;
        }
        for inside in [false, true] {
            let mut scene = scene.clone();
            scene.camera.vertical_fov = 0.08;
            if inside {
                (scene.camera.look_from, scene.camera.vertical_fov) = (DVec3::new(0.3, 0.2, 0.4), 1.0);
            }
            let settings =
                Settings { width: 8, height: 8, samples: samples(subject, 128, 16), ..Settings::of(&scene) };
            let Some(film) = render(subject, &scene, &settings) else { return };
            // Paths in dense smoke are long, and rounding grows with them.
            let known = Known::of(&film.pixels, 1.0);
            assert!(
                (known.mean - 1.0).abs() < 4.5 * known.sigma + 2e-4,
                "{number} {name} {inside}: {known:?}"
            );
            if number == 0 {
                // Negative control: 2 % are absorbed.
                scene.media[0].albedo *= 0.98;
                let Some(film) = render(subject, &scene, &settings) else { return };
                let known = Known::of(&film.pixels, 1.0);
                assert!((known.mean - 1.0).abs() > 4.5 * known.sigma + 2e-4, "negative control: {known:?}");
            }
        }
    }
}

/// Light that scatters once in a ball, from a lamp beside it: against an integral along the ray.
fn single_scattering_is_an_integral(subject: BackendUnderTest) {
    let (sigma, albedo, g) = (DVec3::new(0.4, 1.0, 2.0), DVec3::new(0.9, 0.5, 0.7), 0.6);
    let lamp = DVec3::new(0.8, 1.5, -0.6);
    let mut scene = SceneBuilder::new();
    let smoke = scene.medium(Medium::new(sigma, albedo).anisotropy(g));
    let edge = scene.filled(Interface {}, smoke);
    scene.sphere([0.0; 3], 1.0, edge);
    scene.light(PunctualLight::Point { position: lamp, intensity: DVec3::ONE });
    scene.camera(Camera::look_at([0.0, 0.2, 20.0], [0.0, 0.2, 0.0]).fov_degrees(0.001));
    let scene = scene.build().unwrap();
    let integral = |g: f64, shadows: bool| {
        let (half, n) = (0.96f64.sqrt(), 20_000);
        let mut sum = DVec3::ZERO;
        for i in 0..n {
            let t = 2.0 * half * (f64::from(i) + 0.5) / f64::from(n);
            let point = DVec3::new(0.0, 0.2, half - t);
            let (to, square) = ((lamp - point).normalize(), (lamp - point).length_squared());
            let b = -point.dot(to);
            let exit = b + (b * b - point.length_squared() + 1.0).sqrt();
            let cos = to.dot(DVec3::NEG_Z);
            let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
            let way = t + if shadows { exit } else { 0.0 };
            sum += sigma * albedo * (-sigma * way).exp() * (phase / square);
        }
        sum * (2.0 * half / f64::from(n))
    };
    let settings = Settings {
        width: 16,
        height: 16,
        samples: samples(subject, 1024, 128),
        depth: 2,
        ..Settings::of(&scene)
    };
    let Some(film) = render(subject, &scene, &settings) else { return };
    let count = film.pixels.len() as f64;
    let is = |want: DVec3| {
        (0..3).all(|c| {
            let mean = film.pixels.iter().map(|p| p.mean()[c]).sum::<f64>() / count;
            let error = film.pixels.iter().map(|p| p.variance_of_mean()[c]).sum::<f64>().sqrt() / count;
            (mean - want[c]).abs() < 4.5 * error + 1e-4 * want[c]
        })
    };
    assert!(is(integral(g, true)), "{} for {}", mean(&film), integral(g, true));
    // Negative controls: the other sign of g; a shadow ray that nothing weakens; 3 % more light.
    assert!(!is(integral(-g, true)) && !is(integral(g, false)) && !is(integral(g, true) * 1.03));
}

/// A hot layer shows its emission, as far as it is thick.
fn emission_grows_with_the_layer(subject: BackendUnderTest) {
    for (sigma, samples) in [(0.5, 1024), (1e3, 64)] {
        let smoke = format!(r#""smoke": (extinction: ({sigma}, {sigma}, 0), emission: (1, 2, 3))"#);
        let mut scene = scene(&smoke, EDGE, BOX);
        (scene.sky.bottom, scene.sky.top) = (glam::Vec3::ZERO, glam::Vec3::ZERO);
        let settings = Settings { samples, ..Settings::of(&scene) };
        let Some(film) = render(subject, &scene, &settings) else { return };
        let want = DVec3::new(1.0, 2.0, 0.0) * (1.0 - (-2.0f64 * sigma).exp());
        let found = mean(&film);
        assert!((found - want).abs().max_element() < 0.015, "{found} for {want}");
    }
}

/// Light that is sampled and light that is found have the same mean: with a lamp inside of a
/// medium, the camera inside, nested media, glass, an atmosphere, and emission of a panorama.
fn sampling_agrees_with_light(subject: BackendUnderTest) {
    let media = r#""smoke": (extinction: (0.6, 0.9, 1.5), albedo: (0.9, 0.8, 0.6), anisotropy: 0.5),
        "dense": (extinction: (3, 2, 1), albedo: (0.6, 0.9, 0.9), anisotropy: -0.4)"#;
    let materials = r#""edge": Interface(medium: "smoke"), "inner": Interface(medium: "dense"),
        "glass": Dielectric(ior: 1.3, medium: "dense"), "lamp": Emissive(radiance: (4, 4, 4), two_sided: true),
        "wall": Lambertian(albedo: (0.7, 0.7, 0.7))"#;
    let lamp = r#"Sphere(center: (0.2, 0.3, 0.1), radius: 0.25, material: "lamp")"#;
    let square = r#"Quad(corner: (-1, 2, -1), u: (2, 0, 0), v: (0, 0, 2), material: "lamp")"#;
    let floor = r#"Quad(corner: (-3, -1.1, -3), u: (0, 0, 6), v: (6, 0, 0), material: "wall")"#;
    let inner = r#"Sphere(center: (-0.4, -0.3, 0), radius: 0.4, material: "inner")"#;
    let glass = r#"Sphere(center: (-0.4, -0.3, 0), radius: 0.4, material: "glass")"#;
    let cases = [
        (format!("{BALL}, {lamp}, {floor}"), DVec3::new(0.0, 0.0, 6.0), false),
        (format!("{BOX}, {square}, {floor}, {inner}"), DVec3::new(0.0, 0.5, 6.0), false),
        (format!("{BOX}, {square}, {glass}"), DVec3::new(0.5, 0.5, 0.9), false),
        (format!("{square}, {lamp}, {floor}, {glass}"), DVec3::new(0.0, 0.5, 4.0), true),
    ];
    for (number, (objects, from, atmosphere)) in cases.into_iter().enumerate() {
        let mut scene = scene(media, materials, &objects);
        (scene.sky.bottom, scene.sky.top) = (glam::Vec3::ZERO, glam::Vec3::ZERO);
        (scene.camera.look_from, scene.camera.vertical_fov) = (from, 0.6);
        scene.atmosphere = u32::from(atmosphere);
        let (width, height) = (8, 8);
        let many = samples(subject, 4096, 512);
        let settings = Settings { width, height, samples: many, depth: 12, ..Settings::of(&scene) };
        let Some(with) = render(subject, &scene, &settings) else { return };
        let without = Settings { light_sampling: false, seed: 7, ..settings.clone() };
        let Some(without) = render(subject, &scene, &without) else { return };
        let test = ZTest::new(&with, &without);
        assert!(
            test.global.iter().all(|z| z.abs() < 4.5),
            "{number}: {test:?} {} {}",
            mean(&with),
            mean(&without)
        );
        if subject.is_software() {
            continue;
        }
        // Negative control: a lamp 15 % brighter.
        let brighter = trisect_tests::renders::lit(&scene, 1.15);
        let other = Settings { seed: 9, ..settings };
        let Some(brighter) = render(subject, &brighter, &other) else { return };
        let test = ZTest::new(&brighter, &without);
        assert!(test.global.iter().any(|z| z.abs() > 4.5), "{number}: {test:?}");
    }
}

/// Density 0 is no medium, and a density of 1e9 is a wall: black if it only absorbs. Neither costs
/// more rays than the surfaces do.
fn extreme_densities(subject: BackendUnderTest) {
    let empty = scene(r#""smoke": (extinction: (0, 0, 0))"#, EDGE, BALL);
    let Some(film) = render(subject, &empty, &Settings::of(&empty)) else { return };
    assert_eq!(mean(&film), DVec3::ONE);
    for (object, grid) in [(BALL, false), (BOX, false), ("", true)] {
        for albedo in [0.0, 0.5] {
            let mut scene = match grid {
                true => grid_scene(Medium::new([1e9; 3], [albedo; 3])).0,
                false => scene(
                    &format!(
                        r#""smoke": (extinction: (1e9, 1e9, 1e9), albedo: ({albedo}, {albedo}, {albedo}))"#
                    ),
                    EDGE,
                    object,
                ),
            };
            scene.image.depth = 50;
            let settings = Settings { width: 8, height: 8, samples: 16, ..Settings::of(&scene) };
            let Some(film) = render(subject, &scene, &settings) else { return };
            let found = mean(&film);
            let most = if albedo == 0.0 { 1e-6 } else { albedo };
            assert!(found.max_element() <= most, "{object} {grid} {albedo}: {found}");
            // A path has at most as many rays as its depth, and passes few boundaries.
            let rays: u64 = film.pixels.iter().map(|pixel| pixel.segments).sum();
            assert!(rays <= 8 * 8 * 16 * 60, "{object} {grid} {albedo}: {rays} rays");
        }
    }
}

/// Boundaries that are not closed end no path early and keep no ray forever.
fn open_boundaries_are_harmless(subject: BackendUnderTest) {
    let smoke = r#""smoke": (extinction: (0.1, 1, 5), albedo: (1, 0.5, 0.9))"#;
    let sheet = r#"Quad(corner: (-1, -1, 0), u: (2, 0, 0), v: (0, 2, 0), material: "edge")"#;
    for objects in [sheet, r#"Disc(center: (0, 0, 0), normal: (0, 0, -1), radius: 1, material: "edge")"#] {
        let mut scene = scene(smoke, EDGE, objects);
        scene.image.depth = 50;
        let Some(film) = render(subject, &scene, &Settings::of(&scene)) else { return };
        let found = mean(&film);
        assert!(found.min_element() >= 0.0 && found.max_element() <= 1.001, "{found}");
    }
}

/// The absorption of glTF's volumes is the same in a scene with media, where it is a medium.
fn volumes_absorb_as_media(subject: BackendUnderTest) {
    let glass = r#""glass": MetallicRoughness(metallic: 0, roughness: 0, ior: 1, transmission: 1, layers: (volume:
        (attenuation_color: (0.3, 0.8, 0.5), attenuation_distance: 0.8)))"#;
    let block = r#"Box(min: (-1, -1, -1), max: (1, 1, 1), material: "glass")"#;
    let far = r#"Sphere(center: (50, 0, 0), radius: 1, material: "edge")"#;
    let smoke = r#""smoke": (extinction: (1, 1, 1))"#;
    let alone = scene("", glass, block);
    let both = scene(smoke, &format!("{EDGE}, {glass}"), &format!("{block}, {far}"));
    assert_eq!((alone.media.len(), both.media.len()), (0, 2));
    let Some(alone) = render(subject, &alone, &Settings::of(&alone)) else { return };
    let Some(both) = render(subject, &both, &Settings::of(&both)) else { return };
    let (alone, both) = (mean(&alone), mean(&both));
    assert!((alone - both).abs().max_element() < 1e-4, "{alone} {both}");
    assert!((alone - DVec3::new(0.3, 0.8, 0.5).powf(2.5)).abs().max_element() < 2e-3, "{alone}");
}

/// Each backend shows the CPU's image: CUDA its bits.
fn media_are_the_cpus(subject: BackendUnderTest) {
    for name in ["cornell_smoke.ron", "fog_lamps.ron"] {
        let scene = trisect_tests::scene(name);
        let settings = Settings { width: 48, height: 32, samples: 16, ..Settings::of(&scene) };
        let Some(got) = render(subject, &scene, &settings) else { return };
        let want = film(&mut cpu(&scene), &settings);
        if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
            assert_eq!(differing(&got, &want), 0, "{name}");
        } else {
            let test = ZTest::new(&got, &want);
            assert!(test.passes(), "{name}: {test:?}");
        }
        // Negative control: 10 % more extinction.
        let mut other = scene.clone();
        other.media.iter_mut().for_each(|medium| medium.extinction *= 1.1);
        let other = film(&mut cpu(&other), &settings);
        assert!(differing(&other, &want) > want.pixels.len() / 2, "{name}: negative control");
    }
}

for_each_backend! {
    absorption_is_beer_and_lamberts,
    grids_absorb_by_their_density,
    media_of_albedo_1_vanish,
    single_scattering_is_an_integral,
    emission_grows_with_the_layer,
    sampling_agrees_with_light,
    extreme_densities,
    open_boundaries_are_harmless,
    volumes_absorb_as_media,
    media_are_the_cpus,
}
