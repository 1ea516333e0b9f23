//! Properties that a pointer of KHR_animation_pointer may name, in records of the document.

use super::super::json::{
    Camera, EmissiveStrength, Light, Material, MaterialExtensions, MetallicRoughness, TextureInfo,
    TextureInfoExtensions, TextureTransform,
};
use std::slice::from_mut;

/// Property that a pointer names.
pub enum Found<'a> {
    /// Numbers of a property that the importer reads.
    Numbers(&'a mut [f64]),
    /// A property that no image depends on.
    WithoutEffect,
    /// A property of a part that the file does not have.
    Absent,
    /// A property that is not read, or that does not exist.
    Unsupported,
}

impl<'a> From<Option<&'a mut [f64]>> for Found<'a> {
    fn from(numbers: Option<&'a mut [f64]>) -> Self {
        numbers.map_or(Self::Absent, Self::Numbers)
    }
}

/// Path of the members of a texture's transform, after that of the texture.
const TRANSFORM: [&str; 2] = ["extensions", "KHR_texture_transform"];

/// Returns whether the property that a pointer of these parts names may be negative.
pub fn is_signed(parts: &[&str]) -> bool {
    parts.contains(&TRANSFORM[1])
        || matches!(
            parts,
            [.., "normalTexture" | "clearcoatNormalTexture", "scale"]
                | [.., "anisotropyRotation"]
                | [.., "ymag"]
        )
}

/// Finds a property of a light.
pub fn of_light<'a>(light: &'a mut Light, path: &[&str]) -> Found<'a> {
    match path {
        ["color"] => Found::Numbers(&mut light.color),
        ["intensity"] => Found::Numbers(from_mut(&mut light.intensity)),
        // The reader of lights warns of a range.
        ["range"] => Found::Numbers(from_mut(light.range.get_or_insert(f64::INFINITY))),
        ["spot", name] => {
            let spot = light.spot.as_mut();
            match *name {
                "innerConeAngle" => spot.map(|spot| from_mut(&mut spot.inner_cone_angle)).into(),
                "outerConeAngle" => spot.map(|spot| from_mut(&mut spot.outer_cone_angle)).into(),
                _ => Found::Unsupported,
            }
        }
        _ => Found::Unsupported,
    }
}

/// Finds a property of a camera.
pub fn of_camera<'a>(camera: &'a mut Camera, path: &[&str]) -> Found<'a> {
    match path {
        ["perspective", "yfov"] => camera.perspective.as_mut().map(|of| from_mut(&mut of.yfov)).into(),
        ["orthographic", "ymag"] => camera.orthographic.as_mut().map(|of| from_mut(&mut of.ymag)).into(),
        // The aspect is the image's, and nothing is clipped.
        ["perspective", "aspectRatio" | "znear" | "zfar"] => Found::WithoutEffect,
        ["orthographic", "xmag" | "znear" | "zfar"] => Found::WithoutEffect,
        _ => Found::Unsupported,
    }
}

/// Finds a property of a material.
pub fn of_material<'a>(material: &'a mut Material, path: &[&str]) -> Found<'a> {
    if let [texture @ .., extensions, extension, name] = path
        && [*extensions, *extension] == TRANSFORM
    {
        return match texture_of(material, texture) {
            Some(Some(info)) => of_transform(info, name),
            Some(None) => Found::Absent,
            None => Found::Unsupported,
        };
    }
    match path {
        ["pbrMetallicRoughness", name] => {
            let pbr: &mut MetallicRoughness = material.pbr_metallic_roughness.get_or_insert_default();
            match *name {
                "baseColorFactor" => Found::Numbers(&mut pbr.base_color_factor),
                "metallicFactor" => Found::Numbers(from_mut(&mut pbr.metallic_factor)),
                "roughnessFactor" => Found::Numbers(from_mut(&mut pbr.roughness_factor)),
                _ => Found::Unsupported,
            }
        }
        ["alphaCutoff"] => Found::Numbers(from_mut(material.alpha_cutoff.get_or_insert(0.5))),
        ["emissiveFactor"] => Found::Numbers(&mut material.emissive_factor),
        ["normalTexture", "scale"] => {
            material.normal_texture.as_mut().map(|of| from_mut(&mut of.scale)).into()
        }
        ["extensions", _, "clearcoatNormalTexture", "scale"] => {
            let coat = material.extensions.as_mut().and_then(|of| of.clearcoat.as_mut());
            let map = coat.and_then(|of| of.clearcoat_normal_texture.as_mut());
            map.map(|of| from_mut(&mut of.scale)).into()
        }
        ["extensions", extension, name] => {
            of_extension(material.extensions.get_or_insert_default(), extension, name)
        }
        _ => Found::Unsupported,
    }
}

/// Finds a property of a material's extension.
fn of_extension<'a>(of: &'a mut MaterialExtensions, extension: &str, name: &str) -> Found<'a> {
    macro_rules! number {
        ($extension:ident.$field:ident) => {
            of.$extension.as_mut().map(|of| from_mut(&mut of.$field)).into()
        };
    }
    macro_rules! numbers {
        ($extension:ident.$field:ident) => {
            of.$extension.as_mut().map(|of| &mut of.$field[..]).into()
        };
    }
    match (extension.trim_start_matches("KHR_materials_"), name) {
        // A strength of 1 is that of a file without the extension.
        ("emissive_strength", "emissiveStrength") => {
            let strength = of.emissive_strength.get_or_insert(EmissiveStrength { emissive_strength: 1.0 });
            Found::Numbers(from_mut(&mut strength.emissive_strength))
        }
        ("ior", "ior") => number!(ior.ior),
        ("transmission", "transmissionFactor") => number!(transmission.transmission_factor),
        ("clearcoat", "clearcoatFactor") => number!(clearcoat.clearcoat_factor),
        ("clearcoat", "clearcoatRoughnessFactor") => number!(clearcoat.clearcoat_roughness_factor),
        ("sheen", "sheenColorFactor") => numbers!(sheen.sheen_color_factor),
        ("sheen", "sheenRoughnessFactor") => number!(sheen.sheen_roughness_factor),
        ("specular", "specularFactor") => number!(specular.specular_factor),
        ("specular", "specularColorFactor") => numbers!(specular.specular_color_factor),
        ("anisotropy", "anisotropyStrength") => number!(anisotropy.anisotropy_strength),
        ("anisotropy", "anisotropyRotation") => number!(anisotropy.anisotropy_rotation),
        ("iridescence", "iridescenceFactor") => number!(iridescence.iridescence_factor),
        ("iridescence", "iridescenceIor") => number!(iridescence.iridescence_ior),
        ("iridescence", "iridescenceThicknessMinimum") => number!(iridescence.iridescence_thickness_minimum),
        ("iridescence", "iridescenceThicknessMaximum") => number!(iridescence.iridescence_thickness_maximum),
        ("diffuse_transmission", "diffuseTransmissionFactor") => {
            number!(diffuse_transmission.diffuse_transmission_factor)
        }
        ("diffuse_transmission", "diffuseTransmissionColorFactor") => {
            numbers!(diffuse_transmission.diffuse_transmission_color_factor)
        }
        ("volume", "thicknessFactor") => number!(volume.thickness_factor),
        ("volume", "attenuationDistance") => {
            let volume = of.volume.as_mut();
            volume.map(|of| from_mut(of.attenuation_distance.get_or_insert(f64::INFINITY))).into()
        }
        ("volume", "attenuationColor") => numbers!(volume.attenuation_color),
        ("dispersion", "dispersion") => number!(dispersion.dispersion),
        ("pbrSpecularGlossiness", "diffuseFactor") => numbers!(specular_glossiness.diffuse_factor),
        ("pbrSpecularGlossiness", "specularFactor") => numbers!(specular_glossiness.specular_factor),
        ("pbrSpecularGlossiness", "glossinessFactor") => number!(specular_glossiness.glossiness_factor),
        _ => Found::Unsupported,
    }
}

/// Returns the texture of a material at a path: `None` for a path of no texture that is read, and
/// `Some(None)` for a texture that the material does not have.
fn texture_of<'a>(material: &'a mut Material, path: &[&str]) -> Option<Option<&'a mut TextureInfo>> {
    macro_rules! texture {
        ($extension:ident.$field:ident) => {
            material.extensions.as_mut().and_then(|of| of.$extension.as_mut()?.$field.as_deref_mut())
        };
    }
    let pbr = material.pbr_metallic_roughness.as_mut();
    Some(match path {
        ["normalTexture"] => material.normal_texture.as_mut().map(|of| &mut of.info),
        ["emissiveTexture"] => material.emissive_texture.as_deref_mut(),
        ["pbrMetallicRoughness", "baseColorTexture"] => {
            pbr.and_then(|of| of.base_color_texture.as_deref_mut())
        }
        ["pbrMetallicRoughness", "metallicRoughnessTexture"] => {
            pbr.and_then(|of| of.metallic_roughness_texture.as_deref_mut())
        }
        ["extensions", _, name] => match *name {
            "transmissionTexture" => texture!(transmission.transmission_texture),
            "clearcoatTexture" => texture!(clearcoat.clearcoat_texture),
            "clearcoatRoughnessTexture" => texture!(clearcoat.clearcoat_roughness_texture),
            "clearcoatNormalTexture" => {
                let coat = material.extensions.as_mut().and_then(|of| of.clearcoat.as_mut());
                let map = coat.and_then(|of| of.clearcoat_normal_texture.as_mut());
                map.map(|of| &mut of.info)
            }
            "diffuseTexture" => texture!(specular_glossiness.diffuse_texture),
            "specularGlossinessTexture" => texture!(specular_glossiness.specular_glossiness_texture),
            "sheenColorTexture" => texture!(sheen.sheen_color_texture),
            "sheenRoughnessTexture" => texture!(sheen.sheen_roughness_texture),
            "specularTexture" => texture!(specular.specular_texture),
            "specularColorTexture" => texture!(specular.specular_color_texture),
            "anisotropyTexture" => texture!(anisotropy.anisotropy_texture),
            "iridescenceTexture" => texture!(iridescence.iridescence_texture),
            "iridescenceThicknessTexture" => texture!(iridescence.iridescence_thickness_texture),
            "diffuseTransmissionTexture" => texture!(diffuse_transmission.diffuse_transmission_texture),
            "diffuseTransmissionColorTexture" => {
                texture!(diffuse_transmission.diffuse_transmission_color_texture)
            }
            _ => return None,
        },
        _ => return None,
    })
}

/// Finds a property of a texture's transform. A texture without one gets one that changes nothing.
fn of_transform<'a>(info: &'a mut TextureInfo, name: &str) -> Found<'a> {
    let extensions = info.extensions.get_or_insert(TextureInfoExtensions { transform: None });
    let transform = extensions.transform.get_or_insert(TextureTransform {
        offset: [0.0; 2],
        rotation: 0.0,
        scale: [1.0; 2],
        tex_coord: None,
    });
    match name {
        "offset" => Found::Numbers(&mut transform.offset),
        "rotation" => Found::Numbers(from_mut(&mut transform.rotation)),
        "scale" => Found::Numbers(&mut transform.scale),
        _ => Found::Unsupported,
    }
}
