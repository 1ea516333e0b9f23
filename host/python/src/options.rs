//! Keyword arguments of a render: settings, goal, denoiser, layers, checkpoint.

use crate::checkpoint_options::{CheckpointOptions, interval, path, samples};
use crate::error;
use crate::image_options::{aovs, crop, cropped};
use crate::progress_callback::ProgressCallback;
use crate::scene::Scene;
use crate::words::{count, flag, number, share, time, word, wrong};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use std::ops::Range;
use std::path::PathBuf;
use trisect::adaptive::{Adaptive, DEFAULT_MAX_SAMPLES, Free, Goal, Request};
use trisect::checkpoint::SaveInterval;
use trisect::denoise::{Denoiser, Filter};
use trisect::layers::Aov;
use trisect::render::{Sampler, Settings};

/// Keywords of a render that are settings of a measurement, too.
pub const SETTINGS: [&str; 8] =
    ["width", "height", "depth", "sampler", "roulette", "roulette_depth", "light_sampling", "clamp"];

/// Denoisers by name.
const DENOISERS: [(&str, Option<Denoise>); 4] = [
    ("off", None),
    ("atrous", Some(Denoise::Atrous)),
    ("svgf", Some(Denoise::Svgf)),
    ("oidn", Some(Denoise::Oidn)),
];

#[derive(Clone, Copy)]
enum Denoise {
    Atrous,
    Svgf,
    Oidn,
}

impl From<Denoise> for Denoiser {
    fn from(name: Denoise) -> Self {
        match name {
            Denoise::Atrous => Filter::Atrous.into(),
            Denoise::Svgf => Filter::Svgf.into(),
            Denoise::Oidn => Self::Oidn,
        }
    }
}

/// Settings, goal and layers that a call of `render` asks for.
pub struct RenderOptions {
    /// Settings of the render.
    pub settings: Settings,
    /// Goal in place of a number of samples.
    pub request: Option<Request>,
    /// Denoiser of the finished film; a goal of time has its own.
    pub denoise: Option<Denoiser>,
    /// Layers beside the image.
    pub aovs: Vec<Aov>,
    /// Callable that receives the progress.
    pub progress: Option<ProgressCallback>,
    /// Indices of the samples to render; all of the settings unless a part was asked for.
    pub samples: Range<u32>,
    /// File that keeps the film.
    pub checkpoint: Option<CheckpointOptions>,
}

/// Values that the keywords state, before they are combined.
#[derive(Default)]
struct Given {
    width: Option<u32>,
    height: Option<u32>,
    crop: Option<[f64; 4]>,
    budget: Option<std::time::Duration>,
    target_error: Option<f64>,
    max_spp: Option<u32>,
    adaptive: Option<Adaptive>,
    denoise: Option<Option<Denoise>>,
    sampler: Option<Sampler>,
    roulette: Option<bool>,
    roulette_depth: Option<u32>,
    aovs: Vec<Aov>,
    progress: Option<ProgressCallback>,
    samples: Option<Range<u32>>,
    checkpoint: Option<PathBuf>,
    every: Option<SaveInterval>,
    resumes: Option<bool>,
    has_ranks: bool,
}

impl RenderOptions {
    /// Reads the arguments of a call.
    ///
    /// # Errors
    ///
    /// `TypeError` for an unknown keyword, `SettingsError` for a value out of range.
    pub fn read(
        scene: &Scene,
        spp: Option<&Bound<'_, PyAny>>,
        keywords: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut settings = Settings::of(&scene.inner);
        let mut given = Given::default();
        if let Some(spp) = spp {
            settings.samples = count("spp", spp)?;
        }
        for (name, value) in keywords.into_iter().flatten() {
            let name: String = name.extract()?;
            if !value.is_none() && !given.read(&name, &value, &mut settings)? {
                return Err(unexpected("render", &name));
            }
        }
        given.combine(settings, spp.is_some())
    }

    /// Reads the settings of a measurement, which are among [`SETTINGS`].
    ///
    /// # Errors
    ///
    /// `SettingsError` for a value out of range.
    pub fn settings(scene: &Scene, keywords: &[(String, Bound<'_, PyAny>)]) -> PyResult<Settings> {
        let (mut settings, mut given) = (Settings::of(&scene.inner), Given::default());
        for (name, value) in keywords {
            given.read(name, value, &mut settings)?;
        }
        Ok(given.combine(settings, false)?.settings)
    }
}

/// Returns the error for an unknown keyword of a function.
pub fn unexpected(function: &str, name: &str) -> PyErr {
    PyTypeError::new_err(format!("{function}() got an unexpected keyword argument {name:?}"))
}

impl Given {
    /// Reads a keyword. Returns false for an unknown one.
    fn read(&mut self, name: &str, value: &Bound<'_, PyAny>, settings: &mut Settings) -> PyResult<bool> {
        match name {
            "width" => self.width = Some(count(name, value)?),
            "height" => self.height = Some(count(name, value)?),
            "crop" => self.crop = Some(crop(value)?),
            "depth" => settings.depth = count(name, value)?,
            "seed" => {
                let remedy = "it must be a whole number from 0 to 4294967295";
                settings.seed = number(value).ok_or_else(|| wrong(name, value, remedy))?;
            }
            "sampler" => {
                let words = [("sobol", Sampler::Sobol), ("independent", Sampler::Independent)];
                self.sampler = Some(word(name, value, &words)?);
            }
            "roulette" => self.roulette = Some(flag(name, value)?),
            "roulette_depth" => self.roulette_depth = Some(count(name, value)?),
            "light_sampling" => settings.light_sampling = flag(name, value)?,
            "clamp" => {
                let is_number = !value.is_instance_of::<PyBool>();
                let number: Option<f32> =
                    value.extract().ok().filter(|clamp: &f32| is_number && *clamp > 0.0);
                settings.clamp =
                    Some(number.ok_or_else(|| wrong(name, value, "it must be a radiance above 0"))?);
            }
            "transparent" => settings.hidden_sky = flag(name, value)?,
            "denoise" => self.denoise = Some(word(name, value, &DENOISERS)?),
            "budget" => self.budget = Some(time(name, value)?),
            "target_error" => self.target_error = Some(share(name, value)?),
            "max_spp" => self.max_spp = Some(count(name, value)?),
            "adaptive" => {
                let words = [("auto", Adaptive::Auto), ("on", Adaptive::On), ("off", Adaptive::Off)];
                self.adaptive = Some(word(name, value, &words)?);
            }
            "aov" => self.aovs = aovs(value)?,
            "progress" => self.progress = ProgressCallback::read(value, "bar")?,
            "sample_range" => self.samples = Some(samples(value)?),
            "checkpoint" => self.checkpoint = Some(path(name, value)?),
            "checkpoint_every" => self.every = Some(interval(name, value)?),
            "resume" => self.resumes = Some(flag(name, value)?),
            "comm" => self.has_ranks = true,
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn combine(mut self, mut settings: Settings, has_spp: bool) -> PyResult<RenderOptions> {
        let follow = |given: u32, from: u32, to: u32| {
            let scaled = f64::from(given) * f64::from(to) / f64::from(from);
            scaled.round().clamp(1.0, f64::from(u32::MAX)) as u32
        };
        let (width, height) = (settings.width, settings.height);
        (settings.width, settings.height) = match (self.width, self.height) {
            (Some(wide), Some(high)) => (wide, high),
            (Some(wide), None) => (wide, follow(wide, width, height)),
            (None, Some(high)) => (follow(high, height, width), high),
            (None, None) => (width, height),
        };
        if let Some(crop) = self.crop {
            settings = cropped(settings, crop)?;
        }
        settings.sampler = self.sampler.unwrap_or(settings.sampler);
        settings.roulette = self.roulette.unwrap_or(self.roulette_depth.is_some());
        settings.roulette_depth = self.roulette_depth.unwrap_or(settings.roulette_depth);
        self.check_together(has_spp)?;
        let samples = self.samples.take().unwrap_or(0..settings.samples);
        let (every, resumes) = (self.every.unwrap_or_default(), self.resumes == Some(true));
        let checkpoint = self.checkpoint.take().map(|path| CheckpointOptions { path, every, resumes });
        let denoise = self.denoise.map(|name| name.map(Denoiser::from));
        let goal = match (self.budget, self.target_error) {
            (Some(time), _) => Some(Goal::Time(time)),
            (_, Some(target)) => {
                Some(Goal::Error { target, max_samples: self.max_spp.unwrap_or(DEFAULT_MAX_SAMPLES) })
            }
            (None, None) => None,
        };
        let is_timed = matches!(goal, Some(Goal::Time(_)));
        let denoisers = match &denoise {
            Some(given) => given.iter().copied().collect(),
            None if is_timed => Denoiser::choices().map_err(|error| error::of_library(error.into()))?,
            None => Vec::new(),
        };
        let request = goal.map(|goal| Request {
            goal,
            adaptive: self.adaptive.unwrap_or(Adaptive::Auto),
            free: Free {
                roulette: self.roulette.is_none() && self.roulette_depth.is_none(),
                roulette_depth: self.roulette_depth.is_none(),
                sampler: self.sampler.is_none(),
                denoise: is_timed && denoise.is_none(),
            },
            denoisers,
        });
        let denoise = denoise.flatten().filter(|_| !is_timed);
        settings.guides =
            denoise.is_some() || settings.hidden_sky || self.aovs.iter().any(|aov| aov.needs_aov_sums());
        let (aovs, progress) = (self.aovs, self.progress);
        Ok(RenderOptions { settings, request, denoise, aovs, progress, samples, checkpoint })
    }

    /// Checks that no keyword excludes another or lacks the one that it belongs to.
    fn check_together(&self, has_spp: bool) -> PyResult<()> {
        let given = |goals: &[(&'static str, bool)]| -> Vec<&'static str> {
            goals.iter().filter(|goal| goal.1).map(|goal| goal.0).collect()
        };
        let goals = [("budget", self.budget.is_some()), ("target_error", self.target_error.is_some())];
        if let [first, second, ..] = given(&[&[("spp", has_spp)], &goals[..]].concat())[..] {
            let message = format!("{first} and {second} cannot be combined: each says when the render ends");
            return Err(conflict(message, None));
        }
        let of_films = [
            ("sample_range", self.samples.is_some()),
            ("checkpoint", self.checkpoint.is_some()),
            ("comm", self.has_ranks),
        ];
        if let ([goal, ..], [name, ..]) = (&given(&goals)[..], &given(&of_films)[..]) {
            let message = format!(
                "{name} and {goal} cannot be combined: the samples of {goal} depend on all earlier ones; use spp"
            );
            return Err(conflict(message, Some(name)));
        }
        if self.has_ranks && self.checkpoint.is_some() {
            let message = "checkpoint and comm cannot be combined; save the film of rank 0 by Film.save";
            return Err(conflict(message.to_owned(), Some("checkpoint")));
        }
        let has_goal = goals.iter().any(|goal| goal.1);
        let needs = [
            ("max_spp", self.max_spp.is_some(), "target_error", self.target_error.is_some()),
            ("adaptive", self.adaptive.is_some(), "budget or target_error", has_goal),
            ("roulette_depth", self.roulette_depth.is_some(), "roulette", self.roulette != Some(false)),
            ("checkpoint_every", self.every.is_some(), "checkpoint", self.checkpoint.is_some()),
            ("resume", self.resumes == Some(true), "checkpoint", self.checkpoint.is_some()),
        ];
        match needs.into_iter().find(|(_, is_given, _, has_other)| *is_given && !has_other) {
            Some((name, _, other, _)) => {
                Err(conflict(format!("{name} has no effect without {other}"), Some(name)))
            }
            None => Ok(()),
        }
    }
}

/// Returns the error for keywords that exclude or need each other.
fn conflict(message: String, place: Option<&str>) -> PyErr {
    let place = place.map(str::to_owned);
    error::raise("SettingsError", message, error::Facts { kind: "Goals", place, ..Default::default() })
}
