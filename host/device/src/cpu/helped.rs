//! Launches whose rows [helpers](super::Helper) render, too: the side of the module that launches,
//! whose page has the functions of `host/web/page/helpers.js`.
#![allow(unsafe_code, reason = "the page copies bytes of this module's memory")]

use super::Memory;
use trisect_kernels::native::{Arguments, Kernel};
use trisect_kernels::{EntryPoint, render_kernel};
use trisect_shared::aovs::AovSums;
use trisect_shared::features::{AOVS, has_any};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::params::RenderParams;

#[link(wasm_import_module = "./helpers.js")]
unsafe extern "C" {
    /// Returns the number of helpers.
    #[link_name = "count"]
    pub safe fn count() -> u32;
    /// Gives helpers an array that the launch only reads, unless they have it with this stamp.
    fn share(array: u32, stamp: u64, first: *const u8, bytes: usize);
    /// Gives helpers an array of `bytes` bytes that has a row for each of the image.
    fn share_rows(array: u32, bytes: usize, row_bytes: usize, rows: u32);
    /// Lends helpers a row of such an array: row `y` of the launch.
    fn lend(array: u32, y: u32, first: *const u8);
    /// Starts a launch: helpers take its rows from now on.
    fn begin(features: u64, params: *const u8, bytes: usize, rows: u32);
    /// Takes the next row; `rows` or more if none is left.
    safe fn next_row() -> u32;
    /// Waits until all helpers are done.
    safe fn end();
    /// Returns 1 if a helper rendered this row.
    safe fn is_helped(y: u32) -> u32;
    /// Copies a row back that was lent.
    fn take_back(array: u32, y: u32, first: *mut u8);
    /// Ends the launch, of which helpers rendered this number of rows.
    safe fn finish(rows: u32);
}

/// Returns the index and the record's size of each written array that has a record for each pixel.
/// The counter of a queue has none, and the CPU's kernels do not use it.
fn by_pixel(of: EntryPoint) -> Vec<(usize, usize)> {
    let aovs = if has_any(of.features, AOVS) { size_of::<AovSums>() } else { 0 };
    [(0, size_of::<PixelSums>()), (1, size_of::<Compensation>()), (3, aovs)]
        .map(|(array, record)| (of.reads + array, record))
        .into_iter()
        .filter(|&(_, record)| record > 0)
        .collect()
}

/// Runs a launch of a render kernel with helpers, if there are any. Returns false if it was not run.
///
/// # Safety
///
/// As [`Device::run`](crate::Device::run).
pub(super) unsafe fn dispatch(
    of: EntryPoint,
    kernel: Kernel,
    arguments: &Arguments<'_>,
    memories: &[&Memory],
    threads: u32,
) -> bool {
    if count() == 0 || of.extra > 0 || of != render_kernel(of.features) {
        return false;
    }
    let Ok(params) = bytemuck::try_pod_read_unaligned::<RenderParams>(arguments.params) else { return false };
    let rows = threads.min(params.rows);
    if rows < 2 {
        return false;
    }
    let (width, height) = (params.width as usize, params.height as usize);
    let by_pixel = by_pixel(of);
    let fits = |&(array, record): &(usize, usize)| {
        arguments.arrays.get(array).is_some_and(|array| array.bytes / record / width.max(1) >= height)
    };
    if !by_pixel.iter().all(fits) {
        return false;
    }
    let row_bytes = |record: usize| record * width;
    // SAFETY: the caller's promise: each row of the launch is one of the image, whose rows these
    // arrays have.
    let place = |array: usize, record: usize, y: u32| unsafe {
        arguments.arrays.get_unchecked(array).first.add(params.row(y) as usize * row_bytes(record))
    };
    for (index, (array, memory)) in arguments.arrays.iter().zip(memories).enumerate() {
        match by_pixel.iter().find(|(written, _)| *written == index) {
            // What is written but not by pixel is not used.
            // SAFETY: the page reads no byte.
            None if index >= of.reads => unsafe { share(index as u32, 0, array.first, 0) },
            // SAFETY: the page reads these bytes, which are valid, until the launch ends.
            None => unsafe { share(index as u32, memory.stamp(), array.first, array.bytes) },
            Some(&(_, record)) => {
                // SAFETY: as above.
                unsafe { share_rows(index as u32, row_bytes(record) * height, row_bytes(record), rows) };
                // SAFETY: as above.
                (0..rows).for_each(|y| unsafe { lend(index as u32, y, place(index, record, y)) });
            }
        }
    }
    // SAFETY: as above.
    unsafe { begin(of.features, arguments.params.as_ptr(), arguments.params.len(), rows) };
    let mut is_own = vec![false; rows as usize];
    let mut render = |y: u32| {
        // SAFETY: the caller's promise; no helper's copy is in this memory.
        unsafe { kernel(arguments, 0..params.width, y) };
        if let Some(own) = is_own.get_mut(y as usize) {
            *own = true;
        }
    };
    loop {
        match next_row() {
            y if y < rows => render(y),
            _ => break,
        }
    }
    end();
    let others: Vec<u32> = (0..rows).zip(&is_own).filter(|(_, own)| !**own).map(|(y, _)| y).collect();
    let mut helped = 0;
    for y in others {
        if is_helped(y) == 0 {
            // A helper that failed left the row, of which this memory is as before the launch.
            // SAFETY: as above.
            unsafe { kernel(arguments, 0..params.width, y) };
            continue;
        }
        helped += 1;
        for &(array, record) in &by_pixel {
            // SAFETY: the page writes the row's bytes, which nothing else accesses.
            unsafe { take_back(array as u32, y, place(array, record, y)) };
        }
    }
    finish(helped);
    true
}
