//! Measuring: repeated frames and their statistics, scenes of any number of spheres, and a report with charts.
//!
//! What is measured and how it is summarised are apart, so that everything but the time itself can be tested.

pub mod cluster;
mod error;
mod fit;
mod frames;
mod live;
mod record;
pub mod report;
mod spheres;
mod summary;

pub use error::BenchError;
pub use fit::Line;
pub use frames::{FirstSubmission, FrameStats, WarmUp, measure};
pub use live::{measure_live, rows_of_timings};
pub use record::{Benchmark, FORMAT, Once, Row, Subject, table};
pub use spheres::{MAX_COUNT, sphere_scene};
pub use summary::Summary;
