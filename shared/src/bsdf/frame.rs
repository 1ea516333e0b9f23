//! Frame of a layered material: along the direction of its facets, with its layers.

use super::layered::LayeredLobes;
use super::{Bsdf, is_layered};
use crate::features::{FeatureSet, Features};
use crate::layers::{MaterialLayers, SOLID};
use crate::math::{max, normalize, sqrt};
use crate::microfacet::MIN_ROUGH_ALPHA;
use glam::Vec3;

/// Least difference of a solid's index of refraction from 1: facets that bend no light have no
/// normal that sends one direction to the other.
const MIN_BEND: f32 = 1e-3;

impl Bsdf {
    /// Returns the BSDF with the layers of its material, if that is layered, and with its frame
    /// along `tangent`, whose bitangent is to the side of `handedness`. `dispersed` is the factor
    /// of refracted light.
    #[inline(always)]
    pub fn with_layers<const POSSIBLE: Features>(
        mut self,
        features: FeatureSet<POSSIBLE>,
        layers: MaterialLayers,
        tangent: Vec3,
        handedness: f32,
        dispersed: Vec3,
    ) -> Self {
        if !is_layered(features, self.material.kind) {
            return self;
        }
        (self.layers, self.dispersed) = (layers, dispersed);
        if !self.front && layers.flags & SOLID != 0 {
            // Coat, sheen and film are outside of a solid.
            (self.layers.coat, self.layers.film) = (0.0, 0.0);
            self.layers.sheen_color = Vec3::ZERO;
        }
        if layers.flags & SOLID != 0 && (self.material.ior - 1.0).abs() < MIN_BEND {
            self.material.ior = 1.0 + MIN_BEND;
        }
        let alpha = max(self.alpha, MIN_ROUGH_ALPHA);
        self.alpha_y = alpha;
        self.alpha_x = alpha + (1.0 - alpha) * layers.anisotropy * layers.anisotropy;
        // For the fits of albedos: the root of the mean square over the directions.
        self.alpha = alpha;
        if self.is_stretched() {
            self.alpha = sqrt(0.5 * (self.alpha_x * self.alpha_x + alpha * alpha));
        }
        self.material.roughness = sqrt(self.alpha);
        let along = tangent - self.normal * tangent.dot(self.normal);
        if layers.anisotropy > 0.0 && along.dot(along) > 1e-12 {
            let tangent = normalize(along);
            // The handedness is that of the front's normal.
            let side = if self.front { handedness } else { -handedness };
            let bitangent = self.normal.cross(tangent) * side;
            let x = normalize(tangent * layers.anisotropy_cos + bitangent * layers.anisotropy_sin);
            let y = self.normal.cross(x);
            let (m, s) = (self.local_mapped, self.local_smooth);
            let mapped = self.x * m.x + self.y * m.y + self.normal * m.z;
            let smooth = self.x * s.x + self.y * s.y + self.normal * s.z;
            (self.x, self.y) = (x, y);
            let height = self.local_viewer.z;
            self.local_viewer = Vec3::new(self.viewer.dot(x), self.viewer.dot(y), height);
            self.local_mapped = self.world_to_local(mapped);
            self.local_smooth = self.world_to_local(smooth);
        }
        self.lobes = LayeredLobes::of(&self);
        self
    }
}
