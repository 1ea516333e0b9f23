//! Attributes of meshes: normal maps in tangent space, colours of vertices, and second sets of
//! texture coordinates; against known answers, and equal on every backend.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use glam::{DAffine2, DAffine3, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use trisect::image::Image;
use trisect::prelude::Svgf;
use trisect::render::{Renderer, Sampler, Settings};
use trisect::scene::description::{
    Alpha, Description, Filter, Instance, Lambertian, Material, Mesh, PunctualLight, Sky, Texels,
    TextureImage, TextureUse, Wrap,
};
use trisect::scene::{CameraPose, Scene};
use trisect_tests::renders::{film, independent};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// A direction of tangent space, towards +u, up in the image, and out of the surface.
const TILT: DVec3 = DVec3::new(0.48, 0.36, 0.8);

/// Direction towards the sun.
const SUN: DVec3 = DVec3::new(2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0);

pub(super) fn image(texels: Vec<[f32; 4]>) -> TextureImage {
    let width = texels.len() as u32;
    TextureImage { name: "test".to_owned(), width, height: 1, texels: Texels::Float(texels) }
}

pub(super) fn texture(image: usize, second_uvs: bool) -> TextureUse {
    let (wrap, filter) = ([Wrap::Clamp; 2], Filter::Nearest);
    TextureUse { image, wrap, filter, transform: DAffine2::IDENTITY, second_uvs }
}

/// Returns a square in front of the camera, whose texture coordinates are as upright as it is.
pub(super) fn square() -> Mesh {
    Mesh {
        positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

pub(super) fn sunlit(
    material: Material,
    mesh: Mesh,
    transform: DAffine3,
    images: Vec<TextureImage>,
) -> Scene {
    let camera = CameraPose {
        look_from: DVec3::new(0.0, 0.0, 10.0),
        look_at: DVec3::ZERO,
        vertical_fov: 0.1,
        focus_distance: 10.0,
        ..CameraPose::PINHOLE
    };
    let model = Description {
        cameras: vec![("test".to_owned(), camera)],
        materials: vec![material],
        images: images.into_iter().map(Arc::new).collect(),
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, transform }],
        lights: vec![PunctualLight::Directional { direction: -SUN, irradiance: DVec3::splat(PI) }],
        sky: Some(Sky::Gradient { bottom: DVec3::ZERO, top: DVec3::ZERO }),
        ..Description::default()
    };
    Scene::from_model(model, "test").unwrap()
}

pub(super) fn settings(scene: &Scene) -> Settings {
    Settings { width: 8, height: 8, samples: 2, depth: 2, ..independent(scene) }
}

/// Returns what a diffuse white surface reflects to the camera, whose interpolated normal is +z.
fn expected(normal: DVec3) -> f64 {
    let (cos, tilt) = (SUN.z, normal.z);
    let alpha2 = (0.125 * (1.0 / (tilt * tilt) - 1.0)).min(1.0);
    let slope = 1.0 / (cos * cos) - 1.0;
    normal.dot(SUN).max(0.0) * 2.0 / (1.0 + (1.0 + alpha2 * slope).sqrt())
}

/// A map of one direction turns the light of a square as its texture coordinates lie, also if the
/// instance is mirrored, the coordinates are turned, or the file gives tangents.
fn a_map_of_one_direction_tilts_the_surface(subject: BackendUnderTest) {
    let encoded = |n: DVec3| [0.5 * n.x as f32 + 0.5, 0.5 * n.y as f32 + 0.5, 0.5 * n.z as f32 + 0.5, 1.0];
    let turned = Mesh { uvs: square().uvs.iter().map(|&[u, v]| [v, 1.0 - u]).collect(), ..square() };
    let given = Mesh { tangents: vec![[0.0, 1.0, 0.0, -1.0]; 4], ..square() };
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let flat = Mesh { normals: Vec::new(), ..square() };
    let DVec3 { x, y, z } = TILT;
    let cases = [
        ("upright", square(), DAffine3::IDENTITY, 1.0, TILT),
        ("flat", flat, DAffine3::IDENTITY, 1.0, TILT),
        ("mirrored", square(), mirror, 1.0, DVec3::new(-x, y, z)),
        ("turned", turned, DAffine3::IDENTITY, 1.0, DVec3::new(y, -x, z)),
        ("given", given, DAffine3::IDENTITY, 1.0, DVec3::new(y, x, z)),
        ("scaled", square(), DAffine3::IDENTITY, -0.5, DVec3::new(-0.5 * x, -0.5 * y, z).normalize()),
    ];
    for (name, mesh, transform, scale, normal) in cases {
        let material = Material {
            normal_texture: Some(texture(0, false)),
            normal_scale: scale,
            ..Material::from(Lambertian::rgb(1.0, 1.0, 1.0))
        };
        let scene = sunlit(material, mesh, transform, vec![image(vec![encoded(TILT)])]);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let want = expected(normal);
        let film = film(&mut renderer, &settings(&scene));
        for got in film.pixels.iter().map(|pixel| pixel.mean()[0]) {
            // The texels have 11 bits, and the tangents 16.
            assert!((got - want).abs() < 1e-3, "{name}: {got} for {want}");
        }
        // Negative control: the directions differ by more than that.
        let others = [TILT, DVec3::Z, DVec3::new(-x, y, z), DVec3::new(y, -x, z), DVec3::new(x, -y, z)];
        let others = others.into_iter().filter(|&other| other != normal);
        assert!(others.map(expected).all(|other| (other - want).abs() > 0.02), "{name}");
    }
}

/// A map without a direction, or one that is not finite, changes no bit.
fn a_map_without_a_direction_is_left(subject: BackendUnderTest) {
    let plain = Material::from(Lambertian::rgb(0.5, 0.5, 0.5));
    let scene = sunlit(plain.clone(), square(), DAffine3::IDENTITY, Vec::new());
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let want = film(&mut renderer, &settings(&scene));
    let degenerate = Mesh { uvs: vec![[0.25, 0.25]; 4], ..square() };
    for (mesh, texel, scale, is_left) in [
        (square(), [0.5, 0.5, 0.5, 1.0], 1.0, true),
        (square(), [f32::NAN; 4], 0.0, false),
        (square(), [f32::INFINITY; 4], 1e6, true),
        (degenerate, [0.5, 0.5, 1.0, 1.0], 1.0, false),
        (square(), [0.9, 0.5, 0.7, 1.0], 1.0, false),
    ] {
        let material =
            Material { normal_texture: Some(texture(0, false)), normal_scale: scale, ..plain.clone() };
        let scene = sunlit(material, mesh, DAffine3::IDENTITY, vec![image(vec![texel])]);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let got = film(&mut renderer, &settings(&scene));
        assert_eq!(got.counts().rejected, 0, "{texel:?}");
        if is_left {
            let off = got.pixels.iter().zip(&want.pixels).map(|(a, b)| (a.mean()[0] - b.mean()[0]).abs());
            let off = off.fold(0.0, f64::max);
            // The factor of the bent light is 1, but for rounding.
            assert!(off < 1e-6, "{texel:?}: {off}");
        }
    }
}

/// Colours of vertices and both sets of texture coordinates multiply the material's colour.
fn colours_and_second_coordinates_are_read(subject: BackendUnderTest) {
    let mesh = Mesh {
        second_uvs: vec![[0.75, 0.5]; 4],
        colors: vec![
            [1.0, 0.5, 0.25, 1.0],
            [0.5, 0.5, 0.25, 1.0],
            [0.0, 0.5, 0.25, 1.0],
            [0.5, 0.5, 0.25, 1.0],
        ],
        ..square()
    };
    let images = vec![image(vec![[0.5, 1.0, 1.0, 1.0], [1.0, 1.0, 0.5, 1.0]])];
    let albedo =
        |second_uvs| Lambertian { texture: Some(texture(0, second_uvs)), ..Lambertian::rgb(1.0, 1.0, 1.0) };
    for (second, blue) in [(true, 0.125), (false, 0.25)] {
        let material = Material::from(albedo(second));
        let scene = sunlit(material, mesh.clone(), DAffine3::IDENTITY, images.clone());
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let film = film(&mut renderer, &settings(&scene));
        // At the left the first set's texel is the first; its mean colour lies in the middle.
        let [red, green, got] = film.pixels.iter().nth(8 * 4 + 1).unwrap().mean();
        let lit = SUN.z;
        assert!(
            (green - 0.5 * lit).abs() < 1e-3 && (got - blue * lit).abs() < 1e-3,
            "{second}: {green}, {got}"
        );
        assert!(red > 0.2 * lit * if second { 1.0 } else { 0.5 } && red < 0.7 * lit, "{red}");
    }
}

/// The opacity of vertices lets light through a surface that blends, and not through an opaque one.
fn vertices_fade(subject: BackendUnderTest) {
    let mesh = Mesh { colors: vec![[1.0, 1.0, 1.0, 0.25]; 4], ..square() };
    for (alpha, want) in [(Alpha::Blend, 0.25 * SUN.z), (Alpha::Opaque, SUN.z)] {
        let material = Material { alpha, ..Material::from(Lambertian::rgb(1.0, 1.0, 1.0)) };
        let scene = sunlit(material, mesh.clone(), DAffine3::IDENTITY, Vec::new());
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let film = film(&mut renderer, &Settings { samples: 256, ..settings(&scene) });
        let got = film.pixels.iter().map(|pixel| pixel.mean()[0]).sum::<f64>() / 64.0;
        // 16,384 samples pass or not: the noise of the mean is 0.003.
        assert!((got - want).abs() < 0.012, "{alpha:?}: {got} for {want}");
    }
}

/// Returns the root mean square error of the share of samples that a surface of opacity 1/4 stops,
/// over pixels, and over the means of blocks of 2 x 2 pixels.
fn error_of_opacity(renderer: &mut Renderer, settings: &Settings) -> (f64, f64) {
    let film = film(renderer, settings);
    let width = film.width as usize;
    let off: Vec<f64> = film.aovs.iter().map(|aov| f64::from(aov.alpha()) - 0.25).collect();
    let is_even = |of: usize| of.is_multiple_of(2);
    let blocks = (0..off.len()).filter(|pixel| is_even(pixel / width) && is_even(pixel % width));
    let of_blocks: Vec<f64> =
        blocks.map(|at| 0.25 * (off[at] + off[at + 1] + off[at + width] + off[at + width + 1])).collect();
    let root = |of: &[f64]| (of.iter().map(|x| x * x).sum::<f64>() / of.len() as f64).sqrt();
    (root(&off), root(&of_blocks))
}

/// The Sobol sequence chooses which samples pass: the share of n samples of a pixel is off by less
/// than 1/n, and neighbours complement each other. Independent samples, the control, are off as by
/// chance.
fn fading_has_little_noise(subject: BackendUnderTest) {
    let mesh = Mesh { colors: vec![[1.0, 1.0, 1.0, 0.25]; 4], ..square() };
    let material = Material { alpha: Alpha::Blend, ..Material::from(Lambertian::rgb(1.0, 1.0, 1.0)) };
    let scene = sunlit(material, mesh, DAffine3::IDENTITY, Vec::new());
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    for samples in [4, 16, 64] {
        let n = f64::from(samples);
        let of =
            |sampler| Settings { width: 32, height: 32, samples, sampler, guides: true, ..settings(&scene) };
        let (even, of_blocks) = error_of_opacity(&mut renderer, &of(Sampler::Sobol));
        let (alone, alone_of_blocks) = error_of_opacity(&mut renderer, &of(Sampler::Independent));
        let expected = (0.25 * 0.75 / n).sqrt();
        assert!(even < 1.0 / n, "{samples}: {even}");
        assert!(of_blocks < 0.35 / n, "{samples}: {of_blocks}");
        assert!((alone / expected - 1.0).abs() < 0.1, "{samples}: {alone}, not {expected}");
        assert!((2.0 * alone_of_blocks / expected - 1.0).abs() < 0.2, "{samples}: {alone_of_blocks}");
    }
}

/// SVGF lowers the noise where a surface fades out before a sky: the light of the samples that hit
/// it is filtered with that of its neighbours. The control has no filter.
fn fading_is_denoised(subject: BackendUnderTest) {
    let colors = [[1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0]];
    let mesh = Mesh { colors: colors.to_vec(), ..square() };
    let material = Material { alpha: Alpha::Blend, ..Material::from(Lambertian::rgb(0.5, 0.5, 0.5)) };
    let mut scene = sunlit(material, mesh, DAffine3::from_scale(DVec3::splat(0.01)), Vec::new());
    (scene.sky.bottom, scene.sky.top) = (glam::Vec3::ZERO, glam::Vec3::ONE);
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let of = |samples, seed| Settings { width: 48, height: 48, samples, seed, ..Settings::of(&scene) };
    let exact = film(&mut renderer, &of(4096, 3)).image();
    let noisy = renderer.render(&of(16, 4).denoise(Svgf)).unwrap();
    let rel_mse = |image: &Image| {
        let pairs = image.pixels.iter().zip(&exact.pixels);
        let each = pairs.map(|(a, b)| f64::from((a[0] - b[0]).powi(2) / (b[0].powi(2) + 0.01)));
        each.sum::<f64>() / exact.pixels.len() as f64
    };
    let (raw, denoised) = (rel_mse(&noisy.film.image()), rel_mse(&noisy.image()));
    println!("relMSE {raw:.2e}, denoised {denoised:.2e}");
    assert!(4.0 * denoised < raw, "{raw} {denoised}");
}

/// A kernel reads normals of vertices if a vertex has one, also behind others with attributes of
/// their own; flat meshes do not pay for them.
#[test]
fn only_smooth_meshes_need_the_feature() {
    let white = || Lambertian::rgb(1.0, 1.0, 1.0).into();
    let needs = |mesh| {
        sunlit(white(), mesh, DAffine3::IDENTITY, Vec::new()).features() & trisect_shared::features::SMOOTH
    };
    let flat = Mesh { normals: Vec::new(), ..square() };
    let colored = Mesh { colors: vec![[0.5; 4]; 4], ..flat.clone() };
    for (mesh, expected) in [(square(), true), (flat, false), (colored.clone(), false)] {
        assert_eq!(needs(mesh) != 0, expected);
    }
    let mut scene = sunlit(white(), colored, DAffine3::IDENTITY, Vec::new());
    let last = scene.vertices.len() - 2;
    assert_ne!(scene.vertices[last].attributes, 0);
    scene.vertices[last].normal = glam::Vec3::Z;
    assert_ne!(scene.features() & trisect_shared::features::SMOOTH, 0);
}

for_each_backend!(
    a_map_of_one_direction_tilts_the_surface,
    a_map_without_a_direction_is_left,
    colours_and_second_coordinates_are_read,
    vertices_fade,
    fading_has_little_noise,
    fading_is_denoised,
);
