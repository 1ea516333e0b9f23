//! What a render over several ranks took.

use super::plan::ClusterPlan;
use serde::{Deserialize, Serialize};

/// What one rank's part took. Wall-clock seconds since all ranks were ready.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RankReport {
    /// Which.
    pub rank: u32,
    /// Where.
    pub host: String,
    /// On what.
    pub device: String,
    /// Rendering, reading and encoding its pieces.
    pub render_seconds: f64,
    /// Of that, by the device's timer.
    pub device_seconds: f64,
    /// Without work between its first piece and its last.
    pub wait_seconds: f64,
    /// From its last piece until all it had to send was taken; of the root, until the image was there.
    pub sync_seconds: f64,
    /// From the start until then.
    pub seconds: f64,
    /// That it sent.
    pub bytes: u64,
    /// That it rendered.
    pub pieces: u32,
    /// The same in samples.
    pub samples: u64,
}

/// What a render over several ranks took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClusterReport {
    /// Who rendered what.
    pub plan: ClusterPlan,
    /// Why so, where the program chose.
    pub choice: String,
    /// From the start until the image was there.
    pub seconds: f64,
    /// What of it the slowest rank's rendering does not explain: `seconds` less the greatest of `render_seconds`.
    pub sync_seconds: f64,
    /// How much longer the slowest rank rendered than the mean: 0 for none.
    pub imbalance: f64,
    /// That came to the root.
    pub bytes: u64,
    /// Each rank's.
    pub ranks: Vec<RankReport>,
}

impl ClusterReport {
    /// Of what the ranks said.
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

    /// Lines for people.
    pub fn summary(&self) -> String {
        let mut text = format!(
            "{} ranks: {:.3} s, of that {:.3} s not rendering on the slowest; {:.1} MB came, imbalance {:.1} %",
            self.ranks.len(),
            self.seconds,
            self.sync_seconds,
            self.bytes as f64 * 1e-6,
            self.imbalance * 100.0
        );
        for rank in &self.ranks {
            text += &format!(
                "\n  {:>3} on {} ({}): render {:.3} s, wait {:.3}, sync {:.3}, {} pieces, {:.1} MB",
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
