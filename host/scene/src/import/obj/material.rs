//! Converts MTL materials to those of the description.

use super::super::budget::Budget;
use super::super::files::{Files, readable};
use super::super::images::{Curve, Images};
use super::super::source_location::{SourceLocation, shown};
use super::super::warnings::Warnings;
use super::library::{Entry, Libraries, Map};
use crate::description::{
    Alpha, Conductor, Description, Dielectric, Filter, Lambertian, Material, MetallicRoughness, Surface,
    TextureUse, Wrap,
};
use crate::error::SceneError;
use crate::values::MAX_MAGNITUDE;
use glam::{DAffine2, DVec2, DVec3};
use std::borrow::Cow;
use std::collections::HashMap;

/// Default albedo, and that of faces without a material.
const GREY: f64 = 0.8;
/// Default index of refraction, that of glass.
const GLASS: f64 = 1.5;

/// Materials in use, and the libraries that they come from.
#[derive(Debug)]
pub struct Materials {
    libraries: Libraries,
    index: HashMap<String, usize>,
}

/// Destination of materials and images, and source of image files.
pub struct Used<'a> {
    pub description: &'a mut Description,
    pub images: &'a mut Images,
    pub files: &'a mut dyn Files,
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
        Self { libraries, index: HashMap::new() }
    }

    /// Returns the index of the material `name` in the description, and adds it at its first use;
    /// "" stands for no material.
    pub fn get(
        &mut self,
        name: &str,
        used: &mut Used,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<usize, SceneError> {
        if let Some(&index) = self.index.get(name) {
            return Ok(index);
        }
        let material = match self.libraries.entries.get(name) {
            Some(entry) => material(name, entry, used, budget, warnings)?,
            None if name.is_empty() => grey("default"),
            None => {
                warnings.tally(
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

fn material(
    name: &str,
    entry: &Entry,
    used: &mut Used,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Material, SceneError> {
    let site = SourceLocation::new(&entry.file, format!("line {}, newmtl {}", entry.line, shown(name)));
    let mut share = |value: DVec3| {
        let clamped = value.clamp(DVec3::ZERO, DVec3::ONE);
        warnings.tally("material factors outside 0 to 1, clamped", u64::from(clamped != value), &site.place);
        clamped
    };
    let default = if entry.diffuse_map.is_some() { 1.0 } else { GREY };
    let diffuse = share(entry.diffuse.unwrap_or(DVec3::splat(default)));
    let dissolve =
        entry.dissolve.or(entry.transparency.map(|transparency| 1.0 - transparency)).unwrap_or(1.0);
    let [roughness, metallic, dissolve] =
        share(DVec3::new(entry.roughness.unwrap_or(1.0), entry.metallic.unwrap_or(0.0), dissolve)).to_array();
    let specular = share(entry.specular.unwrap_or(DVec3::ZERO));

    // `map_Kd` multiplies `Kd`, which glass and metal that reflects `Ks` do not use.
    let mut diffuse_map = || match &entry.diffuse_map {
        Some(map) => texture(map, used, budget, &site.member("map_Kd")).map(Some),
        None => Ok(None),
    };
    let model = entry.illumination.map(|number| number as i64);
    let filtered = entry.filter.is_some() && entry.ior.is_some() && dissolve < 1.0;
    let mirror = entry.exponent.filter(|_| matches!(model, Some(3 | 5)) && specular != DVec3::ZERO);
    let surface = if entry.roughness.or(entry.metallic).is_some() {
        let ior = ior(entry.ior, 1.0, &site, warnings);
        let (base_color, texture) = (diffuse, diffuse_map()?);
        MetallicRoughness { base_color, texture, metallic, roughness, ior, ..Default::default() }.into()
    } else if matches!(model, Some(4 | 6 | 7)) || filtered {
        if entry.filter.is_some_and(|filter| filter != DVec3::ONE) {
            warnings.once("coloured glass (Tf) is not supported: glass is clear");
        }
        Dielectric { ior: ior(entry.ior, 1e-3, &site, warnings) }.into()
    } else if let Some(exponent) = mirror {
        let roughness = (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt();
        Conductor::schlick(specular, roughness).into()
    } else {
        warnings.tally(
            "diffuse materials whose highlights (Ks, Ns) are not rendered; Pr and Pm in the MTL file make them glossy",
            u64::from(specular != DVec3::ZERO),
            &site.place,
        );
        Lambertian { albedo: diffuse, texture: diffuse_map()? }.into()
    };
    let mut material = two_sided(&shown(name), surface);
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
        return Err(site.malformed(problem, "emission must be 0 or more and at most 1e18"));
    }
    if let Some(map) = entry.emission_map.as_ref().filter(|_| material.emission != DVec3::ZERO) {
        material.emission_texture = Some(texture(map, used, budget, &site.member("map_Ke"))?);
    }
    Ok(material)
}

/// Returns the index of refraction if it is from `least` to 1000, else 1.5, with a warning.
fn ior(ior: Option<f64>, least: f64, site: &SourceLocation, warnings: &mut Warnings) -> f64 {
    let ior = ior.unwrap_or(GLASS);
    if (least..=1000.0).contains(&ior) {
        return ior;
    }
    warnings.tally("indices of refraction (Ni) out of range, taken as 1.5", 1, &site.place);
    GLASS
}

fn texture(
    map: &Map,
    used: &mut Used,
    budget: &mut Budget,
    site: &SourceLocation,
) -> Result<TextureUse, SceneError> {
    let image = used.images.get(&map.path, Curve::Srgb, site, || {
        let bytes =
            used.files.read(&map.path, readable()).map_err(|source| site.resource(&map.path, source))?;
        budget.extend(bytes.len());
        Ok(Cow::Owned(bytes))
    })?;
    // MTL scales and moves images with v upwards from the bottom.
    let offset = DVec2::new(map.offset.x, 1.0 - map.scale.y - map.offset.y);
    let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
    let transform = DAffine2::from_scale_angle_translation(map.scale, 0.0, offset);
    Ok(TextureUse { image, wrap: [wrap; 2], filter: Filter::Linear, transform, second_uvs: false })
}
