//! Typical models: bodies with lamps on them, rooms with lamps in them, lights in lux and candela.

use super::*;
use crate::description::{Filter, Instance, Lambertian, TextureUse, Wrap};
use glam::{DAffine2, DAffine3};

fn material(emission: f64, both_sides: bool) -> Material {
    let grey = Material::from(Lambertian::rgb(0.5, 0.5, 0.5));
    Material { emission: DVec3::splat(emission), emits_both_sides: both_sides, ..grey }
}

/// Returns a cube of half width 1 whose faces point outwards, or inwards like those of a room.
fn cube(inwards: bool, material: usize) -> Mesh {
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: halves.map(|[a, b, c]| if inwards { [a, c, b] } else { [a, b, c] }).collect(),
        material,
        ..Mesh::default()
    }
}

fn model(parts: Vec<(Mesh, DAffine3)>, materials: Vec<Material>, lights: Vec<PunctualLight>) -> Description {
    let (meshes, transforms): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    let instances =
        transforms.into_iter().enumerate().map(|(mesh, transform)| Instance { mesh, transform }).collect();
    Description { meshes, instances, materials, lights, ..Description::default() }
}

fn body(material: Material, lights: Vec<PunctualLight>) -> OwnLight {
    OwnLight::of(&model(vec![(cube(false, 0), DAffine3::IDENTITY)], vec![material], lights))
}

#[test]
fn lamps_on_a_body_do_not_light_it() {
    assert_eq!(body(material(0.0, false), vec![]), OwnLight::Nothing);
    // However bright it is, a convex body does not light its own front.
    for emission in [1e-3, 1.0, 1000.0] {
        assert_eq!(body(material(emission, false), vec![]), OwnLight::Little);
        assert_eq!(body(material(emission, true), vec![]), OwnLight::Little);
    }
    // A material that no mesh uses is not a lamp.
    let mut unused = model(vec![(cube(false, 0), DAffine3::IDENTITY)], vec![material(0.0, false); 2], vec![]);
    unused.materials[1].emission = DVec3::ONE;
    assert_eq!(OwnLight::of(&unused), OwnLight::Nothing);
}

/// Returns a room with a lamp, a cube of radiance `emission`.
fn room(emission: f64) -> Description {
    let lamp = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.2),
        glam::DQuat::IDENTITY,
        DVec3::new(0.0, 0.7, 0.0),
    );
    let parts = vec![(cube(true, 0), DAffine3::IDENTITY), (cube(false, 1), lamp)];
    model(parts, vec![material(0.0, false), material(emission, false)], vec![])
}

#[test]
fn a_lamp_lights_its_room_if_it_is_bright_enough() {
    assert_eq!(OwnLight::of(&room(15.0)), OwnLight::Enough);
    assert_eq!(OwnLight::of(&room(0.1)), OwnLight::Little);
    // Mirroring keeps the front, and the unit of length does not matter.
    for scale in [DVec3::new(-1.0, 1.0, 1.0), DVec3::splat(1e6), DVec3::splat(1e-6)] {
        for (emission, want) in [(15.0, OwnLight::Enough), (0.1, OwnLight::Little)] {
            let mut scaled = room(emission);
            for instance in &mut scaled.instances {
                instance.transform = DAffine3::from_scale(scale) * instance.transform;
            }
            assert_eq!(OwnLight::of(&scaled), want, "{scale}");
        }
    }
    // With its faces outwards, the room is a body with a lamp inside.
    let mut closed = room(15.0);
    closed.meshes[0] = cube(false, 0);
    assert_eq!(OwnLight::of(&closed), OwnLight::Little);
}

/// The mean of an emissive texture decides, not its brightest texel.
#[test]
fn a_bright_texel_is_no_lamp() {
    let mut texels = vec![[0, 0, 0, 255]; 1024];
    texels[5] = [255; 4];
    let textured = |texels: Texels| {
        let mut textured = room(15.0);
        textured.images.push(TextureImage { name: String::new(), width: 32, height: 32, texels }.into());
        textured.materials[1].emission_texture = Some(TextureUse {
            image: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
            transform: DAffine2::IDENTITY,
            second_uvs: false,
        });
        OwnLight::of(&textured)
    };
    assert_eq!(textured(Texels::Srgb8(texels.clone())), OwnLight::Little);
    assert_eq!(textured(Texels::Linear8(vec![[255; 4]; 1024])), OwnLight::Enough);
    // An sRGB value of 128 is 0.22 in linear light: emission 15 becomes 3.2, and 7.5 with a linear
    // 128.
    let (linear, srgb) = (Texels::Linear8(vec![[128; 4]; 1]), Texels::Srgb8(vec![[128; 4]; 1]));
    let means = [linear, srgb, Texels::Float(vec![[0.25, 0.5, 1.0, 0.0]; 3])]
        .map(|texels| mean(&TextureImage { name: String::new(), width: 1, height: 1, texels }));
    assert!((means[0] - 128.0 / 255.0).length() < 1e-6 && (means[1] - 0.215_86).length() < 1e-4, "{means:?}");
    assert_eq!(means[2], DVec3::new(0.25, 0.5, 1.0));
}

#[test]
fn lights_in_lux_and_candela_carry_an_image() {
    let sun = |irradiance: f64| PunctualLight::Directional {
        direction: DVec3::new(-0.6, -0.8, 0.0),
        irradiance: DVec3::splat(irradiance),
    };
    let point = |intensity: f64, distance: f64| PunctualLight::Point {
        position: DVec3::new(distance, distance, 0.0),
        intensity: DVec3::splat(intensity),
    };
    let spot = |direction: DVec3, outer: f64| PunctualLight::Spot {
        position: DVec3::new(0.0, 3.0, 0.0),
        direction,
        intensity: DVec3::splat(1000.0),
        inner: 0.0,
        outer,
    };
    for (light, want) in [
        (sun(100_000.0), OwnLight::Enough),
        (sun(1.0), OwnLight::Enough),
        (sun(0.01), OwnLight::Little),
        (sun(0.0), OwnLight::Nothing),
        (point(800.0, 3.0), OwnLight::Enough),
        (point(800.0, 1000.0), OwnLight::Little),
        // Inside the body: its front gets nothing.
        (point(800.0, 0.0), OwnLight::Little),
        (spot(DVec3::NEG_Y, 0.6), OwnLight::Enough),
        (spot(DVec3::NEG_Y, 0.05), OwnLight::Little),
        (spot(DVec3::Y, 0.6), OwnLight::Little),
    ] {
        assert_eq!(body(material(0.0, false), vec![light.clone()]), want, "{light:?}");
    }
}

/// Compares points with the closed form for the irradiance of a square lamp, on its axis.
#[test]
fn points_stand_for_their_area() {
    let lamp = DAffine3::from_scale(DVec3::new(1.0, 1e-9, 1.0));
    let scene = model(vec![(cube(false, 0), lamp)], vec![material(3.0, false)], vec![]);
    let emitters = spread(&scene, &|_| 3.0);
    assert_eq!(emitters.len(), POINTS);
    let at = |height: f64, normal: DVec3| {
        let point = Point { place: DVec3::Y * height, normal, area: 0.0, weight: 0.0, both_sides: false };
        emitters.iter().map(|emitter| point.irradiance_from(emitter)).sum::<f64>()
    };
    // Four corners (Howell's catalogue of view factors, B-3), each of a unit square at height h.
    let h: f64 = 2.0;
    let side = (1.0 + h * h).sqrt();
    let factor = 4.0 * 2.0 / (2.0 * PI) * (1.0 / side) * (1.0 / side).atan();
    assert!((at(h, DVec3::NEG_Y) / (3.0 * PI * factor) - 1.0).abs() < 0.02, "{}", at(h, DVec3::NEG_Y));
    assert_eq!(at(h, DVec3::Y), 0.0);
    // However near, the irradiance is at most that of an infinite lamp, plus the error of
    // representing the surface by discs.
    assert!(at(1e-3, DVec3::NEG_Y) < 1.5 * 3.0 * PI);
}
