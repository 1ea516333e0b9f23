//! Sums of AOVs at the first hits of a pixel's camera rays: normal, albedo, position, emission.
//!
//! The denoiser finds edges by them and keeps emission, which has no noise, apart. A kernel with
//! [`AOVS`](crate::features::AOVS) sums them over the paths that it traces, without further rays;
//! the host also writes them to image files.

use crate::buffer::{SharedSlice, load_shared, store_shared};
pub use crate::records::aovs::{AovSums, SurfaceAovs};

/// Applies `change` to the AOV sums of `pixel`.
///
/// # Safety
///
/// `aovs` has a record for this pixel.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(crate) unsafe fn update_pixel(
    aovs: &mut SharedSlice<AovSums>,
    pixel: u32,
    change: impl FnOnce(&mut AovSums),
) {
    // SAFETY: the caller's promise.
    unsafe {
        let mut of_pixel = load_shared::<AovSums>(aovs, pixel);
        change(&mut of_pixel);
        store_shared(aovs, pixel, of_pixel);
    }
}
