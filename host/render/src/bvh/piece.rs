//! Trees that obvhs builds in one piece, as the records of devices.

use super::Bvh;
use super::bounds::{Bounds, BoxOf, shifted};
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance};
use obvhs::{Boundable, BvhBuildParams};
use std::ops::Range;
use trisect_shared::bvh::{BvhNode, Child};

/// Minimum number of primitives for which the builder gets shifted boxes (see [`shifted`]).
const MIN_SHIFTED_PRIMITIVES: usize = 4096;

/// Builds a tree as obvhs's `build_bvh2` does, with one primitive in a leaf, because testing a
/// primitive costs about as much as testing its box. In debug builds, `build_bvh2` also checks that
/// the stack of obvhs's own traversal suffices for a tree that reinsertion made deep. That
/// traversal is not used here, and neither is the check.
///
/// The builder sorts the boxes along a curve through `frame` of their union.
pub(super) fn build_tree(
    count: usize,
    boxes: impl Fn(u32) -> Bounds,
    frame: impl Fn(Bounds) -> Bounds,
    preset: &BvhBuildParams,
) -> Bvh2 {
    let BvhBuildParams { ploc_search_distance, sort_precision, search_depth_threshold, .. } = *preset;
    let mut tree = Bvh2::zeroed(count);
    let mut builder = PlocBuilder::with_capacity(count);
    let mut all = Bounds::EMPTY;
    for (i, node) in (0u32..).zip(&mut builder.current_nodes) {
        let bounds = boxes(i);
        all = Bounds::union([all, bounds].into_iter());
        tree.primitive_indices[i as usize] = i;
        *node = Bvh2Node::new(bounds.aabb(), 1, i);
    }
    let build = match ploc_search_distance {
        PlocSearchDistance::Minimum => PlocBuilder::build_ploc_from_leaves::<1, false>,
        PlocSearchDistance::VeryLow => PlocBuilder::build_ploc_from_leaves::<2, false>,
        PlocSearchDistance::Low => PlocBuilder::build_ploc_from_leaves::<6, false>,
        PlocSearchDistance::Medium => PlocBuilder::build_ploc_from_leaves::<14, false>,
        PlocSearchDistance::High => PlocBuilder::build_ploc_from_leaves::<24, false>,
        PlocSearchDistance::VeryHigh => PlocBuilder::build_ploc_from_leaves::<32, false>,
    };
    build(&mut builder, &mut tree, frame(all).aabb(), sort_precision, search_depth_threshold);
    // Reinsertion has arrays of its own.
    drop(builder);
    let (first, then) =
        (preset.reinsertion_batch_ratio, preset.post_collapse_reinsertion_batch_ratio_multiplier);
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut tree, first, None);
    optimizer.run(&mut tree, first * then, None);
    tree
}

/// Writes the inner nodes below and at `root` of the builder's tree to the beginning of `nodes`,
/// depth-first, so that a subtree's nodes lie together. The number of `nodes[0]` is `first`, and
/// `leaf` is the primitive of a number in the tree. Returns how many nodes and levels there are.
pub(super) fn write_nodes(
    tree: &Bvh2,
    root: usize,
    nodes: &mut [BvhNode],
    first: usize,
    leaf: impl Fn(u32) -> u32,
) -> (usize, usize) {
    let (mut count, mut depth) = (0, 0);
    // A node of the tree, the slot in its parent that waits for its index, and its level.
    let mut pending = vec![(root, None::<(usize, bool)>, 1usize)];
    while let Some((index, slot, level)) = pending.pop() {
        let second = tree.nodes[index].first_index as usize + 1;
        let (a, b) = (&tree.nodes[second - 1], &tree.nodes[second]);
        let me = count;
        let child = |node: &Bvh2Node| {
            if node.is_leaf() {
                Child::leaf(leaf(tree.primitive_indices[node.first_index as usize]))
            } else {
                Child(0) // filled in when the child is visited
            }
        };
        let (box_a, box_b) = (Bounds::of(a.aabb()).corners(), Bounds::of(b.aabb()).corners());
        nodes[me] = BvhNode::new(child(a), box_a, child(b), box_b);
        count += 1;
        if let Some((parent, is_second)) = slot {
            let parent = &mut nodes[parent];
            *(if is_second { &mut parent.second } else { &mut parent.first }) =
                Child::inner((first + me) as u32).0;
        }
        depth = depth.max(level);
        for (node, index, is_second) in [(b, second, true), (a, second - 1, false)] {
            if !node.is_leaf() {
                pending.push((index, Some((me, is_second)), level + 1));
            }
        }
    }
    (count, depth)
}

/// Sets the boxes of the nodes in `range` to those of what is below them. The number of `nodes[0]`
/// is `first`.
pub(super) fn refit(nodes: &mut [BvhNode], first: usize, range: Range<usize>, boxes: BoxOf) {
    let of = |nodes: &[BvhNode], child: Child| {
        if child.is_leaf() {
            return boxes(child.index()).corners();
        }
        let [(low, high), (low2, high2)] = nodes[child.index() as usize - first].boxes();
        (low.min(low2), high.max(high2))
    };
    // Children come after their parents.
    for index in range.rev() {
        let (first, second) = (Child(nodes[index].first), Child(nodes[index].second));
        let (a, b) = (of(nodes, first), of(nodes, second));
        nodes[index] = BvhNode::new(first, a, second, b);
    }
}

impl Bvh {
    /// Builds a tree over at least two boxes in one piece; `frame` is that of [`build_tree`].
    pub(super) fn whole(
        count: usize,
        boxes: BoxOf,
        frame: impl Fn(Bounds) -> Bounds,
        preset: &BvhBuildParams,
    ) -> Self {
        let shift = count >= MIN_SHIFTED_PRIMITIVES;
        let of = |i| if shift { shifted(i, &boxes(i)) } else { boxes(i) };
        let tree = build_tree(count, of, frame, preset);
        let mut nodes = vec![bytemuck::Zeroable::zeroed(); count - 1];
        let (_, depth) = write_nodes(&tree, 0, &mut nodes, 0, |primitive| primitive);
        let mut bvh = Self { nodes: nodes.into(), depth, ..Self::leaf(Child::inner(0)) };
        if shift {
            bvh.refit(boxes);
        }
        bvh
    }

    /// Sets the boxes of all nodes to those of what is below them.
    pub(super) fn refit(&mut self, boxes: BoxOf) {
        let all = 0..self.nodes.len();
        refit(&mut self.nodes, 0, all, boxes);
        self.has_refitted_boxes = true;
    }
}
