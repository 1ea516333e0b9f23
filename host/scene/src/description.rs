//! A scene before lowering: every reader (RON, glTF, OBJ, PLY) produces a [`Description`], and
//! `lower` makes device records from it. Numbers are f64, except those of meshes and images.
//!
//! Readers have checked each number: it is finite and in the ranges of `super::values`. Indices are
//! in range.

use super::CameraPose;
use glam::{DAffine2, DAffine3, DVec3};
use std::path::PathBuf;

/// A whole scene, or a part that a scene file includes.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Cameras by name, in the file's order. The pose of a glTF camera is already in world space.
    pub cameras: Vec<(String, CameraPose)>,
    /// Materials, indexed by [`Shape::material`] and [`Mesh::material`].
    pub materials: Vec<Material>,
    /// Images, indexed by [`TextureUse::image`].
    pub images: Vec<TextureImage>,
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
    /// Warnings: each feature that the file uses and the renderer does not support, named once, and
    /// dropped data with its count.
    pub warnings: Vec<String>,
    /// Index of the scene file's object that each of `shapes` belongs to; empty for a model.
    pub shape_objects: Vec<usize>,
    /// Index of the scene file's object that each of `instances` belongs to; empty for a model.
    pub instance_objects: Vec<usize>,
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
        image: trisect_image::Image,
        /// Factor on the image's radiance.
        scale: f64,
        /// Rotation about +y in radians, counter-clockwise seen from above.
        rotation: f64,
    },
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Scattering model.
    pub surface: Surface,
    /// Reflected fraction (the albedo, or glTF's base colour) in linear Rec. 709, each channel 0 to
    /// 1.
    pub base_color: DVec3,
    /// Texture that multiplies `base_color`; its alpha multiplies `opacity`.
    pub base_color_texture: Option<TextureUse>,
    /// Emitted radiance; zero for a material that does not emit.
    pub emission: DVec3,
    /// Texture that multiplies `emission`.
    pub emission_texture: Option<TextureUse>,
    /// True if the back emits too.
    pub emits_both_sides: bool,
    /// Fraction of the light that meets the surface, 0 to 1; the rest passes straight through.
    pub opacity: f64,
    /// Meaning of `opacity`.
    pub alpha: Alpha,
}

impl Material {
    /// Returns the textures that the material reads.
    pub fn textures(&self) -> impl Iterator<Item = &TextureUse> {
        let of_surface = match &self.surface {
            Surface::MetallicRoughness { metallic_roughness_texture, transmission_texture, .. } => {
                [metallic_roughness_texture.as_ref(), transmission_texture.as_ref()]
            }
            _ => [None; 2],
        };
        let of_material = [self.base_color_texture.as_ref(), self.emission_texture.as_ref()];
        of_material.into_iter().chain(of_surface).flatten()
    }
}

/// Scattering model of a material.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// Diffuse reflection.
    Lambertian,
    /// The metal of "Ray Tracing in One Weekend" (the book).
    Metal {
        /// Radius of the ball of random offsets to the mirrored direction, 0 to 1.
        fuzz: f64,
    },
    /// Smooth clear glass.
    Dielectric {
        /// Index of refraction inside, relative to outside.
        ior: f64,
    },
    /// Clear glass with a rough boundary (GGX).
    RoughDielectric {
        /// Index of refraction inside, relative to outside.
        ior: f64,
        /// Roughness, 0 to 1; GGX alpha is its square.
        roughness: f64,
    },
    /// A rough metal (GGX).
    Conductor {
        /// Fresnel reflectance.
        fresnel: ConductorFresnel,
        /// Roughness, 0 to 1; GGX alpha is its square.
        roughness: f64,
    },
    /// glTF's metallic-roughness material.
    MetallicRoughness {
        /// 0 for a dielectric, 1 for a metal.
        metallic: f64,
        /// Roughness, 0 to 1; GGX alpha is its square.
        roughness: f64,
        /// Texture whose green multiplies `roughness` and whose blue multiplies `metallic`.
        metallic_roughness_texture: Option<TextureUse>,
        /// Index of refraction of the dielectric's boundary.
        ior: f64,
        /// Fraction of the light that enters a dielectric and passes through its thin wall, 0 to 1.
        transmission: f64,
        /// Texture whose red multiplies `transmission`.
        transmission_texture: Option<TextureUse>,
    },
}

/// A conductor's reflectance.
#[derive(Clone, Debug, PartialEq)]
pub enum ConductorFresnel {
    /// Fresnel's equations for a complex index of refraction, eta + i k, by channel.
    Ior {
        /// Real part of the index, relative to outside.
        eta: DVec3,
        /// Imaginary part of the index (absorption).
        k: DVec3,
    },
    /// Schlick's approximation. [`Material::base_color`] is the reflectance at normal incidence.
    Schlick,
}

/// Meaning of a material's opacity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Opacity is ignored.
    #[default]
    Opaque,
    /// The surface exists where opacity is at least `cutoff`.
    Mask {
        /// Threshold of opacity, 0 to 1.
        cutoff: f64,
    },
    /// Opacity is the fraction of the light that meets the surface.
    Blend,
}

/// The use of an image by a material.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`Description::images`].
    pub image: usize,
    /// Continuation beyond 0 to 1, across and down.
    pub wrap: [Wrap; 2],
    /// Interpolation between texels.
    pub filter: Filter,
    /// Map from the mesh's (u, v) to the image's, where (0, 0) is the top left corner as in glTF.
    pub transform: DAffine2,
}

/// Continuation of an image beyond its border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Repeats the image.
    Repeat,
    /// Repeats the image, mirrored at each border.
    Mirror,
    /// Extends the texels of the border.
    Clamp,
}

/// Interpolation between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Takes the nearest texel.
    Nearest,
    /// Interpolates bilinearly.
    Linear,
}

/// An image for textures.
#[derive(Clone, Debug)]
pub struct TextureImage {
    /// Name for messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels, top row first.
    pub texels: Texels,
}

/// The texels of an image: red, green, blue, alpha. Alpha is always linear.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits per channel, sRGB-encoded.
    Srgb8(Vec<[u8; 4]>),
    /// 8 bits per channel, linear.
    Linear8(Vec<[u8; 4]>),
    /// Linear f32.
    Float(Vec<[f32; 4]>),
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
    /// Vertices of each triangle, counter-clockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Description::materials`].
    pub material: usize,
}

/// A mesh placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Description::meshes`].
    pub mesh: usize,
    /// Transform from mesh to world coordinates; may mirror.
    pub transform: DAffine3,
}

/// A light without extent.
#[derive(Clone, Debug, PartialEq)]
pub enum PunctualLight {
    /// A point light, equal in all directions.
    Point {
        /// Position in the world.
        position: DVec3,
        /// Radiant intensity (power per solid angle), by channel.
        intensity: DVec3,
    },
    /// A spot light: a cone.
    Spot {
        /// Position in the world.
        position: DVec3,
        /// Unit vector along the axis.
        direction: DVec3,
        /// Radiant intensity (power per solid angle) on the axis, by channel.
        intensity: DVec3,
        /// Half angle of full intensity, in radians.
        inner: f64,
        /// Half angle beyond which the light is dark, in radians; greater than `inner`, at most
        /// π / 2. Between the two is glTF's smooth falloff.
        outer: f64,
    },
    /// A directional light: parallel light from infinity.
    Directional {
        /// Unit vector along which the light travels.
        direction: DVec3,
        /// Irradiance (power per area) of a surface perpendicular to the light, by channel.
        irradiance: DVec3,
    },
}

impl PunctualLight {
    /// Returns the intensity of a point or spot light, or the irradiance of a directional light.
    pub fn strength(&self) -> DVec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }
}
