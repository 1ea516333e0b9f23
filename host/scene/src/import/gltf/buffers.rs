//! Buffers, buffer views and data URIs.

use super::super::budget::Budget;
use super::super::files::{Files, readable};
use super::super::source_location::{SourceLocation, shown};
use super::json::Root;
use super::meshopt;
use crate::error::SceneError;

use base64::alphabet::STANDARD;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use base64::engine::{DecodePaddingMode, Engine};
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Contents of the buffers.
#[derive(Debug)]
pub struct Buffers<'a> {
    /// Contents by the index of the buffer.
    contents: Vec<Content<'a>>,
    /// Contents of views that were compressed, by the index of the view.
    decompressed: HashMap<u32, Vec<u8>>,
}

#[derive(Debug)]
enum Content<'a> {
    Chunk(Cow<'a, [u8]>),
    File {
        bytes: Arc<Vec<u8>>,
        length: usize,
    },
    /// A buffer without data, whose views are compressed in others.
    Placeholder,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers, and decompresses views; `chunk` is the binary chunk of a GLB.
    pub fn read(
        root: &Root,
        name: &str,
        chunk: Option<&'a [u8]>,
        files: &mut dyn Files,
        budget: &mut Budget,
    ) -> Result<Self, SceneError> {
        let mut known: HashMap<&str, Arc<Vec<u8>>> = HashMap::new(); // several buffers may share a file
        let mut contents = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            let site = SourceLocation::new(name, format!("buffers[{index}]"));
            let short = |length: usize| {
                let problem = format!("byteLength is {}, there are {length} bytes", buffer.byte_length);
                site.malformed(problem, "the buffer is incomplete: copy or export it again")
            };
            contents.push(match (&buffer.uri, chunk) {
                (Some(uri), _) => {
                    let bytes = match known.entry(uri) {
                        Entry::Occupied(entry) => Arc::clone(entry.get()),
                        Entry::Vacant(entry) => {
                            let bytes = read_uri(uri, &site, files, budget)?;
                            Arc::clone(entry.insert(Arc::new(bytes)))
                        }
                    };
                    let length = usize::try_from(buffer.byte_length).unwrap_or(usize::MAX);
                    if length > bytes.len() {
                        return Err(short(bytes.len()));
                    }
                    Content::File { bytes, length }
                }
                (None, Some(chunk)) if index == 0 => {
                    let content = usize::try_from(buffer.byte_length).ok().and_then(|end| chunk.get(..end));
                    Content::Chunk(Cow::Borrowed(content.ok_or_else(|| short(chunk.len()))?))
                }
                (None, _)
                    if buffer
                        .extensions
                        .as_ref()
                        .is_some_and(|e| e.ext_meshopt.is_some() || e.khr_meshopt.is_some()) =>
                {
                    Content::Placeholder
                }
                (None, _) => {
                    return Err(site.malformed("it has no uri", "only a GLB's first buffer may have none"));
                }
            });
        }
        let mut buffers = Self { contents, decompressed: HashMap::new() };
        for (index, view) in (0..).zip(&root.buffer_views) {
            let Some(extensions) = view.extensions.as_deref() else { continue };
            let of_khronos = extensions.khr_meshopt.as_ref();
            let Some(compressed) = of_khronos.or(extensions.ext_meshopt.as_ref()) else { continue };
            let site = SourceLocation::new(name, format!("bufferViews[{index}] (meshopt)"));
            let (offset, length) = (compressed.byte_offset, compressed.byte_length);
            let source = buffers.range(compressed.buffer, offset, length, &site)?;
            let bytes = meshopt::decode(source, compressed, of_khronos.is_some(), budget, &site)?;
            buffers.decompressed.insert(index, bytes);
        }
        Ok(buffers)
    }

    /// Returns the buffers with copies of what they borrow.
    pub fn into_owned(self) -> Buffers<'static> {
        let own = |content| match content {
            Content::Chunk(bytes) => Content::Chunk(Cow::Owned(bytes.into_owned())),
            Content::File { bytes, length } => Content::File { bytes, length },
            Content::Placeholder => Content::Placeholder,
        };
        let contents = self.contents.into_iter().map(own).collect();
        Buffers { contents, decompressed: self.decompressed }
    }

    /// Returns bytes of a buffer.
    fn range(
        &self,
        buffer: u32,
        offset: u64,
        length: u64,
        site: &SourceLocation,
    ) -> Result<&[u8], SceneError> {
        let content = match get(&self.contents, buffer, "buffers", site)? {
            Content::Chunk(bytes) => bytes.as_ref(),
            Content::File { bytes, length } => bytes.get(..*length).unwrap_or_default(),
            Content::Placeholder => {
                let problem = format!("buffers[{buffer}] has no data but that of compressed views");
                return Err(site.malformed(problem, "export the file again"));
            }
        };
        let end = offset.checked_add(length).and_then(|end| usize::try_from(end).ok());
        end.and_then(|end| content.get(offset as usize..end)).ok_or_else(|| {
            let problem =
                format!("{length} bytes at {offset} reach beyond buffers[{buffer}] of {}", content.len());
            site.malformed(problem, "byteOffset and byteLength must stay within the buffer")
        })
    }

    /// Returns the bytes of a buffer view, and its stride if it has one.
    pub fn view(
        &self,
        root: &Root,
        index: u32,
        user: &SourceLocation,
    ) -> Result<(&[u8], Option<u64>), SceneError> {
        let view = get(&root.buffer_views, index, "bufferViews", user)?;
        let site = SourceLocation::new(user.file, format!("bufferViews[{index}]"));
        if let Some(bytes) = self.decompressed.get(&index) {
            return Ok((bytes, view.byte_stride));
        }
        Ok((self.range(view.buffer, view.byte_offset, view.byte_length, &site)?, view.byte_stride))
    }
}

/// Returns the entry `index` of the document's list `name`; `user` is the part that refers to it.
pub fn get<'l, T>(list: &'l [T], index: u32, name: &str, user: &SourceLocation) -> Result<&'l T, SceneError> {
    list.get(index as usize).ok_or_else(|| {
        user.malformed(
            format!("it names {name}[{index}], and there are {}", list.len()),
            "the index must be that of an existing entry",
        )
    })
}

/// Returns the content of a data URI or of a file.
pub fn read_uri(
    uri: &str,
    site: &SourceLocation,
    files: &mut dyn Files,
    budget: &mut Budget,
) -> Result<Vec<u8>, SceneError> {
    if let Some(data) = uri.strip_prefix("data:") {
        return decode_data(data).map_err(|problem| {
            site.malformed(problem, "write \"data:;base64,\" and then the bytes in base64")
        });
    }
    let scheme = uri.split(['/', '?', '#']).next().and_then(|start| start.split_once(':'));
    if let Some((scheme, _)) = scheme {
        let feature = format!("the URI scheme \"{}\"", shown(scheme));
        return Err(
            site.unsupported(feature, "put the file into the scene's folder and give its relative path")
        );
    }
    let path: Cow<str> = percent_decode_str(uri).decode_utf8().map_err(|_| {
        site.malformed(
            format!("\"{}\" is not UTF-8", shown(uri)),
            "percent-encode the UTF-8 bytes of the name",
        )
    })?;
    let bytes = files.read(&path, readable()).map_err(|source| site.resource(uri, source))?;
    budget.extend(bytes.len());
    Ok(bytes)
}

/// Decodes the part of a data URI after `data:`.
fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (kind, content) = data.split_once(',').ok_or("the data URI has no comma")?;
    if !kind.ends_with(";base64") {
        return Ok(percent_decode_str(content).collect());
    }
    // Some exporters omit the padding, and trailing bits need not be 0.
    let config = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    GeneralPurpose::new(&STANDARD, config)
        .decode(content)
        .map_err(|error| format!("the data URI's base64 is wrong: {error}"))
}
