//! Triangle of an instance's mesh that is nearest to a point, found on the host.

use super::TreeOnHost;
use glam::{DVec3, Vec3};
use trisect_shared::bvh::Child;

impl TreeOnHost<'_> {
    /// Returns the number of the leaf of instance `number`'s mesh that is nearest to a point in the
    /// mesh's coordinates. `distance` returns the squared distance of a leaf.
    pub fn nearest_of_instance(
        &self,
        number: u32,
        point: DVec3,
        distance: impl Fn(u32) -> f64,
    ) -> Option<u32> {
        let entry = self.entry_of(number)?;
        let (mut nearest, mut least) = (None, f64::INFINITY);
        let mut open = vec![(Child(entry.root), 0.0)];
        while let Some((child, bound)) = open.pop() {
            if bound > least {
                continue;
            }
            if child.is_leaf() {
                let square = distance(child.index());
                if nearest.is_none() || square < least {
                    (nearest, least) = (Some(child.index()), square);
                }
                continue;
            }
            let Some(node) = self.nodes.get(child.index() as usize) else { continue };
            let children = [node.first, node.second].into_iter().zip(node.boxes());
            let mut children = children.map(|(child, (low, high))| (Child(child), to_box(low, high, point)));
            if let (Some(first), Some(second)) = (children.next(), children.next()) {
                // The nearer one is visited first.
                open.extend(if first.1 < second.1 { [second, first] } else { [first, second] });
            }
        }
        nearest
    }
}

/// Returns the squared distance of a point from a box.
fn to_box(low: Vec3, high: Vec3, point: DVec3) -> f64 {
    (point - point.clamp(low.as_dvec3(), high.as_dvec3())).length_squared()
}
