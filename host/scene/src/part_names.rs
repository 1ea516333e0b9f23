//! Names of a scene's parts as in the scene file, for findings and messages.

use crate::description::{Description, Shape, ShapeKind};
use std::collections::{HashMap, HashSet};

/// Names of an object and of its material, as in the scene's file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartName {
    /// Name of the object: its field `name`, else its place in the file, or the name of its mesh.
    pub object: String,
    /// Name of the material.
    pub material: String,
}

/// Returns the names of spheres, then of quads and discs, then of instances.
pub(crate) fn all(scene: &Description) -> Vec<PartName> {
    let material = |index: usize| match scene.materials.get(index) {
        Some(material) if !material.name.is_empty() => material.name.clone(),
        _ => format!("material {index}"),
    };
    let object = |objects: &[usize], index: usize| {
        let object = *objects.get(index)?;
        Some(
            scene.object_names.get(object).cloned().flatten().unwrap_or_else(|| format!("objects[{object}]")),
        )
    };
    let is_sphere = |shape: &&(usize, &Shape)| matches!(shape.1.kind, ShapeKind::Sphere { .. });
    let shapes: Vec<(usize, &Shape)> = scene.shapes.iter().enumerate().collect();
    let shapes = shapes.iter().filter(is_sphere).chain(shapes.iter().filter(|shape| !is_sphere(shape)));
    let shapes = shapes.map(|(index, shape)| PartName {
        object: object(&scene.shape_objects, *index).unwrap_or_else(|| format!("shape {index}")),
        material: material(shape.material),
    });
    let mut taken: HashSet<String> = HashSet::new();
    let mut counts: HashMap<String, u32> = HashMap::new();
    let instances = scene.instances.iter().enumerate().map(|(index, instance)| {
        let mesh = scene.meshes.get(instance.mesh);
        let name = match mesh.map_or("", |mesh| mesh.name.as_str()) {
            "" => format!("mesh {}", instance.mesh),
            name => name.to_owned(),
        };
        // An object without a name of its own may be a model of several parts.
        let has_name = scene
            .instance_objects
            .get(index)
            .is_some_and(|object| scene.object_names.get(*object).is_some_and(Option::is_some));
        let is_nameless = mesh.is_none_or(|mesh| mesh.name.is_empty());
        let of_file = object(&scene.instance_objects, index).filter(|_| has_name || is_nameless);
        let object = of_file.unwrap_or_else(|| {
            // Instances of one mesh, or of meshes of one name, have numbers from the second on.
            let next = counts.entry(name.clone()).or_insert(1);
            let mut own = name.clone();
            while !taken.insert(own.clone()) {
                *next += 1;
                own = format!("{name} {next}");
            }
            own
        });
        PartName { object, material: material(mesh.map_or(usize::MAX, |mesh| mesh.material)) }
    });
    shapes.chain(instances).collect()
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Instance, Mesh};
    use glam::DAffine3;

    /// Instances of a model have names of their own, whatever their meshes are called.
    #[test]
    fn instances_have_names_of_their_own() {
        let mesh = |name: &str| Mesh { name: name.to_owned(), ..Mesh::default() };
        let meshes = vec![mesh("a"), mesh("a 2"), mesh("")];
        let instance = |mesh| Instance { mesh, transform: DAffine3::IDENTITY };
        let instances = [0, 1, 0, 0, 2].map(instance).to_vec();
        let scene = Description { meshes, instances, ..Description::default() };
        let names: Vec<String> = all(&scene).into_iter().map(|name| name.object).collect();
        assert_eq!(names, ["a", "a 2", "a 3", "a 4", "mesh 2"]);
    }
}
