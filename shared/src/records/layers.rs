//! Records of the layers and further lobes of a material.

use super::texture::NO_TEXTURE;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bit of [`MaterialLayers::flags`]: the surface bounds a solid, which refracts; otherwise it is a
/// thin wall.
pub const SOLID: u32 = 1;
/// Bit of [`MaterialLayers::flags`]: the alpha of the texture of the specular colour multiplies
/// 1 - roughness.
pub const GLOSSINESS: u32 = 2;

/// Layers and further lobes of a layered material. 128 bytes, as
/// [`Material`](crate::material::Material), in whose array it stands.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MaterialLayers {
    /// Colour of the dielectric's reflectance at normal incidence, 0 or more.
    pub specular_color: Vec3,
    /// Strength of the dielectric's reflectance, 0 to 1.
    pub specular: f32,
    /// Colour of the sheen, each 0 to 1.
    pub sheen_color: Vec3,
    /// Roughness of the sheen, 0 to 1.
    pub sheen_roughness: f32,
    /// Absorption of a solid, by channel, per scene unit.
    pub absorption: Vec3,
    /// Difference of the index of refraction of red and blue light from that of green.
    pub dispersion: f32,
    /// Colour of light that passes diffusely, each 0 to 1.
    pub diffuse_transmission_color: Vec3,
    /// Share of the diffuse light that passes, 0 to 1.
    pub diffuse_transmission: f32,
    /// Strength of the coat, 0 to 1.
    pub coat: f32,
    /// Roughness of the coat, 0 to 1.
    pub coat_roughness: f32,
    /// Strength of the anisotropy, 0 to 1.
    pub anisotropy: f32,
    /// Bits: [`SOLID`], [`GLOSSINESS`].
    pub flags: u32,
    /// Cosine of the angle from the tangent to the direction of the anisotropy.
    pub anisotropy_cos: f32,
    /// Sine of that angle.
    pub anisotropy_sin: f32,
    /// Strength of the thin film, 0 to 1.
    pub film: f32,
    /// Index of refraction of the thin film.
    pub film_ior: f32,
    /// Thickness of the thin film where its texture is 0, in nanometres.
    pub film_min: f32,
    /// Thickness of the thin film where its texture is 1 or missing, in nanometres; once textures
    /// are read, the thickness.
    pub film_thickness: f32,
    /// Unused.
    pub pad: [u32; 2],
    /// Factors of the coat's normal map, zero without one; once it is read, its normal in tangent
    /// space, and the unit normal in the world once it is placed.
    pub coat_normal: Vec3,
    /// Unused.
    pub padding: u32,
}

/// Textures of a [`MaterialLayers`], which they follow: indices, or [`NO_TEXTURE`]. 128 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct LayerTextures {
    /// Its red multiplies the coat's strength.
    pub coat: u32,
    /// Its green multiplies the coat's roughness.
    pub coat_roughness: u32,
    /// Its alpha multiplies the strength of the specular reflectance.
    pub specular: u32,
    /// It multiplies the colour of the specular reflectance.
    pub specular_color: u32,
    /// It multiplies the colour of the sheen.
    pub sheen_color: u32,
    /// Its alpha multiplies the roughness of the sheen.
    pub sheen_roughness: u32,
    /// Its red and green are the direction of the anisotropy, its blue multiplies the strength.
    pub anisotropy: u32,
    /// Its red multiplies the strength of the thin film.
    pub film: u32,
    /// Its green chooses the thickness of the thin film.
    pub film_thickness: u32,
    /// Its alpha multiplies the share of light that passes diffusely.
    pub diffuse_transmission: u32,
    /// It multiplies the colour of light that passes diffusely.
    pub diffuse_transmission_color: u32,
    /// Normal map of the coat.
    pub coat_normal: u32,
    /// Unused.
    pub pad: [u32; 20],
}

const _: () = assert!(size_of::<MaterialLayers>() == 128 && size_of::<LayerTextures>() == 128);

impl MaterialLayers {
    /// Layers of a metallic-roughness material without any.
    pub const NONE: Self = Self {
        specular_color: Vec3::ONE,
        specular: 1.0,
        sheen_color: Vec3::ZERO,
        sheen_roughness: 0.0,
        absorption: Vec3::ZERO,
        dispersion: 0.0,
        diffuse_transmission_color: Vec3::ONE,
        diffuse_transmission: 0.0,
        coat: 0.0,
        coat_roughness: 0.0,
        anisotropy: 0.0,
        flags: 0,
        anisotropy_cos: 1.0,
        anisotropy_sin: 0.0,
        film: 0.0,
        film_ior: 1.3,
        film_min: 100.0,
        film_thickness: 400.0,
        pad: [0; 2],
        coat_normal: Vec3::ZERO,
        padding: 0,
    };
}

impl LayerTextures {
    /// Stands for no textures.
    pub const NONE: Self = Self {
        coat: NO_TEXTURE,
        coat_roughness: NO_TEXTURE,
        specular: NO_TEXTURE,
        specular_color: NO_TEXTURE,
        sheen_color: NO_TEXTURE,
        sheen_roughness: NO_TEXTURE,
        anisotropy: NO_TEXTURE,
        film: NO_TEXTURE,
        film_thickness: NO_TEXTURE,
        diffuse_transmission: NO_TEXTURE,
        diffuse_transmission_color: NO_TEXTURE,
        coat_normal: NO_TEXTURE,
        pad: [0; 20],
    };

    /// Returns the indices of the textures, or [`NO_TEXTURE`]. (By destructuring, as
    /// [`Material::textures`](crate::material::Material::textures).)
    pub const fn all(&self) -> [u32; 12] {
        let Self {
            coat,
            coat_roughness,
            specular,
            specular_color,
            sheen_color,
            sheen_roughness,
            anisotropy,
            film,
            film_thickness,
            diffuse_transmission,
            diffuse_transmission_color,
            coat_normal,
            pad: _,
        } = *self;
        [
            coat,
            coat_roughness,
            specular,
            specular_color,
            sheen_color,
            sheen_roughness,
            anisotropy,
            film,
            film_thickness,
            diffuse_transmission,
            diffuse_transmission_color,
            coat_normal,
        ]
    }
}
