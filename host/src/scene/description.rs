//! A scene as its author describes it: what every reader (RON, glTF, OBJ, PLY) produces, in f64 and without device records.
//!
//! A reader has checked each number: finite and in the ranges of `super::values`, indices in range.

use super::CameraPose;
use glam::{DAffine2, DAffine3, DVec3};
use std::path::PathBuf;

/// A whole scene, or a part that a scene file includes.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Cameras by name, in the file's order. A glTF camera's pose is already in the world.
    pub cameras: Vec<(String, CameraPose)>,
    /// What [`Shape::material`] and [`Mesh::material`] index.
    pub materials: Vec<Material>,
    /// What [`TextureUse::image`] indexes.
    pub images: Vec<TextureImage>,
    /// Analytic shapes.
    pub shapes: Vec<Shape>,
    /// Triangle meshes, each placed by any number of [`Instance`]s.
    pub meshes: Vec<Mesh>,
    /// Which mesh stands where.
    pub instances: Vec<Instance>,
    /// Lights without extent.
    pub lights: Vec<PunctualLight>,
    /// Radiance from infinity; `None` is black.
    pub sky: Option<Sky>,
    /// What the file asks for and this program does not do, each by name and once; what was dropped, with counts.
    pub warnings: Vec<String>,
    /// Which object of a scene file each of `shapes` belongs to, by its index; empty for a model.
    pub shape_objects: Vec<usize>,
    /// The same for `instances`.
    pub instance_objects: Vec<usize>,
    /// Files that it was read from. A scene file's own is not among them.
    pub files: Vec<PathBuf>,
}

/// Radiance from infinity.
#[derive(Clone, Debug)]
pub enum Sky {
    /// From straight down to straight up, linear in the y of the unit direction.
    Gradient {
        /// Radiance straight down.
        bottom: DVec3,
        /// Radiance straight up.
        top: DVec3,
    },
    /// A panorama: latitude and longitude, top row straight up; its middle column is seen along -z at rotation 0.
    Image {
        /// Linear radiance, row-major.
        image: crate::image::Image,
        /// Factor on the image's radiance.
        scale: f64,
        /// About +y, in radians, counter-clockwise seen from above.
        rotation: f64,
    },
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// How it scatters.
    pub surface: Surface,
    /// Reflected share (the albedo, or glTF's base colour): linear Rec. 709, each 0 to 1.
    pub base_color: DVec3,
    /// Multiplies `base_color`, and its alpha `opacity`.
    pub base_color_texture: Option<TextureUse>,
    /// Emitted radiance; zero for what is no light.
    pub emission: DVec3,
    /// Multiplies `emission`.
    pub emission_texture: Option<TextureUse>,
    /// Whether the back emits, too.
    pub emits_both_sides: bool,
    /// Share that does not pass through unseen, 0 to 1.
    pub opacity: f64,
    /// What opacity means.
    pub alpha: Alpha,
}

impl Material {
    /// Returns the textures that it reads.
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

/// How a material scatters.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// Diffuse.
    Lambertian,
    /// The book's metal.
    Metal {
        /// Radius of the ball that moves the mirrored direction, 0 to 1.
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
        /// GGX alpha is its square; 0 to 1.
        roughness: f64,
    },
    /// A rough metal (GGX).
    Conductor {
        /// How much it reflects.
        fresnel: ConductorFresnel,
        /// GGX alpha is its square; 0 to 1.
        roughness: f64,
    },
    /// glTF's material.
    MetallicRoughness {
        /// 0 a dielectric, 1 a metal.
        metallic: f64,
        /// GGX alpha is its square; 0 to 1.
        roughness: f64,
        /// Green multiplies `roughness`, blue `metallic`.
        metallic_roughness_texture: Option<TextureUse>,
        /// Of the dielectric's boundary.
        ior: f64,
        /// Share of the light that enters a dielectric and passes through its thin wall, 0 to 1.
        transmission: f64,
        /// Red multiplies `transmission`.
        transmission_texture: Option<TextureUse>,
    },
}

/// A conductor's reflectance.
#[derive(Clone, Debug, PartialEq)]
pub enum ConductorFresnel {
    /// Fresnel's equations for a complex index, eta + i k, by channel.
    Ior {
        /// Real part, relative to outside.
        eta: DVec3,
        /// Absorption.
        k: DVec3,
    },
    /// Schlick's approximation; [`Material::base_color`] is the reflectance at normal incidence.
    Schlick,
}

/// What a material's opacity means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Nothing: it is opaque.
    #[default]
    Opaque,
    /// There where it is at least `alpha_cutoff`, else not.
    Mask {
        /// 0 to 1.
        cutoff: f64,
    },
    /// The share of the light that meets the surface.
    Blend,
}

/// How a material reads an image.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`Description::images`].
    pub image: usize,
    /// Beyond 0 to 1, across and down.
    pub wrap: [Wrap; 2],
    /// Between texels.
    pub filter: Filter,
    /// From the mesh's (u, v) to the image's, (0, 0) its top left corner as in glTF.
    pub transform: DAffine2,
}

/// What lies beyond an image's border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// The image again, mirrored.
    Mirror,
    /// Its border.
    Clamp,
}

/// How to read between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    Linear,
}

/// An image for textures.
#[derive(Clone, Debug)]
pub struct TextureImage {
    /// For messages.
    pub name: String,
    /// Texels across, at least 1.
    pub width: u32,
    /// Texels down, at least 1.
    pub height: u32,
    /// `width * height` of them, top row first.
    pub texels: Texels,
}

/// The texels of an image: red, green, blue, alpha. Alpha is linear always.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits a channel, sRGB's curve.
    Srgb8(Vec<[u8; 4]>),
    /// 8 bits a channel, linear.
    Linear8(Vec<[u8; 4]>),
    /// Linear.
    Float(Vec<[f32; 4]>),
}

/// An analytic shape in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// What shape.
    pub kind: ShapeKind,
    /// Index into [`Description::materials`].
    pub material: usize,
}

/// Kinds of analytic shapes.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeKind {
    /// A sphere.
    Sphere {
        /// Its centre.
        center: DVec3,
        /// Positive.
        radius: f64,
    },
    /// A parallelogram; its front is where u × v points.
    Quad {
        /// One corner.
        corner: DVec3,
        /// To the next corner.
        u: DVec3,
        /// To the other next corner.
        v: DVec3,
    },
    /// A disc; its front is where the normal points.
    Disc {
        /// Its centre.
        center: DVec3,
        /// Of any length but 0.
        normal: DVec3,
        /// Positive.
        radius: f64,
    },
}

impl ShapeKind {
    /// Whether it has no border: a disc as large as a scene may be.
    pub fn is_plane(&self) -> bool {
        matches!(self, Self::Disc { radius, .. } if *radius >= super::values::MAX_MAGNITUDE)
    }
}

/// A triangle mesh in its own coordinates.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For messages.
    pub name: String,
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals by vertex; empty for flat shading.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates by vertex, (0, 0) the image's top left; empty for none.
    pub uvs: Vec<[f32; 2]>,
    /// Vertices of each triangle, counter-clockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Description::materials`].
    pub material: usize,
}

/// A mesh in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Description::meshes`].
    pub mesh: usize,
    /// From the mesh's coordinates to the world's; may mirror.
    pub transform: DAffine3,
}

/// A light without extent.
#[derive(Clone, Debug, PartialEq)]
pub enum PunctualLight {
    /// The same in all directions.
    Point {
        /// Where.
        position: DVec3,
        /// Power a solid angle, by channel.
        intensity: DVec3,
    },
    /// A cone.
    Spot {
        /// Where.
        position: DVec3,
        /// Unit vector along its axis.
        direction: DVec3,
        /// Power a solid angle on the axis, by channel.
        intensity: DVec3,
        /// Half angle within which it has its full intensity, radians.
        inner: f64,
        /// Half angle beyond which it is dark, radians; greater than `inner`, at most π / 2. Between: glTF's smooth falloff.
        outer: f64,
    },
    /// From infinitely far.
    Directional {
        /// Unit vector along which the light travels.
        direction: DVec3,
        /// Power an area perpendicular to it, by channel.
        irradiance: DVec3,
    },
}

impl PunctualLight {
    /// Returns its intensity, or a directional light's irradiance.
    pub fn strength(&self) -> DVec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }
}
