//! Steps of a render: first the samples, then denoising and layers.

use crate::checkpoints::Keeper;
use crate::layers::{FrameLayers, SceneOfLayers};
use crate::observer::Watch;
use crate::options::RenderOptions;
use std::time::Duration;
use trisect::adaptive::{self, Goal};
use trisect::checkpoint::{CheckpointError, Saver};
use trisect::error::Error;
use trisect::film::{Film, SampleBlock};
use trisect::image::Image;
use trisect::render::{RenderObserver, Renderer};
use trisect::stats::RenderStats;

/// Result of a render.
pub struct Rendered {
    /// Sums of all samples.
    pub film: Film,
    /// Image that is not the film's: denoised, or the best of a render to a time.
    pub image: Option<Image>,
    /// Times and counts.
    pub stats: RenderStats,
    /// Layers that were asked for.
    pub layers: FrameLayers,
}

impl Rendered {
    /// Counts all samples of the film, after the sums of other ranks were added. Times and rates
    /// stay those of this rank.
    pub fn count_all(&mut self) {
        let (stats, counts) = (&mut self.stats, self.film.counts());
        (stats.samples, stats.segments) = (counts.samples, counts.segments);
        (stats.rejected_samples, stats.unwritten_pixels) = (counts.rejected, counts.unwritten);
    }
}

/// Remains of a render that ended early, or whose checkpoint could not be written.
#[derive(Default)]
pub struct Kept {
    /// Film with the samples so far.
    pub film: Option<Film>,
    /// Error of the last checkpoint.
    pub unsaved: Option<CheckpointError>,
}

/// Samples of a render.
pub struct Work<'a> {
    /// Settings, goal and samples.
    pub options: &'a RenderOptions,
    /// Blocks of a rank's share; `None` for all samples of the options.
    pub share: Option<&'a [SampleBlock]>,
    /// Writer of the checkpoint.
    pub saver: Option<&'a Saver>,
}

/// Renders the samples that `film` lacks, and writes the last checkpoint. `kept` has the samples of
/// a render that was ended early.
pub fn sample(
    renderer: &mut Renderer,
    Work { options, share, saver }: &Work<'_>,
    film: Film,
    kept: &mut Kept,
    observer: &mut Watch<'_>,
) -> Result<Rendered, Error> {
    let RenderOptions { settings, request, denoise, samples, .. } = options;
    if let Some(denoise) = denoise {
        denoise.check()?;
    }
    let layers = FrameLayers::default();
    if let Some(request) = request {
        let adaptive::Sampled { film, image, stats } =
            adaptive::render(renderer, settings, request, observer)?;
        let image = matches!(request.goal, Goal::Time(_)).then_some(image);
        return Ok(Rendered { film, image, stats, layers });
    }
    let film = kept.film.insert(film);
    let keeper = Keeper(*saver);
    let stats = match share {
        Some(parts) => renderer.render_parts(film, settings, parts, &keeper, observer),
        None => renderer.render_missing(film, settings, samples, &keeper, observer),
    };
    if let Some(saver) = saver.filter(|_| stats.is_ok() || !film.is_empty()) {
        kept.unsaved = saver.finish(film).err();
    }
    let stats = stats?;
    let film = kept.film.take().unwrap_or_else(|| Film::new(0, 0));
    Ok(Rendered { film, image: None, stats, layers })
}

/// Denoises a film and renders its layers, unless the render was ended early.
pub fn finish(
    renderer: &mut Renderer,
    options: &RenderOptions,
    scene: &SceneOfLayers<'_>,
    mut rendered: Rendered,
    observer: &mut Watch<'_>,
) -> Result<Rendered, Error> {
    let RenderOptions { settings, denoise, aovs, .. } = options;
    let Rendered { film, image, stats, layers } = &mut rendered;
    if let Some(denoise) = denoise.as_ref().filter(|_| image.is_none() && !observer.has_ended()) {
        let (denoised, passes) = renderer.denoise(film, settings, *denoise)?;
        stats.denoise_seconds = passes.iter().map(Duration::as_secs_f64).sum();
        stats.denoise = Some(*denoise);
        stats.denoise_library = denoise.library();
        *image = Some(denoised);
    }
    let aovs: &[_] = if observer.has_ended() { &[] } else { aovs };
    *layers = match FrameLayers::of(renderer, (settings, film), scene, aovs, &mut Quiet(observer)) {
        Err(Error::Cancelled) if observer.has_ended() => FrameLayers::default(),
        layers => layers?,
    };
    stats.scene.clone_from(&scene.scene.name);
    Ok(rendered)
}

/// Observer of the layers' camera rays, which may end them, and whose progress is not told.
struct Quiet<'a, 'b>(&'a mut Watch<'b>);

impl RenderObserver for Quiet<'_, '_> {
    fn progress(&mut self, _: u64, _: u64) -> std::ops::ControlFlow<()> {
        self.0.look_at_signals();
        match self.0.should_continue() {
            true => std::ops::ControlFlow::Continue(()),
            false => std::ops::ControlFlow::Break(()),
        }
    }
}
