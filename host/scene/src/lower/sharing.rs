//! Decides which instances of a mesh share its triangles, and which get a copy of their own.

use super::super::description::{Description, Instance, Mesh};
use super::super::limits::is_in_reach;
use super::super::mesh_boxes::MeshBoxes;
use super::super::shared_meshes::Sharing;
use glam::DMat3;

/// Minimum number of triangles that sharing a mesh saves: below, its copies take less than 450 MiB
/// and a second or two to build, and rays among copies are faster (docs/notebook/instances.md).
const MIN_SAVED: u64 = 1 << 20;

/// Minimum number of triangles of a shared mesh: a ray passes into an instance in the time of about
/// ten nodes.
const MIN_TRIANGLES: usize = 256;

/// Maximum norm of a map into the world and of its inverse: a direction keeps so many bits in the
/// test of boxes that rounding does not decide (`slabs::MIN_COMPONENT`).
const MAX_SCALE: f64 = 16_777_216.0 * 1.8;

/// Maximum product of both norms: a map that bends angles further makes the offset of rays that
/// leave a surface large beside its triangles.
const MAX_CONDITION: f64 = 1e4;

/// Returns, for each instance, whether it shares the triangles of its mesh. A mesh that emits has a
/// copy for each instance, because each is a light of its own.
pub fn shared(description: &Description, sharing: Sharing) -> Vec<bool> {
    let mut uses = vec![0u64; description.meshes.len()];
    let boxes = MeshBoxes::of(description);
    let own: Vec<bool> = boxes.all().map(|(low, high)| is_in_reach(low) && is_in_reach(high)).collect();
    let able: Vec<bool> = description
        .instances
        .iter()
        .map(|instance| {
            let mesh = description.meshes.get(instance.mesh);
            let able = sharing != Sharing::Never
                && mesh.is_some_and(|mesh| fits(description, mesh, instance))
                && own[instance.mesh]
                && boxes.corners(instance).all(is_in_reach);
            if able {
                uses[instance.mesh] += 1;
            }
            able
        })
        .collect();
    let worth = |instance: &Instance| {
        let triangles = description.meshes.get(instance.mesh).map_or(0, |mesh| mesh.triangles.len());
        let copies = uses[instance.mesh] - 1;
        sharing == Sharing::Always
            || triangles >= MIN_TRIANGLES && copies.saturating_mul(triangles as u64) >= MIN_SAVED
    };
    description.instances.iter().zip(able).map(|(instance, able)| able && worth(instance)).collect()
}

/// Returns whether an instance can share its mesh.
fn fits(description: &Description, mesh: &Mesh, instance: &Instance) -> bool {
    let material = description.materials.get(mesh.material);
    let emits = material.is_none_or(|material| material.emission.max_element() > 0.0);
    !emits && !mesh.triangles.is_empty() && is_regular(instance.transform.matrix3)
}

/// Returns whether rays keep their precision on their way through a map.
fn is_regular(map: DMat3) -> bool {
    let norm = |m: DMat3| {
        let columns = [m.x_axis, m.y_axis, m.z_axis];
        columns.iter().map(|column| column.length_squared()).sum::<f64>().sqrt()
    };
    let (there, back) = (norm(map), norm(map.inverse()));
    // Comparisons with NaN are false.
    there <= MAX_SCALE && back <= MAX_SCALE && there * back <= MAX_CONDITION
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Material;
    use glam::{DAffine3, DVec3};

    fn scene(triangles: usize, count: usize) -> Description {
        let mesh = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]; triangles],
            ..Mesh::default()
        };
        let instance = Instance { mesh: 0, transform: DAffine3::IDENTITY };
        Description {
            materials: vec![Material::from(crate::builder::Lambertian::rgb(0.5, 0.5, 0.5))],
            meshes: vec![mesh],
            instances: vec![instance; count],
            ..Description::default()
        }
    }

    fn count(scene: &Description, sharing: Sharing) -> usize {
        shared(scene, sharing).into_iter().filter(|shared| *shared).count()
    }

    #[test]
    fn many_copies_are_shared() {
        let many = scene(1024, 1025);
        assert_eq!(count(&many, Sharing::Auto), 1025);
        assert_eq!(count(&many, Sharing::Never), 0);
        assert_eq!(count(&scene(1024, 1024), Sharing::Auto), 0);
        assert_eq!(count(&scene(2, 1 << 20), Sharing::Auto), 0);
        assert_eq!(count(&scene(2, 1), Sharing::Always), 1);
    }

    #[test]
    fn lights_and_bent_maps_are_copied() {
        let mut emitting = scene(1024, 257);
        emitting.materials[0].emission = DVec3::X;
        assert_eq!(count(&emitting, Sharing::Always), 0);
        let mut bent = scene(1024, 3);
        let scales = [
            DVec3::new(1e5, 1.0, 1.0),
            DVec3::new(-2f64.powi(20), 2f64.powi(20), 2f64.powi(20)),
            DVec3::ZERO,
        ];
        for (instance, scale) in bent.instances.iter_mut().zip(scales) {
            instance.transform = DAffine3::from_scale(scale);
        }
        assert_eq!(shared(&bent, Sharing::Always), [false, true, false]);
    }
}
