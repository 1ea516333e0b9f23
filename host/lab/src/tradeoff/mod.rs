//! The trade-off lab measures what each knob that makes rendering faster costs in accuracy.
//!
//! A [`Configuration`] is a set of render settings. A [`TradeoffPlan`] or a [`ConvergencePlan`] is
//! a whole measurement. [`Lab`] renders each configuration with several seeds and numbers of
//! samples. [`Errors`](crate::accuracy::Errors) are measured against a [`Reference`].
//! [`Tradeoff::write`] writes the report. A [`Supervisor`] can end the measurement; the report then
//! has what was measured by then. Used by `trisect tradeoff` and `trisect converge`.

mod advice;
mod cache;
mod charts;
mod command;
mod configuration;
mod converge;
mod enlarge;
mod error_curve;
mod fit;
mod flips;
mod front;
mod gallery;
mod lab;
mod measure;
mod others;
mod others_table;
mod page;
mod picture;
mod plan;
mod point;
mod points_table;
mod recommend;
mod reference;
mod supervisor;
mod table;

pub use crate::error::TradeoffError;
pub use cache::{cache_folder, user_cache};
pub use command::RenderCommand;
pub use configuration::{Configuration, KNOBS, configurations};
pub use converge::ConvergencePlan;
pub use error_curve::{Capture, Convergence, ErrorCurve, Pair};
pub use fit::{Cost, Fit, REFERENCE_SHARE, fit};
pub use lab::Lab;
pub use measure::Sweep;
pub use others::OtherRenderer;
pub use page::is_output;
pub use picture::Pictures;
pub use plan::{ReferenceSource, TradeoffPlan, configurations_of};
pub use point::{Missing, Point, Purpose, Recommended, Seconds, Slope, Tradeoff, VsBase};
pub use reference::{Reference, ReferenceInfo, hash};
pub use supervisor::{Stop, Supervisor};

/// Minimum number of repetitions (seeds) from which bias can be told from noise.
pub const MIN_SEEDS: usize = 4;

/// Maximum number of repetitions, whose results stay in memory.
pub const MAX_SEEDS: usize = 1024;

/// Checks that `given` repetitions are enough to tell bias from noise.
///
/// # Errors
///
/// [`TradeoffError::TooFew`] below [`MIN_SEEDS`].
pub fn check_seeds(given: usize) -> Result<(), TradeoffError> {
    if given < MIN_SEEDS {
        return Err(TradeoffError::TooFew { what: "`seeds`", given, least: MIN_SEEDS });
    }
    Ok(())
}
