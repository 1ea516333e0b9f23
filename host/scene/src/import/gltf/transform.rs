//! Walk over the trees that glTF nodes form.

use super::super::source_location::SourceLocation;
use super::motion::Pose;
use crate::error::SceneError;
use glam::DAffine3;

/// Maximum depth of the node hierarchy.
const MAX_DEPTH: usize = 256;

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
    pub fn place_of_parent(&self, pose: &Pose, node: u32) -> Result<DAffine3, SceneError> {
        self.ancestors(node).try_fold(DAffine3::IDENTITY, |world, ancestor| Ok(pose.local(ancestor)? * world))
    }

    /// Returns the world transforms of all nodes.
    pub fn worlds(&self, pose: &Pose) -> Result<Vec<DAffine3>, SceneError> {
        let mut worlds = vec![DAffine3::IDENTITY; pose.root().nodes.len()];
        for &root in &self.roots {
            walk(pose, root, DAffine3::IDENTITY, &mut |index, world| {
                worlds[index as usize] = world;
                Ok(true)
            })?;
        }
        Ok(worlds)
    }
}

/// Checks that the nodes form trees of bounded depth.
pub fn forest(pose: &Pose) -> Result<Forest, SceneError> {
    let (root, name) = (pose.root(), pose.name());
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
        walk(pose, start, DAffine3::IDENTITY, &mut |index, _| {
            met[index as usize] = true;
            Ok(true)
        })?;
    }
    match met.iter().position(|met| !met) {
        None => Ok(Forest { roots, parents }),
        Some(index) => Err(SourceLocation::new(name, format!("nodes[{index}]"))
            .malformed("it is its own descendant, or below such a node", "nodes must form trees")),
    }
}

/// Visits a node and all nodes below it, with their world transforms, except those below a node for
/// which `visit` returns false; `place` is the parent's transform. If there is a cycle below, the
/// limit of depth ends the walk with an error.
pub fn walk(
    pose: &Pose,
    start: u32,
    place: DAffine3,
    visit: &mut dyn FnMut(u32, DAffine3) -> Result<bool, SceneError>,
) -> Result<(), SceneError> {
    let mut path = vec![(std::slice::from_ref(&start).iter(), place)];
    while let Some((siblings, parent)) = path.last_mut() {
        let Some(&index) = siblings.next() else {
            path.pop();
            continue;
        };
        let Some(node) = pose.root().nodes.get(index as usize) else { continue };
        let site = SourceLocation::new(pose.name(), format!("nodes[{index}]"));
        let world = *parent * pose.local(index)?;
        if !world.is_finite() {
            return Err(site.malformed("its transform to the world is not finite", "use smaller numbers"));
        }
        if visit(index, world)? && !node.children.is_empty() {
            if path.len() >= MAX_DEPTH {
                return Err(site.too_large("nodes are nested too deep", format!("{MAX_DEPTH} levels")));
            }
            path.push((node.children.iter(), world));
        }
    }
    Ok(())
}
