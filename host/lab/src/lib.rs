//! Benchmarks with a report, and the trade-off lab, which measures time, noise and bias of each
//! speed option and evaluates images of other renderers.

pub mod accuracy;
pub mod bench;
pub mod comparison;
mod error;
pub mod evaluate;
#[cfg(test)]
mod fingerprint_tests;
pub mod machine;
pub mod page;
mod plot;
#[cfg(feature = "schema")]
pub mod schema;
pub mod statistics;
pub mod tradeoff;

pub use error::Error;
