//! Whole documents: nodes, cameras, lights and materials.

use super::super::testing::{floats, png};
use super::tests::{TRIANGLE, TRIANGLE_MESH, document, error, mesh, read, triangle};
use crate::description::{Alpha, Filter, PunctualLight, Surface, Texels, Wrap};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_SQRT_2;

#[test]
fn nodes_are_placed_by_their_ancestors() {
    let scene = read(&triangle(&format!(
        r#"{TRIANGLE_MESH},"nodes":[{{"children":[1,2],"translation":[1,2,3],"scale":[2,2,2]}},
        {{"mesh":0,"rotation":[0,0,{FRAC_1_SQRT_2},{FRAC_1_SQRT_2}],"translation":[0.1,0,0]}},
        {{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]}}]"#
    )));
    assert_eq!(scene.meshes.len(), 1);
    let place = |instance: usize, x, y, z| {
        let instance = &scene.instances[instance];
        assert_eq!(instance.mesh, 0);
        instance.transform.transform_point3(DVec3::new(x, y, z))
    };
    assert!(place(0, 1.0, 0.0, 0.0).abs_diff_eq(DVec3::new(1.2, 4.0, 3.0), 1e-12));
    assert!(place(1, 1.0, 1.0, 0.0).abs_diff_eq(DVec3::new(9.0, 4.0, 3.0), 1e-12));
}

#[test]
fn nodes_must_be_trees() {
    let message = |nodes: &str| error(&triangle(&format!(r#"{TRIANGLE_MESH},"nodes":[{nodes}]"#)));
    assert!(message(r#"{"children":[1]},{"children":[0]}"#).contains("nodes[0]: it is its own descendant"));
    assert!(message(r#"{},{"children":[1]}"#).contains("nodes[1]: it is its own descendant"));
    let found = message(r#"{"children":[2]},{"children":[2]},{}"#);
    assert!(found.contains("nodes[1].children: nodes[2] is a child of nodes[0] already"), "{found}");
    assert!(message(r#"{"children":[9]}"#).contains("nodes[0].children: it names nodes[9], and there are 1"));
    assert!(message(r#"{"rotation":[0,0,0,0]}"#).contains("nodes[0]: the rotation's length is 0"));
    assert!(
        message(r#"{"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,2]}"#)
            .contains("nodes[0]: the last row of the matrix")
    );
    assert!(message(r#"{"mesh":0,"scale":[1e300,1,1]}"#).contains("nodes[0]: the instance's position"));
    let chain = |depth: usize| {
        let nodes: Vec<String> = (1..depth).map(|child| format!(r#"{{"children":[{child}]}}"#)).collect();
        format!(r#"{TRIANGLE_MESH},"nodes":[{},{{"mesh":0}}]"#, nodes.join(","))
    };
    assert_eq!(read(&triangle(&chain(256))).instances.len(), 1);
    assert!(error(&triangle(&chain(258))).contains("nodes are nested too deep; the maximum is 256 levels"));
}

/// A node that is flat between two rotations has a determinant that rounding makes other than 0.
#[test]
fn a_rotated_flat_node_is_left_out() {
    let flat = r#"{"children":[1],"rotation":[0.1,0.2,0.3,0.9273618495495703],"scale":[1,0,1]},
        {"mesh":0,"rotation":[0.5,-0.5,0.1,0.7]},{"mesh":0}"#;
    let scene = read(&triangle(&format!(r#"{TRIANGLE_MESH},"nodes":[{flat}]"#)));
    assert_eq!(scene.instances.len(), 1);
    assert_eq!(scene.warnings, ["instances that are scaled to nothing, left out: 1, the first in nodes[1]"]);
}

#[test]
fn the_default_scene_or_all_roots() {
    let nodes = r#""nodes":[{"mesh":0},{"mesh":0,"scale":[1,0,1]}],"scenes":[{"nodes":[0]},{"nodes":[1]}]"#;
    let scene = read(&triangle(&format!("{TRIANGLE_MESH},{nodes},\"scene\":0")));
    assert_eq!(scene.instances.len(), 1);
    assert_eq!(scene.warnings, ["only the default scene is read; the file has others"]);
    let scene = read(&triangle(&format!("{TRIANGLE_MESH},{nodes}")));
    assert_eq!(scene.warnings, ["instances that are scaled to nothing, left out: 1, the first in nodes[1]"]);
    assert!(
        error(&triangle(&format!("{TRIANGLE_MESH},{nodes},\"scene\":2")))
            .contains("scene: it names scenes[2]")
    );
    let none = nodes.replace("[0]}", "[7]}");
    assert!(
        error(&triangle(&format!("{TRIANGLE_MESH},{none},\"scene\":0")))
            .contains("scenes[0].nodes: it names nodes[7], and there are 2")
    );
    let twice = nodes.replace("[0]}", "[0,0]}");
    let scene = read(&triangle(&format!("{TRIANGLE_MESH},{twice},\"scene\":0")));
    assert_eq!(scene.instances.len(), 1);
    assert!(
        scene.warnings[1].starts_with("nodes that the scene names twice, drawn once: 1"),
        "{:?}",
        scene.warnings
    );
}

/// The specification requires that a scene names roots. A scene that names a child is drawn, each
/// node once, where its parents place it.
#[test]
fn a_scene_may_name_children() {
    let drawn = |listed: &str| {
        let nodes = r#""nodes":[{"children":[1],"translation":[1,0,0],"scale":[2,2,2]},
            {"children":[2],"translation":[0,1,0]},{"mesh":0,"translation":[0,0,1]},{"mesh":0}]"#;
        let scene = read(&triangle(&format!(
            r#"{TRIANGLE_MESH},{nodes},"scene":0,"scenes":[{{"nodes":[{listed}]}}]"#
        )));
        let places: Vec<DVec3> =
            scene.instances.iter().map(|instance| instance.transform.translation).collect();
        (places, scene.warnings)
    };
    let place = DVec3::new(1.0, 2.0, 2.0);
    assert_eq!(drawn("0"), (vec![place], vec![]));
    assert_eq!(drawn("0,3"), (vec![place, DVec3::ZERO], vec![]));
    for listed in ["1", "2", "0,1", "2,0", "2,1,0"] {
        let (places, warnings) = drawn(listed);
        assert_eq!(places, [place], "{listed}");
        let [warning] = &warnings[..] else { panic!("{listed}: {warnings:?}") };
        assert!(
            warning
                .starts_with("nodes that the scene names but that are not roots, drawn where their parents")
        );
    }
}

#[test]
fn cameras_look_along_their_nodes() {
    let scene = read(&document(
        &[],
        &format!(
            r#""cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}},{{"type":"orthographic","orthographic":{{"xmag":1,"ymag":2,"znear":0,"zfar":9}}}}],
            "nodes":[{{"camera":0,"name":"eye","translation":[1,2,3],"scale":[2,2,2],
            "rotation":[0,{FRAC_1_SQRT_2},0,{FRAC_1_SQRT_2}]}},{{"camera":1}},{{"camera":0,"name":"eye"}}]"#
        ),
    ));
    let (name, pose) = &scene.cameras[0];
    assert_eq!((name.as_str(), pose.vertical_fov, pose.defocus_angle), ("eye", 0.5, 0.0));
    assert_eq!(pose.look_from, DVec3::new(1.0, 2.0, 3.0));
    let axis = (pose.look_at - pose.look_from).normalize();
    assert!(axis.abs_diff_eq(DVec3::NEG_X, 1e-12), "a quarter turn about y takes -z to -x, not to {axis}");
    assert!(pose.up.abs_diff_eq(DVec3::Y, 1e-12));
    assert_eq!((scene.cameras[1].1.parallel_height, scene.cameras[0].1.parallel_height), (4.0, 0.0));
    assert_eq!(scene.cameras[2].0, "eye 2");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn parallel_cameras_without_a_height_are_refused() {
    for camera in
        [r#"{"type":"orthographic"}"#, r#"{"type":"orthographic","orthographic":{"xmag":1,"ymag":0}}"#]
    {
        let text = document(&[], &format!(r#""cameras":[{camera}],"nodes":[{{"camera":0}}]"#));
        let error = error(&text);
        assert!(error.contains("cameras[0]"), "{error}");
        assert!(error.contains("orthographic") || error.contains("ymag"), "{error}");
    }
}

#[test]
fn lights_shine_along_their_nodes() {
    let lights = |lights: &str, nodes: &str| {
        document(
            &[],
            &format!(r#""extensions":{{"KHR_lights_punctual":{{"lights":[{lights}]}}}},"nodes":[{nodes}]"#),
        )
    };
    let node = |light: usize, rest: &str| {
        format!(r#"{{"extensions":{{"KHR_lights_punctual":{{"light":{light}}}}}{rest}}}"#)
    };
    let scene = read(&lights(
        r#"{"type":"spot","color":[1,0.5,0],"intensity":40,"spot":{"innerConeAngle":0.1,"outerConeAngle":0.2},"range":3},
        {"type":"directional","intensity":2},{"type":"point","color":[0,1,0]}"#,
        &[node(0, r#","translation":[0,5,0]"#), node(1, r#","rotation":[1,0,0,0]"#), node(2, "")].join(","),
    ));
    let PunctualLight::Spot { position, direction, intensity, inner, outer } = scene.lights[0] else {
        panic!()
    };
    assert_eq!((position, direction), (DVec3::new(0.0, 5.0, 0.0), DVec3::NEG_Z));
    assert_eq!((intensity, inner, outer), (DVec3::new(40.0, 20.0, 0.0), 0.1, 0.2));
    let PunctualLight::Directional { direction, irradiance } = scene.lights[1] else { panic!() };
    assert!(direction.abs_diff_eq(DVec3::Z, 1e-12));
    assert_eq!(irradiance, DVec3::splat(2.0));
    assert_eq!(scene.lights[2], PunctualLight::Point { position: DVec3::ZERO, intensity: DVec3::Y });
    assert_eq!(scene.warnings.len(), 1);
    let bad = lights(r#"{"type":"spot","spot":{"innerConeAngle":0.9}}"#, &node(0, ""));
    assert!(error(&bad).contains("extensions.KHR_lights_punctual.lights[0]: innerConeAngle is 0.9"));
    assert!(error(&lights("", &node(0, ""))).contains("nodes[0]: it names"));
}

#[test]
fn materials_and_their_textures() {
    let image = STANDARD.encode(png(2, 1, &[[255, 0, 0, 255], [0, 255, 0, 0]]));
    let data = [floats(&TRIANGLE), floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0])].concat();
    let material = r#"{"name":"m","doubleSided":true,"alphaMode":"MASK","alphaCutoff":0.25,"normalTexture":{"index":0},
        "pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,0.4],"metallicFactor":0.5,"roughnessFactor":2,
        "baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.5,0],"scale":[2,3],"texCoord":1}}},
        "metallicRoughnessTexture":{"index":1}},"emissiveFactor":[0,1,0],"emissiveTexture":{"index":1,"texCoord":1},
        "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":5},"KHR_materials_ior":{"ior":1.33},
        "KHR_materials_transmission":{"transmissionFactor":0.75},"KHR_materials_sheen":{}}}"#;
    let rest = format!(
        r#""bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}}],
        "images":[{{"uri":"data:image/png;base64,{image}"}}],
        "textures":[{{"source":0,"sampler":0}},{{"source":0}}],
        "samplers":[{{"magFilter":9728,"minFilter":9987,"wrapS":33071,"wrapT":33648}}],
        "extensionsUsed":["ADOBE_materials_thin","ADOBE_materials_other"],"materials":[{{}},{material}]"#
    );
    let text = mesh(&data, r#""attributes":{"POSITION":0,"TEXCOORD_1":1},"material":1"#, &rest);
    let scene = read(&text);
    let material = &scene.materials[0];
    assert_eq!((material.name.as_str(), material.alpha), ("m", Alpha::Mask { cutoff: 0.25 }));
    let Surface::MetallicRoughness(pbr) = &material.surface else { panic!() };
    assert_eq!((pbr.base_color, material.opacity), (DVec3::new(0.1, 0.2, 0.3), 0.4));
    assert_eq!((material.emission, material.emits_both_sides), (DVec3::new(0.0, 5.0, 0.0), true));
    let base = pbr.texture.as_ref().unwrap();
    assert_eq!((base.wrap, base.filter), ([Wrap::Clamp, Wrap::Mirror], Filter::Nearest));
    assert_eq!(base.transform.transform_point2(DVec2::ONE), DVec2::new(2.5, 3.0));
    assert_eq!((pbr.metallic, pbr.roughness, pbr.ior, pbr.transmission), (0.5, 1.0, 1.33, 0.75));
    let rough = pbr.metallic_roughness_texture.as_ref().unwrap();
    assert_eq!((rough.wrap, rough.filter), ([Wrap::Repeat; 2], Filter::Linear));
    assert_eq!(scene.images.len(), 2);
    assert!(matches!(scene.images[base.image].texels, Texels::Srgb8(_)));
    assert!(matches!(scene.images[rough.image].texels, Texels::Linear8(_)));
    assert_eq!(material.emission_texture.as_ref().unwrap().image, base.image);
    assert_eq!(scene.meshes[0].uvs[1], [1.0, 0.0]);
    let warnings = scene.warnings.join("\n");
    for expected in [
        "ADOBE_materials_thin is not supported",
        "ADOBE_materials_other is not supported",
        "material factors outside 0 to 1, clamped: 1, the first in materials[1]",
    ] {
        assert_eq!(warnings.matches(expected).count(), 1, "{warnings}");
    }
    let message = error(&text.replace("extensionsUsed", "extensionsRequired"));
    assert!(
        message.contains("extensionsRequired: the extension ADOBE_materials_thin is not supported"),
        "{message}"
    );
    assert!(error(&text.replace("data:image/png;base64,", "x")).contains("images[0]: cannot read"));
}
