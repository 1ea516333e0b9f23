//! Renders a scene on a device with one configuration after another. Used by the sweep
//! ([`Lab::measure`]) and by [`Lab::converge`].

use super::configuration::Configuration;
use super::enlarge::enlarge;
use super::reference::{self, Reference};
use super::supervisor::{Cancelling, Ending, Supervisor, check, was_stopped};
use crate::Error;
use std::path::Path;
use std::time::{Duration, Instant};
use trisect::adaptive::{self, Adaptive, Free, Goal, Request};
use trisect::bvh::BvhQuality;
use trisect::device::{BackendError, Device, DeviceKind};
use trisect::image::Image;
use trisect::render::{Renderer, Settings};
use trisect::scene::Scene;
use trisect_shared::texture::NEAREST;

/// First seed of a measurement; the others follow it.
pub(super) const FIRST_SEED: u32 = 1000;

/// Target error that no image reaches, so that the maximum number of samples is taken.
const UNREACHABLE_ERROR: f64 = 1e-9;

/// A kept reference is good enough if it took at least this share of the time for a new one.
const MIN_TIME_SHARE: f64 = 0.9;

/// Time after which a reference with a goal of a time ends with the samples that it has, over that
/// time.
const TIME_SLACK: f64 = 1.2;

/// Share of the time that is left from which on a render is long enough to tell the speed.
const LONG_SHARE: f64 = 0.04;

/// A scene on a device. Rebuilds its renderer where a configuration needs another BVH or texture
/// filter.
pub struct Lab<'a> {
    pub(super) scene: &'a Scene,
    backend: Option<Box<dyn Device>>,
    built: Option<((Option<BvhQuality>, bool), Renderer)>,
}

/// Seconds that an image took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ImageTiming {
    pub render: f64,
    pub denoise: f64,
    pub scale: f64,
}

impl ImageTiming {
    pub fn all(&self) -> f64 {
        self.render + self.denoise + self.scale
    }

    /// Returns the time of the steps that cannot be cancelled.
    pub fn after_rendering(&self) -> Duration {
        Duration::try_from_secs_f64(self.denoise + self.scale).unwrap_or_default()
    }
}

impl<'a> Lab<'a> {
    /// Creates a lab for a scene on a device. Nothing is uploaded before the first render.
    pub fn new(scene: &'a Scene, backend: Box<dyn Device>) -> Self {
        Self { scene, backend: Some(backend), built: None }
    }

    /// Returns the renderer for a configuration.
    ///
    /// # Errors
    ///
    /// Errors of [`Renderer::with_quality`].
    pub fn renderer(&mut self, mode: &Configuration) -> Result<&mut Renderer, Error> {
        let wanted = (mode.quality, mode.nearest);
        if self.built.as_ref().is_none_or(|(built, _)| *built != wanted) {
            let before = self.built.take().map(|(_, renderer)| renderer.into_device());
            let Some(backend) = before.or_else(|| self.backend.take()) else { return Err(lost()) };
            let renderer = match mode.nearest {
                false => Renderer::with_quality(backend, self.scene, mode.quality)?,
                true => {
                    let mut scene = self.scene.clone();
                    scene.textures.iter_mut().for_each(|texture| texture.flags |= NEAREST);
                    Renderer::with_quality(backend, &scene, mode.quality)?
                }
            };
            self.built = Some((wanted, renderer));
        }
        self.built.as_mut().map(|(_, renderer)| renderer).ok_or_else(lost)
    }

    /// Returns the reference for a configuration's settings: the one kept in `folder` if it is good
    /// enough for `goal`, otherwise the one with more samples of that one and a new one, which is
    /// then kept there. For [`Goal::Error`], rendering takes at most `share` of the time that is
    /// left. Returns `None` if the measurement ended before there was a reference.
    ///
    /// # Errors
    ///
    /// Errors of rendering; [`TradeoffError::Cache`](super::TradeoffError::Cache), before a
    /// reference is rendered, for a folder that cannot be written.
    pub fn reference(
        &mut self,
        base: &Configuration,
        (goal, share): (Goal, f64),
        folder: &Path,
        supervisor: &mut dyn Supervisor,
    ) -> Result<Option<Reference>, Error> {
        let hash = reference::hash(self.scene, &reference::settings_of(&base.settings), base.quality);
        let left = supervisor.time_left();
        let (most, time) = match goal {
            Goal::Error { max_samples: most, .. } => (f64::from(most), left.map(|left| left.mul_f64(share))),
            Goal::Time(time) => (f64::INFINITY, Some(time)),
        };
        let kept = match Reference::read(folder, &hash) {
            Ok(kept) => kept,
            Err(error) => {
                supervisor.report(&format!("warning: {error}"));
                None
            }
        };
        let is_enough = |kept: &Reference| {
            let long = time.is_some_and(|time| kept.facts.seconds >= MIN_TIME_SHARE * time.as_secs_f64());
            kept.facts.samples >= most || long
        };
        let path = Reference::path(folder, &hash);
        if let Some(kept) = kept.as_ref().filter(|kept| is_enough(kept)) {
            supervisor.report(&format!("reference: kept in {}", path.display()));
            return Ok(Some(kept.clone()));
        }
        Reference::check_folder(folder)?;
        supervisor.begin(0, 1, "reference");
        // A render within a time takes longer than that: it prepares before, and on a slow device
        // its first samples alone take longer.
        let slack = if matches!(goal, Goal::Time(_)) { TIME_SLACK } else { 1.0 };
        let until = left.zip(time).map(|(left, time)| left.saturating_sub(time.mul_f64(slack)));
        let made = check(supervisor).and_then(|()| {
            let scene = self.scene;
            let mut observer = Ending { supervisor, until };
            Reference::render(self.renderer(base)?, scene, &base.settings, base.quality, goal, &mut observer)
        });
        let Some(made) = was_stopped(made, supervisor)? else { return Ok(kept) };
        if let Some(kept) = kept.filter(|kept| kept.facts.samples >= made.facts.samples) {
            supervisor.report(&format!("reference: the one kept in {} has more samples", path.display()));
            return Ok(Some(kept));
        }
        if let Err(error) = made.write(folder) {
            // A reference that took minutes to render is not lost because the disk is full now.
            supervisor.report(&format!("warning: {error}; this reference is used but not kept"));
        }
        Ok(Some(made))
    }

    /// Renders an image of a configuration. Returns [`Error::Cancelled`] if the supervisor ends it.
    pub(super) fn image(
        &mut self,
        mode: &Configuration,
        spp: u32,
        seed: u32,
        supervisor: &mut dyn Supervisor,
    ) -> Result<(Image, ImageTiming), Error> {
        check(supervisor)?;
        let full = (mode.settings.width, mode.settings.height);
        let settings = Settings {
            width: full.0.div_ceil(mode.divisor),
            height: full.1.div_ceil(mode.divisor),
            samples: spp,
            seed,
            guides: mode.denoise.is_some(),
            ..mode.settings.clone()
        };
        let renderer = self.renderer(mode)?;
        let mut observer = Cancelling(&mut *supervisor);
        let mut took = ImageTiming::default();
        let start = Instant::now();
        let film = if mode.adaptive {
            let goal = Goal::Error { target: UNREACHABLE_ERROR, max_samples: spp };
            let request =
                Request { goal, adaptive: Adaptive::On, free: Free::default(), denoisers: Vec::new() };
            let sampled = adaptive::render(renderer, &settings, &request, &mut observer)?;
            if sampled.stats.sampling.is_some_and(|sampling| sampling.ended) {
                return Err(trisect::Error::Cancelled.into());
            }
            sampled.film
        } else {
            renderer.render_observed(&settings, &mut observer)?.film
        };
        let mut image = match mode.denoise {
            None => film.image(),
            Some(_) => Image { width: 0, height: 0, pixels: Vec::new() },
        };
        took.render = start.elapsed().as_secs_f64();
        if let Some(denoise) = &mode.denoise {
            check(supervisor)?;
            let start = Instant::now();
            image = renderer.denoise(&film, &settings, denoise)?.0;
            took.denoise = start.elapsed().as_secs_f64();
        }
        renderer.recycle(film);
        if mode.divisor > 1 {
            let start = Instant::now();
            image = enlarge(&image, full);
            took.scale = start.elapsed().as_secs_f64();
        }
        Ok((image, took))
    }

    /// Returns the seconds that the base takes per sample of each pixel, and the fixed seconds of
    /// an image; infinity and 0 if the measurement ended before.
    ///
    /// # Errors
    ///
    /// Errors of rendering.
    pub fn pace(
        &mut self,
        base: &Configuration,
        supervisor: &mut dyn Supervisor,
    ) -> Result<(f64, f64), Error> {
        let pace = self.measure_pace(base, supervisor);
        Ok(was_stopped(pace, supervisor)?.unwrap_or((f64::INFINITY, 0.0)))
    }

    fn measure_pace(
        &mut self,
        base: &Configuration,
        supervisor: &mut dyn Supervisor,
    ) -> Result<(f64, f64), Error> {
        let compiles = self.renderer(base)?.device().info().kind == DeviceKind::Gpu;
        let long = supervisor.time_left().map_or(f64::INFINITY, |left| LONG_SHARE * left.as_secs_f64());
        let mut time = |spp: u32| -> Result<f64, Error> {
            let start = Instant::now();
            self.image(base, spp, FIRST_SEED, supervisor)?;
            Ok(start.elapsed().as_secs_f64())
        };
        let first = time(1)?;
        if !compiles && first > long {
            return Ok((first, 0.0));
        }
        let fixed = time(1)?;
        let mut spp = 1;
        let mut took = fixed;
        // Long enough for the clock's resolution, short enough for a user who waits.
        while took < 0.2 && spp < 4096 {
            spp *= 4;
            took = time(spp)?;
        }
        let each = if spp > 1 { (took - fixed).max(1e-9) / f64::from(spp - 1) } else { took };
        Ok((each, (fixed - each).max(0.0)))
    }
}

/// Returns the error for a lab without a backend: it was lost when a scene could not be uploaded.
fn lost() -> Error {
    let message = "the backend was lost when a scene could not be uploaded".to_owned();
    BackendError::Device { backend: "trade-off lab", action: "reuse of the backend", message }.into()
}
