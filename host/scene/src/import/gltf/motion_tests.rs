//! Documents at a time: animations, morph targets, skins; instances and variants.

use super::super::testing::floats;
use super::tests::{TRIANGLE, TRIANGLE_MESH, document, triangle};
use super::*;
use crate::import::NoFiles;
use glam::DVec3;

fn read(text: &str, options: &ModelOptions) -> Description {
    parse(text.as_bytes(), "a.gltf", options, &mut NoFiles).unwrap()
}

fn error(text: &str, options: &ModelOptions) -> String {
    parse(text.as_bytes(), "a.gltf", options, &mut NoFiles).unwrap_err().to_string()
}

fn at(time: f64) -> ModelOptions {
    ModelOptions { time: Some(time), ..ModelOptions::default() }
}

/// Document of the triangle with further floats, each list an accessor of its type from 1 on.
fn with(lists: &[(&str, &[f32])], rest: &str) -> String {
    let mut data = floats(&TRIANGLE);
    let mut accessors = vec![r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}"#.to_owned()];
    for (kind, list) in lists {
        let width = match *kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let (offset, count) = (data.len(), list.len() / width);
        accessors.push(format!(
            r#"{{"bufferView":0,"byteOffset":{offset},"componentType":5126,"count":{count},"type":"{kind}"}}"#
        ));
        data.extend(floats(list));
    }
    let length = data.len();
    let accessors = accessors.join(",");
    let scene =
        format!(r#""bufferViews":[{{"buffer":0,"byteLength":{length}}}],"accessors":[{accessors}],{rest}"#);
    document(&data, &scene)
}

/// Returns where the first instance has the origin of its mesh.
fn origin(text: &str, time: f64) -> DVec3 {
    read(text, &at(time)).instances[0].transform.translation
}

fn moved_by(path: &str, interpolation: &str, values: (&str, &[f32])) -> String {
    with(
        &[("SCALAR", &[1.0, 2.0, 4.0]), values],
        &format!(
            r#""nodes":[{{"mesh":0,"translation":[7,0,0]}}],{TRIANGLE_MESH},"animations":[{{"name":"go",
            "samplers":[{{"input":1,"output":2,"interpolation":"{interpolation}"}}],
            "channels":[{{"sampler":0,"target":{{"node":0,"path":"{path}"}}}}]}}]"#
        ),
    )
}

#[test]
fn nodes_are_where_their_keys_and_curves_say() {
    let keys: &[f32] = &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 4.0, 0.0];
    let linear = moved_by("translation", "LINEAR", ("VEC3", keys));
    for (time, x, y) in [(0.0, 0.0, 0.0), (1.5, 1.0, 0.0), (2.0, 2.0, 0.0), (3.0, 2.0, 2.0), (9.0, 2.0, 4.0)]
    {
        assert_eq!(origin(&linear, time), DVec3::new(x, y, 0.0), "{time}");
    }
    let step = moved_by("translation", "STEP", ("VEC3", keys));
    for (time, x, y) in [(1.9, 0.0, 0.0), (2.0, 2.0, 0.0), (3.9, 2.0, 0.0), (4.0, 2.0, 4.0)] {
        assert_eq!(origin(&step, time), DVec3::new(x, y, 0.0), "{time}");
    }
    // Without tangents a spline starts and ends at rest; a tangent of 1 a second moves it by t³ -
    // 2t² + t of the span.
    let mut spline = [0.0f32; 27];
    (spline[12], spline[21], spline[22], spline[15]) = (2.0, 2.0, 4.0, 1.0);
    let cubic = moved_by("translation", "CUBICSPLINE", ("VEC3", &spline));
    assert_eq!(origin(&cubic, 1.25), DVec3::new(2.0 * 0.15625, 0.0, 0.0));
    assert_eq!(origin(&cubic, 3.0), DVec3::new(2.0 + 2.0 * 0.125, 2.0, 0.0));
}

#[test]
fn rotations_take_the_shorter_arc() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turn = moved_by(
        "rotation",
        "LINEAR",
        ("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -half, -half, 0.0, 0.0, 0.0, 0.0]),
    );
    let scene = read(&turn, &at(1.5));
    let turned = scene.instances[0].transform.transform_vector3(DVec3::X);
    let eighth = std::f64::consts::FRAC_1_SQRT_2;
    assert!(turned.abs_diff_eq(DVec3::new(eighth, eighth, 0.0), 1e-6), "{turned}");
    assert_eq!(scene.instances[0].transform.translation, DVec3::new(7.0, 0.0, 0.0));
    // Between a rotation and one of length 0 there is no arc; nothing panics.
    assert!(read(&turn, &at(3.0)).instances[0].transform.is_finite());
}

#[test]
fn an_animation_is_chosen_by_name_and_otherwise_none() {
    let text = moved_by("translation", "LINEAR", ("VEC3", &[1.0; 9]));
    let rest = read(&text, &ModelOptions::default());
    assert_eq!(rest.instances[0].transform.translation, DVec3::new(7.0, 0.0, 0.0));
    assert!(
        rest.notes[0].ends_with("because no time or animation is chosen; it has \"go\""),
        "{:?}",
        rest.notes
    );
    let named = |name: &str| ModelOptions { animation: Some(name.to_owned()), ..ModelOptions::default() };
    assert_eq!(read(&text, &named("go")).instances[0].transform.translation, DVec3::ONE);
    let message = error(&text, &named("stop"));
    assert!(message.contains("animations: there is no animation \"stop\"; it has \"go\""), "{message}");
    let still = triangle(&format!(r#"{TRIANGLE_MESH},"nodes":[{{"mesh":0}}]"#));
    assert_eq!(read(&still, &at(1.0)).warnings, ["there is no animation: a time has no effect"]);
    assert!(error(&still, &named("go")).contains("it has none"));
}

#[test]
fn animations_with_too_few_values_are_refused() {
    let text = moved_by("translation", "LINEAR", ("VEC3", &[0.0; 6]));
    let message = error(&text, &at(1.0));
    assert!(message.contains("animations[0].channels[0]: it has 3 times and 2 values"), "{message}");
    let text = moved_by("translation", "CUBICSPLINE", ("VEC3", &[0.0; 9]));
    assert!(error(&text, &at(1.0)).contains("3 for CUBICSPLINE"));
    let text = moved_by("translation", "EASE", ("VEC3", &[0.0; 9]));
    assert!(error(&text, &at(1.0)).contains("interpolation is \"EASE\""));
    let text = moved_by("color", "LINEAR", ("VEC3", &[0.0; 9]));
    assert_eq!(
        read(&text, &at(1.0)).warnings,
        ["an animation moves \"color\", which is not supported and ignored"]
    );
}

#[test]
fn morph_targets_are_added_by_their_weights() {
    let target: &[f32] = &[0.0, 0.0, 2.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0];
    let text = |node: &str, rest: &str| {
        with(
            &[("VEC3", target), ("SCALAR", &[0.0, 1.0]), ("SCALAR", &[0.0, 1.0, 0.0, 3.0])],
            &format!(
                r#""nodes":[{{"mesh":0{node}}}],"meshes":[{{"weights":[0.5,0],"primitives":[{{"attributes":{{"POSITION":0}},
                "targets":[{{"POSITION":1}},{{"POSITION":1}}]}}]}}]{rest}"#
            ),
        )
    };
    let z = |scene: &Description| [0, 1, 2].map(|vertex| scene.meshes[0].positions[vertex][2]);
    let at_rest = ModelOptions::default();
    assert_eq!(z(&read(&text("", ""), &at_rest)), [1.0, 2.0, 0.0]);
    assert_eq!(z(&read(&text(r#","weights":[0,0]"#, ""), &at_rest)), [0.0; 3]);
    assert_eq!(z(&read(&text(r#","weights":[1,0.5]"#, ""), &at_rest)), [3.0, 6.0, 0.0]);
    let animation = r#","animations":[{"samplers":[{"input":2,"output":3}],
        "channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}]}]"#;
    assert_eq!(z(&read(&text("", animation), &at(0.5))), [4.0, 8.0, 0.0]);
}

/// Skin of two joints: the vertices' node is moved, which must not matter; `weights` are those of
/// the three vertices for the two joints.
fn skinned(weights: [[f32; 2]; 3], joints: &str, binds: &[f32]) -> String {
    let weights: Vec<f32> = weights.iter().flat_map(|[a, b]| [*a, *b, 0.0, 0.0]).collect();
    let mut data = floats(&TRIANGLE);
    data.extend(floats(&weights));
    data.extend([0, 1, 0, 0].repeat(3));
    data.extend(floats(binds));
    let (length, matrices) = (data.len(), binds.len() / 16);
    document(
        &data,
        &format!(
            r#""bufferViews":[{{"buffer":0,"byteLength":{length}}}],"accessors":[
            {{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
            {{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC4"}},
            {{"bufferView":0,"byteOffset":84,"componentType":5121,"count":3,"type":"VEC4"}},
            {{"bufferView":0,"byteOffset":96,"componentType":5126,"count":{matrices},"type":"MAT4"}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":0,"JOINTS_0":2,"WEIGHTS_0":1}}}}]}}],
            "skins":[{{"joints":{joints},"inverseBindMatrices":3}}],
            "nodes":[{{"mesh":0,"skin":0,"translation":[100,0,0]}},{{"translation":[0,0,1]}},{{"children":[3]}},
            {{"scale":[2,2,2],"translation":[0,0,5]}}]"#
        ),
    )
}

const IDENTITY: [f32; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

#[test]
fn vertices_follow_their_joints_and_not_their_node() {
    let binds = [IDENTITY, IDENTITY].concat();
    let weights = [[1.0, 0.0], [0.0, 1.0], [0.5, 0.5]];
    let scene = read(&skinned(weights, "[1,3]", &binds), &ModelOptions::default());
    assert_eq!(scene.meshes[0].positions, [[0.0, 0.0, 1.0], [2.0, 0.0, 5.0], [0.0, 1.5, 3.0]]);
    assert_eq!(scene.instances[0].transform, glam::DAffine3::IDENTITY);
    // Weights are relative, and a vertex without any stays with its node.
    let scene =
        read(&skinned([[3.0, 0.0], [0.0, 0.5], [0.0, f32::NAN]], "[1,3]", &binds), &ModelOptions::default());
    assert_eq!(scene.meshes[0].positions, [[0.0, 0.0, 1.0], [2.0, 0.0, 5.0], [100.0, 1.0, 0.0]]);
    assert_eq!(
        scene.warnings[0],
        "vertices without weights, moved with the node, not with joints: 1, the first in meshes[0].primitives[0]"
    );
}

#[test]
fn bind_matrices_come_first_and_may_be_singular() {
    let mut moved = IDENTITY;
    moved[12] = 10.0;
    let scene =
        read(&skinned([[0.0, 1.0]; 3], "[1,3]", &[IDENTITY, moved].concat()), &ModelOptions::default());
    assert_eq!(scene.meshes[0].positions, [[20.0, 0.0, 5.0], [22.0, 0.0, 5.0], [20.0, 2.0, 5.0]]);
    // Flattened to a line, no triangle is left; NaN is refused.
    let mut flat = IDENTITY;
    flat[5] = 0.0;
    let scene =
        read(&skinned([[0.0, 1.0]; 3], "[1,3]", &[IDENTITY, flat].concat()), &ModelOptions::default());
    assert!(scene.meshes.is_empty() && scene.instances.is_empty());
    flat[5] = f32::NAN;
    let message =
        error(&skinned([[0.0, 1.0]; 3], "[1,3]", &[IDENTITY, flat].concat()), &ModelOptions::default());
    assert!(message.contains("vertex 0, moved by its skin, at"), "{message}");
}

#[test]
fn joints_that_are_missing_are_named() {
    let scene = read(&skinned([[1.0, 1.0]; 3], "[1]", &IDENTITY), &ModelOptions::default());
    assert_eq!(
        scene.warnings[..1],
        ["weights of joints that the skin does not have, ignored: 3, the first in meshes[0].primitives[0]"]
    );
    let message =
        error(&skinned([[1.0, 0.0]; 3], "[1,9]", &[IDENTITY, IDENTITY].concat()), &ModelOptions::default());
    assert!(message.contains("skins[0].joints: it names nodes[9], and there are 4"), "{message}");
    let message = error(&skinned([[1.0, 0.0]; 3], "[1,2]", &IDENTITY), &ModelOptions::default());
    assert!(message.contains("there are 1 matrices and 2 joints"), "{message}");
}

#[test]
fn instances_of_a_node_are_placed_below_it() {
    let text = with(
        &[
            ("VEC3", &[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]),
            ("VEC3", &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]),
            ("VEC3", &[0.0; 9]),
        ],
        &format!(
            r#"{TRIANGLE_MESH},"extensionsRequired":["EXT_mesh_gpu_instancing"],"nodes":[{{"mesh":0,"scale":[10,10,10],
            "extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1,"SCALE":2}}}}}}}}]"#
        ),
    );
    let scene = read(&text, &ModelOptions::default());
    let place = |at: usize| scene.instances[at].transform.transform_point3(DVec3::X);
    assert_eq!((scene.meshes.len(), place(0), place(1)), (1, DVec3::X * 20.0, DVec3::X * 50.0));
    let message = error(&text.replace(r#""SCALE":2"#, r#""SCALE":3"#), &ModelOptions::default());
    assert!(message.contains("attributes of instances must have the same count"), "{message}");
}

#[test]
fn invisible_nodes_and_those_below_are_left_out() {
    let text = triangle(&format!(
        r#"{TRIANGLE_MESH},"nodes":[{{"mesh":0,"children":[1],"extensions":{{"KHR_node_visibility":{{"visible":false}}}}}},
        {{"mesh":0}},{{"mesh":0,"extensions":{{"KHR_node_visibility":{{}}}}}}]"#
    ));
    assert_eq!(read(&text, &ModelOptions::default()).instances.len(), 1);
}

#[test]
fn variants_change_materials() {
    let text = triangle(
        r#""nodes":[{"mesh":0}],"materials":[{"name":"day"},{"name":"night"}],
        "extensions":{"KHR_materials_variants":{"variants":[{"name":"Day"},{"name":"Night"}]}},
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0,"extensions":{"KHR_materials_variants":
        {"mappings":[{"material":1,"variants":[1]}]}}}]}]"#,
    );
    let variant = |name: &str| ModelOptions { variant: Some(name.to_owned()), ..ModelOptions::default() };
    let name = |options: &ModelOptions| read(&text, options).materials[0].name.clone();
    let plain = ModelOptions::default();
    assert_eq!([name(&plain), name(&variant("Day")), name(&variant("Night"))], ["day", "day", "night"]);
    assert_eq!(
        read(&text, &plain).notes,
        ["drawn without a variant of the materials; it has \"Day\", \"Night\""]
    );
    let message = error(&text, &variant("Dusk"));
    assert!(
        message.contains("there is no variant \"Dusk\" of the materials; it has \"Day\", \"Night\""),
        "{message}"
    );
}

/// A node whose rotation alone is animated keeps its own scale, mirrored or of nothing; one with a
/// matrix keeps the parts of that.
#[test]
fn what_is_not_animated_stays() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turn: Vec<f32> = [0.0, 0.0, half, half].repeat(3);
    let text = moved_by("rotation", "LINEAR", ("VEC4", &turn));
    let with = |own: &str| text.replace(r#""translation":[7,0,0]"#, own);
    let x = |own: &str| read(&with(own), &at(1.5)).instances[0].transform.transform_vector3(DVec3::Y);
    // Y is mirrored, then turned to x.
    assert!(x(r#""scale":[1,-1,1]"#).abs_diff_eq(DVec3::X, 1e-6));
    assert!(x(r#""scale":[1,1,1]"#).abs_diff_eq(-DVec3::X, 1e-6));
    assert!(x(r#""matrix":[1,0,0,0, 0,3,0,0, 0,0,1,0, 0,0,0,1]"#).abs_diff_eq(-3.0 * DVec3::X, 1e-6));
    let hidden = read(&with(r#""scale":[0,0,0]"#), &at(1.5));
    assert_eq!(hidden.warnings, ["instances that are scaled to nothing, left out: 1, the first in nodes[0]"]);
    let flat = read(&with(r#""matrix":[1,0,0,0, 0,0,0,0, 0,0,1,0, 0,0,0,1]"#), &at(1.5));
    assert!(flat.instances.iter().all(|instance| instance.transform.is_finite()));
}

/// Under a mirroring root the triangles of a skinned mesh face where its normals point.
#[test]
fn a_mirrored_skin_is_not_inside_out() {
    let binds = [IDENTITY, IDENTITY].concat();
    let plain = skinned([[1.0, 0.0]; 3], "[1,3]", &binds);
    let mirrored = plain
        .replace(r#""translation":[100,0,0]}"#, r#""scale":[-1,1,1]}"#)
        .replace(r#"{"translation":[0,0,1]}"#, r#"{"scale":[-1,1,1]}"#);
    let face = |text: &str| {
        let mesh = read(text, &ModelOptions::default()).meshes.swap_remove(0);
        let [a, b, c] =
            mesh.triangles[0].map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
        (b - a).cross(c - a)
    };
    assert!(face(&plain).z > 0.0 && face(&mirrored).z > 0.0);
    assert_eq!(face(&mirrored).z, face(&plain).z);
}
