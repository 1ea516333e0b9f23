//! `--cluster` and its parameters.

use clap::{Args, ValueEnum};
#[cfg(feature = "mpi")]
use trisect::cluster::{Balance, ClusterPlan, DistributionMode, devices::NoGpuPolicy};

/// How ranks render together.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Over several processes (mpirun)")]
pub struct ClusterArgs {
    /// Share the image over all ranks that mpirun started: rows of it, samples of it, or what is faster by a short measurement. Rank 0 alone
    /// prints and writes.
    #[arg(long, value_enum)]
    pub distribute: Option<DistributeArg>,

    /// Which rows a rank gets: interleaved blocks, or what the root hands out, for ranks that differ in speed.
    #[arg(long, value_enum, default_value_t = BalanceArg::Static, requires = "distribute")]
    pub balance: BalanceArg,

    /// Where a rank is lost or the job is ended, write what is there of the image.
    #[arg(long, requires = "distribute")]
    pub write_partial: bool,

    /// What each rank does.
    #[command(flatten)]
    pub ranks: RankArgs,
}

/// How ranks work.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Over several processes (mpirun)")]
pub struct RankArgs {
    /// Rows of a block that one rank renders: a power of two; 8 without it.
    #[arg(long, value_name = "ROWS", value_parser = parse_block)]
    pub block: Option<u32>,

    /// What a rank does for which its host has no GPU left; without it, it refuses.
    #[arg(long, value_enum)]
    pub spare: Option<SpareArg>,

    /// Read the scene on rank 0 and send it to the others: for hosts without a common file system.
    #[arg(long)]
    pub broadcast_scene: bool,

    /// Seconds after which a silent rank counts as lost; 6 without it.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(2..=86_400))]
    pub patience: Option<u64>,
}

impl ClusterArgs {
    /// The first parameter of ranks that is given, where there are none.
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

/// `--cluster`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DistributeArg {
    /// Each rank renders all samples of some rows.
    Rows,
    /// Each rank renders some samples of all rows.
    Average,
    /// The one that a model of this job says to be faster.
    Auto,
}

/// `--balance`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BalanceArg {
    /// Known from the start.
    Static,
    /// On demand.
    Dynamic,
}

/// `--spare`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SpareArg {
    /// Ends the job.
    Refuse,
    /// Uses the CPU.
    Cpu,
    /// Shares a GPU with another rank.
    Share,
}

#[cfg(feature = "mpi")]
impl ClusterArgs {
    /// For the library; by rows where that is still to be chosen.
    pub fn plan(&self) -> ClusterPlan {
        ClusterPlan {
            mode: match self.distribute {
                Some(DistributeArg::Average) => DistributionMode::Average,
                Some(DistributeArg::Rows | DistributeArg::Auto) | None => DistributionMode::Rows,
            },
            balance: match self.balance {
                BalanceArg::Static => Balance::Static,
                BalanceArg::Dynamic => Balance::Dynamic,
            },
            block_shift: self.ranks.block_shift(),
        }
    }
}

#[cfg(feature = "mpi")]
impl RankArgs {
    /// As a power of two.
    pub fn block_shift(&self) -> u32 {
        self.block.map_or(trisect::cluster::plan::BLOCK_SHIFT, u32::ilog2)
    }

    /// For the library.
    pub fn spare(&self) -> NoGpuPolicy {
        match self.spare {
            Some(SpareArg::Refuse) | None => NoGpuPolicy::Refuse,
            Some(SpareArg::Cpu) => NoGpuPolicy::Cpu,
            Some(SpareArg::Share) => NoGpuPolicy::Share,
        }
    }

    /// For the library.
    pub fn patience(&self) -> std::time::Duration {
        self.patience.map_or(trisect::cluster::DEFAULT_PATIENCE, std::time::Duration::from_secs)
    }
}

fn parse_block(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(rows) if rows.is_power_of_two() && rows <= 1024 => Ok(rows),
        _ => Err("must be a power of two from 1 to 1024".to_owned()),
    }
}
