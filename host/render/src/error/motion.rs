//! Errors of images of a scene that moves.

use std::path::PathBuf;
use thiserror::Error;

/// Error of numbered images, or of motion blur.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MotionError {
    /// The samples of a pixel cannot be divided over this number of moments.
    #[error(
        "`shutter_steps` is {steps}, and a pixel has {samples} samples; it must be from 1 to {samples}, or `spp` higher"
    )]
    Steps {
        /// Requested number of moments.
        steps: u32,
        /// Samples of a pixel.
        samples: u32,
    },
    /// An option is for images that do not move.
    #[error("{what} cannot be combined with {with}; {remedy}")]
    Beside {
        /// The option.
        what: &'static str,
        /// Option that makes the scene move.
        with: &'static str,
        /// Remedy.
        remedy: &'static str,
    },
    /// No scene is named, and the built-in one does not move.
    #[error("{option} is for scenes in files, and the built-in one has none; name a scene or a model")]
    BuiltIn {
        /// Option that makes the scene move.
        option: &'static str,
    },
    /// The image has no frames beside it, to which motion could be measured.
    #[error("`aov` motion is the motion between frames; add `frames`, such as 0..1, or `camera_path`")]
    NoFrames,
    /// A file name does not say where the number of an image goes.
    #[error("{}: {problem}; write the number of the frame once in the file's name, as %04d", path.display())]
    Name {
        /// Path of the files.
        path: PathBuf,
        /// Fault of the name.
        problem: &'static str,
    },
}
