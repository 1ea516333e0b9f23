//! Converts MTL materials to those of the description.

use super::super::source_location::{SourceLocation, shown};
use super::library::{Entry, Libraries};
use super::map::Map;
use super::maps::{self, Derived, Used};
use crate::description::{
    Alpha, Conductor, Dielectric, Lambertian, Material, MetallicRoughness, Surface, TextureUse,
};
use crate::error::SceneError;
use crate::material::layers::{Layers, Specular};
use crate::values::MAX_MAGNITUDE;
use glam::DVec3;
use std::collections::HashMap;

/// Default albedo, and that of faces without a material.
const GREY: f64 = 0.8;
/// Default index of refraction, that of glass.
const GLASS: f64 = 1.5;
/// `Ks` of a dielectric that reflects as its index of refraction says, as Blender writes and reads
/// it.
const NEUTRAL_SPECULAR: f64 = 0.5;

/// Materials in use, and the libraries that they come from.
#[derive(Debug)]
pub struct Materials {
    libraries: Libraries,
    index: HashMap<String, usize>,
    derived: Derived,
}

/// Returns a diffuse grey material.
pub fn grey(name: &str) -> Material {
    two_sided(name, Lambertian { albedo: DVec3::splat(GREY), texture: None }.into())
}

/// Returns a material that emits from both sides, because OBJ has no front sides.
fn two_sided(name: &str, surface: Surface) -> Material {
    Material { name: name.to_owned(), emits_both_sides: true, ..Material::new(surface) }
}

impl Materials {
    pub fn new(libraries: Libraries) -> Self {
        Self { libraries, index: HashMap::new(), derived: Derived::default() }
    }

    /// Returns the index of the material `name` in the description, and adds it at its first use;
    /// "" stands for no material.
    pub fn get(&mut self, name: &str, used: &mut Used) -> Result<usize, SceneError> {
        if let Some(&index) = self.index.get(name) {
            return Ok(index);
        }
        let material = match self.libraries.entries.get(name) {
            Some(entry) => {
                let place = format!("line {}, newmtl {}", entry.line, shown(name));
                let site = SourceLocation::new(&entry.file, place);
                let derived = &mut self.derived;
                Converter { entry, site, used, derived }.material(name)?
            }
            None if name.is_empty() => grey("default"),
            None => {
                used.warnings.tally(
                    "materials that no library (mtllib) has, diffuse grey",
                    1,
                    &format!("usemtl {}", shown(name)),
                );
                grey(&shown(name))
            }
        };
        used.description.materials.push(material);
        self.index.insert(name.to_owned(), used.description.materials.len() - 1);
        Ok(used.description.materials.len() - 1)
    }
}

/// An MTL material while it is converted.
struct Converter<'a, 'b> {
    entry: &'a Entry,
    site: SourceLocation<'a>,
    used: &'a mut Used<'b>,
    derived: &'a mut Derived,
}

impl Converter<'_, '_> {
    /// Returns the material of this name.
    fn material(&mut self, name: &str) -> Result<Material, SceneError> {
        let entry = self.entry;
        let dissolve = entry.dissolve.or(entry.transparency.map(|transparency| 1.0 - transparency));
        let dissolve = self.share(DVec3::splat(dissolve.unwrap_or(1.0))).x;
        let mut material = two_sided(&shown(name), self.surface(dissolve)?);
        if !matches!(material.surface, Surface::Dielectric(_)) {
            material.opacity = dissolve;
            material.alpha = if dissolve < 1.0 { Alpha::Blend } else { Alpha::Opaque };
        }
        let emitted = if entry.emission_map.is_some() { DVec3::ONE } else { DVec3::ZERO };
        material.emission = entry.emission.unwrap_or(emitted);
        if !(material.emission.cmpge(DVec3::ZERO).all()
            && material.emission.cmple(DVec3::splat(MAX_MAGNITUDE)).all())
        {
            let problem = format!("Ke is {}", material.emission);
            return Err(self.site.malformed(problem, "emission must be 0 or more and at most 1e18"));
        }
        if material.emission != DVec3::ZERO {
            material.emission_texture = self.colors(entry.emission_map.as_ref())?;
        }
        if entry.normal_map.is_some() && entry.bump_map.is_some() {
            self.used
                .warnings
                .once("materials with both a normal map (norm) and map_Bump show the normal map alone");
        }
        if let Some(map) = entry.normal_map.as_ref().or(entry.bump_map.as_ref()) {
            let is_normal_map = entry.normal_map.is_some();
            let normals = maps::normals(map, is_normal_map, self.derived, self.used, &entry.file)?;
            (material.normal_texture, material.normal_scale) = (Some(normals), map.bump);
        }
        Ok(material)
    }

    /// Returns the surface of a material of this opacity.
    fn surface(&mut self, dissolve: f64) -> Result<Surface, SceneError> {
        let entry = self.entry;
        let default = if entry.diffuse_map.is_some() { 1.0 } else { GREY };
        let diffuse = self.share(entry.diffuse.unwrap_or(DVec3::splat(default)));
        let default = if entry.specular_map.is_some() { DVec3::ONE } else { DVec3::ZERO };
        let specular = self.share(entry.specular.unwrap_or(default));
        let model = entry.illumination.map(|number| number as i64);
        let filtered = entry.filter.is_some() && entry.ior.is_some() && dissolve < 1.0;
        let physical = entry.roughness.or(entry.metallic).is_some()
            || entry.roughness_map.is_some()
            || entry.metallic_map.is_some();
        let is_glass = !physical && (matches!(model, Some(4 | 6 | 7)) || filtered);
        let shines = specular != DVec3::ZERO && !physical && !is_glass;
        let mirror = entry.exponent.filter(|_| shines && matches!(model, Some(3 | 5)));
        let glossy = shines && mirror.is_none() && !matches!(model, Some(0 | 1));
        if !glossy {
            self.used.warnings.tally(
                "reflection maps (map_Ks) of materials whose Ks and Ns do not make them glossy, ignored",
                u64::from(entry.specular_map.is_some()),
                &self.site.place,
            );
        }
        if physical {
            return self.physical(diffuse);
        }
        if is_glass {
            if entry.filter.is_some_and(|filter| filter != DVec3::ONE) {
                self.used.warnings.once("coloured glass (Tf) is not supported: glass is clear");
            }
            return Ok(Dielectric { ior: self.ior(1e-3) }.into());
        }
        if let Some(exponent) = mirror {
            return Ok(Conductor::schlick(specular, roughness(exponent)).into());
        }
        if glossy {
            return self.glossy(diffuse, specular);
        }
        let texture = self.colors(entry.diffuse_map.as_ref())?;
        Ok(Lambertian { albedo: diffuse, texture }.into())
    }

    /// Returns the surface that `Pr` and `Pm` describe.
    fn physical(&mut self, base_color: DVec3) -> Result<Surface, SceneError> {
        let entry = self.entry;
        let default = if entry.metallic_map.is_some() { 1.0 } else { 0.0 };
        let factors = [entry.roughness.unwrap_or(1.0), entry.metallic.unwrap_or(default), 1.0];
        let [roughness, metallic, _] = self.share(factors.into()).to_array();
        let (rough, metal) = (entry.roughness_map.as_ref(), entry.metallic_map.as_ref());
        if let (Some(a), Some(b)) = (rough, metal) {
            self.used.warnings.tally(
                "materials whose map_Pm has another placement than their map_Pr, placed as map_Pr",
                u64::from((a.scale, a.offset, a.clamp) != (b.scale, b.offset, b.clamp)),
                &self.site.place,
            );
        }
        let metallic_roughness_texture =
            maps::roughness_and_metalness((rough, metal), self.derived, self.used, &entry.file)?;
        let surface = MetallicRoughness {
            base_color,
            texture: self.colors(entry.diffuse_map.as_ref())?,
            metallic,
            roughness,
            metallic_roughness_texture,
            ior: self.ior(1.0),
            ..MetallicRoughness::default()
        };
        Ok(surface.into())
    }

    /// Returns a dielectric with highlights. Grey `Ks` changes the index of refraction, and another
    /// one needs a layer.
    fn glossy(&mut self, base_color: DVec3, specular: DVec3) -> Result<Surface, SceneError> {
        let entry = self.entry;
        let factor = specular / NEUTRAL_SPECULAR;
        let is_grey = factor.min_element() == factor.max_element() && entry.specular_map.is_none();
        let mut surface = MetallicRoughness {
            base_color,
            texture: self.colors(entry.diffuse_map.as_ref())?,
            metallic: 0.0,
            roughness: roughness(entry.exponent.unwrap_or(0.0)),
            // Many programs write 1 for opaque materials, which would not reflect.
            ior: if entry.ior == Some(1.0) { GLASS } else { self.ior(1.0) },
            ..MetallicRoughness::default()
        };
        if is_grey {
            surface.ior = scaled_ior(surface.ior, factor.x);
        } else {
            let color_texture = self.colors(entry.specular_map.as_ref())?;
            let layer = Specular { color: factor, color_texture, ..Specular::default() };
            surface.layers = Layers { specular: Some(layer), ..Layers::default() };
        }
        Ok(surface.into())
    }

    /// Returns the use of a map of colours.
    fn colors(&mut self, map: Option<&Map>) -> Result<Option<TextureUse>, SceneError> {
        map.map(|map| maps::colors(map, self.used, &self.entry.file)).transpose()
    }

    /// Returns factors within 0 to 1, with a warning if they are not.
    fn share(&mut self, value: DVec3) -> DVec3 {
        let clamped = value.clamp(DVec3::ZERO, DVec3::ONE);
        let changed = u64::from(clamped != value);
        self.used.warnings.tally("material factors outside 0 to 1, clamped", changed, &self.site.place);
        clamped
    }

    /// Returns the index of refraction if it is from `least` to 1000, else 1.5, with a warning.
    fn ior(&mut self, least: f64) -> f64 {
        let ior = self.entry.ior.unwrap_or(GLASS);
        if (least..=1000.0).contains(&ior) {
            return ior;
        }
        self.used.warnings.tally(
            "indices of refraction (Ni) out of range, taken as 1.5",
            1,
            &self.site.place,
        );
        GLASS
    }
}

/// Returns the roughness of a Phong exponent: GGX alpha is sqrt(2 / (exponent + 2)), at which both
/// distributions of facets have the same peak (Walter and others, "Microfacet Models for Refraction
/// through Rough Surfaces", 2007).
fn roughness(exponent: f64) -> f64 {
    (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt()
}

/// Returns the index of refraction whose reflectance at normal incidence is `factor` times that of
/// `ior`.
fn scaled_ior(ior: f64, factor: f64) -> f64 {
    if factor == 1.0 {
        return ior; // without rounding
    }
    let amplitude = (((ior - 1.0) / (ior + 1.0)) * factor.sqrt()).min(999.0 / 1001.0);
    (1.0 + amplitude) / (1.0 - amplitude)
}
