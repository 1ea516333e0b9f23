//! Series of frames over ranks, and its report.

use super::ClusterError;
use crate::Error;
use serde::{Deserialize, Serialize};
use trisect::film::RowSet;

/// Cost of one frame on one rank, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameCost {
    /// Time until the pixels were in place, measured by the host; for frames rendered at the same
    /// time, each one's share.
    pub render: f64,
    /// Part of `render` by the device's timer.
    pub device: f64,
}

/// Series of frames of an image whose rows are divided among ranks.
#[derive(Clone, Debug)]
pub struct FrameSeries {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Rows of each rank.
    pub rows: Vec<RowSet>,
    /// Number of frames.
    pub frames: u32,
    /// True if a waiting rank spins instead of sleeping, unless others need its processor. Where a
    /// GPU renders, that costs nothing and saves the time of waking up.
    pub spins: bool,
}

/// Costs and times of a series of frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeriesReport {
    /// Cost of each frame, by rank, then frame; empty for a rank without rows.
    pub costs: Vec<Vec<FrameCost>>,
    /// Time when each frame was complete on the root, in seconds since the start.
    pub whole: Vec<f64>,
    /// Mean number of bytes that the root received per frame.
    pub bytes: u64,
}

impl SeriesReport {
    /// Returns the mean time between complete frames in seconds, from frame `from` on. Transfers
    /// that overlap count once.
    pub fn period(&self, from: usize) -> f64 {
        match self.whole.get(from..) {
            Some([first, .., last]) => (last - first) / (self.whole.len() - from - 1) as f64,
            _ => self.whole.last().copied().unwrap_or(0.0),
        }
    }

    /// Returns the mean render time per frame of the slowest rank in seconds, from frame `from` on.
    pub fn render(&self, from: usize) -> f64 {
        self.slowest(from, |cost| cost.render)
    }

    /// Returns the mean device time per frame of the slowest rank in seconds, from frame `from` on.
    pub fn device(&self, from: usize) -> f64 {
        self.slowest(from, |cost| cost.device)
    }

    fn slowest(&self, from: usize, value: fn(&FrameCost) -> f64) -> f64 {
        let mean = |costs: &Vec<FrameCost>| {
            let counted = costs.get(from..).filter(|counted| !counted.is_empty()).unwrap_or(costs);
            counted.iter().map(value).sum::<f64>() / counted.len().max(1) as f64
        };
        self.costs.iter().map(mean).fold(0.0, f64::max)
    }
}

/// Checks that each row of a rank is in the image and belongs to no other rank: two would write to
/// the same memory.
pub(super) fn check_rows(series: &FrameSeries) -> Result<(), Error> {
    let mut taken = vec![false; series.height as usize];
    for (rank, rows) in (0..).zip(&series.rows) {
        for row in rows.iter() {
            match taken.get_mut(row as usize) {
                Some(taken) if !*taken => *taken = true,
                _ => {
                    let message = format!(
                        "row {row} of {}, which is outside the image or another rank's",
                        series.height
                    );
                    return Err(ClusterError::Protocol { rank, message }.into());
                }
            }
        }
    }
    Ok(())
}
