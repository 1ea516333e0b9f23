//! A scene before lowering: every reader (RON, glTF, OBJ, PLY) produces a [`Description`], and
//! `lower` makes device records from it. Numbers are f64, except those of meshes and images.
//!
//! Readers have checked each number: it is finite and in the ranges of `super::values`. Indices are
//! in range.

pub use super::light::PunctualLight;
pub use super::material::{Alpha, Material, surface::*};
pub use super::medium::{DensityGrid, Medium, PlacedGrid};
pub use super::portal::{MAX_PORTALS, Portal};
pub use super::texture::{Filter, Texels, TextureImage, TextureUse, Wrap};

use super::CameraPose;
pub use super::ground::Ground;
use super::studio;
pub use super::sun_sky::{SunSky, SunSkyPanorama};
use glam::{DAffine3, DVec3};
use std::path::PathBuf;
use std::sync::Arc;

/// A whole scene, or a part that a scene file includes.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Cameras by name, in the file's order. The pose of a glTF camera is already in world space.
    pub cameras: Vec<(String, CameraPose)>,
    /// Materials, indexed by [`Shape::material`] and [`Mesh::material`].
    pub materials: Vec<Material>,
    /// Images, indexed by [`TextureUse::image`]; descriptions of one scene at several times share
    /// them.
    pub images: Vec<Arc<TextureImage>>,
    /// Analytic shapes.
    pub shapes: Vec<Shape>,
    /// Triangle meshes, each placed by any number of [`Instance`]s.
    pub meshes: Vec<Mesh>,
    /// Meshes placed in the world.
    pub instances: Vec<Instance>,
    /// Lights without extent.
    pub lights: Vec<PunctualLight>,
    /// Radiance from infinity; `None` is black.
    pub sky: Option<Sky>,
    /// Openings through which rooms see the sky.
    pub portals: Vec<Portal>,
    /// Participating media, indexed by [`Material::medium`].
    pub media: Vec<Medium>,
    /// Index into `media` of the medium around all objects; `None` for none.
    pub atmosphere: Option<usize>,
    /// Ground that catches shadows and fades out.
    pub ground: Option<Ground>,
    /// Warnings: each feature that the file uses and the renderer does not support, named once, and
    /// dropped data with its count.
    pub warnings: Vec<String>,
    /// Choices among what a model file holds, such as its animations, for people.
    pub notes: Vec<String>,
    /// Index of the scene file's object that each of `shapes` belongs to; empty for a model.
    pub shape_objects: Vec<usize>,
    /// Index of the scene file's object that each of `instances` belongs to; empty for a model.
    pub instance_objects: Vec<usize>,
    /// Name of each object of the scene file, where it has one; empty for a model.
    pub object_names: Vec<Option<String>>,
    /// Files that the description was read from, except the scene file itself.
    pub files: Vec<PathBuf>,
}

/// Radiance from infinity.
#[derive(Clone, Debug)]
pub enum Sky {
    /// Gradient from straight down to straight up, linear in the y of the unit direction.
    Gradient {
        /// Radiance straight down.
        bottom: DVec3,
        /// Radiance straight up.
        top: DVec3,
    },
    /// A panorama (environment map) in latitude and longitude. Its top row is straight up. At
    /// rotation 0 its middle column is seen along -z.
    Image {
        /// Linear radiance, row-major.
        image: Arc<trisect_image::Image>,
        /// Factor on the image's radiance.
        scale: f64,
        /// Rotation about +y in radians, counter-clockwise seen from above.
        rotation: f64,
    },
    /// The built-in panorama of a studio.
    Studio {
        /// Factor on the panorama's radiance.
        scale: f64,
        /// Rotation about +y in radians, counter-clockwise seen from above.
        rotation: f64,
    },
    /// A clear sky with the sun.
    Sun(SunSkyPanorama),
}

impl Sky {
    /// Returns the panorama of the sky, with its scale and rotation, if it is one.
    pub fn panorama(&self) -> Option<(&trisect_image::Image, f64, f64)> {
        match self {
            Self::Gradient { .. } => None,
            Self::Image { image, scale, rotation } => Some((image, *scale, *rotation)),
            Self::Studio { scale, rotation } => Some((studio::panorama(), *scale, *rotation)),
            Self::Sun(sky) => {
                let (image, rotation) = sky.panorama();
                Some((image, sky.parameters().scale, rotation))
            }
        }
    }

    /// Returns the maximum radiance of a channel.
    pub fn max_radiance(&self) -> f64 {
        match (self, self.panorama()) {
            (Self::Gradient { bottom, top }, _) => bottom.max(*top).max_element(),
            (_, Some((image, scale, _))) => {
                f64::from(image.pixels.iter().flatten().fold(0.0f32, |most, &c| most.max(c))) * scale
            }
            _ => 0.0,
        }
    }
}

/// An analytic shape in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Kind and dimensions of the shape.
    pub kind: ShapeKind,
    /// Index into [`Description::materials`].
    pub material: usize,
}

/// Kinds of analytic shapes.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeKind {
    /// A sphere.
    Sphere {
        /// Centre of the sphere.
        center: DVec3,
        /// Positive radius.
        radius: f64,
    },
    /// A parallelogram; its front is where u × v points.
    Quad {
        /// One corner.
        corner: DVec3,
        /// Edge from `corner` to the next corner.
        u: DVec3,
        /// Edge from `corner` to the other adjacent corner.
        v: DVec3,
    },
    /// A disc; its front is where the normal points.
    Disc {
        /// Centre of the disc.
        center: DVec3,
        /// Normal of any length but 0.
        normal: DVec3,
        /// Positive radius.
        radius: f64,
    },
}

impl ShapeKind {
    /// Returns whether the shape is a plane: a disc of the maximum radius, which has no visible
    /// border.
    pub fn is_plane(&self) -> bool {
        matches!(self, Self::Disc { radius, .. } if *radius >= super::values::MAX_MAGNITUDE)
    }
}

/// A triangle mesh in its own coordinates.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for messages.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals by vertex; empty for flat shading.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates by vertex, where (0, 0) is the image's top left; empty without.
    pub uvs: Vec<[f32; 2]>,
    /// Second set of texture coordinates by vertex; empty without.
    pub second_uvs: Vec<[f32; 2]>,
    /// Linear red, green and blue, and opacity, by vertex, which multiply those of the material;
    /// empty without.
    pub colors: Vec<[f32; 4]>,
    /// Unit tangents by vertex, and 1 or -1: the factor of the cross product of normal and tangent
    /// that gives the bitangent, as in glTF. If empty, they are computed where a normal map needs
    /// them.
    pub tangents: Vec<[f32; 4]>,
    /// Vertices of each triangle, counter-clockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Description::materials`].
    pub material: usize,
}

impl Mesh {
    /// Returns whether the vertices have attributes that need a record beside normals and texture
    /// coordinates.
    pub(crate) fn has_attributes(&self) -> bool {
        !self.colors.is_empty() || !self.second_uvs.is_empty()
    }
}

/// A mesh placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Description::meshes`].
    pub mesh: usize,
    /// Transform from mesh to world coordinates; may mirror.
    pub transform: DAffine3,
}
