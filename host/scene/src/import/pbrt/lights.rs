//! Lights of pbrt.

use super::super::assembly::{octahedral, power_preserving_cone};
use super::parameters::Parameters;
use super::tokens::At;
use super::{AreaLight, Reader, SceneError, shown};
use crate::description::PunctualLight;
use crate::values::unit;
use glam::DVec3;
use std::f64::consts::PI;

impl Reader<'_> {
    /// Adds a light without a shape.
    pub fn light_source(&mut self, kind: &str, parameters: &Parameters, at: At) -> Result<(), SceneError> {
        let what = format!("LightSource \"{}\"", shown(kind));
        let from = parameters.point(&self.tokens, "from", DVec3::ZERO)?;
        let position = self.state.map.transform_point3(from);
        let light = match kind {
            "point" => {
                let power = parameters.number(&self.tokens, "power", 0.0)?;
                let factor = if power > 0.0 { power / (4.0 * PI) } else { 1.0 };
                PunctualLight::Point { position, intensity: self.strength(parameters, "I", at)? * factor }
            }
            "spot" => self.spot(parameters, from, at)?,
            "distant" => {
                let to = parameters.point(&self.tokens, "to", DVec3::Z)?;
                let illuminance = parameters.number(&self.tokens, "illuminance", 0.0)?;
                let factor = if illuminance > 0.0 { illuminance } else { 1.0 };
                let irradiance = self.strength(parameters, "L", at)? * factor;
                PunctualLight::Directional { direction: self.direction(to - from, at)?, irradiance }
            }
            "infinite" => {
                self.infinite(parameters, at)?;
                self.report_unused(parameters, &what);
                return Ok(());
            }
            _ => {
                self.unsupported(at, &what, "this light is left out");
                return Ok(());
            }
        };
        self.assembly.add_light(light, &self.tokens.site(at, "LightSource"))?;
        self.report_unused(parameters, &what);
        Ok(())
    }

    /// Returns the strength of a light by the name of its spectrum, times its scale.
    fn strength(&mut self, parameters: &Parameters, name: &str, at: At) -> Result<DVec3, SceneError> {
        let color = match self.spectrum(parameters, name)? {
            None => DVec3::ONE,
            Some(spectrum) => match spectrum.light() {
                Some(color) => color,
                None => {
                    return self
                        .error(at, format!("{name} is no spectrum of light that is known; state rgb"));
                }
            },
        };
        let strength = color * parameters.number(&self.tokens, "scale", 1.0)?;
        if strength.is_finite() && strength.min_element() >= 0.0 {
            return Ok(strength);
        }
        self.error(at, "the strength of the light must be finite and not negative")
    }

    /// Returns the unit vector in the world.
    fn direction(&self, along: DVec3, at: At) -> Result<DVec3, SceneError> {
        match unit(self.state.map.transform_vector3(along)).filter(|unit| unit.is_finite()) {
            Some(direction) => Ok(direction),
            None => self.error(at, "the light has no direction: from and to are the same point"),
        }
    }

    fn spot(&mut self, parameters: &Parameters, from: DVec3, at: At) -> Result<PunctualLight, SceneError> {
        let to = parameters.point(&self.tokens, "to", DVec3::Z)?;
        let cone = parameters.number(&self.tokens, "coneangle", 30.0)?;
        let falloff = parameters.number(&self.tokens, "conedeltaangle", 5.0)?;
        if !(0.0 < cone && cone < 180.0 && (0.0..=cone).contains(&falloff)) {
            let message =
                format!("coneangle {cone} and conedeltaangle {falloff} are no cone; from 0 to 180, in order");
            return self.error(at, message);
        }
        if cone > 90.0 {
            self.unsupported(at, "a coneangle above 90", "taken as 90");
        }
        let outer = cone.min(90.0).to_radians().cos();
        let inner = (cone - falloff).min(90.0).to_radians().cos().max(outer);
        let power = parameters.number(&self.tokens, "power", 0.0)?;
        let solid_angle = 2.0 * PI * ((1.0 - inner) + 0.5 * (inner - outer));
        let factor = if power > 0.0 { power / solid_angle } else { 1.0 };
        let intensity = self.strength(parameters, "I", at)? * factor;
        // The falloff is smoothstep of the cosine: its mean is one half.
        let (inner, outer) = power_preserving_cone(inner, outer, 0.5);
        let position = self.state.map.transform_point3(from);
        Ok(PunctualLight::Spot {
            position,
            direction: self.direction(to - from, at)?,
            intensity,
            inner,
            outer,
        })
    }

    fn infinite(&mut self, parameters: &Parameters, at: At) -> Result<(), SceneError> {
        match parameters.text(&self.tokens, "filename")? {
            Some(file) => {
                let site = self.tokens.site(at, "LightSource");
                let scale = parameters.number(&self.tokens, "scale", 1.0)?;
                let image = self.assembly.float_image(file, &site)?;
                if image.width != image.height {
                    let problem = format!("it has {} x {} pixels", image.width, image.height);
                    return Err(
                        site.malformed(problem, "pbrt-v4 needs a square one (`imgtool makeequiarea`)")
                    );
                }
                self.assembly.set_panorama(&image, octahedral, (scale, self.state.map), &site)
            }
            None => {
                let radiance = self.strength(parameters, "L", at)?;
                self.assembly.add_uniform_sky(radiance, &self.tokens.site(at, "LightSource"))
            }
        }
    }

    /// Makes the shapes that follow emit light.
    pub fn area_light(&mut self, kind: &str, parameters: &Parameters, at: At) -> Result<(), SceneError> {
        let what = format!("AreaLightSource \"{}\"", shown(kind));
        if kind != "diffuse" {
            self.unsupported(at, &what, "the shapes do not shine");
            return Ok(());
        }
        let radiance = self.strength(parameters, "L", at)?;
        let is_two_sided = parameters.flag(&self.tokens, "twosided", false)?;
        self.report_unused(parameters, &what);
        self.assembly.budget.take(size_of::<AreaLight>() as u64, &self.tokens.site(at, "AreaLightSource"))?;
        self.lights.push(AreaLight { radiance, is_two_sided });
        self.state.light = Some(self.lights.len() - 1);
        Ok(())
    }
}
