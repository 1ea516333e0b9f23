//! Limits of decoding an image, checked by its header before memory is allocated for its pixels.
//!
//! A file of a few bytes whose header claims gigabytes is refused.

use super::ImageError;
use std::path::Path;

/// Bytes of memory up to which decoding an image is not compared with the length of its file.
pub(super) const ALWAYS: u64 = 64 << 20;

/// Maximum bytes of a PNG's data other than pixels, mainly a colour profile, which may unpack to a
/// thousand times its size.
pub const MAX_CHUNK: u64 = 16 << 20;

/// Maximum bytes into which deflate (PNG, EXR's ZIP) unpacks one byte.
pub(super) const MAX_DEFLATE: u64 = 1032;

/// Maximum bytes into which a byte of a TIFF file unpacks, above the ratios of deflate and LZW.
pub(super) const MAX_TIFF: u64 = 4096;

/// Maximum pixels per byte of a JPEG file: a block of 8 x 8 takes at least one bit.
const MAX_JPEG: u64 = 64 * 8;

/// Maximum pixels of a run in a Radiance file, which takes 4 bytes: runs of four channels are
/// shorter, and longer ones are not written in practice.
const MAX_HDR_RUN: u64 = 256;

/// Demand of decoding an image, by its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Demand {
    /// Width in pixels.
    pub width: u64,
    /// Height in pixels.
    pub height: u64,
    /// Bytes of the shortest file with as many pixels.
    pub shortest: u64,
    /// Peak bytes of memory.
    pub needed: u64,
}

impl Demand {
    /// Returns whether a file of `length` bytes is too short for the pixels that its header claims.
    pub fn is_cut(&self, length: u64) -> bool {
        self.needed > ALWAYS && length < self.shortest
    }
}

/// File to decode, and the available memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds<'a> {
    pub path: &'a Path,
    /// Bytes of the file.
    pub length: u64,
    /// Available bytes of memory.
    pub free: u64,
}

impl Bounds<'_> {
    /// Refuses an image whose header claims more pixels than its file or the memory can hold.
    pub fn check(&self, demand: &Demand) -> Result<(), ImageError> {
        self.check_length(demand)?;
        let Demand { width, height, needed, .. } = *demand;
        if needed > self.free {
            let (path, free) = (self.path.to_owned(), self.free);
            return Err(ImageError::TooLarge { path, width, height, needed, free });
        }
        Ok(())
    }

    /// Refuses an image whose header claims more pixels than its file can hold.
    pub fn check_length(&self, demand: &Demand) -> Result<(), ImageError> {
        let Demand { width, height, shortest, .. } = *demand;
        if demand.is_cut(self.length) {
            let (path, length) = (self.path.to_owned(), self.length);
            return Err(ImageError::Cut { path, width, height, shortest, length });
        }
        Ok(())
    }

    /// Refuses a display window of which the file has `given` pixels, if the blank rest would take
    /// much memory for a short file.
    pub fn check_blank(&self, (width, height): (u64, u64), given: u64) -> Result<(), ImageError> {
        let bytes = 12 * width.saturating_mul(height).saturating_sub(given);
        if bytes > ALWAYS && bytes / MAX_DEFLATE > self.length {
            return Err(ImageError::Blank { path: self.path.to_owned(), width, height, given });
        }
        Ok(())
    }
}

/// Returns width, height and the bytes of the shortest file from the first bytes of a PNG file;
/// `None` if they are not a PNG header.
pub fn png(start: &[u8]) -> Option<(u64, u64, u64)> {
    let header = start.strip_prefix(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")?;
    let number = |at: usize| Some(u64::from(u32::from_be_bytes(*header.get(at..)?.first_chunk()?)));
    let (width, height) = (number(0)?, number(4)?);
    let channels = match header.get(9)? {
        2 => 3,
        4 => 2,
        6 => 4,
        _ => 1,
    };
    let row = (width * channels).saturating_mul(u64::from(*header.get(8)?)).div_ceil(8);
    Some((width, height, row.saturating_mul(height) / MAX_DEFLATE))
}

/// Returns the bytes of the shortest JPEG file with as many pixels.
pub fn shortest_jpeg(width: u64, height: u64) -> u64 {
    width.saturating_mul(height) / MAX_JPEG
}

/// Returns width and height of the lossy image in an extended WebP file; `None` if it has none. The
/// decoder takes memory for that size, before it compares it with that of the canvas.
pub fn webp_image(bytes: &[u8]) -> Option<(u64, u64)> {
    let mut rest = bytes.get(12..)?;
    if !rest.starts_with(b"VP8X") {
        return None;
    }
    loop {
        let length = usize::try_from(u32::from_le_bytes(*rest.get(4..)?.first_chunk()?)).ok()?;
        if let Some(image) = rest.strip_prefix(b"VP8 ") {
            let side =
                |at: usize| Some(u64::from(u16::from_le_bytes(*image.get(at..)?.first_chunk()?) & 0x3fff));
            // Behind the length of the chunk, the tag of the image and a code.
            return Some((side(10)?, side(12)?));
        }
        rest = rest.get(8..)?.get(length.checked_next_multiple_of(2)?..)?;
    }
}

/// Returns the bytes of the shortest Radiance file with as many pixels.
pub(super) fn shortest_hdr(width: u64, height: u64) -> u64 {
    (4 * width.div_ceil(MAX_HDR_RUN)).saturating_mul(height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::TextureDecoder;

    fn bounds(length: u64, free: u64) -> Bounds<'static> {
        Bounds { path: Path::new("a.hdr"), length, free }
    }

    #[test]
    fn a_file_has_the_bytes_that_its_pixels_take() {
        let demand = Demand { width: 30_000, height: 10_000, shortest: 1_000_000, needed: 4 << 30 };
        let error = bounds(999_999, u64::MAX).check(&demand).unwrap_err();
        assert!(matches!(error, ImageError::Cut { .. }), "{error}");
        for word in ["a.hdr", "30000 x 10000", "976.562 KiB", "976.562 KiB"] {
            assert!(error.to_string().contains(word), "{error}");
        }
        // The negative controls: a file that is long enough, and an image that is small.
        assert!(bounds(1_000_000, u64::MAX).check(&demand).is_ok());
        assert!(bounds(1, u64::MAX).check(&Demand { needed: ALWAYS, ..demand }).is_ok());
    }

    #[test]
    fn the_memory_has_room() {
        let demand = Demand { width: 100, height: 100, shortest: 0, needed: 1000 };
        let error = bounds(1_000_000, 999).check(&demand).unwrap_err();
        assert!(matches!(error, ImageError::TooLarge { needed: 1000, free: 999, .. }), "{error}");
        assert!(bounds(1_000_000, 1000).check(&demand).is_ok());
    }

    #[test]
    fn blank_pixels_are_bounded() {
        assert!(bounds(679, u64::MAX).check_blank((20_000, 20_000), 4).is_err());
        assert!(bounds(679, u64::MAX).check_blank((20_000, 20_000), 20_000 * 20_000).is_ok());
        assert!(bounds(679, u64::MAX).check_blank((1920, 1080), 4).is_ok());
        assert!(bounds(10 << 20, u64::MAX).check_blank((20_000, 20_000), 4).is_ok());
    }

    #[test]
    fn png_headers_tell_the_shortest_file() {
        let header = |width: u32, height: u32, kind: [u8; 2]| {
            let start = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
            [start, width.to_be_bytes().to_vec(), height.to_be_bytes().to_vec(), kind.to_vec()].concat()
        };
        assert_eq!(png(&header(1032, 1000, [8, 2])), Some((1032, 1000, 3000)));
        assert_eq!(png(&header(1032, 1000, [16, 6])), Some((1032, 1000, 8000)));
        assert_eq!(png(&header(8256, 1000, [1, 0])), Some((8256, 1000, 1000)));
        assert!(png(&header(u32::MAX, u32::MAX, [255, 6])).is_some());
        assert_eq!(png(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0"), None);
        assert_eq!(png(b"not a png"), None);
    }

    /// Checks that images of one colour, which compress best, are within the bounds.
    #[test]
    fn the_shortest_files_that_encoders_write_pass() {
        let (width, height) = (4096u32, 1024u32);
        let mut file = std::io::Cursor::new(Vec::new());
        let grey = image::GrayImage::new(width, height);
        grey.write_to(&mut file, image::ImageFormat::Png).unwrap();
        let bytes = file.into_inner();
        let (_, _, shortest) = png(&bytes).unwrap();
        assert!(shortest > 0 && bytes.len() as u64 >= shortest, "{} for {shortest}", bytes.len());
        let mut bytes = Vec::new();
        grey.write_with_encoder(image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 1)).unwrap();
        assert!(bytes.len() as u64 >= shortest_jpeg(width.into(), height.into()), "{}", bytes.len());
        let mut bytes = Vec::new();
        let pixels = vec![image::Rgb([0.0f32; 3]); (width * height) as usize];
        let hdr = image::codecs::hdr::HdrEncoder::new(&mut bytes);
        hdr.encode(&pixels, width as usize, height as usize).unwrap();
        assert!(bytes.len() as u64 >= shortest_hdr(width.into(), height.into()), "{}", bytes.len());
    }

    /// A lossy WebP image of another size than its canvas is refused before memory is taken for it.
    #[test]
    fn webp_images_have_the_size_of_their_canvas() {
        let file = |[width, height]: [u16; 2]| {
            let size = [width.to_le_bytes(), height.to_le_bytes()].concat();
            let canvas = [b"VP8X\x0a\0\0\0", &[0; 4][..], &[4, 0, 0, 2, 0, 0]].concat();
            let other = b"EXIF\x01\0\0\0a\0".to_vec();
            let image = [b"VP8 \x0a\0\0\0", &[0x10, 0, 0, 0x9d, 1, 0x2a][..], &size].concat();
            let chunks = [b"WEBP".to_vec(), canvas, other, image].concat();
            [b"RIFF", &(chunks.len() as u32).to_le_bytes()[..], &chunks].concat()
        };
        assert_eq!(webp_image(&file([16383, 3])), Some((16383, 3)));
        assert!(TextureDecoder::new(&file([5, 3])).is_ok());
        let refused = TextureDecoder::new(&file([16383, 3])).err().unwrap().to_string();
        assert!(refused.contains("another size than its canvas"), "{refused}");
        for length in 0..file([5, 3]).len() {
            assert_eq!(webp_image(&file([5, 3])[..length]), None);
        }
    }
}
