//! Render kernel of persistent threads: lanes take pixels from a queue.

use super::Path;
use crate::aovs::AovSums;
use crate::buffer::{SharedSlice, load_shared, store_shared};
use crate::bvh::Child;
use crate::features::{AOVS, FeatureSet, Features, INTERLEAVED, LINEAR, NEE};
use crate::film::{Compensation, PixelSums};
use crate::params::{FLAG_END_OF_CHUNK, FLAG_PER_PIXEL_RANGE, RenderParams};
use crate::scene::Scene;
use crate::tile_entry::{self, NO_TILE_ENTRIES};
use crate::traversal::{Search, Stack, closest_hit_below};
use crate::warp::{self, Counter};

/// Minimum number of lanes with a camera ray for which a warp traces camera rays
/// (docs/notebook/camera-ray-tiles.md).
const MIN_CAMERA_LANES: u32 = 14;

/// Pixels across and down of the tile that a warp starts on.
const TILE: (u32, u32) = (8, 4);

/// Returns pixel `index` of the launch's rows, counted tile by tile, and whether it exists: tiles
/// at the border have fewer pixels. A tile may span two blocks of a share whose rows are no
/// multiple of it.
#[inline(always)]
fn tiled_pixel(params: &RenderParams, index: u32) -> (u32, u32, bool) {
    let across = params.width.div_ceil(TILE.0).max(1); // no division by 0, which would be a panic
    let (tile, inside) = (index / (TILE.0 * TILE.1), index % (TILE.0 * TILE.1));
    let x = tile % across * TILE.0 + inside % TILE.0;
    let row = tile / across * TILE.1 + inside / TILE.0;
    (x, params.row(row), x < params.width && row < params.rows)
}

/// Renders pixels of the launch's rows until the queue that all lanes share is empty, each as
/// [`render_pixel`](super::render_pixel) does.
///
/// It is a kernel of persistent threads (Aila and Laine, "Understanding the Efficiency of Ray
/// Traversal on GPUs", HPG 2009): a lane that has finished its pixel takes the next of the 32 that
/// its warp took from the queue. So no lane waits for another's pixel, and a warp mostly has
/// neighbouring pixels.
///
/// A lane's state is in variables: a record of them costs Vulkan up to 18 %
/// (docs/notebook/measuring.md).
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel), for all pixels of the image. Whole warps call this,
/// with `counter` at 0 when the launch begins. The launch has less than 2^31 pixels, tiles rounded
/// up. `params.max_lane_pixels` is not 0, and so large that all lanes together may take all pixels.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn render_persistent<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    film: &mut SharedSlice<PixelSums>,
    compensations: &mut SharedSlice<Compensation>,
    aovs: &mut SharedSlice<AovSums>,
    counter: &mut Counter,
) {
    let tiles = params.width.div_ceil(TILE.0) * params.rows.div_ceil(TILE.1);
    let total = tiles * (TILE.0 * TILE.1);
    let mut batch = warp::Batch::EMPTY;
    let mut remaining_pixels = params.max_lane_pixels;
    let mut has_work = true;
    let mut busy = false;
    let (mut x, mut y) = (0, 0);
    let (mut sums, mut compensation) = (PixelSums::ZERO, Compensation::ZERO);
    let mut path = Path::new(features, params, (0, 0), 0);
    let mut tile_entry = Child(params.root);
    let (mut search, mut searching, mut stack) = (Search::ENDED, false, Stack::uninit());
    loop {
        let index = warp::take(counter, &mut batch, has_work && !busy);
        if index != warp::NO_WORK {
            let inside;
            (x, y, inside) = tiled_pixel(params, index);
            busy = index < total && inside;
            remaining_pixels -= 1;
            has_work = index < total && remaining_pixels > 0;
            if busy {
                let pixel = y * params.width + x;
                let mut first = params.first_sample;
                if params.flags & FLAG_PER_PIXEL_RANGE != 0 {
                    // SAFETY: the pixel lies inside the image.
                    first = unsafe { load_shared::<PixelSums>(film, pixel) }.samples;
                    busy = first < params.end_sample;
                }
                path = Path::new(features, params, (x, y), first);
                // SAFETY: the pixel lies inside the image.
                tile_entry = unsafe { tile_entry::tile_entry(params, scene, x, y) };
                (sums, compensation) = (PixelSums::ZERO, Compensation::ZERO);
                if params.resume != 0 {
                    // SAFETY: the pixel lies inside the image.
                    unsafe {
                        (sums, compensation) = (
                            load_shared::<PixelSums>(film, pixel),
                            load_shared::<Compensation>(compensations, pixel),
                        )
                    };
                } else if features.has::<AOVS>() {
                    // SAFETY: the pixel lies inside the image.
                    unsafe { store_shared(aovs, pixel, AovSums::ZERO) };
                }
            }
        }
        if !warp::any(busy || has_work) {
            break;
        }
        let needs_camera_ray = path.needs_camera_ray;
        let mut has_hit = false;
        if features.has::<INTERLEAVED>() && !features.has::<LINEAR>() {
            let begins = busy && !searching;
            let root = if needs_camera_ray { tile_entry } else { Child(params.root) };
            if begins && needs_camera_ray {
                path.begin_sample(features, params, x, y);
            }
            let query = path.query(features);
            // SAFETY: the caller's promise.
            unsafe {
                if begins {
                    search = Search::new(features, params, scene, path.ray, query, root, &mut stack);
                }
                search.advance(features, params, scene, path.ray, query, &mut stack);
            }
            searching = !search.has_ended();
            has_hit = busy && !searching;
        } else if traces_now(features, params, busy, needs_camera_ray) {
            let root = if needs_camera_ray { tile_entry } else { Child(params.root) };
            if needs_camera_ray {
                path.begin_sample(features, params, x, y);
            }
            let query = path.query(features);
            // SAFETY: the caller's promise.
            search.hit = unsafe { closest_hit_below(features, params, scene, path.ray, query, root) };
            has_hit = true;
        }
        // SAFETY: the caller's promise.
        if has_hit && unsafe { path.shade(features, params, scene, search.hit, aovs) } {
            path.finish_sample(features, params, &mut sums, &mut compensation);
            if path.key.sample == params.end_sample {
                busy = false;
                // SAFETY: the pixel lies inside the image.
                unsafe { store_sums(params, film, compensations, path.pixel, sums, compensation) };
            }
        }
    }
}

/// Stores the sums of a pixel.
///
/// # Safety
///
/// The pixel lies inside the image.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn store_sums(
    params: &RenderParams,
    film: &mut SharedSlice<PixelSums>,
    compensations: &mut SharedSlice<Compensation>,
    pixel: u32,
    mut sums: PixelSums,
    compensation: Compensation,
) {
    if params.flags & FLAG_END_OF_CHUNK != 0 {
        sums.compensate(compensation);
    }
    // SAFETY: the caller's promise.
    unsafe {
        store_shared(film, pixel, sums);
        store_shared(compensations, pixel, compensation);
    }
}

/// Returns whether a lane that is `busy` traces a ray now.
///
/// With tile entries a warp traces camera rays apart from others: the camera rays of a tile visit
/// few nodes, and the same ones. Not in kernels with next-event estimation, whose paths are so long
/// that lanes would wait for enough camera rays.
#[inline(always)]
fn traces_now<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    busy: bool,
    needs_camera_ray: bool,
) -> bool {
    let mut traces = busy;
    if warp::HAS_WARP_VOTES && !features.has::<NEE>() {
        let camera_lanes = warp::count(busy && needs_camera_ray);
        let traces_camera_rays = camera_lanes >= MIN_CAMERA_LANES || camera_lanes == warp::count(busy);
        let has_tile_entries = params.first_tile_entry != NO_TILE_ENTRIES;
        traces = busy && (!has_tile_entries || needs_camera_ray == traces_camera_rays);
    }
    traces
}
