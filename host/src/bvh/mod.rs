//! Builds the BVH: obvhs (PLOC with reinsertion) makes the tree, this module turns it into device records and proves
//! what kernels rely on when they read without bounds checks.

mod balanced;

use crate::scene::{Scene, SceneError};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::{Boundable, BvhBuildParams};
use serde::Serialize;
use std::time::Duration;
use trisect_shared::bvh::{BvhNode, Child, STACK_SIZE};
use trisect_shared::flat::{DISC, Flat};
use trisect_shared::sphere::Sphere;
use trisect_shared::triangle::{Triangle, TriangleShading};

/// How much work goes into the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BvhQuality {
    /// Built soon.
    Fast,
    /// Between.
    Medium,
    /// Traced soon.
    High,
}

/// A scene of at most so many primitives gets [`BvhQuality::High`] unless told otherwise: it builds within a second.
const HIGH_UP_TO: usize = 100_000;

/// A tree over the primitives of a scene.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Inner nodes, parents before children.
    pub nodes: Vec<BvhNode>,
    /// A leaf for a scene with one primitive, [`Child::EMPTY`] for one with none.
    pub root: Child,
    /// Levels of inner nodes, at most [`STACK_SIZE`].
    pub depth: usize,
    /// The scene's triangles as the leaves name them: in the order of the tree, so that neighbours in space are neighbours in memory.
    pub triangles: Vec<Triangle>,
    /// One for each triangle.
    pub shading: Vec<TriangleShading>,
}

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// A box padded so that it contains the primitive whatever rounding does to its corners and to a ray that touches
/// one: by 2 ULP of the farthest coordinate, and of the greatest extent, which keeps the pad above zero at the origin.
fn padded(low: Vec3, high: Vec3) -> Aabb {
    let (low, high) = (Vec3A::from(low), Vec3A::from(high));
    let extent = Vec3A::splat((high - low).max_element());
    let pad = (low.abs().max(high.abs()) + extent) * (2.0 * f32::EPSILON);
    Aabb::new(low - pad, high + pad)
}

fn sphere_bounds(sphere: &Sphere) -> Aabb {
    padded(sphere.center - sphere.radius, sphere.center + sphere.radius)
}

fn flat_bounds(flat: &Flat) -> Aabb {
    let (u, v) = (flat.edge_u, flat.edge_v);
    if flat.kind == DISC {
        let reach = Vec3::from_array(std::array::from_fn(|i| u[i].hypot(v[i])));
        return padded(flat.origin - reach, flat.origin + reach);
    }
    let corners = [flat.origin, flat.origin + u, flat.origin + v, flat.origin + u + v];
    let low = corners.into_iter().fold(Vec3::INFINITY, Vec3::min);
    padded(low, corners.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max))
}

fn triangle_bounds(t: &Triangle) -> Aabb {
    padded(t.a.min(t.b).min(t.c), t.a.max(t.b).max(t.c))
}

/// One box for each primitive, in their order.
fn bounds(scene: &Scene) -> Vec<Bounds> {
    let spheres = scene.spheres.iter().map(sphere_bounds);
    let flats = scene.flats.iter().map(flat_bounds);
    let triangles = scene.triangles.iter().map(triangle_bounds);
    spheres.chain(flats).chain(triangles).map(Bounds).collect()
}

impl Bvh {
    /// Builds the tree, with one primitive a leaf, and puts the triangles in its order.
    ///
    /// # Errors
    ///
    /// A tree that a traversal's stack cannot hold, or that is broken: kernels rely on it.
    pub fn build(scene: &Scene, quality: Option<BvhQuality>) -> Result<Self, SceneError> {
        let boxes = bounds(scene);
        let mut bvh = match boxes.len() {
            0 => return Ok(Self::leaf(Child::EMPTY)),
            1 => Self::leaf(Child::leaf(0)),
            count => {
                let default = if count <= HIGH_UP_TO { BvhQuality::High } else { BvhQuality::Medium };
                let preset = match quality.unwrap_or(default) {
                    BvhQuality::Fast => BvhBuildParams::fast_build(),
                    BvhQuality::Medium => BvhBuildParams::medium_build(),
                    BvhQuality::High => BvhBuildParams::very_slow_build(),
                };
                // A primitive stands in one leaf: no splits. Its test costs about as much as that of its box.
                let params = BvhBuildParams { pre_split: false, max_prims_per_leaf: 1, ..preset };
                Self::flatten(&build_bvh2(&boxes, params, &mut Duration::default()))
            }
        };
        if bvh.depth > STACK_SIZE {
            bvh = balanced::build(&boxes);
        }
        bvh.prove(boxes.len())
            .map_err(|message| SceneError::Inconsistent { file: scene.name.clone(), message })?;
        bvh.order_triangles(scene);
        Ok(bvh)
    }

    fn leaf(root: Child) -> Self {
        Self { nodes: Vec::new(), root, depth: 0, triangles: Vec::new(), shading: Vec::new() }
    }

    /// Renumbers the triangles by the nodes that name them.
    fn order_triangles(&mut self, scene: &Scene) {
        let first = scene.spheres.len() + scene.flats.len();
        if self.nodes.is_empty() {
            self.triangles = scene.triangles.clone();
            self.shading = scene.shading.clone();
            return;
        }
        self.triangles.reserve_exact(scene.triangles.len());
        self.shading.reserve_exact(scene.triangles.len());
        for node in &mut self.nodes {
            for child in [&mut node.first, &mut node.second] {
                let index = Child(*child).index() as usize;
                if Child(*child).is_leaf() && index >= first {
                    *child = Child::leaf((first + self.triangles.len()) as u32).0;
                    self.triangles.push(scene.triangles[index - first]);
                    self.shading.push(scene.shading[index - first]);
                }
            }
        }
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
            let corners = |b: &Aabb| (Vec3::from(b.min), Vec3::from(b.max));
            nodes.push(BvhNode::new(Child(child(a)), corners(box_a), Child(child(b)), corners(box_b)));
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
        Self { nodes, depth, ..Self::leaf(Child::inner(0)) }
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
            depth: 2,
            ..Bvh::leaf(Child::inner(0))
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

    #[test]
    fn scenes_of_no_and_of_one_object() {
        let mut scene = Scene::hello_world().unwrap();
        scene.spheres.truncate(1);
        assert_eq!(Bvh::build(&scene, None).unwrap().root, Child::leaf(0));
        scene.spheres.clear();
        assert_eq!(Bvh::build(&scene, None).unwrap().root, Child::EMPTY);
    }

    /// Boxes at one place: PLOC merges them into a chain, deeper than the traversal stack.
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
                    Bounds(sphere_bounds(&Sphere { center, ..scene.spheres[0] }))
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
            let b = sphere_bounds(&sphere);
            let (c, r) = (f64::from(center), f64::from(radius));
            assert!(f64::from(b.min.x) < c - r && f64::from(b.max.x) > c + r, "{center} {radius}");
        }
    }
}
