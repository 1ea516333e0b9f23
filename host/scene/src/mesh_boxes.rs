//! Bounding boxes of meshes, and which instances are examined vertex by vertex: many instances of a
//! large mesh would take longer to examine than to render.

use super::description::{Description, Instance, Mesh};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Maximum number of vertices or triangles, counted for each instance, that are all examined.
const MAX_EXAMINED: usize = 1 << 24;

/// Bounding box of each mesh of a description, in the mesh's coordinates.
pub(crate) struct MeshBoxes(Vec<(DVec3, DVec3)>);

impl MeshBoxes {
    /// Computes the boxes.
    pub fn of(scene: &Description) -> Self {
        Self(scene.meshes.iter().map(of_mesh).collect())
    }

    /// Returns the minimum and the maximum corner of each mesh.
    pub fn all(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.0.iter().copied()
    }

    /// Returns the corners of the box of an instance's mesh, in the world; none for a mesh without
    /// vertices.
    pub fn corners(&self, instance: &Instance) -> impl Iterator<Item = DVec3> + use<> {
        let transform = instance.transform;
        let ends = self.0.get(instance.mesh).copied().filter(|(low, high)| low.cmple(*high).all());
        ends.into_iter().flat_map(move |(low, high)| {
            (0..8).map(move |i| {
                let pick = |bit: u32, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
                transform.transform_point3(DVec3::new(
                    pick(0, low.x, high.x),
                    pick(1, low.y, high.y),
                    pick(2, low.z, high.z),
                ))
            })
        })
    }

    /// Returns the points that bound an instance: its vertices or, if the scene `is_large`, the
    /// corners of its box.
    pub fn points<'a>(
        &self,
        scene: &'a Description,
        instance: &'a Instance,
        is_large: bool,
    ) -> Box<dyn Iterator<Item = DVec3> + 'a> {
        if is_large {
            return Box::new(self.corners(instance));
        }
        let positions = scene.meshes.get(instance.mesh).map_or(&[][..], |mesh| &mesh.positions);
        let world = |p: &[f32; 3]| instance.transform.transform_point3(Vec3::from(*p).as_dvec3());
        Box::new(positions.iter().map(world))
    }
}

/// Returns the bounding box of a mesh; low above high if it has no vertices.
pub(crate) fn of_mesh(mesh: &Mesh) -> (DVec3, DVec3) {
    let points = mesh.positions.iter().map(|p| Vec3::from(*p));
    let (low, high) =
        points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    (low.as_dvec3(), high.as_dvec3())
}

/// Returns the number of vertices and triangles of a mesh.
fn size(scene: &Description, mesh: usize) -> usize {
    scene.meshes.get(mesh).map_or(0, |mesh| mesh.positions.len().saturating_add(mesh.triangles.len()))
}

/// Returns whether the scene has too many vertices to examine them for each instance: beyond those
/// of one instance of each mesh, which took as long to read.
pub(crate) fn is_large(scene: &Description) -> bool {
    let all = scene.instances.iter().map(|instance| size(scene, instance.mesh));
    let once = (0..scene.meshes.len()).map(|mesh| size(scene, mesh)).fold(0, usize::saturating_add);
    all.fold(0, usize::saturating_add) > once.saturating_add(MAX_EXAMINED)
}

/// Returns every `n`-th of the instances that `counts` chooses, with the least `n` for which few
/// enough triangles are examined.
pub(crate) fn sampled(
    scene: &Description,
    counts: impl Fn(&Instance) -> bool,
) -> impl Iterator<Item = &Instance> {
    let chosen: Vec<&Instance> = scene.instances.iter().filter(|instance| counts(instance)).collect();
    let all = chosen.iter().map(|instance| size(scene, instance.mesh)).fold(0, usize::saturating_add);
    chosen.into_iter().step_by(all.div_ceil(MAX_EXAMINED).max(1))
}

/// Returns the indices of the instances to examine for findings: all, or of each mesh in a large
/// scene the instance farthest from the origin, the smallest, and the largest.
pub(crate) fn examined(scene: &Description) -> Vec<usize> {
    if !is_large(scene) {
        return (0..scene.instances.len()).collect();
    }
    let mut extremes: HashMap<usize, [(f64, usize); 3]> = HashMap::new();
    for (index, instance) in scene.instances.iter().enumerate() {
        let matrix = instance.transform.matrix3;
        let scales = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
        let least = scales.into_iter().fold(f64::INFINITY, f64::min);
        let greatest = scales.into_iter().fold(0.0, f64::max);
        let measures = [instance.transform.translation.length(), -least, greatest];
        let worst = extremes.entry(instance.mesh).or_insert([(f64::NEG_INFINITY, index); 3]);
        for (worst, measure) in worst.iter_mut().zip(measures) {
            if measure > worst.0 {
                *worst = (measure, index);
            }
        }
    }
    let mut all: Vec<usize> = extremes.into_values().flatten().map(|(_, index)| index).collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;

    #[test]
    fn large_scenes_are_examined_at_their_extremes() {
        let mesh = Mesh { positions: vec![[1.0, 2.0, 3.0]; 1 << 16], ..Mesh::default() };
        let at = |i: usize| Instance {
            mesh: 0,
            transform: DAffine3::from_scale_rotation_translation(
                DVec3::splat(if i == 77 { 0.5 } else { 1.0 }),
                glam::DQuat::IDENTITY,
                DVec3::X * if i == 200 { 9.0 } else { 1.0 },
            ),
        };
        let mut scene = Description {
            meshes: vec![mesh],
            instances: (0..1000).map(at).collect(),
            ..Description::default()
        };
        assert!(is_large(&scene));
        assert_eq!(examined(&scene), [0, 77, 200]);
        assert_eq!(sampled(&scene, |_| true).count(), 250);
        // Those that count are not missed between others.
        let far = |instance: &Instance| instance.transform.translation.x == 9.0;
        assert_eq!(sampled(&scene, far).count(), 1);
        let boxes = MeshBoxes::of(&scene);
        assert_eq!(boxes.points(&scene, &scene.instances[77], true).next(), Some(DVec3::new(1.5, 1.0, 1.5)));
        scene.instances.truncate(100);
        assert_eq!((examined(&scene).len(), sampled(&scene, |_| true).count()), (100, 100));
        assert_eq!(boxes.points(&scene, &scene.instances[7], false).count(), 1 << 16);
    }
}
