//! Torture tests: numerical stability at the extremes, on every backend.
//!
//! `docs/reference/accuracy.md` lists them by number, and `docs/notebook/torture-tests.md` has
//! their outcomes. Each test is one generic function, `tNN_name`, instantiated for each backend. It
//! ends with a line of [`trisect_tests::report`]. Where a tolerance is a bound that a specification
//! gives a backend, the rule is cited. Tests of single functions use [`trisect_probes`]: a question
//! is an input of a probe, an answer its output.
//!
//! The tests in [`precision`] have no number: they measure the limits that
//! `docs/reference/supported-ranges.md` states.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

// Modules of the shared crate's own tests, which run on the CPU only, with debug assertions.
#[path = "../../shared/tests/physics/chart.rs"]
#[allow(dead_code, missing_docs, reason = "shared")]
mod chart;
#[path = "../../shared/tests/physics/materials.rs"]
#[allow(dead_code, missing_docs, unsafe_code, reason = "shared")]
mod materials;
#[path = "../../shared/tests/physics/mesh.rs"]
mod mesh;
#[path = "../../shared/tests/physics/statistics.rs"]
#[allow(dead_code, missing_docs, reason = "shared")]
mod statistics;

mod all_numbers;
mod boundaries;
mod boxes;
mod census;
mod construct;
mod cost_scenes;
mod costs;
mod denoiser;
mod enclosures;
mod equality;
mod estimates;
mod exact;
mod films;
mod firewall;
mod flats;
mod furnace;
mod instances;
mod leaving;
mod media;
mod precision;
mod radii;
mod random;
mod rays;
mod scale;
mod scattering;
mod spheres;
mod splits;
mod sums;
mod terminator;
mod totals;
mod triangles;
