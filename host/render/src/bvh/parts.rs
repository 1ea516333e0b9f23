//! Construction of a large tree in parts, so that obvhs's arrays, of about 220 bytes for each
//! primitive, are those of a few parts and not of the scene.
//!
//! The primitives are divided into parts that are compact in space. obvhs builds the tree of each
//! part, whose nodes are then written where they stay. The top levels of all parts' trees are
//! opened, and obvhs builds a tree over the subtrees that remain: a large primitive, or what lies
//! at the seam between two parts, is then placed as in a tree that is built in one piece.
//!
//! The boxes of a part are sorted along a curve through a cube. A frame that is stretched to the
//! part's box would take neighbours apart where the part is flat.

use super::Bvh;
use super::bounds::{Bounds, BoxOf, shifted};
use super::piece::{build_tree, refit, write_nodes};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::{Mutex, PoisonError};
use trisect_shared::bvh::{BvhNode, Child};

/// Sizes of the parts of a tree.
#[derive(Clone, Copy)]
pub(super) struct PartSizes {
    /// Maximum number of primitives of a tree that is built in one piece.
    pub whole: usize,
    /// Maximum number of primitives of a part.
    pub part: usize,
    /// Number of subtrees into which a part's tree is opened.
    pub subtrees: usize,
}

impl PartSizes {
    /// The sizes for scenes (docs/notebook/triangles-and-trees.md).
    pub const DEFAULT: Self = Self { whole: 1 << 19, part: 1 << 17, subtrees: 32 };
}

/// Parts that are built at once have at most this share of the primitives together, which bounds
/// the memory: the wide BVH needs more later.
const MAX_SHARE: usize = 12;

/// Maximum number of boxes of which a division is chosen.
const SAMPLES: usize = 8192;

/// Number of candidates of a division along an axis, plus one.
const BINS: usize = 32;

/// Smaller side of a division, as a share of the primitives: at least 1 in this many.
const MIN_SIDE: usize = 8;

/// Builds a tree over at least two boxes in parts. It does not depend on the number of threads.
pub(super) fn build(count: usize, boxes: BoxOf, preset: &BvhBuildParams, sizes: &PartSizes) -> Bvh {
    let mut primitives: Vec<u32> = (0..count as u32).collect();
    let parts = divide(&mut primitives, boxes, sizes.part.max(1));
    let subtrees_of = |part: &[u32]| part.len().min(sizes.subtrees.max(1));
    let subtrees: usize = parts.iter().map(|part| subtrees_of(part)).sum();
    // First the nodes above the subtrees, then those of each part.
    let top = subtrees - 1;
    let mut nodes: Vec<BvhNode> = vec![bytemuck::Zeroable::zeroed(); count - 1];
    let (mut rest, mut first) = (&mut nodes[top..], top);
    let mut jobs = Vec::with_capacity(parts.len());
    for primitives in parts {
        let subtrees = subtrees_of(primitives);
        let inner = primitives.len() - subtrees;
        let (mine, others) = rest.split_at_mut(inner);
        jobs.push(Part { primitives, nodes: mine, first, subtrees: Vec::with_capacity(subtrees) });
        (rest, first) = (others, first + inner);
    }
    let workers = (count / (MAX_SHARE * sizes.part.max(1))).clamp(1, rayon::current_num_threads());
    let queue = Mutex::new(jobs.iter_mut());
    rayon::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|_| {
                loop {
                    let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some(part) = next else { return };
                    part.build(boxes, preset, sizes.subtrees.max(1));
                }
            });
        }
    });
    let subtrees: Vec<Subtree> = jobs.into_iter().flat_map(|part| part.subtrees).collect();
    drop(primitives);
    let depth = join(&mut nodes[..top], &subtrees, preset);
    let root = if top == 0 { subtrees[0].root } else { Child::inner(0) };
    Bvh { nodes: nodes.into(), depth, has_refitted_boxes: true, ..Bvh::leaf(root) }
}

/// Subtree of a part's tree.
struct Subtree {
    root: Child,
    /// Number of levels of inner nodes.
    depth: usize,
    bounds: Bounds,
}

/// A part of the primitives, and the place of its nodes.
struct Part<'a> {
    primitives: &'a [u32],
    /// Nodes of the subtrees.
    nodes: &'a mut [BvhNode],
    /// Number of `nodes[0]` in the tree.
    first: usize,
    subtrees: Vec<Subtree>,
}

impl Part<'_> {
    /// Builds the part's tree, and writes the nodes of the subtrees into which it is opened.
    fn build(&mut self, boxes: BoxOf, preset: &BvhBuildParams, subtrees: usize) {
        let shifted = |local: u32| {
            let primitive = self.primitives[local as usize];
            shifted(primitive, &boxes(primitive))
        };
        let tree = build_tree(self.primitives.len(), shifted, Bounds::cube, preset);
        let mut used = 0;
        for root in open(&tree, subtrees) {
            let (node, first) = (&tree.nodes[root as usize], self.first + used);
            let subtree = if node.is_leaf() {
                let local = tree.primitive_indices[node.first_index as usize];
                let primitive = self.primitives[local as usize];
                Subtree { root: Child::leaf(primitive), depth: 0, bounds: boxes(primitive) }
            } else {
                let nodes = &mut self.nodes[used..];
                let of = |local: u32| self.primitives[local as usize];
                let (count, depth) = write_nodes(&tree, root as usize, nodes, first, of);
                refit(nodes, first, 0..count, boxes);
                used += count;
                let [(low, high), (low2, high2)] = nodes[0].boxes();
                let bounds = Bounds { min: low.min(low2).into(), max: high.max(high2).into() };
                Subtree { root: Child::inner(first as u32), depth, bounds }
            };
            self.subtrees.push(subtree);
        }
    }
}

/// Opens the node with the largest box until there are `count` subtrees, or none has an inner node.
/// Returns their roots.
fn open(tree: &Bvh2, count: usize) -> Vec<u32> {
    let (mut leaves, mut inner) = (Vec::new(), BinaryHeap::new());
    let mut opened = vec![0];
    loop {
        for index in opened {
            let node = &tree.nodes[index as usize];
            if node.is_leaf() {
                leaves.push(index);
            } else {
                // The bits of floats that are not negative have the order of the floats.
                inner.push((node.aabb().half_area().max(0.0).to_bits(), Reverse(index)));
            }
        }
        if leaves.len() + inner.len() >= count {
            break;
        }
        let Some((_, Reverse(index))) = inner.pop() else { break };
        let first = tree.nodes[index as usize].first_index;
        opened = vec![first, first + 1];
    }
    leaves.extend(inner.into_sorted_vec().into_iter().map(|(_, Reverse(index))| index));
    leaves
}

/// Builds the tree above the subtrees: there are few, so all of them are candidates for
/// reinsertion. Returns the number of levels of all.
fn join(nodes: &mut [BvhNode], subtrees: &[Subtree], preset: &BvhBuildParams) -> usize {
    let [_, _, ..] = subtrees else {
        return subtrees.iter().map(|subtree| subtree.depth).max().unwrap_or(0);
    };
    let preset = BvhBuildParams {
        reinsertion_batch_ratio: 1.0,
        post_collapse_reinsertion_batch_ratio_multiplier: 1.0,
        ..*preset
    };
    let boxes: BoxOf = &|i| subtrees[i as usize].bounds;
    let mut top = Bvh::whole(subtrees.len(), boxes, Bounds::cube, &preset);
    top.refit(boxes);
    let mut levels = vec![1usize; nodes.len()];
    let mut depth = 0;
    for (index, (node, of_top)) in nodes.iter_mut().zip(&top.nodes).enumerate() {
        *node = *of_top;
        let level = levels[index];
        for child in [&mut node.first, &mut node.second] {
            let below = Child(*child).index() as usize;
            if Child(*child).is_leaf() {
                *child = subtrees[below].root.0;
                depth = depth.max(level + subtrees[below].depth);
            } else {
                levels[below] = level + 1;
            }
        }
    }
    depth
}

/// Divides primitives into parts of at most `part`, each of which gets its range of `primitives`.
fn divide<'a>(primitives: &'a mut [u32], boxes: BoxOf, part: usize) -> Vec<&'a [u32]> {
    let mut parts = Vec::new();
    let mut pending = vec![primitives];
    while let Some(range) = pending.pop() {
        if range.len() <= part {
            parts.push(&*range);
            continue;
        }
        let (axis, place) = division(range, boxes);
        let is_first = |i: u32| boxes(i).center()[axis] < place;
        let mut middle = partition(range, is_first);
        if middle.min(range.len() - middle) < (range.len() / MIN_SIDE).max(1) {
            // Centres at one place, or samples that say little of the rest.
            middle = range.len() / 2;
            let key = |i: u32| boxes(i).center()[axis];
            range.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        }
        let (first, second) = range.split_at_mut(middle);
        pending.extend([second, first]);
    }
    parts
}

/// Moves the elements for which `is_first` to the front. Returns their number.
fn partition(elements: &mut [u32], is_first: impl Fn(u32) -> bool) -> usize {
    let (mut low, mut high) = (0, elements.len());
    while low < high {
        if is_first(elements[low]) {
            low += 1;
        } else {
            high -= 1;
            elements.swap(low, high);
        }
    }
    low
}

/// Returns axis and place of the division with the least cost by the surface area heuristic, of
/// samples, in bins; the middle of the widest axis if no division has enough on both sides.
fn division(primitives: &[u32], boxes: BoxOf) -> (usize, f32) {
    let samples: Vec<Bounds> =
        primitives.iter().step_by(primitives.len().div_ceil(SAMPLES)).map(|&i| boxes(i)).collect();
    let centers = Bounds::union(samples.iter().map(|b| Bounds { min: b.center(), max: b.center() }));
    let size = centers.max - centers.min;
    let widest = size.max_position();
    let mut best = (f32::INFINITY, widest, centers.center()[widest]);
    for axis in 0..3 {
        let mut bins = [(0usize, Bounds::EMPTY); BINS];
        let scale = BINS as f32 / size[axis];
        for sample in &samples {
            // A quotient that is no number falls into the first bin.
            let bin = ((sample.center()[axis] - centers.min[axis]) * scale) as usize;
            let bin = &mut bins[bin.min(BINS - 1)];
            *bin = (bin.0 + 1, Bounds::union([bin.1, *sample].into_iter()));
        }
        let join =
            |a: (usize, Bounds), b: (usize, Bounds)| (a.0 + b.0, Bounds::union([a.1, b.1].into_iter()));
        let mut after = bins;
        for bin in (0..BINS - 1).rev() {
            after[bin] = join(after[bin], after[bin + 1]);
        }
        let mut before = (0, Bounds::EMPTY);
        for bin in 1..BINS {
            before = join(before, bins[bin - 1]);
            let (first, second) = (before, after[bin]);
            let cost = first.1.half_area() * first.0 as f32 + second.1.half_area() * second.0 as f32;
            if first.0.min(second.0) > samples.len() / (MIN_SIDE - 1) && cost < best.0 {
                best = (cost, axis, centers.min[axis] + bin as f32 / scale);
            }
        }
    }
    (best.1, best.2)
}

#[cfg(test)]
mod tests;
