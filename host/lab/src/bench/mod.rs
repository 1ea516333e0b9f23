//! Benchmarks: repeated frames with their statistics, live frames, scenes of any number of spheres,
//! the charts of a report, and ranks of a cluster. Used by `trisect bench`.
//!
//! Measuring is separate from summarising, so that everything but the time itself can be tested.

pub mod cluster;

mod fit;
mod frames;
mod live;
mod oidn;
mod record;
pub mod report;
mod spheres;
mod summary;

pub use crate::error::BenchError;
pub use fit::Line;
pub use frames::{FirstSubmission, FrameStats, WarmUp, measure};
pub use live::{ViewReport, measure_live, rows_of_timings};
pub use oidn::measure_oidn;
pub use record::{Benchmark, FORMAT, Once, Row, Subject, table};
pub use spheres::{MAX_COUNT, sphere_scene};
pub use summary::Summary;
