//! Tile entries: for each tile of the image, the BVH pruned to the primitives that the tile's
//! camera rays may hit. A renderer builds them for its camera and appends their nodes to the
//! scene's.

use crate::camera::Lens;
use glam::{DVec3, Vec4};
use rayon::prelude::*;
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::camera::Camera;

/// Maximum number of levels of branching nodes that a tile has of its own; below them it shares the
/// scene's nodes.
const LEVELS: u32 = 8;

/// Tiles along the edge of a block, as a power of two. Blocks are pruned first, then their
/// quarters, down to tiles.
const BLOCK_SHIFT: u32 = 3;

/// Builds the entry into the BVH for the camera rays of each tile of the image: a node of the
/// scene, or one made for the tile.
///
/// Returns the nodes to append to those of `tree`, for an image of `width` x `height` pixels in
/// tiles of 2^`shift` pixels a side. Besides its own children, node t of them has in `tile_entry`
/// the entry of tile t; tiles are numbered row by row. Returns `None` if there are more nodes than
/// a [`Child`] can number, or for a camera whose rays come from no lens.
///
/// Reshetov, Soupikov and Hurley, "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005, find the
/// deepest common node. A tile's own nodes also drop what is beside the tile's rays further down.
pub fn build_tile_entries(
    tree: &[BvhNode],
    root: Child,
    camera: &Camera,
    width: u32,
    height: u32,
    shift: u32,
) -> Option<Vec<BvhNode>> {
    let (across, down) = (width.div_ceil(1 << shift), height.div_ceil(1 << shift));
    let first = u32::try_from(tree.len()).ok()?;
    let (blocks_x, blocks_y) = (across.div_ceil(1 << BLOCK_SHIFT), down.div_ceil(1 << BLOCK_SHIFT));
    let lens = Lens::new(camera, width, height)?;
    let blocks: Vec<TileBlock> = (0..blocks_x * blocks_y)
        .into_par_iter()
        .map(|index| {
            let (nodes, entries) = (Vec::new(), Vec::new());
            let mut block = TileBlock { tree, lens: &lens, shift, size: (width, height), nodes, entries };
            block.descend((root, ChildBox::ALL), (index % blocks_x, index / blocks_x), BLOCK_SHIFT);
            block
        })
        .collect();
    let tiles = across as usize * down as usize;
    let count = blocks.iter().map(|block| block.nodes.len()).sum::<usize>().max(tiles);
    if tree.len() + count > Child::MAX_INDEX as usize {
        return None;
    }
    let mut nodes = Vec::with_capacity(count);
    let mut entries = vec![Child::EMPTY; tiles];
    for block in &blocks {
        let offset = nodes.len() as u32;
        // A block numbers its own nodes as if there were no other block.
        let moved = |child: u32| if Child(child).is_leaf() || child < first { child } else { child + offset };
        nodes.extend(block.nodes.iter().map(|node| BvhNode {
            first: moved(node.first),
            second: moved(node.second),
            ..*node
        }));
        for &((x, y), entry) in &block.entries {
            entries[y as usize * across as usize + x as usize] = Child(moved(entry.0));
        }
    }
    nodes.resize(count, bytemuck::Zeroable::zeroed());
    for (node, entry) in nodes.iter_mut().zip(entries) {
        node.tile_entry = entry.0;
    }
    Some(nodes)
}

/// Block of tiles that one task prunes the BVH for.
struct TileBlock<'a> {
    tree: &'a [BvhNode],
    lens: &'a Lens,
    shift: u32,
    size: (u32, u32),
    /// Nodes of the block, numbered after the scene's.
    nodes: Vec<BvhNode>,
    /// Entry of each tile of the block, by the tile's column and row.
    entries: Vec<((u32, u32), Child)>,
}

impl TileBlock<'_> {
    /// Prunes the subtree for square (`x`, `y`) of 2^`level` tiles a side, and for all tiles in it.
    fn descend(&mut self, root: (Child, ChildBox), (x, y): (u32, u32), level: u32) {
        let edge = self.shift + level;
        let (x0, y0) = (x << edge, y << edge);
        if x0 >= self.size.0 || y0 >= self.size.1 {
            return;
        }
        let frustum = Frustum::new(self.lens, (x0, y0), 1 << edge);
        let root = match root {
            (child, place) if child == Child::EMPTY || !frustum.intersects(&place) => (Child::EMPTY, place),
            (child, place) => self.prune(child, place, &frustum, LEVELS),
        };
        if level == 0 {
            self.entries.push(((x, y), root.0));
            return;
        }
        for quarter in 0..4 {
            self.descend(root, (2 * x + quarter % 2, 2 * y + quarter / 2), level - 1);
        }
    }

    fn node(&self, child: Child) -> BvhNode {
        let index = child.index() as usize;
        if index < self.tree.len() { self.tree[index] } else { self.nodes[index - self.tree.len()] }
    }

    /// Prunes a subtree. Returns what is left of it and the box of that, which is smaller than
    /// `place` if only a part is left.
    fn prune(&mut self, child: Child, place: ChildBox, frustum: &Frustum, levels: u32) -> (Child, ChildBox) {
        if child.is_leaf() || levels == 0 {
            return (child, place);
        }
        let node = self.node(child);
        let places = [0, 1].map(|which| ChildBox::of(&node, which));
        let [a, b] = [node.first, node.second].map(Child);
        match places.each_ref().map(|place| frustum.intersects(place)) {
            [false, false] => (Child::EMPTY, place),
            [true, false] => self.prune(a, places[0], frustum, levels),
            [false, true] => self.prune(b, places[1], frustum, levels),
            [true, true] => {
                let left = self.prune(a, places[0], frustum, levels - 1);
                let right = self.prune(b, places[1], frustum, levels - 1);
                if left.0 == Child::EMPTY {
                    return right;
                }
                if right.0 == Child::EMPTY {
                    return left;
                }
                if left.0 == a && right.0 == b {
                    return (child, place);
                }
                self.nodes.push(ChildBox::join(left, right));
                (Child::inner((self.tree.len() + self.nodes.len() - 1) as u32), place)
            }
        }
    }
}

/// Box of a child in its node: centre and half extent along each axis.
#[derive(Clone, Copy)]
struct ChildBox([(f32, f32); 3]);

impl ChildBox {
    /// Box of a root, which each frustum intersects.
    const ALL: Self = Self([(0.0, f32::INFINITY); 3]);

    fn of(node: &BvhNode, which: usize) -> Self {
        Self([node.x, node.y, node.z].map(|row| (row[which], row[which + 2])))
    }

    fn join(first: (Child, Self), second: (Child, Self)) -> BvhNode {
        let row = |axis: usize| {
            let (a, b) = (first.1.0[axis], second.1.0[axis]);
            Vec4::new(a.0, b.0, a.1, b.1)
        };
        BvhNode {
            x: row(0),
            y: row(1),
            z: row(2),
            first: first.0.0,
            second: second.0.0,
            tile_entry: 0,
            pad: 0,
        }
    }
}

/// Frustum of the rays through some pixels.
struct Frustum<'a> {
    lens: &'a Lens,
    /// Normal, its magnitude by component, and offset of each plane. Planes come in pairs, or
    /// single for a pinhole; a ray's points have normal · p + offset ≥ 0 for at least one of each
    /// pair.
    planes: Vec<(DVec3, DVec3, f64)>,
}

impl<'a> Frustum<'a> {
    /// Returns the frustum of the rays through `size` x `size` pixels, of which (`x`, `y`) is the
    /// top left one.
    fn new(lens: &'a Lens, (x, y): (u32, u32), size: u32) -> Self {
        let [right, down, forward] = lens.axes;
        let mut planes = Vec::with_capacity(8);
        let sides = [
            (right, lens.corner.0 + lens.pixel.0 * f64::from(x), 1.0),
            (right, lens.corner.0 + lens.pixel.0 * (f64::from(x) + f64::from(size)), -1.0),
            (down, lens.corner.1 + lens.pixel.1 * f64::from(y), 1.0),
            (down, lens.corner.1 + lens.pixel.1 * (f64::from(y) + f64::from(size)), -1.0),
        ];
        // A ray from l on the lens through p in the image plane is at (1 - s) l + s p at depth s ·
        // focus. So if p is beyond p0 along an axis, the ray is beyond s p0 - |1 - s| r. A box is
        // outside if it is outside both of these planes.
        for (axis, border, sign) in sides {
            for radius in [lens.radius, -lens.radius] {
                let normal = (axis - forward * ((border * sign + radius) * sign / lens.focus)) * sign;
                planes.push((normal, normal.abs(), radius));
            }
            if lens.radius == 0.0 {
                planes.pop();
            }
        }
        Self { lens, planes }
    }

    fn intersects(&self, ChildBox(axes): &ChildBox) -> bool {
        let center = DVec3::from(axes.map(|axis| f64::from(axis.0))) - self.lens.origin;
        let half = DVec3::from(axes.map(|axis| f64::from(axis.1)));
        let reach = center.abs().element_sum() + half.element_sum();
        let room = TOLERANCE
            * (self.lens.origin.abs().element_sum()
                + 2.0 * reach
                + self.lens.scale * (1.0 + reach / self.lens.focus));
        let beyond = |(normal, size, offset): &(DVec3, DVec3, f64)| {
            normal.dot(center) + size.dot(half) + offset < -room * size.element_sum()
        };
        let forward = self.lens.axes[2];
        if forward.dot(center) + forward.abs().dot(half) < -room {
            return false;
        }
        let pairs = if self.lens.radius == 0.0 { 1 } else { 2 };
        !self.planes.chunks(pairs).any(|pair| pair.iter().all(beyond))
    }
}

/// Bound of the difference between a device's rays and exact ones, and between boxes and what a
/// traversal enters, relative to the lengths that take part: 80 times the rounding of one
/// operation.
const TOLERANCE: f64 = 1e-5;

#[cfg(test)]
mod tests;
