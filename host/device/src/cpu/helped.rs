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
    safe fn share_rows(array: u32, bytes: usize, row_bytes: usize, rows: u32);
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

/// Stamp of an array that no kernel of the CPU uses, and that helpers have without bytes.
const UNUSED: u64 = 0;

/// Launch of a render kernel that helpers join.
struct Launch<'a> {
    of: EntryPoint,
    kernel: Kernel,
    arguments: &'a Arguments<'a>,
    params: RenderParams,
    rows: u32,
    /// Index and record's size of each written array that has a record for each pixel.
    by_pixel: Vec<(usize, usize)>,
}

/// Runs a launch of a render kernel with helpers, if there are any. Returns false if it did not.
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
    let Some(launch) = Launch::new(of, kernel, arguments, threads).filter(|_| count() > 0) else {
        return false;
    };
    // SAFETY: the caller's promise.
    unsafe {
        launch.share(memories);
        let is_own = launch.render();
        end();
        finish(launch.collect(&is_own));
    }
    true
}

impl<'a> Launch<'a> {
    /// Returns a launch of a render kernel; `None` if it is another, or has too few rows to share.
    fn new(of: EntryPoint, kernel: Kernel, arguments: &'a Arguments<'a>, threads: u32) -> Option<Self> {
        if of.extra > 0 || of != render_kernel(of.features) {
            return None;
        }
        let params = bytemuck::try_pod_read_unaligned::<RenderParams>(arguments.params).ok()?;
        let rows = threads.min(params.rows);
        // The counter of a queue, which is written too, has no record for each pixel.
        let aovs = if has_any(of.features, AOVS) { size_of::<AovSums>() } else { 0 };
        let by_pixel: Vec<_> = [(0, size_of::<PixelSums>()), (1, size_of::<Compensation>()), (3, aovs)]
            .map(|(array, record)| (of.reads + array, record))
            .into_iter()
            .filter(|&(_, record)| record > 0)
            .collect();
        let launch = Self { of, kernel, arguments, params, rows, by_pixel };
        let has_rows = |&(array, record): &(usize, usize)| {
            let bytes = arguments.arrays.get(array).map_or(0, |array| array.bytes);
            bytes / launch.row_bytes(record).max(1) >= params.height as usize
        };
        let is_shared = rows > 1 && launch.by_pixel.iter().all(has_rows);
        is_shared.then_some(launch)
    }

    fn row_bytes(&self, record: usize) -> usize {
        record * self.params.width as usize
    }

    /// Returns the address of row `y` of the launch in a written array.
    ///
    /// # Safety
    ///
    /// The row is one of the launch.
    unsafe fn place(&self, array: usize, record: usize, y: u32) -> *mut u8 {
        let byte = self.params.row(y) as usize * self.row_bytes(record);
        // SAFETY: rows of the launch are rows of the image, which the array has.
        unsafe { self.arguments.arrays.get_unchecked(array).first.add(byte) }
    }

    /// Gives the launch and its arrays to helpers, which begin.
    ///
    /// # Safety
    ///
    /// As [`dispatch`].
    unsafe fn share(&self, memories: &[&Memory]) {
        for (index, (array, memory)) in (0u32..).zip(self.arguments.arrays.iter().zip(memories)) {
            let of = index as usize;
            match self.by_pixel.iter().find(|(written, _)| *written == of) {
                // SAFETY: the page reads no byte.
                None if of >= self.of.reads => unsafe { share(index, UNUSED, array.first, 0) },
                // SAFETY: the page reads these bytes, which are valid, before `begin` returns.
                None => unsafe { share(index, memory.stamp(), array.first, array.bytes) },
                Some(&(_, record)) => {
                    let (row, height) = (self.row_bytes(record), self.params.height as usize);
                    share_rows(index, row * height, row, self.rows);
                    // SAFETY: the page reads the row's bytes before it returns.
                    (0..self.rows).for_each(|y| unsafe { lend(index, y, self.place(of, record, y)) });
                }
            }
        }
        let params = self.arguments.params;
        // SAFETY: the page reads these bytes before it returns.
        unsafe { begin(self.of.features, params.as_ptr(), params.len(), self.rows) };
    }

    /// Renders rows until none is left. Returns which were rendered here.
    ///
    /// # Safety
    ///
    /// As [`dispatch`].
    unsafe fn render(&self) -> Vec<bool> {
        let mut is_own = vec![false; self.rows as usize];
        loop {
            let y = next_row();
            let Some(own) = is_own.get_mut(y as usize) else { break };
            // SAFETY: the caller's promise; nothing else takes this row.
            unsafe { self.render_row(y) };
            *own = true;
        }
        is_own
    }

    /// # Safety
    ///
    /// As [`dispatch`]; the row's records are as before the launch.
    unsafe fn render_row(&self, y: u32) {
        // SAFETY: the caller's promise.
        unsafe { (self.kernel)(self.arguments, 0..self.params.width, y) };
    }

    /// Copies the rows here that helpers rendered, and renders those that they left. Returns the
    /// number of the former.
    ///
    /// # Safety
    ///
    /// As [`dispatch`]; no helper has the launch any more.
    unsafe fn collect(&self, is_own: &[bool]) -> u32 {
        let mut helped = 0;
        for (y, _) in (0u32..).zip(is_own).filter(|(_, own)| !**own) {
            if is_helped(y) == 0 {
                // SAFETY: the caller's promise; only copies of the row were written.
                unsafe { self.render_row(y) };
                continue;
            }
            helped += 1;
            for &(array, record) in &self.by_pixel {
                // SAFETY: the page writes the row's bytes, which nothing else accesses.
                unsafe { take_back(array as u32, y, self.place(array, record, y)) };
            }
        }
        helped
    }
}
