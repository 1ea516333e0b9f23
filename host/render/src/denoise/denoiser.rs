//! Denoiser of a finished image: a filter of this program, or Open Image Denoise.

use super::{DenoiseError, DenoiseSettings, Filter, oidn};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// Denoiser of a finished image. Live frames have [`DenoiseSettings`] only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Denoiser {
    /// Filter that runs on the device of the render, with its parameters.
    Filter(DenoiseSettings),
    /// Open Image Denoise, a library that is loaded at run time ([`oidn`]).
    Oidn,
}

impl Denoiser {
    /// Checks that the parameters are in range, and that the library is available.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] names the parameter, or says what the library lacks.
    pub fn check(&self) -> Result<(), DenoiseError> {
        match self {
            Self::Filter(filter) => filter.check(),
            Self::Oidn => Ok(oidn::check()?),
        }
    }

    /// Returns the denoisers of which a render within a time takes the first that fits: Open Image
    /// Denoise, where it is installed, then SVGF.
    ///
    /// # Errors
    ///
    /// [`DenoiseError::Oidn`] if [`oidn::VARIABLE`] names a library that cannot be used.
    pub fn choices() -> Result<Vec<Self>, DenoiseError> {
        let is_named = std::env::var_os(oidn::VARIABLE).is_some_and(|value| !value.is_empty());
        let found = match oidn::check() {
            Err(error) if is_named => return Err(error.into()),
            found => found.is_ok(),
        };
        Ok(found.then_some(Self::Oidn).into_iter().chain([Filter::Svgf.into()]).collect())
    }

    /// Returns version and device of the library that denoises; `None` for a filter.
    pub fn library(&self) -> Option<String> {
        match self {
            Self::Filter(_) => None,
            Self::Oidn => oidn::describe().ok(),
        }
    }

    /// Returns the name, as on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Filter(DenoiseSettings { filter: Filter::Atrous, .. }) => "atrous",
            Self::Filter(DenoiseSettings { filter: Filter::Svgf, .. }) => "svgf",
            Self::Oidn => "oidn",
        }
    }
}

/// A filter with its default parameters.
impl From<Filter> for Denoiser {
    fn from(filter: Filter) -> Self {
        Self::Filter(filter.into())
    }
}

impl From<DenoiseSettings> for Denoiser {
    fn from(filter: DenoiseSettings) -> Self {
        Self::Filter(filter)
    }
}

impl From<&DenoiseSettings> for Denoiser {
    fn from(filter: &DenoiseSettings) -> Self {
        Self::Filter(*filter)
    }
}

impl From<&Self> for Denoiser {
    fn from(denoiser: &Self) -> Self {
        *denoiser
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Denoiser {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Denoiser".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let filter = generator.subschema_for::<DenoiseSettings>();
        let oidn = schemars::json_schema!({
            "type": "object",
            "properties": { "filter": { "const": "oidn" } },
            "required": ["filter"]
        });
        schemars::json_schema!({ "anyOf": [filter, oidn] })
    }
}

/// Serialises a filter as its settings, and Open Image Denoise as `{"filter": "oidn"}`.
impl Serialize for Denoiser {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Filter(filter) => filter.serialize(serializer),
            Self::Oidn => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry("filter", self.name())?;
                map.end()
            }
        }
    }
}
