//! Decodes primitives that KHR_draco_mesh_compression compresses.

use super::super::budget::{Budget, fits};
use super::super::source_location::SourceLocation;
use super::Document;
use super::accessor::{Attribute, Component};
use super::json::{DracoExtension, Primitive};
use crate::error::SceneError;
use draco_core::decode_limits::DecodeLimits;
use draco_core::decoder_buffer::DecoderBuffer;
use draco_core::draco_types::DataType;
use draco_core::geometry_attribute::PointAttribute;
use draco_core::geometry_indices::PointIndex;
use draco_core::mesh::Mesh;
use draco_core::mesh_decoder::MeshDecoder;
use draco_core::status::ErrorKind;
use std::collections::BTreeMap;

/// Bytes of memory that a decoder takes for a point and for a face, at most.
const PER_POINT: u64 = 256;

/// A primitive that was decompressed.
#[derive(Debug, Default)]
pub struct Decoded {
    /// Number of vertices.
    pub count: u32,
    /// Attributes by their names in the primitive.
    pub attributes: BTreeMap<Box<str>, Attribute>,
    /// Vertices of the triangles.
    pub corners: Vec<u32>,
}

/// Decompresses a primitive.
pub fn decode(
    document: &Document,
    budget: &mut Budget,
    primitive: &Primitive,
    extension: &DracoExtension,
    site: &SourceLocation,
) -> Result<Decoded, SceneError> {
    let site = site.member("extensions.KHR_draco_mesh_compression");
    let (bytes, _) = document.buffers.view(&document.root, extension.buffer_view, &site)?;
    let count_of = |accessor: u32| document.root.accessors.get(accessor as usize).map_or(0, |of| of.count);
    let points = primitive.attributes.get("POSITION").map_or(0, |accessor| count_of(*accessor));
    let corners = primitive.indices.map_or(0, count_of);
    // The accessors state what the data must hold: no more is decoded.
    fits(points.saturating_add(corners / 3).saturating_mul(PER_POINT), &site)?;
    let limits = DecodeLimits::default()
        .with_max_points(points)
        .with_max_faces(corners / 3)
        .with_max_decoded_bytes(points.saturating_mul(PER_POINT));
    let too_many = || format!("its data holds more than {points} vertices or {corners} indices");
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|error| {
        let problem = match error.kind() {
            ErrorKind::LimitExceeded => too_many(),
            _ => format!("its Draco data cannot be decoded: {error}"),
        };
        site.malformed(problem, "export the file again")
    })?;
    // The decoder compares the points of point clouds only. Triangles may have attributes outside
    // the data, which have no more elements than the accessors state.
    let count = u32::try_from(mesh.num_points()).unwrap_or(u32::MAX);
    if u64::from(count) > points {
        return Err(site.malformed(too_many(), "export the file again"));
    }
    let mut decoded = Decoded { count, ..Decoded::default() };
    budget.decompress(12 * mesh.num_faces() as u64, bytes.len() as u64, &site)?;
    for face in mesh.faces() {
        for &PointIndex(point) in face {
            if point >= count {
                let problem = format!("a triangle has vertex {point}, and there are {count}");
                return Err(site.malformed(problem, "export the file again"));
            }
            decoded.corners.push(point);
        }
    }
    for (name, &id) in &extension.attributes {
        let Some(attribute) = mesh.attribute_by_unique_id(id) else {
            let problem = format!("its data has no attribute {id}, which is {name}");
            return Err(site.malformed(problem, "export the file again"));
        };
        let accessor =
            primitive.attributes.get(name).and_then(|at| document.root.accessors.get(*at as usize));
        let normalized = accessor.is_some_and(|accessor| accessor.normalized);
        let site = site.member(&format!("attributes.{name}"));
        let Some(attribute) = copy((attribute, count), normalized, (bytes.len(), budget), &site)? else {
            let feature = format!("numbers of the type {:?} in Draco data", attribute.data_type());
            return Err(site.unsupported(feature, super::features::DECOMPRESS));
        };
        decoded.attributes.insert(name.clone(), attribute);
    }
    Ok(decoded)
}

/// Returns the numbers of an attribute of `count` vertices, one after the other, from `source`
/// bytes; `None` if glTF has no numbers of their type.
fn copy(
    (from, count): (&PointAttribute, u32),
    normalized: bool,
    (source, budget): (usize, &mut Budget),
    site: &SourceLocation,
) -> Result<Option<Attribute>, SceneError> {
    let component = match from.data_type() {
        DataType::Int8 => Component::I8,
        DataType::Uint8 => Component::U8,
        DataType::Int16 => Component::I16,
        DataType::Uint16 => Component::U16,
        DataType::Uint32 => Component::U32,
        DataType::Float32 => Component::F32,
        _ => return Ok(None),
    };
    let width = usize::from(from.num_components());
    let size = width * component.size();
    budget.decompress(u64::from(count) * size as u64, source as u64, site)?;
    let stride = usize::try_from(from.byte_stride()).unwrap_or(0);
    let (data, mut bytes) = (from.buffer().data(), Vec::with_capacity(count as usize * size));
    for point in 0..count {
        let at = (from.mapped_index(PointIndex(point)).0 as usize).saturating_mul(stride);
        let Some(numbers) = data.get(at..).and_then(|data| data.get(..size)) else {
            return Err(site.malformed("its Draco data is incomplete", "export the file again"));
        };
        bytes.extend_from_slice(numbers);
    }
    Ok(Some(Attribute { bytes, component, width, normalized }))
}
