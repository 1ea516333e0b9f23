//! OpenEXR: the first layer with R, G and B, as its display window shows it.

use super::bounds::{ALWAYS, Bounds, Demand, MAX_DEFLATE};
use super::{Image, ImageError};
use exr::block::reader::Reader;
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::Text;
use exr::meta::header::Header;
use exr::prelude::{ReadChannels, ReadLayers, read};
use std::fs::File;
use std::io::BufReader;

/// Bytes that the reader keeps for each chunk, its offset and its place.
const CHUNK: u64 = 128;

/// Bytes of a chunk in the file beside its pixels: its offset, its row and its size.
const CHUNK_IN_FILE: u64 = 16;

/// Reads a file whose extension says that it is one. Pixels of the display window that the layer
/// does not have are black.
pub(super) fn read_file(bounds: &Bounds, file: File) -> Result<Image, ImageError> {
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

/// Refuses a file whose headers say more than it can have, or than the memory has room for.
fn check(
    bounds: &Bounds,
    reader: &Reader<BufReader<File>>,
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
        // A chunk may announce as much as a block has, which is allocated before it is read.
        let data = pixels.max(if block(header) > ALWAYS { block(header) } else { 0 });
        let shortest =
            (data / max_ratio(header.compression)).saturating_add(chunks.saturating_mul(CHUNK_IN_FILE));
        let (width, height) = (size.width() as u64, size.height() as u64);
        bounds.check_length(&Demand { width, height, shortest, needed: data })?;
        // A block compressed, as it is, and sorted by channels.
        let buffers = data.min(block(header)).saturating_mul(3);
        needed = needed.saturating_add(buffers).saturating_add(chunks.saturating_mul(CHUNK));
    }
    bounds.check(&Demand { width, height, shortest: 0, needed })
}

/// Bytes of a block of pixels without compression.
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

/// Bytes of pixels for a byte in the file, at most.
fn max_ratio(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        // Runs of 128 in two bytes.
        Compression::RLE => 64,
        Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ => MAX_DEFLATE,
        // 24 bits of 32.
        Compression::PXR24 => MAX_DEFLATE * 4 / 3,
        // 16 half-precision numbers in 3 bytes.
        Compression::B44 | Compression::B44A => 11,
        // Of 64 numbers the mean alone, deflated, in half precision.
        _ => MAX_DEFLATE * 128,
    }
}
