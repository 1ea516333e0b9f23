//! Refitting: a BVH for a scene whose primitives moved keeps its nodes, with new boxes.

use super::bounds::primitive_bounds;
use super::{Bvh, memory};
use trisect_scene::{Scene, SceneError};
use trisect_shared::bvh::{Child, Corners};
use trisect_system::memory::lacking;

/// Maximum cost of a refitted BVH, relative to the cost when it was built; beyond it, a new one is
/// built (docs/notebook/animations.md).
pub const MAX_REFITTED_COST: f64 = 1.2;

impl Bvh {
    /// Returns the sum, over the inner nodes but the root, of the area of a node's box relative to
    /// those of the primitives below it, weighted by their number, per primitive. It grows when
    /// neighbours move apart, and stays when all are scaled. A large primitive, such as the ground,
    /// counts in the nodes above it only.
    pub fn cost(&self) -> f64 {
        let area = |(low, high): Corners| {
            let size = high.as_dvec3() - low.as_dvec3();
            size.x * size.y + size.y * size.z + size.z * size.x
        };
        // Number of primitives below each node, and the area of their boxes.
        let nodes = self.inner_nodes();
        let mut below = vec![(0.0, 0.0); nodes.len()];
        let mut sum = 0.0;
        // Children come after their parents.
        for (index, node) in nodes.iter().enumerate().rev() {
            for (child, corners) in [node.first, node.second].into_iter().zip(node.boxes()) {
                let (child, area) = (Child(child), area(corners));
                let (count, primitives) = match child.is_leaf() {
                    true => (1.0, area),
                    false => below[child.index() as usize],
                };
                if !child.is_leaf() && primitives > 0.0 {
                    sum += count * area / primitives;
                }
                below[index].0 += count;
                below[index].1 += primitives;
            }
        }
        sum / (nodes.len() + 1) as f64
    }

    /// Moves the primitives to where they are in `scene`, and gives all nodes new boxes, which are
    /// not padded for rays from anywhere. Returns `None`, and leaves the BVH in an unspecified
    /// state, for a scene with another number of primitives of some kind, or with shared meshes.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for boxes that exceed the memory.
    pub fn moved(mut self, scene: &Scene) -> Result<Option<Self>, SceneError> {
        if !self.mesh_roots.is_empty() || !scene.shared.instances.is_empty() {
            return Ok(None);
        }
        let count = scene.primitives();
        let leaves =
            if self.nodes.is_empty() { usize::from(self.root != Child::EMPTY) } else { self.nodes.len() + 1 };
        if leaves != count {
            return Ok(None);
        }
        memory::check(count, &scene.name, lacking)?;
        self.refit(&|leaf| primitive_bounds(scene, leaf));
        Ok(Some(self))
    }
}

#[cfg(test)]
mod tests {
    use super::super::bounds::bounds;
    use super::*;
    use crate::bvh::Wide;
    use glam::Vec3;
    use trisect_shared::triangle::Triangle;

    /// Returns a scene of triangles on a grid, each moved by `by`.
    fn scene(count: u32, by: impl Fn(u32) -> Vec3) -> Scene {
        let mut scene = Scene::hello_world().unwrap();
        let triangle = |i: u32| {
            let a = Vec3::new((i % 32) as f32, (i / 32) as f32, 0.0) + by(i);
            Triangle::of([a, a + Vec3::X * 0.9, a + Vec3::Y * 0.9])
        };
        scene.triangles = (0..count).map(triangle).collect();
        scene.vertices.push(bytemuck::Zeroable::zeroed());
        scene.spheres.truncate(1);
        // The ground is larger than all else, and does not hide what the triangles do.
        (scene.spheres[0].center, scene.spheres[0].radius) = (Vec3::new(0.0, -1e6, 0.0), 1e6);
        scene
    }

    /// Checks that the boxes of all nodes contain the primitives below them.
    fn check(bvh: &Bvh, scene: &Scene) {
        let boxes = bounds(scene);
        let of = |child: Child| match (child.is_leaf(), child.index() as usize) {
            (true, index) => boxes[index].corners(),
            (false, index) => {
                let [a, b] = bvh.nodes[index].boxes();
                (a.0.min(b.0), a.1.max(b.1))
            }
        };
        for node in &bvh.nodes {
            for (child, (low, high)) in [node.first, node.second].into_iter().zip(node.boxes()) {
                let (inner_low, inner_high) = of(Child(child));
                assert!(low.cmple(inner_low).all() && high.cmpge(inner_high).all());
            }
        }
    }

    #[test]
    fn a_refitted_tree_contains_what_moved() {
        // Boxes beside the large ground would not be padded.
        let triangles = |scene: Scene| Scene { spheres: Vec::new(), ..scene };
        let start = triangles(scene(2000, |_| Vec3::ZERO));
        let mut bvh = Bvh::build(&start, None).unwrap();
        bvh.pad_boxes(Vec3::ONE, 0.0).unwrap();
        let later =
            triangles(scene(2000, |i| Vec3::new((i % 7) as f32, 0.1 * (i % 3) as f32, (i % 11) as f32)));
        let moved = bvh.clone().moved(&later).unwrap().unwrap();
        check(&moved, &later);
        assert!(Wide::new(&later, &moved).unwrap().is_some());
        // Negative control: the boxes of the start do not contain what moved.
        let stale = std::panic::catch_unwind(|| check(&bvh, &later));
        assert!(stale.is_err());
    }

    /// Refitting a tree that says so gives it the same bits: one built of shifted boxes, and one
    /// built in parts.
    #[test]
    fn refitting_at_rest_changes_no_bit() {
        let scene = scene(9000, |i| Vec3::new(0.0, 0.0, (i % 5) as f32));
        let boxes: crate::bvh::BoxOf = &|index| primitive_bounds(&scene, index);
        let sizes = crate::bvh::parts::PartSizes { whole: 4000, ..crate::bvh::parts::PartSizes::DEFAULT };
        let in_parts = Bvh::over_parts(scene.primitives(), boxes, None, &sizes).unwrap();
        for built in [Bvh::build(&scene, None).unwrap(), in_parts] {
            assert!(built.has_refitted_boxes);
            let refitted = built.clone().moved(&scene).unwrap().unwrap();
            assert_eq!(refitted.nodes, built.nodes);
        }
        // Negative control: a small tree has the boxes of its builder.
        let small = self::scene(500, |_| Vec3::ZERO);
        let built = Bvh::build(&small, None).unwrap();
        assert!(!built.has_refitted_boxes);
        assert_ne!(built.clone().moved(&small).unwrap().unwrap().nodes, built.nodes);
    }

    #[test]
    fn a_tree_that_did_not_move_costs_the_same_and_a_torn_one_more() {
        let start = scene(2000, |_| Vec3::ZERO);
        let bvh = Bvh::build(&start, None).unwrap();
        let cost = bvh.cost();
        let rest = bvh.clone().moved(&start).unwrap().unwrap();
        assert!((rest.cost() / cost - 1.0).abs() < 1e-3, "{} {cost}", rest.cost());
        let together = scene(2000, |_| Vec3::new(100.0, 0.0, -3.0));
        let carried = bvh.clone().moved(&together).unwrap().unwrap();
        assert!(carried.cost() / cost < MAX_REFITTED_COST, "{} {cost}", carried.cost());
        let large = Scene {
            triangles: start
                .triangles
                .iter()
                .map(|t| Triangle { a: t.a * 9.0, b: t.b * 9.0, c: t.c * 9.0, ..*t })
                .collect(),
            ..start.clone()
        };
        let scaled = bvh.clone().moved(&large).unwrap().unwrap();
        assert!((scaled.cost() / cost - 1.0).abs() < 0.01, "{} {cost}", scaled.cost());
        let torn = scene(2000, |i| Vec3::new((i * 7919 % 2000) as f32, (i * 104_729 % 2000) as f32, 0.0));
        let torn = bvh.moved(&torn).unwrap().unwrap();
        assert!(torn.cost() / cost > 10.0 * MAX_REFITTED_COST, "{} {cost}", torn.cost());
    }

    #[test]
    fn other_numbers_of_primitives_need_another_tree() {
        let start = scene(40, |_| Vec3::ZERO);
        let bvh = Bvh::build(&start, None).unwrap();
        for count in [0, 39, 41] {
            assert!(bvh.clone().moved(&scene(count, |_| Vec3::ZERO)).unwrap().is_none(), "{count}");
        }
        assert!(bvh.moved(&start).unwrap().is_some());
        // A tree of one primitive has no nodes.
        let one = |at: f32| Scene { spheres: Vec::new(), flats: Vec::new(), ..scene(1, |_| Vec3::splat(at)) };
        let moved = Bvh::build(&one(0.0), None).unwrap().moved(&one(5.0)).unwrap().unwrap();
        assert_eq!(moved.root, Child::leaf(0));
    }
}
