//! Cost model: predicts the time of an image over any number of ranks from a few measured numbers.
//!
//! [`choose`] decides with it between rows and averages (`--distribute auto`), and `bench cluster`
//! compares its predictions with measurements.

mod measure;

pub use measure::{measure, with_slowdown};

use super::ClusterError;
use super::heartbeat::Heartbeat;
use super::image_part::WireFormat;
use super::network::{Network, Tag};
use super::plan::{self, ClusterPlan, DistributionMode};
use super::work::Work;
use crate::Error;
use serde::{Deserialize, Serialize};
use trisect::render::{Renderer, Settings};

/// Measured speed of the ranks and the network between them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Machine {
    /// Samples per second of the slowest rank, rendered and read back to the host.
    pub rate: f64,
    /// Seconds per image of the slowest rank that do not depend on the number of samples.
    pub fixed: f64,
    /// Time of an empty message from one rank to another, in seconds.
    pub latency: f64,
    /// Time between consecutive messages of many that are sent at once, in seconds.
    pub overhead: f64,
    /// Bytes per second of a large message.
    pub bandwidth: f64,
    /// Time until another thread of the slowest rank has answered, in seconds, while all ranks wait
    /// for theirs.
    pub handoff: f64,
    /// Time of rendering on a rank while the others do so too, over that of a rank alone: ranks of
    /// a host share its processors and memory. 1 if `rate` is that of all ranks at the same time.
    pub slowdown: f64,
}

impl Machine {
    /// Machine that was not measured.
    pub const UNKNOWN: Self = Self {
        rate: 0.0,
        fixed: 0.0,
        latency: 0.0,
        overhead: 0.0,
        bandwidth: f64::INFINITY,
        handoff: 0.0,
        slowdown: 1.0,
    };
}

/// Size of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Shape {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
}

impl Shape {
    /// Returns the size of the image with these settings.
    pub fn of(settings: &Settings) -> Self {
        Self { width: settings.width, height: settings.height, samples: settings.samples }
    }

    fn pixels(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }
}

/// Method by which pixels reach the root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Gather {
    /// From each rank, when it is done.
    Flat,
    /// From each rank, while the next frame is rendered.
    Pipelined,
    /// Directly into the root's memory, while the next frame is rendered: for ranks on one host.
    Shared,
    /// Up a binomial tree, strip by strip.
    Tree,
    /// The whole image to all ranks: the report's all-reduce, by recursive doubling.
    AllReduce,
}

/// Predicted time of a frame, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Prediction {
    /// Render time of the slowest rank.
    pub render: f64,
    /// Time beyond rendering.
    pub sync: f64,
}

impl Prediction {
    /// Returns the time of the whole frame, in seconds.
    pub fn frame(&self) -> f64 {
        self.render + self.sync
    }
}

impl Machine {
    fn message(&self, bytes: f64) -> f64 {
        self.latency + bytes / self.bandwidth
    }

    /// Returns the time of a message that follows another one, in seconds.
    fn next(&self, bytes: f64) -> f64 {
        self.overhead + bytes / self.bandwidth
    }

    /// Predicts a frame of `shape` with this plan over `ranks` ranks, with `bytes` sent per pixel.
    ///
    /// * Rows: rendering takes as long as that of the rank with the most blocks. Then the root
    ///   receives one message after the other; pipelined, only the time beyond rendering counts;
    ///   with shared memory, the messages are empty. A frame is handed to a thread and back: one
    ///   rank renders meanwhile, several wait for each other.
    /// * Averages: rendering takes as long as that of the rank with the most samples of all pixels.
    ///   Then the last strip goes up the tree, and the root may receive for longer than it renders.
    pub fn predict(
        &self,
        shape: &Shape,
        plan: &ClusterPlan,
        ranks: u32,
        bytes: usize,
        gather: Gather,
    ) -> Prediction {
        let others = f64::from(ranks.max(1) - 1);
        let image = shape.pixels() * bytes as f64;
        let depth = f64::from(ranks.max(1)).log2().ceil();
        let rate = if ranks > 1 { self.rate / self.slowdown.max(1.0) } else { self.rate };
        let render = match plan.mode {
            DistributionMode::Rows => {
                let block = 1u32 << plan.block_shift.min(16);
                let blocks = shape.height.div_ceil(block);
                let rows = (u64::from(blocks.div_ceil(ranks.max(1))) * u64::from(block))
                    .min(u64::from(shape.height));
                self.fixed + rows as f64 * f64::from(shape.width) * f64::from(shape.samples) / rate
            }
            DistributionMode::Average => {
                let averaging = plan::averaging(shape.samples, ranks);
                let most = (0..averaging.min(64))
                    .map(|rank| plan::samples_of(shape.samples, rank, averaging).len())
                    .max();
                self.fixed + shape.pixels() * most.unwrap_or(0) as f64 / rate
            }
        };
        // A rank without blocks or samples sends nothing.
        let senders = match plan.mode {
            DistributionMode::Rows => {
                others.min(f64::from(shape.height.div_ceil(1 << plan.block_shift.min(16))) - 1.0)
            }
            DistributionMode::Average => others.min(f64::from(shape.samples) - 1.0),
        };
        let share = image / f64::from(ranks.max(1));
        let flat = match plan.mode {
            DistributionMode::Rows => senders * self.next(share.max(image / f64::from(shape.height))),
            DistributionMode::Average => senders * self.next(image),
        };
        let sync = match gather {
            _ if ranks <= 1 => (self.handoff - render).max(0.0),
            Gather::Flat => flat + self.latency,
            Gather::Pipelined => (flat - render).max(0.0),
            Gather::Shared => (senders * self.overhead - render).max(0.0),
            Gather::Tree => {
                let up = depth * self.message(image / f64::from(plan::STRIPS));
                up + (depth * self.message(image) - render).max(0.0)
            }
            Gather::AllReduce => depth * self.message(image),
        };
        Prediction { render, sync: if ranks > 1 { sync + self.handoff } else { sync } }
    }
}

/// Chooses between rows and averages by a short measurement. All ranks call this and get the same
/// choice, with its reason as text.
///
/// # Errors
///
/// Same as [`measure`].
pub fn choose<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    work: &Work,
) -> Result<(Renderer, (DistributionMode, String)), Error> {
    let (renderer, machine) = measure(link, renderer, &work.settings)?;
    let chosen = match machine {
        Some(machine) => {
            let chosen = decide(&machine, &Shape::of(&work.settings), &work.plan, link.ranks());
            link.send_all(Tag::Start, &serde_json::to_vec(&chosen).unwrap_or_default())?;
            chosen
        }
        None => {
            let answer = link.expect(Tag::Start)?;
            serde_json::from_slice(&answer.bytes)
                .map_err(|error| ClusterError::Protocol { rank: 0, message: error.to_string() })?
        }
    };
    Ok((renderer, chosen))
}

/// Averages are chosen if their predicted time is below this fraction of that of rows: rows always
/// have the bits of one process, and the model is not more accurate than this.
const AVERAGE_THRESHOLD: f64 = 0.95;

fn decide(machine: &Machine, shape: &Shape, plan: &ClusterPlan, ranks: u32) -> (DistributionMode, String) {
    let rows = ClusterPlan { mode: DistributionMode::Rows, ..*plan };
    let average = ClusterPlan { mode: DistributionMode::Average, ..*plan };
    let rows = machine.predict(shape, &rows, ranks, WireFormat::Color.bytes(), Gather::Flat);
    let average = machine.predict(shape, &average, ranks, WireFormat::Chunk.bytes(), Gather::Tree);
    let mode = if average.frame() < AVERAGE_THRESHOLD * rows.frame() {
        DistributionMode::Average
    } else {
        DistributionMode::Rows
    };
    let why = format!(
        "auto: rows {:.3} s, averages {:.3} s by the model: {:.3} Msamples/s a rank, {:.1} us and {:.2} GB/s between ranks",
        rows.frame(),
        average.frame(),
        machine.rate * 1e-6,
        machine.latency * 1e6,
        machine.bandwidth * 1e-9
    );
    (mode, why)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MACHINE: Machine =
        Machine { rate: 1e6, latency: 1e-5, overhead: 1e-6, bandwidth: 1e10, ..Machine::UNKNOWN };

    #[test]
    fn rows_while_there_are_enough() {
        let many = Shape { width: 1920, height: 1080, samples: 64 };
        assert_eq!(decide(&MACHINE, &many, &ClusterPlan::default(), 4).0, DistributionMode::Rows);
        // 16 rows in blocks of 8 keep only two ranks busy.
        let flat = Shape { width: 1920, height: 16, samples: 4096 };
        assert_eq!(decide(&MACHINE, &flat, &ClusterPlan::default(), 8).0, DistributionMode::Average);
        // One sample cannot be divided.
        let one = Shape { samples: 1, ..many };
        assert_eq!(decide(&MACHINE, &one, &ClusterPlan::default(), 8).0, DistributionMode::Rows);
    }

    #[test]
    fn more_ranks_render_less_and_wait_longer() {
        let shape = Shape { width: 1920, height: 1080, samples: 100 };
        let plan = ClusterPlan::default();
        let at = |ranks, gather| MACHINE.predict(&shape, &plan, ranks, 12, gather);
        assert!((at(1, Gather::Flat).frame() - 1920.0 * 1080.0 * 1e-4).abs() < 1e-9);
        for ranks in [2, 4, 64] {
            assert!(at(ranks, Gather::Flat).render < at(ranks / 2, Gather::Flat).render);
            assert!(at(ranks, Gather::AllReduce).sync > at(ranks / 2, Gather::AllReduce).sync);
            assert!(at(ranks, Gather::Pipelined).sync <= at(ranks, Gather::Flat).sync);
            assert_eq!(at(ranks, Gather::Shared).sync, 0.0);
        }
        // On a host under load one rank renders until a thread wakes, and two also wait for it;
        // ranks that share processors render more slowly.
        let loaded = Machine { handoff: 3e-3, slowdown: 1.5, rate: 1e9, ..MACHINE };
        let at_load = |samples, ranks| {
            loaded.predict(&Shape { samples, ..shape }, &plan, ranks, 12, Gather::Shared).frame() * 1e3
        };
        let seen = [at_load(1, 1), at_load(1, 2), at_load(100, 1), at_load(100, 2)];
        let want = [3.0, 3.0 + 1.5 * 1.0368, 207.36, 3.0 + 1.5 * 103.68];
        assert!(seen.iter().zip(want).all(|(seen, want)| (seen / want - 1.0).abs() < 0.02), "{seen:?}");
        // Only as many ranks as there are blocks have work.
        assert_eq!(at(135, Gather::Flat).render, at(4096, Gather::Flat).render);
    }
}
