//! Bad models, and scenes with bad files: the error names the file, the place and the remedy.
//! Nothing is written, nothing panics, and little time and memory are used.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use trisect::memory;
use trisect_tests::program::{self, check_failure, trisect, within};

/// Limit of address space for each run; files of 50 MB are read within it.
const MEMORY: u64 = 2 << 30;
/// Limit of time for each run, which takes milliseconds unless files are large.
const TIME: Duration = Duration::from_secs(60);

/// Returns the command's arguments for a file.
fn arguments<'a>(path: &'a Path, image: &'a Path) -> [&'a str; 11] {
    let (path, image) = (path.to_str().unwrap(), image.to_str().unwrap());
    ["render", path, "--backend", "cpu", "--resolution", "8x4", "--spp", "1", "--quiet", "-o", image]
}

/// Checks that rendering is refused as a bad scene, with a message that has each of `words`.
/// Returns the message.
fn refused(path: &Path, words: &[&str]) -> String {
    let image = path.with_extension("out.png");
    let arguments = arguments(path, &image);
    let start = Instant::now();
    let output = within(MEMORY, &arguments);
    assert!(start.elapsed() < TIME, "{arguments:?} took {:?}", start.elapsed());
    check_failure(&output, &arguments, 4, words);
    assert!(!image.exists(), "{arguments:?} left an image");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Checks that rendering succeeds, with each of `words` on standard error. Returns standard error.
fn renders(path: &Path, words: &[&str]) -> String {
    let image = path.with_extension("out.png");
    let arguments = arguments(path, &image);
    let output = trisect(&arguments);
    check_failure(&output, &arguments, 0, words);
    assert!(image.exists());
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Temporary folder of a test, which is removed on drop.
struct Files(PathBuf);

impl Files {
    fn new(test: &str) -> Self {
        Self(program::folder("bad-models", test))
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// Writes a file that must be refused with a message that also names it.
    fn refused(&self, name: &str, bytes: impl AsRef<[u8]>, words: &[&str]) -> String {
        refused(&self.write(name, bytes), &[&[name], words].concat())
    }

    fn renders(&self, name: &str, bytes: impl AsRef<[u8]>, words: &[&str]) -> String {
        renders(&self.write(name, bytes), words)
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Returns a glTF document and its binary data: a mesh of three positions, with `indices` of one
/// byte if there are any. With `uri`, the document holds the data as a data URI; without, the
/// document is one for a GLB file.
fn document(positions: &[f32], indices: &[u8], uri: bool) -> (Value, Vec<u8>) {
    let vertices = floats(positions);
    let data = [&vertices[..], indices].concat();
    let mut document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "buffers": [{ "byteLength": data.len() }],
        "bufferViews": [{ "buffer": 0, "byteLength": vertices.len() }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
    });
    if !indices.is_empty() {
        let view = json!({ "buffer": 0, "byteOffset": vertices.len(), "byteLength": indices.len() });
        document["bufferViews"].as_array_mut().unwrap().push(view);
        let accessor =
            json!({ "bufferView": 1, "componentType": 5121, "count": indices.len(), "type": "SCALAR" });
        document["accessors"].as_array_mut().unwrap().push(accessor);
        document["meshes"][0]["primitives"][0]["indices"] = 1.into();
    }
    if uri {
        let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&data));
        document["buffers"][0]["uri"] = uri.into();
    }
    (document, data)
}

/// Returns a valid glTF file with some members replaced.
fn gltf(changes: Value) -> String {
    let (mut document, _) = document(&TRIANGLE, &[0, 1, 2], true);
    for (key, value) in changes.as_object().unwrap() {
        document[key] = value.clone();
    }
    document.to_string()
}

fn glb(document: &Value, data: &[u8]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], content: &[u8], filler: u8| {
        let mut content = content.to_vec();
        content.resize(content.len().next_multiple_of(4), filler);
        [&(content.len() as u32).to_le_bytes()[..], kind, &content].concat()
    };
    let chunks = [chunk(b"JSON", document.to_string().as_bytes(), b' '), chunk(b"BIN\0", data, 0)].concat();
    [b"glTF", &2u32.to_le_bytes()[..], &(chunks.len() as u32 + 12).to_le_bytes(), &chunks].concat()
}

/// Returns a GLB file with a mesh of `triangles` triangles, of 3 bytes each, that `nodes` nodes
/// share.
fn bomb(triangles: usize, nodes: usize) -> Vec<u8> {
    let (mut document, data) = document(&TRIANGLE, &[0, 1, 2].repeat(triangles), false);
    // A mesh that emits has a copy for each node.
    document["materials"] = json!([{ "emissiveFactor": [1, 1, 1] }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    document["nodes"] =
        (0..nodes).map(|i| json!({ "mesh": 0, "translation": [i, 0, 0] })).collect::<Vec<_>>().into();
    glb(&document, &data)
}

/// Returns the first chunks of a PNG file that states its size and has almost no data.
fn png(width: u32, height: u32) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], content: &[u8]| {
        let checked = [kind, content].concat();
        let step = |crc: u32, byte: &u8| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
                (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 }
            })
        };
        let crc = !checked.iter().fold(!0, step);
        [&(content.len() as u32).to_be_bytes()[..], &checked, &crc.to_be_bytes()].concat()
    };
    let size = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 6, 0, 0, 0]].concat();
    [&b"\x89PNG\r\n\x1a\n"[..], &chunk(b"IHDR", &size), &chunk(b"IDAT", &[0x78, 0x9c, 1])].concat()
}

/// Returns changes for [`gltf`] that texture the triangle with `image`.
fn textured(image: &str) -> Value {
    json!({
        "images": [{ "uri": image }],
        "textures": [{ "source": 0 }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
    })
}

#[test]
fn the_models_that_the_faults_are_planted_in_are_good() {
    let files = Files::new("good");
    files.renders("a.gltf", gltf(json!({})), &[]);
    let (document, data) = document(&TRIANGLE, &[], false);
    files.renders("a.glb", glb(&document, &data), &[]);
    files.renders("few.glb", bomb(10, 10), &[]);
    // Without normals the model is shaded flat; with impossible ones, too, with a warning.
    files.renders("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &[]);
    files.renders("n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nf 1//1 2//1 3//1\n", &["shaded flat"]);
}

#[test]
fn other_files_of_a_model_are_missing_or_none() {
    let files = Files::new("missing");
    let remedy = "it must be at this path";
    let buffers = json!({ "buffers": [{ "byteLength": 39, "uri": "none%20such.bin" }] });
    files.refused("buffer.gltf", gltf(buffers), &["buffers[0]", "none%20such.bin", "No such file", remedy]);
    files.refused("texture.gltf", gltf(textured("none.png")), &["images[0]", "none.png", remedy]);
    files.refused(
        "outside.gltf",
        gltf(textured("/etc/hostname")),
        &["images[0]", "outside the scene's folder"],
    );
    files.refused("web.gltf", gltf(textured("https://a.b/c.png")), &["images[0]", "scheme \"https\""]);
    files.write("text.png", "not a picture");
    files.refused(
        "text.gltf",
        gltf(textured("text.png")),
        &["images[0]", "not an image", "PNG, JPEG, WebP or KTX2"],
    );
    files.write("short.bin", "short");
    let buffers = json!({ "buffers": [{ "byteLength": 39, "uri": "short.bin" }] });
    files.refused("short.gltf", gltf(buffers), &["buffers[0]", "byteLength is 39", "5 bytes", "incomplete"]);
    files.renders(
        "a.obj",
        "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        &["line 1, mtllib", "\"none.mtl\" is missing", "No such file", "diffuse grey"],
    );
    files.write("maps.mtl", "newmtl a\nmap_Kd none.png\n");
    let map = "mtllib maps.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    refused(&files.write("map.obj", map), &["maps.mtl", "line 2, map_Kd", "none.png", remedy]);
    refused(&files.0.join("none.glb"), &["none.glb", "No such file"]);
    refused(&files.0, &["bad-models"]);
}

#[test]
fn a_truncated_glb() {
    let files = Files::new("glb");
    let (document, data) = document(&TRIANGLE, &[], false);
    let file = glb(&document, &data);
    let remedy = "copy or export it again";
    files.refused("empty.glb", "", &["1:"]);
    files.refused("head.glb", &file[..10], &["GLB header", "export the file again"]);
    files.refused("cut.glb", &file[..file.len() - 8], &["GLB header", remedy]);
    // The header's length is right, but the last chunk is longer than the file.
    let mut chunk = file[..file.len() - 8].to_vec();
    let length = (chunk.len() as u32).to_le_bytes();
    chunk[8..12].copy_from_slice(&length);
    files.refused("chunk.glb", &chunk, &["GLB chunk 1", remedy]);
    let mut huge = file.clone();
    huge[12..16].fill(0xff);
    files.refused("huge.glb", &huge, &["GLB chunk 0", remedy]);
    let mut old = file;
    old[4] = 1;
    files.refused(
        "old.glb",
        &old,
        &["GLB header", "this is glTF 1.0", "gltf-pipeline -i old.gltf -o new.glb"],
    );
}

#[test]
fn indices_and_numbers_out_of_range() {
    let files = Files::new("range");
    let (broken, _) = document(&TRIANGLE, &[0, 1, 3], true);
    let place = "meshes[0].primitives[0].indices";
    files.refused("index.gltf", broken.to_string(), &["accessors[1]", place, "is 3", "must be below"]);
    let mesh = json!({ "nodes": [{ "mesh": 7 }] });
    files.refused("mesh.gltf", gltf(mesh), &["nodes[0]", "meshes[7]", "there are 1"]);
    let view = json!({ "accessors": [
        { "bufferView": 0, "componentType": 5126, "count": 4_000_000_000u32, "type": "VEC3" },
        { "bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR" },
    ] });
    files.refused("view.gltf", gltf(view), &["accessors[0]", "4000000000 elements", "must stay within"]);
    for (name, bad) in [("nan", f32::NAN), ("infinite", f32::INFINITY), ("far", 3e38)] {
        let mut positions = TRIANGLE;
        positions[4] = bad;
        let (broken, _) = document(&positions, &[], true);
        let words = ["accessors[0]", "POSITION", "vertex 1", "1e18"];
        files.refused(&format!("{name}.gltf"), broken.to_string(), &words);
    }
    let ply = |y: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n0 0 0\n1 {y} 0\n0 1 0\n3 0 1 2\n"
        )
    };
    files.renders("good.ply", ply("0"), &[]);
    files.refused("nan.ply", ply("nan"), &["vertex 1", "not finite", "must be finite"]);
    files.refused("far.ply", ply("1e15"), &["vertex 1", "at most 1e12"]);
    files.refused("index.ply", ply("0").replace("3 0 1 2", "3 0 1 -1"), &["face 0", "-1", "below"]);
    files.refused("word.ply", ply("zero"), &["\"zero\" is not a number", "numbers only"]);
    for index in ["4", "0", "-4", "4294967297", "9223372036854775807", "-9223372036854775808"] {
        let words = [&format!(".obj:4:7: v {index} does not exist, there are 3")[..], "the first is 1"];
        files.refused("index.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n"), &words);
    }
    for index in ["99999999999999999999", "1.5", "NaN", "1/2/3/"] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n");
        files.refused("word.obj", text, &[".obj:4:7: ", index]);
    }
    files.refused("nan.obj", "v 0 0 0\nv 1 nan 0\n", &[".obj:2:1: ", "not finite", "must be finite"]);
}

#[test]
fn triangles_without_area_are_dropped_and_counted() {
    let files = Files::new("area");
    let (document, _) = document(&TRIANGLE, &[0, 1, 2, 0, 0, 1, 2, 2, 2], true);
    files.renders("a.gltf", document.to_string(), &["without area", "dropped: 2", "meshes[0].primitives[0]"]);
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 2\n";
    files.renders("a.obj", obj, &["without area", "dropped: 1", "fewer than three vertices, dropped: 1"]);
    // The triangle has an area in f64, but none in f32.
    let sliver = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1e-30 0\nf 1 2 3\nf 1 2 4\n";
    files.renders("sliver.obj", sliver, &["1 triangles", "single precision", "dropped"]);
    // Small triangles that are not thin are kept.
    let tiny = "v 0 0 0\nv 1e-30 0 0\nv 0 1e-30 0\nf 1 2 3\n";
    let printed = files.renders("tiny.obj", tiny, &[]);
    assert!(!printed.contains("dropped"), "{printed}");
}

#[test]
fn nodes_that_are_no_trees() {
    let files = Files::new("nodes");
    let nodes = |nodes: Value| gltf(json!({ "nodes": nodes }));
    let cycle = nodes(json!([{ "mesh": 0 }, { "children": [2] }, { "children": [1] }]));
    files.refused("cycle.gltf", cycle, &["nodes[1]", "its own descendant", "must form trees"]);
    files.refused("self.gltf", nodes(json!([{ "children": [0] }])), &["nodes[0]", "must form trees"]);
    let twice = nodes(json!([{ "children": [1, 1] }, { "mesh": 0 }]));
    files.refused("twice.gltf", twice, &["nodes[1]", "must have one parent"]);
    let mut deep: Vec<Value> = (1..=100_000).map(|child| json!({ "children": [child] })).collect();
    deep.push(json!({ "mesh": 0 }));
    files.refused("deep.gltf", nodes(deep.into()), &["nodes[255]", "too deep", "256 levels"]);
    // The JSON itself is nested too deeply.
    let nested = "[".repeat(1_000_000);
    files.refused("json.gltf", &nested, &[".gltf:1:"]);
    files.refused(
        "extras.gltf",
        format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{nested}"),
        &[".gltf:1:"],
    );
}

#[test]
fn images_of_absurd_size() {
    let files = Files::new("image");
    for (name, size) in [("wide", (65535, 65535)), ("most", (0x7fff_ffff, 0x7fff_ffff)), ("long", (1, 16385))]
    {
        files.write(&format!("{name}.png"), png(size.0, size.1));
        files.refused(&format!("{name}.gltf"), gltf(textured(&format!("{name}.png"))), &["images[0]"]);
        let scene = scene(&format!("textures: {{ \"a\": (file: \"{name}.png\") }},"), "");
        refused(&files.write(&format!("{name}.ron"), scene), &[&format!("{name}.png")]);
    }
    refused(&files.0.join("wide.ron"), &["65535 x 65535", "16384 x 16384 texels"]);
    // The largest permitted size, without its data.
    files.write("legal.png", png(16384, 16384));
    files.refused("legal.gltf", gltf(textured("legal.png")), &["images[0]"]);
    for (name, bytes) in [
        ("wide.hdr", &b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n"[..]),
        ("most.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4294967295 +X 4294967295\n"),
        ("short.hdr", b"#?RADIANCE\n"),
        ("wide.pfm", b"PF\n65535 65535\n-1.0\nabc"),
        ("most.pfm", b"PF\n4294967295 4294967295\n-1.0\nabc"),
        ("none.exr", b"\x76\x2f\x31\x01\x02\0\0\0"),
    ] {
        files.write(name, bytes);
        let scene = scene(&format!("sky: Image(file: \"{name}\"),"), "");
        files.refused(&format!("{name}.ron"), scene, &[".ron:4:18: ", name]);
    }
}

#[test]
fn more_than_fits() {
    let files = Files::new("bomb");
    // More triangles than most machines have memory for.
    if memory::available() < 400 << 30 {
        let remedy = "place fewer copies";
        let path = files.write("fit.glb", bomb(1 << 20, 1000));
        refused(&path, &["fit.glb", "memory", remedy]);
        // Many objects of one model.
        std::fs::write(&path, bomb(1 << 20, 1)).unwrap();
        let objects = "Mesh(file: \"fit.glb\"),\n".repeat(1000);
        files.refused(
            "copies.ron",
            scene("", &objects),
            &["copies.ron:", ": the scene's triangles", "fit.glb", "memory", remedy],
        );
    }
    // base64 data with a wrong last character, and data URIs without a comma or with a huge image.
    let mut buffers = "A".repeat(50_000_000);
    let bomb = |content: &str| {
        gltf(json!({ "buffers": [{ "byteLength": 39, "uri": format!("data:;base64,{content}") }] }))
    };
    buffers.push('!');
    files.refused("base64.gltf", bomb(&buffers), &["buffers[0]", "base64 is wrong", "offset 50000000"]);
    files.refused("comma.gltf", bomb("").replace(',', ""), &["1:"]);
    let image = gltf(textured(&format!("data:;base64,{}", STANDARD.encode(png(65535, 65535)))));
    files.refused("image.gltf", image, &["images[0]", "65535 x 65535", "16384"]);
}

#[test]
fn a_ply_file_with_less_than_it_says() {
    let files = Files::new("ply");
    let file = |format: &str, vertices: &str, faces: &str, kind: &str, body: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list {kind} int vertex_indices\nend_header\n{body}"
        )
    };
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let remedy = "copy or export it again";
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let text = file(format, "4000000000", "1", "uchar", body);
        files.refused("vertices.ply", text, &["element vertex", "4000000000", remedy]);
        let text = file(format, "18446744073709551615", "1", "uchar", body);
        files.refused("most.ply", text, &["element vertex", "18446744073709551615", remedy]);
    }
    let text = file("ascii", "3", "4000000000", "uchar", body);
    files.refused("faces.ply", text, &["element face", "4000000000", remedy]);
    let text = file("ascii", "3", "1", "uint", &body.replace("3 0 1 2", "4000000000 0 1 2"));
    files.refused("list.ply", text, &["4000000000 members", "must follow"]);
    files.refused("count.ply", file("ascii", "-1", "1", "uchar", body), &["line 3", "has no count"]);
    let text = file("ascii", "3", "1", "uchar", "0 0 0\n1 0 0\n0 1 0\n3 0 1\n");
    files.refused("end.ply", text, &["less data than the header says", remedy]);
    files.refused("head.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", &["line 4", "end_header"]);
    files.refused("none.ply", "pyl\n", &["line 1", "not a PLY file"]);
}

/// Returns a scene file with these fields and objects.
fn scene(fields: &str, objects: &str) -> String {
    format!(
        "Scene(\nversion: 1, image: (width: 8, height: 4, samples: 1),\n\
         camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),\n{fields}\nmaterials: {{}},\nobjects: [\n{objects}])\n"
    )
}

#[test]
fn a_scene_names_files_that_are_missing_or_none() {
    let files = Files::new("scene");
    let remedy = "docs/reference/scene-format/README.md";
    files.write("good.gltf", gltf(json!({})));
    files.renders("good.ron", scene("", "Mesh(file: \"good.gltf\"),\n"), &[]);
    let mesh = scene("", "Mesh(file: \"none.glb\")");
    files.refused("mesh.ron", mesh, &["mesh.ron:7:12: ", "none.glb", "No such file", remedy]);
    let texture = scene("textures: { \"a\": (file: \"none.png\") },", "");
    files.refused("texture.ron", texture, &["texture.ron:4:25: ", "none.png", "No such file", remedy]);
    let sky = |name: &str| scene(&format!("sky: Image(file: \"{name}\"),"), "");
    let text =
        files.refused("sky.ron", sky("none.hdr"), &["sky.ron:4:18: ", "none.hdr: No such file", remedy]);
    assert_eq!(text.matches("none.hdr: ").count(), 1, "{text}");
    files.refused("kind.ron", sky("a.png"), &["kind.ron:4:18: ", "not a panorama", ".hdr, .exr"]);
    let mesh = scene("", "Mesh(file: \"a.fbx\")");
    files.refused("model.ron", mesh, &["model.ron:7:12: ", "not a model", ".gltf, .glb, .obj, .ply"]);
    files.refused("extension.fbx", "", &["extension.fbx"]);
    let texture = scene("textures: { \"a\": (file: \"good.gltf\") },", "");
    refused(&files.write("image.ron", texture), &["good.gltf", "not an image", "PNG, JPEG, WebP or KTX2"]);
    // An error within a model is placed there.
    files.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    let mesh = scene("", "Mesh(file: \"bad.obj\")");
    refused(&files.write("within.ron", mesh), &["bad.obj:2:5: ", "v 2 does not exist, there are 1"]);
}
