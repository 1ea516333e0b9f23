//! A helper of the CPU in a browser: a module in a worker of its own that renders rows of the
//! launches of another worker's module.
//!
//! Modules share no memory, so the page copies a scene's arrays into each helper's memory when they
//! change, and rows of what a launch writes there and back; see `host/web/page/helpers.js`.

use crate::{BackendError, HostMemory};
use trisect_kernels::native::{Arguments, Array, Kernel, native};
use trisect_kernels::{EntryPoint, render_kernel};
use trisect_shared::features::Features;
use trisect_shared::params::RenderParams;

/// Copies of the arrays of a launch, and the launch.
#[derive(Debug, Default)]
pub struct Helper {
    arrays: Vec<HostMemory>,
    launch: Option<(EntryPoint, Kernel, RenderParams)>,
}

impl Helper {
    /// Allocates an array of a launch in place of an earlier one with this index, and returns the
    /// address of its first byte. Its bytes are zeros.
    pub fn allocate(&mut self, index: usize, bytes: usize) -> *mut u8 {
        while self.arrays.len() <= index {
            self.arrays.push(HostMemory::new(0));
        }
        if let Some(array) = self.arrays.get_mut(index) {
            // The earlier one first, so that both need not fit.
            *array = HostMemory::new(0);
            *array = HostMemory::new(bytes);
        }
        self.address(index, 0)
    }

    /// Returns the address of a byte of an array.
    pub fn address(&self, index: usize, byte: usize) -> *mut u8 {
        self.arrays.get(index).map_or(std::ptr::null_mut(), |array| array.first().wrapping_add(byte))
    }

    /// Begins a launch of the render kernel with these features.
    ///
    /// # Errors
    ///
    /// [`BackendError::Misuse`] if there is no such kernel, or the parameters are none of it.
    pub fn begin(&mut self, features: Features, params: &[u8]) -> Result<(), BackendError> {
        self.launch = None;
        let of = render_kernel(features);
        let kernel = native(of).filter(|_| of.extra == 0);
        let kernel = kernel.ok_or_else(|| super::misuse(super::NAME, "there is no such kernel"))?;
        let params = bytemuck::try_pod_read_unaligned(params)
            .map_err(|_| super::misuse(super::NAME, "the parameters are none of a render kernel"))?;
        self.launch = Some((of, kernel.baseline, params));
        Ok(())
    }

    /// Returns the row of the image that is row `y` of the launch.
    pub fn image_row(&self, y: u32) -> u32 {
        self.launch.as_ref().map_or(0, |(_, _, params)| params.row(y))
    }

    /// Renders row `y` of the launch.
    ///
    /// # Errors
    ///
    /// [`BackendError::Misuse`] if no launch was begun, or arrays are missing.
    ///
    /// # Safety
    ///
    /// As [`Device::run`](crate::Device::run), for the launch that was begun.
    #[allow(unsafe_code, reason = "kernels answer for nothing that their caller hands them")]
    pub unsafe fn render(&self, y: u32) -> Result<(), BackendError> {
        let launch = self.launch.as_ref().filter(|(of, ..)| self.arrays.len() >= of.arrays());
        let (of, kernel, params) = launch.ok_or_else(|| super::misuse(super::NAME, "no launch was begun"))?;
        let arrays: Vec<Array> =
            self.arrays.iter().map(|array| Array { first: array.first(), bytes: array.bytes() }).collect();
        let arguments =
            Arguments { params: bytemuck::bytes_of(params), arrays: &arrays, features: of.features };
        // SAFETY: the caller's promise.
        unsafe { kernel(&arguments, 0..params.width, y) };
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn launches_are_checked() {
        let mut helper = Helper::default();
        let params = RenderParams { share_first_row: 3, block_shift: 1, block_gap: 4, ..Zeroable::zeroed() };
        helper.begin(0, bytemuck::bytes_of(&params)).unwrap();
        assert_eq!([0, 1, 2, 3].map(|y| helper.image_row(y)), [3, 4, 9, 10]);
        for short in [0, 4, size_of::<RenderParams>() - 1] {
            let error = helper.begin(0, &bytemuck::bytes_of(&params)[..short]).unwrap_err();
            assert!(error.to_string().contains("parameters"), "{error}");
        }
        assert_eq!(helper.image_row(1), 0);
        for begin in [false, true] {
            if begin {
                helper.begin(0, bytemuck::bytes_of(&params)).unwrap();
            }
            // SAFETY: without arrays no kernel runs.
            #[allow(unsafe_code, reason = "see above")]
            let rendered = unsafe { helper.render(0) };
            assert!(rendered.is_err(), "{begin}");
        }
    }

    #[test]
    fn arrays_are_zeros_at_their_addresses() {
        let mut helper = Helper::default();
        let first = helper.allocate(2, 64);
        assert_eq!(helper.address(2, 16), first.wrapping_add(16));
        assert!(helper.address(3, 0).is_null());
        assert!(!helper.allocate(3, 0).is_null());
        assert_eq!(helper.arrays.iter().map(HostMemory::bytes).collect::<Vec<_>>(), [0, 0, 64, 0]);
        helper.allocate(2, 8);
        assert_eq!(helper.arrays[2].bytes(), 8);
    }
}
