//! The launch record: all that a render kernel knows besides the scene.

use crate::camera::Camera;
use crate::sky::Sky;
use bytemuck::{Pod, Zeroable};

/// One launch: samples `first_sample..end_sample` of `rows` rows of its [share](Self::row) of the image. 240 bytes, fifteen rows.
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
    /// The launch's first row, of those of its share.
    pub first_row: u32,
    /// Rows of the launch.
    pub rows: u32,
    /// Index of the first sample, of all samples of a pixel.
    pub first_sample: u32,
    /// One past the last sample.
    pub end_sample: u32,
    /// Whether the film's sums, and what they rounded off, go on (1) or start anew (0).
    pub resume: u32,
    /// Of the random numbers.
    pub seed: u32,
    /// The greatest number of segments of a path.
    pub max_depth: u32,
    /// Root of the BVH, as a [`crate::bvh::Child`].
    pub root: u32,
    /// Number of the first flat shape among the primitives. (Words, not an array: a uniform array's elements take 16 bytes each.)
    pub first_planar: u32,
    /// Number of the first triangle among the primitives.
    pub first_triangle: u32,
    /// Length of the scene's lights; 0 where light sampling is off.
    pub light_count: u32,
    /// A path may end at random from this segment on.
    pub roulette_from: u32,
    /// [`FLAG_SCHLICK`], [`FLAG_HOLES`], [`FLAG_END_OF_CHUNK`], [`FLAG_PADDED_BOXES`], [`FLAG_PER_PIXEL_RANGE`].
    pub flags: u32,
    /// Chance that next-event estimation chooses the panorama; 0 where light sampling is off.
    pub environment_probability: f32,
    /// Texels across; 0 for no panorama.
    pub environment_width: u32,
    /// Texels down.
    pub environment_height: u32,
    /// Cosine of the panorama's rotation about y.
    pub environment_cos: f32,
    /// Its sine.
    pub environment_sin: f32,
    /// Number of the scene's primitives.
    pub primitive_count: u32,
    /// Pixels that a persistent lane takes, at most.
    pub max_lane_pixels: u32,
    /// The first node of the camera's [view](crate::tile_entry), or [`NO_TILE_ENTRIES`](crate::tile_entry::NO_TILE_ENTRIES).
    pub first_tile_entry: u32,
    /// Pixels along a tile's edge there, as a power of two.
    pub tile_shift: u32,
    /// The share's first row of the image; 0 is the top.
    pub share_first_row: u32,
    /// Rows of a block of the share, as a power of two; 31 for all rows in one.
    pub block_shift: u32,
    /// Rows of others between two blocks.
    pub block_gap: u32,
    /// The most that a channel of a sample's radiance is. [`NO_CLAMP`] for any.
    pub max_radiance: f32,
}

impl RenderParams {
    /// The row of the image that row `index` of the launch is. A share of the image is blocks of rows at equal distances.
    #[inline(always)]
    pub fn row(&self, index: u32) -> u32 {
        let of_share = self.first_row + index;
        self.share_first_row + of_share + (of_share >> (self.block_shift & 31)) * self.block_gap
    }
}

/// In a kernel that can do both: dielectrics reflect by Schlick's approximation.
pub const FLAG_SCHLICK: u32 = 1;
/// Some surface has holes: shadow rays look at what they hit.
pub const FLAG_HOLES: u32 = 2;
/// The launch's last sample is its chunk's last: what the sums rounded off is added to them.
pub const FLAG_END_OF_CHUNK: u32 = 4;
/// The boxes of the tree have [room](crate::slabs) for all rays of the scene.
pub const FLAG_PADDED_BOXES: u32 = 8;
/// Each pixel begins at a sample of its own, which the film says in [`samples`](crate::film::PixelSums::samples) when the launch begins; one that
/// begins at the launch's end takes none and stays as it is. Those of a work group begin at the same.
pub const FLAG_PER_PIXEL_RANGE: u32 = 16;
/// No sample is as bright.
pub const NO_CLAMP: f32 = f32::MAX;
/// Never set: a zero that no compiler knows (see [`PixelSums::add`](crate::film::PixelSums::add)).
pub const FLAG_OPAQUE_ZERO: u32 = 1 << 31;

const _: () = assert!(size_of::<RenderParams>() == 240 && align_of::<RenderParams>() == 16);
