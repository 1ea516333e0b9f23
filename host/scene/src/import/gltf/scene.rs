//! Walks the nodes of a glTF scene, and adds their meshes, cameras and lights to the description.

use super::super::mesh::{check_instance, extent};
use super::super::source_location::SourceLocation;
use super::super::warnings::Warnings;
use super::buffers::get;
use super::material::Materials;
use super::motion::skin::{self, Skin};
use super::motion::{self, Chosen, Deformation, Pose};
use super::transform::Forest;
use super::{Document, Output};
use super::{camera, instancing, light, primitive, transform};
use crate::description::Instance;
use crate::error::SceneError;
use crate::import::ModelOptions;
use glam::DAffine3;
use std::collections::HashMap;

/// Reads everything in the scene, with its nodes as an animation moves them, as `options` choose.
pub fn read(
    document: &Document,
    output: &mut Output,
    chosen: Option<Chosen>,
    options: &ModelOptions,
) -> Result<(), SceneError> {
    let Document { root, .. } = document;
    let pose = motion::pose(document, output, chosen)?;
    let forest = transform::forest(&pose)?;
    let starts = match root.scene {
        None => forest.roots.iter().map(|&root| (root, DAffine3::IDENTITY)).collect(),
        Some(index) => {
            let scene = get(&root.scenes, index, "scenes", &document.site("scene"))?;
            if root.scenes.len() > 1 {
                output.warnings.once("only the default scene is read; the file has others");
            }
            let site = document.site(format!("scenes[{index}].nodes"));
            starts(&pose, &scene.nodes, &forest, &site, &mut output.warnings)?
        }
    };
    let skinned = root.nodes.iter().any(|node| node.skin.is_some());
    let worlds = if skinned { forest.worlds(&pose)? } else { Vec::new() };
    let materials = Materials::of(document, output, options)?;
    let mut meshes = Meshes { materials, worlds, pose: &pose, parts: HashMap::new() };
    let mut visit = |index: u32, world: DAffine3| {
        let Some(node) = root.nodes.get(index as usize) else { return Ok(true) };
        let site = document.site(format!("nodes[{index}]"));
        let extensions = node.extensions.as_deref();
        if !pose.is_visible(index) {
            return Ok(false);
        }
        if let Some(camera) = node.camera {
            camera::read(document, output, camera, node.name.as_deref(), world, &site)?;
        }
        if let Some(mesh) = node.mesh {
            meshes.place(document, output, (index, mesh), world, &site)?;
        }
        if let Some(light) = extensions.and_then(|extensions| extensions.light.as_ref()) {
            light::read(document, output, light.light, world, &site)?;
        }
        Ok(true)
    };
    for (start, place) in starts {
        transform::walk(&pose, start, place, &mut visit)?;
    }
    camera::distinguish(&mut output.description.cameras);
    Ok(())
}

/// Returns the nodes at which a scene begins, each with its parent's world transform.
///
/// The specification allows a scene to list roots only. A listed node below another one is drawn
/// where its parents place it, and each node is drawn once.
fn starts(
    pose: &Pose,
    nodes: &[u32],
    forest: &Forest,
    site: &SourceLocation,
    warnings: &mut Warnings,
) -> Result<Vec<(u32, DAffine3)>, SceneError> {
    let root = pose.root();
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
            starts.push((node, forest.place_of_parent(pose, node)?));
        }
    }
    Ok(starts)
}

/// The meshes that have been read, and their materials.
#[derive(Debug)]
struct Meshes<'a> {
    /// Parts of a mesh in a shape: one for each primitive that has triangles.
    parts: HashMap<Form, Vec<Part>>,
    materials: Materials,
    pose: &'a Pose<'a>,
    /// World transforms of all nodes; empty if no node has a skin.
    worlds: Vec<DAffine3>,
}

/// A mesh of the document in one of its shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Form {
    /// The mesh of this index, without morph targets and skin.
    Plain(u32),
    /// The mesh of the node of this index, as its weights and joints move it.
    Deformed(u32),
}

/// A mesh of the description, with its extent and its number of triangles.
#[derive(Clone, Copy, Debug)]
struct Part {
    mesh: usize,
    extent: f64,
    triangles: usize,
}

impl Meshes<'_> {
    /// Places the mesh of a node in the world.
    fn place(
        &mut self,
        document: &Document,
        output: &mut Output,
        (node, mesh): (u32, u32),
        world: DAffine3,
        user: &SourceLocation,
    ) -> Result<(), SceneError> {
        let source = document.root.nodes.get(node as usize);
        let skin = source.and_then(|node| node.skin);
        let weights = self.pose.weights(node);
        let form = match skin.is_some() || weights.iter().any(|weight| *weight != 0.0) {
            true => Form::Deformed(node),
            false => Form::Plain(mesh),
        };
        if !self.parts.contains_key(&form) {
            let joints = match skin {
                Some(skin) => Some(skin::joints(document, output, skin, &self.worlds, user)?),
                None => None,
            };
            let skin = joints.as_deref().map(|joints| Skin { joints, node: world });
            let parts = self.read(document, output, mesh, Deformation { weights, skin }, user)?;
            self.parts.insert(form, parts);
        }
        let instancing = source.and_then(|node| node.extensions.as_deref()?.instancing.as_ref());
        let places = match instancing {
            Some(instancing) => instancing::read(document, output, instancing, user)?,
            None => vec![DAffine3::IDENTITY],
        };
        // Joints move a mesh to the world, wherever its node is.
        let world = if skin.is_some() { DAffine3::IDENTITY } else { world };
        for &Part { mesh, extent, triangles } in self.parts.get(&form).into_iter().flatten() {
            for place in &places {
                let transform = world * *place;
                if check_instance(extent, triangles, &transform, &mut output.budget, user)? {
                    output.description.instances.push(Instance { mesh, transform });
                } else {
                    output.warnings.tally("instances that are scaled to nothing, left out", 1, &user.place);
                }
            }
        }
        Ok(())
    }

    fn read(
        &mut self,
        document: &Document,
        output: &mut Output,
        index: u32,
        deformation: Deformation,
        user: &SourceLocation,
    ) -> Result<Vec<Part>, SceneError> {
        let mesh = get(&document.root.meshes, index, "meshes", user)?;
        let mut parts = Vec::new();
        for (place, source) in mesh.primitives.iter().enumerate() {
            let site = document.site(format!("meshes[{index}].primitives[{place}]"));
            let material = self.materials.of_primitive(document, output, source, &site)?;
            let name = primitive::name(mesh.name.as_deref(), index, place, mesh.primitives.len());
            if let Some(part) = primitive::read(document, output, source, name, material, deformation, &site)?
            {
                let mesh = output.description.meshes.len();
                parts.push(Part { mesh, extent: extent(&part), triangles: part.triangles.len() });
                output.description.meshes.push(part);
            }
        }
        Ok(parts)
    }
}
