//! Reads PLY: ASCII, and binary of both byte orders.
//!
//! [`parse`] turns a file into a [`Description`]; docs/reference/scene-format/models.md lists the
//! supported features for users.

mod body;
mod header;

use super::budget::Budget;
use super::mesh::{POSITION_REMEDY, check_instance, check_position, check_uvs, extent, finish};
use super::origin;
use super::source_location::{SourceLocation, shown};
use super::warnings::Warnings;
use crate::description::{Description, Instance, Lambertian, Material, Mesh};
use crate::error::SceneError;
use body::Body;
use glam::DAffine3;
use header::{Element, Kind};

/// Properties of a vertex that are read, each with its names.
const VERTEX: [&[&str]; 8] =
    [&["x"], &["y"], &["z"], &["nx"], &["ny"], &["nz"], &["u", "s", "texture_u"], &["v", "t", "texture_v"]];

/// Reads PLY from `bytes`; `name` stands for the file in messages.
///
/// * Of the element `vertex`, `x`, `y`, `z`, `nx`, `ny`, `nz` and texture coordinates are read.
///   These are `u` and `v`, or `s` and `t`, or `texture_u` and `texture_v`, with v upwards in the
///   file and downwards in the description.
/// * Of the element `face`, the list `vertex_indices` or `vertex_index` is read. Polygons become
///   fans around their first vertex.
/// * Numbers may be of any type, indices of any integer type.
/// * Positions are read in f64. In a file far from 0, they are stored relative to its centre.
/// * The material is one diffuse grey.
///
/// # Errors
///
/// * [`SceneError::Malformed`] for a file that is not PLY or is incomplete
/// * [`SceneError::TooLarge`] for data beyond the limits
pub fn parse(bytes: &[u8], name: &str) -> Result<Description, SceneError> {
    let mut warnings = Warnings::default();
    let mut budget = Budget::new(bytes.len());
    let header = header::read(bytes, name)?;
    let mut body = Body::new(bytes, &header, name);
    let count_of = |name: &str| header.elements.iter().find(|element| element.name == name).map(|e| e.count);
    // Each vertex takes bytes, so a count beyond u32 is found to be missing before its indices are
    // used.
    let vertices = count_of("vertex").unwrap_or(0).min(u64::from(u32::MAX)) as u32;

    // Positions that f32 would round. Those that f32 holds exactly are stored in the mesh at once.
    let mut exact = Vec::new();
    let mut mesh = Mesh { name: "mesh".to_owned(), ..Mesh::default() };
    for element in &header.elements {
        body.reserve(element)?;
        match element.name.as_str() {
            "vertex" => read_vertices(&mut body, element, &mut mesh, &mut exact, &mut warnings)?,
            "face" => read_faces(&mut body, element, vertices, &mut mesh, &mut warnings)?,
            other => {
                warnings.once(format!("the PLY element \"{}\" is not supported and ignored", shown(other)));
                body.skip(element)?;
            }
        }
    }

    let site = SourceLocation::new(name, "face");
    let vertex = SourceLocation::new(name, "vertex");
    check_uvs(&mut mesh.uvs, &vertex, &mut warnings);
    let corners = mesh.triangles.as_flattened().iter();
    let origin = origin::choose(corners.filter_map(|&corner| exact.get(corner as usize).copied()));
    if exact.is_empty() {
        origin::warn_of_single(&mesh.positions, &vertex, &mut warnings);
    } else {
        mesh.positions = exact.into_iter().map(|position| origin::relative(position, origin)).collect();
    }
    let mut description = Description::default();
    if mesh.triangles.is_empty() {
        warnings.once("the file has no faces");
    } else if let Some(mesh) = finish(mesh, &site, &mut warnings) {
        let transform = DAffine3::from_translation(origin);
        check_instance(extent(&mesh), mesh.triangles.len(), &transform, &mut budget, &site)?;
        description.instances.push(Instance { mesh: 0, transform });
        description.meshes.push(mesh);
        description.materials.push(grey());
    }
    description.warnings = warnings.finish();
    Ok(description)
}

fn grey() -> Material {
    Material::from(Lambertian::rgb(0.8, 0.8, 0.8)).named("default")
}

fn read_vertices(
    body: &mut Body,
    element: &Element,
    mesh: &mut Mesh,
    exact: &mut Vec<[f64; 3]>,
    warnings: &mut Warnings,
) -> Result<(), SceneError> {
    let role = |name: &str| VERTEX.iter().position(|names| names.contains(&name));
    let has = |roles: std::ops::Range<usize>| {
        let scalar = |names: &[&str]| {
            let properties = &element.properties;
            properties.iter().any(|p| matches!(p.kind, Kind::Scalar(_)) && names.contains(&p.name.as_str()))
        };
        VERTEX[roles].iter().all(|names| scalar(names))
    };
    if !has(0..3) {
        return Err(body.site("vertex").malformed("it has no x, y and z", "vertices must have a position"));
    }
    let (normals, uvs) = (has(3..6), has(6..8));
    let ignored: Vec<&str> =
        element.properties.iter().map(|p| p.name.as_str()).filter(|name| role(name).is_none()).collect();
    if !ignored.is_empty() {
        let names = shown(&ignored.join(", "));
        warnings.once(format!("these properties of PLY vertices are not supported and ignored: {names}"));
    }
    let count = element.count as usize; // all present: `reserve` has checked
    let single = element.properties.iter().all(|property| match property.kind {
        Kind::Scalar(number) if matches!(role(&property.name), Some(0..3)) => body.is_single(number),
        _ => true,
    });
    mesh.positions.reserve_exact(if single { count } else { 0 });
    exact.reserve_exact(if single { 0 } else { count });
    mesh.normals.reserve_exact(if normals { count } else { 0 });
    mesh.uvs.reserve_exact(if uvs { count } else { 0 });
    let roles: Vec<Option<usize>> = element.properties.iter().map(|p| role(&p.name)).collect();
    for vertex in 0..element.count {
        let mut values = [0.0; VERTEX.len()];
        for (property, role) in element.properties.iter().zip(&roles) {
            match (property.kind, role) {
                (Kind::Scalar(number), Some(role)) => values[*role] = body.number(number)?,
                (Kind::Scalar(number), None) => drop(body.number(number)?),
                (kind @ Kind::List { .. }, _) => body.skip_property(kind)?,
            }
        }
        let [x, y, z, nx, ny, nz, u, v] = values;
        let position = check_position([x, y, z]).map_err(|problem| {
            let site = body.site(&format!("vertex {vertex}"));
            site.malformed(format!("its position {problem}"), POSITION_REMEDY)
        })?;
        match single {
            true => mesh.positions.push(position.map(|x| x as f32)),
            false => exact.push(position),
        }
        if normals {
            mesh.normals.push([nx as f32, ny as f32, nz as f32]);
        }
        if uvs {
            mesh.uvs.push([u as f32, (1.0 - v) as f32]);
        }
    }
    Ok(())
}

fn read_faces(
    body: &mut Body,
    element: &Element,
    vertices: u32,
    mesh: &mut Mesh,
    warnings: &mut Warnings,
) -> Result<(), SceneError> {
    let is_indices = |name: &str| matches!(name, "vertex_indices" | "vertex_index");
    if !element.properties.iter().any(|p| is_indices(&p.name) && matches!(p.kind, Kind::List { .. })) {
        let site = body.site("face");
        return Err(
            site.malformed("it has no list vertex_indices", "faces must have their vertices' indices")
        );
    }
    let others = element.properties.iter().map(|p| p.name.as_str()).filter(|name| !is_indices(name));
    let others: Vec<&str> = others.collect();
    if !others.is_empty() {
        let names = shown(&others.join(", "));
        warnings.once(format!("these properties of PLY faces are not supported and ignored: {names}"));
    }
    for face in 0..element.count {
        for property in &element.properties {
            let Kind::List { count, item } = property.kind else {
                body.skip_property(property.kind)?;
                continue;
            };
            if !is_indices(&property.name) {
                body.skip_property(property.kind)?;
                continue;
            }
            let length = body.count(count, item)?;
            let (mut first, mut latest) = (0, 0);
            for place in 0..length {
                let index = body.number(item)?;
                // f64 holds the whole numbers of all integer types exactly.
                if !(index >= 0.0 && index < f64::from(vertices) && index.fract() == 0.0) {
                    let site = body.site(&format!("face {face}"));
                    return Err(site.malformed(
                        format!("it has vertex {index}, and there are {vertices}"),
                        "indices must be whole numbers from 0 on and below the count of vertices",
                    ));
                }
                let index = index as u32;
                match place {
                    0 => first = index,
                    1 => {}
                    _ => mesh.triangles.push([first, latest, index]),
                }
                latest = index;
            }
            if length < 3 {
                let place = format!("face {face}");
                warnings.tally("faces with fewer than three vertices, dropped", 1, &place);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
