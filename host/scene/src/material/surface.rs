//! Surfaces: how materials scatter light. Scene files, importers and programs that build scenes
//! give these types; `Surface::fill` in `record` makes device records of them.

use super::layers::Layers;
use crate::ranges::{all, each};
pub use crate::texture::TextureRole;
use crate::texture::TextureUse;
use crate::values::{Absorption, Eta, Ior, Share, number, numbers, some};
use glam::DVec3;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use trisect_shared::microfacet::MIN_ROUGH_ALPHA;

/// Scattering model of a material. `T` refers to a texture: by its name in a scene file.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a scene has few materials, which are made once")]
pub enum Surface<T = TextureUse> {
    /// Diffuse reflection.
    Lambertian(Lambertian<T>),
    /// The metal of "Ray Tracing in One Weekend" (the book).
    Metal(Metal),
    /// Smooth clear glass.
    Dielectric(Dielectric),
    /// Clear glass with a rough boundary (GGX).
    RoughDielectric(RoughDielectric),
    /// A rough metal (GGX).
    Conductor(Conductor),
    /// glTF's metallic-roughness material.
    MetallicRoughness(MetallicRoughness<T>),
    /// Boundary of a medium alone: light passes straight through.
    Interface(Interface),
}

/// Boundary of a medium that light passes straight through: its medium has the index of refraction
/// of what is outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interface {}

/// Diffuse reflection.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, bound = "T: Deserialize<'de>")]
pub struct Lambertian<T = TextureUse> {
    /// Reflected fraction by channel, 0 to 1.
    #[serde(deserialize_with = "numbers::<Share, _>")]
    pub albedo: DVec3,
    /// Texture that multiplies `albedo`; its alpha multiplies the material's opacity.
    #[serde(default = "Option::default", deserialize_with = "some")]
    pub texture: Option<T>,
}

/// Metal of "Ray Tracing in One Weekend": a blurred mirror.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metal {
    /// Reflected fraction by channel, 0 to 1.
    #[serde(deserialize_with = "numbers::<Share, _>")]
    pub albedo: DVec3,
    /// Radius of the ball of random offsets to the mirrored direction, 0 to 1.
    #[serde(default, deserialize_with = "number::<Share, _>")]
    pub fuzz: f64,
}

/// Smooth clear glass.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dielectric {
    /// Index of refraction inside, relative to outside.
    #[serde(deserialize_with = "number::<Ior, _>")]
    pub ior: f64,
}

/// Clear glass with a rough boundary (GGX).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoughDielectric {
    /// Index of refraction inside, relative to outside.
    #[serde(deserialize_with = "number::<Ior, _>")]
    pub ior: f64,
    /// Roughness, 0 to 1; GGX alpha is its square.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub roughness: f64,
    /// True if light that a facet sends to others comes out again; false for the model of renderers
    /// that lose it.
    #[serde(default = "yes")]
    pub multiple_scattering: bool,
}

/// A rough metal (GGX).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conductor {
    /// Fresnel reflectance.
    pub fresnel: ConductorFresnel,
    /// Roughness, 0 to 1; GGX alpha is its square.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub roughness: f64,
    /// True if light that a facet sends to others comes out again; false for the model of renderers
    /// that lose it.
    #[serde(default = "yes")]
    pub multiple_scattering: bool,
}

fn yes() -> bool {
    true
}

/// A conductor's reflectance.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ConductorFresnel {
    /// Fresnel's equations for a complex index of refraction, eta + i k, by channel.
    Ior {
        /// Real part of the index, relative to outside.
        #[serde(deserialize_with = "numbers::<Eta, _>")]
        eta: DVec3,
        /// Imaginary part of the index (absorption).
        #[serde(deserialize_with = "numbers::<Absorption, _>")]
        k: DVec3,
    },
    /// Schlick's approximation.
    Schlick {
        /// Reflectance at normal incidence by channel, 0 to 1.
        #[serde(deserialize_with = "numbers::<Share, _>")]
        reflectance: DVec3,
    },
}

/// glTF's metallic-roughness material.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct MetallicRoughness<T = TextureUse> {
    /// Diffuse colour of a dielectric, reflectance of a metal, by channel, 0 to 1.
    #[serde(deserialize_with = "numbers::<Share, _>")]
    pub base_color: DVec3,
    /// Texture that multiplies `base_color`; its alpha multiplies the material's opacity.
    #[serde(deserialize_with = "some")]
    pub texture: Option<T>,
    /// 0 for a dielectric, 1 for a metal.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub metallic: f64,
    /// Roughness, 0 to 1; GGX alpha is its square.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub roughness: f64,
    /// Texture whose green multiplies `roughness` and whose blue multiplies `metallic`.
    #[serde(deserialize_with = "some")]
    pub metallic_roughness_texture: Option<T>,
    /// Index of refraction of the dielectric's boundary.
    #[serde(deserialize_with = "number::<Ior, _>")]
    pub ior: f64,
    /// Fraction of the light that enters a dielectric and passes through its thin wall, 0 to 1.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub transmission: f64,
    /// Texture whose red multiplies `transmission`.
    #[serde(deserialize_with = "some")]
    pub transmission_texture: Option<T>,
    /// Layers and further lobes.
    pub layers: Layers<T>,
}

impl Lambertian {
    /// Returns the material with this reflected fraction.
    pub fn rgb(red: f64, green: f64, blue: f64) -> Self {
        Self { albedo: DVec3::new(red, green, blue), texture: None }
    }
}

impl RoughDielectric {
    /// Returns the glass with this index of refraction and roughness.
    pub fn new(ior: f64, roughness: f64) -> Self {
        Self { ior, roughness, multiple_scattering: true }
    }
}

impl Conductor {
    /// Returns the metal with this reflectance at normal incidence.
    pub fn schlick(reflectance: impl Into<DVec3>, roughness: f64) -> Self {
        let fresnel = ConductorFresnel::Schlick { reflectance: reflectance.into() };
        Self { fresnel, roughness, multiple_scattering: true }
    }
}

impl<T> Default for MetallicRoughness<T> {
    /// Returns glTF's default: a white rough metal.
    fn default() -> Self {
        Self {
            base_color: DVec3::ONE,
            texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            ior: 1.5,
            transmission: 0.0,
            transmission_texture: None,
            layers: Layers::default(),
        }
    }
}

impl<T> Surface<T> {
    /// Names of materials in scene files.
    pub(super) const NAMES: [&'static str; 8] = [
        "Lambertian",
        "Metal",
        "Dielectric",
        "RoughDielectric",
        "Conductor",
        "Emissive",
        "MetallicRoughness",
        "Interface",
    ];

    /// Reads the fields of the surface of this name.
    pub(super) fn read<'de, D>(name: &str, fields: D) -> Result<Self, D::Error>
    where
        D: Deserializer<'de>,
        T: Deserialize<'de>,
    {
        match name {
            "Lambertian" => Deserialize::deserialize(fields).map(Self::Lambertian),
            "Metal" => Deserialize::deserialize(fields).map(Self::Metal),
            "Dielectric" => Deserialize::deserialize(fields).map(Self::Dielectric),
            "RoughDielectric" => Deserialize::deserialize(fields).map(Self::RoughDielectric),
            "Conductor" => Deserialize::deserialize(fields).map(Self::Conductor),
            "MetallicRoughness" => Deserialize::deserialize(fields).map(Self::MetallicRoughness),
            "Interface" => Deserialize::deserialize(fields).map(Self::Interface),
            other => Err(D::Error::unknown_variant(other, &Self::NAMES)),
        }
    }

    /// Returns the textures with their roles.
    pub fn textures(&self) -> impl Iterator<Item = (&T, TextureRole)> {
        let (base, numbers) = match self {
            Self::Lambertian(lambertian) => (&lambertian.texture, [&None; 2]),
            Self::MetallicRoughness(m) => {
                (&m.texture, [&m.metallic_roughness_texture, &m.transmission_texture])
            }
            Self::Metal(_)
            | Self::Dielectric(_)
            | Self::RoughDielectric(_)
            | Self::Conductor(_)
            | Self::Interface(_) => (&None, [&None; 2]),
        };
        let numbers = numbers.into_iter().flatten().map(|texture| (texture, TextureRole::Numbers));
        let layers = match self {
            Self::MetallicRoughness(m) => Some(m.layers.textures()),
            _ => None,
        };
        let base = base.iter().map(|texture| (texture, TextureRole::Colour));
        base.chain(numbers).chain(layers.into_iter().flatten())
    }

    /// Returns the surface with each texture replaced by what `f` makes of it.
    pub(super) fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Surface<U>, E> {
        fn map<T, U, E>(texture: Option<T>, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Option<U>, E> {
            texture.map(f).transpose()
        }
        Ok(match self {
            Self::Lambertian(Lambertian { albedo, texture }) => {
                Surface::Lambertian(Lambertian { albedo, texture: map(texture, f)? })
            }
            Self::MetallicRoughness(m) => Surface::MetallicRoughness(MetallicRoughness {
                base_color: m.base_color,
                texture: map(m.texture, f)?,
                metallic: m.metallic,
                roughness: m.roughness,
                metallic_roughness_texture: map(m.metallic_roughness_texture, f)?,
                ior: m.ior,
                transmission: m.transmission,
                transmission_texture: map(m.transmission_texture, f)?,
                layers: m.layers.with_textures(f)?,
            }),
            Self::Metal(metal) => Surface::Metal(metal),
            Self::Dielectric(dielectric) => Surface::Dielectric(dielectric),
            Self::RoughDielectric(dielectric) => Surface::RoughDielectric(dielectric),
            Self::Conductor(conductor) => Surface::Conductor(conductor),
            Self::Interface(interface) => Surface::Interface(interface),
        })
    }

    /// Returns the texture slot of the surface's colour; `None` for surfaces that have none.
    pub(crate) fn base_texture_mut(&mut self) -> Option<&mut Option<T>> {
        match self {
            Self::Lambertian(lambertian) => Some(&mut lambertian.texture),
            Self::MetallicRoughness(m) => Some(&mut m.texture),
            _ => None,
        }
    }

    /// Returns the index of refraction of clear glass; `None` for other surfaces.
    pub fn glass_ior(&self) -> Option<f64> {
        match *self {
            Self::Dielectric(Dielectric { ior }) | Self::RoughDielectric(RoughDielectric { ior, .. }) => {
                Some(ior)
            }
            _ => None,
        }
    }

    /// Returns whether light passes the surface, if it is opaque.
    pub(crate) fn transmits(&self) -> bool {
        match self {
            Self::Dielectric(_) | Self::RoughDielectric(_) | Self::Interface(_) => true,
            Self::MetallicRoughness(m) => m.transmission > 0.0 || m.layers.diffuse_transmission.is_some(),
            Self::Lambertian(_) | Self::Metal(_) | Self::Conductor(_) => false,
        }
    }

    /// Returns whether the surface transmits light without scattering it, but no connection passes:
    /// layers reflect and transmit in narrow lobes, not in one direction.
    pub fn blocks_connections(&self) -> bool {
        let Self::MetallicRoughness(m) = self else { return false };
        m.transmission > 0.0
            && m.metallic < 1.0
            && is_smooth(m.roughness)
            && !m.layers.is_empty()
            && !m.is_clear_solid()
    }

    /// Checks that each number is finite and in range.
    pub(super) fn check(&self) -> Result<(), String> {
        match self {
            Self::Lambertian(Lambertian { albedo, .. }) => each::<Share>("albedo", *albedo),
            Self::Metal(Metal { albedo, fuzz }) => {
                each::<Share>("albedo", *albedo)?;
                all::<Share>("fuzz", &[*fuzz])
            }
            Self::Interface(_) => Ok(()),
            Self::Dielectric(Dielectric { ior }) => all::<Ior>("ior", &[*ior]),
            Self::RoughDielectric(RoughDielectric { ior, roughness, .. }) => {
                all::<Ior>("ior", &[*ior])?;
                all::<Share>("roughness", &[*roughness])
            }
            Self::Conductor(Conductor { fresnel, roughness, .. }) => {
                all::<Share>("roughness", &[*roughness])?;
                match fresnel {
                    ConductorFresnel::Ior { eta, k } => {
                        each::<Eta>("eta", *eta)?;
                        each::<Absorption>("k", *k)
                    }
                    ConductorFresnel::Schlick { reflectance } => each::<Share>("reflectance", *reflectance),
                }
            }
            Self::MetallicRoughness(m) => {
                each::<Share>("base_color", m.base_color)?;
                all::<Share>("metallic", &[m.metallic])?;
                all::<Share>("roughness", &[m.roughness])?;
                all::<Share>("transmission", &[m.transmission])?;
                m.layers.check()?;
                // Index 0 stands for a boundary whose reflectance is the specular colour.
                if m.ior == 0.0 && m.layers.specular.is_some() { Ok(()) } else { all::<Ior>("ior", &[m.ior]) }
            }
        }
    }
}

/// Implements the conversions of surfaces into [`Surface`].
macro_rules! surfaces {
    ($($name:ident: $type:ty),*) => {$(
        impl From<$type> for Surface {
            fn from(surface: $type) -> Self {
                Self::$name(surface)
            }
        }
    )*};
}

surfaces! {
    Lambertian: Lambertian, Metal: Metal, Dielectric: Dielectric, RoughDielectric: RoughDielectric,
    Conductor: Conductor, MetallicRoughness: MetallicRoughness, Interface: Interface
}

/// Returns whether a boundary of microfacets with this roughness is one without facets.
pub(super) fn is_smooth(roughness: f64) -> bool {
    ((roughness * roughness) as f32) < MIN_ROUGH_ALPHA
}
