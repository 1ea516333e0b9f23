//! Charts of the cluster benchmark: frame time and synchronisation by ranks, time and noise of
//! averaged images, and the model's prediction.

use super::{ClusterBench, GatherMethod, Point, RowFrames};
use crate::bench::BenchError;
use crate::plot;
use crate::plot::{Axis, Chart, Plot, Series};
use std::path::{Path, PathBuf};
use trisect_cluster::cost::{Gather, Machine, Shape};
use trisect_cluster::plan::{ClusterPlan, DistributionMode};

/// Maximum number of ranks for which the chart shows the model's prediction.
const MAX_RANKS: u32 = 4096;

pub(super) fn write(bench: &ClusterBench, folder: &Path) -> Result<Vec<PathBuf>, BenchError> {
    let mut files = Vec::new();
    let mut draw = |stem: &str, plot: Plot| {
        files.extend(["svg", "png"].map(|kind| folder.join(format!("{stem}.{kind}"))));
        plot::write(&Chart::Plot(plot), folder, stem)
    };
    for frames in &bench.frames {
        draw(&format!("rows_{}spp", frames.spp), rows(bench, frames))?;
    }
    if !bench.averages.is_empty() {
        draw("average_time", average(bench))?;
    }
    if !bench.noise.is_empty() {
        draw("average_noise", noise(bench))?;
    }
    if let Some(frames) = bench.frames.last() {
        draw("model", model(bench, frames))?;
    }
    Ok(files)
}

fn notes(bench: &ClusterBench) -> Vec<String> {
    vec![format!("{}, {}x{}, {}", bench.scene, bench.width, bench.height, bench.device)]
}

fn rows(bench: &ClusterBench, frames: &RowFrames) -> Plot {
    let title = format!("Rows, {} spp: a frame, and what of it is synchronisation", frames.spp);
    both_ways(bench, title, "frame", &frames.points)
}

fn average(bench: &ClusterBench) -> Plot {
    let spp = bench.averages.first().map_or(0, |average| average.spp);
    let title = format!("Averages, {spp} spp over all ranks: an image, and what of it is synchronisation");
    let points = bench.averages.iter().map(|average| (average.ranks, average.way, average.point));
    both_ways(bench, title, "image", &points.collect::<Vec<_>>())
}

/// Plots the time of a frame or image (`what`) and its share of synchronisation, for both methods
/// of assembling it.
fn both_ways(bench: &ClusterBench, title: String, what: &str, points: &[(u32, GatherMethod, Point)]) -> Plot {
    let of = |wanted: GatherMethod, value: fn(&Point) -> f64| {
        let points = points.iter().filter(move |point| point.1 == wanted);
        points.map(move |(ranks, _, point)| (f64::from(*ranks), value(point) * 1e3)).collect::<Vec<_>>()
    };
    Plot {
        title,
        notes: notes(bench),
        x: Axis::linear("ranks"),
        y: Axis::linear("ms"),
        series: vec![
            Series::measured(what, 0, of(GatherMethod::Gather, |point| point.frame)),
            Series::measured("of it sync", 1, of(GatherMethod::Gather, |point| point.sync)),
            Series::measured(
                &format!("{what}, all-reduce"),
                2,
                of(GatherMethod::AllReduce, |point| point.frame),
            ),
            Series::measured("of it sync, all-reduce", 3, of(GatherMethod::AllReduce, |point| point.sync)),
        ],
    }
}

fn noise(bench: &ClusterBench) -> Plot {
    let points = bench.noise.iter().map(|noise| (f64::from(noise.ranks), noise.rms));
    let first = bench.noise.first().map_or(0.0, |noise| noise.rms * f64::from(noise.ranks).sqrt());
    let line =
        bench.noise.iter().map(|noise| (f64::from(noise.ranks), first / f64::from(noise.ranks).sqrt()));
    let spp = bench.noise.first().map_or(0, |noise| noise.spp / noise.ranks.max(1));
    let mut law = Series::measured("1/sqrt(ranks)", 2, line);
    law.marks = false;
    Plot {
        title: format!("Averages, {spp} spp a rank: noise"),
        notes: notes(bench),
        x: Axis::linear("ranks"),
        y: Axis::linear("RMS of the clipped image"),
        series: vec![Series::measured("measured", 0, points), law],
    }
}

fn model(bench: &ClusterBench, frames: &RowFrames) -> Plot {
    let shape = Shape { width: bench.width, height: bench.height, samples: frames.spp };
    let one = frames.points.iter().find(|point| point.0 == 1 && point.1 == GatherMethod::Gather);
    let samples = f64::from(shape.width) * f64::from(shape.height) * f64::from(shape.samples);
    let rate = one.map_or(bench.machine.rate, |one| samples / one.2.render.max(1e-12));
    let machine = Machine { rate, fixed: 0.0, ..bench.machine };
    let ranks: Vec<u32> = (0..=MAX_RANKS.ilog2()).map(|power| 1 << power).collect();
    let of = |mode: DistributionMode, bytes: usize, gather: Gather| {
        let plan = ClusterPlan { mode, ..ClusterPlan::default() };
        let at = |ranks: u32| machine.predict(&shape, &plan, ranks, bytes, gather).frame() * 1e3;
        ranks.iter().map(move |&ranks| (f64::from(ranks), at(ranks))).collect::<Vec<_>>()
    };
    let line = |name: &str, style: usize, points: Vec<(f64, f64)>| {
        let mut series = Series::measured(name, style, points);
        series.marks = false;
        series
    };
    let measured = frames.points.iter().filter(|point| point.1 == GatherMethod::Gather);
    let mut marks = Series::measured(
        "measured",
        0,
        measured.map(|(ranks, _, point)| (f64::from(*ranks), point.frame * 1e3)),
    );
    marks.line = false;
    Plot {
        title: format!("A frame of {} spp by the model", frames.spp),
        notes: notes(bench),
        x: Axis::log("ranks"),
        y: Axis::log("ms"),
        series: vec![
            marks,
            line("rows, shared memory", 5, of(DistributionMode::Rows, 4, Gather::Shared)),
            line("rows, pipelined", 0, of(DistributionMode::Rows, 4, Gather::Pipelined)),
            line("rows, flat gather", 1, of(DistributionMode::Rows, 4, Gather::Flat)),
            line("rows, all-reduce", 2, of(DistributionMode::Rows, 12, Gather::AllReduce)),
            line("averages, tree", 3, of(DistributionMode::Average, 16, Gather::Tree)),
            line("averages, flat", 4, of(DistributionMode::Average, 16, Gather::Flat)),
        ],
    }
}
