//! Validation of a wide BVH, on which the traversal relies.

use super::Wide;
use std::collections::BTreeSet;
use trisect_shared::bvh::STACK_SIZE;
use trisect_shared::simd::LANES;
use trisect_shared::wide::{LeafKind, WideChild};

impl Wide {
    /// Checks what [`trisect_shared::buffer`] requires: indices in range; each node, packet of
    /// spheres and primitive reached once; primitives of their leaf's kind; depth within the
    /// traversal stack. `counts` has the numbers of spheres, of quads and discs, of triangles, and
    /// of instances. A shared mesh is reached from its first instance.
    pub(super) fn validate(&self, counts: [usize; 4]) -> Result<(), String> {
        let mut seen = Visited {
            primitives: vec![false; counts[..3].iter().sum()],
            instances: vec![false; counts[3]],
            nodes: vec![false; self.nodes.len()],
            spheres: vec![false; self.spheres.len()],
            triangles: vec![false; self.triangles.len()],
        };
        let broken =
            |child: WideChild| format!("the wide BVH is broken at {child:?}; please report this scene");
        let mut levels = vec![0u8; self.nodes.len()];
        if self.root != WideChild::EMPTY {
            self.visit(self.root, None, counts, &mut seen).ok_or_else(|| broken(self.root))?;
        }
        if self.instance_roots.len() != counts[3] {
            return Err(format!(
                "the wide BVH has {} roots of {} instances; please report this scene",
                self.instance_roots.len(),
                counts[3]
            ));
        }
        let meshes: BTreeSet<u32> = self.instance_roots.iter().copied().collect();
        for root in meshes.into_iter().map(WideChild) {
            self.visit(root, None, counts, &mut seen).ok_or_else(|| broken(root))?;
        }
        for (index, node) in self.nodes.iter().enumerate() {
            let level = levels[index] + 1;
            if usize::from(level) > STACK_SIZE {
                return Err(format!(
                    "the wide BVH has more than {STACK_SIZE} levels; please report this scene"
                ));
            }
            for (lane, child) in node.children.0.into_iter().map(WideChild).enumerate() {
                if child == WideChild::EMPTY {
                    // The box of an empty lane must be one that no ray enters.
                    if (0..3).any(|axis| node.planes[axis].0[lane] <= node.planes[axis + 3].0[lane]) {
                        return Err(broken(child));
                    }
                    continue;
                }
                self.visit(child, Some(index), counts, &mut seen).ok_or_else(|| broken(child))?;
                if !child.is_leaf() {
                    levels[child.index() as usize] = level;
                }
            }
            if node
                .order
                .0
                .iter()
                .any(|&order| (0..LANES).fold(0, |all, i| all | 1 << (order >> (3 * i) & 7)) != 255)
            {
                return Err(format!("node {index} of the wide BVH omits a child; please report this scene"));
            }
        }
        let Visited { primitives, instances, nodes, spheres, triangles } = seen;
        let all = primitives.into_iter().chain(instances).chain(nodes).chain(spheres).chain(triangles);
        if all.into_iter().all(|seen| seen) {
            Ok(())
        } else {
            Err("the wide BVH lost a primitive; please report this scene".to_owned())
        }
    }

    /// Marks what a child refers to. Returns `None` if the reference is not valid.
    fn visit(
        &self,
        child: WideChild,
        parent: Option<usize>,
        counts: [usize; 4],
        seen: &mut Visited,
    ) -> Option<()> {
        let mark = |seen: &mut [bool], index: usize| {
            let slot = seen.get_mut(index)?;
            (!std::mem::replace(slot, true)).then_some(())
        };
        let index = child.index() as usize;
        if !child.is_leaf() {
            return (parent.is_none_or(|parent| index > parent) && child.0 == child.index())
                .then(|| mark(&mut seen.nodes, index))?;
        }
        let (first_flat, first_triangle) = (counts[0], counts[0] + counts[1]);
        let (range, primitives) = if child.holds(LeafKind::Planar) {
            if child.count() != 1 || !(first_flat..first_triangle).contains(&index) {
                return None;
            }
            return mark(&mut seen.primitives, index);
        } else if child.holds(LeafKind::Instance) {
            return (child.count() == 1).then(|| mark(&mut seen.instances, index))?;
        } else if child.holds(LeafKind::Triangles) {
            // Leaves share packets, and no triangle.
            *seen.triangles.get_mut(child.packet() as usize)? = true;
            (
                first_triangle..first_triangle + counts[2],
                &self.triangles.get(child.packet() as usize)?.primitives,
            )
        } else if child.holds(LeafKind::Spheres) {
            mark(&mut seen.spheres, index)?;
            (0..first_flat, &self.spheres.get(index)?.primitives)
        } else {
            return None;
        };
        let first = if child.holds(LeafKind::Triangles) { index % LANES } else { 0 };
        for &primitive in primitives.0.get(first..first + child.count() as usize)? {
            if !range.contains(&(primitive as usize)) {
                return None;
            }
            mark(&mut seen.primitives, primitive as usize)?;
        }
        Some(())
    }
}

/// Records that [`Wide::validate`] has reached so far.
struct Visited {
    primitives: Vec<bool>,
    instances: Vec<bool>,
    nodes: Vec<bool>,
    spheres: Vec<bool>,
    triangles: Vec<bool>,
}
