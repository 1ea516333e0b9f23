//! `trisect bench cluster`: measures renders over different numbers of ranks.

use super::ClusterSession;
use crate::cli::ClusterBenchArgs;
use std::process::ExitCode;
use trisect::device::{DeviceInfo, DeviceKind};
use trisect::output::Outputs;
use trisect::render::Settings;
use trisect_lab::Error;
use trisect_lab::bench::BenchError;
use trisect_lab::bench::cluster::{self, ClusterBench, ClusterBenchPlan};

/// Measures how renders scale with ranks, writes charts and data, and prints a summary.
pub fn run(arguments: &ClusterBenchArgs) -> Result<ExitCode, Error> {
    let mut crew = ClusterSession::start(&arguments.ranks, arguments.job.threads)?;
    let all = crew.link.ranks();
    let out = arguments.output.clone();
    let check = move || {
        let io = |source| BenchError::Io { path: out.clone(), source };
        std::fs::create_dir_all(&out).map_err(io)?;
        Ok(Outputs::default().folder("-o", Some(&out), cluster::is_output))
    };
    let asked = format!(
        "{:?}",
        (
            &arguments.counts,
            &arguments.frame_spp,
            arguments.average_spp,
            arguments.noise_spp,
            &arguments.sync,
            arguments.frames
        )
    );
    let adjust = move |_: &mut Settings, _: &DeviceInfo| Ok(vec![("what is measured".to_owned(), asked)]);
    let session = match crew.assemble(&arguments.job, &arguments.ranks, check, adjust) {
        Ok(session) => session,
        Err(code) => return Ok(code),
    };
    let mut counts = arguments.counts.clone();
    if counts.is_empty() {
        counts = (0..=all.ilog2()).map(|power| 1 << power).chain([all]).collect();
        counts.dedup();
    }
    let plan = ClusterBenchPlan {
        ranks: counts,
        spp: arguments.frame_spp.clone(),
        frames: arguments.frames,
        average: arguments.average_spp,
        noise: arguments.noise_spp,
        block_shift: arguments.ranks.block_shift(),
        ways: arguments.sync.clone(),
        spins: session.renderer.device().info().kind == DeviceKind::Gpu,
    };
    let root = crew.link.is_root();
    let mut say = |line: &str| {
        if root {
            super::super::eprint(line);
        }
    };
    let measured = ClusterBench::measure(
        &mut crew.link,
        session.renderer,
        &session.name,
        &session.settings,
        &plan,
        &mut say,
    );
    match measured {
        Ok((_, Some(bench))) => {
            for file in bench.write(&arguments.output)? {
                super::super::eprint(&format!("wrote {}", file.display()));
            }
            super::super::print(&bench.summary())?;
            Ok(ExitCode::SUCCESS)
        }
        Ok((_, None)) => Ok(ExitCode::SUCCESS),
        Err(error) => Ok(crew.give_up(&error)),
    }
}
