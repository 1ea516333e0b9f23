//! Mitsuba's principled materials.

use super::super::assembly::glass_surface;
use super::document::Element;
use super::{Reader, SceneError};
use crate::description::{MetallicRoughness, Surface};
use crate::material::layers::{Coat, Layers, Volume};
use glam::DVec3;
use std::rc::Rc;

impl Reader<'_, '_> {
    /// Returns the surface of `principled` or `principledthin`.
    pub fn principled(&mut self, element: &Rc<Element>) -> Result<Surface, SceneError> {
        let document = self.document;
        let is_thin = element.kind() == "principledthin";
        let (base_color, texture) = self.share(element, "base_color", 0.5)?.share();
        let roughness = self.scalar(element, "roughness", 0.5)?.clamp(0.0, 1.0);
        let metallic = self.scalar(element, "metallic", 0.0)?.clamp(0.0, 1.0);
        let transmission = self.scalar(element, "spec_trans", 0.0)?.clamp(0.0, 1.0);
        let coat = self.scalar(element, "clearcoat", 0.0)?.clamp(0.0, 1.0);
        let gloss = self.scalar(element, "clearcoat_gloss", 0.0)?.clamp(0.0, 1.0);
        let ior = match element.property("eta") {
            Some(_) => document.number(element, "eta", 1.5)?,
            // The reflectance at normal incidence is 0.08 times this.
            None => {
                let root = (0.08 * self.scalar(element, "specular", 0.5)?.clamp(0.0, 1.0)).sqrt();
                (1.0 + root) / (1.0 - root)
            }
        };
        for name in ["anisotropic", "spec_tint", "sheen", "flatness", "diff_trans"] {
            if self.scalar(element, name, 0.0)? != 0.0 {
                self.unsupported(element, &format!("{name} of {}", element.label()), "ignored");
            }
        }
        for name in ["sheen_tint", "diffuse_reflectance_sampling_rate", "specular_sampling_rate"] {
            let _ = element.property(name);
        }
        let _ = element.property("clearcoat_sampling_rate");
        if !(1e-3..=1e3).contains(&ior) {
            return Err(document.error(element, format!("eta is {ior}; it must be from 0.001 to 1000")));
        }
        let is_glass = (metallic, transmission, coat) == (0.0, 1.0, 0.0);
        if is_glass && !is_thin && base_color == DVec3::ONE && texture.is_none() {
            return Ok(glass_surface(ior, roughness * roughness));
        }
        // Light takes the root of the colour at each crossing of a solid's surface.
        let is_solid = transmission > 0.0 && !is_thin;
        let base_color = match is_solid && base_color != DVec3::ONE {
            true if transmission == 1.0 && metallic == 0.0 && texture.is_none() => base_color.map(f64::sqrt),
            true => {
                let what = "spec_trans of a coloured principled";
                self.unsupported(
                    element,
                    what,
                    "light takes base_color at each crossing in place of its root",
                );
                base_color
            }
            false => base_color,
        };
        // The coat is a quarter of a boundary of index 1.5 whose alpha is 0.1 to 0.001.
        let coat = (coat > 0.0).then(|| Coat {
            strength: 0.25 * coat,
            roughness: (0.1 + (0.001 - 0.1) * gloss).sqrt(),
            ..Coat::default()
        });
        let volume = (transmission > 0.0 && !is_thin).then(Volume::default);
        Ok(Surface::MetallicRoughness(MetallicRoughness {
            base_color,
            texture,
            metallic,
            roughness,
            ior,
            transmission,
            layers: Layers { coat, volume, ..Layers::default() },
            ..MetallicRoughness::default()
        }))
    }
}
