//! The scene on a device: its arrays, and those of the trees and the light table.

use super::array_content::{ArrayContent, SameArrays};
use super::scene_writer::{SceneArray, SceneWriter, WrittenArray};
use crate::bvh::{Bvh, Wide};
use crate::lights::Lights;
use std::sync::Arc;
use trisect_device::{BackendError, Buffer, Command, Device};
use trisect_scene::{Scene, SceneError};
use trisect_shared::bvh::BvhNode;
use trisect_shared::scene::SceneLengths;

/// Scene that was validated.
pub(crate) struct ValidScene<'a>(&'a Scene);

/// Arrays of a scene on a device, which several streams may share. They are those of a
/// [`ValidScene`], so every index in them is one of the array that it refers to.
#[derive(Clone)]
pub(crate) struct SceneArrays {
    /// Arrays that all render kernels read, in the order of PTX arguments.
    scene: [Buffer; 10],
    /// Arrays of the wide BVH: root, nodes, packets of spheres and of triangles.
    wide: Option<[Buffer; 4]>,
    /// Lengths of the arrays that all render kernels read.
    pub lengths: SceneLengths,
    /// Number of the scene's own nodes; nodes of tile entries follow them.
    own_nodes: usize,
    content: ArrayContent,
}

/// Wide BVH of a scene that goes to a device.
pub(crate) enum WideSource<'a> {
    /// The device traces the binary BVH.
    Unused,
    /// The wide BVH that the device has, if it is of the same binary one.
    Kept,
    /// A wide BVH.
    New(&'a Wide),
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
    /// Arrays of another scene, `before`, are taken as they are if they have the same content, and
    /// written in place if they have the size. Also returns what was written.
    pub fn upload(
        &self,
        to: &mut dyn Device,
        bvh: &Arc<Bvh>,
        wide: &WideSource<'_>,
        lights: &Lights,
        before: Option<SceneArrays>,
    ) -> Result<(SceneArrays, Vec<WrittenArray>), BackendError> {
        let scene = self.0;
        let planars = scene.flats_and_portals();
        let content = ArrayContent::of(scene, bvh, lights, &planars);
        let same = before.as_ref().map_or_else(SameArrays::default, |of| of.content.compared(&content));
        let (old, mut old_wide) = match before {
            // The old content makes room.
            Some(SceneArrays { scene, wide, .. }) => {
                (scene.map(Some), wide.map(|of| of.map(Some)).unwrap_or_default())
            }
            None => Default::default(),
        };
        let [spheres, nodes, materials, flats, triangles, vertices, table, textures, texels, panorama] = old;
        let all_triangles = scene.numbered_triangles();
        let mut to = SceneWriter::new(to);
        let nodes = to.write(SceneArray::lent(&bvh.nodes, "the scene's BVH", nodes, same.bvh))?;
        let texels = to.write(SceneArray::of(&content.texels, "the scene's texels", texels, same.texels))?;
        // The arrays of a binding: see `SCENE_BINDINGS`.
        let materials =
            to.write(SceneArray::of(&lights.materials, "the scene's materials", materials, same.materials))?;
        let names = "the scene's normals and texture coordinates";
        let mesh = [
            SceneArray::lent(&all_triangles, "the scene's triangles", triangles, same.triangles),
            SceneArray::lent(&scene.vertices, names, vertices, same.vertices),
        ];
        let [triangles, vertices] = to.write_joined(mesh, "the scene's triangles and vertices")?;
        let panorama_texels = &content.environment;
        let others = [
            SceneArray::of(&planars, "the scene's quads and discs", flats, same.planars),
            SceneArray::of(&scene.spheres, "the scene's spheres", spheres, same.spheres),
            SceneArray::of(&lights.lights, "the scene's lights", table, same.lights),
            SceneArray::of(&scene.textures, "the scene's textures", textures, same.textures),
            SceneArray::of(panorama_texels, "the scene's environment map", panorama, same.environment),
        ];
        let what = "the scene's shapes, lights and environment map";
        let [flats, spheres, table, textures, panorama] = to.write_joined(others, what)?;
        let arrays =
            [spheres, nodes, materials, flats, triangles, vertices, table, textures, texels, panorama];
        let wide = match wide {
            WideSource::Unused => None,
            WideSource::Kept => match old_wide {
                [Some(roots), Some(nodes), Some(spheres), Some(triangles)] if same.bvh => {
                    Some([roots, nodes, spheres, triangles])
                }
                _ => None,
            },
            WideSource::New(Wide { root, instance_roots, nodes, spheres, triangles }) => {
                let mut old = |index: usize| old_wide[index].take();
                let roots = [&[root.0], instance_roots.as_slice()].concat();
                let (tree, packets) = ("the scene's wide BVH", "the scene's packets of triangles");
                Some([
                    to.write(SceneArray::of(&roots, tree, old(0), false))?,
                    to.write(SceneArray::lent(nodes, tree, old(1), false))?,
                    to.write(SceneArray::of(spheres, "the scene's packets of spheres", old(2), false))?,
                    to.write(SceneArray::lent(triangles, packets, old(3), false))?,
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
            environment: content.environment.len(),
        };
        let arrays = SceneArrays { scene: arrays, wide, lengths, own_nodes: bvh.nodes.len(), content };
        Ok((arrays, to.written))
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

    /// Returns whether there is a wide BVH, of this binary one.
    pub fn has_wide_of(&self, bvh: &Arc<Bvh>) -> bool {
        self.has_wide() && self.content.is_of(bvh)
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
