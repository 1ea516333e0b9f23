//! Choice between the form of a command for one process and that for ranks.

use super::{bench, frames, render, report, resume, view};
use crate::cli::{BenchArgs, BenchCommand, RenderArgs, ResumeArgs, ViewArgs};
use std::process::ExitCode;
use std::time::Instant;
use trisect::error::MotionError;
use trisect_cluster::ClusterError;
use trisect_lab::Error;

/// Runs a command over ranks; without MPI it returns [`ClusterError::NotBuilt`].
macro_rules! over_ranks {
    ($command:ident, $arguments:expr) => {{
        #[cfg(feature = "mpi")]
        {
            super::cluster::$command::run($arguments)
        }
        #[cfg(not(feature = "mpi"))]
        {
            let _ = $arguments;
            Err(ClusterError::NotBuilt.into())
        }
    }};
}

/// Renders a scene to an image file.
pub fn render(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    if arguments.cluster.distribute.is_none() {
        return match arguments.motion.moves() {
            true => frames::run(arguments),
            false => render::run(arguments),
        };
    }
    if let Some(with) = arguments.motion.option() {
        let remedy =
            "start a process for each part of the frames, such as --frames 0..60 and --frames 60..120";
        return Err(MotionError::Beside { what: "--distribute", with, remedy }.into());
    }
    if arguments.preview.display.is_some() {
        let remedy = "render with one process, or without the preview";
        return Err(MotionError::Beside { what: "--distribute", with: "--display", remedy }.into());
    }
    if arguments.request()?.is_some() {
        let what = "--budget, --target-error and --quality are for one process".to_owned();
        return Err(ClusterError::Unsupported { what, remedy: "name --spp".to_owned() }.into());
    }
    over_ranks!(render, arguments)
}

/// Continues a render from its checkpoint.
pub fn resume(arguments: &ResumeArgs) -> Result<ExitCode, Error> {
    match arguments.cluster.distribute {
        None => resume::run(arguments),
        Some(_) => over_ranks!(resume, arguments),
    }
}

/// Shows a scene in a window, or renders its frames without one.
pub fn view(arguments: &ViewArgs) -> Result<ExitCode, Error> {
    match arguments.cluster.distribute {
        None => view::run(arguments),
        Some(_) => over_ranks!(view, arguments),
    }
}

/// Measures frames, a report or ranks. The program started at `start`.
pub fn bench(arguments: &BenchArgs, start: Instant) -> Result<ExitCode, Error> {
    match &arguments.command {
        None => bench::run(arguments, start),
        Some(BenchCommand::Report(arguments)) => report::run(arguments),
        Some(BenchCommand::Cluster(arguments)) => over_ranks!(bench, arguments),
    }
}
