//! The scene on a device: its arrays, and those of the trees and the light table.

use crate::bvh::{Bvh, Wide};
use crate::lights::Lights;
use bytemuck::Pod;
use trisect_device::{BackendError, Buffer, Command, Device};
use trisect_scene::{Scene, SceneError};
use trisect_shared::bvh::BvhNode;
use trisect_shared::scene::SceneLengths;
use trisect_shared::wide::WideTree;

/// Scene that was validated.
pub(crate) struct ValidScene<'a>(&'a Scene);

/// Arrays of a scene on a device, which several streams may share. They are those of a
/// [`ValidScene`], so every index in them is one of the array that it refers to.
#[derive(Clone)]
pub(crate) struct SceneArrays {
    /// Arrays that all render kernels read, in the order of their bindings.
    scene: [Buffer; 10],
    /// Arrays of the wide BVH: root, nodes, packets of spheres and of triangles.
    wide: Option<[Buffer; 4]>,
    /// Lengths of the arrays that all render kernels read.
    pub lengths: SceneLengths,
    /// Number of the scene's own nodes; nodes of tile entries follow them.
    own_nodes: usize,
}

/// Index of the nodes among a scene's arrays.
const NODES: usize = 1;

impl<'a> ValidScene<'a> {
    /// Validates the scene.
    pub fn new(scene: &'a Scene) -> Result<Self, SceneError> {
        scene.validate().map(|()| Self(scene))
    }

    /// Returns the scene.
    pub fn get(&self) -> &'a Scene {
        self.0
    }

    /// Copies the scene to a device, with the trees and the light table that were made for it.
    pub fn upload(
        &self,
        to: &mut dyn Device,
        bvh: &Bvh,
        wide: Option<&Wide>,
        lights: &Lights,
    ) -> Result<SceneArrays, BackendError> {
        fn upload<T: Pod>(
            to: &mut dyn Device,
            records: &[T],
            what: &'static str,
        ) -> Result<Buffer, BackendError> {
            to.upload(bytemuck::cast_slice(records), what)
        }
        let scene = self.0;
        let environment = scene.environment.as_ref().map_or(&[][..], |environment| &environment.texels);
        let arrays = [
            upload(to, &scene.spheres, "the scene's spheres")?,
            upload(to, &bvh.nodes, "the scene's BVH")?,
            upload(to, &lights.materials, "the scene's materials")?,
            upload(to, &scene.flats, "the scene's quads and discs")?,
            upload(to, &bvh.triangles, "the scene's triangles")?,
            upload(to, &bvh.shading, "the scene's normals and texture coordinates")?,
            upload(to, &lights.lights, "the scene's lights")?,
            upload(to, &scene.textures, "the scene's textures")?,
            upload(to, &scene.texels, "the scene's texels")?,
            upload(to, environment, "the scene's environment map")?,
        ];
        let wide = match wide.map(Wide::tree) {
            None => None,
            Some(WideTree { root, instance_roots, nodes, spheres, triangles }) => Some([
                upload(to, &[&[root.0], instance_roots].concat(), "the scene's wide BVH")?,
                upload(to, nodes, "the scene's wide BVH")?,
                upload(to, spheres, "the scene's packets of spheres")?,
                upload(to, triangles, "the scene's packets of triangles")?,
            ]),
        };
        let lengths = SceneLengths {
            spheres: scene.spheres.len(),
            nodes: bvh.nodes.len(),
            materials: lights.materials.len(),
            planars: scene.flats.len(),
            triangles: bvh.triangles.len(),
            shading: bvh.shading.len(),
            lights: lights.lights.len(),
            textures: scene.textures.len(),
            texels: scene.texels.len(),
            environment: environment.len(),
        };
        Ok(SceneArrays { scene: arrays, wide, lengths, own_nodes: bvh.nodes.len() })
    }
}

impl SceneArrays {
    /// Writes the nodes of [tile entries](trisect_shared::tile_entry) after those of the scene, in
    /// place of earlier ones.
    pub fn write_tile_entries(
        &mut self,
        device: &mut dyn Device,
        nodes: &[BvhNode],
    ) -> Result<(), BackendError> {
        let bytes: &[u8] = bytemuck::cast_slice(nodes);
        let own = (self.own_nodes * size_of::<BvhNode>()) as u64;
        let needed = own + bytes.len() as u64;
        let array = &self.scene[NODES];
        // A second stream has tile entries of its own, so a shared array is copied first.
        if array.bytes() < needed || array.is_shared() {
            let larger = device.allocate(needed, "the BVH's tile entries")?;
            let copy = Command::Copy { from: array, to: &larger, bytes: own };
            // SAFETY: no launch; the other stream reads these nodes, and never writes them.
            unsafe { device.run(vec![copy]) }?;
            self.scene[NODES] = larger;
        }
        device.write(&self.scene[NODES], own, bytes)?;
        self.lengths.nodes = self.own_nodes + nodes.len();
        Ok(())
    }

    /// Returns whether there is a wide BVH.
    pub fn has_wide(&self) -> bool {
        self.wide.is_some()
    }

    /// Returns the arrays of a render kernel's launch: those of the scene, then those that it
    /// writes, then those of the wide BVH if it traces that.
    pub fn of_launch<'a>(
        &'a self,
        written: [&'a Buffer; 4],
        wide: bool,
    ) -> Result<Vec<&'a Buffer>, BackendError> {
        let mut arrays: Vec<&Buffer> = self.scene.iter().chain(written).collect();
        if wide {
            let tree = self.wide.as_ref().ok_or_else(|| super::misuse("the scene has no wide BVH"))?;
            arrays.extend(tree);
        }
        Ok(arrays)
    }
}
