//! Normals of a BSDF whose shading normal a normal map bends, and the edge of the light there.

use super::{Bsdf, LAMBERTIAN};
use crate::features::{FeatureSet, Features, NORMAL_MAPS};
use crate::math::{max, min, sqrt};
use glam::Vec3;

/// Normals of a BSDF: unit vectors on the viewer's side. (Vectors begin rows of 16 bytes: naga lays
/// records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct BsdfNormals {
    /// Shading normal.
    pub shading: Vec3,
    /// True if there is a normal map.
    pub is_mapped: bool,
    /// Normal by the normal map, which a diffuse base has; the shading normal may be bent from it.
    pub mapped: Vec3,
    /// Interpolated normal, without the normal map.
    pub smooth: Vec3,
}

impl BsdfNormals {
    /// Returns the normals of a surface without a normal map.
    #[inline(always)]
    pub fn plain(normal: Vec3) -> Self {
        Self { shading: normal, is_mapped: false, mapped: normal, smooth: normal }
    }
}

impl Bsdf {
    /// Returns the factor of diffuse light from direction `i` of the shading frame that softens the
    /// edge of the light on a mapped surface: where the interpolated normal turns away, the mapped
    /// normal alone would cut the light off. It is the masking of GGX microfacets around the
    /// interpolated normal, as rough as the map is steep (Conty Estevez, Lecocq and Stein, "A
    /// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem", Ray Tracing Gems,
    /// 2019). It darkens, and never lightens: less light is reflected than arrives.
    #[inline(always)]
    pub(super) fn bump_shadowing(&self, i: Vec3) -> f32 {
        let (cos, tilt) = (i.dot(self.local_smooth), self.local_mapped.dot(self.local_smooth));
        if cos <= 0.0 {
            return 0.0;
        }
        // Squared tangents; an upright tilt is as rough as can be.
        let steepness = 1.0 / max(tilt * tilt, 1e-6) - 1.0;
        let alpha2 = min(0.125 * max(steepness, 0.0), 1.0);
        let slope = max(1.0 / max(cos * cos, 1e-12) - 1.0, 0.0);
        2.0 * (1.0 / (1.0 + sqrt(1.0 + alpha2 * slope)))
    }

    /// Returns whether a normal map bends the normal of a diffuse surface of the book.
    #[inline(always)]
    pub(super) fn is_mapped_lambertian<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
    ) -> bool {
        features.has::<NORMAL_MAPS>() && self.is_mapped && self.material.kind == LAMBERTIAN
    }
}
