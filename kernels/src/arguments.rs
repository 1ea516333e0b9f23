//! What PTX entry points take by value besides the launch record.

/// Lengths of the scene's arrays. 72 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneLengths {
    /// Of [`Scene::spheres`](trisect_shared::scene::Scene::spheres), and so on.
    pub spheres: usize,
    /// Inner nodes of the BVH.
    pub nodes: usize,
    /// By index from the primitives.
    pub materials: usize,
    /// Flat shapes.
    pub flats: usize,
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

const _: () = assert!(size_of::<SceneLengths>() == 9 * size_of::<usize>());
