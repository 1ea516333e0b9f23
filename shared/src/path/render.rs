//! Render kernel of a pixel a lane: the loop over its samples.

use super::Path;
use crate::aovs::AovSums;
use crate::buffer::{SharedSlice, load, store, store_shared};
use crate::buffer_layout::Packed;
use crate::bvh::Child;
use crate::features::{AOVS, FeatureSet, Features, REGENERATE};
use crate::film::{Compensation, PixelSums};
use crate::params::{FLAG_END_OF_CHUNK, FLAG_PER_PIXEL_RANGE, RenderParams};
use crate::scene::Scene;
use crate::tile_entry;
use crate::traversal::closest_hit_below;
use crate::warp;

/// Adds the launch's samples of pixel (`x`, `y`), in index order, to `film[slot]`, and their
/// rounding errors to `compensations[slot]`.
///
/// The caller decides where both are kept between samples: Vulkan's entry points pass the buffers,
/// which is faster there, CUDA's pass local variables (docs/notebook/robustness-costs.md).
///
/// With [`REGENERATE`] a lane whose path ended starts its next sample at once; without it, the lane
/// waits for the longest path of its warp.
///
/// # Safety
///
/// The scene's indices, `params.root` among them, were proven as [`crate::buffer`] says. `slot` is
/// below both lengths. With [`AOVS`], `aovs` has a record for each pixel of the image. All lanes of
/// a warp that have not ended call this together, for equally many samples each.
#[inline(always)]
#[allow(clippy::too_many_arguments, unsafe_code, reason = "one argument per buffer; see buffer")]
pub unsafe fn render_pixel<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    x: u32,
    y: u32,
    film: &mut [Packed<PixelSums>],
    compensations: &mut [Packed<Compensation>],
    slot: u32,
    aovs: &mut SharedSlice<AovSums>,
) {
    let pixel = y * params.width + x;
    let mut first = params.first_sample;
    if params.flags & FLAG_PER_PIXEL_RANGE != 0 {
        // SAFETY: the caller's promise.
        first = unsafe { load::<PixelSums>(film, slot) }.samples;
        if first >= params.end_sample {
            return;
        }
    }
    if params.resume == 0 {
        // SAFETY: the caller's promise.
        unsafe {
            store(film, slot, PixelSums::ZERO);
            store(compensations, slot, Compensation::ZERO);
            if features.has::<AOVS>() {
                store_shared(aovs, pixel, AovSums::ZERO);
            }
        }
    }
    // SAFETY: the caller's promise.
    let tile_entry = unsafe { tile_entry::tile_entry(params, scene, x, y) };
    let mut path = Path::new(features, params, (x, y), first);
    while path.key.sample < params.end_sample {
        let needs_camera_ray = path.needs_camera_ray;
        if needs_camera_ray {
            path.begin_sample(features, params, x, y);
        }
        let mut ended;
        let mut root = if needs_camera_ray { tile_entry } else { Child(params.root) };
        loop {
            // SAFETY: the caller's promise.
            ended = unsafe { trace_segment(features, params, scene, &mut path, root, aovs) };
            root = Child(params.root);
            if ended || features.has::<REGENERATE>() {
                break;
            }
        }
        if !features.has::<REGENERATE>() {
            warp::sync_warp();
        }
        if ended {
            // SAFETY: the caller's promise; both were stored above or by the previous launch.
            unsafe {
                let (mut sums, mut compensation) =
                    (load::<PixelSums>(film, slot), load::<Compensation>(compensations, slot));
                path.finish_sample(features, params, &mut sums, &mut compensation);
                store(film, slot, sums);
                store(compensations, slot, compensation);
            }
        }
    }
    if params.flags & FLAG_END_OF_CHUNK != 0 {
        // SAFETY: as above.
        unsafe {
            let mut sums = load::<PixelSums>(film, slot);
            sums.compensate(load::<Compensation>(compensations, slot));
            store(film, slot, sums);
        }
    }
}

/// Traces the path's ray, from `root` down, and continues the path from the hit. Returns whether
/// the path ended.
///
/// # Safety
///
/// As [`render_pixel`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn trace_segment<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    path: &mut Path,
    root: Child,
    aovs: &mut SharedSlice<AovSums>,
) -> bool {
    // SAFETY: the caller's promise.
    unsafe {
        let query = path.query(features);
        let hit = closest_hit_below(features, params, scene, path.ray, query, root);
        path.shade(features, params, scene, hit, aovs)
    }
}
