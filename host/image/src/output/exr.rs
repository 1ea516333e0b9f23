//! OpenEXR files of any channels.

use super::channel::TASK;
use super::{Channel, Encoding, Metadata, Picture, Samples, Window, color_channels};
use ::exr::block::writer::ChunksWriter;
use ::exr::block::{UncompressedBlock, enumerate_ordered_header_block_indices};
use ::exr::image::write::layers::{LayersWriter, WritableLayers};
use ::exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use ::exr::meta::header::ImageAttributes;
use ::exr::prelude::{AnyChannel, AnyChannels, Encoding as ExrEncoding, FlatSamples, IntegerBounds};
use ::exr::prelude::{Layer, LayerAttributes, Vec2, f16};
use rayon::prelude::*;
use std::io::Cursor;

/// Maximum finite value of a 16-bit float.
pub const MAX_HALF: f32 = 65504.0;

/// Primaries and white of Rec. 709 (ITU-R BT.709-6, section 1).
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Bytes of a file before the attributes of its header: magic number and version.
const START: usize = 8;

/// Returns whether a finite value of the pixels is beyond 16-bit floats.
pub fn exceeds_half(pixels: &[[f32; 3]]) -> bool {
    pixels.par_iter().with_min_len(TASK).flatten_iter().any(|value| is_beyond(*value))
}

fn is_beyond(value: f32) -> bool {
    value.is_finite() && value.abs() > MAX_HALF
}

/// Returns the bytes of a file with the channels R, G, B and A of a picture, and its layers:
/// scanlines from the top, compressed by ZIP.
///
/// # Errors
///
/// A message if a channel has not one sample for each pixel, two channels have the same name, or
/// the image is empty.
pub fn encode(picture: Picture, encoding: &Encoding) -> Result<Vec<u8>, String> {
    let image = picture.image;
    let size = (image.width as usize, image.height as usize);
    let mut all = color_channels("", &image.pixels);
    all.extend(picture.alpha.map(|alpha| Channel::new("A", Samples::Color(alpha.to_vec()))));
    all.extend(picture.layers);
    let mut names: Vec<&str> = all.iter().map(|channel| channel.name.as_ref()).collect();
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("two channels are named {}", twice[0]));
    }
    let beyond = |channel: &Channel| match &channel.samples {
        Samples::Color(values) => values.par_iter().with_min_len(TASK).any(|value| is_beyond(*value)),
        _ => false,
    };
    let half = encoding.half && !all.iter().any(beyond);
    let channel = |Channel { name, samples }: Channel| {
        let samples = match samples {
            Samples::Color(values) if half => {
                FlatSamples::F16(values.into_par_iter().with_min_len(TASK).map(f16::from_f32).collect())
            }
            Samples::Color(values) | Samples::F32(values) => FlatSamples::F32(values),
            Samples::U32(values) => FlatSamples::U32(values),
        };
        match samples.len() == size.0 * size.1 {
            true => Ok(AnyChannel::new(Text::from_slice_unchecked(name.as_bytes()), samples)),
            false => Err(format!("{name} has {} samples for {}x{} pixels", samples.len(), size.0, size.1)),
        }
    };
    let channels = all.into_iter().map(channel).collect::<Result<_, _>>()?;
    let mut attributes = layer_attributes(&encoding.metadata);
    let mut display = size;
    if let Some(Window { at, of }) = encoding.window {
        let place = |pixels: u32| i32::try_from(pixels).map_err(|error| error.to_string());
        attributes.layer_position = Vec2(place(at.0)?, place(at.1)?);
        display = (of.0 as usize, of.1 as usize);
    }
    let layer = Layer::new(size, attributes, ExrEncoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    encode_layer(&layer, display).map_err(|error| error.to_string())
}

/// Returns the bytes of a file with this layer, for a display of `size`. All threads of the pool
/// compress its blocks.
fn encode_layer<'a>(
    layer: &'a impl WritableLayers<'a>,
    size: (usize, usize),
) -> ::exr::error::Result<Vec<u8>> {
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    attributes.chromaticities = Some(REC_709);
    let headers = layer.infer_headers(&attributes);
    let source = layer.create_writer(&headers);
    let mut bytes = Cursor::new(Vec::new());
    ::exr::block::write(&mut bytes, headers, true, |meta, writer| {
        let blocks: Vec<_> = enumerate_ordered_header_block_indices(&meta.headers).collect();
        let compress = |(place, index)| {
            let data = source.extract_uncompressed_block(&meta.headers, index);
            Ok((place, UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)?))
        };
        let chunks = blocks.into_par_iter().map(compress).collect::<::exr::error::Result<Vec<_>>>()?;
        chunks.into_iter().try_for_each(|(place, chunk)| writer.write_chunk(place, chunk))
    })?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn layer_attributes(metadata: &Metadata) -> LayerAttributes {
    let text = |value: &String| Text::from_slice_unchecked(value.as_bytes());
    let mut attributes =
        LayerAttributes { software_name: metadata.software.as_ref().map(text), ..LayerAttributes::default() };
    for (name, value) in &metadata.entries {
        let name = format!("trisect.{}", lower_camel(name));
        let name = Text::from_slice_unchecked(name.as_bytes());
        attributes.other.insert(name, AttributeValue::Text(text(value)));
    }
    for (name, value) in &metadata.attributes {
        let name = Text::from_slice_unchecked(name.as_bytes());
        attributes.other.insert(name, AttributeValue::Text(text(value)));
    }
    if let Some(camera) = &metadata.camera {
        let flat = |rows: [[f32; 4]; 4]| {
            let mut flat = [0.0; 16];
            flat.copy_from_slice(rows.as_flattened());
            flat
        };
        attributes.world_to_camera = Some(flat(camera.world_to_camera));
        attributes.world_to_normalized_device = Some(flat(camera.world_to_ndc));
        attributes.vertical_field_of_view = camera.vertical_fov;
    }
    attributes
}

/// Returns "Creation Time" as "creationTime".
fn lower_camel(name: &str) -> String {
    let (first, rest) = name.split_at(name.len().min(1));
    first.to_ascii_lowercase() + &rest.replace(' ', "")
}

/// Sorts the attributes in the header by their names. The library writes them in the order of a
/// hash map, which differs from file to file.
fn sort_attributes(file: &mut [u8]) {
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut rest = &file[START..];
    loop {
        // Name and type end with 0; the bytes of the value follow their number.
        let texts = rest.split_inclusive(|byte| *byte == 0).take(2).map(<[u8]>::len).sum::<usize>();
        let length = rest.get(texts..).and_then(|rest| rest.first_chunk()).copied().map(u32::from_le_bytes);
        let end = length.map(|length| texts + 4 + length as usize);
        match end.and_then(|end| rest.split_at_checked(end)) {
            Some((attribute, others)) if rest[0] != 0 => {
                attributes.push(attribute);
                rest = others;
            }
            _ => break,
        }
    }
    attributes.sort_unstable();
    let sorted = attributes.concat();
    file[START..START + sorted.len()].copy_from_slice(&sorted);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Image;

    fn encoded(pixels: &[[f32; 3]], encoding: &Encoding) -> Vec<u8> {
        let image = Image { width: pixels.len() as u32, height: 1, pixels: pixels.to_vec() };
        encode(Picture::from(&image), encoding).unwrap()
    }

    /// Without sorting, two files of several entries are equal by chance only.
    #[test]
    fn equal_pictures_are_equal_files() {
        let entries = ["A", "B", "C", "D", "E", "F"].map(|name| (name, name.repeat(3)));
        let metadata = Metadata { entries: entries.to_vec(), ..Metadata::default() };
        let encoding = Encoding { metadata, ..Encoding::default() };
        let files: Vec<_> = (0..8).map(|_| encoded(&[[1.0; 3]], &encoding)).collect();
        assert!(files.windows(2).all(|pair| pair[0] == pair[1]));
        let text = String::from_utf8_lossy(&files[0]).into_owned();
        let place = |name: &str| text.find(name).unwrap();
        assert!(place("channels") < place("chromaticities") && place("trisect.a") < place("trisect.f"));
    }

    #[test]
    fn colours_have_16_bits_where_they_fit() {
        let half = Encoding { half: true, ..Encoding::default() };
        // 4 bytes for each of three channels, or 2; of one pixel nothing is compressed.
        let sizes = |pixel: [f32; 3]| [&Encoding::default(), &half].map(|of| encoded(&[pixel], of).len());
        let [whole, short] = sizes([0.1, 0.2, 0.3]);
        assert_eq!(whole - short, 6);
        let [whole, short] = sizes([65504.0, f32::INFINITY, f32::NAN]);
        assert_eq!(whole - short, 6);
        let [whole, short] = sizes([65505.0, 0.2, 0.3]);
        assert_eq!(whole, short);
        assert!(exceeds_half(&[[0.0, 65505.0, 0.0]]) && !exceeds_half(&[[f32::INFINITY, 65504.0, f32::NAN]]));
    }

    #[test]
    fn channels_are_complete_and_have_names_of_their_own() {
        let image = Image { width: 1, height: 1, pixels: vec![[0.0; 3]] };
        let with = |name: &'static str, count: usize| {
            let layers = vec![Channel::new(name, Samples::U32(vec![0; count]))];
            encode(Picture { layers, ..Picture::from(&image) }, &Encoding::default())
        };
        assert!(with("id", 1).is_ok());
        assert!(with("id", 2).unwrap_err().contains("id has 2 samples"));
        assert!(with("G", 1).unwrap_err().contains("two channels"));
    }
}
