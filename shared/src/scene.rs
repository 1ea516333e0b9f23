//! The scene as kernels see it: borrowed arrays of records, which the host proves and uploads.

use crate::buffer_layout::Packed;
use crate::bvh::BvhNode;
use crate::planar::Planar;
use crate::records::attributes::MeshVertex;
use crate::records::environment::EnvironmentTexel;
use crate::records::light::Light;
use crate::records::material::Material;
use crate::records::texture::{Texel, Texture};
use crate::sphere::Sphere;
use crate::triangle::Triangle;

/// Arrays of a scene. The host proves their indices; see [`crate::buffer`].
///
/// Primitives are numbered spheres first, then planar shapes, then triangles;
/// [`RenderParams`](crate::params::RenderParams) has the first number of each kind.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Spheres: primitives from 0 on.
    pub spheres: &'a [Packed<Sphere>],
    /// Inner nodes of the binary BVH, then nodes for tile entries.
    pub nodes: &'a [Packed<BvhNode>],
    /// Materials, indexed by primitives.
    pub materials: &'a [Packed<Material>],
    /// Planar shapes: primitives from [`first_planar`](crate::params::RenderParams::first_planar)
    /// on; then portals, which are none.
    pub planars: &'a [Packed<Planar>],
    /// Triangles: primitives from [`first_triangle`](crate::params::RenderParams::first_triangle)
    /// on.
    pub triangles: &'a [Packed<Triangle>],
    /// Vertices of triangles; among them the [attributes](crate::attributes::VertexAttributes) of
    /// vertices that have some.
    pub vertices: &'a [Packed<MeshVertex>],
    /// Lights that next-event estimation samples, with their alias table.
    pub lights: &'a [Packed<Light>],
    /// Textures, indexed by materials.
    pub textures: &'a [Packed<Texture>],
    /// Texels of all textures.
    pub texels: &'a [Packed<Texel>],
    /// Texels of the environment map, row by row; empty without one.
    pub environment: &'a [Packed<EnvironmentTexel>],
    /// Wide BVH, on the CPU only.
    #[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
    pub wide: crate::records::wide::WideTree<'a>,
}

/// Lengths of a scene's arrays, which PTX entry points take by value. 80 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SceneLengths {
    /// Length of [`Scene::spheres`].
    pub spheres: usize,
    /// Length of [`Scene::nodes`].
    pub nodes: usize,
    /// Length of [`Scene::materials`].
    pub materials: usize,
    /// Length of [`Scene::planars`].
    pub planars: usize,
    /// Length of [`Scene::triangles`].
    pub triangles: usize,
    /// Length of [`Scene::vertices`].
    pub vertices: usize,
    /// Length of [`Scene::lights`].
    pub lights: usize,
    /// Length of [`Scene::textures`].
    pub textures: usize,
    /// Length of [`Scene::texels`].
    pub texels: usize,
    /// Length of [`Scene::environment`].
    pub environment: usize,
}

#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
impl SceneLengths {
    /// Returns the lengths of the arrays of `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self {
            spheres: scene.spheres.len(),
            nodes: scene.nodes.len(),
            materials: scene.materials.len(),
            planars: scene.planars.len(),
            triangles: scene.triangles.len(),
            vertices: scene.vertices.len(),
            lights: scene.lights.len(),
            textures: scene.textures.len(),
            texels: scene.texels.len(),
            environment: scene.environment.len(),
        }
    }
}

const _: () = assert!(size_of::<SceneLengths>() == 10 * size_of::<usize>());
