//! OpenEXR files of any channels.

use crate::ImageError;
use exr::block::writer::ChunksWriter;
use exr::block::{UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::meta::header::ImageAttributes;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, IntegerBounds, Layer, LayerAttributes, SpecificChannels,
    Vec2,
};
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// Samples of a channel, row by row, top row first.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// 32-bit floating-point numbers.
    F32(Vec<f32>),
    /// 32-bit unsigned integers.
    U32(Vec<u32>),
}

/// Channel of an OpenEXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name in the file; the part before the last dot names a layer.
    pub name: &'static str,
    /// One sample for each pixel.
    pub samples: Samples,
}

/// Writes a file of `width * height` pixels with these channels, and replaces an earlier file as
/// [`write_file`](super::write_file) does.
///
/// # Errors
///
/// [`ImageError::Codec`] if a channel has not one sample for each pixel, [`ImageError::Io`] if the
/// file cannot be written.
pub fn write_channels(
    (width, height): (u32, u32),
    channels: Vec<Channel>,
    path: &Path,
) -> Result<(), ImageError> {
    let codec = |message: String| ImageError::Codec { path: path.to_owned(), message };
    let size = (width as usize, height as usize);
    let channel = |channel: Channel| {
        let samples = match channel.samples {
            Samples::F32(values) => FlatSamples::F32(values),
            Samples::U32(values) => FlatSamples::U32(values),
        };
        if samples.len() == size.0 * size.1 {
            Ok(AnyChannel::new(channel.name, samples))
        } else {
            Err(codec(format!("{} has {} samples for {width}x{height} pixels", channel.name, samples.len())))
        }
    };
    let channels = channels.into_iter().map(channel).collect::<Result<_, _>>()?;
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
        Encoding::SMALL_FAST_LOSSLESS,
        AnyChannels::sort(channels),
    );
    super::write_file(path, &encode(&layer, size).map_err(|error| codec(error.to_string()))?)
}

/// Returns the bytes of a file with the channels R, G and B of an image.
///
/// # Errors
///
/// A message if the pixels do not fill the image, or the image is empty.
pub fn encode_rgb(image: &crate::Image) -> Result<Vec<u8>, String> {
    let size = (image.width as usize, image.height as usize);
    if image.pixels.len() != size.0 * size.1 {
        return Err("the pixels do not fill the image".to_owned());
    }
    let pixel = |Vec2(x, y): Vec2<usize>| {
        let [red, green, blue] = image.pixels.get(y * size.0 + x).copied().unwrap_or_default();
        (red, green, blue)
    };
    let layer =
        Layer::new(size, LayerAttributes::default(), Encoding::FAST_LOSSLESS, SpecificChannels::rgb(pixel));
    encode(&layer, size).map_err(|error| error.to_string())
}

/// Returns the bytes of a file with this layer. All threads of the pool compress its blocks.
fn encode<'a>(layer: &'a impl WritableLayers<'a>, size: (usize, usize)) -> exr::error::Result<Vec<u8>> {
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let headers = layer.infer_headers(&attributes);
    let source = layer.create_writer(&headers);
    let mut bytes = Cursor::new(Vec::new());
    exr::block::write(&mut bytes, headers, true, |meta, writer| {
        let blocks: Vec<_> = enumerate_ordered_header_block_indices(&meta.headers).collect();
        let compress = |(place, index)| {
            let data = source.extract_uncompressed_block(&meta.headers, index);
            Ok((place, UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)?))
        };
        let chunks = blocks.into_par_iter().map(compress).collect::<exr::error::Result<Vec<_>>>()?;
        chunks.into_iter().try_for_each(|(place, chunk)| writer.write_chunk(place, chunk))
    })?;
    Ok(bytes.into_inner())
}
