//! Trisect in a browser: the library in a page's worker, through WebGPU or on the CPU.
//!
//! The worker hands a [`Request`] as JSON to a [`Session`], which answers with JSON and bytes; see
//! `page/worker.js`. On other systems the same session runs on a thread, for tests.

#[cfg(target_family = "wasm")]
mod allocator;
#[cfg(target_family = "wasm")]
mod exports;
#[cfg(target_family = "wasm")]
mod helper;
mod request;
mod session;

pub use request::{BackendName, Filter, ImageRequest, Move, Request};
pub use session::{Answer, Session, WebError};
