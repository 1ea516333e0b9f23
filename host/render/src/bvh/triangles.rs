//! Triangles and their shading records in the order of the BVH.

use super::Bvh;
use trisect_scene::Scene;
use trisect_shared::bvh::Child;

impl Bvh {
    /// Numbers the triangles in the world in the order of the nodes that refer to them.
    pub(super) fn order_triangles(&mut self, scene: &Scene) {
        let first = scene.spheres.len() + scene.flats.len();
        let end = first + scene.triangles.len();
        self.world_triangles = scene.triangles.len();
        if self.nodes.is_empty() {
            self.triangles = scene.triangles.clone();
            self.shading = scene.shading.clone();
            self.order = (0..scene.triangles.len() as u32).collect();
            return;
        }
        let all = scene.triangles.len() + scene.shared.triangles.len();
        self.triangles.reserve_exact(all);
        self.shading.reserve_exact(all + scene.attributes.len());
        self.order.reserve_exact(scene.triangles.len());
        for node in &mut self.nodes {
            for child in [&mut node.first, &mut node.second] {
                let index = Child(*child).index() as usize;
                if Child(*child).is_leaf() && (first..end).contains(&index) {
                    *child = Child::leaf((first + self.triangles.len()) as u32).0;
                    self.triangles.push(scene.triangles[index - first]);
                    self.shading.push(scene.shading[index - first]);
                    self.order.push((index - first) as u32);
                }
            }
        }
    }

    /// Appends the attributes of triangles to the shading data.
    pub(super) fn append_attributes(&mut self, scene: &Scene) {
        let before = self.shading.len() as u32;
        for shading in &mut self.shading {
            // The scene counts from 1; there is a record before the attributes.
            shading.attributes = shading.attributes.checked_sub(1).map_or(0, |index| before + index);
        }
        self.shading.extend_from_slice(bytemuck::cast_slice(&scene.attributes));
    }
}
