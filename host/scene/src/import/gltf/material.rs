//! Reads the materials that glTF primitives use.

use super::super::images::Curve;
use super::super::source_location::{SourceLocation, shown};
use super::json::{self, MetallicRoughness, Primitive};
use super::layers;
use super::slots::{Slots, share};
use super::{Document, Output};
use crate::description::{self, Alpha, Lambertian, Material};
use crate::error::SceneError;
use crate::import::ModelOptions;
use crate::material::layers::Layers;
use crate::values::MAX_MAGNITUDE;
use glam::{DVec3, DVec4};
use std::collections::HashMap;

/// Indices of refraction that are used as they are.
const IOR: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Materials in use, by their index in the document; `None` is the material of primitives that name
/// none.
#[derive(Debug)]
pub struct Materials {
    known: HashMap<Option<u32>, Known>,
    /// Index of the variant that is drawn.
    variant: Option<u32>,
}

/// A material of the description.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Index into the description's materials.
    pub index: usize,
    /// Sets of texture coordinates that the textures use, first and second.
    pub sets: [Option<u32>; 2],
    /// True if it needs the tangents of its mesh.
    pub is_mapped: bool,
}

impl Materials {
    /// Returns the materials of the document in the variant that `options` name, before any is
    /// read.
    ///
    /// # Errors
    ///
    /// [`SceneError::Malformed`] for a variant that does not exist
    pub fn of(document: &Document, output: &mut Output, options: &ModelOptions) -> Result<Self, SceneError> {
        let variants = document.root.extensions.variants.as_ref();
        let names: Vec<_> =
            variants.map_or(&[][..], |list| &list.variants).iter().map(|of| &*of.name).collect();
        let list = || {
            let first = names.iter().take(8).map(|name| format!("\"{}\"", shown(name)));
            first.collect::<Vec<_>>().join(", ") + if names.len() > 8 { ", …" } else { "" }
        };
        let variant = match &options.variant {
            None => {
                if !names.is_empty() {
                    output.notes.push(format!("drawn without a variant of the materials; it has {}", list()));
                }
                None
            }
            Some(wanted) => {
                let found =
                    names.iter().position(|name| name == wanted).and_then(|at| u32::try_from(at).ok());
                let has = if names.is_empty() { "none".to_owned() } else { list() };
                let site = document.site("extensions.KHR_materials_variants");
                let problem = || format!("there is no variant \"{}\" of the materials", shown(wanted));
                Some(found.ok_or_else(|| site.malformed(problem(), format!("it has {has}")))?)
            }
        };
        Ok(Self { known: HashMap::new(), variant })
    }

    /// Returns the material of a primitive in the variant that is drawn.
    pub fn of_primitive(
        &mut self,
        document: &Document,
        output: &mut Output,
        primitive: &Primitive,
        site: &SourceLocation,
    ) -> Result<Known, SceneError> {
        let mappings = primitive.extensions.as_deref().and_then(|of| of.variants.as_ref());
        let of_variant = self.variant.and_then(|variant| {
            let mapping = mappings?.mappings.iter().find(|of| of.variants.contains(&variant))?;
            Some(mapping.material)
        });
        self.get(document, output, of_variant.or(primitive.material), site)
    }

    /// Returns the material that a primitive names, and adds it to the description at its first
    /// use.
    fn get(
        &mut self,
        document: &Document,
        output: &mut Output,
        index: Option<u32>,
        user: &SourceLocation,
    ) -> Result<Known, SceneError> {
        if let Some(known) = self.known.get(&index) {
            return Ok(*known);
        }
        let (material, sets) = match index {
            None => (plain("default"), [None; 2]),
            Some(index) => read(document, output, index, user)?,
        };
        let is_mapped = material.needs_tangents();
        output.description.materials.push(material);
        let known = Known { index: output.description.materials.len() - 1, sets, is_mapped };
        self.known.insert(index, known);
        Ok(known)
    }
}

/// Returns a material with the specification's defaults.
fn plain(name: &str) -> Material {
    let MetallicRoughness {
        base_color_factor: [r, g, b, opacity], metallic_factor, roughness_factor, ..
    } = MetallicRoughness::default();
    let surface = description::MetallicRoughness {
        base_color: DVec3::new(r, g, b),
        metallic: metallic_factor,
        roughness: roughness_factor,
        ior: json::glass(),
        ..Default::default()
    };
    Material { opacity, ..Material::from(surface) }.named(name)
}

/// Reads a material, and the sets of texture coordinates that its textures use, first and second.
fn read(
    document: &Document,
    output: &mut Output,
    index: u32,
    user: &SourceLocation,
) -> Result<(Material, [Option<u32>; 2]), SceneError> {
    let source = super::buffers::get(&document.root.materials, index, "materials", user)?;
    let site = document.site(format!("materials[{index}]"));
    let name = source.name.as_deref().map_or_else(|| site.place.clone(), shown);

    let mut slots = Slots { document, site: &site, sets: [None; 2], others: 0 };
    let defaults = MetallicRoughness::default();
    let pbr = source.pbr_metallic_roughness.as_deref().unwrap_or(&defaults);
    let [base, emissive, rough, transmitted] = [
        "pbrMetallicRoughness.baseColorTexture",
        "emissiveTexture",
        "pbrMetallicRoughness.metallicRoughnessTexture",
        "extensions.KHR_materials_transmission.transmissionTexture",
    ];
    let base_color_texture = slots.texture(output, pbr.base_color_texture.as_deref(), Curve::Srgb, base)?;
    let metallic_roughness_texture =
        slots.texture(output, pbr.metallic_roughness_texture.as_deref(), Curve::Linear, rough)?;

    let extensions = source.extensions.as_deref();
    let strength = extensions.and_then(|extensions| extensions.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |extension| extension.emissive_strength);
    let emission = DVec3::from(source.emissive_factor) * strength;
    if !emission.cmple(DVec3::splat(MAX_MAGNITUDE)).all() || !emission.cmpge(DVec3::ZERO).all() {
        return Err(
            site.malformed(format!("it emits {emission}"), "emission must be 0 or more and at most 1e18")
        );
    }
    let emission_texture = if emission == DVec3::ZERO {
        None // without emission, its texture has no effect
    } else {
        slots.texture(output, source.emissive_texture.as_deref(), Curve::Srgb, emissive)?
    };
    let transmission = extensions.and_then(|extensions| extensions.transmission.as_ref());
    let transmission_texture = match transmission {
        Some(extension) if extension.transmission_factor > 0.0 => {
            slots.texture(output, extension.transmission_texture.as_deref(), Curve::Linear, transmitted)?
        }
        _ => None,
    };

    let layers = match extensions {
        Some(extensions) => Some(layers::read(&mut slots, output, extensions)?),
        None => None,
    };
    let glossy = match extensions.and_then(|extensions| extensions.specular_glossiness.as_ref()) {
        Some(extension) => Some(layers::glossy(&mut slots, output, extension)?),
        None => None,
    };
    let (normal_texture, normal_scale) =
        slots.normal_map(output, source.normal_texture.as_deref(), "normalTexture")?;
    output.warnings.tally(
        "textures beyond a material's first two sets of texture coordinates, read with the first",
        slots.others,
        &site.place,
    );
    let Output { warnings, .. } = output;
    let factor = share(DVec4::from(pbr.base_color_factor), &site, warnings);
    let [metallic, roughness, transmission, _] = share(
        DVec4::new(
            pbr.metallic_factor,
            pbr.roughness_factor,
            transmission.map_or(0.0, |extension| extension.transmission_factor),
            0.0,
        ),
        &site,
        warnings,
    )
    .to_array();
    let alpha = match source.alpha_mode.as_deref() {
        None | Some("OPAQUE") => Alpha::Opaque,
        Some("MASK") => {
            let cutoff = DVec4::splat(source.alpha_cutoff.unwrap_or(0.5));
            Alpha::Mask { cutoff: share(cutoff, &site, warnings).x }
        }
        Some("BLEND") => Alpha::Blend,
        Some(other) => {
            let problem = format!("alphaMode is \"{}\"", shown(other));
            return Err(site.malformed(problem, "it must be OPAQUE, MASK or BLEND"));
        }
    };
    let ior = extensions.and_then(|extensions| extensions.ior.as_ref()).map(|extension| extension.ior);
    let ior = match ior {
        // The specification's value for a boundary that reflects what the specular colour says.
        Some(0.0) if extensions.is_some_and(|extensions| extensions.specular.is_some()) => 0.0,
        Some(ior) if !IOR.contains(&ior) => {
            warnings.tally("indices of refraction outside 1 to 1000, taken as 1.5", 1, &site.place);
            json::glass()
        }
        ior => ior.unwrap_or(json::glass()),
    };
    let mut surface = description::MetallicRoughness {
        base_color: factor.truncate(),
        texture: base_color_texture,
        metallic,
        roughness,
        metallic_roughness_texture,
        ior,
        transmission,
        transmission_texture,
        layers: layers.unwrap_or_default(),
    };
    let mut opacity = factor.w;
    if let Some(old) = glossy {
        opacity = old.opacity;
        let transmitted = (surface.transmission, surface.transmission_texture);
        let layers = Layers { specular: old.surface.layers.specular, has_glossiness: true, ..surface.layers };
        surface = description::MetallicRoughness { layers, ..old.surface };
        (surface.transmission, surface.transmission_texture) = transmitted;
    }
    let mut material = Material {
        name,
        surface: surface.into(),
        emission,
        emission_texture,
        emits_both_sides: source.double_sided,
        opacity,
        alpha,
        normal_texture,
        normal_scale,
        medium: None,
        is_unlit: false,
    };
    if extensions.is_some_and(|extensions| extensions.unlit.is_some()) {
        unlit(&mut material);
    }
    Ok((material, slots.sets))
}

/// Makes a material show its base colour whatever the light. It emits to both sides and reflects
/// nothing.
fn unlit(material: &mut Material) {
    let description::Surface::MetallicRoughness(surface) = &material.surface else { return };
    material.emission = surface.base_color;
    material.emission_texture = surface.texture.clone();
    // Its alpha still multiplies the opacity.
    material.surface = Lambertian { albedo: DVec3::ZERO, texture: surface.texture.clone() }.into();
    (material.emits_both_sides, material.is_unlit) = (true, true);
    material.normal_texture = None;
}
