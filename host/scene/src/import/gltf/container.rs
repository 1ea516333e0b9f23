//! Splits a GLB file into its JSON and its binary chunk, which is the first buffer.

use super::super::source_location::SourceLocation;
use super::version;
use crate::error::SceneError;

/// First bytes of a GLB file.
pub const MAGIC: &[u8] = b"glTF";

const JSON: u32 = 0x4e4f_534a;
const BINARY: u32 = 0x004e_4942;

/// Content of a GLB file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Container<'a> {
    /// JSON of the document.
    pub json: &'a [u8],
    /// First buffer, if the file has one.
    pub chunk: Option<&'a [u8]>,
    /// True if the chunks begin at multiples of 4 bytes, as the specification requires.
    pub aligned: bool,
}

/// Splits a GLB file into its JSON and its first buffer.
pub fn split<'a>(bytes: &'a [u8], name: &str) -> Result<Container<'a>, SceneError> {
    let header = SourceLocation::new(name, "GLB header");
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(header.malformed("the file ends within the header", "export the file again"));
    };
    if version == 1 {
        return Err(version::convert(&header));
    }
    if version != 2 {
        return Err(header.unsupported(format!("GLB version {version}"), "export glTF 2.0"));
    }
    let Some(bytes) = bytes.get(..length as usize) else {
        return Err(truncated(&header, u64::from(length), bytes.len()));
    };
    let (kind, json, end) = chunk(bytes, 12, &SourceLocation::new(name, "GLB chunk 0"))?;
    if kind != JSON {
        return Err(SourceLocation::new(name, "GLB chunk 0")
            .malformed("it is not JSON", "JSON must be the first chunk"));
    }
    let padded = end.next_multiple_of(4);
    // Some writers do not pad the JSON: the next chunk then begins right after it.
    let binary_at = |at: usize| word(bytes, at.saturating_add(4)) == Some(BINARY);
    let rest = if !binary_at(padded) && binary_at(end) { end } else { padded };
    let aligned = rest == padded;
    if rest >= bytes.len() {
        return Ok(Container { json, chunk: None, aligned });
    }
    // Chunks of other kinds belong to extensions and are skipped.
    let (kind, binary, _) = chunk(bytes, rest, &SourceLocation::new(name, "GLB chunk 1"))?;
    Ok(Container { json, chunk: (kind == BINARY).then_some(binary), aligned })
}

/// Returns the kind of a chunk, its content and the offset of its end.
fn chunk<'a>(
    bytes: &'a [u8],
    at: usize,
    site: &SourceLocation,
) -> Result<(u32, &'a [u8], usize), SceneError> {
    let (Some(length), Some(kind)) = (word(bytes, at), word(bytes, at.saturating_add(4))) else {
        return Err(truncated(site, at as u64 + 8, bytes.len()));
    };
    let start = at + 8;
    let end = start.saturating_add(length as usize);
    match bytes.get(start..end) {
        Some(content) => Ok((kind, content, end)),
        None => Err(truncated(site, end as u64, bytes.len())),
    }
}

fn truncated(site: &SourceLocation, end: u64, length: usize) -> SceneError {
    site.malformed(
        format!("it ends at byte {end}, the file at byte {length}"),
        "the file is incomplete: copy or export it again",
    )
}

/// Returns the little-endian number at the offset `at`.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|word| u32::from_le_bytes(*word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::testing::glb;

    #[test]
    fn chunks_come_apart() {
        let file = glb("{}", Some(&[1, 2, 3, 4]));
        let Container { json, chunk, aligned } = split(&file, "a").unwrap();
        assert_eq!((json.trim_ascii_end(), chunk, aligned), (&b"{}"[..], Some(&[1, 2, 3, 4][..]), true));
        assert_eq!(split(&glb("{}", None), "a").unwrap().chunk, None);
    }

    #[test]
    fn chunks_that_are_not_aligned_are_found() {
        let header =
            |length: usize| [b"glTF", &2u32.to_le_bytes()[..], &(length as u32).to_le_bytes()].concat();
        let chunk = |kind: &[u8; 4], content: &[u8]| {
            [&(content.len() as u32).to_le_bytes()[..], kind, content].concat()
        };
        for json in ["{}", "{ }", "{  }", "{   }"] {
            let chunks = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &[1, 2, 3])].concat();
            let file = [header(12 + chunks.len()), chunks].concat();
            let want = Container { json: json.as_bytes(), chunk: Some(&[1, 2, 3]), aligned: json.len() == 4 };
            assert_eq!(split(&file, "a").unwrap(), want);
            // Padding that the chunk's length does not include.
            let mut json_chunk = chunk(b"JSON", json.as_bytes());
            json_chunk.resize(json_chunk.len().next_multiple_of(4), b' ');
            let chunks = [json_chunk, chunk(b"BIN\0", &[1, 2, 3])].concat();
            let file = [header(12 + chunks.len()), chunks].concat();
            assert_eq!(split(&file, "a").unwrap(), Container { aligned: true, ..want });
        }
    }

    #[test]
    fn every_truncation_is_an_error() {
        let file = glb("{}", Some(&[1, 2, 3, 4]));
        for length in 0..file.len() {
            let mut cut = file[..length].to_vec();
            assert!(split(&cut, "a").is_err(), "{length}");
            if length >= 12 {
                cut[8..12].copy_from_slice(&(length as u32).to_le_bytes()); // the header agrees; at 24 it is JSON only
                assert_eq!(split(&cut, "a").is_err(), length != 24, "{length}");
            }
        }
        let error = split(&file[..30], "a.glb").unwrap_err().to_string();
        assert_eq!(
            error,
            "a.glb: GLB header: it ends at byte 36, the file at byte 30; the file is incomplete: copy or export it again"
        );
    }
}
