//! BVH construction: obvhs (PLOC with reinsertion) builds the tree. This module converts it to
//! device records, and validates what kernels rely on when they read without bounds checks.
//!
//! A [`Renderer`](crate::render::Renderer) builds a [`Bvh`] of a scene, a [`Wide`] BVH from it for
//! the CPU, and [tile entries](build_tile_entries) for its camera.

mod balanced;
mod bounds;
mod build;
mod instances;
mod memory;
mod nearest;
mod nodes_entered;
mod padding;
mod parts;
mod piece;
mod refit;
mod tile_entries;
mod wide;

pub(crate) use nodes_entered::TreeOnHost;
pub(crate) use padding::TightExtent;
pub use refit::MAX_REFITTED_COST;
pub use tile_entries::build_tile_entries;
pub use wide::Wide;

use bounds::{BoxOf, primitive_bounds};
use serde::Serialize;
use trisect_scene::{Scene, SceneError, SharedVec};
use trisect_shared::bvh::{BvhNode, Child, STACK_SIZE};
use trisect_system::memory::lacking;

/// Quality of the BVH: a better one is faster to trace and slower to build.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum BvhQuality {
    /// Fastest to build.
    Fast,
    /// Between the other two; the default for large scenes.
    Medium,
    /// Fastest to trace.
    High,
}

/// BVH over the primitives of a scene.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Inner nodes, parents before children: those of the world, then of each shared mesh. Behind
    /// them are the records of instances.
    pub nodes: SharedVec<BvhNode>,
    /// Root: a leaf for a scene with one primitive, [`Child::EMPTY`] for one with none.
    pub root: Child,
    /// Number of levels of inner nodes, at most [`STACK_SIZE`]; between the world and a shared mesh
    /// there is a level more.
    pub depth: usize,
    /// Roots of the trees of shared meshes.
    pub mesh_roots: Vec<Child>,
    /// Index in `nodes` of the first record of instances.
    pub first_instance_node: usize,
    /// Number of the first instance, among the leaves.
    pub first_instance: usize,
    /// True if the boxes, before padding, are those that refitting gives for the same primitives.
    pub has_refitted_boxes: bool,
}

impl Bvh {
    /// Builds the BVH, with one primitive in a leaf. If `quality` is `None`, it follows from the
    /// number of primitives. A tree that is too deep for the traversal stack is replaced by a
    /// balanced one.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a BVH that exceeds the memory, or that is broken.
    pub fn build(scene: &Scene, quality: Option<BvhQuality>) -> Result<Self, SceneError> {
        let count = scene.primitives() + scene.shared.instances.len();
        memory::check(count, &scene.name, lacking)?;
        let broken = |message| SceneError::Inconsistent { file: scene.name.clone(), message };
        let boxes: BoxOf = &|index| primitive_bounds(scene, index);
        let in_world = scene.world_primitives() + scene.shared.instances.len();
        let mut bvh = Self::over(in_world, boxes, quality).map_err(broken)?;
        // The levels of the world, an instance and a mesh share a stack.
        let largest = scene.shared.meshes.iter().map(|mesh| mesh.triangles).max().unwrap_or(0);
        let levels = largest.checked_next_power_of_two().map_or(64, u64::trailing_zeros) as usize;
        if largest > 0 && bvh.depth + 1 + levels > STACK_SIZE {
            bvh = balanced::build(in_world, boxes);
            bvh.validate(in_world).map_err(broken)?;
        }
        bvh.append_meshes(scene, quality).map_err(broken)?;
        Ok(bvh)
    }

    fn leaf(root: Child) -> Self {
        Self {
            nodes: SharedVec::default(),
            root,
            depth: 0,
            mesh_roots: Vec::new(),
            first_instance_node: 0,
            first_instance: 0,
            has_refitted_boxes: false,
        }
    }

    /// Checks what [`trisect_shared::buffer`] requires: indices in range, each node and primitive
    /// reached once, depth within the traversal stack.
    fn validate(&self, primitives: usize) -> Result<(), String> {
        if self.depth > STACK_SIZE {
            return Err(format!(
                "the BVH has {} levels, and traversal supports {STACK_SIZE}: too many objects at nearly one place",
                self.depth
            ));
        }
        let mut leaves = vec![false; primitives];
        let mut inner = vec![false; self.nodes.len()];
        let mut visit = |child: Child, parent: Option<usize>| {
            let seen = if child.is_leaf() { &mut leaves } else { &mut inner };
            let ordered = child.is_leaf() || parent.is_none_or(|parent| child.index() as usize > parent);
            match seen.get_mut(child.index() as usize) {
                Some(seen) if !*seen && ordered => {
                    *seen = true;
                    Ok(())
                }
                _ => {
                    Err(format!("the BVH builder gave a broken tree at {child:?}; please report this scene"))
                }
            }
        };
        visit(self.root, None)?;
        for (index, node) in self.nodes.iter().enumerate() {
            visit(Child(node.first), Some(index))?;
            visit(Child(node.second), Some(index))?;
        }
        if leaves.iter().chain(&inner).all(|&seen| seen) {
            Ok(())
        } else {
            Err("the BVH builder lost a primitive; please report this scene".to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::bounds::{Bounds, bounds, sphere_bounds};
    use super::*;
    use glam::Vec3;
    use trisect_shared::sphere::Sphere;

    fn tree() -> Bvh {
        let node = |first: Child, second: Child| BvhNode {
            first: first.0,
            second: second.0,
            ..bytemuck::Zeroable::zeroed()
        };
        Bvh {
            nodes: vec![node(Child::inner(1), Child::leaf(2)), node(Child::leaf(0), Child::leaf(1))].into(),
            depth: 2,
            ..Bvh::leaf(Child::inner(0))
        }
    }

    #[test]
    fn a_good_tree_is_proven() {
        assert_eq!(tree().validate(3), Ok(()));
    }

    #[test]
    fn negative_control_each_broken_tree_is_refused() {
        let broken: [fn(&mut Bvh); 6] = [
            |t| t.nodes[0].second = Child::leaf(3).0,  // no such primitive
            |t| t.nodes[0].second = Child::leaf(0).0,  // twice
            |t| t.nodes[1].second = Child::inner(0).0, // a loop
            |t| t.nodes[0].first = Child::inner(7).0,  // no such node
            |t| t.depth = STACK_SIZE + 1,
            |t| t.root = Child::inner(1), // loses a primitive
        ];
        for (i, damage) in broken.into_iter().enumerate() {
            let mut tree = tree();
            damage(&mut tree);
            assert!(tree.validate(3).is_err(), "fault {i}");
        }
    }

    #[test]
    fn scenes_of_no_and_of_one_object() {
        let mut scene = Scene::hello_world().unwrap();
        scene.spheres.truncate(1);
        assert_eq!(Bvh::build(&scene, None).unwrap().root, Child::leaf(0));
        scene.spheres.clear();
        assert_eq!(Bvh::build(&scene, None).unwrap().root, Child::EMPTY);
    }

    /// Boxes at one place, which PLOC merges into a chain deeper than the traversal stack.
    #[test]
    fn coincident_spheres_get_a_balanced_tree() {
        let mut scene = Scene::hello_world().unwrap();
        scene.spheres = vec![scene.spheres[0]; 1000];
        let bvh = Bvh::build(&scene, None).unwrap();
        assert!(bvh.depth <= 10, "{}", bvh.depth);
        for count in [2, 3, 5, 64, 65] {
            let boxes: Vec<Bounds> = (0..count)
                .map(|i| {
                    let center = Vec3::new(i as f32, (i * i % 7) as f32, 0.0);
                    sphere_bounds(&Sphere { center, ..scene.spheres[0] })
                })
                .collect();
            assert_eq!(balanced::build(count, &|i| boxes[i as usize]).validate(count), Ok(()));
        }
    }

    /// Equal boxes in a row, of which PLOC merges one pair a pass, are built quickly; and each
    /// node's boxes fit what is below it.
    #[test]
    fn a_long_row_is_refitted() {
        let mut scene = Scene::hello_world().unwrap();
        let at = |i: u32| Sphere { center: Vec3::new(i as f32, 0.0, 0.0), radius: 0.5, ..scene.spheres[0] };
        scene.spheres = (0..20_000).map(at).collect();
        let bvh = Bvh::build(&scene, Some(BvhQuality::Fast)).unwrap();
        let boxes = bounds(&scene);
        for node in &bvh.nodes {
            for (child, (low, high)) in [node.first, node.second].into_iter().zip(node.boxes()) {
                let (least, greatest) = if Child(child).is_leaf() {
                    boxes[Child(child).index() as usize].corners()
                } else {
                    let [a, b] = bvh.nodes[child as usize].boxes();
                    (a.0.min(b.0), a.1.max(b.1))
                };
                // The 4 ULP of half the extent that a node adds, and the rounding of centre, half
                // extent and both corners.
                let room = 16.0 * f32::EPSILON * least.x.abs().max(greatest.x.abs());
                assert!(low.x <= least.x && least.x <= low.x + room, "{low} {least}");
                assert!(high.x >= greatest.x && greatest.x >= high.x - room, "{high} {greatest}");
            }
        }
    }
}
