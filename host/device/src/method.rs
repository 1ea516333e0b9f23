//! Methods of rendering: math build, traversal and schedule.

use serde::Serialize;
use trisect_shared::features::{Features, INTERLEAVED, LINEAR, PERSISTENT, REGENERATE, WIDE};

/// Math build of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum MathMode {
    /// Each operation is rounded separately; CUDA gives the bits of the CPU.
    ///
    /// Vulkan gives them too where the driver's division and square root are correctly rounded.
    Precise,
    /// Fused multiply-add, and on CUDA approximate division and square root; not on the CPU.
    Fast,
}

/// Method of finding the closest hit. The image does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Traversal {
    /// Test of each primitive.
    Linear,
    /// Binary BVH, with a stack for each ray.
    Stack,
    /// Wide BVH, on the CPU only.
    Wide,
}

/// Minimum number of primitives for which a GPU interleaves the searches of triangles. With fewer,
/// and on CUDA with materials that take long to shade, lanes lose more by shading in small groups
/// than by waiting for searches (docs/notebook/triangles-and-trees.md).
pub(crate) const MIN_INTERLEAVED_PRIMITIVES: usize = 4096;

/// Assignment of pixels and samples to the lanes of a device. The image does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Schedule {
    /// One pixel per lane, one sample after the other; lanes of a warp wait for its longest path.
    Pixel,
    /// One pixel per lane; its next sample starts as soon as a path ends.
    Regenerate,
    /// All lanes that the device holds; each takes pixels from a queue.
    Persistent,
    /// Lanes as in `persistent`; those whose rays are done shade while the searches of others wait.
    Interleaved,
}

impl Traversal {
    /// Returns the traversal of a kernel with these features.
    pub fn of(features: Features) -> Self {
        match features & (LINEAR | WIDE) {
            LINEAR => Self::Linear,
            0 => Self::Stack,
            _ => Self::Wide,
        }
    }

    /// Returns the features of a kernel with this method.
    pub fn features(self) -> Features {
        match self {
            Self::Linear => LINEAR,
            Self::Stack => 0,
            Self::Wide => WIDE,
        }
    }
}

impl Schedule {
    /// Returns the schedule of a kernel with these features.
    pub fn of(features: Features) -> Self {
        match features & (REGENERATE | PERSISTENT | INTERLEAVED) {
            0 => Self::Pixel,
            REGENERATE => Self::Regenerate,
            few if few & INTERLEAVED == 0 => Self::Persistent,
            _ => Self::Interleaved,
        }
    }

    /// Returns the features of a kernel with this method.
    pub fn features(self) -> Features {
        match self {
            Self::Pixel => 0,
            Self::Regenerate => REGENERATE,
            Self::Persistent => REGENERATE | PERSISTENT,
            Self::Interleaved => REGENERATE | PERSISTENT | INTERLEAVED,
        }
    }
}
