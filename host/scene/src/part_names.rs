//! Names of a scene's parts as in the scene file, for findings and messages.

use crate::description::{Description, Shape, ShapeKind};

/// Returns the name of an analytic shape.
pub(crate) fn shape(scene: &Description, index: usize, shape: &Shape) -> String {
    let kind = match shape.kind {
        ShapeKind::Sphere { .. } => "a sphere",
        ShapeKind::Quad { .. } => "a quad",
        ShapeKind::Disc { .. } if shape.kind.is_plane() => "a plane",
        ShapeKind::Disc { .. } => "a disc",
    };
    let place = match scene.shape_objects.get(index) {
        Some(object) => format!("objects[{object}]"),
        None => format!("shape {index}"),
    };
    let material = scene.materials.get(shape.material).map_or("", |material| &material.name);
    format!("{place}, {kind} of \"{material}\"")
}

/// Returns the name of a mesh instance.
pub(crate) fn instance(scene: &Description, index: usize) -> String {
    let mesh = scene.instances.get(index).and_then(|instance| scene.meshes.get(instance.mesh));
    let name = mesh.map_or("", |mesh| &mesh.name);
    match scene.instance_objects.get(index) {
        Some(object) => format!("objects[{object}], mesh \"{name}\""),
        None => format!("mesh \"{name}\""),
    }
}

/// Returns the name of a material.
pub(crate) fn material(name: &str) -> String {
    format!("material \"{name}\"")
}

/// Returns the name of a medium.
pub(crate) fn medium(name: &str) -> String {
    format!("medium \"{name}\"")
}

/// Returns the name of a light without extent. Those of a scene file have the first indices.
pub(crate) fn light(index: usize) -> String {
    format!("lights[{index}]")
}
