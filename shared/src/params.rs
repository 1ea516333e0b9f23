//! Launch record of the render kernels: everything they need besides the scene's arrays.
//!
//! The host fills one for each launch; [`crate::path`] and [`crate::traversal`] read it.

use crate::camera::Camera;
use crate::sky::Sky;
use bytemuck::{Pod, Zeroable};

/// One launch: samples `first_sample..end_sample` of `rows` rows of a [share](Self::row) of the
/// image, which is a rank's rows or the whole image. 272 bytes, 17 rows.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct RenderParams {
    /// Camera. Bytes 0 to 95.
    pub camera: Camera,
    /// Sky, unless there is an environment map. Bytes 96 to 127.
    pub sky: Sky,
    /// Pixels across the whole image.
    pub width: u32,
    /// Pixels down the whole image.
    pub height: u32,
    /// First row of the launch, counted in the rows of the share.
    pub first_row: u32,
    /// Number of rows of the launch.
    pub rows: u32,
    /// Index of the launch's first sample among all samples of a pixel.
    pub first_sample: u32,
    /// Index one past the launch's last sample.
    pub end_sample: u32,
    /// 1 if the launch continues the film's sums and compensations; 0 if it starts them at zero.
    pub resume: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Maximum number of segments of a path.
    pub max_depth: u32,
    /// Root of the BVH, as a [`crate::bvh::Child`].
    pub root: u32,
    /// Number of the first planar shape among the primitives. (Single words instead of an array:
    /// each element of a uniform array takes 16 bytes.)
    pub first_planar: u32,
    /// Number of the first triangle among the primitives.
    pub first_triangle: u32,
    /// Number of the scene's lights; 0 if light sampling is off.
    pub light_count: u32,
    /// Segment from which on Russian roulette may end a path.
    pub roulette_from: u32,
    /// Bits: [`FLAG_END_OF_CHUNK`], [`FLAG_PER_PIXEL_RANGE`], [`FLAG_HIDDEN_SKY`].
    pub flags: u32,
    /// Probability that next-event estimation samples the sky, 0 to 1; 0 if light sampling is off.
    pub environment_probability: f32,
    /// Texels across the environment map; 0 without one.
    pub environment_width: u32,
    /// Texels down the environment map.
    pub environment_height: u32,
    /// Cosine of the environment map's rotation about y.
    pub environment_cos: f32,
    /// Sine of the environment map's rotation about y.
    pub environment_sin: f32,
    /// Number of the primitives in the world; the triangles of instances follow.
    pub primitive_count: u32,
    /// Maximum number of pixels that a persistent lane takes; not 0.
    pub max_lane_pixels: u32,
    /// Index of the node with the first [tile entry](crate::tile_entry), or
    /// [`NO_TILE_ENTRIES`](crate::tile_entry::NO_TILE_ENTRIES).
    pub first_tile_entry: u32,
    /// Base-2 logarithm of a tile's edge in pixels, for the tile entries.
    pub tile_shift: u32,
    /// Image row of the share's first row; 0 is the top.
    pub share_first_row: u32,
    /// Base-2 logarithm of the rows of a block of the share; 31 if the share is one block.
    pub block_shift: u32,
    /// Number of rows between two blocks of the share, which belong to other shares.
    pub block_gap: u32,
    /// Maximum radiance of a sample per channel, or [`NO_CLAMP`].
    pub max_radiance: f32,
    /// Number of the first instance among the leaves of the BVH: that of all triangles, and shapes.
    pub first_instance: u32,
    /// Number of instances.
    pub instance_count: u32,
    /// Index, in the array of nodes, of the first instance's
    /// [entry](crate::instance::InstanceEntry).
    pub first_instance_node: u32,
    /// Number of lights that are primitives: the first of all lights, sorted by primitive.
    pub area_light_count: u32,
    /// Index, in the array of lights, of the first piece of smooth glass: see
    /// [`crate::light::glass`].
    pub first_glass: u32,
    /// Number of pieces of smooth glass.
    pub glass_count: u32,
    /// Index, in the array of planar shapes, of the first portal.
    pub first_portal: u32,
    /// Number of portals; 0 if light sampling is off.
    pub portal_count: u32,
}

impl RenderParams {
    /// Returns the image row of row `index` of the launch. A share consists of blocks of rows at
    /// equal distances, as several ranks divide an image.
    #[inline(always)]
    pub fn row(&self, index: u32) -> u32 {
        row_of_share(self.share_first_row, self.block_shift, self.block_gap, self.first_row + index)
    }
}

/// Returns the image row of row `index` of a share, which begins at row `first` of the image and
/// consists of blocks of 2^`shift` rows with `gap` rows between them.
#[inline(always)]
pub fn row_of_share(first: u32, shift: u32, gap: u32, index: u32) -> u32 {
    first + index + (index >> (shift & 31)) * gap
}

/// Flag: the launch's last sample is the last of its chunk, so the compensation is added to the
/// sums.
pub const FLAG_END_OF_CHUNK: u32 = 1;
/// Flag: each pixel starts at its own sample, which [`samples`](crate::film::PixelSums::samples) in
/// the film names when the launch begins. A pixel that starts at `end_sample` is left as it is. All
/// pixels of a work group start at the same sample.
pub const FLAG_PER_PIXEL_RANGE: u32 = 2;
/// Flag: camera rays that reach the sky add nothing. All other rays see it.
pub const FLAG_HIDDEN_SKY: u32 = 4;
/// Value of `max_radiance` that clamps no sample.
pub const NO_CLAMP: f32 = f32::MAX;
/// Flag that is never set: a zero that no compiler can know (see
/// [`PixelSums::add`](crate::film::PixelSums::add)).
pub const FLAG_OPAQUE_ZERO: u32 = 1 << 31;

const _: () = assert!(size_of::<RenderParams>() == 272 && align_of::<RenderParams>() == 16);
