//! Point lights, and spot lights: a point light whose intensity falls off from an axis.

use super::{Light, LightSample, NO_LIGHT, ReferencePoint};
use crate::math::{max, min, sqrt};
use glam::Vec3;

/// Returns the part of the intensity that a spot light has along the unit vector `to` towards it;
/// 1 for a point light.
#[inline(always)]
pub(crate) fn falloff(light: &Light, to: Vec3) -> f32 {
    let cone = min(max(light.cone_offset - to.dot(light.axis) * light.cone_scale, 0.0), 1.0);
    cone * cone
}

/// Samples the light, whose only point is its position.
#[inline(always)]
pub(super) fn sample(light: &Light, from: ReferencePoint) -> LightSample {
    let to = light.position - from.point;
    let square = to.dot(to);
    if square <= 0.0 {
        return NO_LIGHT;
    }
    let distance = sqrt(square);
    let direction = to * (1.0 / distance);
    LightSample {
        direction,
        t_max: distance,
        radiance: light.intensity * (falloff(light, direction) * (1.0 / square)),
        pdf: light.probability,
        ..NO_LIGHT
    }
}
