//! Passes: the kernels that a device runs for a render, a denoised image and a display, with their
//! buffers. They are written once, for all devices.
//!
//! A [`DeviceScene`] is a scene on a device. Kernels check no index, so what they get is checked
//! here or comes from modules that answer for it; each unsafe block says which.
#![allow(unsafe_code, reason = "each launch states why the promise of `Device::run` holds")]

mod array_content;
mod bands;
mod chunk_counter;
mod denoise;
mod display;
mod film;
mod halves;
mod on_device;
mod record_digest;
mod scene;
mod scene_writer;
mod totals;
mod totals_launch;

pub(crate) use display::DisplayPass;
pub(crate) use film::{FilmDesc, Launch};
pub(crate) use halves::MeasuredNoise;
pub(crate) use on_device::{DeviceScene, StartedDisplay};
pub(crate) use record_digest::{Digest, digest_of, equal_by};
pub(crate) use scene::{SceneArrays, ValidScene, WideSource};
pub use scene_writer::WrittenArray;

use trisect_device::BackendError;

/// Returns the error of a call that comes too early, or for an image of another size.
fn misuse(message: &str) -> BackendError {
    BackendError::Misuse { message: message.to_owned() }
}
