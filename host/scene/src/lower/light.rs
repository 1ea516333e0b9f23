//! Lowers lights without extent.

use super::super::description::PunctualLight;
use super::unit;
use trisect_shared::light::{DIRECTIONAL, Light, POINT};

/// Returns the record of a light; `trisect::lights` fills in its probability and its row of the
/// alias table.
pub(super) fn lower(light: &PunctualLight) -> Light {
    let mut record: Light = bytemuck::Zeroable::zeroed();
    record.kind = POINT;
    record.cone_offset = 1.0;
    match light {
        PunctualLight::Point { position, intensity } => {
            record.position = position.as_vec3();
            record.intensity = intensity.as_vec3();
        }
        PunctualLight::Spot { position, direction, intensity, inner, outer } => {
            record.position = position.as_vec3();
            record.intensity = intensity.as_vec3();
            record.axis = unit(*direction);
            // KHR_lights_punctual: scale = 1 / max(0.001, cos inner - cos outer), offset = -cos
            // outer · scale.
            let scale = 1.0 / (inner.cos() - outer.cos()).max(1e-3);
            record.cone_scale = scale as f32;
            record.cone_offset = (-outer.cos() * scale) as f32;
        }
        PunctualLight::Directional { direction, irradiance } => {
            record.kind = DIRECTIONAL;
            record.position = -unit(*direction);
            record.intensity = irradiance.as_vec3();
        }
    }
    record
}
