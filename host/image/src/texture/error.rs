//! Reasons why bytes are no image for a texture.

use thiserror::Error;
use trisect_system::memory;

/// Maximum width and height in texels. It is small for fuzzers: a few bytes may be a large image,
/// and its memory is that of the machine.
pub const MAX_SIDE: u32 = if cfg!(fuzzing) { 512 } else { 16384 };

/// Bytes that are no image for a texture. Messages name neither file nor place, which the caller
/// knows.
#[derive(Debug, Error)]
pub enum TextureError {
    /// A container of textures for GPUs that glTF does not have.
    #[error("{0}, the format of this image,")]
    Container(&'static str),
    /// An image of another format.
    #[error("{0}, the format of this image,")]
    Format(String),
    /// Bytes of no known format.
    #[error("this is not an image")]
    NoImage,
    /// Bytes that the image library does not decode.
    #[error("the image cannot be decoded: {0}")]
    Codec(String),
    /// An image without texels.
    #[error("the image has no texels")]
    Empty,
    /// A side above [`MAX_SIDE`].
    #[error("an image of {width} x {height}")]
    TooLarge {
        /// Width in texels that the header claims.
        width: u64,
        /// Height in texels that the header claims.
        height: u64,
    },
    /// The header claims more texels than a file of this length can hold.
    #[error(
        "its header says {width} x {height} texels, for which a file of this kind has {} at least, and it has {}",
        memory::display(*shortest), memory::display(*length)
    )]
    Cut {
        /// Width in texels that the header claims.
        width: u64,
        /// Height in texels that the header claims.
        height: u64,
        /// Bytes of the shortest file with as many texels.
        shortest: u64,
        /// Bytes of the file.
        length: u64,
    },
}
