//! Transforms of glTF nodes, and the walk over the trees that nodes form.

use super::super::source_location::SourceLocation;
use super::json::{Node, Root};
use crate::error::SceneError;
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};

/// Maximum depth of the node hierarchy.
const MAX_DEPTH: usize = 256;

/// Returns a node's transform relative to its parent.
pub fn local(node: &Node, site: &SourceLocation) -> Result<DAffine3, SceneError> {
    if let Some(matrix) = node.matrix.as_deref() {
        let matrix = DMat4::from_cols_array(matrix);
        let last = matrix.row(3);
        if !(last - DVec4::W).abs().cmple(DVec4::splat(1e-6)).all() {
            let problem = format!("the last row of the matrix is {last}");
            return Err(site.malformed(problem, "it must be 0, 0, 0, 1: elements 3, 7, 11 and 15"));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    let vector =
        |source: &Option<Box<[f64; 3]>>, otherwise| source.as_deref().map_or(otherwise, |v| DVec3::from(*v));
    let rotation = match node.rotation.as_deref() {
        None => DQuat::IDENTITY,
        Some(rotation) => {
            let length = DVec4::from(*rotation).length();
            if !(1e-6..1e6).contains(&length) {
                let problem = format!("the rotation's length is {length}");
                return Err(site.malformed(problem, "it must be a unit quaternion"));
            }
            DQuat::from_vec4(DVec4::from(*rotation) / length)
        }
    };
    let (scale, translation) = (vector(&node.scale, DVec3::ONE), vector(&node.translation, DVec3::ZERO));
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// Stands for no node.
const NONE: u32 = u32::MAX;

/// The trees of nodes.
#[derive(Debug)]
pub struct Forest {
    /// Nodes without a parent.
    pub roots: Vec<u32>,
    parents: Vec<u32>,
}

impl Forest {
    /// Returns the ancestors of a node, its parent first.
    pub fn ancestors(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let parent = |&node: &u32| self.parents.get(node as usize).copied().filter(|&parent| parent != NONE);
        std::iter::successors(Some(node), parent).skip(1)
    }

    /// Returns the world transform of a node's parent.
    pub fn place_of_parent(&self, root: &Root, node: u32, name: &str) -> Result<DAffine3, SceneError> {
        let mut world = DAffine3::IDENTITY;
        for ancestor in self.ancestors(node) {
            if let Some(node) = root.nodes.get(ancestor as usize) {
                world = local(node, &SourceLocation::new(name, format!("nodes[{ancestor}]")))? * world;
            }
        }
        Ok(world)
    }
}

/// Checks that the nodes form trees of bounded depth.
pub fn forest(root: &Root, name: &str) -> Result<Forest, SceneError> {
    let mut parents = vec![NONE; root.nodes.len()];
    for (index, node) in root.nodes.iter().enumerate() {
        let site = SourceLocation::new(name, format!("nodes[{index}].children"));
        for &child in &node.children {
            super::buffers::get(&root.nodes, child, "nodes", &site)?;
            let parent = &mut parents[child as usize];
            if *parent != NONE {
                let problem = format!("nodes[{child}] is a child of nodes[{parent}] already");
                return Err(site.malformed(problem, "a node must have one parent"));
            }
            *parent = index as u32;
        }
    }
    let roots: Vec<u32> =
        (0..).zip(&parents).filter(|(_, parent)| **parent == NONE).map(|(index, _)| index).collect();
    // Each node has at most one parent, so a walk down from the roots meets every node once, except
    // those in or below a cycle.
    let mut met = vec![false; root.nodes.len()];
    for &start in &roots {
        walk(root, start, DAffine3::IDENTITY, name, &mut |index, _| {
            met[index as usize] = true;
            Ok(())
        })?;
    }
    match met.iter().position(|met| !met) {
        None => Ok(Forest { roots, parents }),
        Some(index) => Err(SourceLocation::new(name, format!("nodes[{index}]"))
            .malformed("it is its own descendant, or below such a node", "nodes must form trees")),
    }
}

/// Visits a node and all nodes below it, with their world transforms; `place` is the parent's. If
/// there is a cycle below, the limit of depth ends the walk with an error.
pub fn walk(
    root: &Root,
    start: u32,
    place: DAffine3,
    name: &str,
    visit: &mut dyn FnMut(u32, DAffine3) -> Result<(), SceneError>,
) -> Result<(), SceneError> {
    let mut path = vec![(std::slice::from_ref(&start).iter(), place)];
    while let Some((siblings, parent)) = path.last_mut() {
        let Some(&index) = siblings.next() else {
            path.pop();
            continue;
        };
        let Some(node) = root.nodes.get(index as usize) else { continue };
        let site = SourceLocation::new(name, format!("nodes[{index}]"));
        let world = *parent * local(node, &site)?;
        if !world.is_finite() {
            return Err(site.malformed("its transform to the world is not finite", "use smaller numbers"));
        }
        visit(index, world)?;
        if !node.children.is_empty() {
            if path.len() >= MAX_DEPTH {
                return Err(site.too_large("nodes are nested too deep", format!("{MAX_DEPTH} levels")));
            }
            path.push((node.children.iter(), world));
        }
    }
    Ok(())
}
