//! Walks the nodes of a glTF scene, and adds their meshes, cameras and lights to the description.

use super::super::mesh::{check_instance, extent};
use super::super::source_location::SourceLocation;
use super::super::warnings::Warnings;
use super::buffers::get;
use super::material::Materials;
use super::transform::Forest;
use super::{Document, Output};
use super::{camera, light, primitive, transform};
use crate::description::Instance;
use crate::error::SceneError;
use glam::DAffine3;
use std::collections::HashMap;

/// Reads everything in the scene.
pub fn read(document: &Document, output: &mut Output) -> Result<(), SceneError> {
    let Document { name, root, .. } = document;
    let forest = transform::forest(root, name)?;
    let starts = match root.scene {
        None => forest.roots.iter().map(|&root| (root, DAffine3::IDENTITY)).collect(),
        Some(index) => {
            let scene = get(&root.scenes, index, "scenes", &document.site("scene"))?;
            if root.scenes.len() > 1 {
                output.warnings.once("only the default scene is read; the file has others");
            }
            let site = document.site(format!("scenes[{index}].nodes"));
            starts(document, &scene.nodes, &forest, &site, &mut output.warnings)?
        }
    };
    let mut meshes = Meshes::default();
    let mut visit = |index: u32, world: DAffine3| {
        let Some(node) = root.nodes.get(index as usize) else { return Ok(()) };
        let site = document.site(format!("nodes[{index}]"));
        if let Some(camera) = node.camera {
            camera::read(document, output, camera, node.name.as_deref(), world, &site)?;
        }
        if let Some(mesh) = node.mesh {
            meshes.place(document, output, mesh, world, &site)?;
        }
        match node.extensions.as_deref().and_then(|extensions| extensions.light.as_ref()) {
            Some(light) => light::read(document, output, light.light, world, &site),
            None => Ok(()),
        }
    };
    for (start, place) in starts {
        transform::walk(root, start, place, name, &mut visit)?;
    }
    camera::distinguish(&mut output.description.cameras);
    Ok(())
}

/// Returns the nodes at which a scene begins, each with its parent's world transform.
///
/// The specification allows a scene to list roots only. A listed node below another one is drawn
/// where its parents place it, and each node is drawn once.
fn starts(
    document: &Document,
    nodes: &[u32],
    forest: &Forest,
    site: &SourceLocation,
    warnings: &mut Warnings,
) -> Result<Vec<(u32, DAffine3)>, SceneError> {
    let root = &document.root;
    let mut listed = vec![false; root.nodes.len()];
    let mut once = Vec::with_capacity(nodes.len());
    for &node in nodes {
        get(&root.nodes, node, "nodes", site)?;
        if std::mem::replace(&mut listed[node as usize], true) {
            warnings.tally("nodes that the scene names twice, drawn once", 1, &format!("nodes[{node}]"));
        } else {
            once.push(node);
        }
    }
    let mut starts = Vec::with_capacity(once.len());
    for node in once {
        if forest.ancestors(node).next().is_some() {
            let what =
                "nodes that the scene names but that are not roots, drawn where their parents place them";
            warnings.tally(what, 1, &format!("nodes[{node}]"));
        }
        if !forest.ancestors(node).any(|ancestor| listed[ancestor as usize]) {
            starts.push((node, forest.place_of_parent(root, node, document.name)?));
        }
    }
    Ok(starts)
}

/// The meshes that have been read, and their materials.
#[derive(Debug, Default)]
struct Meshes {
    /// Parts of a mesh by its index in the document: one for each primitive that has triangles.
    parts: HashMap<u32, Vec<Part>>,
    materials: Materials,
}

/// A mesh of the description, with its extent and its number of triangles.
#[derive(Clone, Copy, Debug)]
struct Part {
    mesh: usize,
    extent: f64,
    triangles: usize,
}

impl Meshes {
    /// Places a mesh in the world.
    fn place(
        &mut self,
        document: &Document,
        output: &mut Output,
        index: u32,
        world: DAffine3,
        user: &SourceLocation,
    ) -> Result<(), SceneError> {
        if !self.parts.contains_key(&index) {
            let parts = self.read(document, output, index, user)?;
            self.parts.insert(index, parts);
        }
        for &Part { mesh, extent, triangles } in self.parts.get(&index).into_iter().flatten() {
            if check_instance(extent, triangles, &world, &mut output.budget, user)? {
                output.description.instances.push(Instance { mesh, transform: world });
            } else {
                output.warnings.tally("instances that are scaled to nothing, left out", 1, &user.place);
            }
        }
        Ok(())
    }

    fn read(
        &mut self,
        document: &Document,
        output: &mut Output,
        index: u32,
        user: &SourceLocation,
    ) -> Result<Vec<Part>, SceneError> {
        let mesh = get(&document.root.meshes, index, "meshes", user)?;
        let mut parts = Vec::new();
        for (place, source) in mesh.primitives.iter().enumerate() {
            let site = document.site(format!("meshes[{index}].primitives[{place}]"));
            let material = self.materials.get(document, output, source.material, &site)?;
            let name = primitive::name(mesh.name.as_deref(), index, place, mesh.primitives.len());
            if let Some(part) = primitive::read(document, output, source, name, material, &site)? {
                let mesh = output.description.meshes.len();
                parts.push(Part { mesh, extent: extent(&part), triangles: part.triangles.len() });
                output.description.meshes.push(part);
            }
        }
        Ok(parts)
    }
}
