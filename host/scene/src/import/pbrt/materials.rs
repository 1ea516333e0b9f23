//! Materials of pbrt.

use super::super::assembly::{
    Coating, Value, conductor, glass_surface, metal, plastic, roughness_of, thin_glass,
};
use super::parameters::Parameters;
use super::spectrum::Spectrum;
use super::tokens::At;
use super::{Reader, SceneError, shown};
use crate::description::{Interface, Material, MetallicRoughness, Surface};
use crate::material::layers::{DiffuseTransmission, Layers, Specular};
use glam::DVec3;

impl Reader<'_> {
    /// Chooses a material by its name.
    pub fn named_material(&mut self, at: At) -> Result<(), SceneError> {
        let name = self.text("NamedMaterial")?;
        match self.named_materials.get(&name) {
            Some(&material) => self.state.material = material,
            None => {
                let message =
                    format!("unknown material \"{}\"; MakeNamedMaterial must define it", shown(&name));
                return self.error(at, message);
            }
        }
        Ok(())
    }

    /// Defines a material with a name.
    pub fn make_named_material(
        &mut self,
        name: String,
        parameters: &Parameters,
        at: At,
    ) -> Result<(), SceneError> {
        let Some(kind) = parameters.text(&self.tokens, "type")? else {
            return self.error(at, "MakeNamedMaterial needs the parameter type");
        };
        let material = self.add_base_material(&name, kind, parameters, at)?;
        self.named_materials.insert(name, material);
        Ok(())
    }

    /// Adds a material without light, opacity and medium, and returns its index.
    pub fn add_base_material(
        &mut self,
        name: &str,
        kind: &str,
        parameters: &Parameters,
        at: At,
    ) -> Result<usize, SceneError> {
        let what = format!("Material \"{}\"", shown(kind));
        if kind == "mix" {
            return self.mixed(parameters, at);
        }
        let surface = self.surface(kind, parameters, at)?;
        let mut material = Material::new(surface).named(shown(name));
        if let Some(file) = parameters.text(&self.tokens, "normalmap")? {
            material.normal_texture = Some(self.image(file, true, at)?);
        }
        // An interface gets its medium from the shape.
        if !matches!(material.surface, Surface::Interface(_)) {
            let checked = material.check(self.assembly.images.all.len());
            checked.map_err(|fault| self.tokens.error(at, format!("{what}: {fault}")))?;
        }
        self.assembly.budget.take(size_of::<Material>() as u64, &self.tokens.site(at, "Material"))?;
        self.report_unused(parameters, &what);
        self.materials.push(material);
        Ok(self.materials.len() - 1)
    }

    fn surface(&mut self, kind: &str, parameters: &Parameters, at: At) -> Result<Surface, SceneError> {
        Ok(match kind {
            "diffuse" => self.share(parameters, "reflectance", 0.5, at)?.into(),
            "coateddiffuse" => {
                let base = self.share(parameters, "reflectance", 0.5, at)?;
                let alpha = self.alpha(parameters, "", 0.0, at)?;
                let ior = self.glass(parameters, "eta", at)?;
                self.layered(parameters, at)?;
                plastic(base, Coating { ior, alpha, is_nonlinear: true })
            }
            "conductor" => {
                let alpha = self.alpha(parameters, "", 0.0, at)?;
                let (eta, k) = self.metal(parameters, "", at)?;
                conductor(eta, k, alpha)
            }
            "coatedconductor" => {
                let alpha = self.alpha(parameters, "conductor.", 0.0, at)?;
                let coating = Coating {
                    ior: self.glass(parameters, "interface.eta", at)?,
                    alpha: self.alpha(parameters, "interface.", 0.0, at)?,
                    is_nonlinear: false,
                };
                let (eta, k) = self.metal(parameters, "conductor.", at)?;
                self.layered(parameters, at)?;
                // The metal is below the coating.
                let eta = eta / coating.ior;
                let k = k / coating.ior;
                let normal = ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k);
                Surface::MetallicRoughness(MetallicRoughness {
                    base_color: normal.clamp(DVec3::ZERO, DVec3::ONE),
                    metallic: 1.0,
                    roughness: roughness_of(alpha),
                    layers: coating.layers(),
                    ..MetallicRoughness::default()
                })
            }
            "dielectric" => {
                let ior = self.glass(parameters, "eta", at)?;
                glass_surface(ior, self.alpha(parameters, "", 0.0, at)?)
            }
            "thindielectric" => thin_glass(self.glass(parameters, "eta", at)?.max(1.0)),
            "diffusetransmission" => self.diffuse_transmission(parameters, at)?,
            "interface" | "" | "none" => Surface::Interface(Interface {}),
            _ => {
                let what = format!("Material \"{}\"", shown(kind));
                self.unsupported(at, &what, "drawn as a diffuse surface that reflects 0.5");
                parameters.unused().for_each(|parameter| parameters.ignore(&[&parameter.name]));
                Value::number(0.5).into()
            }
        })
    }

    /// Returns a share of light by its name.
    fn share(
        &mut self,
        parameters: &Parameters,
        name: &str,
        default: f64,
        at: At,
    ) -> Result<Value, SceneError> {
        let value = self.value(parameters, name, default, false)?;
        if value.exceeds_one() {
            self.unsupported(at, &format!("a {name} above 1"), "taken as 1");
        }
        Ok(value)
    }

    /// Returns the GGX alpha of a rough surface; `prefix` begins the names of its parameters.
    fn alpha(
        &mut self,
        parameters: &Parameters,
        prefix: &str,
        default: f64,
        at: At,
    ) -> Result<f64, SceneError> {
        let roughness = self.scalar(parameters, &format!("{prefix}roughness"), default)?;
        let u = self.scalar(parameters, &format!("{prefix}uroughness"), roughness)?;
        let v = self.scalar(parameters, &format!("{prefix}vroughness"), roughness)?;
        if u != v {
            self.unsupported(at, "different uroughness and vroughness", "the root of their product is used");
        }
        let roughness = (u * v).max(0.0).sqrt();
        Ok(if parameters.flag(&self.tokens, "remaproughness", true)? { roughness.sqrt() } else { roughness })
    }

    /// Returns the index of refraction of a dielectric.
    fn glass(&mut self, parameters: &Parameters, name: &str, at: At) -> Result<f64, SceneError> {
        let ior = match self.spectrum(parameters, name)? {
            None => 1.5,
            Some(spectrum) => {
                if let Spectrum::Samples(_) = spectrum {
                    self.unsupported(at, "dispersion", "the index of refraction of green light is used");
                }
                match spectrum.glass() {
                    Some(ior) => ior,
                    None => return self.error(at, format!("{name} has an unknown spectrum; state a number")),
                }
            }
        };
        if (1e-3..=1e3).contains(&ior) {
            return Ok(ior);
        }
        self.error(at, format!("{name} is {ior}; it must be from 0.001 to 1000"))
    }

    /// Returns the index of refraction of a metal; `prefix` begins the names of its parameters.
    fn metal(&mut self, parameters: &Parameters, prefix: &str, at: At) -> Result<(DVec3, DVec3), SceneError> {
        let name = format!("{prefix}reflectance");
        let name = if parameters.get(&name).is_some() { name } else { "reflectance".to_owned() };
        if let Some(reflectance) = self.optional_value(parameters, &name, false)? {
            if let Value::Image { .. } = reflectance {
                self.unsupported(at, "a texture as reflectance of a metal", "its mean is used");
            }
            // An index of 1 whose absorption gives this reflectance.
            let r = reflectance.mean(&self.assembly.images.all).clamp(DVec3::ZERO, DVec3::splat(0.9999));
            let k = 2.0 * (r / (DVec3::ONE - r)).map(f64::sqrt);
            return Ok((DVec3::ONE, k));
        }
        let copper = metal("Cu").unwrap_or_default();
        let eta = self.metal_part(parameters, &format!("{prefix}eta"), copper.0, at)?;
        Ok((eta, self.metal_part(parameters, &format!("{prefix}k"), copper.1, at)?))
    }

    /// Returns `eta` or `k` of a metal by the name of its parameter.
    fn metal_part(
        &mut self,
        parameters: &Parameters,
        name: &str,
        default: DVec3,
        at: At,
    ) -> Result<DVec3, SceneError> {
        let Some(spectrum) = self.spectrum(parameters, name)? else { return Ok(default) };
        match spectrum.metal() {
            Some(part) => Ok(part),
            None => self.error(at, format!("{name} has an unknown spectrum; state it as rgb")),
        }
    }

    /// Warns of what happens between the layers of a coated surface.
    fn layered(&mut self, parameters: &Parameters, at: At) -> Result<(), SceneError> {
        if self.value(parameters, "albedo", 0.0, false)?.mean(&self.assembly.images.all) != DVec3::ZERO {
            self.unsupported(at, "the albedo between the layers of a coated surface", "taken as 0");
        }
        parameters.ignore(&["g", "maxdepth", "nsamples", "thickness", "interface.thickness"]);
        Ok(())
    }

    fn diffuse_transmission(&mut self, parameters: &Parameters, at: At) -> Result<Surface, SceneError> {
        let scale = parameters.number(&self.tokens, "scale", 1.0)?;
        let mut share = |name: &str| {
            let value = self.share(parameters, name, 0.25, at)?;
            if let Value::Image { .. } = value {
                self.unsupported(at, "a texture of Material \"diffusetransmission\"", "its mean is used");
            }
            Ok(value.mean(&self.assembly.images.all) * scale)
        };
        let (reflected, passed) = (share("reflectance")?, share("transmittance")?);
        let (most, all) = (passed.max_element(), reflected.max_element() + passed.max_element());
        let share = if all > 0.0 { most / all } else { 0.0 };
        let over = |color: DVec3, share: f64| {
            if share > 0.0 { (color / share).clamp(DVec3::ZERO, DVec3::ONE) } else { DVec3::ZERO }
        };
        let base_color = over(reflected, 1.0 - share);
        // The colour of what passes stands apart from that of what is reflected.
        let color = over(passed, share);
        Ok(Surface::MetallicRoughness(MetallicRoughness {
            base_color,
            metallic: 0.0,
            roughness: 1.0,
            layers: Layers {
                specular: Some(Specular { strength: 0.0, ..Specular::default() }),
                diffuse_transmission: Some(DiffuseTransmission {
                    share,
                    color,
                    ..DiffuseTransmission::default()
                }),
                ..Layers::default()
            },
            ..MetallicRoughness::default()
        }))
    }

    /// Returns the material of the greater amount in a mix.
    fn mixed(&mut self, parameters: &Parameters, at: At) -> Result<usize, SceneError> {
        let amount = self.scalar(parameters, "amount", 0.5)?;
        self.unsupported(at, "Material \"mix\"", "the material of the greater amount is drawn");
        let names = parameters.texts(&self.tokens, "materials")?;
        let [first, second] = names else {
            return self.error(at, "a mix needs the names of two materials");
        };
        let name = if amount > 0.5 { second } else { first };
        match self.named_materials.get(name) {
            Some(&material) => Ok(material),
            None => self
                .error(at, format!("unknown material \"{}\"; MakeNamedMaterial must define it", shown(name))),
        }
    }
}
