//! Keyword arguments of a measurement.

use crate::device::DeviceChoice;
use crate::error;
use crate::options::{RenderOptions, SETTINGS, unexpected};
use crate::progress_callback::ProgressCallback;
use crate::scene::Scene;
use crate::words::{count, number, time, wrong};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};
use std::path::PathBuf;
use std::time::Duration;
use trisect_lab::tradeoff::{Configuration, MAX_SEEDS, RenderCommand, cache_folder, check_seeds};

/// Maximum time of a measurement, as in the program.
const TIME_LIMIT: Duration = Duration::from_secs(8 * 60);

/// Maximum of a time limit, so that sums of times do not overflow.
const MAX_LIMIT: Duration = Duration::from_secs(u32::MAX as u64);

/// Repetitions of each configuration, as in the program.
const SEEDS: usize = 8;

/// Arguments that measurements of both kinds take.
pub struct LabOptions {
    /// Base configuration.
    pub base: Configuration,
    /// Device to measure on.
    pub device: DeviceChoice,
    /// Options to vary; empty if not given.
    pub knobs: Vec<String>,
    /// Repetitions (seeds).
    pub seeds: usize,
    /// Maximum time.
    pub limit: Duration,
    /// Folder that keeps references.
    pub cache: PathBuf,
    /// Maximum mean samples per pixel of the reference.
    pub reference_spp: Option<u32>,
    /// True if the size of the images is given.
    pub has_size: bool,
    /// Callable that receives the progress.
    pub progress: Option<ProgressCallback>,
    /// Command that renders the base; `None` if the scene is not a file.
    pub command: Option<RenderCommand>,
}

/// Values that the keywords state.
#[derive(Default)]
struct Given<'py> {
    backend: Option<Bound<'py, PyAny>>,
    device: Option<usize>,
    threads: Option<usize>,
    knobs: Vec<String>,
    seeds: Option<usize>,
    limit: Option<Duration>,
    cache: Option<PathBuf>,
    reference_spp: Option<u32>,
    progress: Option<ProgressCallback>,
    settings: Vec<(String, Bound<'py, PyAny>)>,
    /// Options of the program with the same meaning.
    options: Vec<(String, Option<String>)>,
}

impl LabOptions {
    /// Reads the arguments of a call of `function`. `own` reads those of that function alone, and
    /// returns false for others.
    ///
    /// # Errors
    ///
    /// `TypeError` for an unknown keyword, `SettingsError` for a value out of range.
    pub fn read(
        scene: &Scene,
        function: &str,
        keywords: Option<&Bound<'_, PyDict>>,
        mut own: impl FnMut(&str, &Bound<'_, PyAny>) -> PyResult<bool>,
    ) -> PyResult<Self> {
        let mut given = Given::default();
        for (name, value) in keywords.into_iter().flatten() {
            let name: String = name.extract()?;
            if !value.is_none() && !own(&name, &value)? && !given.read(&name, &value)? {
                return Err(unexpected(function, &name));
            }
        }
        let Given { backend, device, threads, knobs, cache, reference_spp, progress, .. } = given;
        let settings = RenderOptions::settings(scene, &given.settings)?;
        settings.check().map_err(|error| error::of_library(error.into()))?;
        let command = scene.command().map(|mut command| {
            command.options.extend(given.options);
            command
        });
        Ok(Self {
            base: Configuration::base(&settings, None),
            device: DeviceChoice::read(backend.as_ref(), device, threads)?,
            knobs,
            seeds: given.seeds.unwrap_or(SEEDS),
            limit: given.limit.unwrap_or(TIME_LIMIT).min(MAX_LIMIT),
            cache: cache_folder(cache.as_deref()).map_err(|error| super::of_measurement(&error))?,
            reference_spp,
            has_size: given.settings.iter().any(|(name, _)| name == "width" || name == "height"),
            progress,
            command,
        })
    }
}

impl<'py> Given<'py> {
    /// Reads a keyword. Returns false for an unknown one.
    fn read(&mut self, name: &str, value: &Bound<'py, PyAny>) -> PyResult<bool> {
        match name {
            "knobs" => self.knobs = knobs(value)?,
            "seeds" => self.seeds = Some(seeds(value)?),
            "time_limit" => self.limit = Some(time(name, value)?),
            "cache" => {
                let folder =
                    value.extract().map_err(|_| wrong(name, value, "it must be the path of a folder"));
                self.cache = Some(folder?);
            }
            "reference_spp" => self.reference_spp = Some(count(name, value)?),
            "progress" => self.progress = ProgressCallback::read(value, "stages")?,
            "backend" => self.backend = Some(value.clone()),
            "device" => self.device = Some(index(name, value)?),
            "threads" => self.threads = Some(index(name, value)?),
            _ if SETTINGS.contains(&name) => self.settings.push((name.to_owned(), value.clone())),
            _ => return Ok(false),
        }
        if SETTINGS.contains(&name) || ["backend", "device", "threads"].contains(&name) {
            let text = match value.extract::<bool>() {
                Ok(is_on) => (if is_on { "on" } else { "off" }).to_owned(),
                Err(_) => value.str()?.to_string(),
            };
            self.options.push((format!("--{}", name.replace('_', "-")), Some(text)));
        }
        Ok(true)
    }
}

/// Returns a whole number from 0 on.
fn index(name: &str, value: &Bound<'_, PyAny>) -> PyResult<usize> {
    let number = number(value).map(|number| number as usize);
    number.ok_or_else(|| wrong(name, value, "it must be a whole number from 0 on"))
}

/// Returns a number of repetitions.
fn seeds(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    let remedy =
        format!("it must be a whole number from {} to {MAX_SEEDS}", trisect_lab::tradeoff::MIN_SEEDS);
    let number = number(value).map(|number| number as usize).filter(|number| *number <= MAX_SEEDS);
    let number = number.ok_or_else(|| wrong("seeds", value, &remedy))?;
    check_seeds(number).map_err(|error| super::of_measurement(&error))?;
    Ok(number)
}

/// Returns the names of options to vary: those of a sequence, or of a text with commas between
/// them.
fn knobs(value: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    let remedy = "it must be names of options, such as [\"sampler\", \"depth\"]; None takes the default";
    let names: Option<Vec<String>> = match value.cast::<PyString>() {
        Ok(text) => Some(text.to_string().split(',').map(|name| name.trim().to_owned()).collect()),
        Err(_) => value.extract().ok(),
    };
    names.filter(|names| !names.is_empty()).ok_or_else(|| wrong("knobs", value, remedy))
}

/// Returns numbers of samples per pixel: one, or those of a sequence.
pub fn levels(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    let remedy = "it must be a whole number of samples per pixel above 0, or a sequence of such numbers";
    let each: Option<Vec<u32>> = match number(value) {
        Some(one) => Some(vec![one]),
        None if value.is_instance_of::<PyString>() || value.is_instance_of::<PyBool>() => None,
        None => value.try_iter().ok().and_then(|all| all.map(|one| number(&one.ok()?)).collect()),
    };
    let is_valid = |each: &Vec<u32>| !each.is_empty() && each.iter().all(|spp| *spp > 0);
    each.filter(is_valid).ok_or_else(|| wrong(name, value, remedy))
}
