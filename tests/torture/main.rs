//! The torture tests: numerical stability at the extremes, on every backend. `docs/accuracy.md` lists them by number, with what
//! each found where.
//!
//! A test is one generic function, `tNN_name`, instantiated for each backend; it ends with a line from
//! [`trisect_tests::report`]. Where a tolerance is a bound that a backend may use up, its rule is cited.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

mod boxes;
mod census;
mod construct;
mod exact;
mod flats;
mod leaving;
#[path = "../../shared/tests/physics/mesh.rs"]
mod mesh;
mod radii;
mod rays;
mod spheres;
mod triangles;
