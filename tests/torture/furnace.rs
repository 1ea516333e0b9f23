//! White furnace: what absorbs nothing cannot be seen (10, 31, 45).

use crate::mesh::Mesh;
use bytemuck::Zeroable;
use glam::Vec3;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_shared::attributes::MeshVertex;
use trisect_shared::math::normalize;
use trisect_shared::triangle::Triangle;
use trisect_tests::renders::{film, independent};
use trisect_tests::report::{Outcome, report};
use trisect_tests::statistics::{GLOBAL_LIMIT, Known};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Returns `objects` under a sky of 1, seen through a square window. With a `fov` of [`WINDOW`] its
/// corners are at the rim of the unit sphere around 0. With a `fov` of 0.001 all rays meet the
/// sphere within 0.7 degrees of normal incidence.
fn furnace(materials: &str, objects: &str, fov: f64) -> Scene {
    let text = format!(
        "Scene(version: 1, image: (width: 8, height: 8, samples: 16, depth: 400), \
         camera: (look_from: (0, 0, 1000), look_at: (0, 0, 0), vertical_fov: {fov}), \
         sky: Uniform(radiance: (1, 1, 1)), materials: {{{materials}}}, objects: [{objects}])"
    );
    Scene::parse(&text, "furnace").unwrap()
}

/// Field of view in degrees: tan(fov / 2) = 0.707 / 1000.
const WINDOW: f64 = 0.081;

const LOSSLESS: [&str; 4] = [
    "Lambertian(albedo: (1, 1, 1))",
    "Metal(albedo: (1, 1, 1), fuzz: 0)",
    "Dielectric(ior: 1.5)",
    "Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), roughness: 0)",
];

/// Each material that loses light, with the share that it keeps at normal incidence where that is
/// known: GGX with Smith's G, or with multiple scattering what the fit of its albedo leaves.
const LOSSY: [(&str, Option<f64>); 14] = [
    ("Metal(albedo: (1, 1, 1), fuzz: 0.3)", None),
    (
        "Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), roughness: 0.1, multiple_scattering: false)",
        Some(0.9999),
    ),
    (
        "Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), roughness: 0.5, multiple_scattering: false)",
        Some(0.9158),
    ),
    (
        "Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), roughness: 1, multiple_scattering: false)",
        Some(1.0 - std::f64::consts::LN_2),
    ),
    ("Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), roughness: 0.5)", Some(0.994)),
    ("Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), roughness: 1)", Some(0.994)),
    (
        "MetallicRoughness(base_color: (1, 1, 1), metallic: 1, roughness: 0.5, \
         layers: (coat: (strength: 1, roughness: 0.3)))",
        None,
    ),
    (
        "MetallicRoughness(base_color: (1, 1, 1), metallic: 0, roughness: 0.8, \
         layers: (sheen: (color: (1, 1, 1), roughness: 0.4)))",
        None,
    ),
    ("RoughDielectric(ior: 1.5, roughness: 0.1)", None),
    ("RoughDielectric(ior: 1.5, roughness: 0.5)", None),
    ("RoughDielectric(ior: 1.5, roughness: 1)", None),
    ("MetallicRoughness(base_color: (1, 1, 1), metallic: 0, roughness: 0.3, ior: 1.5)", None),
    ("MetallicRoughness(base_color: (1, 1, 1), metallic: 0, roughness: 1, ior: 1.5)", None),
    ("MetallicRoughness(base_color: (1, 1, 1), metallic: 1, roughness: 0.3)", None),
];

fn samples(subject: BackendUnderTest, cpu: u32, software: u32) -> u32 {
    if subject.is_software() { software } else { cpu }
}

/// Renders the scene to each depth and returns the means over the window, compared with 1.
fn seen(subject: BackendUnderTest, scene: &Scene, depths: &[u32], samples: u32) -> Option<Vec<Known>> {
    let mut renderer = subject.renderer(scene)?;
    let at = |depth: &u32| {
        let settings = Settings { depth: *depth, samples, ..independent(scene) };
        Known::of(&film(&mut renderer, &settings).pixels, 1.0)
    };
    Some(depths.iter().map(at).collect())
}

const SPHERE: &str = r#"Sphere(center: (0, 0, 0), radius: 1, material: "a")"#;

/// Returns whether the mean exceeds 1 by no more than 4 sigma and rounding, so that no light is
/// created.
fn at_most_one(known: &Known) -> bool {
    known.mean <= 1.0 + GLOBAL_LIMIT * known.sigma + Known::ROUNDING
}

/// A sphere of a lossless material shows the furnace's radiance of 1, and a sphere of any other
/// material shows at most 1. The loss of each material is printed by depth.
fn t10_white_furnace(subject: BackendUnderTest) {
    let depths: &[u32] = if samples(subject, 1, 0) == 1 { &[2, 3, 5, 9, 400] } else { &[3, 400] };
    let mut worst = 0.0f64;
    for material in LOSSLESS {
        let scene = furnace(&format!("\"a\": {material}"), SPHERE, WINDOW);
        let Some(means) = seen(subject, &scene, depths, samples(subject, 64, 8)) else { return };
        let whole = means[means.len() - 1];
        assert!(whole.holds(), "{material}: {whole:?}");
        assert!(means.iter().all(at_most_one), "{material}: {means:?}");
        worst = worst.max((whole.mean - 1.0).abs());
        // Negative control: 1 % more albedo.
        let mut faulty = scene.clone();
        faulty.materials[0].albedo *= 1.01;
        let found = &seen(subject, &faulty, &[400], samples(subject, 64, 8)).expect("opened before")[0];
        assert!(!at_most_one(found), "{material}: negative control not detected: {found:?}");
    }
    let mut table = format!("loss by depth {depths:?}:");
    let mut greatest = (0.0, "");
    for (material, normal) in LOSSY {
        let scene = furnace(&format!("\"a\": {material}"), SPHERE, WINDOW);
        let Some(means) = seen(subject, &scene, depths, samples(subject, 256, 16)) else { return };
        assert!(means.iter().all(at_most_one), "{material}: {means:?}");
        // The random numbers are the same, so a longer path only adds to a shorter one.
        assert!(means.windows(2).all(|m| m[1].mean >= m[0].mean - Known::ROUNDING), "{material}: {means:?}");
        let losses: Vec<String> = means.iter().map(|m| format!("{:.4}", 1.0 - m.mean)).collect();
        table += &format!("\n  {material}: {}", losses.join(" "));
        let loss = 1.0 - means[means.len() - 1].mean;
        if loss > greatest.0 {
            greatest = (loss, material);
        }
        // A loss of 1e-4 is one event in 10,000, which needs more samples than a software adapter
        // renders in reasonable time.
        let Some(want) = normal.filter(|&n| n < 0.99 || samples(subject, 1, 0) == 1) else { continue };
        let scene = furnace(&format!("\"a\": {material}"), SPHERE, 0.001);
        let settings = Settings { samples: samples(subject, 1024, 32), ..independent(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let known = Known::of(&film(&mut renderer, &settings).pixels, want);
        // 5e-5 is half of the last known digit.
        assert!(
            known.off < GLOBAL_LIMIT || (known.mean - want).abs() < 5e-5 + GLOBAL_LIMIT * known.sigma,
            "{material}: {known:?}"
        );
    }
    eprintln!("{table}");
    let figure = format!(
        "{} lossless materials: 1 within {worst:.1e}; {} others at most 1; the most lost at depth 400: {:.3} by {}",
        LOSSLESS.len(),
        LOSSY.len(),
        greatest.0,
        greatest.1
    );
    report(10, subject, Outcome::Passed, &figure);
}

/// Glass that is hollow by relative indices, and glass in water around a white ball, cannot be
/// seen.
fn t31_hollow_and_nested(subject: BackendUnderTest) {
    let hollow = r#""a": Dielectric(ior: 1.5), "b": Dielectric(ior: 0.6666667)"#;
    let nested =
        r#""a": Dielectric(ior: 1.33), "b": Dielectric(ior: 1.1278195), "c": Lambertian(albedo: (1, 1, 1))"#;
    let shell = r#", Sphere(center: (0, 0, 0), radius: 0.9, material: "b")"#;
    let ball = r#", Sphere(center: (0.1, 0, 0), radius: 0.4, material: "c")"#;
    let mut worst = 0.0f64;
    for (name, materials, inside) in
        [("hollow", hollow, shell.to_owned()), ("nested", nested, format!("{shell}{ball}"))]
    {
        let scene = furnace(materials, &format!("{SPHERE}{inside}"), WINDOW);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let settings = Settings { samples: samples(subject, 64, 8), ..independent(&scene) };
        // Each path has a weight of 1, so there is no noise: each pixel is 1 within rounding,
        // unless a path is cut off.
        let got = film(&mut renderer, &settings);
        for pixel in &got.pixels {
            let off = (pixel.mean()[0] - 1.0).abs();
            assert!(off <= Known::ROUNDING, "{name}: {pixel:?}");
            worst = worst.max(off);
        }
        // Negative control: an inner surface that absorbs 1 %.
        let mut faulty = scene.clone();
        faulty.materials[1].albedo = Vec3::splat(0.99);
        let mut renderer = subject.renderer(&faulty).expect("the backend opened before");
        let known = Known::of(&film(&mut renderer, &settings).pixels, 1.0);
        assert!(!known.holds(), "{name}: negative control not detected: {known:?}");
    }
    report(
        31,
        subject,
        Outcome::Passed,
        format!("hollow shell, glass in water around a white ball: 1 within {worst:.1e} a pixel"),
    );
}

/// Returns a ball of 32 triangles with the normals of a sphere, which point away from the viewer at
/// its silhouette.
fn coarse_ball(material: &str) -> Scene {
    let objects = r#"Sphere(center: (0, 0, 0), radius: 1, material: "a")"#;
    let mut scene = furnace(&format!("\"a\": {material}"), objects, 0.13);
    scene.spheres.clear();
    for triangle in Mesh::octahedron().divided(normalize).triangles() {
        let first = scene.vertices.len() as u32;
        let vertex = |normal| MeshVertex { normal, ..MeshVertex::zeroed() };
        scene.vertices.extend([triangle.a, triangle.b, triangle.c].map(vertex));
        let (vertex_a, vertex_b, vertex_c) = (first, first + 1, first + 2);
        scene.triangles.push(Triangle { vertex_a, vertex_b, vertex_c, ..triangle });
    }
    scene
}

/// Each pixel of a mirror of few triangles is 1 in the furnace, as a convex body does not see
/// itself. A mirrored direction that entered the surface would be lost, and the silhouette would be
/// black.
fn t45_coarse_mirrors(subject: BackendUnderTest) {
    let mirrors = [
        "Metal(albedo: (1, 1, 1), fuzz: 0)",
        "Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), roughness: 0)",
        "MetallicRoughness(base_color: (1, 1, 1), metallic: 1, roughness: 0)",
    ];
    let mut worst = 0.0f64;
    for material in mirrors {
        let scene = coarse_ball(material);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let settings = Settings { width: 32, height: 32, samples: 16, ..independent(&scene) };
        for pixel in &film(&mut renderer, &settings).pixels {
            let off = (pixel.mean()[0] - 1.0).abs();
            assert!(off <= Known::ROUNDING, "{material}: {pixel:?}");
            worst = worst.max(off);
        }
        // Negative control: a mirror that absorbs 1 %.
        let mut faulty = scene.clone();
        faulty.materials[0].albedo = Vec3::splat(0.99);
        let mut renderer = subject.renderer(&faulty).expect("the backend opened before");
        let darkest =
            film(&mut renderer, &settings).pixels.iter().map(|p| p.mean()[0]).fold(1.0f64, f64::min);
        assert!(1.0 - darkest > Known::ROUNDING, "{material}: negative control not detected: {darkest}");
    }
    let figure = format!("{} mirrors of 32 triangles: each pixel 1 within {worst:.1e}", mirrors.len());
    report(45, subject, Outcome::Passed, figure);
}

for_each_route!(t10_white_furnace, t31_hollow_and_nested, t45_coarse_mirrors);
