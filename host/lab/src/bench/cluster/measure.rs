//! Measures one point: rows, averages or noise with a number of ranks.

use super::ClusterBenchPlan;
use crate::Error;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::{ControlFlow, Range};
use std::time::Instant;
use trisect::film::{PixelTotals, RowSet, RowTarget};
use trisect::render::{ChunkJob, ChunkResult, DisplayOptions, Renderer, Settings, chunks};
use trisect_cluster::cost::{Gather, Machine, Prediction, Shape};
use trisect_cluster::plan::{self as shares, ClusterPlan as Sharing, DistributionMode};
use trisect_cluster::{
    AssembledImage, FrameCost, FrameSeries, Heartbeat, Network, Tag, WireFormat, Work, render_image, series,
};

/// Method of assembling pixels from all ranks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum GatherMethod {
    /// Ranks send their pixels to the root, as in `render`.
    Gather,
    /// All-reduce of the whole image in f32, the method of "Parallelizing Ray Tracing"; for
    /// comparison.
    #[cfg_attr(feature = "clap", value(name = "allreduce"))]
    AllReduce,
}

impl GatherMethod {
    /// Returns the name for tables and CSV.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gather => "gather",
            Self::AllReduce => "allreduce",
        }
    }
}

/// Mean seconds of a frame or an image.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Point {
    /// From one frame to the next on the root.
    pub frame: f64,
    /// Rendering until the pixels are on the host: on the slowest rank, or on this one with
    /// [`GatherMethod::AllReduce`].
    pub render: f64,
    /// Part of `render` by the device's timer; 0 if it was not measured.
    pub device: f64,
    /// Synchronisation: the part of `frame` beyond `render`.
    pub sync: f64,
    /// Bytes that the root received.
    pub bytes: u64,
    /// Prediction of the model.
    pub model: Prediction,
}

impl Point {
    pub(super) fn new(frame: f64, render: f64, device: f64, bytes: u64) -> Self {
        Self { frame, render, device, sync: (frame - render).max(0.0), bytes, model: Prediction::default() }
    }

    /// Returns one line for people.
    pub fn line(&self, ranks: u32, way: GatherMethod) -> String {
        format!(
            "{ranks} ranks, {}: frame {:.3} ms, render {:.3}, sync {:.3}",
            way.name(),
            self.frame * 1e3,
            self.render * 1e3,
            self.sync * 1e3
        )
    }
}

/// Frames distributed by rows, with one number of samples.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RowFrames {
    /// Samples per pixel.
    pub spp: u32,
    /// Number of ranks, method and times of each point.
    pub points: Vec<(u32, GatherMethod, Point)>,
}

impl RowFrames {
    pub(super) fn new(
        spp: u32,
        points: Vec<(u32, GatherMethod, Point)>,
        machine: &Machine,
        shape: &Shape,
        plan: &ClusterBenchPlan,
    ) -> Self {
        let sharing = Sharing { block_shift: plan.block_shift, ..Sharing::default() };
        // The rate of a rank is taken from these frames: the trial has another size.
        let one = points.iter().find(|point| point.0 == 1 && point.1 == GatherMethod::Gather);
        let samples = f64::from(shape.width) * f64::from(shape.height) * f64::from(spp);
        let rate = one.map_or(machine.rate, |one| samples / one.2.render.max(1e-12));
        let model = Machine { rate, fixed: 0.0, ..*machine };
        let points = points.into_iter().map(|(ranks, way, point)| {
            let (bytes, gather) = match way {
                // The root received nothing: the ranks of its host wrote to its memory.
                GatherMethod::Gather if point.bytes == 0 => (4, Gather::Shared),
                GatherMethod::Gather => (4, Gather::Pipelined),
                GatherMethod::AllReduce => (12, Gather::AllReduce),
            };
            (ranks, way, Point { model: model.predict(shape, &sharing, ranks, bytes, gather), ..point })
        });
        Self { spp, points: points.collect() }
    }

    /// Returns the seconds of a frame with one rank, or an estimate from the first measured number
    /// of ranks; 0 if nothing was measured.
    pub(super) fn one_rank(&self, way: GatherMethod) -> f64 {
        let one = self.points.iter().find(|point| point.1 == way);
        one.map_or(0.0, |one| one.2.frame * f64::from(one.0))
    }
}

/// Measurement of an averaged image.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Average {
    /// Number of ranks.
    pub ranks: u32,
    /// Samples per pixel, of all ranks together.
    pub spp: u32,
    /// Method of assembling the image.
    pub way: GatherMethod,
    /// Times of the image.
    pub point: Point,
}

impl Average {
    pub(super) fn new(
        ranks: u32,
        way: GatherMethod,
        point: Point,
        machine: &Machine,
        shape: &Shape,
        one: Option<f64>,
    ) -> Self {
        let samples = f64::from(shape.width) * f64::from(shape.height) * f64::from(shape.samples);
        // The rate of a rank is taken from an image with one rank, if measured.
        let machine =
            one.map_or(*machine, |one| Machine { rate: samples / one.max(1e-12), fixed: 0.0, ..*machine });
        let sharing = Sharing { mode: DistributionMode::Average, ..Sharing::default() };
        let (bytes, gather) = match way {
            GatherMethod::Gather => (16, Gather::Tree),
            GatherMethod::AllReduce => (12, Gather::AllReduce),
        };
        let model = machine.predict(shape, &sharing, ranks, bytes, gather);
        Self { ranks, spp: shape.samples, way, point: Point { model, ..point } }
    }
}

/// Noise of an averaged image.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Noise {
    /// Number of ranks.
    pub ranks: u32,
    /// Samples per pixel, of all ranks together.
    pub spp: u32,
    /// Root mean square difference of two images with different seeds, divided by √2. Values are
    /// clamped to 0 to 1.
    pub rms: f64,
}

/// Runs `work` on the first `ranks` ranks while the others wait.
pub(super) fn with_ranks<N: Network, T>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    ranks: u32,
    work: impl FnOnce(&mut Heartbeat<N>, Renderer) -> Result<(Renderer, Option<T>), Error>,
) -> Result<(Renderer, Option<T>), Error> {
    link.limit_ranks(ranks)?;
    let done = if link.rank() < ranks { work(link, renderer)? } else { (renderer, None) };
    // The root sends all ranks a message when the work is done.
    link.use_all_ranks();
    if link.is_root() {
        link.send_all(Tag::Start, &[])?;
    } else {
        link.expect(Tag::Start)?;
    }
    Ok(done)
}

/// Number of frames that do not count: they compile kernels and fill the pipeline of frames in
/// transit.
pub(super) const WARM_UP: u32 = 5;

pub(super) fn rows<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    settings: &Settings,
    plan: &ClusterBenchPlan,
    ranks: u32,
    way: GatherMethod,
) -> Result<(Renderer, Option<Point>), Error> {
    let sharing = Sharing { block_shift: plan.block_shift, ..Sharing::default() };
    let own = sharing.rows(settings.height, link.rank(), ranks);
    if way == GatherMethod::AllReduce {
        let mut renderer = renderer;
        let mut times = Vec::new();
        for _ in 0..plan.frames + WARM_UP {
            let time;
            (renderer, time) = reduced(link, renderer, settings, &own, 0..settings.samples)?;
            times.push(time);
        }
        return Ok((renderer, Some(mean(&times[WARM_UP as usize..], settings))));
    }
    let all = (0..ranks).map(|rank| sharing.rows(settings.height, rank, ranks)).collect();
    let (width, height, frames) = (settings.width, settings.height, plan.frames + WARM_UP);
    let of = FrameSeries { width, height, rows: all, frames, spins: plan.spins };
    let settings = settings.clone();
    let render = move |renderer: &mut Renderer, _: u32, to: &mut RowTarget<'_>| {
        let start = Instant::now();
        let framed = renderer.frame_to(&settings, &DisplayOptions::default(), to)?;
        Ok(FrameCost { render: start.elapsed().as_secs_f64(), device: framed.trace.as_secs_f64() })
    };
    let twin = renderer.second_stream()?;
    let (renderer, report) = series(link, (renderer, twin), &of, render, &mut |_, _| Ok(()), &|| false)?;
    let from = WARM_UP as usize;
    Ok((
        renderer,
        report.map(|report| {
            Point::new(report.period(from), report.render(from), report.device(from), report.bytes)
        }),
    ))
}

/// Seconds of a frame, and of its rendering.
type Times = (f64, f64);

/// Renders some samples of some rows, and sums the whole image over all ranks, as the report does.
/// Returns the renderer and the times.
fn reduced<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    settings: &Settings,
    rows: &RowSet,
    samples: Range<u32>,
) -> Result<(Renderer, Times), Error> {
    let start = Instant::now();
    let (own, rows) = (settings.clone(), rows.clone());
    let mut renderer = renderer;
    let (renderer, image) = link.run_while_polling(move || {
        let image = part_of_image(&mut renderer, &own, &rows, samples);
        (renderer, image)
    })?;
    let mut image = image?;
    let render = start.elapsed().as_secs_f64();
    link.network().all_reduce(&mut image)?;
    Ok((renderer, (start.elapsed().as_secs_f64(), render)))
}

/// Returns an f32 image that contains nothing but these samples of these rows, weighted by their
/// share of all samples.
fn part_of_image(
    renderer: &mut Renderer,
    settings: &Settings,
    rows: &RowSet,
    samples: Range<u32>,
) -> Result<Vec<f32>, Error> {
    let width = settings.width as usize;
    let image = vec![0f32; width * settings.height as usize * 3];
    let parts: Vec<Range<u32>> = chunks(samples).collect();
    let wanted: Vec<u32> = rows.iter().collect();
    // Converted in parallel, while the next chunk is rendered, as the gather method encodes its
    // parts.
    let take = |image: &mut Vec<f32>, part: &Range<u32>, sums: &ChunkResult<'_>| {
        let count = part.len() as u32;
        let share = count as f32 / settings.samples as f32;
        let mut places: Vec<Option<&mut [f32]>> = image.chunks_mut(width.max(1) * 3).map(Some).collect();
        let places = wanted.iter().filter_map(|&row| places.get_mut(row as usize).and_then(Option::take));
        let places: Vec<&mut [f32]> = places.collect();
        places.into_par_iter().zip(sums.pixels.par_chunks_exact(width.max(1))).for_each(|(to, pixels)| {
            for (to, sums) in to.chunks_exact_mut(3).zip(pixels) {
                let mean = PixelTotals::of(sums, count).mean();
                to.iter_mut().zip(mean).for_each(|(to, mean)| *to += mean as f32 * share);
            }
        });
        Ok(())
    };
    let parts =
        ChunkJob { settings, rows, samples: &parts, seeds: &[settings.seed], should_continue: &|| true };
    Ok(renderer.for_each_chunk(&parts, &mut |_| ControlFlow::Continue(()), image, &take)?)
}

fn mean(times: &[(f64, f64)], settings: &Settings) -> Point {
    let count = times.len().max(1) as f64;
    let sum = times.iter().fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    Point::new(sum.0 / count, sum.1 / count, 0.0, settings.pixels() * 12)
}

fn averaging(settings: &Settings, ranks: u32) -> Work {
    let most = shares::samples_of(settings.samples, 0, shares::averaging(settings.samples, ranks));
    let travels = if most.len() <= 256 { WireFormat::Chunk } else { WireFormat::Mean };
    let plan = Sharing { mode: DistributionMode::Average, ..Sharing::default() };
    Work { settings: settings.clone(), plan, wire_format: travels, choice: String::new() }
}

/// Number of images that count, after one that does not.
pub(super) const IMAGES: usize = 5;

pub(super) fn average<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    settings: &Settings,
    ranks: u32,
    way: GatherMethod,
) -> Result<(Renderer, Option<Point>), Error> {
    let mut renderer = renderer;
    let mut times = Vec::new();
    let mut bytes = 0;
    let work = averaging(settings, ranks);
    for _ in 0..=IMAGES {
        if way == GatherMethod::AllReduce {
            let averaging = shares::averaging(settings.samples, ranks);
            let own = match link.rank() < averaging {
                true => shares::samples_of(settings.samples, link.rank(), averaging),
                false => 0..0,
            };
            let all = RowSet::from(0..settings.height);
            let time;
            (renderer, time) = reduced(link, renderer, settings, &all, own)?;
            times.push(time);
            bytes = settings.pixels() * 12;
        } else {
            let finished;
            (finished, renderer) =
                render_image(link, renderer, &work, &mut (), &|| false).map_err(|failure| failure.error)?;
            if let Some(finished) = finished {
                let report = finished.report;
                bytes = report.bytes;
                times.push((report.seconds, report.seconds - report.sync_seconds));
            }
        }
    }
    // The median, because one late rank says nothing about the other images.
    let mut counted = times.split_off(times.len().min(1));
    counted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let middle = counted.get(counted.len() / 2).copied();
    Ok((renderer, middle.map(|(frame, render)| Point::new(frame, render, 0.0, bytes))))
}

pub(super) fn noise<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    settings: &Settings,
    ranks: u32,
) -> Result<(Renderer, Option<f64>), Error> {
    let mut renderer = renderer;
    let mut images = Vec::new();
    for seed in [settings.seed, settings.seed.wrapping_add(1)] {
        let work = averaging(&Settings { seed, ..settings.clone() }, ranks);
        let finished;
        (finished, renderer) =
            render_image(link, renderer, &work, &mut (), &|| false).map_err(|failure| failure.error)?;
        if let Some(AssembledImage::Color(image)) = finished.map(|finished| finished.picture) {
            images.push(image);
        }
    }
    let [a, b] = &images[..] else { return Ok((renderer, None)) };
    let differences = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    // Values are clamped to the display's range: a single bright path would outweigh all others.
    let squares = differences.map(|(a, b)| f64::from(a.clamp(0.0, 1.0) - b.clamp(0.0, 1.0)).powi(2));
    let mean = squares.sum::<f64>() / (a.pixels.len() * 3).max(1) as f64;
    Ok((renderer, Some((mean / 2.0).sqrt())))
}
