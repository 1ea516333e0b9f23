//! Reads Wavefront OBJ with MTL materials.
//!
//! [`parse`] turns a file into a [`Description`]; docs/reference/scene-format/models.md lists the
//! supported features for users.

mod geometry;
mod group;
mod library;
mod lines;
mod lookup;
mod map;
mod maps;
mod material;
mod smoothing;

use super::budget::Budget;
use super::files::Files;
use super::images::Images;
use super::mesh::{check_instance, check_uvs, extent, finish};
use super::origin;
use super::source_location::SourceLocation;
use super::warnings::Warnings;
use crate::description::{Description, Instance, Mesh};
use crate::error::SceneError;
use geometry::{Geometry, Group, NONE};
use glam::{DAffine3, DVec3};
use lines::Source;
use lookup::Lookup;
use material::Materials;
use std::collections::HashMap;

/// Reads OBJ from `bytes`, and its material libraries and images from `files`; `name` stands for
/// the file in messages.
///
/// The OBJ statements `v`, `vt`, `vn`, `f`, `s`, `o`, `g`, `usemtl` and `mtllib` are supported:
///
/// * Polygons become fans around their first vertex.
/// * Polygons of the same object or group with the same material become a mesh. Those with normals,
///   those of smoothing groups and others make different meshes, and so do those with and without
///   texture coordinates.
/// * Positions are f64. In a file far from 0, they are stored relative to its centre.
/// * Normals are those of `vn`. Without, a face of a smoothing group has at each corner the mean of
///   the normals of the group's faces that share the position's index, weighted by their angles
///   there; other faces are flat.
/// * Texture coordinates have v upwards in the file and downwards in the description.
///
/// The first of these lines that applies makes an MTL material:
///
/// * `Pr`, `Pm`, `map_Pr` or `map_Pm`: metallic-roughness with base colour `Kd`, roughness `Pr` (1
///   without), metallic `Pm` (0 without, 1 with `map_Pm`) and index of refraction `Ni` (1.5
///   without)
/// * `illum` 4, 6 or 7; or `Tf`, `Ni` and `d` below 1: smooth glass with index of refraction `Ni`
///   (1.5 without)
/// * `illum` 3 or 5, with `Ns`, and with `Ks` above 0: rough metal that reflects `Ks`, with GGX
///   alpha sqrt(2 / (`Ns` + 2))
/// * `Ks` above 0, and `illum` neither 0 nor 1: a dielectric with base colour `Kd`, GGX alpha
///   sqrt(2 / (`Ns` + 2)), and the reflectance of index `Ni` (1.5 without, or for 1) times 2 `Ks`
/// * any others: diffuse `Kd` (0.8 without, 1 with `map_Kd`)
///
/// Further rules:
///
/// * `map_Kd` multiplies `Kd` of materials with a base colour; `map_Ks`, `map_Pr` and `map_Pm`
///   multiply `Ks`, `Pr` and `Pm`.
/// * `norm` is a normal map. `map_Bump` or `bump` is one if its texels are; otherwise it is a
///   height map, of which white is 1 % of the image's width above black. `-bm` multiplies both.
/// * `Ke`, times `map_Ke`, is emitted by both sides.
/// * `d` below 1 (or `Tr` above 0) is opacity, except for glass.
/// * Maps take the options `-s`, `-o` and `-clamp`.
/// * Ambient light (`Ka`) is ignored.
/// * Faces without a material, or with one that no library defines, are diffuse grey. A library
///   that is missing defines none, with a warning.
/// * An image that is missing at its path is looked for by its name, beside its library and below
///   the folder of the file, in the folders that end its path; if found, with a warning.
///
/// # Errors
///
/// * [`SceneError::Invalid`] with the line, for text that is not OBJ or MTL
/// * [`SceneError::Resource`] and [`SceneError::Outside`] for images that `files` does not give,
///   and for libraries that it refuses
/// * [`SceneError::Malformed`], [`SceneError::Unsupported`] and [`SceneError::TooLarge`] for their
///   content
pub fn parse(bytes: &[u8], name: &str, files: &mut dyn Files) -> Result<Description, SceneError> {
    read(bytes, name, files, true)
}

/// Reads OBJ as [`parse`] does, but for smoothing groups, which have no effect.
pub(super) fn parse_unsmoothed(
    bytes: &[u8],
    name: &str,
    files: &mut dyn Files,
) -> Result<Description, SceneError> {
    read(bytes, name, files, false)
}

fn read(
    bytes: &[u8],
    name: &str,
    files: &mut dyn Files,
    is_smoothed: bool,
) -> Result<Description, SceneError> {
    let mut warnings = Warnings::default();
    let mut budget = Budget::new(bytes.len());
    let source = Source::new(name, bytes);
    let geometry = geometry::read(&source, is_smoothed, &mut warnings)?;
    let mut libraries = library::Libraries::default();
    for (library, line) in &geometry.libraries {
        let site = SourceLocation::new(name, format!("line {line}, mtllib"));
        libraries.read(library, &site, files, &mut budget, &mut warnings)?;
    }
    let mut description = Description::default();
    let mut materials = Materials::new(libraries);
    let mut images = Images::default();
    let mut lookup = Lookup::default();
    let origin = origin::choose(geometry.corners());
    let transform = DAffine3::from_translation(origin);
    for group in &geometry.groups {
        let site = SourceLocation::new(
            name,
            format!("the object or group \"{}\"", super::source_location::shown(geometry.name(group))),
        );
        budget.place(group.triangles.len() as u64, &site)?;
        let mut mesh = mesh(&geometry, group, origin);
        check_uvs(&mut mesh.uvs, &site, &mut warnings);
        let Some(mut mesh) = finish(mesh, &site, &mut warnings) else { continue };
        let mut used = maps::Used {
            description: &mut description,
            images: &mut images,
            files: &mut *files,
            lookup: &mut lookup,
            budget: &mut budget,
            warnings: &mut warnings,
        };
        mesh.material = materials.get(geometry.material(group), &mut used)?;
        if check_instance(extent(&mesh), 0, &transform, &mut budget, &site)? {
            description.instances.push(Instance { mesh: description.meshes.len(), transform });
            description.meshes.push(mesh);
        }
    }
    if description.meshes.is_empty() {
        warnings.once("the file has no faces");
    }
    description.images = images.all;
    description.warnings = warnings.finish();
    Ok(description)
}

/// Builds a group's mesh, with positions relative to `origin` and a vertex for each combination of
/// position, texture coordinates and normal.
fn mesh(geometry: &Geometry, group: &Group, origin: DVec3) -> Mesh {
    let mut mesh = Mesh { name: super::source_location::shown(geometry.name(group)), ..Mesh::default() };
    let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
    mesh.triangles.reserve_exact(group.triangles.len());
    for corners in &group.triangles {
        mesh.triangles.push(corners.map(|corner| {
            *vertices.entry(corner).or_insert_with(|| {
                let [position, uv, normal] = corner;
                mesh.positions.push(origin::relative(geometry.positions[position as usize], origin));
                if uv != NONE {
                    mesh.uvs.push(geometry.uvs[uv as usize]);
                }
                if normal != NONE {
                    mesh.normals.push(geometry.normals[normal as usize]);
                }
                mesh.positions.len() as u32 - 1
            })
        }));
    }
    mesh
}

#[cfg(test)]
mod lookup_tests;
#[cfg(test)]
mod smoothing_tests;
#[cfg(test)]
mod tests;
