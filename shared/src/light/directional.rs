//! Directional lights: parallel light from infinity.

use super::{Light, LightSample, NO_LIGHT};

/// Samples the light, which has one direction.
#[inline(always)]
pub(super) fn sample(light: &Light) -> LightSample {
    LightSample { direction: light.position, radiance: light.intensity, pdf: light.probability, ..NO_LIGHT }
}
