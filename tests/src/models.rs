//! glTF models that move.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::f32::consts::TAU;

/// Numbers of an accessor.
enum Numbers<'a> {
    Floats(&'a [f32]),
    Shorts(&'a [u16]),
    Bytes(&'a [u8]),
}

/// Returns a glTF file with these accessors, each with its type, and the members of `rest`.
fn document(accessors: &[(&str, Numbers)], rest: &Value) -> String {
    let (mut data, mut views, mut records) = (Vec::new(), Vec::new(), Vec::new());
    for (kind, numbers) in accessors {
        data.resize(data.len().next_multiple_of(4), 0);
        let offset = data.len();
        let (component, count) = match numbers {
            Numbers::Floats(list) => {
                data.extend(list.iter().flat_map(|number| number.to_le_bytes()));
                (5126, list.len())
            }
            Numbers::Shorts(list) => {
                data.extend(list.iter().flat_map(|number| number.to_le_bytes()));
                (5123, list.len())
            }
            Numbers::Bytes(list) => {
                data.extend_from_slice(list);
                (5121, list.len())
            }
        };
        let width = match *kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let view = views.len();
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": data.len() - offset }));
        records.push(
            json!({ "bufferView": view, "componentType": component, "count": count / width, "type": kind }),
        );
    }
    let mut document = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": data.len(), "uri": format!("data:;base64,{}", STANDARD.encode(&data)) }],
        "bufferViews": views,
        "accessors": records,
    });
    if let (Some(document), Some(rest)) = (document.as_object_mut(), rest.as_object()) {
        document.extend(rest.clone());
    }
    document.to_string()
}

/// Returns a model of a white square that emits radiance 1. Its side is 1, and in one second its
/// lower left corner moves from (-1, -0.5, 0) to (1, -0.5, 0), or to `end`.
pub fn sliding_square(end: [f32; 3]) -> String {
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let places = [&[-1.0, -0.5, 0.0][..], &end].concat();
    let accessors = [
        ("VEC3", Numbers::Floats(&corners)),
        ("SCALAR", Numbers::Shorts(&[0, 1, 2, 0, 2, 3])),
        ("SCALAR", Numbers::Floats(&[0.0, 1.0])),
        ("VEC3", Numbers::Floats(&places)),
    ];
    let unlit = json!({ "extensions": { "KHR_materials_unlit": {} } });
    let channel = json!({ "sampler": 0, "target": { "node": 0, "path": "translation" } });
    let rest = json!({
        "extensionsUsed": ["KHR_materials_unlit"],
        "materials": [unlit],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "nodes": [{ "mesh": 0 }],
        "animations": [{ "name": "slide", "samplers": [{ "input": 2, "output": 3 }], "channels": [channel] }],
    });
    document(&accessors, &rest)
}

/// Returns a model of a white square of side 2 and of a lamp, which moves away from it in the first
/// second: the radiance of the square falls by 7 stops and more.
pub fn departing_lamp() -> String {
    let corners = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0];
    let accessors = [
        ("VEC3", Numbers::Floats(&corners)),
        ("SCALAR", Numbers::Shorts(&[0, 1, 2, 0, 2, 3])),
        ("SCALAR", Numbers::Floats(&[0.0, 1.0])),
        ("VEC3", Numbers::Floats(&[0.0, 0.0, 2.0, 0.0, 0.0, 40.0])),
    ];
    let channel = json!({ "sampler": 0, "target": { "node": 1, "path": "translation" } });
    let lamp = json!({ "type": "point", "intensity": 3000.0 });
    let rest = json!({
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [lamp] } },
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "nodes": [{ "mesh": 0 }, { "extensions": { "KHR_lights_punctual": { "light": 0 } } }],
        "animations": [{ "samplers": [{ "input": 2, "output": 3 }], "channels": [channel] }],
    });
    document(&accessors, &rest)
}

/// Returns a model of a tube of 2 · `rings` · `sides` triangles on eight joints, which bend in the
/// first second, and of a camera that moves towards it.
pub fn bending_tube(rings: u16, sides: u16) -> String {
    const JOINTS: u16 = 8;
    let (mut positions, mut joints, mut weights, mut indices) = (vec![], vec![], vec![], vec![]);
    for ring in 0..=rings {
        let height = f32::from(ring) / f32::from(rings);
        let place = (height * f32::from(JOINTS)).min(f32::from(JOINTS) - 0.001);
        let (joint, part) = (place as u8, place.fract());
        for side in 0..sides {
            let angle = TAU * f32::from(side) / f32::from(sides);
            positions.extend([0.5 * angle.cos(), 8.0 * height, 0.5 * angle.sin()]);
            joints.extend([joint, (joint + 1).min(JOINTS as u8 - 1), 0, 0]);
            weights.extend([1.0 - 0.5 * part, 0.5 * part, 0.0, 0.0]);
        }
    }
    for ring in 0..rings {
        for side in 0..sides {
            let (a, b) = (ring * sides + side, ring * sides + (side + 1) % sides);
            indices.extend([a, a + sides, b, b, a + sides, b + sides]);
        }
    }
    let binds: Vec<f32> = (0..JOINTS)
        .flat_map(|joint| {
            let height = -f32::from(joint) * 8.0 / f32::from(JOINTS);
            [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, height, 0.0, 1.0]
        })
        .collect();
    let half = 0.2f32;
    let turns = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half.sin(), half.cos()];
    let accessors = [
        ("VEC3", Numbers::Floats(&positions)),
        ("VEC4", Numbers::Bytes(&joints)),
        ("VEC4", Numbers::Floats(&weights)),
        ("SCALAR", Numbers::Shorts(&indices)),
        ("MAT4", Numbers::Floats(&binds)),
        ("SCALAR", Numbers::Floats(&[0.0, 1.0])),
        ("VEC4", Numbers::Floats(&turns)),
        ("VEC3", Numbers::Floats(&[0.0, 4.0, 14.0, 0.0, 4.0, 12.0])),
    ];
    let mut nodes = vec![json!({ "mesh": 0, "skin": 0 }), json!({ "camera": 0, "translation": [0, 4, 14] })];
    for joint in 0..JOINTS {
        let height = if joint == 0 { 0.0 } else { 8.0 / f64::from(JOINTS) };
        let mut node = json!({ "translation": [0.0, height, 0.0] });
        if joint + 1 < JOINTS {
            node["children"] = json!([joint + 3]);
        }
        nodes.push(node);
    }
    let turn = |joint: u16| json!({ "sampler": 0, "target": { "node": joint + 2, "path": "rotation" } });
    let mut channels: Vec<Value> = (1..JOINTS).map(turn).collect();
    channels.push(json!({ "sampler": 1, "target": { "node": 1, "path": "translation" } }));
    let samplers = json!([{ "input": 5, "output": 6 }, { "input": 5, "output": 7 }]);
    let attributes = json!({ "POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2 });
    let rest = json!({
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": 3 }] }],
        "skins": [{ "joints": (2..JOINTS + 2).collect::<Vec<_>>(), "inverseBindMatrices": 4 }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.9, "znear": 0.1 } }],
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": nodes,
        "animations": [{ "name": "bend", "samplers": samplers, "channels": channels }],
    });
    document(&accessors, &rest)
}
