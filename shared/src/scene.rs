//! The scene as kernels see it: borrowed arrays of records, which the host proves and uploads.

use crate::buffer::RecordSlice;
use crate::buffer_layout::Packed;
use crate::bvh::BvhNode;
use crate::params::RenderParams;
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
/// [`RenderParams`] has the first number of each kind.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Spheres: primitives from 0 on.
    pub spheres: RecordSlice<'a, Sphere>,
    /// Inner nodes of the binary BVH, then nodes for tile entries.
    pub nodes: &'a [Packed<BvhNode>],
    /// Materials, indexed by primitives.
    pub materials: &'a [Packed<Material>],
    /// Planar shapes: primitives from [`first_planar`](crate::params::RenderParams::first_planar)
    /// on; then portals, which are none.
    pub planars: RecordSlice<'a, Planar>,
    /// Triangles: primitives from [`first_triangle`](crate::params::RenderParams::first_triangle)
    /// on.
    pub triangles: RecordSlice<'a, Triangle>,
    /// Vertices of triangles; among them the [attributes](crate::attributes::VertexAttributes) of
    /// vertices that have some.
    pub vertices: RecordSlice<'a, MeshVertex>,
    /// Lights that next-event estimation samples, with their alias table.
    pub lights: RecordSlice<'a, Light>,
    /// Textures, indexed by materials.
    pub textures: RecordSlice<'a, Texture>,
    /// Texels of all textures.
    pub texels: &'a [Packed<Texel>],
    /// Texels of the environment map, row by row; empty without one.
    pub environment: RecordSlice<'a, EnvironmentTexel>,
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

/// Index of the first row of each array of a scene that stands behind another one in a buffer, in
/// rows of 16 bytes. SPIR-V entry points read them behind [their parameters](SceneLaunch). 32
/// bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FirstRows {
    /// First row of [`Scene::vertices`], behind the triangles.
    pub vertices: u32,
    /// First row of [`Scene::spheres`], in a buffer that begins with the planar shapes.
    pub spheres: u32,
    /// First row of [`Scene::lights`] there.
    pub lights: u32,
    /// First row of [`Scene::textures`] there.
    pub textures: u32,
    /// First row of [`Scene::environment`] there.
    pub environment: u32,
    /// Zero. (Each element of a uniform array would take 16 bytes.)
    pub pad0: u32,
    /// Zero.
    pub pad1: u32,
    /// Zero.
    pub pad2: u32,
}

/// Parameters of a launch as SPIR-V entry points of a scene read them. 304 bytes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SceneLaunch {
    /// Parameters.
    pub params: RenderParams,
    /// Places of the scene's arrays.
    pub first_rows: FirstRows,
}

const _: () = assert!(size_of::<SceneLaunch>() == size_of::<RenderParams>() + size_of::<FirstRows>());

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
