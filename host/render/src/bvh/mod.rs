//! BVH construction: obvhs (PLOC with reinsertion) builds the tree. This module converts it to
//! device records, and validates what kernels rely on when they read without bounds checks.
//!
//! A [`Renderer`](crate::render::Renderer) builds a [`Bvh`] of a scene, a [`Wide`] BVH from it for
//! the CPU, and [tile entries](build_tile_entries) for its camera.

mod balanced;
mod bounds;
mod instances;
mod memory;
mod padding;
mod refit;
mod tile_entries;
mod wide;

pub use refit::MAX_REFITTED_COST;
pub use tile_entries::build_tile_entries;
pub use wide::Wide;

use bounds::{Bounds, bounds, shifted};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::PlocBuilder;
use serde::Serialize;
use trisect_scene::{Scene, SceneError, SharedVec};
use trisect_shared::bvh::{BvhNode, Child, STACK_SIZE};
use trisect_system::memory::available;

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

/// Maximum number of primitives for which the default is [`BvhQuality::High`]; larger scenes would
/// take long to build with it.
const MAX_HIGH_QUALITY_PRIMITIVES: usize = 100_000;

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
}

/// Minimum number of primitives for which the builder gets shifted boxes (see [`shifted`]).
const MIN_SHIFTED_PRIMITIVES: usize = 4096;

/// Builds a tree as obvhs's `build_bvh2` does, with one primitive in a leaf, because testing a
/// primitive costs about as much as testing its box. In debug builds, `build_bvh2` also checks that
/// the stack of obvhs's own traversal suffices for a tree that reinsertion made deep. That
/// traversal is not used here, and neither is the check.
fn build_tree(boxes: &[Bounds], preset: &BvhBuildParams) -> Bvh2 {
    let BvhBuildParams { ploc_search_distance, sort_precision, search_depth_threshold, .. } = *preset;
    let indices = (0..boxes.len() as u32).collect();
    let builder = &mut PlocBuilder::with_capacity(boxes.len());
    let mut tree =
        builder.build(ploc_search_distance, boxes, indices, sort_precision, search_depth_threshold);
    let (first, then) =
        (preset.reinsertion_batch_ratio, preset.post_collapse_reinsertion_batch_ratio_multiplier);
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut tree, first, None);
    optimizer.run(&mut tree, first * then, None);
    tree
}

impl Bvh {
    /// Builds the BVH, with one primitive in a leaf. If `quality` is `None`, it follows from the
    /// number of primitives. A tree that is too deep for
    /// the traversal stack is replaced by a balanced one.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a BVH that exceeds the memory, or that is broken.
    pub fn build(scene: &Scene, quality: Option<BvhQuality>) -> Result<Self, SceneError> {
        let count = scene.primitives() + scene.shared.instances.len();
        memory::check(count, &scene.name, available)?;
        let broken = |message| SceneError::Inconsistent { file: scene.name.clone(), message };
        let boxes = bounds(scene);
        let mut bvh = Self::over(&boxes, quality).map_err(broken)?;
        // The levels of the world, an instance and a mesh share a stack.
        let largest = scene.shared.meshes.iter().map(|mesh| mesh.triangles).max().unwrap_or(0);
        let levels = largest.checked_next_power_of_two().map_or(64, u64::trailing_zeros) as usize;
        if largest > 0 && bvh.depth + 1 + levels > STACK_SIZE {
            bvh = balanced::build(&boxes);
            bvh.validate(boxes.len()).map_err(broken)?;
        }
        bvh.append_meshes(scene, quality).map_err(broken)?;
        Ok(bvh)
    }

    /// Builds a tree over boxes, which stand for the primitives of the same numbers.
    fn over(boxes: &[Bounds], quality: Option<BvhQuality>) -> Result<Self, String> {
        let bvh = match boxes.len() {
            0 => return Ok(Self::leaf(Child::EMPTY)),
            1 => Self::leaf(Child::leaf(0)),
            count => {
                let default =
                    if count <= MAX_HIGH_QUALITY_PRIMITIVES { BvhQuality::High } else { BvhQuality::Medium };
                let preset = match quality.unwrap_or(default) {
                    BvhQuality::Fast => BvhBuildParams::fast_build(),
                    BvhQuality::Medium => BvhBuildParams::medium_build(),
                    BvhQuality::High => BvhBuildParams::very_slow_build(),
                };
                if count < MIN_SHIFTED_PRIMITIVES {
                    Self::flatten(&build_tree(boxes, &preset))
                } else {
                    let shifted: Vec<Bounds> =
                        (0u32..).zip(boxes).map(|(i, bounds)| shifted(i, bounds)).collect();
                    let mut bvh = Self::flatten(&build_tree(&shifted, &preset));
                    bvh.refit(boxes);
                    bvh
                }
            }
        };
        let bvh = if bvh.depth > STACK_SIZE { balanced::build(boxes) } else { bvh };
        bvh.validate(boxes.len())?;
        Ok(bvh)
    }

    /// Sets the boxes of all nodes to those of what is below them.
    fn refit(&mut self, boxes: &[Bounds]) {
        let of = |nodes: &[BvhNode], child: Child| {
            let index = child.index() as usize;
            if child.is_leaf() {
                return boxes[index].corners();
            }
            let [(low, high), (low2, high2)] = nodes[index].boxes();
            (low.min(low2), high.max(high2))
        };
        // Children come after their parents.
        let nodes: &mut Vec<BvhNode> = &mut self.nodes;
        for index in (0..nodes.len()).rev() {
            let (first, second) = (Child(nodes[index].first), Child(nodes[index].second));
            let (a, b) = (of(nodes, first), of(nodes, second));
            nodes[index] = BvhNode::new(first, a, second, b);
        }
    }

    fn leaf(root: Child) -> Self {
        Self {
            nodes: SharedVec::default(),
            root,
            depth: 0,
            mesh_roots: Vec::new(),
            first_instance_node: 0,
            first_instance: 0,
        }
    }

    /// Converts the builder's tree, depth-first, so that a subtree's nodes lie together.
    fn flatten(tree: &Bvh2) -> Self {
        let mut nodes = Vec::with_capacity(tree.nodes.len() / 2);
        let mut depth = 0;
        // A node of the tree, the slot in its parent that waits for its index, and its level.
        let mut pending = vec![(0usize, None::<(usize, bool)>, 1usize)];
        while let Some((index, slot, level)) = pending.pop() {
            let first = tree.nodes[index].first_index as usize;
            let (a, b) = (&tree.nodes[first], &tree.nodes[first + 1]);
            let (box_a, box_b) = (a.aabb(), b.aabb());
            let me = nodes.len();
            let child = |node: &obvhs::bvh2::node::Bvh2Node| {
                if node.is_leaf() {
                    Child::leaf(tree.primitive_indices[node.first_index as usize]).0
                } else {
                    0 // filled in when the child is visited
                }
            };
            let (box_a, box_b) = (Bounds::of(box_a).corners(), Bounds::of(box_b).corners());
            nodes.push(BvhNode::new(Child(child(a)), box_a, Child(child(b)), box_b));
            if let Some((parent, is_second)) = slot {
                let parent: &mut BvhNode = &mut nodes[parent];
                *(if is_second { &mut parent.second } else { &mut parent.first }) = Child::inner(me as u32).0;
            }
            depth = depth.max(level);
            for (node, index, is_second) in [(b, first + 1, true), (a, first, false)] {
                if !node.is_leaf() {
                    pending.push((index, Some((me, is_second)), level + 1));
                }
            }
        }
        Self { nodes: nodes.into(), depth, ..Self::leaf(Child::inner(0)) }
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
    use super::bounds::sphere_bounds;
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
            assert_eq!(balanced::build(&boxes).validate(count), Ok(()));
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
