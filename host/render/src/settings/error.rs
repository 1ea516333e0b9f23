//! Errors of settings.

use super::MAX_DEPTH;
use std::ops::Range;
use thiserror::Error;
use trisect_shared::film::CHUNK_SAMPLES;
use trisect_system::memory;

/// Error of settings that cannot be rendered.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SettingsError {
    /// A number that must be at least 1 is 0.
    #[error("{name} is 0; it must be 1 or more")]
    Zero {
        /// Name of the setting.
        name: &'static str,
    },
    /// Paths are longer than a film can count: 256 samples of [`MAX_DEPTH`] segments fit 32 bits.
    #[error("`depth` is {depth}; it must be at most {MAX_DEPTH}")]
    TooDeep {
        /// Requested depth.
        depth: u32,
    },
    /// The edge of a tile is out of range, or no power of two.
    #[error("`tile` is {edge}; choose 0, or a power of two from 4 to 1024")]
    NoSuchTile {
        /// Requested edge in pixels.
        edge: u32,
    },
    /// The clamp is not a positive number.
    #[error("`clamp` is {clamp}; it must be a number above 0")]
    NoClamp {
        /// Requested clamp.
        clamp: String,
    },
    /// The image has more pixels than 32-bit indices can number.
    #[error(
        "an image of {width}x{height} has more than 2^32 - 1 pixels; choose a smaller image by `resolution`, `width` or `height`"
    )]
    TooManyPixels {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// The image needs more memory than is free.
    #[error(
        "an image of {width}x{height} needs {} of memory, {} are free; choose a smaller image by `resolution`, `width` or `height`",
        memory::display(*needed), memory::display(*available)
    )]
    TooLarge {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Bytes that the image needs.
        needed: u64,
        /// Bytes that are free.
        available: u64,
    },
    /// A crop is empty, or beyond the image.
    #[error(
        "`crop` has columns {} to {} and rows {} to {} of an image of {width}x{height}; choose at least one pixel, within an image of at most 2147483647 pixels a side",
        columns.start, columns.end, rows.start, rows.end
    )]
    NoSuchCrop {
        /// Requested columns.
        columns: Range<u32>,
        /// Requested rows.
        rows: Range<u32>,
        /// Pixels across the image.
        width: u32,
        /// Pixels down the image.
        height: u32,
    },
    /// Rows or samples are empty, or beyond the frame.
    #[error(
        "rows {} to {} and samples {} to {} are not part of an image of {height} rows and {of} samples; choose at least one of each, all within the image",
        rows.start, rows.end, samples.start, samples.end
    )]
    NoSuchPart {
        /// Requested rows.
        rows: Range<u32>,
        /// Requested samples.
        samples: Range<u32>,
        /// Number of rows of the image.
        height: u32,
        /// Samples per pixel of the image.
        of: u32,
    },
    /// A part splits a chunk, whose f32 sum would then be rounded differently.
    #[error(
        "samples {} to {} of {of} split a chunk; a part begins at a multiple of {CHUNK_SAMPLES} and ends at one or at the last sample",
        samples.start, samples.end
    )]
    SplitsChunk {
        /// Requested samples.
        samples: Range<u32>,
        /// Samples per pixel of the image.
        of: u32,
    },
    /// A live frame has more samples than a chunk.
    #[error(
        "a live frame has at most {CHUNK_SAMPLES} samples a pixel, not {samples}; lower `spp`, or render it to a file"
    )]
    TooManyLive {
        /// Requested samples per pixel.
        samples: u32,
    },
    /// The features named would not render the scene correctly.
    #[error("`features` lacks what scene and settings need: {missing}")]
    FeaturesLack {
        /// Names of the features that are missing.
        missing: String,
    },
    /// The features named are those of another image.
    #[error(
        "`features` and the settings differ in {other}, which changes the image; name it in both or in none"
    )]
    FeaturesDiffer {
        /// Names of the features that are in one of both.
        other: String,
    },
    /// The settings name the traversal of a tree that the device does not have.
    #[error("`traversal` wide needs a CPU with AVX2; choose another, or leave it out")]
    NoWideTree,
    /// `--device` without `--backend`.
    #[error("`device` needs `backend`: its index is one of that backend's, as `device::list` says")]
    DeviceWithoutBackend,
}
