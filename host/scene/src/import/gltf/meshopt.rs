//! Decodes buffer views that EXT_meshopt_compression or KHR_meshopt_compression compresses.

use super::super::budget::Budget;
use super::super::source_location::{SourceLocation, shown};
use super::json::Meshopt;
use crate::error::SceneError;
use meshoptimizer_rs::{Error, Limits, Workspace, codec};

/// Greatest stride of vertices in bytes.
const MAX_STRIDE: u64 = 256;

/// Returns the bytes of a view, which `source` compresses. `is_khronos` is true for the extension
/// of that prefix, which has a newer codec of vertices and a filter for colours.
pub fn decode(
    source: &[u8],
    view: &Meshopt,
    is_khronos: bool,
    budget: &mut Budget,
    site: &SourceLocation,
) -> Result<Vec<u8>, SceneError> {
    let Meshopt { byte_stride: stride, count, ref mode, ref filter, .. } = *view;
    let filter = filter.as_deref().unwrap_or("NONE");
    let fits = match &**mode {
        "ATTRIBUTES" => stride.is_multiple_of(4) && (4..=MAX_STRIDE).contains(&stride),
        "TRIANGLES" => (stride == 2 || stride == 4) && count.is_multiple_of(3),
        "INDICES" => stride == 2 || stride == 4,
        other => {
            let problem = format!("mode is \"{}\"", shown(other));
            return Err(site.malformed(problem, "it must be ATTRIBUTES, TRIANGLES or INDICES"));
        }
    };
    let filtered = match filter {
        "NONE" => true,
        "OCTAHEDRAL" => stride == 4 || stride == 8,
        "QUATERNION" => stride == 8,
        "EXPONENTIAL" => true,
        "COLOR" if is_khronos => stride == 4 || stride == 8,
        other => {
            let problem = format!("filter is \"{}\"", shown(other));
            return Err(site.malformed(problem, "it must be NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL"));
        }
    };
    if !fits || !filtered || filter != "NONE" && **mode != *"ATTRIBUTES" {
        let problem = format!("byteStride is {stride} and count {count} for {mode} with the filter {filter}");
        return Err(site.malformed(problem, "export the file again"));
    }
    let bytes = stride.saturating_mul(count);
    budget.decompress(bytes, source.len() as u64, site)?;
    let (Ok(count), Ok(stride), Ok(bytes)) =
        (usize::try_from(count), usize::try_from(stride), usize::try_from(bytes))
    else {
        return Err(site.too_large(format!("count is {count}"), usize::MAX.to_string()));
    };
    let wrong = |error: Error| {
        site.malformed(format!("its meshopt data cannot be decoded: {error:?}"), "export the file again")
    };
    // The budget has granted the bytes; the decoder keeps a copy at most.
    let max_bytes = bytes.saturating_mul(4).saturating_add(1 << 20);
    let mut workspace = Workspace::new(Limits { max_bytes, max_work: u64::MAX });
    let decoded = match &**mode {
        "ATTRIBUTES" => {
            if !is_khronos && codec::decode_vertex_version(source).map_err(wrong)? != 0 {
                let feature = "version 1 of the vertex codec in EXT_meshopt_compression";
                return Err(site.unsupported(feature, "export it as KHR_meshopt_compression"));
            }
            codec::decode_vertex_buffer(count, stride, source, &mut workspace)
        }
        "TRIANGLES" => codec::decode_index_buffer(count, stride, source, &mut workspace),
        _ => codec::decode_index_sequence(count, stride, source, &mut workspace),
    };
    let mut decoded = decoded.map_err(wrong)?;
    match filter {
        "OCTAHEDRAL" => codec::decode_filter_oct(&mut decoded, count, stride, &mut workspace),
        "QUATERNION" => codec::decode_filter_quat(&mut decoded, count, stride, &mut workspace),
        "EXPONENTIAL" => codec::decode_filter_exp(&mut decoded, count, stride, &mut workspace),
        "COLOR" => codec::decode_filter_color(&mut decoded, count, stride, &mut workspace),
        _ => Ok(()),
    }
    .map_err(wrong)?;
    Ok(decoded)
}
