//! Point lights, and spot lights: a point light whose intensity falls off from an axis.

use super::{Light, LightSample, NO_LIGHT, ReferencePoint};
use crate::math::{max, min, sqrt};

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
    let cone = min(max(light.cone_offset - direction.dot(light.axis) * light.cone_scale, 0.0), 1.0);
    LightSample {
        direction,
        t_max: distance,
        radiance: light.intensity * (cone * cone * (1.0 / square)),
        pdf: light.probability,
        ..NO_LIGHT
    }
}
