//! Pose: the transforms of nodes and the weights of morph targets at a time.

use super::super::super::source_location::SourceLocation;
use super::super::json::{Node, Root};
use crate::error::SceneError;
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};
use std::collections::HashMap;

/// Pose of a document's nodes: what the file states, and what an animation puts in its place.
#[derive(Debug)]
pub struct Pose<'a> {
    root: &'a Root,
    name: &'a str,
    moved: HashMap<u32, Moved>,
}

/// Numbers that an animation puts in the place of a node's own numbers.
#[derive(Clone, Debug, Default)]
pub struct Moved {
    pub translation: Option<DVec3>,
    pub rotation: Option<DQuat>,
    pub scale: Option<DVec3>,
    pub weights: Option<Vec<f64>>,
    pub visible: Option<bool>,
}

impl<'a> Pose<'a> {
    /// Returns the pose that the file states; `name` stands for it in messages.
    pub fn at_rest(root: &'a Root, name: &'a str) -> Self {
        Self { root, name, moved: HashMap::new() }
    }

    /// Returns what moves a node, to be changed.
    pub fn of(&mut self, node: u32) -> &mut Moved {
        self.moved.entry(node).or_default()
    }

    /// Returns a node's transform relative to its parent; the identity for a node that does not
    /// exist.
    pub fn local(&self, index: u32) -> Result<DAffine3, SceneError> {
        let Some(node) = self.root.nodes.get(index as usize) else { return Ok(DAffine3::IDENTITY) };
        let site = SourceLocation::new(self.name, format!("nodes[{index}]"));
        let own = local(node, &site)?;
        let Some(moved) = self.moved.get(&index) else { return Ok(own) };
        if moved.translation.is_none() && moved.rotation.is_none() && moved.scale.is_none() {
            return Ok(own);
        }
        // Only a node without a matrix should be moved; of a matrix the parts are taken, if it has
        // any.
        let (scale, rotation, translation) = match node.matrix {
            Some(_) if own.matrix3.determinant() != 0.0 => own.to_scale_rotation_translation(),
            Some(_) => (DVec3::ONE, DQuat::IDENTITY, own.translation),
            None => parts(node, &site)?,
        };
        Ok(DAffine3::from_scale_rotation_translation(
            moved.scale.unwrap_or(scale),
            moved.rotation.unwrap_or(rotation),
            moved.translation.unwrap_or(translation),
        ))
    }

    /// Returns the weights of the morph targets of a node's mesh: those of the animation, of the
    /// node or of the mesh. All others are 0.
    pub fn weights(&self, node: u32) -> &[f64] {
        let of = self.root.nodes.get(node as usize);
        let own = of.and_then(|node| node.weights.as_deref());
        let mesh = of.and_then(|node| self.root.meshes.get(node.mesh? as usize));
        let moved = self.moved.get(&node).and_then(|moved| moved.weights.as_deref());
        moved.or(own).or(mesh.and_then(|mesh| mesh.weights.as_deref())).unwrap_or_default()
    }

    /// Returns whether a node, and what is below it, is drawn (KHR_node_visibility).
    pub fn is_visible(&self, node: u32) -> bool {
        let own = self.root.nodes.get(node as usize).and_then(|node| node.extensions.as_deref());
        let own = own.and_then(|of| of.visibility.as_ref()).is_none_or(|of| of.visible);
        self.moved.get(&node).and_then(|moved| moved.visible).unwrap_or(own)
    }

    /// Returns the document.
    pub fn root(&self) -> &'a Root {
        self.root
    }

    /// Returns the name of the file, for messages.
    pub fn name(&self) -> &'a str {
        self.name
    }
}

/// Returns a node's transform relative to its parent.
fn local(node: &Node, site: &SourceLocation) -> Result<DAffine3, SceneError> {
    if let Some(matrix) = node.matrix.as_deref() {
        let matrix = DMat4::from_cols_array(matrix);
        let last = matrix.row(3);
        if !(last - DVec4::W).abs().cmple(DVec4::splat(1e-6)).all() {
            let problem = format!("the last row of the matrix is {last}");
            return Err(site.malformed(problem, "it must be 0, 0, 0, 1: elements 3, 7, 11 and 15"));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    let (scale, rotation, translation) = parts(node, site)?;
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// Returns scale, rotation and translation of a node without a matrix.
fn parts(node: &Node, site: &SourceLocation) -> Result<(DVec3, DQuat, DVec3), SceneError> {
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
    Ok((vector(&node.scale, DVec3::ONE), rotation, vector(&node.translation, DVec3::ZERO)))
}
