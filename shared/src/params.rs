//! The launch record: all that a render kernel knows besides the scene.

use crate::camera::Camera;
use crate::sky::Sky;
use bytemuck::{Pod, Zeroable};

/// One launch: samples `first_sample..end_sample` of rows `first_row..first_row + rows`. 176 bytes, eleven rows.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct RenderParams {
    /// Bytes 0 to 95.
    pub camera: Camera,
    /// Bytes 96 to 127.
    pub sky: Sky,
    /// Pixels across the whole image.
    pub width: u32,
    /// Pixels down the whole image.
    pub height: u32,
    /// The launch's first row; 0 is the top.
    pub first_row: u32,
    /// Rows of the launch.
    pub rows: u32,
    /// Index of the first sample, of all samples of a pixel.
    pub first_sample: u32,
    /// One past the last sample.
    pub end_sample: u32,
    /// Whether the film's sums go on (1) or start anew (0).
    pub resume: u32,
    /// Of the random numbers.
    pub seed: u32,
    /// The greatest number of segments of a path.
    pub depth: u32,
    /// Root of the BVH, as a [`crate::bvh::Child`].
    pub root: u32,
    /// Unused. (Words, not an array: a uniform array's elements would take 16 bytes each.)
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
}

const _: () = assert!(size_of::<RenderParams>() == 176 && align_of::<RenderParams>() == 16);
