//! The cheapest way to collapse a binary BVH: for each subtree, how the children of a wide node, or
//! the trees of a forest, are divided between both children of the subtree's root.

use super::{LeafKind, area, union};
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::simd::LANES;

/// Bits of a division: a number of trees below the first child, less than [`LANES`].
const BITS: u32 = LANES.ilog2();

const _: () = assert!(BITS * (LANES as u32 - 1) <= u32::BITS);

/// Divisions of all subtrees of a binary BVH, 4 bytes for each node.
pub(super) struct CollapsePlan(Vec<u32>);

impl CollapsePlan {
    /// Plan of a BVH without nodes.
    pub const NONE: Self = Self(Vec::new());

    /// Plans the collapse of trees whose children come after their parents; `kind` is that of a
    /// primitive. Costs are expected visits: a node's area relative to that of the first node; a
    /// leaf costs as much as a node (docs/notebook/triangles-and-trees.md).
    pub fn new(nodes: &[BvhNode], kind: impl Fn(u32) -> LeafKind) -> Self {
        let mut divisions = vec![0; nodes.len()];
        let root = nodes.first().map_or(1.0, |node| {
            let [a, b] = node.boxes();
            area(union(a, b))
        });
        let mut waiting = Waiting(Vec::new());
        let of = |waiting: &mut Waiting, child: Child, area: f32| {
            if child.is_leaf() {
                let kind = Some(kind(child.index()));
                Costs { node: 0, cost: [area; LANES - 1], count: 1, kind, taken: false }
            } else {
                waiting.take(child.index())
            }
        };
        for (index, node) in nodes.iter().enumerate().rev() {
            let [a, b] = node.boxes();
            let [area, area_a, area_b] = [union(a, b), a, b].map(|b| (area(b) / root) as f32);
            let a = of(&mut waiting, Child(node.first), area_a);
            let b = of(&mut waiting, Child(node.second), area_b);
            let (costs, firsts) = combine(&a, &b, area);
            divisions[index] = firsts.iter().rev().fold(0, |all, &first| all << BITS | u32::from(first));
            waiting.0.push(Costs { node: index as u32, ..costs });
        }
        Self(divisions)
    }

    /// Returns, for the subtree of an inner node as a forest of at most `trees` trees, how many of
    /// them lie below its first child, or 0 if fewer trees cost no more. For one tree: how many of
    /// its node's eight children, or 0 for a leaf.
    pub fn first(&self, node: Child, trees: usize) -> usize {
        (self.0[node.index() as usize] >> (BITS * (trees as u32 - 1))) as usize & (LANES - 1)
    }

    /// Returns whether a child becomes a node of the wide BVH, if it becomes one tree.
    pub fn is_node(&self, child: Child) -> bool {
        !child.is_leaf() && self.first(child, 1) != 0
    }
}

/// Costs of a subtree.
#[derive(Clone, Copy)]
struct Costs {
    /// Node at its root.
    node: u32,
    /// Cost as a forest of at most 1, 2, ..., 7 trees.
    cost: [f32; LANES - 1],
    /// Number of primitives, at most one more than a leaf holds.
    count: u8,
    /// Kind of the primitives; `None` if they are of several kinds.
    kind: Option<LeafKind>,
    /// True once the parent has them.
    taken: bool,
}

/// Costs of the subtrees whose parents are not reached yet, in descending order of their nodes. In
/// a tree that is numbered depth-first, those of a node's children are the last two.
struct Waiting(Vec<Costs>);

impl Waiting {
    fn take(&mut self, node: u32) -> Costs {
        while self.0.last().is_some_and(|costs| costs.taken) {
            self.0.pop();
        }
        if self.0.last().is_some_and(|costs| costs.node == node)
            && let Some(costs) = self.0.pop()
        {
            return costs;
        }
        // A validated tree has each node after its parent.
        let place = self.0.partition_point(|costs| costs.node > node);
        self.0[place].taken = true;
        self.0[place]
    }
}

/// Returns the costs of a node with these children and this area, and its divisions.
fn combine(a: &Costs, b: &Costs, area: f32) -> (Costs, [u8; LANES - 1]) {
    // The cheapest division of `trees` trees between both children; some division even if no cost
    // is a number.
    let share = |trees: usize| {
        let cost = |first: usize| a.cost[first - 1] + b.cost[trees - first - 1];
        let least = (trees + 1).saturating_sub(LANES).max(1);
        (least..trees.min(LANES)).fold((cost(least), least as u8), |best, first| {
            let cost = cost(first);
            if cost < best.0 { (cost, first as u8) } else { best }
        })
    };
    let kind = if a.kind == b.kind { a.kind } else { None };
    let count = (a.count + b.count).min(LANES as u8 + 1);
    let gathers = |kind| matches!(kind, LeafKind::Spheres | LeafKind::Triangles);
    let fits = usize::from(count) <= LANES && kind.is_some_and(gathers);
    let (mut cost, mut firsts) = ([0.0; LANES - 1], [0; LANES - 1]);
    let (below, first) = share(LANES);
    let inner = area + below;
    (cost[0], firsts[0]) = if fits && area <= inner { (area, 0) } else { (inner, first) };
    for trees in 2..LANES {
        let (divided, first) = share(trees);
        let fewer = cost[trees - 2];
        (cost[trees - 1], firsts[trees - 1]) = if divided < fewer { (divided, first) } else { (fewer, 0) };
    }
    (Costs { node: 0, cost, count, kind, taken: false }, firsts)
}
