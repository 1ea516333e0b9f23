//! OpenEXR files of any channels.

use crate::ImageError;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
};
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
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).map_err(|error| codec(error.to_string()))?;
    super::write_file(path, &bytes.into_inner())
}
