//! Normal maps of coats: they bend the coat's reflection, and nothing else.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::bumps::{adds_no_light, ball_of, is_exact};
use super::mesh_attributes::{image, settings, square, sunlit, texture};
use glam::{DAffine3, DVec3};
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect::scene::description::{Material, Mesh, MetallicRoughness, TextureUse};
use trisect::scene::material::layers::{Coat, Layers, Specular};
use trisect_tests::renders::{apart, cpu, differing, film, independent};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// A direction near that in which a mirror shows the sun to the camera.
const TILT: DVec3 = DVec3::new(0.48, -0.6, 0.64);

/// Returns the texel of a direction of tangent space.
fn texel(direction: DVec3) -> [f32; 4] {
    (direction * 0.5 + 0.5).as_vec3().extend(1.0).to_array()
}

/// Returns a black surface, which a coat alone lets shine.
fn coated(coat: Coat, normal_texture: Option<TextureUse>) -> Material {
    let specular = Some(Specular { strength: 0.0, ..Specular::default() });
    let layers = Layers { coat: Some(Coat { roughness: 0.6, ..coat }), specular, ..Layers::default() };
    let surface = MetallicRoughness { base_color: DVec3::ZERO, metallic: 0.0, layers, ..Default::default() };
    Material { normal_texture, ..Material::from(surface) }
}

fn brightness(film: &Film) -> f64 {
    film.pixels.iter().map(|pixel| pixel.mean()[0]).sum::<f64>() / film.pixels.len() as f64
}

/// A map of one direction lets a coat shine as one whose mesh has that normal, with a map of the
/// surface below it or without; a map without a direction is left.
fn a_map_turns_the_coats_light(subject: BackendUnderTest) {
    let other = DVec3::new(-0.6, 0.0, 0.8);
    let mapped = |direction: [f32; 4], scale: f64, below: bool| {
        let coat = Coat { normal_texture: Some(texture(0, false)), normal_scale: scale, ..Coat::default() };
        let material = coated(coat, below.then(|| texture(1, false)));
        let images = vec![image(vec![direction]), image(vec![texel(other)])];
        sunlit(material, square(), DAffine3::IDENTITY, images)
    };
    let turned = |normal: DVec3| {
        let mesh = Mesh { normals: vec![normal.as_vec3().to_array(); 4], ..square() };
        sunlit(coated(Coat::default(), None), mesh, DAffine3::IDENTITY, Vec::new())
    };
    let only_below = || {
        let material = coated(Coat::default(), Some(texture(0, false)));
        sunlit(material, square(), DAffine3::IDENTITY, vec![image(vec![texel(other)])])
    };
    let halved = DVec3::new(0.5 * TILT.x, 0.5 * TILT.y, TILT.z).normalize();
    for (name, scene, normal) in [
        ("mapped", mapped(texel(TILT), 1.0, false), TILT),
        ("also below", mapped(texel(TILT), 1.0, true), TILT),
        ("scaled", mapped(texel(TILT), 0.5, false), halved),
        ("only below", only_below(), DVec3::Z),
        ("no direction", mapped([0.5, 0.5, 0.5, 1.0], 1.0, false), DVec3::Z),
        ("not finite", mapped([f32::INFINITY; 4], 1e6, true), DVec3::Z),
    ] {
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let got = film(&mut renderer, &settings(&scene));
        assert_eq!(got.counts().rejected, 0, "{name}");
        let light = |normal| {
            let scene = turned(normal);
            brightness(&film(&mut cpu(&scene), &settings(&scene)))
        };
        let (got, want) = (brightness(&got), light(normal));
        // The texels have 11 bits, and the tangents 16.
        assert!((got / want - 1.0).abs() < 0.01, "{name}: {got} for {want}");
        // Negative control: the other directions shine differently.
        for control in [TILT, halved, other, DVec3::Z].into_iter().filter(|control| *control != normal) {
            assert!((light(control) / want - 1.0).abs() > 0.05, "{name}: {control}");
        }
    }
}

/// A ball with bumps below its coat and others in it adds no light in a furnace, and every backend
/// shows the CPU's image.
fn bumps_of_coats_add_no_light(subject: BackendUnderTest) {
    let scene = |has_map: bool, below: bool| -> Scene {
        ball_of(|[bumps, _]| {
            let normal_texture = has_map.then(|| bumps.clone());
            let coat = Coat { roughness: 0.3, normal_texture, ..Coat::default() };
            let layers = Layers { coat: Some(coat), ..Layers::default() };
            let surface =
                MetallicRoughness { base_color: DVec3::ONE, metallic: 1.0, layers, ..Default::default() };
            Material { normal_texture: below.then_some(bumps), ..Material::from(surface) }
        })
    };
    for below in [false, true] {
        let mapped = scene(true, below);
        let Some(mut renderer) = subject.renderer(&mapped) else { return };
        let settings =
            Settings { width: 20, height: 20, samples: 32, depth: 8, seed: 3, ..independent(&mapped) };
        let (got, want) = (film(&mut renderer, &settings), film(&mut cpu(&mapped), &settings));
        if is_exact(subject) {
            assert_eq!(differing(&got, &want), 0, "{below}");
        } else {
            let off = apart(&got, &want);
            assert!(off * 100 <= 3 * want.pixels.len(), "{below}: {off} pixels differ");
        }
        if subject == BackendUnderTest::Cpu {
            adds_no_light(&mut renderer, &settings);
        }
        // Negative control: without the map it is another image.
        let plain = film(&mut cpu(&scene(false, below)), &settings);
        assert!(differing(&plain, &want) > 100, "{below}: {}", differing(&plain, &want));
    }
}

for_each_backend!(a_map_turns_the_coats_light, bumps_of_coats_add_no_light);
