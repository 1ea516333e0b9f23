//! Sums of AOVs.

use crate::bvh::NO_PRIMITIVE;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Sums over the samples of one pixel. 64 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AovSums {
    /// Sum of the unit shading normals at the hits, on the camera's side.
    pub normal: Vec3,
    /// Number of samples that hit a primitive.
    pub hits: u32,
    /// Sum of the albedos at the hits; a miss adds 0.
    pub albedo: Vec3,
    /// Primitive hit by the first of the samples that hit any, or [`NO_PRIMITIVE`].
    pub primitive: u32,
    /// Sum of the positions of the hits, in scene units.
    pub position: Vec3,
    /// Number of samples that hit nothing.
    pub misses: u32,
    /// Sum of the radiance emitted towards the camera: by the surface at a hit, by the sky at a
    /// miss.
    pub emission: Vec3,
    /// Sum of the diffuseness at the hits: how little the reflected light depends on the viewer's
    /// position; 1 for a diffuse surface, 0 for a mirror or glass.
    pub diffuse: f32,
}

const _: () = assert!(size_of::<AovSums>() == 64 && align_of::<AovSums>() == 16);

/// AOVs of a surface that follow from its material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceAovs {
    /// Colour of the surface.
    pub albedo: Vec3,
    /// Diffuseness; see [`AovSums::diffuse`].
    pub diffuse: f32,
}

impl AovSums {
    /// Sums over no samples.
    pub const ZERO: Self = Self {
        normal: Vec3::ZERO,
        hits: 0,
        albedo: Vec3::ZERO,
        primitive: NO_PRIMITIVE,
        position: Vec3::ZERO,
        misses: 0,
        emission: Vec3::ZERO,
        diffuse: 0.0,
    };

    /// Value of all pixels before a launch, so that a pixel that no kernel wrote is visible: each
    /// byte is 0xff.
    pub const UNWRITTEN: Self = Self {
        normal: Vec3::splat(f32::from_bits(u32::MAX)),
        hits: u32::MAX,
        albedo: Vec3::splat(f32::from_bits(u32::MAX)),
        primitive: u32::MAX,
        position: Vec3::splat(f32::from_bits(u32::MAX)),
        misses: u32::MAX,
        emission: Vec3::splat(f32::from_bits(u32::MAX)),
        diffuse: f32::from_bits(u32::MAX),
    };

    /// Adds a sample that hits `primitive`.
    #[inline(always)]
    pub fn add_hit(
        &mut self,
        primitive: u32,
        normal: Vec3,
        surface: SurfaceAovs,
        position: Vec3,
        emission: Vec3,
    ) {
        if self.hits == 0 {
            self.primitive = primitive;
        }
        self.hits += 1;
        self.normal += normal;
        self.albedo += surface.albedo;
        self.diffuse += surface.diffuse;
        self.position += position;
        self.emission += emission;
    }

    /// Adds a sample that hits nothing, under a sky of radiance `emission`.
    #[inline(always)]
    pub fn add_miss(&mut self, emission: Vec3) {
        self.misses += 1;
        self.emission += emission;
    }

    /// Adds the sums over other samples, which were taken after these.
    #[inline(always)]
    pub fn add(&mut self, other: Self) {
        if self.hits == 0 {
            self.primitive = other.primitive;
        }
        self.normal += other.normal;
        self.albedo += other.albedo;
        self.position += other.position;
        self.emission += other.emission;
        self.diffuse += other.diffuse;
        self.hits = self.hits.wrapping_add(other.hits);
        self.misses = self.misses.wrapping_add(other.misses);
    }

    /// Returns the number of samples.
    #[inline(always)]
    pub fn samples(&self) -> u32 {
        self.hits + self.misses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_hit_names_the_primitive() {
        let mut aovs = AovSums::ZERO;
        aovs.add_miss(Vec3::ONE);
        let look = |albedo, diffuse| SurfaceAovs { albedo: Vec3::splat(albedo), diffuse };
        aovs.add_hit(7, Vec3::Z, look(0.5, 1.0), Vec3::X, Vec3::ZERO);
        aovs.add_hit(9, Vec3::X, look(0.25, 0.5), Vec3::Y, Vec3::Z);
        assert_eq!((aovs.primitive, aovs.hits, aovs.misses, aovs.samples()), (7, 2, 1, 3));
        assert_eq!((aovs.albedo, aovs.emission), (Vec3::splat(0.75), Vec3::new(1.0, 1.0, 2.0)));
        assert_eq!(aovs.diffuse, 1.5);
        assert_eq!((aovs.normal, aovs.position), (Vec3::new(1.0, 0.0, 1.0), Vec3::new(1.0, 1.0, 0.0)));
        let mut sky = AovSums::ZERO;
        sky.add_miss(Vec3::ONE);
        sky.add(aovs);
        assert_eq!((sky.primitive, sky.hits, sky.misses, sky.emission.x), (7, 2, 2, 2.0));
        aovs.add(AovSums { primitive: 11, ..sky });
        assert_eq!((aovs.primitive, aovs.hits, aovs.albedo), (7, 4, Vec3::splat(1.5)));
    }

    #[test]
    fn unwritten_is_all_ones() {
        assert!(bytemuck::bytes_of(&AovSums::UNWRITTEN).iter().all(|&b| b == 0xff));
    }
}
