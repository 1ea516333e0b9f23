//! Reading of materials in scene files. A material is written as its surface; the fields of
//! [`Common`] stand among those of the surface.

use super::surface::Surface;
use super::{Alpha, Emissive, Material};
use crate::ron_error::unknown_field;
use crate::values::{Radiance, Share, TextureNumber, vector};
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, EnumAccess, Error, IntoDeserializer, MapAccess, VariantAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::marker::PhantomData;

/// A material as a scene file has it; `T` refers to a texture or to a medium.
#[derive(Debug)]
pub struct Written<T> {
    /// The material, without its medium.
    pub material: Material<T>,
    /// Medium behind the surface.
    pub medium: Option<T>,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Written<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_enum("Material", &Surface::<T>::NAMES, ByName(PhantomData))
    }
}

/// Reads the name of the material's surface.
struct ByName<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ByName<T> {
    type Value = Written<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "a material")
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Self::Value, A::Error> {
        let (Identifier(name), fields) = data.variant()?;
        if !Surface::<T>::NAMES.contains(&name.as_str()) {
            return Err(A::Error::unknown_variant(&name, &Surface::<T>::NAMES));
        }
        fields.struct_variant(&[], Fields { name, textures: PhantomData })
    }
}

/// Reads the fields of the material whose surface has this name.
struct Fields<T> {
    name: String,
    textures: PhantomData<T>,
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Fields<T> {
    type Value = Written<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "the fields of {}", self.name)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        if self.name == "Emissive" {
            let emissive = Emissive::deserialize(MapAccessDeserializer::new(map))?;
            return Ok(Written { material: emissive.into(), medium: None });
        }
        let mut common = Common::new();
        let fields = SurfaceFields { map, surface: &self.name, common: &mut common };
        let surface = Surface::read(&self.name, MapAccessDeserializer::new(fields))?;
        let medium = common.medium.take();
        Ok(Written { material: common.material(surface), medium })
    }
}

/// Fields that all materials have, except [`Emissive`].
struct Common<T> {
    emission: Option<(Radiance, Radiance, Radiance)>,
    emission_texture: Option<T>,
    two_sided: Option<bool>,
    opacity: Option<Share>,
    alpha_cutoff: Option<Share>,
    normal_texture: Option<T>,
    normal_scale: Option<TextureNumber>,
    medium: Option<T>,
}

impl<T> Common<T> {
    const NAMES: [&'static str; 8] = [
        "emission",
        "emission_texture",
        "two_sided",
        "opacity",
        "alpha_cutoff",
        "normal_texture",
        "normal_scale",
        "medium",
    ];

    const fn new() -> Self {
        Self {
            emission: None,
            emission_texture: None,
            two_sided: None,
            opacity: None,
            alpha_cutoff: None,
            normal_texture: None,
            normal_scale: None,
            medium: None,
        }
    }

    /// Reads the value of the field `name`. Returns false for a field of the surface.
    fn read<'de, A: MapAccess<'de>>(&mut self, name: &str, map: &mut A) -> Result<bool, A::Error>
    where
        T: Deserialize<'de>,
    {
        fn set<'de, A: MapAccess<'de>, V: Deserialize<'de>>(
            field: &mut Option<V>,
            name: &'static str,
            map: &mut A,
        ) -> Result<bool, A::Error> {
            match field.replace(map.next_value()?) {
                Some(_) => Err(A::Error::duplicate_field(name)),
                None => Ok(true),
            }
        }
        match name {
            "emission" => set(&mut self.emission, "emission", map),
            "emission_texture" => set(&mut self.emission_texture, "emission_texture", map),
            "two_sided" => set(&mut self.two_sided, "two_sided", map),
            "opacity" => set(&mut self.opacity, "opacity", map),
            "alpha_cutoff" => set(&mut self.alpha_cutoff, "alpha_cutoff", map),
            "normal_texture" => set(&mut self.normal_texture, "normal_texture", map),
            "normal_scale" => set(&mut self.normal_scale, "normal_scale", map),
            "medium" => set(&mut self.medium, "medium", map),
            _ => Ok(false),
        }
    }

    fn material(self, surface: Surface<T>) -> Material<T> {
        let opacity = self.opacity.map_or(1.0, |opacity| opacity.0);
        let plain = Material::new(surface);
        Material {
            emission: self.emission.map_or(plain.emission, vector),
            emission_texture: self.emission_texture,
            emits_both_sides: self.two_sided.unwrap_or(false),
            normal_texture: self.normal_texture,
            normal_scale: self.normal_scale.map_or(plain.normal_scale, |scale| scale.0),
            opacity,
            alpha: match self.alpha_cutoff {
                Some(cutoff) => Alpha::Mask { cutoff: cutoff.0 },
                None if opacity < 1.0 => Alpha::Blend,
                None => Alpha::Opaque,
            },
            ..plain
        }
    }
}

/// The fields of a map that are not in [`Common`].
struct SurfaceFields<'a, A, T> {
    map: A,
    /// Name of the surface.
    surface: &'a str,
    common: &'a mut Common<T>,
}

impl<'de, A: MapAccess<'de>, T: Deserialize<'de>> MapAccess<'de> for SurfaceFields<'_, A, T> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        while let Some(Identifier(name)) = self.map.next_key()? {
            if !self.common.read(&name, &mut self.map)? {
                let key = seed.deserialize(name.as_str().into_deserializer());
                return key.map(Some).map_err(|error: FieldError| match error {
                    FieldError::Unknown(fields) => {
                        let known = [fields, &Common::<T>::NAMES].concat();
                        A::Error::custom(unknown_field(&name, self.surface, &known))
                    }
                    FieldError::Other(message) => A::Error::custom(message),
                });
            }
        }
        Ok(None)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

/// Error of reading the name of a field.
#[derive(Debug)]
enum FieldError {
    /// The surface has other fields, these.
    Unknown(&'static [&'static str]),
    Other(String),
}

impl fmt::Display for FieldError {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Unknown(fields) => write!(formatter, "an unknown field; known: {}", fields.join(", ")),
            Self::Other(message) => formatter.write_str(message),
        }
    }
}

impl std::error::Error for FieldError {}

impl Error for FieldError {
    fn custom<M: fmt::Display>(message: M) -> Self {
        Self::Other(message.to_string())
    }

    fn unknown_field(_: &str, expected: &'static [&'static str]) -> Self {
        Self::Unknown(expected)
    }
}

/// A name that stands in a file without quotation marks.
struct Identifier(String);

impl<'de> Deserialize<'de> for Identifier {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = Identifier;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                write!(formatter, "a name")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Identifier, E> {
                Ok(Identifier(name.to_owned()))
            }
        }
        deserializer.deserialize_identifier(Text)
    }
}
