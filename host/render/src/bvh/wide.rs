//! Wide BVH of the CPU: the binary one collapsed to eight children a node, with up to eight
//! primitives of one kind in a leaf.

mod plan;
mod sharing;
mod validate;

use super::Bvh;
use glam::Vec3;
use plan::CollapsePlan;
use sharing::PacketPlaces;
use trisect_scene::{Scene, SceneError, SharedVec};
use trisect_shared::bvh::{Child, Corners};
use trisect_shared::simd::{LANES, SimdRow};
use trisect_shared::triangle::Triangle;
use trisect_shared::wide::{LeafKind, SpherePacket, TrianglePacket, WideChild, WideNode, WideTree};

/// Wide BVH, which the CPU traces, over the primitives of a [`Bvh`], with that BVH's numbering.
#[derive(Clone, Debug)]
pub struct Wide {
    /// Root of the tree: a node or a leaf.
    pub root: WideChild,
    /// Root of the mesh of each instance, as a [`WideChild`] word.
    pub instance_roots: Vec<u32>,
    /// Inner nodes, parents before children, depth-first.
    pub nodes: SharedVec<WideNode>,
    /// Leaves of spheres.
    pub spheres: Vec<SpherePacket>,
    /// Leaves of triangles.
    pub triangles: SharedVec<TrianglePacket>,
}

impl Wide {
    /// Collapses the binary BVH so that the total area of nodes and leaves is smallest (Ylitie,
    /// Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs",
    /// HPG 2017, section 3.2, with leaves of up to eight). Returns `None` if `bvh` has 2²⁶ or more
    /// inner nodes, triangles, or spheres, quads and discs together, or needs 2²³ packets of
    /// triangles: a [`WideChild`] might not be able to number them.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a tree that is broken, because the traversal relies on it.
    pub fn new(scene: &Scene, bvh: &Bvh) -> Result<Option<Self>, SceneError> {
        let builder = Builder::new(scene, bvh);
        let Some(wide) = builder.build() else { return Ok(None) };
        let instances = scene.shared.instances.len();
        let triangles = scene.triangles.len() + scene.shared.triangles.len();
        let counts = [scene.spheres.len(), scene.flats.len(), triangles, instances];
        wide.validate(counts)
            .map_err(|message| SceneError::Inconsistent { file: scene.name.clone(), message })?;
        Ok(Some(wide))
    }

    /// Returns the tree as kernels get it.
    pub fn tree(&self) -> WideTree<'_> {
        let Self { root, instance_roots, nodes, spheres, triangles } = self;
        WideTree { root: *root, instance_roots, nodes, spheres, triangles }
    }
}

struct Builder<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    first_flat: u32,
    first_triangle: u32,
    first_instance: u32,
    plan: CollapsePlan,
    places: PacketPlaces,
    wide: Wide,
}

/// Returns half the surface area of a box, in f64: the squares of large f32 numbers exceed the
/// range of f32.
fn area((low, high): Corners) -> f64 {
    let size = high.as_dvec3() - low.as_dvec3();
    size.x * size.y + size.y * size.z + size.z * size.x
}

fn union(a: Corners, b: Corners) -> Corners {
    (a.0.min(b.0), a.1.max(b.1))
}

impl<'a> Builder<'a> {
    fn new(scene: &'a Scene, bvh: &'a Bvh) -> Self {
        let first_flat = scene.spheres.len() as u32;
        Self {
            scene,
            bvh,
            first_flat,
            first_triangle: first_flat + scene.flats.len() as u32,
            first_instance: bvh.first_instance as u32,
            plan: CollapsePlan::NONE,
            places: PacketPlaces::default(),
            wide: Wide {
                root: WideChild::EMPTY,
                instance_roots: Vec::new(),
                nodes: SharedVec::default(),
                spheres: Vec::new(),
                triangles: SharedVec::default(),
            },
        }
    }

    /// Returns a triangle, in the world or of a shared mesh.
    fn triangle(&self, index: usize) -> &Triangle {
        let world = &self.scene.triangles;
        world.get(index).unwrap_or_else(|| &self.scene.shared.triangles[index - world.len()])
    }

    fn kind(&self, primitive: u32) -> LeafKind {
        if primitive >= self.first_instance {
            LeafKind::Instance
        } else if primitive >= self.first_triangle {
            LeafKind::Triangles
        } else if primitive >= self.first_flat {
            LeafKind::Planar
        } else {
            LeafKind::Spheres
        }
    }

    fn build(mut self) -> Option<Wide> {
        let bvh = self.bvh;
        let limit = WideChild::MAX_INDEX as usize;
        let instances = self.scene.shared.instances.len();
        let most = bvh.nodes.len().max(self.scene.primitives()).max(instances);
        if self.first_triangle as usize > limit || most > limit {
            return None;
        }
        if bvh.root == Child::EMPTY {
            return Some(self.wide);
        }
        self.plan = CollapsePlan::new(bvh.inner_nodes(), |primitive| self.kind(primitive));
        if !self.reserve() {
            return None;
        }
        self.wide.root = self.emit(bvh.root);
        let mesh_roots: Vec<u32> = bvh.mesh_roots.iter().map(|&root| self.emit(root).0).collect();
        let instances = &self.scene.shared.instances;
        self.wide.instance_roots = instances.iter().map(|of| mesh_roots[of.mesh as usize]).collect();
        Some(self.wide)
    }

    /// Reserves the memory of all nodes and packets: growing arrays would take twice as much.
    /// Returns whether the packets of triangles can be numbered.
    fn reserve(&mut self) -> bool {
        let (mut nodes, mut spheres, mut triangles) = (0, 0, PacketPlaces::default());
        // As `emit`: the places depend on the order.
        let roots = [self.bvh.root].into_iter().chain(self.bvh.mesh_roots.iter().copied());
        let mut pending: Vec<Child> = roots.rev().collect();
        let (mut list, mut primitives) = (Vec::with_capacity(LANES), Vec::with_capacity(LANES));
        while let Some(child) = pending.pop() {
            if self.plan.is_node(child) {
                nodes += 1;
                self.forest(child, self.plan.first(child, 1), LANES, &mut list);
                pending.extend(list.drain(..).rev().map(|(child, _)| child));
                continue;
            }
            self.primitives_below(child, &mut primitives);
            match self.kind(primitives[0]) {
                LeafKind::Spheres => spheres += 1,
                LeafKind::Triangles => _ = triangles.place(primitives.len()),
                LeafKind::Planar | LeafKind::Instance => {}
            }
        }
        self.wide.nodes.reserve_exact(nodes);
        self.wide.spheres.reserve_exact(spheres);
        self.wide.triangles.reserve_exact(triangles.packets);
        triangles.packets * LANES <= WideChild::MAX_INDEX as usize + 1
    }

    /// Makes the nodes and leaves, from `root` down. Returns what becomes of it.
    fn emit(&mut self, root: Child) -> WideChild {
        // A child of the binary BVH that becomes one of the wide BVH, and the slot that waits for
        // it.
        let mut pending = vec![(root, None::<(usize, usize)>)];
        let mut emitted = WideChild::EMPTY;
        let mut list = Vec::with_capacity(LANES);
        while let Some((child, slot)) = pending.pop() {
            let is_node = self.plan.is_node(child);
            let word =
                if is_node { WideChild::inner(self.wide.nodes.len() as u32) } else { self.leaf(child) };
            match slot {
                Some((node, lane)) => self.wide.nodes[node].children.0[lane] = word.0,
                None => emitted = word,
            }
            if is_node {
                list.clear();
                self.forest(child, self.plan.first(child, 1), LANES, &mut list);
                let me = self.wide.nodes.len();
                self.wide.nodes.push(node(&list));
                pending.extend(
                    list.iter().enumerate().rev().map(|(lane, (child, _))| (*child, Some((me, lane)))),
                );
            }
        }
        emitted
    }

    /// Appends the trees that an inner node's subtree is divided into: `first` below its first
    /// child, of `trees` in all, at most.
    fn forest(&self, node: Child, first: usize, trees: usize, list: &mut Vec<(Child, Corners)>) {
        let node = &self.bvh.nodes[node.index() as usize];
        let [a, b] = node.boxes();
        for (child, corners, mut trees) in
            [(Child(node.first), a, first), (Child(node.second), b, trees - first)]
        {
            let mut share = 0;
            if !child.is_leaf() {
                while trees > 1 && self.plan.first(child, trees) == 0 {
                    trees -= 1;
                }
                share = self.plan.first(child, trees);
            }
            if child.is_leaf() || trees == 1 {
                list.push((child, corners));
            } else {
                self.forest(child, share, trees, list);
            }
        }
    }

    /// Lists all primitives below a child, of which there are at most eight, by their numbers.
    fn primitives_below(&self, child: Child, primitives: &mut Vec<u32>) {
        primitives.clear();
        let mut pending = vec![child];
        while let Some(child) = pending.pop() {
            if child.is_leaf() {
                primitives.push(child.index());
            } else {
                let node = &self.bvh.nodes[child.index() as usize];
                pending.extend([Child(node.first), Child(node.second)]);
            }
        }
        primitives.sort_unstable();
    }

    /// Makes a leaf of all primitives below a child.
    fn leaf(&mut self, child: Child) -> WideChild {
        let mut primitives = Vec::with_capacity(LANES);
        self.primitives_below(child, &mut primitives);
        let kind = self.kind(primitives[0]);
        let index = match kind {
            LeafKind::Planar => primitives[0] as usize,
            LeafKind::Instance => (primitives[0] - self.first_instance) as usize,
            LeafKind::Spheres => {
                let mut numbers = SimdRow([u32::MAX; LANES]);
                numbers.0[..primitives.len()].copy_from_slice(&primitives);
                let mut packet = SpherePacket { shape: [SimdRow([0.0; LANES]); 4], primitives: numbers };
                for (lane, &primitive) in primitives.iter().enumerate() {
                    let sphere = &self.scene.spheres[primitive as usize];
                    for (row, x) in sphere.center.to_array().into_iter().chain([sphere.radius]).enumerate() {
                        packet.shape[row].0[lane] = x;
                    }
                }
                self.wide.spheres.push(packet);
                self.wide.spheres.len() - 1
            }
            LeafKind::Triangles => {
                let (index, first) = self.places.place(primitives.len());
                if index == self.wide.triangles.len() {
                    let (vertices, primitives) = ([SimdRow([0.0; LANES]); 9], SimdRow([u32::MAX; LANES]));
                    self.wide.triangles.push(TrianglePacket { vertices, primitives });
                }
                for (lane, &primitive) in (first..).zip(&primitives) {
                    let t = *self.triangle((primitive - self.first_triangle) as usize);
                    let packet = &mut self.wide.triangles[index];
                    packet.primitives.0[lane] = primitive;
                    for (row, x) in [t.a, t.b, t.c].into_iter().flat_map(|v| v.to_array()).enumerate() {
                        packet.vertices[row].0[lane] = x;
                    }
                }
                index * LANES + first
            }
        };
        WideChild::leaf(kind, primitives.len() as u32, index as u32)
    }
}

/// Returns a node with the boxes of these children, whose words are set later.
fn node(list: &[(Child, Corners)]) -> WideNode {
    let (low, high) = (SimdRow([f32::INFINITY; LANES]), SimdRow([f32::NEG_INFINITY; LANES]));
    let mut node = WideNode {
        planes: [low, low, low, high, high, high],
        children: SimdRow([WideChild::EMPTY.0; LANES]),
        order: SimdRow([0; LANES]),
    };
    for (lane, (_, (low, high))) in list.iter().enumerate() {
        for axis in 0..3 {
            node.planes[axis].0[lane] = low[axis];
            node.planes[axis + 3].0[lane] = high[axis];
        }
    }
    for octant in 0..LANES {
        let sign =
            Vec3::from_array(std::array::from_fn(|axis| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 }));
        let mut lanes: [(f32, u32); LANES] = std::array::from_fn(|lane| {
            // Half the centre: the sum over its axes stays within the range of f32.
            let along = list.get(lane).map(|(_, (low, high))| (*low * 0.25 + *high * 0.25).dot(sign));
            (along.unwrap_or(f32::INFINITY), lane as u32)
        });
        lanes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        node.order.0[octant] = lanes.iter().rev().fold(0, |order, (_, lane)| order << 3 | lane);
    }
    node
}

#[cfg(test)]
mod tests;
