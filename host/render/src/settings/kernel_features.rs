//! Features of the kernel, as settings name them to measure what they cost.

use serde::{Serialize, Serializer};
use std::fmt;
use std::str::FromStr;
use trisect_kernels::{feature_names, features_by_names};
use trisect_shared::features::{CHOICES, Features, NEEDS, PADDED_BOXES};

/// Features of the kernel. They do not change the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KernelFeatures {
    /// The features that the scene and the settings need.
    #[default]
    Needed,
    /// The needed features, and these.
    Also(Features),
    /// Exactly these features.
    Exactly(Features),
}

/// Writes names of features with commas between them, after `+` if they are added to those needed.
impl fmt::Display for KernelFeatures {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Needed => to.write_str("needed"),
            Self::Also(features) => write!(to, "+{}", feature_names(*features)),
            Self::Exactly(features) => to.write_str(&feature_names(*features)),
        }
    }
}

/// Reads what [`Display`](fmt::Display) writes, and `all`.
impl FromStr for KernelFeatures {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const NAMED: Features = CHOICES | NEEDS | PADDED_BOXES;
        let read = |names| match features_by_names(names) {
            Ok(features) if features & !NAMED == 0 => Ok(features),
            Ok(features) => Err(feature_names(features & !NAMED)),
            Err(name) => Err(name.to_owned()),
        };
        let features = match (text, text.strip_prefix('+')) {
            ("needed", _) => Ok(Self::Needed),
            ("all", _) => Ok(Self::Also(NEEDS)),
            (_, Some(names)) => read(names).map(Self::Also),
            (names, None) => read(names).map(Self::Exactly),
        };
        features.map_err(|name| format!("unknown feature {name}; known: {}", feature_names(NAMED)))
    }
}

impl Serialize for KernelFeatures {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for KernelFeatures {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "KernelFeatures".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect_shared::features::{SPHERES, TEXTURES};

    #[test]
    fn what_is_written_is_read() {
        use KernelFeatures::{Also, Exactly, Needed};
        for features in [Needed, Also(TEXTURES), Exactly(SPHERES | TEXTURES)] {
            assert_eq!(features.to_string().parse(), Ok(features));
        }
        assert_eq!("all".parse(), Ok(Also(NEEDS)));
        for unknown in ["sphere", "+linear", "spheres,persistent"] {
            assert!(
                unknown.parse::<KernelFeatures>().is_err_and(|error| error.contains("known: ")),
                "{unknown}"
            );
        }
    }
}
