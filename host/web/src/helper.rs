//! Functions that the worker of a helper calls; see `page/helper.js`.

use std::cell::RefCell;
use trisect_device::cpu::Helper;
use wasm_bindgen::JsError;
use wasm_bindgen::prelude::wasm_bindgen;

thread_local! {
    static HELPER: RefCell<Helper> = RefCell::default();
}

/// Allocates an array of launches, and returns the address of its first byte.
#[wasm_bindgen]
pub fn allocate_array(index: usize, bytes: usize) -> usize {
    HELPER.with_borrow_mut(|helper| helper.allocate(index, bytes) as usize)
}

/// Begins a launch.
///
/// # Errors
///
/// An error for a launch of no render kernel.
#[wasm_bindgen]
pub fn begin_rows(features: u64, params: &[u8]) -> Result<(), JsError> {
    HELPER.with_borrow_mut(|helper| helper.begin(features, params)).map_err(JsError::from)
}

/// Returns the address, in an array with `row_bytes` bytes for each row of the image, of row `y` of
/// the launch.
#[wasm_bindgen]
pub fn place_of_row(index: usize, y: u32, row_bytes: usize) -> usize {
    HELPER.with_borrow(|helper| helper.address(index, helper.image_row(y) as usize * row_bytes) as usize)
}

/// Renders row `y` of the launch.
///
/// # Errors
///
/// An error if no launch was begun.
#[wasm_bindgen]
#[allow(unsafe_code, reason = "the page keeps the promise")]
pub fn render_row(y: u32) -> Result<(), JsError> {
    // SAFETY: the arrays are copies of those of a launch for which the same was promised, and
    // nothing else accesses this module's memory.
    HELPER.with_borrow(|helper| unsafe { helper.render(y) }).map_err(JsError::from)
}
