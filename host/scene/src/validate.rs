//! Checks what kernels rely on when they read without bounds checks.

use super::medium::MAX_MEDIA;
use super::{Scene, SceneError};
use trisect_shared::attributes::MeshVertex;
use trisect_shared::bsdf::LAYERED;
use trisect_shared::bvh::Child;
use trisect_shared::medium::{CELL, CLEAR, HAS_GRID};
use trisect_shared::texture::NO_TEXTURE;

impl Scene {
    /// Checks every index that a kernel follows: each primitive's material, each material's
    /// textures, each texture's texels and the panorama's aliases, each triangle's vertices. A
    /// loaded scene passes; one that was changed since may not.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.broken()
            .map_or(Ok(()), |message| Err(SceneError::Inconsistent { file: self.name.clone(), message }))
    }

    /// Returns what is wrong with a vertex of a triangle, if something is.
    fn broken_vertex(&self) -> Option<String> {
        let (vertices, materials) = (self.vertices.len(), self.materials.len());
        for t in self.triangles.iter().chain(&self.shared.triangles) {
            for index in [t.vertex_a, t.vertex_b, t.vertex_c] {
                let Some(vertex) = self.vertices.get(index as usize) else {
                    return Some(format!("a triangle has vertex {index}, but there are {vertices} vertices"));
                };
                let MeshVertex { material, attributes, .. } = *vertex;
                if material as usize >= materials {
                    return Some(format!(
                        "vertex {index} has material {material}, but there are {materials} materials"
                    ));
                }
                if attributes as usize >= vertices {
                    return Some(format!(
                        "vertex {index} has attributes {attributes}, but there are {vertices} vertices"
                    ));
                }
            }
        }
        None
    }

    /// Returns what is wrong with a medium or the number of one, if something is.
    fn broken_medium(&self) -> Option<String> {
        let count = self.media.len();
        let known = |id: u32| id as usize <= count;
        if count > MAX_MEDIA || !known(self.atmosphere) {
            return Some(format!(
                "{count} media, at most {MAX_MEDIA}, of which {} is around",
                self.atmosphere
            ));
        }
        let numbers = self.materials.iter().map(|material| material.medium);
        if let Some(id) = numbers.into_iter().find(|&id| !known(id) && (id != CLEAR || count == 0)) {
            return Some(format!("a material bounds medium {id}, but there are {count}"));
        }
        let texels = self.texels.len() as u64;
        for (index, medium) in self.media.iter().enumerate() {
            let size = [medium.width, medium.height, medium.depth];
            let voxels = size.iter().map(|&n| u64::from(n)).try_fold(1u64, u64::checked_mul);
            let cells: u64 = size.iter().map(|&n| u64::from(n.div_ceil(CELL))).fold(1, u64::saturating_mul);
            let ends = voxels.and_then(|voxels| {
                let voxels = voxels.checked_add(u64::from(medium.first_density))?;
                Some(voxels.max(cells.checked_add(u64::from(medium.first_majorant))?))
            });
            let is_there =
                size.iter().all(|n| (1..=1 << 30).contains(n)) && ends.is_some_and(|end| end <= texels);
            if medium.flags & HAS_GRID != 0 && !is_there {
                return Some(format!("the grid of medium {} is not among the {texels} texels", index + 1));
            }
        }
        None
    }

    fn broken(&self) -> Option<String> {
        let materials = self.materials.len();
        let used = self.spheres.iter().map(|s| s.material);
        let used = used.chain(self.flats.iter().map(|f| f.material));
        let mut used = used.enumerate();
        if let Some((index, material)) = used.find(|&(_, material)| material as usize >= materials) {
            return Some(format!(
                "primitive {index} has material {material}, but there are {materials} materials"
            ));
        }
        let numbered = self.primitives() + self.shared.instances.len();
        if numbered > Child::MAX_INDEX as usize {
            return Some(format!("{numbered} primitives and instances; at most {} fit", Child::MAX_INDEX));
        }
        if let Some(message) = self.shared.broken() {
            return Some(message);
        }
        if let Some(message) = self.broken_vertex() {
            return Some(message);
        }
        let textures = self.textures.len();
        for (index, m) in self.materials.iter().enumerate() {
            if let Some(texture) = m.textures().iter().find(|&&t| t != NO_TEXTURE && t as usize >= textures) {
                return Some(format!(
                    "material {index} has texture {texture}, but there are {textures} textures"
                ));
            }
        }
        let layers = self.layers.len();
        for (index, m) in self.materials.iter().enumerate() {
            let is_layered = m.kind == LAYERED;
            if m.layers as usize > layers || is_layered && m.layers == 0 {
                return Some(format!("material {index} has layers {}, but there are {layers}", m.layers));
            }
        }
        for (index, (_, of)) in self.layers.iter().enumerate() {
            if let Some(texture) = of.all().iter().find(|&&t| t != NO_TEXTURE && t as usize >= textures) {
                return Some(format!(
                    "layers {index} have texture {texture}, but there are {textures} textures"
                ));
            }
        }
        for (index, t) in self.textures.iter().enumerate() {
            let end = u64::from(t.first) + u64::from(t.width) * u64::from(t.height);
            // Sizes are at most 2³⁰, because kernels compute with twice the size.
            let sizes = 1..=1 << 30;
            if !sizes.contains(&t.width) || !sizes.contains(&t.height) || end > self.texels.len() as u64 {
                return Some(format!("texture {index} ends at texel {end} of {}", self.texels.len()));
            }
        }
        if self.texels.len() > u32::MAX as usize {
            return Some(format!("{} texels; at most {} fit", self.texels.len(), u32::MAX));
        }
        if let Some(message) = self.broken_medium() {
            return Some(message);
        }
        let environment = self.environment.as_ref()?;
        let count = u64::from(environment.width) * u64::from(environment.height);
        let aliases = environment.texels.iter().all(|texel| u64::from(texel.alias) < count);
        if count == 0 || count > 1 << 30 || count != environment.texels.len() as u64 || !aliases {
            return Some(format!(
                "the panorama has {} texels for a size of {count} (at most 2^30), or its alias table is invalid",
                environment.texels.len()
            ));
        }
        None
    }
}
