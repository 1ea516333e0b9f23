//! Recognises glTF 1.0, which is another format: most of its lists are objects.

use super::super::source_location::SourceLocation;
use crate::error::SceneError;
use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt::{Formatter, Result as FmtResult};

/// Returns the error for a file of glTF 1.0.
pub fn convert(site: &SourceLocation) -> SceneError {
    site.malformed("this is glTF 1.0", "convert it with `gltf-pipeline -i old.gltf -o new.glb`")
}

/// Returns whether a text that is not glTF 2.0 is glTF 1.0 or older: by its version, or by objects
/// where glTF 2.0 has lists.
pub fn is_first(text: &str) -> bool {
    let Ok(Probe { asset, accessors, meshes, nodes }) = serde_json::from_str(text) else { return false };
    let version = asset.and_then(|asset| asset.version);
    let old = |version: &Kind| matches!(version, Kind::Text(text) if text.starts_with("1.") || text.starts_with("0."));
    let object = |kind: Option<Kind>| matches!(kind, Some(Kind::Object));
    version.as_ref().is_some_and(old) || object(accessors) || object(meshes) || object(nodes)
}

/// Members that differ between the versions.
#[derive(Deserialize)]
struct Probe {
    asset: Option<Asset>,
    accessors: Option<Kind>,
    meshes: Option<Kind>,
    nodes: Option<Kind>,
}

#[derive(Deserialize)]
struct Asset {
    version: Option<Kind>,
}

/// The kind of a JSON value, whose content is skipped.
enum Kind {
    Object,
    Text(String),
    Other,
}

impl<'de> Deserialize<'de> for Kind {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        struct Any;

        impl<'de> Visitor<'de> for Any {
            type Value = Kind;

            fn expecting(&self, formatter: &mut Formatter) -> FmtResult {
                formatter.write_str("anything")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Kind, A::Error> {
                while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
                Ok(Kind::Object)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Kind, A::Error> {
                while list.next_element::<IgnoredAny>()?.is_some() {}
                Ok(Kind::Other)
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Kind, E> {
                Ok(Kind::Text(text.chars().take(8).collect()))
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<Kind, E> {
                Ok(Kind::Text(format!("{number:.1}")))
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Kind, E> {
                Ok(Kind::Text(format!("{number}.0")))
            }

            fn visit_i64<E: Error>(self, _: i64) -> Result<Kind, E> {
                Ok(Kind::Other)
            }

            fn visit_bool<E: Error>(self, _: bool) -> Result<Kind, E> {
                Ok(Kind::Other)
            }

            fn visit_unit<E: Error>(self) -> Result<Kind, E> {
                Ok(Kind::Other)
            }
        }

        source.deserialize_any(Any)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_version_is_told_by_its_number_or_its_objects() {
        for text in [
            r#"{"asset":{"version":"1.0"}}"#,
            r#"{"asset":{"version":1}}"#,
            r#"{"asset":{"version":"0.8"},"nodes":null}"#,
            r#"{"nodes":{"a":{"meshes":["b"]}}}"#,
            r#"{"asset":{},"accessors":{}}"#,
        ] {
            assert!(is_first(text), "{text}");
        }
        for text in [
            r#"{"asset":{"version":"2.0"},"nodes":[]}"#,
            r#"{"asset":{"version":2}}"#,
            r#"{"asset":{"version":"10.0"}}"#,
            r#"{"asset":{"version":-1},"meshes":true}"#,
            "{}",
            "[]",
            "",
            r#"{"nodes":{"#,
        ] {
            assert!(!is_first(text), "{text}");
        }
    }
}
