//! Materials: how a surface scatters, what it emits, and how much of it is there.

pub mod layers;
mod read;
mod record;
pub mod surface;

pub(crate) use read::Written;

use crate::ranges::{all, each};
use crate::texture::TextureUse;
use crate::values::{Radiance, Share, TextureNumber, numbers, some};
use glam::DVec3;
use layers::Layers;
use serde::Deserialize;
use surface::{Lambertian, MetallicRoughness, Surface, TextureRole};

/// A material. `T` refers to a texture: by its name in a scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct Material<T = TextureUse> {
    /// Name for messages.
    pub name: String,
    /// Scattering model.
    pub surface: Surface<T>,
    /// Emitted radiance; zero for a material that does not emit.
    pub emission: DVec3,
    /// Texture that multiplies `emission`.
    pub emission_texture: Option<T>,
    /// True if the back emits too.
    pub emits_both_sides: bool,
    /// Fraction of the light that meets the surface, 0 to 1; the rest passes straight through.
    pub opacity: f64,
    /// Meaning of `opacity`.
    pub alpha: Alpha,
    /// Normal map in the tangent space of a mesh; shapes have none.
    pub normal_texture: Option<T>,
    /// Factor of the normal map's x and y.
    pub normal_scale: f64,
    /// True if the surface shows `emission` whatever the light (KHR_materials_unlit): colours of
    /// vertices multiply it, and next-event estimation does not sample it.
    pub is_unlit: bool,
    /// Index into [`Description::media`](crate::description::Description::media) of the medium
    /// behind the surface: inside of what its surfaces enclose.
    pub medium: Option<usize>,
}

/// Meaning of a material's opacity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Opacity is ignored.
    #[default]
    Opaque,
    /// The surface exists where opacity is at least `cutoff`.
    Mask {
        /// Threshold of opacity, 0 to 1.
        cutoff: f64,
    },
    /// Opacity is the fraction of the light that meets the surface.
    Blend,
}

/// Light that reflects nothing.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, bound = "T: Deserialize<'de>")]
pub struct Emissive<T = TextureUse> {
    /// Emitted radiance, equal in all directions.
    #[serde(deserialize_with = "numbers::<Radiance, _>")]
    pub radiance: DVec3,
    /// True if the back emits too.
    #[serde(default)]
    pub two_sided: bool,
    /// Texture that multiplies `radiance`.
    #[serde(default = "Option::default", deserialize_with = "some")]
    pub texture: Option<T>,
}

impl Emissive {
    /// Returns the light with this radiance, which emits from its front.
    pub fn rgb(red: f64, green: f64, blue: f64) -> Self {
        Self { radiance: DVec3::new(red, green, blue), two_sided: false, texture: None }
    }
}

impl<T> From<Emissive<T>> for Material<T> {
    fn from(Emissive { radiance, two_sided, texture }: Emissive<T>) -> Self {
        Self {
            emission: radiance,
            emission_texture: texture,
            emits_both_sides: two_sided,
            ..Self::new(Surface::Lambertian(Lambertian { albedo: DVec3::ZERO, texture: None }))
        }
    }
}

impl<S: Into<Surface>> From<S> for Material {
    fn from(surface: S) -> Self {
        Self::new(surface.into())
    }
}

impl<T> Material<T> {
    /// Returns a material without a name that does not emit, and is opaque.
    pub const fn new(surface: Surface<T>) -> Self {
        Self {
            name: String::new(),
            surface,
            emission: DVec3::ZERO,
            emission_texture: None,
            emits_both_sides: false,
            opacity: 1.0,
            alpha: Alpha::Opaque,
            normal_texture: None,
            normal_scale: 1.0,
            is_unlit: false,
            medium: None,
        }
    }

    /// Returns the material with this name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// Returns the fault of the medium behind this surface, if there is one.
    fn medium_fault(&self) -> Option<&'static str> {
        let is_interface = matches!(self.surface, Surface::Interface(_));
        let is_opaque = self.opacity >= 1.0 && self.alpha == Alpha::Opaque && !self.surface.transmits();
        match self.medium {
            None if is_interface => Some("an Interface shows nothing; give it a `medium`"),
            Some(_) if is_opaque => {
                Some("no light passes this surface to its `medium`; use an Interface or a Dielectric")
            }
            Some(_) if self.layers().is_some_and(Layers::absorbs) => {
                Some("`medium` and the attenuation of `volume` exclude each other; remove one")
            }
            _ if is_interface && (self.opacity < 1.0 || self.emission != DVec3::ZERO) => {
                Some("an Interface has neither opacity nor emission; remove them")
            }
            _ => None,
        }
    }

    /// Returns whether the material needs the tangents of its mesh.
    pub fn needs_tangents(&self) -> bool {
        self.layers().is_some_and(Layers::is_anisotropic) || self.normal_maps().next().is_some()
    }

    /// Returns the normal maps: that of the surface and that of its coat.
    pub fn normal_maps(&self) -> impl Iterator<Item = &T> {
        let coat = self.layers().and_then(|layers| layers.coat.as_ref());
        self.normal_texture.iter().chain(coat.and_then(|coat| coat.normal_texture.as_ref()))
    }

    fn layers(&self) -> Option<&Layers<T>> {
        match &self.surface {
            Surface::MetallicRoughness(MetallicRoughness { layers, .. }) => Some(layers),
            _ => None,
        }
    }

    /// Returns the textures that the material reads, with their roles.
    pub fn textures(&self) -> impl Iterator<Item = (&T, TextureRole)> {
        let emission = self.emission_texture.iter().map(|texture| (texture, TextureRole::Colour));
        let normal = self.normal_texture.iter().map(|texture| (texture, TextureRole::Numbers));
        emission.chain(self.surface.textures()).chain(normal)
    }

    /// Returns the material with each texture replaced by what `f` makes of it.
    ///
    /// # Errors
    ///
    /// The first error of `f`.
    pub fn with_textures<U, E>(self, mut f: impl FnMut(T) -> Result<U, E>) -> Result<Material<U>, E> {
        Ok(Material {
            emission_texture: self.emission_texture.map(&mut f).transpose()?,
            surface: self.surface.with_textures(&mut f)?,
            normal_texture: self.normal_texture.map(&mut f).transpose()?,
            normal_scale: self.normal_scale,
            name: self.name,
            emission: self.emission,
            emits_both_sides: self.emits_both_sides,
            opacity: self.opacity,
            alpha: self.alpha,
            is_unlit: self.is_unlit,
            medium: self.medium,
        })
    }
}

impl Material {
    /// Checks that each number is finite and in range, and that each image is one of `images`.
    pub(crate) fn check(&self, images: usize) -> Result<(), String> {
        self.surface.check()?;
        each::<Radiance>("emission", self.emission)?;
        all::<Share>("opacity", &[self.opacity])?;
        all::<TextureNumber>("normal scale", &[self.normal_scale])?;
        if let Alpha::Mask { cutoff } = self.alpha {
            all::<Share>("alpha cutoff", &[cutoff])?;
        }
        if let Some(fault) = self.medium_fault() {
            return Err(fault.to_owned());
        }
        self.textures().try_for_each(|(texture, _)| texture.check(images))
    }
}
