//! Padding of the boxes for rays from anywhere in the scene, which makes the box test cheaper.

use super::Bvh;
use glam::{Vec3, Vec4};
use trisect_shared::bvh::Child;
use trisect_shared::slabs::box_padding;

/// Maximum padding, relative to the median half extent of a primitive's box: rays then enter few
/// more boxes (docs/notebook/camera-ray-tiles.md).
const MAX_GROWTH: f32 = 1.0 / 64.0;

/// Extent of a BVH whose boxes are not padded, from which the padding for each camera follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TightExtent {
    /// Maximum distance of the root's boxes from the world's origin, along each axis.
    reach: Vec3,
    /// Median half extent of the primitives' boxes.
    middle: f32,
}

impl TightExtent {
    /// Returns the maximum distance of a ray's origin from the world's origin, along each axis, for
    /// which boxes are padded: for rays that start in the boxes, or within `lens` of `eye` along
    /// each axis. Returns `None` if the padding would make the primitives' boxes much larger.
    pub fn padded_for(&self, eye: Vec3, lens: f32) -> Option<Vec3> {
        let mut reach = (eye.abs() + lens).max(self.reach);
        reach *= 1.0 + 1e-5; // surface points, and the origins of rays that leave them, lie in the boxes within rounding
        (box_padding(0.0, 0.0, reach.max_element()) <= MAX_GROWTH * self.middle).then_some(reach)
    }
}

impl Bvh {
    /// Pads all boxes for rays that start in them, or within `lens` of `eye` along each axis.
    /// Returns the maximum distance of a ray's origin from the world's origin, along each axis, for
    /// which the boxes are padded. Returns `None` and leaves the boxes as they are if there is no
    /// inner node, if there are instances, or if the padding would make the primitives' boxes much
    /// larger, as in a scene with fine detail that reaches far.
    pub fn pad_boxes(&mut self, eye: Vec3, lens: f32) -> Option<Vec3> {
        let reach = self.tight_extent()?.padded_for(eye, lens)?;
        self.pad(reach);
        Some(reach)
    }

    /// Returns the extent of the BVH, whose boxes are not padded yet. Returns `None` if its boxes
    /// are never padded: without an inner node, and with instances.
    pub(crate) fn tight_extent(&self) -> Option<TightExtent> {
        // In the coordinates of an instance a ray may start anywhere.
        if !self.mesh_roots.is_empty() {
            return None;
        }
        let boxes = self.nodes.first()?.boxes();
        let reach =
            boxes.into_iter().fold(Vec3::ZERO, |reach, (low, high)| reach.max(low.abs()).max(high.abs()));
        Some(TightExtent { reach, middle: self.middle_extent() })
    }

    /// Pads all boxes for rays whose origins are at most `reach` away from the world's origin,
    /// along each axis.
    pub(crate) fn pad(&mut self, reach: Vec3) {
        for node in &mut self.nodes {
            for (row, reach) in [(&mut node.x, reach.x), (&mut node.y, reach.y), (&mut node.z, reach.z)] {
                let wider = |center: f32, half: f32| (half + box_padding(center, half, reach)).next_up();
                *row = Vec4::new(row.x, row.y, wider(row.x, row.z), wider(row.y, row.w));
            }
        }
    }

    /// Returns the median, over the primitives, of the mean half extent of their boxes.
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
    use trisect_scene::Scene;

    /// The boxes of the built-in scene are padded; for an eye far from the origin they stay as they
    /// are.
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
