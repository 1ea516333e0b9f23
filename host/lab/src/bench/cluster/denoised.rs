//! Measures denoised frames of one sample per pixel over ranks.

use super::ClusterBenchPlan;
use super::measure::{IMAGES, Point, WARM_UP};
use crate::Error;
use serde::Serialize;
use std::time::{Duration, Instant};
use trisect::denoise::{DenoiseSettings, Filter};
use trisect::film::RowTarget;
use trisect::render::{DisplayOptions, Renderer, Settings};
use trisect_cluster::plan::{self as shares, ClusterPlan as Sharing};
use trisect_cluster::{
    AssembledImage, FrameCost, FrameSeries, Heartbeat, Network, WireFormat, Work, render_image, series,
};

/// Source of the pixels beyond a rank's rows that the denoiser reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum BorderSource {
    /// Each rank also renders the rows around its own that the filter reads, and filters its own
    /// rows.
    Halo,
    /// Everything that the filter needs is sent to the root, which filters the image.
    Gathered,
}

/// Measurement of denoised frames of one sample per pixel.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Denoised {
    /// Number of ranks.
    pub ranks: u32,
    /// Source of the border pixels.
    pub around: BorderSource,
    /// Times of a frame.
    pub point: Point,
}

/// Measures frames of one sample per pixel, denoised with SVGF, on `ranks` ranks. Returns the times
/// on the root only.
///
/// `Halo` gives means over a series of frames. `Gathered` gives the fastest of [`IMAGES`] images,
/// after one that does not count; its `sync` includes the filter on the root.
pub(super) fn denoised<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    settings: &Settings,
    plan: &ClusterBenchPlan,
    ranks: u32,
    around: BorderSource,
) -> Result<(Renderer, Option<Point>), Error> {
    let settings = Settings { samples: 1, guides: true, ..settings.clone() };
    let filter = DenoiseSettings::new(Filter::Svgf);
    if around == BorderSource::Gathered {
        let work = Work {
            settings: settings.clone(),
            plan: Sharing { block_shift: plan.block_shift, ..Sharing::default() },
            wire_format: WireFormat::SumsAndAovs,
            choice: String::new(),
        };
        let mut renderer = renderer;
        let mut times = Vec::new();
        for _ in 0..=IMAGES {
            let start = Instant::now();
            let finished;
            (finished, renderer) =
                render_image(link, renderer, &work, &mut (), &|| false).map_err(|failure| failure.error)?;
            let Some(finished) = finished else { continue };
            if let AssembledImage::Film(film) = &finished.picture {
                renderer.denoise(film, &settings, filter)?;
            }
            let render = finished.report.seconds - finished.report.sync_seconds;
            times.push((start.elapsed().as_secs_f64(), render, finished.report.bytes));
        }
        let counted = times.get(1..).unwrap_or_default();
        let best = counted.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0));
        return Ok((renderer, best.map(|(frame, render, bytes)| Point::new(frame, render, 0.0, bytes))));
    }
    let band = |rank: u32| shares::band(settings.height, rank, ranks);
    let own = band(link.rank());
    let (width, height, frames) = (settings.width, settings.height, plan.frames + WARM_UP);
    let rows = (0..ranks).map(|rank| band(rank).into()).collect();
    let of = FrameSeries { width, height, rows, frames, spins: plan.spins };
    let render = move |renderer: &mut Renderer, _: u32, to: &mut RowTarget<'_>| {
        let start = Instant::now();
        let live = renderer.live_rows(&settings, Some(&filter), None, &own)?;
        let shown = renderer.show_to(&live, &DisplayOptions::default(), to)?;
        let passes: Duration = live.passes.iter().map(|pass| pass.1).sum();
        let device = (live.trace + passes + shown).as_secs_f64();
        Ok(FrameCost { render: start.elapsed().as_secs_f64(), device })
    };
    let (renderer, report) = series(link, (renderer, None), &of, render, &mut |_, _| Ok(()), &|| false)?;
    let from = WARM_UP as usize;
    let point = report.map(|report| {
        Point::new(report.period(from), report.render(from), report.device(from), report.bytes)
    });
    Ok((renderer, point))
}
