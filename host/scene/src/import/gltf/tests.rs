//! Whole documents: shared helpers, meshes, and files that are not glTF 2.0.

use super::super::testing::{Memory, floats, glb, shorts};
use super::*;
use crate::description::MetallicRoughness;
use crate::import::NoFiles;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

pub const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Returns a document with one buffer of `data`, which bufferViews[0] covers.
pub fn document(data: &[u8], rest: &str) -> String {
    let length = data.len();
    let data = STANDARD.encode(data);
    format!(
        r#"{{"asset":{{"version":"2.0"}},
        "buffers":[{{"byteLength":{length},"uri":"data:application/octet-stream;base64,{data}"}}],{rest}}}"#
    )
}

/// Returns a document that shows mesh 0, of one primitive, at one node; `rest` has accessors and
/// bufferViews.
pub fn mesh(data: &[u8], primitive: &str, rest: &str) -> String {
    let scene = format!(r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{{primitive}}}]}}],{rest}"#);
    document(data, &scene)
}

fn view(length: usize) -> String {
    format!(r#""bufferViews":[{{"buffer":0,"byteLength":{length}}}]"#)
}

/// Returns a document that shows the triangle as often as nodes ask for mesh 0.
pub fn triangle(rest: &str) -> String {
    let scene = format!(
        r#"{},"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],{rest}"#,
        view(36)
    );
    document(&floats(&TRIANGLE), &scene)
}

pub const TRIANGLE_MESH: &str = r#""meshes":[{"name":"t","primitives":[{"attributes":{"POSITION":0}}]}]"#;

pub fn read(text: &str) -> Description {
    parse(text.as_bytes(), "a.gltf", &ModelOptions::default(), &mut NoFiles).unwrap()
}

pub fn error(text: &str) -> String {
    parse(text.as_bytes(), "a.gltf", &ModelOptions::default(), &mut NoFiles).unwrap_err().to_string()
}

#[test]
fn a_triangle_without_anything_has_the_defaults() {
    let scene = read(&triangle(&format!(r#""nodes":[{{"mesh":0}}],{TRIANGLE_MESH}"#)));
    assert_eq!(scene.meshes[0].positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!((&scene.meshes[0].triangles[..], &scene.meshes[0].name[..]), (&[[0, 1, 2]][..], "t"));
    assert!(scene.meshes[0].normals.is_empty() && scene.meshes[0].uvs.is_empty());
    assert_eq!(scene.instances[0].transform, glam::DAffine3::IDENTITY);
    assert_eq!(scene.materials[0].surface, MetallicRoughness::default().into());
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn the_first_buffer_of_a_glb_is_its_chunk() {
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":36}}],{},{TRIANGLE_MESH},"nodes":[{{"mesh":0}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}]}}"#,
        view(36)
    );
    let bytes = floats(&TRIANGLE);
    let scene = parse(&glb(&json, Some(&bytes)), "a.glb", &ModelOptions::default(), &mut NoFiles).unwrap();
    assert_eq!(scene.meshes[0].positions.len(), 3);
    let message = parse(&glb(&json, Some(&bytes[..32])), "a.glb", &ModelOptions::default(), &mut NoFiles)
        .unwrap_err()
        .to_string();
    assert!(message.contains("buffers[0]: byteLength is 36, there are 32 bytes"), "{message}");
    assert!(error(&json).contains("buffers[0]: it has no uri"));
}

#[test]
fn external_files_are_percent_decoded_and_named_if_missing() {
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":36,"uri":"my%20data.bin"}}],{},{TRIANGLE_MESH},
        "nodes":[{{"mesh":0}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}]}}"#,
        view(36)
    );
    let mut files = Memory([("my data.bin", floats(&TRIANGLE))].into());
    assert_eq!(
        parse(json.as_bytes(), "a.gltf", &ModelOptions::default(), &mut files).unwrap().meshes.len(),
        1
    );
    let message = error(&json);
    assert!(message.contains("buffers[0]: cannot read \"my%20data.bin\""), "{message}");
    assert!(error(&json.replace("my%20data.bin", "http://a/b")).contains("URI scheme \"http\""));
}

#[test]
fn indices_strips_and_fans_face_the_same_way() {
    let data = [floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]), shorts(&[0, 1, 2, 3])]
        .concat();
    let rest = r#""bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":8}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
        {"bufferView":1,"componentType":5123,"count":4,"type":"SCALAR"}]"#;
    let triangles = |primitive: &str| read(&mesh(&data, primitive, rest)).meshes[0].triangles.clone();
    let indexed = r#""attributes":{"POSITION":0},"indices":1"#;
    assert_eq!(triangles(&format!(r#"{indexed},"mode":5"#)), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(triangles(&format!(r#"{indexed},"mode":6"#)), [[0, 1, 2], [0, 2, 3]]);
    let scene = read(&mesh(&data, indexed, rest));
    assert_eq!(scene.meshes[0].positions.len(), 3, "the fourth vertex is in no triangle");
    assert_eq!(
        scene.warnings,
        ["vertices after the last whole triangle, ignored: 1, the first in meshes[0].primitives[0]"]
    );
    let scene = read(&mesh(&data, &format!(r#"{indexed},"mode":1"#), rest));
    assert!(scene.meshes.is_empty() && scene.instances.is_empty());
    assert_eq!(scene.warnings, ["lines (mode 1) are not supported and left out"]);
    let message = error(&mesh(
        &data,
        indexed,
        &rest.replace("\"count\":4,\"type\":\"VEC3\"", "\"count\":2,\"type\":\"VEC3\""),
    ));
    assert!(
        message.contains(
            "accessors[1] (meshes[0].primitives[0].indices): element 2 is 2, and there are 2 vertices"
        ),
        "{message}"
    );
}

#[test]
fn interleaved_and_quantised_attributes() {
    // Position as i16 and two bytes of padding, normal as i8, uv as normalized u16: 16 bytes a
    // vertex.
    let vertex = |x: i16, y: i16, uv: [u16; 2]| {
        let mut bytes: Vec<u8> = [x, y, 0, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
        bytes.extend([0, 0, 127, 0]);
        bytes.extend(shorts(&uv));
        bytes
    };
    let data = [vertex(-5, 0, [0, 0]), vertex(300, 0, [65535, 0]), vertex(0, 7, [0, 13107])].concat();
    let rest = r#""extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"],
        "bufferViews":[{"buffer":0,"byteLength":48,"byteStride":16}],
        "accessors":[{"bufferView":0,"componentType":5122,"count":3,"type":"VEC3"},
        {"bufferView":0,"byteOffset":8,"componentType":5120,"normalized":true,"count":3,"type":"VEC3"},
        {"bufferView":0,"byteOffset":12,"componentType":5123,"normalized":true,"count":3,"type":"VEC2"}]"#;
    let primitive = r#""attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}"#;
    let scene = read(&mesh(&data, primitive, rest));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, [[-5.0, 0.0, 0.0], [300.0, 0.0, 0.0], [0.0, 7.0, 0.0]]);
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(mesh.uvs, [[0.0, 0.0], [1.0, 0.0], [0.0, 0.2]]);
}

#[test]
fn sparse_accessors_replace_elements() {
    let data = [floats(&TRIANGLE), shorts(&[1]), vec![0; 2], floats(&[9.0, 0.0, 0.0])].concat();
    let rest = r#""bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":2},
        {"buffer":0,"byteOffset":40,"byteLength":12}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,
        "indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":2}}}]"#;
    let primitive = r#""attributes":{"POSITION":0}"#;
    let positions = &read(&mesh(&data, primitive, rest)).meshes[0].positions;
    assert_eq!(positions, &[[0.0; 3], [9.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let mut far = data.clone();
    far[36] = 3;
    let message = error(&mesh(&far, primitive, rest));
    assert!(message.contains("accessors[0].sparse: index 0 is 3"), "{message}");
}

#[test]
fn wrong_accessors_are_errors_that_name_them() {
    let primitive = r#""attributes":{"POSITION":0}"#;
    let accessor = r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}"#;
    let message = |accessor: &str, values: &[f32]| {
        let rest = format!(r#"{},"accessors":[{accessor}]"#, view(4 * values.len()));
        error(&mesh(&floats(values), primitive, &rest))
    };
    for (from, to, expected) in [
        (
            "\"count\":3",
            "\"count\":4",
            "accessors[0]: 4 elements of 12 bytes, 12 apart, from byte 0 reach beyond",
        ),
        (
            "\"count\":3",
            "\"count\":3,\"byteOffset\":18446744073709551615",
            "reach beyond bufferViews[0] of 36",
        ),
        ("\"bufferView\":0", "\"bufferView\":7", "accessors[0]: it names bufferViews[7], and there are 1"),
        (
            "VEC3",
            "VEC2",
            "accessors[0]: it is VEC2 of componentType 5126; meshes[0].primitives[0].attributes.POSITION takes VEC3",
        ),
        ("5126", "5125", "accessors[0]: it is VEC3 of componentType 5125"),
        ("\"bufferView\":0,", "", "meshes without triangles"),
    ] {
        let changed = accessor.replace(from, to);
        let found = if to.is_empty() {
            // Without a view, all elements are 0.
            read(&mesh(&[], primitive, &format!(r#""accessors":[{changed}]"#))).warnings.join("\n")
        } else {
            message(&changed, &TRIANGLE)
        };
        assert!(found.contains(expected), "{found}");
    }
    let mut bad = TRIANGLE;
    for (value, expected) in
        [(f32::NAN, "is not finite"), (f32::INFINITY, "is not finite"), (2e18, "is beyond 1e18")]
    {
        bad[4] = value;
        let found = message(accessor, &bad);
        assert!(
            found.contains("accessors[0] (meshes[0].primitives[0].attributes.POSITION): vertex 1 at"),
            "{found}"
        );
        assert!(found.contains(expected), "{found}");
    }
    let count = "\"count\":4000000000";
    let huge = accessor.replace("\"bufferView\":0,", "").replace("\"count\":3", count);
    assert!(message(&huge, &TRIANGLE).contains("the scene needs too much memory for the size of its files"));
}

#[test]
fn what_is_no_gltf_says_where() {
    assert!(
        error("{\"asset\":\n{\"version\":2}}")
            .contains("a.gltf:2:12: invalid type: integer `2`, expected a string")
    );
    assert!(error("").contains("a.gltf:1:0"));
    assert!(error("{}").contains("missing field `asset`"));
    assert!(
        error(r#"{"asset":{"version":"3.0"}}"#)
            .contains("asset.version: glTF version \"3.0\" is not supported")
    );
    let first =
        "a.gltf: asset.version: this is glTF 1.0; convert it with `gltf-pipeline -i old.gltf -o new.glb`";
    assert_eq!(error(r#"{"asset":{"version":"1.0"}}"#), first);
    // In glTF 1.0 lists are objects, and the asset is optional.
    assert_eq!(error(r#"{"nodes":{"n":{"meshes":["m"]}},"scene":"s"}"#), first);
    let many = format!(r#"{{"asset":{{"version":"2.0"}},"materials":[{}{{}}]}}"#, "{},".repeat(1 << 16));
    assert!(error(&many).contains("a list of more than 65536 members"));
    let message = parse(b"{\xff", "a", &ModelOptions::default(), &mut NoFiles).unwrap_err().to_string();
    assert!(message.contains("byte 1 of the JSON: it is not UTF-8"));
}

#[test]
fn many_instances_of_many_parts_are_refused() {
    let primitives = r#"{"attributes":{"POSITION":0}},"#.repeat(2000);
    let nodes = r#"{"mesh":0},"#.repeat(2000);
    let text = triangle(&format!(
        r#""meshes":[{{"primitives":[{}]}}],"nodes":[{}]"#,
        primitives.trim_end_matches(','),
        nodes.trim_end_matches(',')
    ));
    assert!(error(&text).contains("the scene needs too much memory for the size of its files"));
}

/// Returns the triangle in a primitive with `extensions`; without a view in `accessor`, it has no
/// data of its own.
fn compressed(accessor: &str, extensions: &str) -> String {
    let primitive = format!(r#""attributes":{{"POSITION":0}},"extensions":{{{extensions}}}"#);
    let rest =
        format!(r#"{},"accessors":[{{{accessor}"componentType":5126,"count":3,"type":"VEC3"}}]"#, view(36));
    mesh(&floats(&TRIANGLE), &primitive, &rest)
}

#[test]
fn data_beside_compressed_data_is_preferred() {
    const DRACO: &str = r#""KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}"#;
    let message = error(&compressed("", DRACO));
    let want = "a.gltf: meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: its Draco data cannot be decoded";
    assert!(message.starts_with(want), "{message}");
    assert_eq!(read(&compressed(r#""bufferView":0,"#, DRACO)).meshes.len(), 1);
    // Without the extension, elements without data are 0: the mesh has no triangles.
    assert!(read(&compressed("", "")).meshes.is_empty());
}

#[test]
fn required_extensions_that_are_missing_are_refused() {
    let required = |extension: &str| {
        let used = format!(r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["{extension}"]}}"#);
        error(&used)
    };
    for (extension, remedy) in
        [("EXT_texture_avif", "PNG or JPEG"), ("EXT_other", "export the file without it")]
    {
        let message = required(extension);
        assert!(message.contains(extension) && message.contains(remedy), "{message}");
    }
    let buffer =
        r#""buffers":[{"byteLength":36,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}]"#;
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},{buffer},"bufferViews":[{{"buffer":0,"byteLength":36}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],{TRIANGLE_MESH},"nodes":[{{"mesh":0}}]}}"#
    );
    let message = error(&text);
    assert!(
        message.contains("bufferViews[0]: buffers[0] has no data but that of compressed views"),
        "{message}"
    );
}

#[test]
fn textures_of_other_formats_are_named() {
    let textured = |texture: &str, images: &str| {
        let primitive = r#""attributes":{"POSITION":0},"material":0"#;
        let rest = format!(
            r#"{},"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "textures":[{{{texture}}}],"images":[{images}]"#,
            view(36)
        );
        mesh(&floats(&TRIANGLE), primitive, &rest)
    };
    let warnings = read(&textured("", "")).warnings.join("\n");
    assert!(warnings.contains("textures without an image, ignored: 1"), "{warnings}");
    // The core format's image first, because others lose more.
    let both = r#""source":0,"extensions":{"EXT_texture_webp":{"source":9}}"#;
    assert!(error(&textured(both, "{}")).contains("images[0]"));
    let webp = r#""extensions":{"EXT_texture_webp":{"source":1},"KHR_texture_basisu":{"source":2}}"#;
    assert!(error(&textured(webp, "{},{},{}")).contains("images[1]"));
    assert!(error(&textured(&webp.replace("webp", "avif"), "{},{},{}")).contains("images[2]"));
    let ktx2 = STANDARD.encode(b"\xabKTX 11\xbb\r\n\x1a\n\0\0\0\0");
    let message = error(&textured(r#""source":0"#, &format!(r#"{{"uri":"data:image/ktx2;base64,{ktx2}"}}"#)));
    assert!(message.contains("images[0]: KTX, the format of this image, is not supported"), "{message}");
}
