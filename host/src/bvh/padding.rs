//! Room in the boxes for rays from anywhere in the scene, which makes them cheaper to test.

use super::Bvh;
use glam::{Vec3, Vec4};
use trisect_shared::bvh::Child;
use trisect_shared::slabs::box_padding;

/// Of the middle box of a primitive, the part by which it may grow: rays then enter 1 % more boxes.
const MAX_GROWTH: f32 = 1.0 / 64.0;

impl Bvh {
    /// Widens all boxes for rays that start in them or at `eye`, within `lens` along each axis. Not where that would make the boxes of
    /// the primitives much larger: in a scene with fine detail that reaches far. Returns how
    /// far from the world's origin along each axis a ray may start for which the boxes have room now.
    pub fn pad_boxes(&mut self, eye: Vec3, lens: f32) -> Option<Vec3> {
        let root = self.nodes.first()?;
        let mut reach = eye.abs() + lens;
        for (low, high) in root.boxes() {
            reach = reach.max(low.abs()).max(high.abs());
        }
        reach *= 1.0 + 1e-5; // points of surfaces, and where rays leave them, lie in the boxes within rounding
        if box_padding(0.0, 0.0, reach.max_element()) > MAX_GROWTH * self.middle_extent() {
            return None;
        }
        for node in &mut self.nodes {
            for (row, reach) in [(&mut node.x, reach.x), (&mut node.y, reach.y), (&mut node.z, reach.z)] {
                let wider = |center: f32, half: f32| (half + box_padding(center, half, reach)).next_up();
                *row = Vec4::new(row.x, row.y, wider(row.x, row.z), wider(row.y, row.w));
            }
        }
        Some(reach)
    }

    /// The median of half the mean extent of the primitives' boxes.
    fn middle_extent(&self) -> f32 {
        let mut extents = Vec::new();
        for node in &self.nodes {
            if Child(node.first).is_leaf() {
                extents.push((node.x.z + node.y.z + node.z.z) / 3.0);
            }
            if Child(node.second).is_leaf() {
                extents.push((node.x.w + node.y.w + node.z.w) / 3.0);
            }
        }
        let middle = extents.len() / 2;
        if extents.is_empty() { 0.0 } else { *extents.select_nth_unstable_by(middle, f32::total_cmp).1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// The built-in scene has room; the same scene far from the origin has not, and keeps its boxes.
    #[test]
    fn room_where_it_is_small() {
        let scene = Scene::hello_world().unwrap();
        let mut bvh = Bvh::build(&scene, None).unwrap();
        let tight = bvh.nodes.clone();
        let reach = bvh.pad_boxes(Vec3::ONE, 0.0).unwrap();
        assert!(reach.cmpgt(Vec3::ONE).all());
        for (node, tight) in bvh.nodes.iter().zip(&tight) {
            for ((low, high), (tight_low, tight_high)) in node.boxes().into_iter().zip(tight.boxes()) {
                assert!(low.cmple(tight_low).all() && high.cmpge(tight_high).all());
            }
        }
        bvh.nodes.clone_from(&tight);
        assert_eq!(bvh.pad_boxes(Vec3::splat(1e9), 0.0), None);
        assert_eq!(bvh.nodes, tight);
    }
}
