//! Errors of the evaluation of images, besides those of reading them.

use std::path::{Path, PathBuf};
use thiserror::Error;
use trisect::image::ImageError;
use trisect::metrics::MetricsError;

/// Images that cannot be evaluated.
#[derive(Debug, Error)]
pub enum EvaluateError {
    /// A file or folder could not be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// A folder has no images.
    #[error(
        "{}: no images; each configuration is a folder of .exr, .hdr or .pfm images, one for each seed",
        path.display()
    )]
    NoImages {
        /// The folder.
        path: PathBuf,
    },
    /// A folder has images of one configuration and folders of others.
    #[error(
        "{}: has images and folders, such as {}; move the images into a folder of their own",
        path.display(), folder.display()
    )]
    Mixed {
        /// The folder.
        path: PathBuf,
        /// One of the folders in it.
        folder: PathBuf,
    },
    /// No reference is named or found.
    #[error("{}: no reference; name one by `reference`, or call a file or folder in it reference", path.display())]
    NoReference {
        /// The folder of the images.
        path: PathBuf,
    },
    /// The reference is an image for a display.
    #[error("{}: an image for a display, with clipped values; use .exr, .hdr or .pfm", path.display())]
    ForDisplay {
        /// The file.
        path: PathBuf,
    },
    /// Too few images of a configuration.
    #[error("{set}: {count} of at least {least} images; render more, each with a seed of its own")]
    TooFew {
        /// Name of the configuration, or its folder.
        set: String,
        /// Number of images.
        count: usize,
        /// Minimum.
        least: usize,
    },
    /// An animation has too few frames.
    #[error("{set}: {count} of at least {least} frames; flicker is a change between frames")]
    FewFrames {
        /// Name of the configuration, or its folder.
        set: String,
        /// Number of its frames.
        count: usize,
        /// Minimum.
        least: usize,
    },
    /// A configuration has another number of frames than the reference.
    #[error(
        "{set}: {count} frames, but the reference has {reference}; give both the same frames, \
         in the order of their names"
    )]
    Frames {
        /// Name of the configuration, or its folder.
        set: String,
        /// Number of its frames.
        count: usize,
        /// Number of the reference's frames.
        reference: usize,
    },
    /// Two images are equal, so their noise is not independent.
    #[error("{second}: equal to {first}; render each image with a seed of its own")]
    Equal {
        /// Name of the first image.
        first: String,
        /// Name of the second image.
        second: String,
    },
    /// An image has another size than the reference.
    #[error(
        "{image}: {}x{} pixels, but {other} has {}x{}; render both at one size",
        size.0, size.1, other_size.0, other_size.1
    )]
    Size {
        /// Name of the image.
        image: String,
        /// Its width and height in pixels.
        size: (u32, u32),
        /// Name of the image that it is compared with.
        other: String,
        /// Width and height of that image.
        other_size: (u32, u32),
    },
    /// An image has values that are NaN or infinite.
    #[error(
        "{image}: NaN or infinite in {count} of its pixels, the first at ({x}, {y}); \
         render it again, or give them finite values"
    )]
    NotFinite {
        /// Name of the image.
        image: String,
        /// Number of such pixels.
        count: usize,
        /// Column of the first one, from the left.
        x: u32,
        /// Row of the first one, from the top.
        y: u32,
    },
    /// The file of times cannot be used.
    #[error(
        "{}: {message}; write {{\"seconds\": [1.5, 1.6]}}, a time for each image, or {{\"seconds\": 1.5}} for all",
        path.display()
    )]
    Times {
        /// The file.
        path: PathBuf,
        /// Reason.
        message: String,
    },
    /// An image could not be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// An image cannot be compared.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// Results that cannot be written as JSON.
    #[error("writing the evaluation as JSON: {message}")]
    Encode {
        /// Message of the encoder.
        message: String,
    },
}

impl EvaluateError {
    /// Returns a function that makes an [`EvaluateError::Io`] for a file or folder.
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    /// Returns the program's exit code, as [`trisect::Error::exit_code`] does.
    pub(super) fn exit_code(&self) -> u8 {
        if matches!(self, Self::NoReference { .. }) { 2 } else { 1 }
    }
}
