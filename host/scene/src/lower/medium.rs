//! Lowers media: the records, and the number of the medium that each material bounds.

use super::super::description::Description;
use super::super::medium::{DensityGrid, MAX_MEDIA, Medium, PlacedGrid};
use super::texture::texel;
use glam::{DVec3, Vec3, Vec4};
use trisect_shared::bsdf::{DIELECTRIC, LAYERED, ROUGH_DIELECTRIC};
use trisect_shared::layers::{LayerTextures, MaterialLayers, SOLID};
use trisect_shared::material::Material;
use trisect_shared::math::max_component;
use trisect_shared::medium::{CELL, CLEAR, COLLIDES, HAS_GRID, Medium as Record};
use trisect_shared::texture::Texel;

/// Media of a scene, and which of them surrounds it.
#[derive(Clone, Debug, Default)]
pub(super) struct Media {
    pub records: Vec<Record>,
    /// Number of the medium around all objects, from 1 on; 0 for none.
    pub atmosphere: u32,
}

/// Returns the records of the media that a scene uses, adds the texels of their grids, and numbers
/// the medium of each of `materials`, the records of the scene's materials.
///
/// In a scene with media the inside of a solid that refracts, without a medium of its own, is
/// clear, or has the absorption of its layers as a medium.
///
/// # Errors
///
/// A message for too many media or texels.
pub(super) fn lower(
    scene: &Description,
    materials: &mut [Material],
    layers: &mut [(MaterialLayers, LayerTextures)],
    texels: &mut Vec<Texel>,
) -> Result<Media, String> {
    let used = |index: usize| {
        scene.atmosphere == Some(index) || scene.materials.iter().any(|m| m.medium == Some(index))
    };
    if !(0..scene.media.len()).any(used) {
        return Ok(Media::default());
    }
    let number = |index: Option<usize>| index.map_or(0, |index| index as u32 + 1);
    let mut records = Vec::with_capacity(scene.media.len());
    for medium in &scene.media {
        let fault = |fault| format!("medium \"{}\": {fault}", medium.name);
        records.push(record(medium, texels).map_err(fault)?);
    }
    for (material, described) in materials.iter_mut().zip(&scene.materials) {
        material.medium = number(described.medium);
        let layers = match material.kind {
            LAYERED => material.layers.checked_sub(1).and_then(|index| layers.get_mut(index as usize)),
            _ => None,
        };
        let solid = layers.map(|(layers, _)| layers).filter(|layers| layers.flags & SOLID != 0);
        let refracts = matches!(material.kind, DIELECTRIC | ROUGH_DIELECTRIC) || solid.is_some();
        if material.medium != 0 || !refracts {
            continue;
        }
        material.medium = CLEAR;
        if let Some(layers) = solid.filter(|layers| max_component(layers.absorption) > 0.0) {
            let extinction = std::mem::replace(&mut layers.absorption, Vec3::ZERO);
            records.push(Record { extinction, ..Record::CLEAR });
            material.medium = records.len() as u32;
        }
    }
    match records.len() {
        ..=MAX_MEDIA => Ok(Media { records, atmosphere: number(scene.atmosphere) }),
        count => Err(format!("{count} media, with those of volumes that absorb; at most {MAX_MEDIA} fit")),
    }
}

fn record(medium: &Medium, texels: &mut Vec<Texel>) -> Result<Record, String> {
    let Medium { extinction, albedo, anisotropy, emission, .. } = medium;
    let collides = |c: usize| extinction[c] > 0.0;
    let albedo = DVec3::from_array(std::array::from_fn(|c| if collides(c) { albedo[c] } else { 0.0 }));
    let glow = DVec3::from_array(std::array::from_fn(|c| {
        if collides(c) { emission[c] * (1.0 - albedo[c]) } else { 0.0 }
    }));
    let only_absorbs = albedo == DVec3::ZERO && glow == DVec3::ZERO;
    let mut record = Record {
        extinction: extinction.as_vec3(),
        anisotropy: *anisotropy as f32,
        albedo: albedo.as_vec3(),
        flags: if only_absorbs { 0 } else { COLLIDES },
        emission: glow.as_vec3(),
        ..Record::CLEAR
    };
    if let Some(PlacedGrid { grid, transform }) = &medium.grid {
        let [width, height, depth] = grid.size();
        record.flags |= HAS_GRID;
        record.extinction = (extinction * f64::from(grid.max())).as_vec3();
        (record.width, record.height, record.depth) = (width, height, depth);
        let map = transform.inverse();
        let size = DVec3::new(f64::from(width), f64::from(height), f64::from(depth));
        let row = |axis: usize| -> Vec4 {
            (map.matrix3.row(axis).extend(map.translation[axis]) * size[axis]).as_vec4()
        };
        (record.x, record.y, record.z) = (row(0), row(1), row(2));
        let size = (grid.densities().len() + texels.len()) as u64 * 2;
        if size > u64::from(u32::MAX) {
            return Err("all grids and images together may have 2^31 texels".to_owned());
        }
        (record.first_density, record.first_majorant) = append(grid, texels);
    }
    Ok(record)
}

/// Appends the texels of a grid: for each voxel its density with those of its neighbours, relative
/// to the maximum, then for each cell its majorant. Returns the indices of the first of both.
fn append(grid: &DensityGrid, texels: &mut Vec<Texel>) -> (u32, u32) {
    let [width, height, depth] = grid.size().map(|size| size as usize);
    let scale = if grid.max() > 0.0 { 1.0 / f64::from(grid.max()) } else { 0.0 };
    let at = |x: usize, y: usize, z: usize| {
        let (x, y, z) = (x.min(width - 1), y.min(height - 1), z.min(depth - 1));
        let density = grid.densities().get((z * height + y) * width + x).copied().unwrap_or(0.0);
        (f64::from(density) * scale) as f32
    };
    let first = texels.len() as u32;
    for z in 0..depth {
        for y in 0..height {
            for x in 0..width {
                texels.push(texel([at(x, y, z), at(x + 1, y, z), at(x, y + 1, z), at(x + 1, y + 1, z)]));
            }
        }
    }
    let first_majorant = texels.len() as u32;
    let cell = CELL as usize;
    // Places in a cell lie between the centres of its voxels and of those next to them.
    let span =
        |cells: usize, size: usize| (cells * cell).saturating_sub(1)..=((cells + 1) * cell).min(size - 1);
    for z in 0..depth.div_ceil(cell) {
        for y in 0..height.div_ceil(cell) {
            for x in 0..width.div_ceil(cell) {
                let mut majorant = 0.0f32;
                for k in span(z, depth) {
                    for j in span(y, height) {
                        majorant = span(x, width).fold(majorant, |most, i| most.max(at(i, j, k)));
                    }
                }
                // Half precision rounds by 2^-12, and below the normal numbers to 0.
                let majorant = majorant * (1.0 + 1.0 / 2048.0);
                texels.push(Texel { red_green: majorant.to_bits(), blue_alpha: 0 });
            }
        }
    }
    (first, first_majorant)
}
