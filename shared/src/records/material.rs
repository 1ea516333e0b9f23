//! Record of a material. The host fills it; [`crate::bsdf`] makes a BSDF of it.

use super::texture::NO_TEXTURE;
use crate::math::max_component;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bit of [`Material::flags`]: emits from its back, too.
pub const EMITS_BOTH_SIDES: u32 = 1;
/// Bit of [`Material::flags`]: a conductor by `eta` and `k` instead of a reflectance at normal
/// incidence.
pub const COMPLEX_IOR: u32 = 2;
/// Bit of [`Material::flags`]: has holes where its opacity is below `alpha_cutoff`.
pub const MASKED: u32 = 4;
/// Bit of [`Material::flags`]: transmits the part of the light that its opacity leaves.
pub const BLENDED: u32 = 8;

/// Bit of [`Material::flags`]: light that facets send to others is lost.
pub const SINGLE_SCATTERING: u32 = 16;
/// Bit of [`Material::flags`]: colours of vertices multiply the emission.
pub const UNLIT: u32 = 32;

/// Material: a tag and flat fields, because rust-gpu has no enums with data. 128 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Reflected fraction by channel, 0 to 1; 1 for a dielectric; a conductor's reflectance at
    /// normal incidence.
    pub albedo: Vec3,
    /// Kind: [`LAMBERTIAN`](crate::bsdf::LAMBERTIAN) or another tag of [`crate::bsdf`].
    pub kind: u32,
    /// Radius of a metal's ball, 0 to 1.
    pub fuzz: f32,
    /// Index of refraction of a dielectric inside, relative to outside.
    pub ior: f32,
    /// Roughness of a microfacet material, 0 to 1; GGX's alpha is its square.
    pub roughness: f32,
    /// Fraction of metal, 0 to 1.
    pub metallic: f32,
    /// Emitted radiance; zero if the material is not a light.
    pub emission: Vec3,
    /// pdf of the points of an emitter in next-event estimation, per square scene unit; 0 if it
    /// does not sample this material.
    pub light_pdf: f32,
    /// Real part of a conductor's index of refraction, by channel.
    pub eta: Vec3,
    /// Fraction of the light entering a dielectric that passes through its thin wall, 0 to 1.
    pub transmission: f32,
    /// Imaginary part of a conductor's index of refraction, by channel.
    pub k: Vec3,
    /// Bits: [`EMITS_BOTH_SIDES`], [`COMPLEX_IOR`], [`MASKED`], [`BLENDED`],
    /// [`SINGLE_SCATTERING`], [`UNLIT`].
    pub flags: u32,
    /// Index of the texture that multiplies albedo and opacity, or [`NO_TEXTURE`].
    pub albedo_texture: u32,
    /// Index of the texture whose green multiplies roughness and blue metallic, or [`NO_TEXTURE`].
    pub metallic_roughness_texture: u32,
    /// Index of the texture that multiplies emission, or [`NO_TEXTURE`].
    pub emission_texture: u32,
    /// Index of the texture whose red multiplies transmission, or [`NO_TEXTURE`].
    pub transmission_texture: u32,
    /// Opacity, 0 to 1; used if masked or blended.
    pub opacity: f32,
    /// Opacity below which a masked material has a hole.
    pub alpha_cutoff: f32,
    /// Index of the normal map, in the tangent space of the mesh, or [`NO_TEXTURE`].
    pub normal_texture: u32,
    /// Factor of the normal map's x and y.
    pub normal_scale: f32,
    /// Layers of a [`LAYERED`](crate::bsdf::LAYERED) material. On the host, 1 plus an index into
    /// the scene's layers, or 0; on a device, the index at which they stand among the materials.
    pub layers: u32,
    /// Identifier of the medium behind the surface, as a
    /// [`MediumStack`](crate::medium::MediumStack) has it; 0 for a surface that bounds none.
    pub medium: u32,
    /// Unused.
    pub pad: [u32; 2],
}

const _: () = assert!(size_of::<Material>() == 128 && align_of::<Material>() == 16);

impl Material {
    /// Creates a material of this kind: opaque, smooth, not emitting, without textures, with index
    /// of refraction 1.
    pub const fn new(kind: u32, albedo: Vec3) -> Self {
        Self {
            albedo,
            kind,
            fuzz: 0.0,
            ior: 1.0,
            roughness: 0.0,
            metallic: 0.0,
            emission: Vec3::ZERO,
            light_pdf: 0.0,
            eta: Vec3::ONE,
            transmission: 0.0,
            k: Vec3::ZERO,
            flags: 0,
            albedo_texture: NO_TEXTURE,
            metallic_roughness_texture: NO_TEXTURE,
            emission_texture: NO_TEXTURE,
            transmission_texture: NO_TEXTURE,
            opacity: 1.0,
            alpha_cutoff: 0.0,
            normal_texture: NO_TEXTURE,
            normal_scale: 1.0,
            layers: 0,
            medium: 0,
            pad: [0; 2],
        }
    }

    /// Returns the indices of the textures, or [`NO_TEXTURE`], slot by slot. (By destructuring, so
    /// that the compiler asks about each new field: kernels read textures without bounds checks.)
    pub const fn textures(&self) -> [u32; 5] {
        let Self {
            albedo: _,
            kind: _,
            fuzz: _,
            ior: _,
            roughness: _,
            metallic: _,
            emission: _,
            light_pdf: _,
            eta: _,
            transmission: _,
            k: _,
            flags: _,
            albedo_texture,
            metallic_roughness_texture,
            emission_texture,
            transmission_texture,
            opacity: _,
            alpha_cutoff: _,
            normal_texture,
            normal_scale: _,
            layers: _,
            medium: _,
            pad: _,
        } = *self;
        [albedo_texture, metallic_roughness_texture, emission_texture, transmission_texture, normal_texture]
    }

    /// Returns whether a surface of this material emits from its front (`front`) or its back.
    #[inline(always)]
    pub fn emits(&self, front: bool) -> bool {
        max_component(self.emission) > 0.0 && (front || self.flags & EMITS_BOTH_SIDES != 0)
    }
}
