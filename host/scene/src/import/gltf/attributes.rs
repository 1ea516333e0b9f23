//! Attributes of a primitive: in accessors, or in Draco data.

use super::super::source_location::SourceLocation;
use super::accessor::{Elements, Expected};
use super::draco::{self, Decoded};
use super::json::Primitive;
use super::{Document, Output};
use crate::error::SceneError;

/// Attributes of a primitive.
#[derive(Debug)]
pub struct Attributes<'a> {
    /// Primitive of the document.
    pub primitive: &'a Primitive,
    /// Vertices and triangles of its Draco data, if it has any.
    pub decoded: Option<Decoded>,
    site: &'a SourceLocation<'a>,
}

impl<'a> Attributes<'a> {
    /// Returns the attributes of a primitive, whose place is `site`, and decompresses its Draco
    /// data.
    pub fn of(
        document: &Document,
        output: &mut Output,
        primitive: &'a Primitive,
        site: &'a SourceLocation<'a>,
    ) -> Result<Self, SceneError> {
        // Data beside the Draco data, for readers without a decoder, is exact.
        let is_empty = |accessor: &u32| {
            let accessor = document.root.accessors.get(*accessor as usize);
            accessor.is_some_and(|accessor| accessor.buffer_view.is_none() && accessor.sparse.is_none())
        };
        let mut accessors = primitive.attributes.values().chain(&primitive.indices);
        let draco = primitive.extensions.as_deref().and_then(|extensions| extensions.draco.as_ref());
        let draco = draco.filter(|_| accessors.any(is_empty));
        let decoded = match draco {
            Some(draco) => Some(draco::decode(document, &mut output.budget, primitive, draco, site)?),
            None => None,
        };
        Ok(Self { primitive, decoded, site })
    }

    /// Opens the attribute of this name; `None` if the primitive does not have it.
    pub fn open<'e>(
        &'e self,
        document: &'e Document,
        output: &mut Output,
        name: &str,
        expected: Expected,
    ) -> Result<Option<Elements<'e>>, SceneError> {
        let site = self.site.member(&format!("attributes.{name}"));
        let decoded = self.decoded.as_ref();
        if let Some((decoded, attribute)) = decoded.and_then(|of| Some((of, of.attributes.get(name)?))) {
            return Elements::of_attribute(attribute, decoded.count, expected, &site).map(Some);
        }
        let Some(&accessor) = self.primitive.attributes.get(name) else { return Ok(None) };
        Elements::open(document, &mut output.budget, accessor, expected, &site).map(Some)
    }

    /// Returns the number of components of the attribute of this name.
    pub fn width(&self, document: &Document, name: &str) -> Option<usize> {
        if let Some(attribute) = self.decoded.as_ref().and_then(|decoded| decoded.attributes.get(name)) {
            return Some(attribute.width);
        }
        let accessor = document.root.accessors.get(*self.primitive.attributes.get(name)? as usize)?;
        Some(if accessor.kind == "VEC4" { 4 } else { 3 })
    }
}
