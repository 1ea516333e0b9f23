//! BVH of a scene with what it depends on, from which the BVH of another scene follows.

use crate::bvh::{Bvh, BvhQuality, MAX_REFITTED_COST, TightExtent};
use crate::camera;
use crate::passes::{Digest, digest_of, equal_by};
use glam::Vec3;
use std::sync::Arc;
use trisect_scene::{Scene, SceneError, SharedVec};
use trisect_shared::planar::Planar;
use trisect_shared::sphere::Sphere;
use trisect_shared::triangle::Triangle;

/// Origin of a scene's BVH: the one of the scene before, or a new one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeReuse {
    /// BVH of the scene before, as it was.
    Kept,
    /// BVH of the scene before, with its boxes padded for rays from another camera.
    Padded,
    /// BVH of the scene before, with boxes of primitives that moved.
    Refitted,
    /// New BVH.
    Built,
}

/// BVH of a scene, from which that of a scene with the same or with moved primitives is made.
#[derive(Clone)]
pub struct SceneTree {
    pub(super) bvh: Arc<Bvh>,
    /// Quality of the BVH, as it was asked for.
    pub(super) quality: Option<BvhQuality>,
    /// Cost of the BVH when it was built.
    built_cost: f64,
    shapes: Shapes,
    /// Padding of the boxes; `None` if they are not padded.
    padding: Option<Padding>,
    /// CRC-32 of root and nodes.
    pub(super) crc: u32,
}

/// Padding of a BVH's boxes for rays from anywhere in the scene.
#[derive(Clone, Copy)]
struct Padding {
    /// Maximum distance of a ray's origin from the world's origin, along each axis.
    reach: Vec3,
    /// Extent of the BVH before.
    tight: TightExtent,
}

/// Shapes of a scene, without materials: what its BVH is made of.
#[derive(Clone)]
struct Shapes {
    spheres: Digest,
    planars: Digest,
    triangles: SharedVec<Triangle>,
    /// Triangles, meshes and instances of shared meshes.
    shared: [Digest; 3],
}

impl Shapes {
    fn of(scene: &Scene) -> Self {
        let shared = &scene.shared;
        Self {
            spheres: digest_of(&scene.spheres, |of| Sphere { material: 0, ..*of }),
            planars: digest_of(&scene.flats, |of| Planar { material: 0, ..*of }),
            triangles: scene.triangles.clone(),
            shared: [
                digest_of(&shared.triangles, corners),
                digest_of(&shared.meshes, |mesh| *mesh),
                digest_of(&shared.instances, |instance| *instance),
            ],
        }
    }

    fn are(&self, other: &Self) -> bool {
        (self.spheres, self.planars, self.shared) == (other.spheres, other.planars, other.shared)
            && (self.triangles.is_shared_with(&other.triangles)
                || equal_by(&self.triangles, &other.triangles, corners))
    }
}

/// Returns the bits of a triangle's corners.
fn corners(triangle: &Triangle) -> [[u32; 3]; 3] {
    [triangle.a, triangle.b, triangle.c].map(|corner| corner.to_array().map(f32::to_bits))
}

/// Returns the place of the scene's camera, and the radius of its lens. Returns `None` for a
/// parallel projection: its rays start beside the camera, as far as the image is wide.
fn eye(scene: &Scene) -> Option<(Vec3, f32)> {
    let camera = camera::record(&scene.camera, 1, 1);
    (camera.is_parallel == 0).then(|| (camera.origin, camera.lens_x.length()))
}

/// Returns the padding of a BVH whose boxes are not padded, for the scene's camera.
fn padding(bvh: &Bvh, scene: &Scene) -> Option<Padding> {
    let (eye, lens) = eye(scene)?;
    let tight = bvh.tight_extent()?;
    tight.padded_for(eye, lens).map(|reach| Padding { reach, tight })
}

/// Returns the CRC-32 of root and nodes.
fn crc(bvh: &Bvh) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(bytemuck::bytes_of(&bvh.root.0));
    crc.update(bytemuck::cast_slice(&bvh.nodes));
    crc.finalize()
}

impl SceneTree {
    /// Builds the BVH of a scene.
    ///
    /// # Errors
    ///
    /// Those of [`Bvh::build`].
    pub(super) fn build(scene: &Scene, quality: Option<BvhQuality>) -> Result<Self, SceneError> {
        Self::build_of(scene, quality, Shapes::of(scene))
    }

    fn build_of(scene: &Scene, quality: Option<BvhQuality>, shapes: Shapes) -> Result<Self, SceneError> {
        let bvh = Bvh::build(scene, quality)?;
        let built_cost = bvh.cost();
        Ok(Self::of(bvh, scene, quality, built_cost, shapes))
    }

    /// Pads the boxes of a BVH for the scene's camera.
    fn of(mut bvh: Bvh, scene: &Scene, quality: Option<BvhQuality>, built_cost: f64, shapes: Shapes) -> Self {
        let padding = padding(&bvh, scene);
        if let Some(Padding { reach, .. }) = padding {
            bvh.pad(reach);
        }
        let crc = crc(&bvh);
        Self { bvh: Arc::new(bvh), quality, built_cost, shapes, padding, crc }
    }

    /// Makes the BVH of another scene. The BVH of the same shapes is kept, and has the bits of one
    /// that is built if this one was. That of as many primitives at other places is refitted, or
    /// built if refitting would make it more than [`MAX_REFITTED_COST`] times as costly as when it
    /// was built.
    ///
    /// # Errors
    ///
    /// Those of [`Bvh::build`].
    pub(super) fn update(
        self,
        scene: &Scene,
        quality: Option<BvhQuality>,
    ) -> Result<(Self, TreeReuse), SceneError> {
        let shapes = Shapes::of(scene);
        if quality != self.quality {
            return Ok((Self::build_of(scene, quality, shapes)?, TreeReuse::Built));
        }
        if self.shapes.are(&shapes) {
            return self.pad_again(scene, shapes);
        }
        let Self { bvh, built_cost, .. } = self;
        let refitted = Arc::unwrap_or_clone(bvh).moved(scene)?;
        match refitted.filter(|bvh| bvh.cost() <= MAX_REFITTED_COST * built_cost) {
            Some(bvh) => Ok((Self::of(bvh, scene, quality, built_cost, shapes), TreeReuse::Refitted)),
            None => Ok((Self::build_of(scene, quality, shapes)?, TreeReuse::Built)),
        }
    }

    /// Makes the BVH of a scene with the same shapes: another camera may need other padding.
    fn pad_again(self, scene: &Scene, shapes: Shapes) -> Result<(Self, TreeReuse), SceneError> {
        let Self { quality, built_cost, .. } = self;
        let wanted = match self.padding {
            Some(Padding { tight, .. }) => eye(scene).and_then(|(eye, lens)| tight.padded_for(eye, lens)),
            None => padding(&self.bvh, scene).map(|padding| padding.reach),
        };
        if wanted == self.padded_for() {
            return Ok((Self { shapes, ..self }, TreeReuse::Kept));
        }
        let tight = match self.padding {
            None => Some(Arc::unwrap_or_clone(self.bvh)),
            // Refitting undoes the padding.
            Some(_) if self.bvh.has_refitted_boxes => Arc::unwrap_or_clone(self.bvh).moved(scene)?,
            Some(_) => None,
        };
        match tight {
            Some(bvh) => Ok((Self::of(bvh, scene, quality, built_cost, shapes), TreeReuse::Padded)),
            None => Ok((Self::build_of(scene, quality, shapes)?, TreeReuse::Built)),
        }
    }

    /// Returns the maximum distance of a ray's origin from the world's origin, along each axis, for
    /// which the boxes are padded; `None` if they are not.
    pub(super) fn padded_for(&self) -> Option<Vec3> {
        self.padding.map(|padding| padding.reach)
    }
}
