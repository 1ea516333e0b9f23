//! Reads the extensions of glTF materials that add layers and lobes.

use super::super::images::Curve;
use super::Output;
use super::json::{
    Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, MaterialExtensions, Sheen, Specular,
    SpecularGlossiness, TextureInfo, Volume,
};
use super::slots::{Slots, share};
use crate::description::{MetallicRoughness, TextureUse};
use crate::error::SceneError;
use crate::material::layers::{self, Layers};
use crate::values::{Dispersion, FilmIor, Gain, Length, Thickness};
use glam::{DVec3, DVec4};

/// Reads the layers of a material.
pub fn read(
    slots: &mut Slots,
    output: &mut Output,
    extensions: &MaterialExtensions,
) -> Result<Layers, SceneError> {
    let mut found = Layers::default();
    if let Some(extension) = &extensions.clearcoat {
        found.coat = coat(slots, output, extension)?;
    }
    if let Some(extension) = &extensions.sheen {
        found.sheen = sheen(slots, output, extension)?;
    }
    if let Some(extension) = &extensions.specular {
        found.specular = Some(specular(slots, output, extension)?);
    }
    if let Some(extension) = &extensions.anisotropy {
        found.anisotropy = anisotropy(slots, output, extension)?;
    }
    if let Some(extension) = &extensions.iridescence {
        found.iridescence = iridescence(slots, output, extension)?;
    }
    if let Some(extension) = &extensions.diffuse_transmission {
        found.diffuse_transmission = diffuse_transmission(slots, output, extension)?;
    }
    // A thickness of 0 is a thin wall. Its texture is for renderers that do not trace the inside.
    if let Some(extension) = extensions.volume.as_ref().filter(|volume| volume.thickness_factor > 0.0) {
        found.volume = Some(volume(slots, output, extension));
    }
    if let Some(extension) = &extensions.dispersion {
        found.dispersion = number::<Dispersion>(slots, output, extension.dispersion, 0.0);
    }
    Ok(found)
}

/// Surface and opacity of KHR_materials_pbrSpecularGlossiness.
pub struct Glossy {
    pub surface: MetallicRoughness,
    pub opacity: f64,
}

/// Reads a material of KHR_materials_pbrSpecularGlossiness: a dielectric whose reflectance at
/// normal incidence is the specular colour.
pub fn glossy(
    slots: &mut Slots,
    output: &mut Output,
    extension: &SpecularGlossiness,
) -> Result<Glossy, SceneError> {
    const PLACE: &str = "extensions.KHR_materials_pbrSpecularGlossiness";
    let texture = extension.diffuse_texture.as_deref();
    let texture = slots.texture(output, texture, Curve::Srgb, &format!("{PLACE}.diffuseTexture"))?;
    let info = extension.specular_glossiness_texture.as_deref();
    let place = format!("{PLACE}.specularGlossinessTexture");
    let color_texture = slots.texture(output, info, Curve::Srgb, &place)?;
    let diffuse = share(DVec4::from(extension.diffuse_factor), slots.site, &mut output.warnings);
    let [red, green, blue] = extension.specular_factor;
    let specular = DVec4::new(red, green, blue, extension.glossiness_factor);
    let specular = share(specular, slots.site, &mut output.warnings);
    let layers = Layers {
        specular: Some(layers::Specular { color: specular.truncate(), color_texture, ..Default::default() }),
        has_glossiness: true,
        ..Layers::default()
    };
    let surface = MetallicRoughness {
        base_color: diffuse.truncate(),
        texture,
        metallic: 0.0,
        roughness: 1.0 - specular.w,
        // Index 0: the boundary reflects what the specular colour says.
        ior: 0.0,
        layers,
        ..Default::default()
    };
    Ok(Glossy { surface, opacity: diffuse.w })
}

fn coat(
    slots: &mut Slots,
    output: &mut Output,
    extension: &Clearcoat,
) -> Result<Option<layers::Coat>, SceneError> {
    if extension.clearcoat_factor <= 0.0 {
        return Ok(None);
    }
    let texture =
        numbers(slots, output, extension.clearcoat_texture.as_deref(), "clearcoat.clearcoatTexture")?;
    let roughness_texture = numbers(
        slots,
        output,
        extension.clearcoat_roughness_texture.as_deref(),
        "clearcoat.clearcoatRoughnessTexture",
    )?;
    let (normal_texture, normal_scale) = slots.normal_map(
        output,
        extension.clearcoat_normal_texture.as_deref(),
        "extensions.KHR_materials_clearcoat.clearcoatNormalTexture",
    )?;
    let [strength, roughness] =
        shares(slots, output, [extension.clearcoat_factor, extension.clearcoat_roughness_factor]);
    Ok(Some(layers::Coat { strength, roughness, texture, roughness_texture, normal_texture, normal_scale }))
}

fn sheen(
    slots: &mut Slots,
    output: &mut Output,
    extension: &Sheen,
) -> Result<Option<layers::Sheen>, SceneError> {
    let [red, green, blue] = extension.sheen_color_factor;
    if DVec3::new(red, green, blue).max_element() <= 0.0 {
        return Ok(None);
    }
    let texture = colors(slots, output, extension.sheen_color_texture.as_deref(), "sheen.sheenColorTexture")?;
    let info = extension.sheen_roughness_texture.as_deref();
    let roughness_texture = numbers(slots, output, info, "sheen.sheenRoughnessTexture")?;
    let [red, green, blue, roughness] =
        shares(slots, output, [red, green, blue, extension.sheen_roughness_factor]);
    let color = DVec3::new(red, green, blue);
    Ok(Some(layers::Sheen { color, roughness, texture, roughness_texture }))
}

fn specular(
    slots: &mut Slots,
    output: &mut Output,
    extension: &Specular,
) -> Result<layers::Specular, SceneError> {
    let texture = numbers(slots, output, extension.specular_texture.as_deref(), "specular.specularTexture")?;
    let info = extension.specular_color_texture.as_deref();
    let color_texture = colors(slots, output, info, "specular.specularColorTexture")?;
    let [strength] = shares(slots, output, [extension.specular_factor]);
    let color = extension.specular_color_factor.map(|channel| number::<Gain>(slots, output, channel, 1.0));
    Ok(layers::Specular { strength, color: color.into(), texture, color_texture })
}

fn anisotropy(
    slots: &mut Slots,
    output: &mut Output,
    extension: &Anisotropy,
) -> Result<Option<layers::Anisotropy>, SceneError> {
    if extension.anisotropy_strength <= 0.0 {
        return Ok(None);
    }
    let texture =
        numbers(slots, output, extension.anisotropy_texture.as_deref(), "anisotropy.anisotropyTexture")?;
    let [strength] = shares(slots, output, [extension.anisotropy_strength]);
    let rotation = extension.anisotropy_rotation.to_degrees().rem_euclid(360.0);
    let rotation = if rotation.is_finite() { rotation } else { 0.0 };
    Ok(Some(layers::Anisotropy { strength, rotation, texture }))
}

fn iridescence(
    slots: &mut Slots,
    output: &mut Output,
    extension: &Iridescence,
) -> Result<Option<layers::Iridescence>, SceneError> {
    if extension.iridescence_factor <= 0.0 {
        return Ok(None);
    }
    let texture =
        numbers(slots, output, extension.iridescence_texture.as_deref(), "iridescence.iridescenceTexture")?;
    let info = extension.iridescence_thickness_texture.as_deref();
    let thickness_texture = numbers(slots, output, info, "iridescence.iridescenceThicknessTexture")?;
    let [strength] = shares(slots, output, [extension.iridescence_factor]);
    Ok(Some(layers::Iridescence {
        strength,
        ior: number::<FilmIor>(slots, output, extension.iridescence_ior, 1.3),
        thickness_min: number::<Thickness>(slots, output, extension.iridescence_thickness_minimum, 100.0),
        thickness: number::<Thickness>(slots, output, extension.iridescence_thickness_maximum, 400.0),
        texture,
        thickness_texture,
    }))
}

fn diffuse_transmission(
    slots: &mut Slots,
    output: &mut Output,
    extension: &DiffuseTransmission,
) -> Result<Option<layers::DiffuseTransmission>, SceneError> {
    if extension.diffuse_transmission_factor <= 0.0 {
        return Ok(None);
    }
    let info = extension.diffuse_transmission_texture.as_deref();
    let texture = numbers(slots, output, info, "diffuse_transmission.diffuseTransmissionTexture")?;
    let info = extension.diffuse_transmission_color_texture.as_deref();
    let color_texture = colors(slots, output, info, "diffuse_transmission.diffuseTransmissionColorTexture")?;
    let [red, green, blue] = extension.diffuse_transmission_color_factor;
    let [share, red, green, blue] =
        shares(slots, output, [extension.diffuse_transmission_factor, red, green, blue]);
    Ok(Some(layers::DiffuseTransmission {
        share,
        color: DVec3::new(red, green, blue),
        texture,
        color_texture,
    }))
}

fn volume(slots: &Slots, output: &mut Output, extension: &Volume) -> layers::Volume {
    let [red, green, blue] = shares(slots, output, extension.attenuation_color);
    // Without a distance, and with one that is not positive, nothing is absorbed.
    let attenuation_distance =
        extension.attenuation_distance.filter(|distance| Length::try_from(*distance).is_ok());
    layers::Volume { attenuation_color: DVec3::new(red, green, blue), attenuation_distance }
}

/// Reads a texture of numbers at a place of the extension.
fn numbers(
    slots: &mut Slots,
    output: &mut Output,
    info: Option<&TextureInfo>,
    place: &str,
) -> Result<Option<TextureUse>, SceneError> {
    slots.texture(output, info, Curve::Linear, &format!("extensions.KHR_materials_{place}"))
}

/// Reads a texture of colours at a place of the extension.
fn colors(
    slots: &mut Slots,
    output: &mut Output,
    info: Option<&TextureInfo>,
    place: &str,
) -> Result<Option<TextureUse>, SceneError> {
    slots.texture(output, info, Curve::Srgb, &format!("extensions.KHR_materials_{place}"))
}

/// Clamps up to four factors to 0 to 1, with a warning if one changes.
fn shares<const N: usize>(slots: &Slots, output: &mut Output, factors: [f64; N]) -> [f64; N] {
    let all = std::array::from_fn(|place| factors.get(place).copied().unwrap_or(0.0));
    let clamped = share(DVec4::from_array(all), slots.site, &mut output.warnings).to_array();
    std::array::from_fn(|place| clamped.get(place).copied().unwrap_or(0.0))
}

/// Returns a number of a range, or `otherwise`, with a warning.
fn number<T: TryFrom<f64>>(slots: &Slots, output: &mut Output, number: f64, otherwise: f64) -> f64 {
    if T::try_from(number).is_ok() {
        return number;
    }
    let what = "numbers of material extensions out of range, replaced by the default";
    output.warnings.tally(what, 1, &slots.site.place);
    otherwise
}
