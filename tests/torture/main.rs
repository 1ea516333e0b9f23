//! The torture tests of numerical robustness, by number: one generic function each, for the
//! CPU, wgpu with and without naga, and CUDA. Each prints a line for the table in `docs/accuracy.md`; see `trisect_tests::report`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

mod enclosures;
mod estimates;
mod films;
mod firewall;
mod furnace;
mod scale;
