//! `trisect tradeoff` and `trisect converge`.

use super::JobArgs;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// Where references are kept, and how good they are.
#[derive(Clone, Debug, Args)]
pub struct ReferenceArgs {
    /// Mean samples per pixel of the reference, as many as its share of --time-limit allows (35 %
    /// for tradeoff, 20 % for converge). Default: for tradeoff as many as fit, for converge eight
    /// times --last.
    #[arg(long, value_name = "N", value_parser = super::parse_count)]
    pub reference_spp: Option<u32>,

    /// Folder where references are kept by hash; without it, trisect/references in the user's cache.
    #[arg(long, value_name = "FOLDER")]
    pub cache: Option<PathBuf>,
}

/// `trisect tradeoff`.
#[derive(Clone, Debug, Args)]
pub struct TradeoffArgs {
    /// What and where; --spp is what each point's number of samples is at most.
    #[command(flatten)]
    pub job: JobArgs,

    /// Knobs to turn, with commas between; without it, all that the scene and the device have.
    #[arg(long, value_name = "KNOBS", value_delimiter = ',')]
    pub knobs: Vec<String>,

    /// Repetitions of each point, by different random numbers.
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub seeds: usize,

    /// Numbers of samples a pixel, with commas between; without it, three that about fit
    /// --time-limit.
    #[arg(long, value_name = "N,N", value_delimiter = ',', value_parser = super::parse_count)]
    pub levels: Vec<u32>,

    /// Maximum time for all of it, such as 60s. What is not measured by then is named in the
    /// report, and the exit code is 7.
    #[arg(long, value_name = "TIME", value_parser = super::goal::parse_time, default_value = "8m")]
    pub time_limit: Duration,

    /// The reference.
    #[command(flatten)]
    pub reference: ReferenceArgs,

    /// Folder for report.html, tradeoff.json, tradeoff.csv and charts.
    #[arg(short, long, value_name = "FOLDER", default_value = "tradeoff")]
    pub output: PathBuf,

    /// Print the summary only.
    #[arg(short, long)]
    pub quiet: bool,

    /// Print what is in tradeoff.json in place of the summary.
    #[arg(long)]
    pub json: bool,
}

/// `trisect converge`.
#[derive(Clone, Debug, Args)]
pub struct ConvergeArgs {
    /// What and where.
    #[command(flatten)]
    pub job: JobArgs,

    /// Knobs whose ways are followed beside the base, with commas between.
    #[arg(
        long,
        value_name = "KNOBS",
        value_delimiter = ',',
        default_value = "sampler,roulette,lights,denoiser,depth,clamp"
    )]
    pub knobs: Vec<String>,

    /// Repetitions, by different random numbers.
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub seeds: usize,

    /// Samples a pixel at first.
    #[arg(long, value_name = "N", value_parser = super::parse_count, default_value_t = 16)]
    pub first: u32,

    /// Maximum samples per pixel; fewer where --time-limit allows no more.
    #[arg(long, value_name = "N", value_parser = super::parse_count, default_value_t = 4096)]
    pub last: u32,

    /// Maximum time for all of it, such as 60s, in equal shares for all ways. What is not measured
    /// by then is named, and the exit code is 7.
    #[arg(long, value_name = "TIME", value_parser = super::goal::parse_time, default_value = "8m")]
    pub time_limit: Duration,

    /// The reference.
    #[command(flatten)]
    pub reference: ReferenceArgs,

    /// Write what was found as JSON.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}
