//! What the nodes of the scene show.

use super::super::mesh::{check_instance, extent};
use super::super::site::Site;
use super::buffers::get;
use super::material::Materials;
use super::{Document, Output};
use super::{camera, light, primitive, transform};
use crate::scene::description::Instance;
use crate::scene::error::SceneError;
use glam::DAffine3;
use std::collections::HashMap;

/// Reads all that is in the scene.
pub fn read(document: &Document, output: &mut Output) -> Result<(), SceneError> {
    let Document { name, root, .. } = document;
    let roots = transform::roots(root, name)?;
    let starts = match root.scene {
        None => roots,
        Some(index) => {
            let scene = get(&root.scenes, index, "scenes", &document.site("scene"))?;
            if root.scenes.len() > 1 {
                output.warnings.once("only the default scene is read; the file has others");
            }
            check_starts(&scene.nodes, &roots, &document.site(format!("scenes[{index}].nodes")))?;
            scene.nodes.clone()
        }
    };
    let mut meshes = Meshes::default();
    transform::walk(root, &starts, name, &mut |index, world| {
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
    })?;
    camera::distinguish(&mut output.description.cameras);
    Ok(())
}

/// Checks that a scene's nodes are roots, each there once; `roots` ascend.
fn check_starts(starts: &[u32], roots: &[u32], site: &Site) -> Result<(), SceneError> {
    let mut left = vec![true; roots.len()];
    for start in starts {
        let found = roots.binary_search(start).ok().and_then(|place| left.get_mut(place));
        if !found.is_some_and(std::mem::take) {
            return Err(site.malformed(
                format!("nodes[{start}] is no root, or is there twice"),
                "a scene must name nodes without parents, each once",
            ));
        }
    }
    Ok(())
}

/// The meshes that have been read.
#[derive(Debug, Default)]
struct Meshes {
    /// By the document's index: a part for each primitive that shows something.
    parts: HashMap<u32, Vec<Part>>,
    materials: Materials,
}

/// A mesh of the description.
#[derive(Clone, Copy, Debug)]
struct Part {
    mesh: usize,
    extent: f64,
    triangles: usize,
}

impl Meshes {
    /// Puts a mesh into the world.
    fn place(
        &mut self,
        document: &Document,
        output: &mut Output,
        index: u32,
        world: DAffine3,
        user: &Site,
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
        user: &Site,
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
