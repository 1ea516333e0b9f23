//! Reader of OpenEXR: the first layer with R, G and B, cropped or extended to its display window.

use super::bounds::{ALWAYS, Bounds, Demand, MAX_DEFLATE};
use super::{Image, ImageError};
use exr::block::reader::Reader;
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::Text;
use exr::meta::header::Header;
use exr::prelude::{ReadChannels, ReadLayers, read};
use std::io::{BufReader, Read, Seek};

/// Bytes of memory that the reader keeps for each chunk: its offset and its position.
const CHUNK: u64 = 128;

/// Bytes of a chunk in the file in addition to its pixels: its offset, its row and its size.
const CHUNK_IN_FILE: u64 = 16;

/// Reads an EXR file. Pixels of the display window that the layer lacks are black.
pub(super) fn read_file(bounds: &Bounds, file: impl Read + Seek) -> Result<Image, ImageError> {
    let codec = |message: String| ImageError::Codec { path: bounds.path.to_owned(), message };
    let failed = |error: exr::error::Error| match error {
        exr::error::Error::Io(source) => ImageError::Io { path: bounds.path.to_owned(), source },
        other => codec(other.to_string()),
    };
    let reader = exr::block::read(BufReader::new(file), false).map_err(failed)?;
    let Some(header) = reader.headers().iter().find(|header| has_rgb(header)) else {
        return Err(codec("there is no layer with channels R, G and B".to_owned()));
    };
    let window = header.shared_attributes.display_window;
    let (width, height) = (window.size.width() as u64, window.size.height() as u64);
    check(bounds, &reader, (width, height))?;
    let (Ok(wide), Ok(high)) = (u32::try_from(width), u32::try_from(height)) else {
        return Err(codec(format!("its display window is {width} x {height}")));
    };
    let offset = header.own_attributes.layer_position - window.position;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            move |_, _| vec![[0.0; 3]; wide as usize * high as usize],
            move |pixels: &mut Vec<[f32; 3]>, at, (r, g, b): (f32, f32, f32)| {
                let Vec2(x, y) = at.to_i32() + offset;
                let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
                if x < wide as usize
                    && let Some(pixel) = pixels.get_mut(y * wide as usize + x)
                {
                    *pixel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_chunks(reader)
        .map_err(failed)?;
    Ok(Image { width: wide, height: high, pixels: image.layer_data.channel_data.pixels })
}

fn has_rgb(header: &Header) -> bool {
    let has = |name: &str| header.channels.find_index_of_channel(&Text::from(name)).is_some();
    !header.deep && ["R", "G", "B"].into_iter().all(has)
}

/// Refuses a file whose headers claim more than the file or the memory can hold.
fn check<R: Read + Seek>(
    bounds: &Bounds,
    reader: &Reader<BufReader<R>>,
    (width, height): (u64, u64),
) -> Result<(), ImageError> {
    let sizes = || reader.headers().iter().map(|header| header.layer_size);
    bounds.check_blank((width, height), sizes().map(|size| area(size.0, size.1)).max().unwrap_or(0))?;
    let mut needed = area(width as usize, height as usize).saturating_mul(12);
    for header in reader.headers() {
        let chunks = header.chunk_count as u64;
        let size = header.layer_size;
        let bytes = |channel: &exr::meta::attribute::ChannelDescription| {
            let Vec2(across, down) = channel.subsampled_resolution(size);
            area(across, down).saturating_mul(channel.sample_type.bytes_per_sample() as u64)
        };
        let pixels = header.channels.list.iter().map(bytes).fold(0, u64::saturating_add);
        // A chunk may claim the size of a whole block, which is allocated before the chunk is read.
        let data = pixels.max(if block(header) > ALWAYS { block(header) } else { 0 });
        let shortest =
            (data / max_ratio(header.compression)).saturating_add(chunks.saturating_mul(CHUNK_IN_FILE));
        let (width, height) = (size.width() as u64, size.height() as u64);
        bounds.check_length(&Demand { width, height, shortest, needed: data })?;
        // A block is held compressed, uncompressed, and sorted by channels.
        let buffers = data.min(block(header)).saturating_mul(3);
        needed = needed.saturating_add(buffers).saturating_add(chunks.saturating_mul(CHUNK));
    }
    bounds.check(&Demand { width, height, shortest: 0, needed })
}

/// Returns the bytes of an uncompressed block of pixels.
fn block(header: &Header) -> u64 {
    let Vec2(across, down) = match header.blocks {
        BlockDescription::Tiles(tiles) => tiles.tile_size,
        BlockDescription::ScanLines => {
            Vec2(header.layer_size.width(), header.compression.scan_lines_per_block())
        }
    };
    area(across, down).saturating_mul(header.channels.bytes_per_pixel as u64)
}

fn area(across: usize, down: usize) -> u64 {
    (across as u64).saturating_mul(down as u64)
}

/// Returns the maximum bytes of pixels per byte of the file.
fn max_ratio(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        // A run of 128 bytes takes two.
        Compression::RLE => 64,
        Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ => MAX_DEFLATE,
        // 24 of 32 bits are stored.
        Compression::PXR24 => MAX_DEFLATE * 4 / 3,
        // 16 half-precision numbers take 3 bytes.
        Compression::B44 | Compression::B44A => 11,
        // DWAA, DWAB: of 64 numbers possibly only the mean, in half precision and deflated.
        _ => MAX_DEFLATE * 128,
    }
}
