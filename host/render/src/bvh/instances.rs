//! Trees of shared meshes, and the records of their instances, behind the tree of the world.

use super::bounds::{BoxOf, triangle_bounds};
use super::{Bvh, BvhQuality, balanced};
use trisect_scene::{Scene, SharedInstance};
use trisect_shared::bvh::{BvhNode, Child, STACK_SIZE};
use trisect_shared::instance::InstanceEntry;

impl Bvh {
    /// Appends the trees and triangles of the shared meshes and the records of the instances, and
    /// numbers the leaves of instances behind all primitives.
    pub(super) fn append_meshes(&mut self, scene: &Scene, quality: Option<BvhQuality>) -> Result<(), String> {
        let world = scene.world_primitives();
        self.first_instance = scene.primitives();
        self.number_instances(world);
        let starts = scene.shared.starts();
        let mut ranges = Vec::with_capacity(scene.shared.meshes.len());
        let mut depth = 0;
        self.nodes.reserve_exact(scene.shared.triangles.len() + 2 * scene.shared.instances.len());
        for range in starts.windows(2).map(|ends| ends[0]..ends[1]) {
            let triangles = &scene.shared.triangles[range.clone()];
            let boxes: BoxOf = &|index| triangle_bounds(&triangles[index as usize]);
            let mut tree = Self::over(triangles.len(), boxes, quality)?;
            // The world's levels, the level of the instance, and the mesh's share a stack.
            if self.depth + 1 + tree.depth > STACK_SIZE {
                tree = balanced::build(triangles.len(), boxes);
            }
            depth = depth.max(tree.depth);
            let first = (world + range.start) as u32;
            ranges.push((first, triangles.len() as u32));
            self.append_tree(&tree, first);
        }
        if !scene.shared.instances.is_empty() && self.depth + 1 + depth > STACK_SIZE {
            return Err(format!(
                "the trees of the scene and of a mesh in it have {} levels, and traversal supports {STACK_SIZE}: too many objects at nearly one place",
                self.depth + 1 + depth
            ));
        }
        self.append_instances(&scene.shared.instances, &ranges)
    }

    /// Numbers the leaves of instances, which follow `world` primitives, from `first_instance` on.
    fn number_instances(&mut self, world: usize) {
        let by = self.first_instance - world;
        let number = |child: &mut u32| {
            let leaf = Child(*child);
            if leaf != Child::EMPTY && leaf.is_leaf() && leaf.index() as usize >= world {
                *child = Child::leaf((leaf.index() as usize + by) as u32).0;
            }
        };
        for node in &mut self.nodes {
            number(&mut node.first);
            number(&mut node.second);
        }
        number(&mut self.root.0);
    }

    /// Appends the tree of a mesh, whose triangles have numbers from `first` on.
    fn append_tree(&mut self, tree: &Self, first: u32) {
        let nodes = self.nodes.len() as u32;
        let moved = |child: u32| match Child(child).is_leaf() {
            true => Child::leaf(first + Child(child).index()).0,
            false => nodes + Child(child).index(),
        };
        let root = Child(moved(tree.root.0));
        for node in &tree.nodes {
            self.nodes.push(BvhNode { first: moved(node.first), second: moved(node.second), ..*node });
        }
        self.mesh_roots.push(root);
    }

    /// Appends the records of the instances; `ranges` has the first number and the count of each
    /// mesh's triangles.
    fn append_instances(
        &mut self,
        instances: &[SharedInstance],
        ranges: &[(u32, u32)],
    ) -> Result<(), String> {
        self.first_instance_node = self.nodes.len();
        self.nodes.reserve_exact(2 * instances.len());
        for (index, instance) in instances.iter().enumerate() {
            let records = InstanceEntry::placed(instance.map());
            let (Some(root), Some(&(first_triangle, triangle_count)), Some((entry, placement))) =
                (self.mesh_roots.get(instance.mesh as usize), ranges.get(instance.mesh as usize), records)
            else {
                return Err(format!("instance {index} has no mesh, or its transform has no inverse"));
            };
            let entry = InstanceEntry { root: root.0, first_triangle, triangle_count, ..entry };
            self.nodes.extend([bytemuck::cast::<_, BvhNode>(entry), bytemuck::cast(placement)]);
        }
        Ok(())
    }

    /// Returns the number of the first instance among the leaves, as launches state it; in a scene
    /// without instances a number that no leaf has.
    pub fn first_leaf_of_instances(&self) -> u32 {
        if self.mesh_roots.is_empty() { u32::MAX } else { self.first_instance as u32 }
    }

    /// Returns the inner nodes of all trees, without the records of instances.
    pub fn inner_nodes(&self) -> &[BvhNode] {
        &self.nodes[..self.first_instance_node]
    }
}
