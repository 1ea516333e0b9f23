//! Layered materials: absorption, dispersion and unlit surfaces against known answers, and light
//! that is sampled against light that is found; on every backend.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use glam::{DAffine2, DAffine3, DVec3};
use std::sync::Arc;
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect::scene::description::{
    Description, Filter, Instance, Lambertian, Material, Mesh, MetallicRoughness, Sky, Texels, TextureImage,
    TextureUse, Wrap,
};
use trisect::scene::material::layers::{self, Layers};
use trisect_tests::renders::{cpu, differing, film, independent};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Returns a scene that a far camera looks at along -z, before a sky of radiance 1.
fn scene(materials: &str, objects: &str) -> Scene {
    let text = format!(
        "Scene(version: 1, image: (width: 8, height: 8, samples: 64, depth: 12),
        camera: (look_from: (0, 0, 20), look_at: (0, 0, 0), vertical_fov: 0.1),
        sky: Gradient(bottom: (1, 1, 1), top: (1, 1, 1)),
        materials: {{ {materials} }}, objects: [ {objects} ])"
    );
    Scene::parse(&text, "test").unwrap()
}

fn mean(film: &Film) -> DVec3 {
    let sum: DVec3 = film.pixels.iter().map(|pixel| DVec3::from(pixel.mean())).sum();
    sum / film.pixels.len() as f64
}

fn render(subject: BackendUnderTest, scene: &Scene) -> Option<DVec3> {
    let film = film(&mut subject.renderer(scene)?, &independent(scene));
    assert_eq!(film.counts().rejected, 0);
    Some(mean(&film))
}

/// Light through a block of index 1 is weakened by Beer and Lambert's law: to the attenuation's
/// colour after its distance. So is that of what is inside.
fn solids_absorb_by_distance(subject: BackendUnderTest) {
    let color = DVec3::new(0.3, 0.8, 0.5);
    let glass = "MetallicRoughness(metallic: 0, roughness: 0, ior: 1, transmission: 1, layers: (volume: \
                 (attenuation_color: (0.3, 0.8, 0.5), attenuation_distance: 0.8)))";
    let block = r#"Box(min: (-1, -1, -1), max: (1, 1, 1), material: "glass")"#;
    let lamp = r#"Quad(corner: (-0.5, -0.5, 0.25), u: (1, 0, 0), v: (0, 1, 0), material: "lamp")"#;
    let lamp_material = r#""lamp": Emissive(radiance: (1, 1, 1))"#;
    for (objects, distance) in [(block.to_owned(), 2.0), (format!("{block}, {lamp}"), 0.75)] {
        let scene = scene(&format!(r#""glass": {glass}, {lamp_material}"#), &objects);
        let Some(found) = render(subject, &scene) else { return };
        let want = DVec3::from_array(color.to_array().map(|c| c.powf(distance / 0.8)));
        // The boundary reflects 2.5e-7, and bends light by 1e-3 of its angle with the facets.
        assert!((found - want).abs().max_element() < 2e-3, "{distance}: {found} for {want}");
        // Negative control: half of the distance.
        assert!((found - want.powf(0.5)).abs().max_element() > 0.05);
    }
}

/// Glass that disperses adds and loses no light, but for single scattering by its facets.
fn dispersion_keeps_light(subject: BackendUnderTest) {
    let prism = r#""prism": MetallicRoughness(metallic: 0, roughness: 0.03, transmission: 1, ior: 1.6,
        layers: (volume: (), dispersion: 10))"#;
    let mut scene = scene(prism, r#"Sphere(center: (0, 0, 0), radius: 1, material: "prism")"#);
    (scene.camera.vertical_fov, scene.image.samples, scene.image.depth) = (0.09, 128, 40);
    let Some(found) = render(subject, &scene) else { return };
    // 5 sigma of the mean of 8,192 samples from 0 to 3, of which a third is bright.
    let noise = 5.0 * 2f64.sqrt() / 90.0;
    assert!((found - DVec3::ONE).abs().max_element() < noise, "{found}");
}

/// An unlit surface shows its colour, without light and with too much of it.
fn unlit_surfaces_show_their_colour(subject: BackendUnderTest) {
    let model = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_materials_unlit"],"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.25,0.5,1,1]},"extensions":{"KHR_materials_unlit":{}}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":
        "data:;base64,AAAgwQAAIMEAAAAAAAAgQQAAIMEAAAAAAAAAAAAAIEEAAAAA"}]}"#;
    let read = |light: f64| {
        let options = trisect::scene::import::ModelOptions::default();
        let none = &mut trisect::scene::import::NoFiles;
        let mut model =
            trisect::scene::import::gltf::parse(model.as_bytes(), "unlit.gltf", &options, none).unwrap();
        model.sky = Some(Sky::Gradient { bottom: DVec3::splat(light), top: DVec3::splat(light) });
        let mut scene = Scene::from_model(model, "unlit.gltf").unwrap();
        scene.camera.look_from = DVec3::new(0.0, 0.0, 20.0);
        scene.camera.look_at = DVec3::ZERO;
        (scene.camera.vertical_fov, scene.image.width, scene.image.height) = (0.1, 8, 8);
        scene.image.samples = 4;
        scene
    };
    for light in [0.0, 1.0, 1e6] {
        let Some(found) = render(subject, &read(light)) else { return };
        assert_eq!(found, DVec3::new(0.25, 0.5, 1.0), "{light}");
    }
}

/// A lamp inside of a solid is as bright by connections as by chance: connections are absorbed.
fn connections_inside_agree_with_light(subject: BackendUnderTest) {
    let scene = scene(
        r#""glass": MetallicRoughness(metallic: 0, roughness: 0.3, ior: 1.3, transmission: 1, layers: (volume:
            (attenuation_color: (0.2, 0.5, 0.8), attenuation_distance: 0.5))),
        "lamp": Emissive(radiance: (8, 8, 8), two_sided: true), "ball": Lambertian(albedo: (0.8, 0.8, 0.8))"#,
        r#"Box(min: (-1, -1, -1), max: (1, 1, 1), material: "glass"),
        Quad(corner: (-0.3, 0.7, -0.3), u: (0.6, 0, 0), v: (0, 0, 0.6), material: "lamp"),
        Sphere(center: (0, -0.3, 0), radius: 0.4, material: "ball")"#,
    );
    let mut dark = scene;
    (dark.sky.bottom, dark.sky.top) = (glam::Vec3::ZERO, glam::Vec3::ZERO);
    dark.camera.vertical_fov = 5.0f64.to_radians();
    let settings = Settings { width: 9, height: 7, samples: 4096, depth: 12, ..independent(&dark) };
    let few = if subject.is_software() { 1024 } else { 4096 };
    let settings = Settings { samples: few, ..settings };
    let Some(mut renderer) = subject.renderer(&dark) else { return };
    let with = mean(&film(&mut renderer, &settings));
    let without = mean(&film(&mut renderer, &Settings { light_sampling: false, ..settings }));
    let apart = ((with - without) / without).abs().max_element();
    // The noise of 64,512 paths or more is 1 %. Connections that are not absorbed add 20 % in red.
    assert!(apart < 0.05, "{with} {without}");
}

/// Light that is sampled and light that is found have the same mean on all layers: the pdfs of the
/// lobes are those of their samples. Every backend shows the CPU's image.
fn sampling_agrees_with_light(subject: BackendUnderTest) {
    let scene = Scene::load(&trisect_tests::root().join("scenes/layers.ron")).unwrap();
    let settings = Settings { width: 16, height: 9, samples: 256, depth: 4, ..independent(&scene) };
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let with = film(&mut renderer, &settings);
    let without = film(&mut renderer, &Settings { light_sampling: false, samples: 1024, ..settings.clone() });
    let (with, without) = (mean(&with), mean(&without));
    // The noise of light that is found, as the spread of seeds shows it, is 0.7 %.
    let apart = ((with - without) / without).abs().max_element();
    assert!(apart < 0.025, "{with} {without}");
    if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
        let few = Settings { samples: 4, ..settings };
        let (got, want) = (film(&mut renderer, &few), film(&mut cpu(&scene), &few));
        assert_eq!(differing(&got, &want), 0);
    }
}

/// A closed room of layered white walls that emit is bright by a geometric series: emission over
/// absorption. Its camera is in a corner, and its size is odd.
fn a_closed_room_keeps_its_light(subject: BackendUnderTest) {
    let wall = |layers: &str, metallic: f64| {
        format!(
            "MetallicRoughness(base_color: (0.5, 0.5, 0.5), metallic: {metallic}, roughness: 0.6, \
             emission: (1, 1, 1), two_sided: true, layers: ({layers}))"
        )
    };
    for (layers, metallic) in [
        ("coat: (strength: 1, roughness: 0.4)", 0.0),
        ("sheen: (color: (0.5, 0.5, 0.5), roughness: 0.5)", 0.0),
        ("anisotropy: (strength: 0.6, rotation: 30)", 1.0),
        ("iridescence: (thickness: 300)", 1.0),
        ("specular: (strength: 0.5)", 0.0),
    ] {
        let room = r#"Box(min: (-1, -1, -1), max: (1, 1, 1), material: "wall")"#;
        let mut scene = scene(&format!(r#""wall": {}"#, wall(layers, metallic)), room);
        scene.camera.look_from = DVec3::new(0.9, 0.8, 0.9);
        scene.camera.look_at = DVec3::new(-1.0, -0.7, -0.6);
        scene.camera.vertical_fov = 1.2;
        let samples = if subject.is_software() { 64 } else { 256 };
        let settings = Settings { width: 13, height: 7, samples, depth: 32, ..independent(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let got = film(&mut renderer, &settings);
        assert_eq!(got.counts().rejected, 0, "{layers}");
        let found = mean(&got);
        // An albedo from 0.35 to 0.75: 1 / (1 - albedo).
        assert!(found.min_element() > 1.5 && found.max_element() < 4.0, "{layers}: {found}");
        let without = Settings { light_sampling: false, ..settings };
        let other = mean(&film(&mut renderer, &without));
        assert!(((found - other) / other).abs().max_element() < 0.05, "{layers}: {found} {other}");
    }
}

/// The transmission of a layered material is multiplied by its texture once, with normal maps in
/// the scene and without.
fn a_transmission_texture_is_read_once(subject: BackendUnderTest) {
    let grey = Arc::new(TextureImage {
        name: "grey".to_owned(),
        width: 1,
        height: 1,
        texels: Texels::Float(vec![[0.5, 0.5, 1.0, 1.0]]),
    });
    let texture = || TextureUse {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
        transform: DAffine2::IDENTITY,
        second_uvs: false,
    };
    let square = |z: f32, x: f32| Mesh {
        positions: vec![[x - 1.0, -1.0, z], [x + 1.0, -1.0, z], [x + 1.0, 1.0, z], [x - 1.0, 1.0, z]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: usize::from(x > 1.0),
        ..Mesh::default()
    };
    for has_map in [false, true] {
        let surface = MetallicRoughness {
            metallic: 0.0,
            roughness: 0.0,
            ior: 1.0,
            transmission: 1.0,
            transmission_texture: Some(texture()),
            base_color: DVec3::ONE,
            layers: Layers { specular: Some(layers::Specular::default()), ..Layers::default() },
            ..MetallicRoughness::default()
        };
        let other = Material {
            normal_texture: has_map.then(texture),
            ..Material::from(Lambertian::rgb(0.5, 0.5, 0.5))
        };
        let model = Description {
            materials: vec![Material::from(surface), other],
            images: vec![grey.clone()],
            meshes: vec![square(0.0, 0.0), square(-5.0, 30.0)],
            instances: [0, 1].map(|mesh| Instance { mesh, transform: DAffine3::IDENTITY }).to_vec(),
            // Light from behind the pane alone, so that what its diffuse part reflects is dark.
            lights: Vec::new(),
            sky: Some(Sky::Gradient { bottom: DVec3::ZERO, top: DVec3::ZERO }),
            ..Description::default()
        };
        let mut scene = Scene::from_model(model, "test").unwrap();
        let lamp = self::scene(
            r#""lamp": Emissive(radiance: (1, 1, 1))"#,
            r#"Quad(corner: (-9, -9, -9), u: (18, 0, 0), v: (0, 18, 0), material: "lamp")"#,
        );
        scene
            .flats
            .extend(lamp.flats.iter().map(|flat| trisect_shared::planar::Planar { material: 2, ..*flat }));
        scene.materials.extend(lamp.materials);
        scene.camera = lamp.camera;
        let settings = Settings { width: 8, height: 8, samples: 256, depth: 2, ..independent(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let found = mean(&film(&mut renderer, &settings)).x;
        // Half of the light passes; the noise of 16,384 samples is 0.004. Read twice, a quarter
        // does.
        assert!((found - 0.5).abs() < 0.03, "{has_map}: {found}");
    }
}

for_each_backend! {
    solids_absorb_by_distance,
    dispersion_keeps_light,
    unlit_surfaces_show_their_colour,
    sampling_agrees_with_light,
    connections_inside_agree_with_light,
    a_closed_room_keeps_its_light,
    a_transmission_texture_is_read_once,
}
