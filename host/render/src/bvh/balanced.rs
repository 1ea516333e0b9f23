//! BVH of bounded depth, for input from which PLOC makes a chain: many boxes at one place.

use super::Bvh;
use super::bounds::{Bounds, BoxOf};
use glam::Vec3A;
use std::ops::Range;
use trisect_shared::bvh::{BvhNode, Child};

/// Slot for a node's index: the parent node, and whether it is the second child; `None` for the
/// root.
type Slot = Option<(usize, bool)>;

/// Builds a BVH by splitting at the median along the axis of the widest spread of centres. It has
/// ⌈log₂ n⌉ levels for any n ≥ 2 boxes.
pub(super) fn build(count: usize, boxes: BoxOf) -> Bvh {
    let mut order: Vec<u32> = (0..count as u32).collect();
    let mut nodes: Vec<BvhNode> = Vec::with_capacity(count - 1);
    let mut depth = 0;
    let mut pending: Vec<(Range<usize>, Slot, usize)> = vec![(0..count, None, 1)];
    while let Some((range, slot, level)) = pending.pop() {
        let part = &mut order[range.clone()];
        let axis = widest_axis(part.iter().map(|&i| boxes(i).center()));
        let middle = part.len() / 2;
        let key = |i: &u32| boxes(*i).center()[axis];
        part.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let (first, second) = part.split_at(middle);
        let (box_a, box_b) = (union(boxes, first), union(boxes, second));
        let leaf = |part: &[u32]| if let [one] = part { Child::leaf(*one).0 } else { 0 };
        let me = nodes.len();
        let (box_a, box_b) = (box_a.corners(), box_b.corners());
        nodes.push(BvhNode::new(Child(leaf(first)), box_a, Child(leaf(second)), box_b));
        if let Some((parent, is_second)) = slot {
            let parent = &mut nodes[parent];
            *(if is_second { &mut parent.second } else { &mut parent.first }) = Child::inner(me as u32).0;
        }
        depth = depth.max(level);
        let split = range.start + middle;
        for (part, is_second) in [(split..range.end, true), (range.start..split, false)] {
            if part.len() > 1 {
                pending.push((part, Some((me, is_second)), level + 1));
            }
        }
    }
    Bvh { nodes: nodes.into(), depth, ..Bvh::leaf(Child::inner(0)) }
}

fn union(boxes: BoxOf, part: &[u32]) -> Bounds {
    Bounds::union(part.iter().map(|&i| boxes(i)))
}

fn widest_axis(centers: impl Iterator<Item = Vec3A>) -> usize {
    let (low, high) = centers.fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(low, high), center| {
        (low.min(center), high.max(center))
    });
    (high - low).max_position()
}
