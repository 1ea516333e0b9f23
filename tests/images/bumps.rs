//! A ball with a map of steep bumps: it adds no light, and lights that are sampled agree with those
//! that are found.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use super::mesh_attributes::{image, sunlit, texture};
use glam::{DAffine3, DVec3};
use std::f64::consts::PI;
use trisect::render::{Renderer, Settings};
use trisect::scene::Scene;
use trisect::scene::description::{
    Filter, Material, Mesh, MetallicRoughness, Texels, TextureImage, TextureUse,
};
use trisect_tests::renders::{apart, cpu, differing, film, independent, lit};
use trisect_tests::statistics::Blocks;
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Returns a ball under a sky of radiance 1 with all attributes, and a map of steep bumps.
fn ball(metallic: f64, roughness: f64) -> Scene {
    ball_of(|[bumps, colors]| {
        let surface = MetallicRoughness { base_color: DVec3::ONE, metallic, roughness, ..Default::default() };
        let surface = MetallicRoughness { texture: Some(colors), ..surface };
        Material { normal_texture: Some(bumps), ..Material::from(surface) }
    })
}

/// Returns a ball under a sky of radiance 1 with all attributes, of a material that may have a map
/// of steep bumps, and colours by the second set of coordinates.
pub(super) fn ball_of(material: impl FnOnce([TextureUse; 2]) -> Material) -> Scene {
    let (columns, rows) = (24u32, 12u32);
    let mut mesh = Mesh { ..Mesh::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
            let ((sin, cos), (around_sin, around_cos)) = ((PI * v).sin_cos(), (2.0 * PI * u).sin_cos());
            let normal = DVec3::new(sin * around_cos, cos, -sin * around_sin).as_vec3().to_array();
            mesh.positions.push(normal);
            mesh.normals.push(normal);
            mesh.uvs.push([u as f32, v as f32]);
            mesh.second_uvs.push([v as f32, u as f32]);
            mesh.colors.push([1.0, 1.0, 1.0 - v as f32, 1.0]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let b = a + columns + 1;
            mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    let bump = |i: u32| {
        let (x, y) = (f64::from(i % 16) - 7.5, f64::from(i / 16 % 16) - 7.5);
        let n = DVec3::new(x.sin(), y.cos(), 0.5).normalize() * 0.5 + 0.5;
        [n.x as f32, n.y as f32, n.z as f32, 1.0]
    };
    let bumps = TextureImage {
        name: "bumps".to_owned(),
        width: 16,
        height: 16,
        texels: Texels::Float((0..256).map(bump).collect()),
    };
    let linear = TextureUse { filter: Filter::Linear, ..texture(0, false) };
    let material = material([linear, texture(1, true)]);
    let images = vec![bumps, image(vec![[1.0; 4], [1.0, 0.75, 1.0, 1.0]])];
    let mut scene = sunlit(material, mesh, DAffine3::from_rotation_x(0.4), images);
    scene.lights.clear();
    scene.sky.bottom = glam::Vec3::ONE;
    scene.sky.top = glam::Vec3::ONE;
    scene.camera.vertical_fov = 0.22;
    scene
}

pub(super) fn is_exact(subject: BackendUnderTest) -> bool {
    matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda)
}

/// Checks that an image in a furnace is at most as bright as the furnace, within 4 sigma, and that
/// none of its pixels is much brighter.
///
/// # Panics
///
/// If it is brighter.
pub(super) fn adds_no_light(renderer: &mut Renderer, settings: &Settings) {
    let many = film(renderer, &Settings { samples: 1024, ..settings.clone() });
    let (mean, variance) = Blocks::new(&many).whole;
    let sigma = variance[0].sqrt();
    assert!(mean[0] <= 1.0 + 4.0 * sigma && sigma < 2e-3, "{} +- {sigma}", mean[0]);
    let brightest = many.pixels.iter().map(|pixel| pixel.mean()[0]).fold(0.0, f64::max);
    assert!(brightest < 1.15, "{brightest}");
}

/// Bumps add no light in a furnace: where no pixel sees the sky, none is brighter than it. And
/// every backend shows the CPU's image.
fn bumps_add_no_light(subject: BackendUnderTest) {
    for (metallic, roughness) in [(0.0, 0.5), (1.0, 0.3), (0.5, 1.0), (1.0, 0.0)] {
        let scene = ball(metallic, roughness);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let settings =
            Settings { width: 20, height: 20, samples: 32, depth: 8, seed: 3, ..independent(&scene) };
        let got = film(&mut renderer, &settings);
        let want = film(&mut cpu(&scene), &settings);
        if is_exact(subject) {
            assert_eq!(differing(&got, &want), 0, "{metallic}, {roughness}");
        } else {
            let off = apart(&got, &want);
            assert!(off * 100 <= 3 * want.pixels.len(), "{metallic}, {roughness}: {off} pixels differ");
        }
        if subject == BackendUnderTest::Cpu {
            adds_no_light(&mut renderer, &settings);
        }
        // Negative control: without the map the ball is brighter.
        let mut smooth = scene.clone();
        smooth.materials[0].normal_texture = trisect_shared::texture::NO_TEXTURE;
        let smooth = film(&mut cpu(&smooth), &settings);
        assert!(differing(&smooth, &want) > 100, "the map has no effect");
    }
}

/// Light that is sampled and light that is found have the same mean on steep bumps: the pdfs of the
/// lobes are those of their samples, also where reflections bend the normal.
fn sampling_agrees_with_light(subject: BackendUnderTest) {
    let mut scene = ball(0.0, 0.6);
    (scene.sky.bottom, scene.sky.top) = (glam::Vec3::ZERO, glam::Vec3::ZERO);
    let lamp = Scene::parse(
        r#"Scene(version: 1, image: (width: 8, height: 8), camera: (look_from: (0, 0, 9), look_at: (0, 0, 0), vertical_fov: 40),
            materials: { "lamp": Emissive(radiance: (4, 4, 4), two_sided: true) },
            objects: [Quad(corner: (1.5, -2, -1), u: (0, 4, 0), v: (0, 0, 4), material: "lamp")])"#,
        "lamp",
    );
    let lamp = lamp.unwrap();
    scene.flats =
        lamp.flats.iter().map(|flat| trisect_shared::planar::Planar { material: 1, ..*flat }).collect();
    scene.materials.extend(lamp.materials);
    let settings =
        Settings { width: 12, height: 12, samples: 2048, depth: 2, seed: 1, ..independent(&scene) };
    let mean = |scene: &Scene, light_sampling| {
        let film = film(&mut subject.renderer(scene)?, &Settings { light_sampling, ..settings.clone() });
        Some(film.pixels.iter().map(|pixel| pixel.mean()[0]).sum::<f64>() / 144.0)
    };
    let (Some(with), Some(without)) = (mean(&scene, true), mean(&scene, false)) else { return };
    // 295,000 paths: the noise of the mean is 0.3 %.
    assert!((with / without - 1.0).abs() < 0.012, "{with} and {without}");
    // Negative control: a lamp that is brighter by 3 %.
    let brighter = mean(&lit(&scene, 1.03), true).unwrap();
    assert!((brighter / without - 1.0).abs() > 0.012, "{brighter} and {without}");
}

for_each_backend!(bumps_add_no_light, sampling_agrees_with_light);
