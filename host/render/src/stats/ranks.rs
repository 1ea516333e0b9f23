//! Report of the times and bytes of a render over several ranks, for `--stats` and its summary.

use crate::film::RowSet;
use serde::{Deserialize, Serialize};

/// Mode of dividing an image among ranks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum DistributionMode {
    /// Each rank renders all samples of some rows.
    Rows,
    /// Each rank renders some samples of all rows.
    Average,
}

/// Balance of the rows among ranks, in mode `Rows`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Balance {
    /// Interleaved blocks, fixed at the start.
    Static,
    /// Rank 0 hands out rows on demand, for ranks of different speed.
    Dynamic,
}

/// Assignment of an image to ranks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ClusterPlan {
    /// Division by rows or by samples.
    pub mode: DistributionMode,
    /// Assignment of rows, in mode `Rows`.
    pub balance: Balance,
    /// Rows per block, as a power of two.
    pub block_shift: u32,
}

/// Default number of rows per block, as a power of two: a multiple of the tiles of devices, and
/// small enough to spread expensive rows.
pub const BLOCK_SHIFT: u32 = 3;

impl Default for ClusterPlan {
    fn default() -> Self {
        Self { mode: DistributionMode::Rows, balance: Balance::Static, block_shift: BLOCK_SHIFT }
    }
}

impl ClusterPlan {
    /// Returns the rows of one of `ranks` ranks.
    pub fn rows(&self, height: u32, rank: u32, ranks: u32) -> RowSet {
        match self.mode {
            DistributionMode::Rows => RowSet::interleaved(height, self.block_shift, rank, ranks),
            DistributionMode::Average => RowSet::from(0..height),
        }
    }
}

/// Times and bytes of one rank. Its start is when it begins to render the image, after the
/// handshake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RankReport {
    /// The rank.
    pub rank: u32,
    /// Its host.
    pub host: String,
    /// Its backend and device.
    pub device: String,
    /// Seconds of rendering, reading back and encoding its image parts.
    pub render_seconds: f64,
    /// Part of `render_seconds` by the device's timer.
    pub device_seconds: f64,
    /// Seconds without work before its last image part.
    pub wait_seconds: f64,
    /// Seconds from its last image part until all its messages were sent; on the root, until the
    /// image was complete.
    pub sync_seconds: f64,
    /// Seconds from its start to the end of `sync_seconds`.
    pub seconds: f64,
    /// Bytes that it sent, without heartbeats.
    pub bytes: u64,
    /// Image parts that it rendered.
    pub pieces: u32,
    /// Samples that it rendered.
    pub samples: u64,
}

/// Report of a render over several ranks.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ClusterReport {
    /// Assignment of the work to ranks.
    pub plan: ClusterPlan,
    /// Reason for the plan, if the program chose it.
    pub choice: String,
    /// Seconds from the root's start until the image was complete.
    pub seconds: f64,
    /// Part of `seconds` that is not rendering on the slowest rank: `seconds` minus the maximum
    /// `render_seconds`.
    pub sync_seconds: f64,
    /// Render time of the slowest rank over the mean, minus 1; 0 if all ranks take the same time.
    pub imbalance: f64,
    /// Bytes that the ranks sent.
    pub bytes: u64,
    /// Report of each rank.
    pub ranks: Vec<RankReport>,
}

impl ClusterReport {
    /// Builds the report from those of the ranks.
    pub fn new(plan: ClusterPlan, choice: String, seconds: f64, ranks: Vec<RankReport>) -> Self {
        let render = ranks.iter().map(|rank| rank.render_seconds);
        let slowest = render.clone().fold(0.0, f64::max);
        let mean = render.sum::<f64>() / ranks.len().max(1) as f64;
        Self {
            plan,
            choice,
            seconds,
            sync_seconds: (seconds - slowest).max(0.0),
            imbalance: if mean > 0.0 { slowest / mean - 1.0 } else { 0.0 },
            bytes: ranks.iter().map(|rank| rank.bytes).sum(),
            ranks,
        }
    }

    /// Returns a readable summary, with a line for each rank.
    pub fn summary(&self) -> String {
        let mut text = format!(
            "{} ranks: {:.3} s, of that {:.3} s not rendering on the slowest; {:.1} MB sent, imbalance {:.1} %",
            self.ranks.len(),
            self.seconds,
            self.sync_seconds,
            self.bytes as f64 * 1e-6,
            self.imbalance * 100.0
        );
        for rank in &self.ranks {
            text += &format!(
                "\n  {:>3} on {} ({}): render {:.3} s, wait {:.3}, sync {:.3}, pieces {}, {:.1} MB",
                rank.rank,
                rank.host,
                rank.device,
                rank.render_seconds,
                rank.wait_seconds,
                rank.sync_seconds,
                rank.pieces,
                rank.bytes as f64 * 1e-6
            );
        }
        text
    }
}
