//! Options for several processes: `--distribute` and those of ranks.
//!
//! A build without MPI parses them, to refuse them with the reason, and hides them in its help.

use super::time::parse_time;
use clap::{Args, ValueEnum};
use trisect_cluster::Balance;
use trisect_cluster::devices::NoGpuPolicy;
#[cfg(feature = "mpi")]
use trisect_cluster::{ClusterPlan, DistributionMode};

/// Options of renders over several processes.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Over several processes (mpirun)")]
pub struct ClusterArgs {
    /// Share the image over all ranks that mpirun started; rank 0 prints and writes. view takes
    /// rows, with --headless (default: one process).
    #[arg(long, value_enum, hide = cfg!(not(feature = "mpi")))]
    pub distribute: Option<DistributeArg>,

    /// With --distribute rows: assignment of rows to ranks.
    #[arg(long, value_enum, default_value_t = Balance::Static, requires = "distribute", hide = cfg!(not(feature = "mpi")))]
    pub balance: Balance,

    /// If a rank is lost or the job is told to end, write the part of the image that is complete.
    #[arg(long, requires = "distribute", hide = cfg!(not(feature = "mpi")))]
    pub write_partial: bool,

    /// Options of each rank.
    #[command(flatten)]
    pub ranks: RankArgs,
}

/// Options of each rank.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Over several processes (mpirun)")]
pub struct RankArgs {
    /// Rows of a block, which one rank renders: a power of two up to 1024 (default: 8).
    #[arg(long, value_name = "ROWS", value_parser = parse_block, hide = cfg!(not(feature = "mpi")))]
    pub block: Option<u32>,

    /// Action of a rank if its host has more ranks than GPUs (default: refuse).
    #[arg(long, value_enum, hide = cfg!(not(feature = "mpi")))]
    pub spare: Option<NoGpuPolicy>,

    /// Read the scene on rank 0 and send it to the others, for hosts without a common file system
    /// (default: each rank reads it).
    #[arg(long, hide = cfg!(not(feature = "mpi")))]
    pub broadcast_scene: bool,

    /// Time without a message, in whole seconds, after which a rank counts as lost (default: 6s).
    #[arg(long, value_name = "TIME", value_parser = parse_patience, hide = cfg!(not(feature = "mpi")))]
    pub patience: Option<u64>,
}

/// Parses a time of 2 s to a day, in whole seconds.
fn parse_patience(text: &str) -> Result<u64, String> {
    let time = parse_time(text)?;
    match (time.subsec_nanos(), time.as_secs()) {
        (0, seconds @ 2..=86_400) => Ok(seconds),
        _ => Err("must be whole seconds, from 2s to 24h".to_owned()),
    }
}

impl ClusterArgs {
    /// Returns a warning if `--balance` has no effect.
    #[cfg(feature = "mpi")]
    pub fn without_effect(&self) -> Option<&'static str> {
        (self.distribute == Some(DistributeArg::Average) && self.balance == Balance::Dynamic).then_some(
            "--balance dynamic has no effect with --distribute average, where each rank has a fixed share",
        )
    }

    /// Returns the first given option of ranks, if `--distribute` is not given.
    pub fn without_ranks(&self) -> Option<&'static str> {
        let RankArgs { block, spare, broadcast_scene, patience } = &self.ranks;
        let given = [
            ("--block", block.is_some()),
            ("--spare", spare.is_some()),
            ("--broadcast-scene", *broadcast_scene),
            ("--patience", patience.is_some()),
        ];
        given.into_iter().find(|given| given.1 && self.distribute.is_none()).map(|given| given.0)
    }
}

/// Values of `--distribute`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DistributeArg {
    /// Each rank renders all samples of some rows.
    Rows,
    /// Each rank renders some samples of all rows; not with --checkpoint, --time-limit or resume.
    Average,
    /// The faster of both, predicted from a short measurement.
    Auto,
}

#[cfg(feature = "mpi")]
impl ClusterArgs {
    /// Returns the plan for the library: by rows if `auto` has still to choose.
    pub fn plan(&self) -> ClusterPlan {
        ClusterPlan {
            mode: match self.distribute {
                Some(DistributeArg::Average) => DistributionMode::Average,
                Some(DistributeArg::Rows | DistributeArg::Auto) | None => DistributionMode::Rows,
            },
            balance: self.balance,
            block_shift: self.ranks.block_shift(),
        }
    }
}

#[cfg(feature = "mpi")]
impl RankArgs {
    /// Returns the binary logarithm of the rows of a block.
    pub fn block_shift(&self) -> u32 {
        self.block.map_or(trisect_cluster::plan::BLOCK_SHIFT, u32::ilog2)
    }

    /// Returns the policy for a rank without a GPU.
    pub fn spare(&self) -> NoGpuPolicy {
        self.spare.unwrap_or(NoGpuPolicy::Refuse)
    }

    /// Returns the time without a message after which a rank counts as lost.
    pub fn patience(&self) -> std::time::Duration {
        self.patience.map_or(trisect_cluster::DEFAULT_PATIENCE, std::time::Duration::from_secs)
    }
}

fn parse_block(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(rows) if rows.is_power_of_two() && rows <= 1024 => Ok(rows),
        _ => Err("must be a power of two from 1 to 1024".to_owned()),
    }
}
