//! Properties of nodes, materials, lights and cameras at a time (KHR_animation_pointer).

use super::super::testing::floats;
use super::tests::{TRIANGLE, document};
use super::*;
use crate::description::{Alpha, Material, MetallicRoughness, PunctualLight, Surface};
use crate::import::NoFiles;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;

fn at(time: f64) -> ModelOptions {
    ModelOptions { time: Some(time), ..ModelOptions::default() }
}

fn read(text: &str, time: f64) -> Description {
    parse(text.as_bytes(), "a.gltf", &at(time), &mut NoFiles).unwrap()
}

/// A pointer, and the values of its property at 0 s and at 1 s.
type Track<'a> = (&'a str, &'a [f32]);

/// Returns a document of a textured triangle, a lamp and two cameras, with an animation that has
/// these channels.
fn with(tracks: &[Track], interpolation: &str) -> String {
    let keys = if interpolation == "CUBICSPLINE" { 6 } else { 2 };
    let mut data = [floats(&TRIANGLE), floats(&[0.0, 1.0]), floats(&[0.0; 6])].concat();
    let mut accessors = vec![
        r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}"#.to_owned(),
        r#"{"bufferView":0,"byteOffset":36,"componentType":5126,"count":2,"type":"SCALAR"}"#.to_owned(),
        r#"{"bufferView":0,"byteOffset":44,"componentType":5126,"count":3,"type":"VEC2"}"#.to_owned(),
    ];
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (index, (pointer, values)) in tracks.iter().enumerate() {
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][values.len() / keys];
        accessors.push(format!(
            r#"{{"bufferView":0,"byteOffset":{},"componentType":5126,"count":{keys},"type":"{kind}"}}"#,
            data.len()
        ));
        data.extend(floats(values));
        samplers.push(format!(r#"{{"input":1,"output":{},"interpolation":"{interpolation}"}}"#, index + 3));
        channels.push(format!(
            r#"{{"sampler":{index},"target":{{"path":"pointer","extensions":{{"KHR_animation_pointer":{{"pointer":"{pointer}"}}}}}}}}"#
        ));
    }
    let image = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";
    document(
        &data,
        &format!(
            r#""extensionsUsed":["KHR_animation_pointer"],"extensionsRequired":["KHR_animation_pointer"],
            "bufferViews":[{{"buffer":0,"byteLength":{}}}],"accessors":[{}],
            "images":[{{"uri":"{image}"}}],"textures":[{{"source":0}}],
            "materials":[{{"alphaMode":"MASK","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}},
              "extensions":{{"KHR_materials_clearcoat":{{"clearcoatFactor":0.25}}}}}},{{}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":2}},"material":0}}]}}],
            "cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":1}}}},
              {{"type":"orthographic","orthographic":{{"xmag":1,"ymag":1,"znear":1,"zfar":2}}}}],
            "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","spot":{{}}}},{{"type":"point"}}]}}}},
            "nodes":[{{"mesh":0}},{{"camera":0}},{{"camera":1}},
              {{"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
            "animations":[{{"samplers":[{}],"channels":[{}]}}]"#,
            data.len(),
            accessors.join(","),
            samplers.join(","),
            channels.join(",")
        ),
    )
}

fn surface(material: &Material) -> &MetallicRoughness {
    match &material.surface {
        Surface::MetallicRoughness(surface) => surface,
        other => panic!("{other:?}"),
    }
}

#[test]
fn materials_change() {
    let text = with(
        &[
            ("/materials/0/pbrMetallicRoughness/baseColorFactor", &[0.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.0, 1.0]),
            ("/materials/0/pbrMetallicRoughness/metallicFactor", &[0.0, 0.5]),
            ("/materials/0/pbrMetallicRoughness/roughnessFactor", &[1.0, 0.0]),
            ("/materials/0/emissiveFactor", &[0.0, 0.0, 0.0, 0.0, 1.0, 0.5]),
            ("/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", &[1.0, 7.0]),
            ("/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor", &[0.0, 1.0]),
            ("/materials/0/alphaCutoff", &[0.25, 0.75]),
        ],
        "LINEAR",
    );
    let scene = read(&text, 0.5);
    let material = &scene.materials[0];
    let of = surface(material);
    assert_eq!((of.base_color, material.opacity), (DVec3::new(0.5, 0.25, 0.0), 0.5));
    assert_eq!((of.metallic, of.roughness), (0.25, 0.5));
    assert_eq!(material.emission, 4.0 * DVec3::new(0.0, 0.5, 0.25));
    assert!(matches!(material.alpha, Alpha::Mask { cutoff: 0.5 }), "{:?}", material.alpha);
    assert_eq!(scene.warnings, [""; 0]);
    // The layers change, too. Each time starts from the file's own numbers.
    let layers = |time| surface(&read(&text, time).materials[0]).layers.clone();
    assert_ne!(layers(0.0), layers(1.0));
    let mut files = NoFiles;
    let mut open = Gltf::open(text.as_bytes(), "a.gltf", &mut files).unwrap();
    let mut emission =
        |options: &ModelOptions| open.describe(options, &mut NoFiles).unwrap().materials[0].emission;
    assert_eq!(emission(&at(1.0)), DVec3::new(0.0, 7.0, 3.5));
    assert_eq!(emission(&ModelOptions::default()), DVec3::ZERO);
    assert_eq!(emission(&at(0.0)), DVec3::ZERO);
}

#[test]
fn glossy_materials_change() {
    let place = "/materials/0/extensions/KHR_materials_pbrSpecularGlossiness";
    let names = ["diffuseFactor", "specularFactor", "glossinessFactor"].map(|name| format!("{place}/{name}"));
    let text = with(
        &[
            (&names[0], &[0.0, 0.0, 0.0, 1.0, 1.0, 0.5, 0.25, 0.0]),
            (&names[1], &[0.0, 0.0, 0.0, 0.5, 0.25, 1.0]),
            (&names[2], &[0.0, 1.0]),
        ],
        "LINEAR",
    );
    let clear = r#""KHR_materials_clearcoat":{"clearcoatFactor":0.25}"#;
    assert!(text.contains(clear));
    let text = text.replace(clear, r#""KHR_materials_pbrSpecularGlossiness":{}"#);
    let scene = read(&text, 0.5);
    let of = surface(&scene.materials[0]);
    assert_eq!((of.base_color, scene.materials[0].opacity), (DVec3::new(0.5, 0.25, 0.125), 0.5));
    let specular = of.layers.specular.as_ref().unwrap();
    assert_eq!((specular.color, of.roughness), (DVec3::new(0.25, 0.125, 0.5), 0.5));
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn textures_are_moved() {
    let path = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform";
    let names = ["offset", "scale", "rotation"].map(|name| format!("{path}/{name}"));
    let text = with(
        &[
            (&names[0], &[0.0, 0.0, 1.0, -0.5]),
            (&names[1], &[2.0, 2.0, 4.0, 4.0]),
            (&names[2], &[0.0, -(FRAC_PI_2 as f32)]),
        ],
        "LINEAR",
    );
    let place = |time| {
        let scene = read(&text, time);
        let texture = surface(&scene.materials[0]).texture.clone().unwrap();
        texture.transform.transform_point2(DVec2::new(1.0, 0.0))
    };
    assert_eq!(place(0.0), DVec2::new(2.0, 0.0));
    assert!(place(1.0).abs_diff_eq(DVec2::new(1.0, -0.5) + DVec2::new(0.0, 4.0), 1e-6), "{}", place(1.0));
}

#[test]
fn lights_and_cameras_change() {
    let text = with(
        &[
            ("/extensions/KHR_lights_punctual/lights/0/color", &[1.0, 1.0, 1.0, 1.0, 0.5, 0.0]),
            ("/extensions/KHR_lights_punctual/lights/0/intensity", &[0.0, 8.0]),
            ("/extensions/KHR_lights_punctual/lights/0/spot/innerConeAngle", &[0.0, 0.5]),
            ("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", &[0.5, 1.0]),
            ("/cameras/0/perspective/yfov", &[0.5, 1.5]),
            ("/cameras/0/perspective/znear", &[1.0, 2.0]),
            ("/cameras/1/orthographic/ymag", &[1.0, 3.0]),
            ("/cameras/1/orthographic/xmag", &[1.0, 3.0]),
        ],
        "LINEAR",
    );
    let scene = read(&text, 0.5);
    let PunctualLight::Spot { intensity, inner, outer, .. } = scene.lights[0] else { panic!() };
    assert_eq!((intensity, inner, outer), (4.0 * DVec3::new(1.0, 0.75, 0.5), 0.25, 0.75));
    assert_eq!((scene.cameras[0].1.vertical_fov, scene.cameras[1].1.parallel_height), (1.0, 4.0));
    assert_eq!(scene.warnings, [""; 0]);
    let text = with(&[("/extensions/KHR_lights_punctual/lights/0/range", &[1.0, 2.0])], "LINEAR");
    assert!(
        read(&text, 0.5).warnings[0].starts_with("the range of lights"),
        "{:?}",
        read(&text, 0.5).warnings
    );
}

#[test]
fn nodes_move_and_vanish() {
    let text = with(
        &[
            ("/nodes/0/translation", &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0]),
            ("/nodes/0/extensions/KHR_node_visibility/visible", &[1.0, 0.0]),
        ],
        "LINEAR",
    );
    let place = |time| read(&text, time).instances.first().map(|of| of.transform.translation.x);
    // Visibility changes at keys, and not in between.
    assert_eq!([0.0, 0.5, 0.75, 1.0].map(place), [Some(0.0), Some(2.0), Some(3.0), None]);
}

/// A spline may leave the range of its keys; what cannot be negative stays 0 there.
#[test]
fn splines_stay_in_range() {
    // In-tangent, value and out-tangent of both keys: a dip below 0 between two zeros.
    let dip = &[0.0, 0.0, -8.0, 8.0, 0.0, 0.0];
    let light = "/extensions/KHR_lights_punctual/lights/0/intensity";
    let text = with(&[(light, dip), ("/materials/0/emissiveFactor", &[0.0; 18])], "CUBICSPLINE");
    let PunctualLight::Spot { intensity, .. } = read(&text, 0.5).lights[0] else { panic!() };
    assert_eq!(intensity, DVec3::ZERO);
}

#[test]
fn what_a_pointer_cannot_name_is_said() {
    let warnings = |pointer: &str| read(&with(&[(pointer, &[0.0, 1.0])], "LINEAR"), 0.5).warnings;
    for pointer in [
        "/materials/0/occlusionTexture/strength",
        "/materials/0/pbrMetallicRoughness/extras",
        "/meshes/0/weights/0",
        "/nodes/0/name",
        "/cameras/0/type",
        "nonsense",
        "",
    ] {
        let said = warnings(pointer);
        assert!(said.len() == 1 && said[0].ends_with("which is not supported and ignored"), "{said:?}");
    }
    let said = warnings("/materials/0/occlusionTexture/strength");
    assert_eq!(
        said,
        [
            "an animation changes \"/materials/{}/occlusionTexture/strength\", which is not supported and ignored"
        ]
    );
    for pointer in [
        "/materials/1/emissiveTexture/extensions/KHR_texture_transform/rotation",
        "/materials/0/extensions/KHR_materials_sheen/sheenRoughnessFactor",
        "/extensions/KHR_lights_punctual/lights/1/spot/innerConeAngle",
        "/cameras/1/perspective/yfov",
    ] {
        let said = warnings(pointer);
        assert!(said.len() == 1 && said[0].ends_with("which the file does not have: ignored"), "{said:?}");
    }
    let error = |pointer: &str, values: &[f32]| {
        let text = with(&[(pointer, values)], "LINEAR");
        parse(text.as_bytes(), "a.gltf", &at(0.5), &mut NoFiles).unwrap_err().to_string()
    };
    let message = error("/materials/2/alphaCutoff", &[0.0, 1.0]);
    assert!(
        message.contains("animations[0].channels[0]: its pointer names materials/2, and there are 2"),
        "{message}"
    );
    assert!(error("/nodes/9/scale", &[0.0; 6]).contains("names nodes[9]"));
    let message = error("/materials/0/emissiveFactor", &[0.0, 1.0]);
    assert!(message.contains("SCALAR") && message.contains("takes VEC3"), "{message}");
}
