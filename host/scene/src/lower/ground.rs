//! Lowers the ground to a mesh whose vertices fade out.

use crate::description::{Alpha, Description, Instance, Lambertian, Material, Mesh};
use crate::ground::{ALBEDO, Disc, Ground};
use glam::{DAffine3, DMat3, DVec3};

/// Replaces the ground of a scene by a mesh, after all others.
pub(in super::super) fn place(scene: &mut Description) {
    let Some(ground) = scene.ground.take() else { return };
    let surface = Lambertian::rgb(ALBEDO, ALBEDO, ALBEDO);
    scene.materials.push(Material { alpha: Alpha::Blend, ..Material::from(surface).named("ground") });
    let Disc { positions, opacity, triangles } = Ground::disc();
    scene.meshes.push(Mesh {
        name: "ground".to_owned(),
        normals: vec![[0.0, 1.0, 0.0]; positions.len()],
        colors: opacity.into_iter().map(|opacity| [1.0, 1.0, 1.0, opacity]).collect(),
        positions,
        triangles,
        material: scene.materials.len() - 1,
        ..Mesh::default()
    });
    let matrix3 = DMat3::from_diagonal(DVec3::splat(ground.size));
    let transform = DAffine3 { matrix3, translation: ground.center };
    scene.instances.push(Instance { mesh: scene.meshes.len() - 1, transform });
}
