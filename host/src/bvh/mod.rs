//! Builds the BVH: obvhs (PLOC with reinsertion) makes the tree, this module turns it into device records and proves
//! what kernels rely on when they read without bounds checks.

mod balanced;

use crate::scene::{Scene, SceneError};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::{Boundable, BvhBuildParams};
use std::time::Duration;
use trisect_shared::bvh::STACK_SIZE;
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::sphere::Sphere;

/// A tree over the spheres of a scene.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Inner nodes, parents before children.
    pub nodes: Vec<BvhNode>,
    /// A leaf for a scene with one primitive, [`Child::EMPTY`] for one with none.
    pub root: Child,
    /// Levels of inner nodes, at most [`STACK_SIZE`].
    pub depth: usize,
}

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// The box of a sphere, padded so that it contains the sphere whatever rounding does to its corners and to a ray that touches
/// one: by 2 ULP of the farthest coordinate, and of the radius, which keeps the pad above zero at the origin.
fn bounds(sphere: &Sphere) -> Aabb {
    let center = Vec3A::from(sphere.center);
    let radius = Vec3A::splat(sphere.radius);
    let pad = (center.abs() + radius) * (2.0 * f32::EPSILON);
    Aabb::new(center - radius - pad, center + radius + pad)
}

impl Bvh {
    /// Builds the tree. One primitive a leaf.
    pub fn build(scene: &Scene) -> Result<Self, SceneError> {
        let boxes: Vec<Bounds> = scene.spheres.iter().map(|sphere| Bounds(bounds(sphere))).collect();
        match boxes.len() {
            0 => return Ok(Self { nodes: Vec::new(), root: Child::EMPTY, depth: 0 }),
            1 => return Ok(Self { nodes: Vec::new(), root: Child::leaf(0), depth: 0 }),
            _ => {}
        }
        // The best tree that still builds in moments: 487 spheres take a few milliseconds.
        let mut params = BvhBuildParams::very_slow_build();
        params.pre_split = false;
        params.max_prims_per_leaf = 1;
        if boxes.len() > 100_000 {
            params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
        }
        let tree = build_bvh2(&boxes, params, &mut Duration::default());
        let mut bvh = Self::flatten(&tree);
        if bvh.depth > STACK_SIZE {
            bvh = balanced::build(&boxes);
        }
        bvh.prove(boxes.len())
            .map_err(|message| SceneError::Inconsistent { file: scene.name.clone(), message })?;
        Ok(bvh)
    }

    /// Depth-first, so that a subtree's nodes lie together.
    fn flatten(tree: &Bvh2) -> Self {
        let mut nodes = Vec::with_capacity(tree.nodes.len() / 2);
        let mut depth = 0;
        // A node of the tree, the parent slot that waits for its index, its level.
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
            nodes.push(BvhNode {
                first_min: Vec3::from(box_a.min),
                first: child(a),
                first_max: Vec3::from(box_a.max),
                second: child(b),
                second_min: Vec3::from(box_b.min),
                pad0: 0,
                second_max: Vec3::from(box_b.max),
                pad1: 0,
            });
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
        Self { nodes, root: Child::inner(0), depth }
    }

    /// Checks what [`trisect_shared::buffer`] promises: indices in range, each node and primitive reached once, depth within the
    /// traversal stack.
    fn prove(&self, primitives: usize) -> Result<(), String> {
        if self.depth > STACK_SIZE {
            return Err(format!(
                "the BVH has {} levels, traversal has room for {STACK_SIZE}: too many objects at nearly one place",
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
    use super::*;

    fn tree() -> Bvh {
        let node = |first: Child, second: Child| BvhNode {
            first: first.0,
            second: second.0,
            ..bytemuck::Zeroable::zeroed()
        };
        Bvh {
            nodes: vec![node(Child::inner(1), Child::leaf(2)), node(Child::leaf(0), Child::leaf(1))],
            root: Child::inner(0),
            depth: 2,
        }
    }

    #[test]
    fn a_good_tree_is_proven() {
        assert_eq!(tree().prove(3), Ok(()));
    }

    #[test]
    fn sabotage_each_broken_tree_is_refused() {
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
            assert!(tree.prove(3).is_err(), "fault {i}");
        }
    }

    /// Boxes at one place: PLOC merges them into a chain, deeper than the traversal stack.
    #[test]
    fn coincident_spheres_get_a_balanced_tree() {
        let mut scene = Scene::hello_world().unwrap();
        scene.spheres = vec![scene.spheres[0]; 1000];
        let bvh = Bvh::build(&scene).unwrap();
        assert!(bvh.depth <= 10, "{}", bvh.depth);
        for count in [2, 3, 5, 64, 65] {
            let boxes: Vec<Bounds> = (0..count)
                .map(|i| {
                    let center = Vec3::new(i as f32, (i * i % 7) as f32, 0.0);
                    Bounds(bounds(&Sphere { center, ..scene.spheres[0] }))
                })
                .collect();
            assert_eq!(balanced::build(&boxes).prove(count), Ok(()));
        }
    }

    #[test]
    fn boxes_contain_their_spheres() {
        for (center, radius) in [(0.0f32, 1e-6f32), (1e6, 1e-3), (-1000.0, 1000.0), (0.1, 0.2), (-1e18, 1e18)]
        {
            let sphere = Sphere { center: Vec3::splat(center), radius, material: 0, pad: [0; 3] };
            let b = bounds(&sphere);
            let (c, r) = (f64::from(center), f64::from(radius));
            assert!(f64::from(b.min.x) < c - r && f64::from(b.max.x) > c + r, "{center} {radius}");
        }
    }
}
