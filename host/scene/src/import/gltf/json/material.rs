//! Materials, and their extensions.

use super::defaults::{film, glass, one, opaque_white, thick, thin, white};
use super::{NormalTexture, TextureInfo};
use serde::Deserialize;
use serde::de::IgnoredAny;

objects! {
    Material {
        name: Option<Box<str>>,
        pbr_metallic_roughness: Option<Box<MetallicRoughness>>,
        normal_texture: Option<Box<NormalTexture>>,
        occlusion_texture: Option<IgnoredAny>,
        emissive_texture: Option<Box<TextureInfo>>,
        #[serde(default)] emissive_factor: [f64; 3],
        alpha_mode: Option<Box<str>>,
        alpha_cutoff: Option<f64>,
        #[serde(default)] double_sided: bool,
        #[serde(default)] extensions: Option<Box<MaterialExtensions>>,
    }
    MetallicRoughness {
        #[serde(default = "opaque_white")] base_color_factor: [f64; 4],
        base_color_texture: Option<Box<TextureInfo>>,
        #[serde(default = "one")] metallic_factor: f64,
        #[serde(default = "one")] roughness_factor: f64,
        metallic_roughness_texture: Option<Box<TextureInfo>>,
    }
    #[derive(Default)]
    MaterialExtensions {
        #[serde(rename = "KHR_materials_emissive_strength")] emissive_strength: Option<EmissiveStrength>,
        #[serde(rename = "KHR_materials_ior")] ior: Option<Ior>,
        #[serde(rename = "KHR_materials_transmission")] transmission: Option<Transmission>,
        #[serde(rename = "KHR_materials_clearcoat")] clearcoat: Option<Clearcoat>,
        #[serde(rename = "KHR_materials_sheen")] sheen: Option<Sheen>,
        #[serde(rename = "KHR_materials_specular")] specular: Option<Specular>,
        #[serde(rename = "KHR_materials_anisotropy")] anisotropy: Option<Anisotropy>,
        #[serde(rename = "KHR_materials_iridescence")] iridescence: Option<Iridescence>,
        #[serde(rename = "KHR_materials_diffuse_transmission")] diffuse_transmission: Option<DiffuseTransmission>,
        #[serde(rename = "KHR_materials_volume")] volume: Option<Volume>,
        #[serde(rename = "KHR_materials_dispersion")] dispersion: Option<Dispersion>,
        #[serde(rename = "KHR_materials_unlit")] unlit: Option<IgnoredAny>,
        #[serde(rename = "KHR_materials_pbrSpecularGlossiness")] specular_glossiness: Option<SpecularGlossiness>,
    }
    Clearcoat {
        #[serde(default)] clearcoat_factor: f64,
        clearcoat_texture: Option<Box<TextureInfo>>,
        #[serde(default)] clearcoat_roughness_factor: f64,
        clearcoat_roughness_texture: Option<Box<TextureInfo>>,
        clearcoat_normal_texture: Option<Box<NormalTexture>>,
    }
    Sheen {
        #[serde(default)] sheen_color_factor: [f64; 3],
        sheen_color_texture: Option<Box<TextureInfo>>,
        #[serde(default)] sheen_roughness_factor: f64,
        sheen_roughness_texture: Option<Box<TextureInfo>>,
    }
    Specular {
        #[serde(default = "one")] specular_factor: f64,
        specular_texture: Option<Box<TextureInfo>>,
        #[serde(default = "white")] specular_color_factor: [f64; 3],
        specular_color_texture: Option<Box<TextureInfo>>,
    }
    Anisotropy {
        #[serde(default)] anisotropy_strength: f64,
        #[serde(default)] anisotropy_rotation: f64,
        anisotropy_texture: Option<Box<TextureInfo>>,
    }
    Iridescence {
        #[serde(default)] iridescence_factor: f64,
        iridescence_texture: Option<Box<TextureInfo>>,
        #[serde(default = "film")] iridescence_ior: f64,
        #[serde(default = "thin")] iridescence_thickness_minimum: f64,
        #[serde(default = "thick")] iridescence_thickness_maximum: f64,
        iridescence_thickness_texture: Option<Box<TextureInfo>>,
    }
    DiffuseTransmission {
        #[serde(default)] diffuse_transmission_factor: f64,
        diffuse_transmission_texture: Option<Box<TextureInfo>>,
        #[serde(default = "white")] diffuse_transmission_color_factor: [f64; 3],
        diffuse_transmission_color_texture: Option<Box<TextureInfo>>,
    }
    Volume {
        #[serde(default)] thickness_factor: f64,
        attenuation_distance: Option<f64>,
        #[serde(default = "white")] attenuation_color: [f64; 3],
    }
    Dispersion {
        #[serde(default)] dispersion: f64,
    }
    SpecularGlossiness {
        #[serde(default = "opaque_white")] diffuse_factor: [f64; 4],
        diffuse_texture: Option<Box<TextureInfo>>,
        #[serde(default = "white")] specular_factor: [f64; 3],
        #[serde(default = "one")] glossiness_factor: f64,
        specular_glossiness_texture: Option<Box<TextureInfo>>,
    }
    EmissiveStrength {
        #[serde(default = "one")] emissive_strength: f64,
    }
    Ior {
        #[serde(default = "glass")] ior: f64,
    }
    Transmission {
        #[serde(default)] transmission_factor: f64,
        transmission_texture: Option<Box<TextureInfo>>,
    }
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        Self {
            base_color_factor: opaque_white(),
            base_color_texture: None,
            metallic_factor: one(),
            roughness_factor: one(),
            metallic_roughness_texture: None,
        }
    }
}
