//! The scene as a kernel sees it: borrowed arrays of records.

use crate::buffer_layout::Packed;
use crate::bvh::BvhNode;
use crate::environment::EnvironmentTexel;
use crate::light::Light;
use crate::material::Material;
use crate::planar::Planar;
use crate::sphere::Sphere;
use crate::texture::{Texel, Texture};
use crate::triangle::{Triangle, TriangleShading};

/// The device arrays of a scene. Their indices are proven by the host; see [`crate::buffer`].
///
/// Primitives are numbered spheres first, then flat shapes, then triangles;
/// [`RenderParams`](crate::params::RenderParams) says where each kind begins.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Primitives of the first kind.
    pub spheres: &'a [Packed<Sphere>],
    /// Inner nodes of the BVH.
    pub nodes: &'a [Packed<BvhNode>],
    /// By index from the primitives.
    pub materials: &'a [Packed<Material>],
    /// Primitives of the second kind.
    pub planars: &'a [Packed<Planar>],
    /// Primitives of the third kind.
    pub triangles: &'a [Packed<Triangle>],
    /// One for each triangle.
    pub shading: &'a [Packed<TriangleShading>],
    /// What next-event estimation chooses from.
    pub lights: &'a [Packed<Light>],
    /// By index from the materials.
    pub textures: &'a [Packed<Texture>],
    /// Of all textures.
    pub texels: &'a [Packed<Texel>],
    /// The panorama; empty for none.
    pub environment: &'a [Packed<EnvironmentTexel>],
    /// The wide tree; on a CPU only.
    #[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
    pub wide: crate::wide::WideTree<'a>,
}

/// Lengths of a scene's arrays, which PTX entry points take by value. 72 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SceneLengths {
    /// Of [`Scene::spheres`], and so on.
    pub spheres: usize,
    /// Inner nodes of the BVH.
    pub nodes: usize,
    /// By index from the primitives.
    pub materials: usize,
    /// Flat shapes.
    pub planars: usize,
    /// Triangles, and their shading records.
    pub triangles: usize,
    /// For next-event estimation.
    pub lights: usize,
    /// By index from the materials.
    pub textures: usize,
    /// Of all textures.
    pub texels: usize,
    /// Of the panorama.
    pub environment: usize,
}

#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
impl SceneLengths {
    /// Those of `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self {
            spheres: scene.spheres.len(),
            nodes: scene.nodes.len(),
            materials: scene.materials.len(),
            planars: scene.planars.len(),
            triangles: scene.triangles.len(),
            lights: scene.lights.len(),
            textures: scene.textures.len(),
            texels: scene.texels.len(),
            environment: scene.environment.len(),
        }
    }
}

const _: () = assert!(size_of::<SceneLengths>() == 9 * size_of::<usize>());
