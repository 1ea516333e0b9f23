//! Materials of Mitsuba.

use super::super::assembly::{
    Coating, Value, conductor, glass, glass_surface, metal, plastic, thin_glass, tinted_metal,
};
use super::super::source_location::shown;
use super::document::Element;
use super::texture::Quantity;
use super::{Reader, SceneError};
use crate::description::{Interface, Material, Surface};
use glam::DVec3;
use std::rc::Rc;

/// Maximum number of materials within each other.
const MAX_NESTING: usize = 16;

impl Reader<'_, '_> {
    /// Returns the material of a BSDF, without emission and medium.
    pub fn bsdf(&mut self, element: &Rc<Element>, depth: usize) -> Result<Material, SceneError> {
        let document = self.document;
        let element = self.resolved(element)?;
        element.mark();
        if element.tag != "bsdf" {
            return Err(document.error(element, format!("{} is no <bsdf>", element.label())));
        }
        if depth > MAX_NESTING {
            return Err(document.error(element, "materials are nested too deeply, or contain themselves"));
        }
        let material = match element.kind() {
            "twosided" => self.nested(element, depth)?,
            "mask" => {
                let mut material = self.nested(element, depth)?;
                let opacity = self.value(element, "opacity", Quantity::Share)?;
                let site = document.site(element);
                self.assembly.set_opacity(&mut material, &opacity.unwrap_or(Value::number(0.5)), &site)?;
                material
            }
            "normalmap" => {
                let mut material = self.nested(element, depth)?;
                match self.value(element, "normalmap", Quantity::Share)? {
                    Some(Value::Image { texture, .. }) => material.normal_texture = Some(texture),
                    _ => self.unsupported(element, "a normal map without a bitmap", "ignored"),
                }
                material
            }
            "bumpmap" => {
                self.unsupported(element, "<bsdf type=\"bumpmap\">", "the surface is drawn without bumps");
                for child in element.children.iter().filter(|child| child.tag == "texture") {
                    child.mark();
                }
                let _ = element.property("scale");
                self.nested(element, depth)?
            }
            "blendbsdf" => {
                let weight = self.scalar(element, "weight", 0.5)?;
                self.unsupported(
                    element,
                    "<bsdf type=\"blendbsdf\">",
                    "the part of the greater weight is drawn",
                );
                let parts: Vec<_> =
                    element.children.iter().filter(|child| self.is_bsdf(child)).cloned().collect();
                let chosen = parts.get(usize::from(weight > 0.5));
                let chosen = chosen.ok_or_else(|| document.error(element, "blendbsdf needs two <bsdf>"))?;
                parts.iter().for_each(|part| part.mark());
                self.bsdf(chosen, depth + 1)?
            }
            _ => Material::new(self.surface(element)?),
        };
        self.report_unused(element);
        let name = element.attribute("id").unwrap_or(element.kind());
        Ok(material.named(shown(name)))
    }

    fn is_bsdf(&self, child: &Rc<Element>) -> bool {
        self.resolved(child).is_ok_and(|child| child.tag == "bsdf")
    }

    /// Returns the material within another one; of two, the first.
    fn nested(&mut self, element: &Rc<Element>, depth: usize) -> Result<Material, SceneError> {
        let mut parts = element.children.iter().filter(|child| self.is_bsdf(child)).cloned();
        let (first, second) = (parts.next(), parts.next());
        if let Some(second) = second {
            second.mark();
            self.unsupported(&second, "another material for the back", "the front's is used for both sides");
        }
        match first {
            Some(first) => {
                first.mark();
                self.bsdf(&first, depth + 1)
            }
            None => {
                let message = format!("{} needs a <bsdf> within it", element.label());
                Err(self.document.error(element, message))
            }
        }
    }

    fn surface(&mut self, element: &Rc<Element>) -> Result<Surface, SceneError> {
        let kind = element.kind();
        Ok(match kind {
            "diffuse" => self.share(element, "reflectance", 0.5)?.into(),
            "dielectric" | "roughdielectric" => {
                let ior = self.relative_ior(element, "bk7")?;
                let alpha = if kind == "dielectric" { 0.0 } else { self.alpha(element)? };
                self.warn_of_tint(element, &["specular_reflectance", "specular_transmittance"])?;
                glass_surface(ior, alpha)
            }
            "thindielectric" => {
                let ior = self.relative_ior(element, "bk7")?;
                self.warn_of_tint(element, &["specular_reflectance", "specular_transmittance"])?;
                thin_glass(ior.max(1.0 / ior))
            }
            "conductor" | "roughconductor" => self.conductor(element)?,
            "plastic" | "roughplastic" => {
                let base = self.share(element, "diffuse_reflectance", 0.5)?;
                let ior = self.relative_ior(element, "polypropylene")?;
                let alpha = if kind == "plastic" { 0.0 } else { self.alpha(element)? };
                let is_nonlinear = self.document.flag(element, "nonlinear", false)?;
                self.warn_of_tint(element, &["specular_reflectance"])?;
                plastic(base, Coating { ior, alpha, is_nonlinear })
            }
            "principled" | "principledthin" => self.principled(element)?,
            "null" => Surface::Interface(Interface {}),
            _ => {
                self.unsupported(element, &element.label(), "drawn as a diffuse surface that reflects 0.5");
                element.children.iter().for_each(|child| child.mark());
                Value::number(0.5).into()
            }
        })
    }

    /// Returns a share of light by the name of its property.
    pub fn share(&mut self, element: &Element, name: &str, default: f64) -> Result<Value, SceneError> {
        let value = self.value(element, name, Quantity::Share)?.unwrap_or(Value::number(default));
        if value.exceeds_one() {
            let feature = format!("{name} above 1 of <{} type=\"{}\">", element.tag, shown(element.kind()));
            self.unsupported(element, &feature, "taken as 1");
        }
        Ok(value)
    }

    /// Returns the index of refraction inside relative to outside.
    fn relative_ior(&mut self, element: &Element, inside: &str) -> Result<f64, SceneError> {
        let document = self.document;
        let ior = |name: &str, default: &str| {
            let word = document.word(element, name)?.unwrap_or(default);
            match glass(word) {
                Some(ior) => Ok(ior),
                None => document.parse_number(element, word),
            }
        };
        let ratio = ior("int_ior", inside)? / ior("ext_ior", "air")?;
        if (1e-3..=1e3).contains(&ratio) {
            return Ok(ratio);
        }
        Err(document.error(element, format!("int_ior / ext_ior is {ratio}; it must be from 0.001 to 1000")))
    }

    /// Returns the GGX alpha of a rough surface.
    fn alpha(&mut self, element: &Rc<Element>) -> Result<f64, SceneError> {
        if self.document.word(element, "distribution")?.unwrap_or("beckmann") != "ggx" {
            let feature = format!("the distribution beckmann of <bsdf type=\"{}\">", shown(element.kind()));
            self.unsupported(element, &feature, "taken as ggx of the same alpha");
        }
        let _ = element.property("sample_visible");
        let [along, across] = ["alpha_u", "alpha_v"].map(|name| element.property(name).is_some());
        if along || across {
            let (u, v) = (self.scalar(element, "alpha_u", 0.1)?, self.scalar(element, "alpha_v", 0.1)?);
            if u != v {
                let feature =
                    format!("different alpha_u and alpha_v of <bsdf type=\"{}\">", shown(element.kind()));
                self.unsupported(element, &feature, "the root of their product is used");
            }
            return Ok((u * v).max(0.0).sqrt());
        }
        self.scalar(element, "alpha", 0.1)
    }

    /// Warns of factors on reflection and transmission.
    fn warn_of_tint(&mut self, element: &Rc<Element>, names: &[&str]) -> Result<(), SceneError> {
        for name in names {
            if self.color(element, name, Quantity::Share)?.is_some_and(|color| color != DVec3::ONE) {
                let feature = format!("{name} of <bsdf type=\"{}\">", shown(element.kind()));
                self.unsupported(element, &feature, "taken as 1");
            }
        }
        Ok(())
    }

    fn conductor(&mut self, element: &Rc<Element>) -> Result<Surface, SceneError> {
        let document = self.document;
        let alpha = if element.kind() == "conductor" { 0.0 } else { self.alpha(element)? };
        let tint = self.color(element, "specular_reflectance", Quantity::Share)?.unwrap_or(DVec3::ONE);
        let name = document.word(element, "material")?;
        let eta = self.color(element, "eta", Quantity::Share)?;
        let k = self.color(element, "k", Quantity::Share)?;
        let _ = element.property("ext_eta");
        // Without a material a conductor is a mirror, as with "none".
        if name == Some("none") || (name, eta, k) == (None, None, None) {
            return Ok(tinted_metal(tint, alpha));
        }
        let (eta, k) = match (name, eta, k) {
            (None, eta, k) => (eta.unwrap_or(DVec3::ZERO), k.unwrap_or(DVec3::ONE)),
            (Some(name), _, _) => metal(name).ok_or_else(|| {
                document
                    .error(element, format!("unknown material \"{}\"; state eta and k instead", shown(name)))
            })?,
        };
        if tint == DVec3::ONE {
            return Ok(conductor(eta, k, alpha));
        }
        let feature = format!("specular_reflectance of <bsdf type=\"{}\">", shown(element.kind()));
        self.unsupported(element, &feature, "Schlick's approximation of the product is used");
        let normal = ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k);
        Ok(tinted_metal(normal * tint, alpha))
    }
}
