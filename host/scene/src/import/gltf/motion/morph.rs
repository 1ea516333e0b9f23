//! Morph targets: adds weighted differences to the attributes of a mesh (glTF 2.0, section
//! 3.7.2.2).

use super::super::super::source_location::SourceLocation;
use super::super::accessor::{Component, Elements, Expected};
use super::super::{Document, Output};
use super::Vertices;
use crate::description::Mesh;
use crate::error::SceneError;
use Component::{F32, I8, I16, U8, U16};

const VECTOR: Expected = Expected { kind: "VEC3", components: &[F32, I8, U8, I16, U16] };
const TEXCOORD: Expected = Expected { kind: "VEC2", components: &[F32, I8, U8, I16, U16] };
const COLOR: [Expected; 2] = [
    Expected { kind: "VEC3", components: &[F32, I8, U8, I16, U16] },
    Expected { kind: "VEC4", components: &[F32, I8, U8, I16, U16] },
];

/// Adds the morph targets of a primitive with these weights to its mesh.
pub fn apply(
    document: &Document,
    output: &mut Output,
    vertices: Vertices,
    weights: &[f64],
    mesh: &mut Mesh,
    site: &SourceLocation,
) -> Result<(), SceneError> {
    let Vertices { attributes, used, sets } = vertices;
    let targets = attributes.primitive.targets.as_deref().unwrap_or_default();
    for (index, (target, &weight)) in targets.iter().zip(weights).enumerate() {
        if weight == 0.0 {
            continue;
        }
        let site = site.member(&format!("targets[{index}]"));
        // No memory but time: many targets may name one accessor.
        output.budget.take(used.len() as u64, &site)?;
        let open = |output: &mut Output, name: &str, expected| {
            let Some(&accessor) = target.get(name) else { return Ok(None) };
            Elements::open(document, &mut output.budget, accessor, expected, &site.member(name)).map(Some)
        };
        add::<3, 3>(&mut mesh.positions, open(output, "POSITION", VECTOR)?, weight, used);
        add::<3, 3>(&mut mesh.normals, open(output, "NORMAL", VECTOR)?, weight, used);
        add::<3, 4>(&mut mesh.tangents, open(output, "TANGENT", VECTOR)?, weight, used);
        for (uvs, set) in [&mut mesh.uvs, &mut mesh.second_uvs].into_iter().zip(sets) {
            if let Some(set) = set {
                add::<2, 2>(uvs, open(output, &format!("TEXCOORD_{set}"), TEXCOORD)?, weight, used);
            }
        }
        if let Some(&accessor) = target.get("COLOR_0") {
            let accessor = document.root.accessors.get(accessor as usize);
            if accessor.is_some_and(|accessor| accessor.kind == "VEC4") {
                add::<4, 4>(&mut mesh.colors, open(output, "COLOR_0", COLOR[1])?, weight, used);
            } else {
                add::<3, 4>(&mut mesh.colors, open(output, "COLOR_0", COLOR[0])?, weight, used);
            }
        }
    }
    Ok(())
}

/// Adds weighted differences of `M` components to the first components of attributes.
fn add<const M: usize, const N: usize>(
    attributes: &mut [[f32; N]],
    differences: Option<Elements>,
    weight: f64,
    used: &[u32],
) {
    let Some(differences) = differences else { return };
    for (attribute, &vertex) in attributes.iter_mut().zip(used) {
        if vertex < differences.count {
            for (value, by) in attribute.iter_mut().zip(differences.floats::<M>(vertex)) {
                *value = (f64::from(*value) + weight * f64::from(by)) as f32;
            }
        }
    }
}
