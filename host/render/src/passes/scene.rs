//! The scene on a device: its arrays, and those of the trees and the light table.

use crate::bvh::{Bvh, Wide};
use crate::lights::Lights;
use bytemuck::Pod;
use std::sync::Arc;
use trisect_device::{BackendError, Buffer, Command, Device, LentRecords};
use trisect_scene::{Scene, SceneError, SharedVec};
use trisect_shared::bvh::BvhNode;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::scene::SceneLengths;
use trisect_shared::texture::Texel;

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
    shared: Shared,
}

/// Content of the arrays that scenes of one file at several times share. It stays in memory, so
/// that the same address is the same content.
#[derive(Clone)]
struct Shared {
    texels: Arc<[Texel]>,
    environment: Arc<[EnvironmentTexel]>,
}

/// Content of an array that is already on the device.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Content {
    /// The records to be copied.
    Same,
    /// Other records.
    Other,
}

/// Copies records to a device: into `old`, if that has the size and no other stream reads it.
fn upload<T: Pod>(
    to: &mut dyn Device,
    records: &[T],
    what: &'static str,
    old: Option<Buffer>,
    content: Content,
) -> Result<Buffer, BackendError> {
    let bytes: &[u8] = bytemuck::cast_slice(records);
    let fits = |old: &Buffer| old.bytes() == bytes.len() as u64 && !bytes.is_empty() && !old.is_shared();
    // An array that is not used again is freed before the other one is allocated.
    match old.filter(|old| content == Content::Same || fits(old)) {
        Some(old) => {
            if content == Content::Other {
                to.write(&old, 0, bytes)?;
            }
            Ok(old)
        }
        None => to.upload(bytes, what),
    }
}

/// Gives records to a device: their own memory if it reads that in place, and a copy otherwise, as
/// [`upload`] does.
fn give<T: Pod + Send + Sync>(
    to: &mut dyn Device,
    records: &SharedVec<T>,
    what: &'static str,
    old: Option<Buffer>,
) -> Result<Buffer, BackendError> {
    match to.adopt(&LentRecords::of(records.shared())) {
        Some(buffer) => Ok(buffer),
        None => upload(to, records, what, old, Content::Other),
    }
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
    /// Arrays of the same scene at another time, `before`, are written in place if they have the
    /// size, and taken as they are if they cannot have changed.
    pub fn upload(
        &self,
        to: &mut dyn Device,
        bvh: &Bvh,
        wide: Option<&Wide>,
        lights: &Lights,
        before: Option<SceneArrays>,
    ) -> Result<SceneArrays, BackendError> {
        let scene = self.0;
        let no_texels = || Arc::from([]);
        let environment = scene.environment.as_ref().map_or_else(no_texels, |of| Arc::clone(&of.texels));
        let shared = Shared { texels: Arc::clone(&scene.texels), environment };
        let (old, old_wide, old_shared) = match before {
            Some(SceneArrays { scene, wide, shared, .. }) => {
                (scene.map(Some), wide.map(|of| of.map(Some)), Some(shared))
            }
            None => (std::array::from_fn(|_| None), None, None),
        };
        let mut old_wide = old_wide.unwrap_or_default();
        let [spheres, nodes, materials, flats, triangles, vertices, table, textures, texels, panorama] = old;
        let same = |a: bool| if a { Content::Same } else { Content::Other };
        let of = old_shared.as_ref();
        let same_texels = same(of.is_some_and(|of| Arc::ptr_eq(&of.texels, &shared.texels)));
        let same_panorama = same(of.is_some_and(|of| Arc::ptr_eq(&of.environment, &shared.environment)));
        let other = Content::Other;
        let planars = scene.flats_and_portals();
        let all_triangles = scene.numbered_triangles();
        let arrays = [
            upload(to, &scene.spheres, "the scene's spheres", spheres, other)?,
            give(to, &bvh.nodes, "the scene's BVH", nodes)?,
            upload(to, &lights.materials, "the scene's materials", materials, other)?,
            upload(to, &planars, "the scene's quads and discs", flats, other)?,
            give(to, &all_triangles, "the scene's triangles", triangles)?,
            give(to, &scene.vertices, "the scene's normals and texture coordinates", vertices)?,
            upload(to, &lights.lights, "the scene's lights", table, other)?,
            upload(to, &scene.textures, "the scene's textures", textures, other)?,
            upload(to, &shared.texels, "the scene's texels", texels, same_texels)?,
            upload(to, &shared.environment, "the scene's environment map", panorama, same_panorama)?,
        ];
        let wide = match wide {
            None => None,
            Some(Wide { root, instance_roots, nodes, spheres, triangles }) => {
                let mut old = |index: usize| old_wide[index].take();
                let roots = [&[root.0], instance_roots.as_slice()].concat();
                Some([
                    upload(to, &roots, "the scene's wide BVH", old(0), other)?,
                    give(to, nodes, "the scene's wide BVH", old(1))?,
                    upload(to, spheres, "the scene's packets of spheres", old(2), other)?,
                    give(to, triangles, "the scene's packets of triangles", old(3))?,
                ])
            }
        };
        let lengths = SceneLengths {
            spheres: scene.spheres.len(),
            nodes: bvh.nodes.len(),
            materials: lights.materials.len(),
            planars: planars.len(),
            triangles: all_triangles.len(),
            vertices: scene.vertices.len(),
            lights: lights.lights.len(),
            textures: scene.textures.len(),
            texels: scene.texels.len(),
            environment: shared.environment.len(),
        };
        Ok(SceneArrays { scene: arrays, wide, lengths, own_nodes: bvh.nodes.len(), shared })
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
