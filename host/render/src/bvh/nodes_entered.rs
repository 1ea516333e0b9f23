//! Nodes of the binary BVH along a camera ray, counted on the host.

use glam::{DVec3, Vec3, Vec4};
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::instance::InstanceEntry;

/// Binary BVH of a scene, with the trees of its instances.
pub(crate) struct TreeOnHost<'a> {
    /// Nodes, behind which the entries of instances stand.
    pub nodes: &'a [BvhNode],
    /// Root of the scene's tree.
    pub root: Child,
    /// Number of the first instance among the leaves.
    pub first_instance: u32,
    /// Index of the first instance's entry among the nodes.
    pub first_instance_node: u32,
}

impl TreeOnHost<'_> {
    /// Returns the number of inner nodes whose boxes the ray enters before `distance`, the root
    /// among them. Any traversal visits them at least; the order of its visits may add others.
    pub fn nodes_before(&self, origin: DVec3, direction: DVec3, distance: f64) -> u32 {
        let mut count = 0;
        let mut open = vec![(self.root, origin, direction)];
        while let Some((child, origin, direction)) = open.pop() {
            if child.is_leaf() {
                if let Some(entry) = self.entry(child) {
                    let (origin, direction) = enter(&entry, origin, direction);
                    open.push((Child(entry.root), origin, direction));
                }
                continue;
            }
            let Some(node) = self.nodes.get(child.index() as usize) else { continue };
            count += 1;
            for (child, (low, high)) in [node.first, node.second].into_iter().zip(node.boxes()) {
                if is_entered(low, high, origin, direction, distance) {
                    open.push((Child(child), origin, direction));
                }
            }
        }
        count
    }

    /// Returns the entry of the instance that a leaf is, if it is one.
    fn entry(&self, leaf: Child) -> Option<InstanceEntry> {
        let number = leaf.index().checked_sub(self.first_instance).filter(|_| leaf != Child::EMPTY)?;
        self.entry_of(number)
    }

    /// Returns the entry of an instance.
    pub(super) fn entry_of(&self, number: u32) -> Option<InstanceEntry> {
        let node = self.nodes.get(self.first_instance_node as usize + 2 * number as usize)?;
        Some(bytemuck::cast(*node))
    }
}

/// Returns the ray in the coordinates of an instance's mesh, with the same distances.
fn enter(entry: &InstanceEntry, origin: DVec3, direction: DVec3) -> (DVec3, DVec3) {
    let InstanceEntry { x, y, z, .. } = *entry;
    let rows = [x, y, z].map(Vec4::as_dvec4);
    let linear = |v: DVec3| DVec3::from(rows.map(|row| row.truncate().dot(v)));
    (linear(origin) + DVec3::from(rows.map(|row| row.w)), linear(direction))
}

/// Returns whether the ray is in the box at a distance from 0 to `max_distance`.
fn is_entered(low: Vec3, high: Vec3, origin: DVec3, direction: DVec3, max_distance: f64) -> bool {
    let (mut first, mut last) = (0.0f64, max_distance);
    for axis in 0..3 {
        let (from, along) = (origin[axis], direction[axis]);
        let (low, high) = (f64::from(low[axis]), f64::from(high[axis]));
        if along == 0.0 {
            if from < low || from > high {
                return false;
            }
            continue;
        }
        let (a, b) = ((low - from) / along, (high - from) / along);
        (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
    }
    first <= last
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: (Vec3, Vec3) = (Vec3::ZERO, Vec3::ONE);

    #[test]
    fn boxes_are_entered_before_the_hit() {
        let (low, high) = UNIT;
        let from = |x: f64, y: f64| DVec3::new(x, y, 0.5);
        assert!(is_entered(low, high, from(-1.0, 0.5), DVec3::X, 1.5));
        assert!(!is_entered(low, high, from(-1.0, 0.5), DVec3::X, 0.5), "the hit is before the box");
        assert!(!is_entered(low, high, from(2.0, 0.5), DVec3::X, 9.0), "the box is behind the ray");
        assert!(is_entered(low, high, from(0.5, 0.5), DVec3::X, 0.1), "the ray starts inside");
        assert!(!is_entered(low, high, from(-1.0, 1.5), DVec3::X, 9.0));
    }

    /// Two boxes in a row, each with two leaves.
    #[test]
    fn nodes_behind_the_hit_do_not_count() {
        let at = |x: f32| (Vec3::new(x, 0.0, 0.0), Vec3::new(x + 1.0, 1.0, 1.0));
        let leaves =
            |x: f32, first: u32| BvhNode::new(Child::leaf(first), at(x), Child::leaf(first + 1), at(x + 1.0));
        let nodes = [
            BvhNode::new(Child::inner(1), (at(0.0).0, at(1.0).1), Child::inner(2), (at(5.0).0, at(6.0).1)),
            leaves(0.0, 0),
            leaves(5.0, 2),
        ];
        let tree = TreeOnHost {
            nodes: &nodes,
            root: Child::inner(0),
            first_instance: u32::MAX,
            first_instance_node: 0,
        };
        let from = DVec3::new(-1.0, 0.5, 0.5);
        let count = |distance: f64| tree.nodes_before(from, DVec3::X, distance);
        assert_eq!((count(1e9), count(3.0), count(0.5)), (3, 2, 1));
        assert_eq!(tree.nodes_before(from, DVec3::Y, 1e9), 1);
        let empty = TreeOnHost { root: Child::EMPTY, ..tree };
        assert_eq!(empty.nodes_before(from, DVec3::X, 1e9), 0);
    }
}
