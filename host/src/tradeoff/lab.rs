//! Measuring: each way of rendering, with each number of samples, by several seeds.

use super::enlarge::enlarge;
use super::errors::Errors;
use super::front;
use super::mode::Mode;
use super::picture::{Picture, Pictures};
use super::point::{Against, FORMAT, Missing, Point, Seconds, Tradeoff};
use super::reference::{self, Reference, Truth};
use super::{TradeoffError, check_seeds};
use crate::Error;
use crate::backend::{Backend, BackendError};
use crate::bench::Summary;
use crate::bvh::BvhQuality;
use crate::image::Image;
use crate::render::{Observer, Renderer, Settings, SettingsError};
use crate::sampling::{self, Adaptive, Free, Goal, Request};
use crate::scene::Scene;
use crate::statistics;
use std::path::Path;
use std::time::{Duration, Instant};
use trisect_shared::texture::NEAREST;

/// Samples from which on those by noise differ from as many for each pixel.
const LEAST_ADAPTIVE: u32 = 8;

/// Ways between two looks at the base's time.
const MODES_OF_AN_EPOCH: usize = 3;

/// The first seed of a measurement; the others follow.
const FIRST_SEED: u32 = 1000;

/// An error that no image has: as many samples as there may be are taken.
const NEVER: f64 = 1e-9;

/// A scene on a device, however it has to be built.
pub struct Lab<'a> {
    scene: &'a Scene,
    backend: Option<Box<dyn Backend>>,
    built: Option<((Option<BvhQuality>, bool), Renderer)>,
}

/// What an image took.
#[derive(Clone, Copy, Debug, Default)]
struct Took {
    render: f64,
    denoise: f64,
    scale: f64,
}

impl Took {
    fn all(&self) -> f64 {
        self.render + self.denoise + self.scale
    }
}

/// What to measure.
#[derive(Clone, Debug)]
pub struct Sweep<'a> {
    /// The base first.
    pub modes: &'a [Mode],
    /// Numbers of samples a pixel.
    pub levels: &'a [u32],
    /// Repetitions.
    pub seeds: usize,
    /// Repetitions that get a FLIP.
    pub flips: usize,
}

impl<'a> Lab<'a> {
    /// Of a scene.
    pub fn new(scene: &'a Scene, backend: Box<dyn Backend>) -> Self {
        Self { scene, backend: Some(backend), built: None }
    }

    /// The renderer for a way.
    ///
    /// # Errors
    ///
    /// As [`Renderer::with_quality`].
    pub fn renderer(&mut self, mode: &Mode) -> Result<&mut Renderer, Error> {
        let wanted = (mode.quality, mode.nearest);
        if self.built.as_ref().is_none_or(|(built, _)| *built != wanted) {
            let before = self.built.take().map(|(_, renderer)| renderer.into_backend());
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

    /// The reference of a way's settings: that in `folder`, if it has at most this error or took as long, else a new one, which is kept there.
    ///
    /// # Errors
    ///
    /// As rendering; [`TradeoffError`] for a folder that cannot be written.
    pub fn reference(
        &mut self,
        base: &Mode,
        goal: Goal,
        folder: &Path,
        say: &mut dyn FnMut(&str),
        observer: &mut dyn Observer,
    ) -> Result<Reference, Error> {
        let hash = reference::hash(self.scene, &reference::settings_of(&base.settings));
        let enough = |kept: &Reference| match goal {
            Goal::Error { target, most } => {
                kept.facts.error <= target || kept.facts.samples >= f64::from(most)
            }
            Goal::Time(time) => kept.facts.seconds >= 0.9 * time.as_secs_f64(),
        };
        match Reference::read(folder, &hash) {
            Ok(Some(kept)) if enough(&kept) => {
                say(&format!("reference: kept in {}", Reference::path(folder, &hash).display()));
                return Ok(kept);
            }
            Ok(_) => {}
            Err(error) => say(&format!("warning: {error}")),
        }
        let scene = self.scene;
        let made = Reference::render(self.renderer(base)?, scene, &base.settings, goal, observer)?;
        made.write(folder)?;
        Ok(made)
    }

    /// Renders an image of a way.
    fn image(
        &mut self,
        mode: &Mode,
        spp: u32,
        seed: u32,
        observer: &mut dyn Observer,
    ) -> Result<(Image, Took), Error> {
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
        let mut took = Took::default();
        let start = Instant::now();
        let film = if mode.adaptive {
            let goal = Goal::Error { target: NEVER, most: spp };
            let request = Request { goal, adaptive: Adaptive::On, free: Free::default(), denoise: None };
            sampling::render(renderer, &settings, &request, observer)?.film
        } else {
            renderer.render(&settings, observer)?.film
        };
        let mut image = match mode.denoise {
            None => film.image(),
            Some(_) => Image { width: 0, height: 0, pixels: Vec::new() },
        };
        took.render = start.elapsed().as_secs_f64();
        if let Some(denoise) = &mode.denoise {
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

    /// Seconds that the base takes for a sample of each pixel, and for none.
    ///
    /// # Errors
    ///
    /// As rendering.
    pub fn pace(&mut self, base: &Mode, observer: &mut dyn Observer) -> Result<(f64, f64), Error> {
        let mut time = |spp: u32| -> Result<f64, Error> {
            let start = Instant::now();
            self.image(base, spp, FIRST_SEED, observer)?;
            Ok(start.elapsed().as_secs_f64())
        };
        time(1)?;
        let fixed = time(1)?;
        let mut spp = 1;
        let mut took = fixed;
        // Long enough for a clock, short enough for a person.
        while took < 0.2 && spp < 4096 {
            spp *= 4;
            took = time(spp)?;
        }
        let each = if spp > 1 { (took - fixed).max(1e-9) / f64::from(spp - 1) } else { took };
        Ok((each, (fixed - each).max(0.0)))
    }

    /// Measures everything. `say` gets a line for each point.
    ///
    /// # Errors
    ///
    /// As rendering, and [`TradeoffError`].
    pub fn measure(
        &mut self,
        sweep: &Sweep,
        reference: &Reference,
        say: &mut dyn FnMut(&str),
        observer: &mut dyn Observer,
    ) -> Result<(Tradeoff, Pictures), Error> {
        check_seeds(sweep.seeds)?;
        let [base, ..] = sweep.modes else {
            return Err(TradeoffError::TooFew { what: "the number of modes", given: 0, least: 1 }.into());
        };
        let start = Instant::now();
        let image = reference.image();
        let truth = Truth::new(reference, &image)?;
        let device = self.renderer(base)?.backend().device().clone();
        let mut found = Tradeoff {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: self.scene.name.clone(),
            device: format!("{}: {} ({})", device.backend, device.name, device.details),
            width: base.settings.width,
            height: base.settings.height,
            depth: base.settings.depth,
            reference: reference.facts.clone(),
            seeds: sweep.seeds,
            drift: 0.0,
            points: Vec::new(),
            slopes: Vec::new(),
            missing: Vec::new(),
            seconds: 0.0,
        };
        let mut pictures = Pictures::new(&truth);
        let mut epochs = Vec::new();
        for (index, mode) in sweep.modes.iter().enumerate() {
            // Compiles what this way needs, outside of what is measured.
            match self.image(mode, 1, FIRST_SEED - 1, observer) {
                Ok(_) => {}
                Err(error) if is_missing(&error) => {
                    let (knob, level) = (mode.knob.to_owned(), mode.level.clone());
                    found.missing.push(Missing { knob, level, reason: error.to_string() });
                    say(&format!("{}: not here: {error}", mode.name()));
                    continue;
                }
                Err(error) => return Err(error),
            }
            for &spp in sweep.levels {
                // Two halves of two samples each say where noise is; what comes after them goes there.
                if mode.adaptive && spp < LEAST_ADAPTIVE {
                    let reason =
                        format!("{spp} samples a pixel; it needs {LEAST_ADAPTIVE} to tell where noise is");
                    say(&format!("{}: not here: {reason}", mode.name()));
                    let (knob, level) = (mode.knob.to_owned(), mode.level.clone());
                    found.missing.push(Missing { knob, level, reason });
                    continue;
                }
                let (mut point, first) = self.point(mode, spp, sweep, &truth, observer)?;
                point.exact = mode.is_exact(base, !self.scene.lights.is_empty());
                say(&point.line());
                if Some(&spp) == sweep.levels.last() {
                    pictures.add(&point, Picture::of(&first, &truth)?);
                }
                found.points.push(point);
            }
            let as_built = (mode.quality, mode.nearest) == (base.quality, base.nearest);
            if as_built && index % MODES_OF_AN_EPOCH == 0 {
                epochs.push(self.base_again(base, sweep.levels.last().copied().unwrap_or(1), observer)?);
            }
        }
        found.drift = epochs_deviation(&epochs);
        let of_base: Vec<Point> = found.points.iter().filter(|point| point.knob == "base").cloned().collect();
        for point in found.points.iter_mut().filter(|point| point.knob != "base") {
            let base = of_base.iter().find(|base| base.spp == point.spp);
            point.against = base.map(|base| Against::of(point, base, found.drift));
        }
        front::mark(&mut found.points);
        found.slopes = front::slopes(&found.points);
        found.seconds = start.elapsed().as_secs_f64();
        Ok((found, pictures))
    }

    /// The logarithm of the base's median time, now.
    fn base_again(&mut self, base: &Mode, spp: u32, observer: &mut dyn Observer) -> Result<f64, Error> {
        let mut times = Vec::new();
        for _ in 0..3 {
            times.push(self.image(base, spp, FIRST_SEED, observer)?.1.all());
        }
        Ok(Summary::of(&times).map_or(f64::NAN, |summary| summary.median.ln()))
    }

    fn point(
        &mut self,
        mode: &Mode,
        spp: u32,
        sweep: &Sweep,
        truth: &Truth,
        observer: &mut dyn Observer,
    ) -> Result<(Point, Image), Error> {
        let (mut images, mut took) = (Vec::new(), Vec::new());
        for index in 0..sweep.seeds as u32 {
            let (image, times) = self.image(mode, spp, FIRST_SEED + index, observer)?;
            images.push(image);
            took.push(times);
        }
        let errors = Errors::of(&images, truth, sweep.flips)?;
        let each: Vec<f64> = took.iter().map(Took::all).collect();
        let all = Summary::of(&each).unwrap_or(Summary::NOTHING);
        let median = |of: fn(&Took) -> f64| {
            Summary::of(&took.iter().map(of).collect::<Vec<_>>()).map_or(f64::NAN, |summary| summary.median)
        };
        let seconds = Seconds {
            render: median(|took| took.render),
            denoise: median(|took| took.denoise),
            scale: median(|took| took.scale),
            all,
            each,
        };
        let efficiency = errors.efficiency(seconds.all.median);
        let (knob, level) = (mode.knob.to_owned(), mode.level.clone());
        let (exact, against, on_front) = (false, None, false);
        let point = Point { knob, level, exact, spp, seconds, errors, efficiency, against, on_front };
        Ok((point, images.swap_remove(0)))
    }
}

/// The standard deviation of what was measured at several times; 0 of fewer than two.
fn epochs_deviation(logs: &[f64]) -> f64 {
    match statistics::mean_and_error(logs) {
        (_, error) if error.is_finite() => error * (logs.len() as f64).sqrt(),
        _ => 0.0,
    }
}

/// Whether a way is not there, and others may be.
fn is_missing(error: &Error) -> bool {
    use SettingsError::{NoFastMath, NoQueue, NoVariant, VariantLacks};
    let of = |error: &SettingsError| {
        matches!(error, NoVariant { .. } | VariantLacks { .. } | NoQueue { .. } | NoFastMath { .. })
    };
    match error {
        Error::Settings(error) | Error::Backend(BackendError::Settings(error)) => of(error),
        _ => false,
    }
}

/// After a scene that could not be uploaded there is no backend any more.
fn lost() -> Error {
    let message = "it was lost with a scene that could not be uploaded".to_owned();
    Error::Backend(BackendError::Device { backend: "the", action: "taking it up again", message })
}

/// Numbers of samples and repetitions that about fit a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Samples a pixel.
    pub levels: Vec<u32>,
    /// Repetitions.
    pub seeds: usize,
    /// For the reference.
    pub reference: Duration,
}

/// The share of a time that the reference gets.
const REFERENCE_SHARE: f64 = 0.35;

/// Numbers of samples a pixel of a way.
const LEVELS: u32 = 3;

/// Shares `time` out: a third for the reference, the rest for `modes` ways of three numbers of samples, each four times the one before. `analysis`: seconds that
/// an image takes beside rendering.
pub fn fit(time: Duration, modes: usize, seeds: usize, (each, fixed): (f64, f64), analysis: f64) -> Fit {
    let reference = time.mul_f64(REFERENCE_SHARE);
    let rest = time.as_secs_f64() * (1.0 - REFERENCE_SHARE) * 0.8;
    let images = (modes * seeds) as f64;
    let overhead = images * f64::from(LEVELS) * (fixed + analysis);
    // 1 + 1/4 + 1/16 of the greatest; ways differ, and some take twice as long.
    let most = ((rest - overhead) / (images * 1.3125 * each)).max(1.0);
    let top = most.log2().floor().clamp(4.0, 16.0) as i32;
    let levels = (0..LEVELS as i32).rev().map(|k| 1u32 << (top - 2 * k).max(0)).collect();
    Fit { levels, seeds, reference }
}
