//! Kernels: the samples of a pixel, and the pixels of a launch.

use super::Path;
use crate::buffer::{Slots, load, load_slot, store, store_slot};
use crate::bvh::Child;
use crate::features::{Features, GUIDES, LIGHTS, REGENERATE, has, has_any};
use crate::film::{Carry, PixelSums};
use crate::guides::Guides;
use crate::params::{FLAG_FINISH, FLAG_OWN, RenderParams};
use crate::rng::PathKey;
use crate::rows::Stored;
use crate::scene::Scene;
use crate::traversal::closest_hit_below;
use crate::view::{self, NO_VIEW};
use crate::warp::{self, Counter};

/// Adds the launch's samples of pixel (`x`, `y`), in the order of their indices, to `film[slot]`, and what they round off to
/// `carries[slot]`. Whether both stay in memory between samples is the caller's choice: in Vulkan's buffers they do, and are 11 % faster
/// there on scenes with light sampling; CUDA is 19 % slower so, and hands over variables of its own.
///
/// With [`REGENERATE`] a lane whose path ended starts its next sample at once; without it waits for the longest path of its warp.
///
/// # Safety
///
/// The scene's indices, `params.root` among them, were proven as [`crate::buffer`] says; `slot` is below both lengths, and with [`GUIDES`] there
/// are guides for each pixel of the image. All lanes of
/// a warp that reach their end call this together, for as many samples each.
#[inline(always)]
#[allow(clippy::too_many_arguments, unsafe_code, reason = "buffers each; see buffer")]
pub unsafe fn render_pixel<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    x: u32,
    y: u32,
    film: &mut [Stored<PixelSums>],
    carries: &mut [Stored<Carry>],
    slot: u32,
    guides: &mut Slots<Guides>,
) {
    let pixel = y * params.width + x;
    let mut first = params.first_sample;
    if params.flags & FLAG_OWN != 0 {
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
            store(carries, slot, Carry::ZERO);
            if const { has(FEATURES, GUIDES) } {
                store_slot(guides, pixel, Guides::ZERO);
            }
        }
    }
    // SAFETY: the caller's promise.
    let entry = unsafe { view::entry(params, scene, x, y) };
    let mut path = Path::new(PathKey { seed: params.seed, pixel, sample: first });
    while path.key.sample < params.end_sample {
        let begins = path.fresh;
        if begins {
            path.begin::<FEATURES>(params, x, y);
        }
        let mut ended;
        let mut root = if begins { entry } else { Child(params.root) };
        loop {
            // SAFETY: the caller's promise.
            ended = unsafe { turn::<FEATURES>(params, scene, &mut path, root, guides) };
            root = Child(params.root);
            if ended || const { has(FEATURES, REGENERATE) } {
                break;
            }
        }
        if const { !has(FEATURES, REGENERATE) } {
            warp::meet();
        }
        if ended {
            // SAFETY: the caller's promise, and the stores above or of the launch before.
            unsafe {
                let (mut sums, mut carry) = (load::<PixelSums>(film, slot), load::<Carry>(carries, slot));
                path.end::<FEATURES>(params, &mut sums, &mut carry);
                store(film, slot, sums);
                store(carries, slot, carry);
            }
        }
    }
    if params.flags & FLAG_FINISH != 0 {
        // SAFETY: as above.
        unsafe {
            let mut sums = load::<PixelSums>(film, slot);
            sums.finish(load::<Carry>(carries, slot));
            store(film, slot, sums);
        }
    }
}

/// Traces the path's ray, from `root` down, and goes on from there. Returns whether the path ended.
///
/// # Safety
///
/// As [`render_pixel`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn turn<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    path: &mut Path,
    root: Child,
    guides: &mut Slots<Guides>,
) -> bool {
    // SAFETY: the caller's promise.
    unsafe {
        let reach = path.reach::<FEATURES>(params);
        let hit = closest_hit_below::<FEATURES>(params, scene, path.ray, reach, root);
        path.advance::<FEATURES>(params, scene, hit, guides)
    }
}

/// Lanes with a camera ray from which on a warp traces those. Measured on an H100: 10 and 16 are 1 % slower, 24 are 5 %.
const CAMERA_LANES: u32 = 14;

/// Pixels across and down a tile: a warp starts on one.
const TILE: (u32, u32) = (8, 4);

/// Pixel `index` of the launch's rows, tile by tile, and whether there is one: tiles at the border have less. Those of blocks of rows that are no
/// multiple of a tile lie on two.
#[inline(always)]
fn pixel_of(params: &RenderParams, index: u32) -> (u32, u32, bool) {
    let across = params.width.div_ceil(TILE.0).max(1); // no division by 0, which would be a panic
    let (tile, inside) = (index / (TILE.0 * TILE.1), index % (TILE.0 * TILE.1));
    let x = tile % across * TILE.0 + inside % TILE.0;
    let row = tile / across * TILE.1 + inside / TILE.0;
    (x, params.row(row), x < params.width && row < params.rows)
}

/// Renders pixels of the launch's rows until a queue that all lanes share has no more: what [`render_pixel`] does, by persistent threads
/// (Aila and Laine, "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009). A lane that is done with its pixel takes the next one
/// of the 32 that its warp took; so no lane waits for another's pixel, and neighbours mostly are in one warp.
///
/// # Safety
///
/// As [`render_pixel`], for all pixels of the image; whole warps call this, with `counter` at 0 when the launch begins, and
/// the launch has less than 2^31 pixels, tiles rounded up. All lanes together take enough of them, by `params.lane_pixels`, which is not 0.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn render_queue<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    film: &mut Slots<PixelSums>,
    carries: &mut Slots<Carry>,
    guides: &mut Slots<Guides>,
    counter: &mut Counter,
) {
    let tiles = params.width.div_ceil(TILE.0) * params.rows.div_ceil(TILE.1);
    let total = tiles * (TILE.0 * TILE.1);
    let mut batch = warp::Batch::EMPTY;
    let mut left = params.lane_pixels;
    let mut open = true;
    let mut busy = false;
    let (mut x, mut y) = (0, 0);
    let (mut sums, mut carry) = (PixelSums::ZERO, Carry::ZERO);
    let mut path = Path::new(PathKey { seed: params.seed, pixel: 0, sample: 0 });
    let mut entry = Child(params.root);
    loop {
        let index = warp::take(counter, &mut batch, open && !busy);
        if index != warp::NOTHING {
            let inside;
            (x, y, inside) = pixel_of(params, index);
            busy = index < total && inside;
            left -= 1;
            open = index < total && left > 0;
            if busy {
                let pixel = y * params.width + x;
                let mut first = params.first_sample;
                if params.flags & FLAG_OWN != 0 {
                    // SAFETY: the pixel is of the image.
                    first = unsafe { load_slot::<PixelSums>(film, pixel) }.samples;
                    busy = first < params.end_sample;
                }
                path = Path::new(PathKey { seed: params.seed, pixel, sample: first });
                // SAFETY: the pixel is of the image.
                entry = unsafe { view::entry(params, scene, x, y) };
                (sums, carry) = (PixelSums::ZERO, Carry::ZERO);
                if params.resume != 0 {
                    // SAFETY: the pixel is of the image.
                    unsafe {
                        (sums, carry) =
                            (load_slot::<PixelSums>(film, pixel), load_slot::<Carry>(carries, pixel))
                    };
                } else if const { has(FEATURES, GUIDES) } {
                    // SAFETY: the pixel is of the image.
                    unsafe { store_slot(guides, pixel, Guides::ZERO) };
                }
            }
        }
        if !warp::any(busy || open) {
            break;
        }
        // Where the camera has a view, its rays are traced together, and others together: those of a tile visit a few nodes, and the same
        // ones. Not where lights make paths so long that lanes would wait for enough of them.
        let mut now = busy;
        if const { warp::TOGETHER && !has_any(FEATURES, LIGHTS) } {
            let camera = warp::count(busy && path.fresh);
            let fresh = camera >= CAMERA_LANES || camera == warp::count(busy);
            let apart = params.first_view != NO_VIEW;
            now = busy && (!apart || path.fresh == fresh);
        }
        if now {
            let begins = path.fresh;
            let root = if begins { entry } else { Child(params.root) };
            if begins {
                path.begin::<FEATURES>(params, x, y);
            }
            // SAFETY: the caller's promise.
            if unsafe { turn::<FEATURES>(params, scene, &mut path, root, guides) } {
                path.end::<FEATURES>(params, &mut sums, &mut carry);
                if path.key.sample == params.end_sample {
                    busy = false;
                    if params.flags & FLAG_FINISH != 0 {
                        sums.finish(carry);
                    }
                    // SAFETY: the pixel is of the image.
                    unsafe {
                        store_slot(film, path.key.pixel, sums);
                        store_slot(carries, path.key.pixel, carry);
                    }
                }
            }
        }
    }
}
