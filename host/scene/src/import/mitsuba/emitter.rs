//! Lights of Mitsuba that are no surfaces.

use super::super::assembly::{power_preserving_cone, spherical};
use super::document::Element;
use super::texture::Quantity;
use super::{Reader, SceneError};
use crate::description::PunctualLight;
use crate::values::unit;
use glam::{DAffine3, DVec3};
use std::rc::Rc;

impl Reader<'_, '_> {
    /// Adds a light without a shape.
    pub fn emitter(&mut self, element: &Rc<Element>) -> Result<(), SceneError> {
        let document = self.document;
        let site = document.site(element);
        let map = document.transform(element, "to_world")?;
        for name in ["sampling_weight", "mis_compensation"] {
            let _ = element.property(name);
        }
        match element.kind() {
            "point" => {
                let position = document.point(element, "position", map.translation)?;
                let intensity = self.light(element, "intensity")?;
                self.assembly.add_light(PunctualLight::Point { position, intensity }, &site)?;
            }
            "spot" => self.spot(element, &map)?,
            "directional" => {
                let ahead = map.transform_vector3(DVec3::Z);
                let direction = document.point(element, "direction", ahead)?;
                let direction = unit(direction)
                    .ok_or_else(|| document.error(element, "the direction of the light is 0"))?;
                let irradiance = self.light(element, "irradiance")?;
                self.assembly.add_light(PunctualLight::Directional { direction, irradiance }, &site)?;
            }
            "constant" => {
                let radiance = self.light(element, "radiance")?;
                self.assembly.add_uniform_sky(radiance, &site)?;
            }
            "envmap" => {
                let name = document.word(element, "filename")?;
                let name = name.ok_or_else(|| document.error(element, "an envmap needs a filename"))?;
                let scale = document.number(element, "scale", 1.0)?;
                let image = self.assembly.float_image(name, &site)?;
                self.assembly.set_panorama(&image, spherical, (scale, map), &site)?;
            }
            "area" => return Err(document.error(element, "an area light must stand within a <shape>")),
            _ => {
                self.unsupported(element, &element.label(), "this light is left out");
                return Ok(());
            }
        }
        self.report_unused(element);
        Ok(())
    }

    /// Returns the strength of a light by the name of its property; 1 without it.
    fn light(&mut self, element: &Element, name: &str) -> Result<DVec3, SceneError> {
        Ok(self.color(element, name, Quantity::Light)?.unwrap_or(DVec3::ONE))
    }

    fn spot(&mut self, element: &Rc<Element>, map: &DAffine3) -> Result<(), SceneError> {
        let document = self.document;
        let cutoff = document.number(element, "cutoff_angle", 20.0)?;
        let beam = document.number(element, "beam_width", 0.75 * cutoff)?;
        if !(0.0 < cutoff && cutoff < 180.0 && (0.0..=cutoff).contains(&beam)) {
            let message =
                format!("beam_width {beam} and cutoff_angle {cutoff} must be in order, from 0 to 180");
            return Err(document.error(element, message));
        }
        if cutoff > 90.0 {
            self.unsupported(element, "a cutoff_angle above 90 of <emitter type=\"spot\">", "taken as 90");
        }
        let intensity = self.light(element, "intensity")?;
        let outer = cutoff.min(90.0).to_radians();
        let inner = beam.to_radians().min(outer * (1.0 - 1e-6));
        // The falloff is linear in the angle.
        let mean = inner.cos() - (outer.sin() - inner.sin()) / (outer - inner);
        let ring = (mean / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
        let (inner, outer) = power_preserving_cone(inner.cos(), outer.cos(), ring);
        let direction = unit(map.transform_vector3(DVec3::Z))
            .ok_or_else(|| document.error(element, "the transform flattens the light"))?;
        let light = PunctualLight::Spot { position: map.translation, direction, intensity, inner, outer };
        self.assembly.add_light(light, &document.site(element))
    }
}
