//! Writes a glTF 2.0 scene with each feature that the reader supports, twice: as `features.gltf`
//! with the files `features.bin` and `features_tiles.png`, and as `features.glb`.
//!
//! ```text
//! cargo generate-scene features_gltf scenes/gltf
//! ```

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat3, DMat4, DQuat, DVec3, Vec2, Vec3, dvec3, vec2, vec3};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use serde_json::{Value, json};
use std::error::Error;
use std::f64::consts::{FRAC_PI_4, PI, TAU};
use std::path::Path;

const U8: u32 = 5121;
const I8: u32 = 5120;
const U16: u32 = 5123;
const I16: u32 = 5122;
const U32: u32 = 5125;
const F32: u32 = 5126;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

const NEAREST: u32 = 9728;
const LINEAR: u32 = 9729;
const CLAMP: u32 = 33071;
const MIRROR: u32 = 33648;
const REPEAT: u32 = 10497;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: features_gltf FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;

    let (mut json, bin) = scene(true)?;
    json["buffers"] = json!([{ "byteLength": bin.len(), "uri": "features.bin" }]);
    std::fs::write(folder.join("features.gltf"), serde_json::to_string_pretty(&json)? + "\n")?;
    std::fs::write(folder.join("features.bin"), bin)?;
    std::fs::write(folder.join("features_tiles.png"), tiles()?)?;

    let (mut json, bin) = scene(false)?;
    json["buffers"] = json!([{ "byteLength": bin.len() }]);
    std::fs::write(folder.join("features.glb"), glb(serde_json::to_string(&json)?.into_bytes(), bin))?;
    Ok(())
}

/// Returns a GLB file: a header, a chunk of text and a chunk of data, each a multiple of four bytes
/// long.
fn glb(mut text: Vec<u8>, mut data: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    let length = 12 + 8 + text.len() + 8 + data.len();
    bytes.extend([2, length as u32].map(u32::to_le_bytes).concat());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", data)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// Binary buffer under construction, with the views and accessors into it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds a view with `bytes`, and with the fields of `extra`. Returns its index.
    fn view(&mut self, bytes: &[u8], extra: Value) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.views.push(with(view, extra));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn positions(&mut self, points: &[Vec3]) -> usize {
        let view =
            self.view(&floats(points.iter().flat_map(|p| p.to_array())), json!({ "target": VERTICES }));
        self.accessor(with(
            json!({ "bufferView": view, "componentType": F32, "count": points.len(), "type": "VEC3" }),
            bounds(points),
        ))
    }

    fn vec3(&mut self, values: &[Vec3]) -> usize {
        let view =
            self.view(&floats(values.iter().flat_map(|p| p.to_array())), json!({ "target": VERTICES }));
        self.accessor(
            json!({ "bufferView": view, "componentType": F32, "count": values.len(), "type": "VEC3" }),
        )
    }

    fn vec2(&mut self, values: &[Vec2]) -> usize {
        let view =
            self.view(&floats(values.iter().flat_map(|p| p.to_array())), json!({ "target": VERTICES }));
        self.accessor(
            json!({ "bufferView": view, "componentType": F32, "count": values.len(), "type": "VEC2" }),
        )
    }

    fn indices(&mut self, indices: &[u32], component: u32) -> usize {
        let bytes: Vec<u8> = match component {
            U8 => indices.iter().map(|i| *i as u8).collect(),
            U16 => indices.iter().flat_map(|i| (*i as u16).to_le_bytes()).collect(),
            _ => indices.iter().flat_map(|i| i.to_le_bytes()).collect(),
        };
        let view = self.view(&bytes, json!({ "target": INDICES }));
        self.accessor(
            json!({ "bufferView": view, "componentType": component, "count": indices.len(), "type": "SCALAR" }),
        )
    }

    fn png(&mut self, png: &[u8]) -> Value {
        json!({ "bufferView": self.view(png, json!({})), "mimeType": "image/png" })
    }
}

fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

fn bounds(points: &[Vec3]) -> Value {
    let low = points.iter().copied().fold(Vec3::MAX, Vec3::min);
    let high = points.iter().copied().fold(Vec3::MIN, Vec3::max);
    json!({ "min": low.to_array(), "max": high.to_array() })
}

/// Returns an object with the fields of both.
fn with(mut object: Value, extra: Value) -> Value {
    if let (Value::Object(fields), Value::Object(extra)) = (&mut object, extra) {
        fields.extend(extra);
    }
    object
}

/// Returns the glTF JSON without its buffers, and the buffer's bytes. With `files`, one image is in
/// its own file and one is a data URI; the others are in the buffer.
fn scene(files: bool) -> Result<(Value, Vec<u8>), Box<dyn Error>> {
    let mut buffer = Buffer::default();

    let tiles_image = if files { json!({ "uri": "features_tiles.png" }) } else { buffer.png(&tiles()?) };
    let glow_image = if files {
        json!({ "uri": format!("data:image/png;base64,{}", STANDARD.encode(glow()?)) })
    } else {
        buffer.png(&glow()?)
    };
    let images = json!([
        with(tiles_image, json!({ "name": "tiles, sRGB" })),
        with(glow_image, json!({ "name": "glow, sRGB" })),
        with(buffer.png(&leaf()?), json!({ "name": "leaf, sRGB and alpha" })),
        with(buffer.png(&steps()?), json!({ "name": "roughness in green, metallic in blue, linear" })),
        with(buffer.png(&stripes()?), json!({ "name": "transmission in red, linear" })),
    ]);
    let samplers = json!([
        { "magFilter": LINEAR, "minFilter": LINEAR, "wrapS": REPEAT, "wrapT": REPEAT },
        { "magFilter": NEAREST, "minFilter": NEAREST, "wrapS": MIRROR, "wrapT": MIRROR },
        { "magFilter": NEAREST, "minFilter": NEAREST, "wrapS": CLAMP, "wrapT": CLAMP },
        { "magFilter": NEAREST, "minFilter": NEAREST, "wrapS": REPEAT, "wrapT": MIRROR },
    ]);
    let textures = json!([
        { "source": 0, "sampler": 0, "name": "tiles, repeated, linear" },
        { "source": 0, "sampler": 1, "name": "tiles, mirrored, nearest" },
        { "source": 0, "sampler": 2, "name": "tiles, clamped, nearest" },
        { "source": 0, "sampler": 3, "name": "tiles, repeated across and mirrored down" },
        { "source": 1, "sampler": 2, "name": "glow" },
        { "source": 2, "name": "leaf, default sampler" },
        { "source": 3, "sampler": 2, "name": "steps" },
        { "source": 4, "sampler": 0, "name": "stripes" },
    ]);

    let diffuse = |texture: usize| json!({ "baseColorTexture": { "index": texture }, "metallicFactor": 0, "roughnessFactor": 1 });
    let materials = json!([
        {
            "name": "0 ground: texture transform",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.8, 0.8, 0.8, 1],
                "baseColorTexture": {
                    "index": 3,
                    "extensions": { "KHR_texture_transform": { "offset": [0.25, -0.1], "rotation": 0.4, "scale": [6, 4] } },
                },
                "metallicFactor": 0,
                "roughnessFactor": 0.9,
            },
        },
        { "name": "1 repeat", "pbrMetallicRoughness": diffuse(0), "doubleSided": true },
        { "name": "2 mirror", "pbrMetallicRoughness": diffuse(1), "doubleSided": true },
        { "name": "3 clamp", "pbrMetallicRoughness": diffuse(2), "doubleSided": true },
        {
            "name": "4 leaf: alpha mask",
            "pbrMetallicRoughness": diffuse(5),
            "alphaMode": "MASK",
            "alphaCutoff": 0.4,
            "doubleSided": true,
        },
        {
            "name": "5 lamp: emissive strength",
            "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0 },
            "emissiveFactor": [1, 0.9, 0.7],
            "emissiveTexture": { "index": 4 },
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } },
        },
        {
            "name": "6 metal: roughness and metallic by texture",
            "pbrMetallicRoughness": { "baseColorFactor": [0.95, 0.7, 0.4, 1], "metallicRoughnessTexture": { "index": 6 } },
        },
        {
            "name": "7 film: transmission and ior",
            "pbrMetallicRoughness": { "baseColorFactor": [0.7, 0.9, 1, 1], "metallicFactor": 0, "roughnessFactor": 0.05 },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_ior": { "ior": 1.33 } },
        },
        {
            "name": "8 striped film: transmission by texture",
            "pbrMetallicRoughness": { "baseColorFactor": [1, 0.6, 0.6, 1], "metallicFactor": 0, "roughnessFactor": 0.3 },
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 0.9, "transmissionTexture": { "index": 7 } },
                "KHR_materials_ior": { "ior": 1.8 },
            },
        },
        {
            "name": "9 red plastic",
            "pbrMetallicRoughness": { "baseColorFactor": [0.6, 0.06, 0.05, 1], "metallicFactor": 0, "roughnessFactor": 0.25 },
        },
        {
            "name": "10 blue plastic",
            "pbrMetallicRoughness": { "baseColorFactor": [0.05, 0.12, 0.6, 1], "metallicFactor": 0, "roughnessFactor": 0.5 },
        },
        {
            "name": "11 green metal, roughness factor only",
            "pbrMetallicRoughness": { "baseColorFactor": [0.3, 0.7, 0.35, 1], "roughnessFactor": 0.35 },
        },
    ]);

    let mut meshes = json!([
        ground(&mut buffer),
        panel(&mut buffer, "1 repeat", 1, -1.0, 2.0),
        panel(&mut buffer, "2 mirror", 2, -1.0, 2.0),
        panel(&mut buffer, "3 clamp", 3, -1.0, 2.0),
        panel(&mut buffer, "4 leaf", 4, 0.0, 1.0),
        lamp(&mut buffer),
        { "name": "6 ball, u16 indices", "primitives": [ball(&mut buffer, 6)] },
        cube(&mut buffer),
        quantized_ball(&mut buffer),
        quantized_pyramid(&mut buffer),
        sparse_grid(&mut buffer),
        sparse_triangle(&mut buffer),
    ]);
    // Two more meshes share the ball's vertices.
    let ball = meshes[6]["primitives"][0].clone();
    for (name, material) in [("12 film ball", 7), ("13 striped film ball", 8)] {
        let primitive = with(ball.clone(), json!({ "material": material }));
        if let Value::Array(meshes) = &mut meshes {
            meshes.push(json!({ "name": name, "primitives": [primitive] }));
        }
    }

    let quarter = DQuat::from_rotation_y(FRAC_PI_4);
    // Mirrors x, which turns triangles inside out unless the reader heeds the determinant.
    let mirrored = DMat4::from_translation(dvec3(2.6, 0.35, 1.9))
        * DMat4::from_rotation_y(0.5)
        * DMat4::from_scale(dvec3(-0.35, 0.35, 0.2));
    let nodes = json!([
        { "name": "0 root", "children": [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 19, 20, 21, 22, 24] },
        { "name": "1 ground", "mesh": 0 },
        { "name": "2 repeat", "mesh": 1, "translation": [-2.6, 1.1, -2], "scale": [0.9, 0.9, 1] },
        { "name": "3 mirror", "mesh": 2, "translation": [-0.6, 1.1, -2], "scale": [0.9, 0.9, 1] },
        { "name": "4 clamp", "mesh": 3, "translation": [1.4, 1.1, -2], "scale": [0.9, 0.9, 1] },
        { "name": "5 leaf", "mesh": 4, "translation": [3.2, 0.9, -1.4], "rotation": quaternion(DQuat::from_rotation_y(-0.5)), "scale": [0.8, 0.8, 1] },
        { "name": "6 lamp", "mesh": 5, "translation": [0, 3.2, 0.5] },
        { "name": "7 ball", "mesh": 6, "translation": [-2.4, 0.5, 0], "scale": [0.5, 0.5, 0.5] },
        { "name": "8 film ball", "mesh": 12, "translation": [-1.1, 0.5, 0.4], "scale": [0.5, 0.5, 0.5] },
        { "name": "9 striped film ball", "mesh": 13, "translation": [0.2, 0.5, 0.2], "scale": [0.5, 0.5, 0.5] },
        { "name": "10 quantized ball", "mesh": 8, "translation": [1.5, 0.5, 0.1], "scale": [0.5, 0.5, 0.5] },
        { "name": "11 quantized pyramid", "mesh": 9, "translation": [2.2, 0, 0], "scale": [0.01, 0.01, 0.01] },
        { "name": "12 mirrored by its matrix", "mesh": 7, "matrix": mirrored.as_mat4().to_cols_array() },
        { "name": "13 sparse grid", "mesh": 10, "translation": [-1.9, 0.02, 1.7], "rotation": quaternion(quarter) },
        { "name": "14 sparse triangle", "mesh": 11, "translation": [0.9, 0.02, 1.9] },
        // A chain of nodes: each rotates and moves its children; the last but one is scaled
        // unevenly.
        { "name": "15 shoulder", "translation": [-3.4, 0.3, 1], "rotation": quaternion(quarter), "children": [16] },
        { "name": "16 arm", "mesh": 7, "scale": [0.25, 0.3, 0.25], "children": [17] },
        { "name": "17 elbow", "translation": [0, 1.6, 0], "rotation": quaternion(DQuat::from_rotation_z(-0.6)), "scale": [0.7, 0.9, 0.7], "children": [18] },
        { "name": "18 hand", "mesh": 7, "translation": [0, 0.8, 0] },
        // Lights shine along their -z.
        { "name": "19 point", "translation": [-3, 2.5, 2], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "name": "20 spot", "translation": [2.5, 3, 2.5], "rotation": quaternion(facing(dvec3(-1.3, -2.6, -2.4))), "extensions": { "KHR_lights_punctual": { "light": 1 } } },
        { "name": "21 directional", "rotation": quaternion(facing(dvec3(-0.6, -1.0, -0.8))), "extensions": { "KHR_lights_punctual": { "light": 2 } } },
        { "name": "22 main camera", "camera": 0, "translation": [0.2, 2.6, 7.2], "rotation": quaternion(facing(dvec3(0.0, -1.9, -7.2))) },
        { "name": "23 side camera", "camera": 1, "rotation": quaternion(facing(dvec3(-1.0, 0.0, 0.0))) },
        { "name": "24 camera's arm", "translation": [7, 1.5, 0.5], "children": [23] },
    ]);

    let scene = json!({
        "asset": {
            "version": "2.0",
            "generator": "example features_gltf of Trisect",
            "copyright": "made for this project; CC0-1.0",
        },
        "extensionsUsed": [
            "KHR_texture_transform",
            "KHR_materials_emissive_strength",
            "KHR_materials_transmission",
            "KHR_materials_ior",
            "KHR_lights_punctual",
            "KHR_mesh_quantization",
        ],
        "extensionsRequired": ["KHR_mesh_quantization"],
        "extensions": {
            "KHR_lights_punctual": {
                "lights": [
                    { "name": "point", "type": "point", "color": [1, 0.8, 0.6], "intensity": 5 },
                    {
                        "name": "spot", "type": "spot", "color": [0.6, 0.8, 1], "intensity": 20,
                        "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.35 },
                    },
                    { "name": "directional", "type": "directional", "intensity": 0.8 },
                ],
            },
        },
        "scene": 0,
        "scenes": [{ "name": "features", "nodes": [0] }],
        "nodes": nodes,
        "cameras": [
            { "name": "main", "type": "perspective", "perspective": { "yfov": 0.6, "aspectRatio": 1.6, "znear": 0.1, "zfar": 100 } },
            { "name": "side", "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } },
        ],
        "meshes": meshes,
        "materials": materials,
        "textures": textures,
        "images": images,
        "samplers": samplers,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
    });
    Ok((scene, buffer.bytes))
}

fn quaternion(rotation: DQuat) -> Value {
    json!(rotation.as_quat().to_array())
}

/// Returns the rotation that turns -z to `direction`, with +y as far up as possible.
fn facing(direction: DVec3) -> DQuat {
    let back = -direction.normalize();
    let right = DVec3::Y.cross(back).normalize();
    DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back))
}

/// Returns a primitive with separate attributes.
fn primitive(positions: usize, normals: usize, uvs: usize, indices: usize, material: usize) -> Value {
    json!({
        "attributes": { "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs },
        "indices": indices,
        "material": material,
        "mode": 4,
    })
}

fn ground(buffer: &mut Buffer) -> Value {
    let corners = [vec3(-6.0, 0.0, 6.0), vec3(6.0, 0.0, 6.0), vec3(6.0, 0.0, -6.0), vec3(-6.0, 0.0, -6.0)];
    let positions = buffer.positions(&corners);
    let normals = buffer.vec3(&[Vec3::Y; 4]);
    let uvs = buffer.vec2(&[vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(1.0, 0.0), vec2(0.0, 0.0)]);
    let indices = buffer.indices(&[0, 1, 2, 0, 2, 3], U16);
    json!({ "name": "0 ground", "primitives": [primitive(positions, normals, uvs, indices, 0)] })
}

/// Returns a square from -1 to 1 that faces +z, with texture coordinates from `low` to `high`.
fn panel(buffer: &mut Buffer, name: &str, material: usize, low: f32, high: f32) -> Value {
    let corners = [vec3(-1.0, -1.0, 0.0), vec3(1.0, -1.0, 0.0), vec3(1.0, 1.0, 0.0), vec3(-1.0, 1.0, 0.0)];
    let positions = buffer.positions(&corners);
    let normals = buffer.vec3(&[Vec3::Z; 4]);
    let uvs = buffer.vec2(&[vec2(low, high), vec2(high, high), vec2(high, low), vec2(low, low)]);
    let indices = buffer.indices(&[0, 1, 2, 0, 2, 3], U16);
    json!({ "name": name, "primitives": [primitive(positions, normals, uvs, indices, material)] })
}

/// Returns a rectangle that faces down, without indices or normals.
fn lamp(buffer: &mut Buffer) -> Value {
    let [a, b, c, d] =
        [vec3(-1.0, 0.0, -0.6), vec3(1.0, 0.0, -0.6), vec3(1.0, 0.0, 0.6), vec3(-1.0, 0.0, 0.6)];
    let [ua, ub, uc, ud] = [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 1.0)];
    let positions = buffer.positions(&[a, b, c, a, c, d]);
    let uvs = buffer.vec2(&[ua, ub, uc, ua, uc, ud]);
    json!({
        "name": "5 lamp without indices and normals",
        "primitives": [{ "attributes": { "POSITION": positions, "TEXCOORD_0": uvs }, "material": 5 }],
    })
}

/// Returns points of the unit sphere by latitude and longitude, with texture coordinates and
/// triangles.
fn ball_points(rows: u32, columns: u32) -> (Vec<Vec3>, Vec<Vec2>, Vec<u32>) {
    let (mut points, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..=rows {
        for j in 0..=columns {
            let (v, u) = (f64::from(i) / f64::from(rows), f64::from(j) / f64::from(columns));
            let (theta, phi) = (PI * v, TAU * u);
            points.push(dvec3(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()).as_vec3());
            uvs.push(vec2(u as f32, v as f32));
        }
    }
    for i in 0..rows {
        for j in 0..columns {
            let a = i * (columns + 1) + j;
            let (b, c, d) = (a + columns + 1, a + columns + 2, a + 1);
            if i > 0 {
                indices.extend([a, c, d]);
            }
            if i + 1 < rows {
                indices.extend([a, b, c]);
            }
        }
    }
    (points, uvs, indices)
}

fn ball(buffer: &mut Buffer, material: usize) -> Value {
    let (points, uvs, indices) = ball_points(24, 48);
    let positions = buffer.positions(&points);
    let normals = buffer.vec3(&points);
    let uvs = buffer.vec2(&uvs);
    let indices = buffer.indices(&indices, U16);
    primitive(positions, normals, uvs, indices, material)
}

/// Returns a cube with interleaved attributes in one view, u8 indices, and two primitives: sides,
/// and top and bottom.
fn cube(buffer: &mut Buffer) -> Value {
    let mut points = Vec::new();
    let mut bytes = Vec::new();
    for axis in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_Y] {
        let u = if axis.y == 0.0 { Vec3::Y.cross(axis) } else { Vec3::X };
        let v = axis.cross(u);
        for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let point = axis + u * a + v * b;
            points.push(point);
            let uv = [(a + 1.0) / 2.0, (1.0 - b) / 2.0];
            bytes.extend(floats(point.to_array().into_iter().chain(axis.to_array()).chain(uv)));
        }
    }
    let view = buffer.view(&bytes, json!({ "byteStride": 32, "target": VERTICES }));
    let base = json!({ "bufferView": view, "componentType": F32, "count": 24 });
    let positions = buffer.accessor(with(with(base.clone(), json!({ "type": "VEC3" })), bounds(&points)));
    let normals = buffer.accessor(with(base.clone(), json!({ "type": "VEC3", "byteOffset": 12 })));
    let uvs = buffer.accessor(with(base, json!({ "type": "VEC2", "byteOffset": 24 })));
    let faces: Vec<u32> = (0..6).flat_map(|f| [0, 1, 2, 0, 2, 3].map(|i| 4 * f + i)).collect();
    let view = buffer.view(&faces.iter().map(|i| *i as u8).collect::<Vec<_>>(), json!({ "target": INDICES }));
    let base = json!({ "bufferView": view, "componentType": U8, "type": "SCALAR" });
    let sides = buffer.accessor(with(base.clone(), json!({ "count": 24 })));
    let ends = buffer.accessor(with(base, json!({ "count": 12, "byteOffset": 24 })));
    json!({
        "name": "7 cube, interleaved, u8 indices, two materials",
        "primitives": [primitive(positions, normals, uvs, sides, 10), primitive(positions, normals, uvs, ends, 9)],
    })
}

/// Returns a ball with KHR_mesh_quantization: positions i16 and normals i8, both normalized,
/// texture coordinates u16; u32 indices.
fn quantized_ball(buffer: &mut Buffer) -> Value {
    let (points, uvs, indices) = ball_points(20, 40);
    let mut bytes = Vec::new();
    let (mut low, mut high) = ([i16::MAX; 3], [i16::MIN; 3]);
    for (point, uv) in points.iter().zip(&uvs) {
        let position = point.to_array().map(|c| (c * 32767.0).round() as i16);
        for axis in 0..3 {
            low[axis] = low[axis].min(position[axis]);
            high[axis] = high[axis].max(position[axis]);
        }
        bytes.extend(position.iter().flat_map(|c| c.to_le_bytes()));
        bytes.extend([0, 0]); // each attribute starts at a multiple of 4
        bytes.extend(point.to_array().map(|c| (c * 127.0).round() as i8 as u8));
        bytes.push(0);
        bytes.extend(uv.to_array().iter().flat_map(|c| ((c * 65535.0).round() as u16).to_le_bytes()));
    }
    let view = buffer.view(&bytes, json!({ "byteStride": 16, "target": VERTICES }));
    let base = json!({ "bufferView": view, "count": points.len(), "normalized": true });
    let position = json!({ "componentType": I16, "type": "VEC3", "min": low, "max": high });
    let positions = buffer.accessor(with(base.clone(), position));
    let normals =
        buffer.accessor(with(base.clone(), json!({ "componentType": I8, "type": "VEC3", "byteOffset": 8 })));
    let uvs = buffer.accessor(with(base, json!({ "componentType": U16, "type": "VEC2", "byteOffset": 12 })));
    let indices = buffer.indices(&indices, U32);
    json!({ "name": "8 ball, quantized, u32 indices", "primitives": [primitive(positions, normals, uvs, indices, 11)] })
}

/// Returns a pyramid with KHR_mesh_quantization: positions u8, not normalized; no normals.
fn quantized_pyramid(buffer: &mut Buffer) -> Value {
    let points: [[u8; 3]; 5] = [[0, 0, 0], [80, 0, 0], [80, 0, 80], [0, 0, 80], [40, 90, 40]];
    let bytes: Vec<u8> = points.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0]).collect();
    let view = buffer.view(&bytes, json!({ "byteStride": 4, "target": VERTICES }));
    let positions = buffer.accessor(json!({
        "bufferView": view, "componentType": U8, "count": 5, "type": "VEC3", "min": [0, 0, 0], "max": [80, 90, 80],
    }));
    let indices = buffer.indices(&[0, 1, 2, 0, 2, 3, 4, 1, 0, 4, 2, 1, 4, 3, 2, 4, 0, 3], U8);
    json!({
        "name": "9 pyramid, quantized",
        "primitives": [{ "attributes": { "POSITION": positions }, "indices": indices, "material": 9 }],
    })
}

/// Returns a flat grid of 8x8 squares, with five of its points raised by a sparse accessor; no
/// normals.
fn sparse_grid(buffer: &mut Buffer) -> Value {
    let mut points: Vec<Vec3> =
        (0..81).map(|i| vec3((i % 9) as f32 / 8.0 - 0.5, 0.0, (i / 9) as f32 / 8.0 - 0.5)).collect();
    let flat = buffer.view(&floats(points.iter().flat_map(|p| p.to_array())), json!({ "target": VERTICES }));
    let raised: [u16; 5] = [20, 24, 40, 56, 60];
    for i in raised {
        points[usize::from(i)].y = 0.1 + 0.004 * f32::from(i);
    }
    let values: Vec<u8> = floats(raised.iter().flat_map(|i| points[usize::from(*i)].to_array()));
    let indices = buffer.view(&raised.map(u16::to_le_bytes).concat(), json!({}));
    let values = buffer.view(&values, json!({}));
    let positions = buffer.accessor(with(
        json!({
            "bufferView": flat, "componentType": F32, "count": 81, "type": "VEC3",
            "sparse": {
                "count": raised.len(),
                "indices": { "bufferView": indices, "componentType": U16 },
                "values": { "bufferView": values },
            },
        }),
        bounds(&points),
    ));
    let squares = (0..64).map(|i| i / 8 * 9 + i % 8);
    let triangles: Vec<u32> = squares.flat_map(|a| [a, a + 9, a + 10, a, a + 10, a + 1]).collect();
    let indices = buffer.indices(&triangles, U16);
    json!({
        "name": "10 sparse grid",
        "primitives": [{ "attributes": { "POSITION": positions }, "indices": indices, "material": 11 }],
    })
}

/// Returns a triangle with a sparse accessor that has no buffer view: points are zero except those
/// given. The sparse indices are u8.
fn sparse_triangle(buffer: &mut Buffer) -> Value {
    let points = [Vec3::ZERO, vec3(0.8, 0.0, 0.0), vec3(0.4, 0.7, -0.3)];
    let indices = buffer.view(&[1, 2], json!({}));
    let values = buffer.view(&floats(points[1..].iter().flat_map(|p| p.to_array())), json!({}));
    let positions = buffer.accessor(with(
        json!({
            "componentType": F32, "count": 3, "type": "VEC3",
            "sparse": {
                "count": 2,
                "indices": { "bufferView": indices, "componentType": U8 },
                "values": { "bufferView": values },
            },
        }),
        bounds(&points),
    ));
    json!({
        "name": "11 sparse triangle",
        "primitives": [{ "attributes": { "POSITION": positions }, "material": 10 }],
    })
}

/// Returns an image of 8x8 tiles that shows orientation: red grows to the right and green
/// downwards, the top left tile is white, and a dark L is on it.
fn tiles() -> Result<Vec<u8>, Box<dyn Error>> {
    let texel = |x: u32, y: u32| match (x, y) {
        (0, 0) => [255, 255, 255],
        (2, 2..=5) | (2..=4, 5) => [25, 20, 30],
        _ => [40 + 25 * x as u8, 40 + 25 * y as u8, 70],
    };
    let bytes: Vec<u8> = (0..64).flat_map(|i| texel(i % 8, i / 8)).collect();
    png(&bytes, 8, ExtendedColorType::Rgb8)
}

/// Returns an image that is bright in the middle.
fn glow() -> Result<Vec<u8>, Box<dyn Error>> {
    let texel = |x: u32, y: u32| if (1..7).contains(&x) && (1..7).contains(&y) { 255 } else { 128 };
    let bytes: Vec<u8> = (0..64).map(|i| texel(i % 8, i / 8)).collect();
    png(&bytes, 8, ExtendedColorType::L8)
}

/// Returns an image of two leaves: alpha is 1 within, and falls to 0 over a few texels.
fn leaf() -> Result<Vec<u8>, Box<dyn Error>> {
    let texel = |x: u32, y: u32| {
        let (u, v) = ((x as f32 + 0.5) / 32.0, (y as f32 + 0.5) / 32.0);
        let leaf = |cx: f32, turn: f32| {
            let (dx, dy) = (u - cx, v - 0.5);
            let (a, b) = (turn * dx + dy, dx - turn * dy);
            1.0 - (b.abs() / 0.13 + (a / 0.42) * (a / 0.42))
        };
        let inside = leaf(0.3, 0.3).max(leaf(0.7, -0.3));
        let alpha = ((inside * 2.0 + 0.5).clamp(0.0, 1.0) * 255.0).round() as u8;
        [60 + 2 * x as u8, 150 - y as u8, 40, alpha]
    };
    let bytes: Vec<u8> = (0..1024).flat_map(|i| texel(i % 32, i / 32)).collect();
    png(&bytes, 32, ExtendedColorType::Rgba8)
}

/// Returns an image whose green (roughness) grows to the right, and whose blue (metallic) is 1 in
/// the upper half.
fn steps() -> Result<Vec<u8>, Box<dyn Error>> {
    let texel = |x: u32, y: u32| [0, 40 + 28 * x as u8, if y < 4 { 255 } else { 0 }];
    let bytes: Vec<u8> = (0..64).flat_map(|i| texel(i % 8, i / 8)).collect();
    png(&bytes, 8, ExtendedColorType::Rgb8)
}

fn stripes() -> Result<Vec<u8>, Box<dyn Error>> {
    let texel = |y: u32| [if y.is_multiple_of(2) { 255 } else { 60 }, 0, 0];
    let bytes: Vec<u8> = (0..64).flat_map(|i| texel(i / 8)).collect();
    png(&bytes, 8, ExtendedColorType::Rgb8)
}

fn png(bytes: &[u8], size: u32, color: ExtendedColorType) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut file = Vec::new();
    PngEncoder::new(&mut file).write_image(bytes, size, size, color)?;
    Ok(file)
}
