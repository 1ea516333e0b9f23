//! KTX2 containers with Basis Universal textures, as glTF has them (KHR_texture_basisu): ETC1S with
//! BasisLZ, and UASTC, plain or with zstd.
//!
//! The container is read here, and its base level alone is handed to the transcoder in a new one:
//! the transcoder trusts the numbers of a header.

use super::error::{MAX_SIDE, TextureError};
use ruzstd::decoding::StreamingDecoder;
use std::io::Read;

/// First bytes of a file.
pub const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Bytes of the header.
const HEADER: usize = 80;
/// Place of the data format descriptor in the container that is handed on: behind the header and
/// the place of one level.
const DESCRIPTOR: usize = HEADER + 24;
/// Colour models of the descriptor.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;
/// Schemes of supercompression.
const NONE: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTD: u32 = 2;
/// Bytes of the header of BasisLZ's global data, and of its description of an image.
const GLOBAL: usize = 20;

/// A texture whose header was checked.
pub struct Ktx2 {
    pub width: u32,
    pub height: u32,
    /// A container of the base level.
    container: Vec<u8>,
}

impl Ktx2 {
    /// Reads the header of a file and its base level.
    ///
    /// # Errors
    ///
    /// * [`TextureError::Container`] for textures that are not those of KHR_texture_basisu
    /// * [`TextureError::TooLarge`], [`TextureError::Empty`] and [`TextureError::Codec`]
    pub fn new(bytes: &[u8]) -> Result<Self, TextureError> {
        let cut = || TextureError::Codec("the KTX2 file is cut off".to_owned());
        let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?)) };
        let long = |at: usize| -> Option<u64> { Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?)) };
        let range = |from: u64, length: u64| {
            let from = usize::try_from(from).ok()?;
            bytes.get(from..from.checked_add(usize::try_from(length).ok()?)?)
        };
        let head = |at| word(at).ok_or_else(cut);
        let (format, width, height, depth) = (head(12)?, head(20)?, head(24)?, head(28)?);
        let (layers, faces, levels, scheme) = (head(32)?, head(36)?, head(40)?, head(44)?);
        if format != 0 || depth > 0 || layers > 1 || faces != 1 {
            return Err(TextureError::Container("KTX2 without Basis Universal, or of several images"));
        }
        if width == 0 || height == 0 {
            return Err(TextureError::Empty);
        }
        if width.max(height) > MAX_SIDE {
            return Err(TextureError::TooLarge { width: width.into(), height: height.into() });
        }
        let descriptor = range(head(48)?.into(), head(52)?.into()).ok_or_else(cut)?;
        let model = descriptor.get(12).copied().ok_or_else(cut)?;
        let level = [80, 88, 96].map(long);
        let [Some(from), Some(length), Some(inflated)] = level else { return Err(cut()) };
        let level = range(from, length).ok_or_else(cut)?;
        let (global_from, global_length) = (long(64).ok_or_else(cut)?, long(72).ok_or_else(cut)?);
        let blocks = (width.div_ceil(4) as usize).saturating_mul(height.div_ceil(4) as usize);
        let plain = blocks.saturating_mul(16);
        let (mut global, mut data) = (Vec::new(), Vec::new());
        match (model, scheme) {
            (ETC1S, BASIS_LZ) => {
                let all = range(global_from, global_length).ok_or_else(cut)?;
                let images = (levels.max(1) as usize).saturating_mul(GLOBAL).saturating_add(GLOBAL);
                global.extend_from_slice(all.get(..2 * GLOBAL).ok_or_else(cut)?);
                global.extend_from_slice(all.get(images..).ok_or_else(cut)?);
                data.extend_from_slice(level);
            }
            (UASTC, NONE) => data.extend_from_slice(level.get(..plain).ok_or_else(cut)?),
            (UASTC, ZSTD) if inflated == plain as u64 => data = inflate(level, plain)?,
            (UASTC, ZSTD) => return Err(cut()),
            _ => return Err(TextureError::Container("KTX2 with a format that glTF does not have")),
        }
        let scheme = if model == ETC1S { BASIS_LZ } else { NONE };
        let container = rebuilt((width, height), scheme, descriptor, &global, &data);
        Ok(Self { width, height, container })
    }

    /// Returns the bytes of memory that [`transcode`](Self::transcode) takes.
    pub fn memory(&self) -> u64 {
        (self.container.len() as u64).saturating_add(8 * u64::from(self.width) * u64::from(self.height))
    }

    /// Returns the texels of the base level, row by row, top row first.
    ///
    /// # Errors
    ///
    /// [`TextureError::Codec`].
    pub fn transcode(&self) -> Result<Vec<[u8; 4]>, TextureError> {
        let codec = |error: basisu::Error| TextureError::Codec(format!("{error:?}"));
        let transcoder = basisu::Transcoder::new(&self.container).map_err(codec)?;
        let texels = transcoder
            .transcode(0, basisu::TargetFormat::Rgba32, basisu::DecodeFlags::NONE)
            .map_err(codec)?;
        let texels = texels.as_chunks().0.to_vec();
        if texels.len() as u64 != u64::from(self.width) * u64::from(self.height) {
            return Err(TextureError::Codec("the texture has another size than its container".to_owned()));
        }
        Ok(texels)
    }
}

/// Inflates exactly `size` bytes of zstd; the memory for them is taken as the file gives them.
fn inflate(level: &[u8], size: usize) -> Result<Vec<u8>, TextureError> {
    let wrong = |error: String| TextureError::Codec(format!("zstd: {error}"));
    let decoder = StreamingDecoder::new_with_max_window_size(level, 8 << 20);
    let decoder = decoder.map_err(|error| wrong(error.to_string()))?;
    let mut data = Vec::new();
    decoder.take(size as u64).read_to_end(&mut data).map_err(|error| wrong(error.to_string()))?;
    if data.len() == size { Ok(data) } else { Err(wrong("it ends too early".to_owned())) }
}

/// Returns a container of one level.
fn rebuilt(
    (width, height): (u32, u32),
    scheme: u32,
    descriptor: &[u8],
    global: &[u8],
    data: &[u8],
) -> Vec<u8> {
    let after = DESCRIPTOR + descriptor.len();
    let (global_at, inflated) = match global.is_empty() {
        true => (0, data.len()),
        false => (after.next_multiple_of(8), 0),
    };
    let data_at = (after.next_multiple_of(8) + global.len()).next_multiple_of(16);
    let mut file = MAGIC.to_vec();
    let words = [0, 1, width, height, 0, 0, 1, 1, scheme, DESCRIPTOR as u32, descriptor.len() as u32, 0, 0];
    file.extend(words.into_iter().flat_map(u32::to_le_bytes));
    let longs = [global_at, global.len(), data_at, data.len(), inflated];
    file.extend(longs.into_iter().flat_map(|long| (long as u64).to_le_bytes()));
    file.extend_from_slice(descriptor);
    file.resize(after.next_multiple_of(8), 0);
    file.extend_from_slice(global);
    file.resize(data_at, 0);
    file.extend_from_slice(data);
    file
}
