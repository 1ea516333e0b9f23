//! Reads a glTF primitive as a mesh of the description.

use super::super::mesh::{self, POSITION_REMEDY, check_colors, check_position, check_uvs, finish};
use super::super::source_location::{SourceLocation, shown};
use super::accessor::Elements;
use super::accessor::{Component, Expected};
use super::attributes::Attributes;
use super::json::{Primitive, TRIANGLES};
use super::material::Known;
use super::motion::{Deformation, Vertices, morph, skin};
use super::{Document, Output};
use crate::description::Mesh;
use crate::error::SceneError;

const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

use Component::{F32, I8, I16, U8, U16, U32};

const INDICES: Expected = Expected { kind: "SCALAR", components: &[U8, U16, U32] };
const POSITION: Expected = Expected { kind: "VEC3", components: &[F32, I8, U8, I16, U16] };
const NORMAL: Expected = Expected { kind: "VEC3", components: &[F32, I8, I16] };
const TANGENT: Expected = Expected { kind: "VEC4", components: &[F32, I8, I16] };
const COLOR: [Expected; 2] = [
    Expected { kind: "VEC3", components: &[F32, U8, U16] },
    Expected { kind: "VEC4", components: &[F32, U8, U16] },
];
const TEXCOORD: Expected = Expected { kind: "VEC2", components: &[F32, I8, U8, I16, U16] };

/// Reads a primitive; `None` if it has no triangles.
pub fn read(
    document: &Document,
    output: &mut Output,
    primitive: &Primitive,
    name: String,
    material: Known,
    deformation: Deformation,
    site: &SourceLocation,
) -> Result<Option<Mesh>, SceneError> {
    if !(TRIANGLES..=TRIANGLE_FAN).contains(&primitive.mode) {
        output.warnings.once(match primitive.mode {
            0 => "points (mode 0) are not supported and left out",
            1 => "lines (mode 1) are not supported and left out",
            2 => "line loops (mode 2) are not supported and left out",
            3 => "line strips (mode 3) are not supported and left out",
            other => {
                return Err(site.malformed(format!("mode is {other}"), "it must be between 0 and 6"));
            }
        });
        return Ok(None);
    }
    if !primitive.attributes.contains_key("POSITION") {
        output.warnings.tally("primitives without POSITION, left out", 1, &site.place);
        return Ok(None);
    }
    let attributes = Attributes::of(document, output, primitive, site)?;
    let Some(positions) = attributes.open(document, output, "POSITION", POSITION)? else { return Ok(None) };
    let attribute = |output: &mut Output, name: &str, expected| {
        let Some(elements) = attributes.open(document, output, name, expected)? else { return Ok(None) };
        if elements.count != positions.count {
            let problem = format!("it has {} elements, and POSITION {}", elements.count, positions.count);
            let site = site.member(&format!("attributes.{name}"));
            return Err(site.malformed(problem, "attributes of a primitive must have the same count"));
        }
        Ok(Some(elements))
    };
    let normals = attribute(output, "NORMAL", NORMAL)?;
    let uvs = |output: &mut Output, set: Option<u32>| match set {
        Some(set) => attribute(output, &format!("TEXCOORD_{set}"), TEXCOORD),
        None => Ok(None),
    };
    // A scene file may give the mesh another material.
    let numbers = [material.sets[0].or(Some(0)), material.sets[1]];
    let sets = [uvs(output, numbers[0])?, uvs(output, numbers[1])?];
    let tangents = if material.is_mapped { attribute(output, "TANGENT", TANGENT)? } else { None };
    let has_opacity = attributes.width(document, "COLOR_0") == Some(4);
    let colors = attribute(output, "COLOR_0", COLOR[usize::from(has_opacity)])?;
    if (0..2).any(|place| material.sets[place].is_some() && sets[place].is_none()) {
        output.warnings.tally(
            "meshes without the texture coordinates that their material's textures use",
            1,
            &site.place,
        );
    }

    let (corners, mode) = match &attributes.decoded {
        // Draco data holds triangles, whatever they were.
        Some(decoded) => {
            output.budget.take(4 * decoded.corners.len() as u64, site)?;
            (decoded.corners.clone(), TRIANGLES)
        }
        None => (corners(document, output, primitive, positions.count, site)?, primitive.mode),
    };
    let most = if mode == TRIANGLES { corners.len() / 3 } else { corners.len() };
    output.budget.take(mesh::bytes(0, most as u64), site)?;
    let mut triangles = triangles(&corners, mode, output, site);
    drop(corners);
    let used = compact(&mut triangles, positions.count);
    output.budget.take(mesh::bytes(used.len() as u64, 0), site)?;

    let mut mesh = Mesh { name, material: material.index, triangles, ..Mesh::default() };
    mesh.positions = used.iter().map(|&vertex| positions.floats(vertex)).collect();
    if let Some(normals) = normals {
        mesh.normals = used.iter().map(|&vertex| normals.floats(vertex)).collect();
    }
    for (uvs, elements) in [&mut mesh.uvs, &mut mesh.second_uvs].into_iter().zip(sets) {
        let Some(elements) = elements else { continue };
        *uvs = used.iter().map(|&vertex| elements.floats(vertex)).collect();
    }
    if let Some(tangents) = tangents {
        mesh.tangents = used.iter().map(|&vertex| tangents.floats(vertex)).collect();
    }
    if let Some(colors) = colors {
        let color = |&vertex: &u32| match has_opacity {
            true => colors.floats(vertex),
            false => {
                let [r, g, b] = colors.floats(vertex);
                [r, g, b, 1.0]
            }
        };
        mesh.colors = used.iter().map(color).collect();
    }
    let vertices = Vertices { attributes: &attributes, used: &used, sets: numbers };
    morph::apply(document, output, vertices, deformation.weights, &mut mesh, site)?;
    if let Some(skin) = deformation.skin {
        skin::apply(document, output, vertices, skin, &mut mesh, site)?;
    }
    for (&vertex, position) in used.iter().zip(&mesh.positions) {
        check_position(position.map(f64::from)).map_err(|problem| {
            let moved = if deformation.skin.is_some() { ", moved by its skin," } else { "" };
            let user = document.site(format!("{} ({}.attributes.POSITION)", positions.place, site.place));
            user.malformed(format!("vertex {vertex}{moved} at {problem}"), POSITION_REMEDY)
        })?;
    }
    for uvs in [&mut mesh.uvs, &mut mesh.second_uvs] {
        check_uvs(uvs, site, &mut output.warnings);
    }
    check_colors(&mut mesh.colors, site, &mut output.warnings);
    Ok(finish(mesh, site, &mut output.warnings))
}

/// Returns the vertices in the order in which they form triangles; each is below `count`.
fn corners(
    document: &Document,
    output: &mut Output,
    primitive: &Primitive,
    count: u32,
    site: &SourceLocation,
) -> Result<Vec<u32>, SceneError> {
    let Some(index) = primitive.indices else {
        output.budget.take(4 * u64::from(count), site)?;
        return Ok((0..count).collect());
    };
    let site = site.member("indices");
    let indices = Elements::open(document, &mut output.budget, index, INDICES, &site)?;
    output.budget.take(4 * u64::from(indices.count), &site)?;
    let mut corners = Vec::with_capacity(indices.count as usize);
    for element in 0..indices.count {
        let vertex = indices.integer(element);
        if vertex >= count {
            let place = format!("{} ({})", indices.place, site.place);
            return Err(document.site(place).malformed(
                format!("element {element} is {vertex}, and there are {count} vertices"),
                "indices must be below the count of the attributes",
            ));
        }
        corners.push(vertex);
    }
    Ok(corners)
}

/// Forms triangles from corners by the mode, all with the front on the same side.
fn triangles(corners: &[u32], mode: u32, output: &mut Output, site: &SourceLocation) -> Vec<[u32; 3]> {
    match mode {
        TRIANGLE_STRIP => {
            let odd = |place: usize| place % 2 == 1;
            let turn =
                |(place, &[a, b, c]): (usize, &[u32; 3])| if odd(place) { [b, a, c] } else { [a, b, c] };
            corners.array_windows().enumerate().map(turn).collect()
        }
        TRIANGLE_FAN => match corners {
            [first, others @ ..] => others.array_windows().map(|&[a, b]| [*first, a, b]).collect(),
            [] => Vec::new(),
        },
        _ => {
            let (triangles, left) = corners.as_chunks();
            output.warnings.tally(
                "vertices after the last whole triangle, ignored",
                left.len() as u64,
                &site.place,
            );
            triangles.to_vec()
        }
    }
}

/// Renumbers the vertices that triangles use from 0 on, in their order, and returns their old
/// numbers.
///
/// Unused vertices are dropped, because many primitives may share attributes of which each uses a
/// part.
fn compact(triangles: &mut [[u32; 3]], count: u32) -> Vec<u32> {
    const NONE: u32 = u32::MAX; // not a vertex: all are below `count`
    let corners = triangles.as_flattened_mut();
    if (count as usize) / 8 <= corners.len() {
        let mut numbers = vec![NONE; count as usize];
        for &mut corner in corners.iter_mut() {
            numbers[corner as usize] = 0;
        }
        let mut used = Vec::new();
        for (vertex, number) in (0..count).zip(&mut numbers) {
            if *number == 0 {
                *number = used.len() as u32;
                used.push(vertex);
            }
        }
        for corner in corners {
            *corner = numbers[*corner as usize];
        }
        return used;
    }
    let mut used = corners.to_vec();
    used.sort_unstable();
    used.dedup();
    for corner in corners {
        *corner = used.partition_point(|vertex| vertex < corner) as u32;
    }
    used
}

/// Returns a primitive's name: that of its mesh, with its index if there are several.
pub fn name(mesh: Option<&str>, mesh_index: u32, primitive: usize, primitives: usize) -> String {
    let mesh = mesh.map_or_else(|| format!("meshes[{mesh_index}]"), shown);
    if primitives == 1 { mesh } else { format!("{mesh}.primitives[{primitive}]") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_in_use_are_renumbered_in_order() {
        for count in [10, 1_000_000] {
            let mut triangles = [[9, 2, 4], [2, 9, 7]];
            assert_eq!(compact(&mut triangles, count), [2, 4, 7, 9]);
            assert_eq!(triangles, [[3, 0, 1], [0, 3, 2]]);
        }
        assert!(compact(&mut [], 0).is_empty());
    }
}
