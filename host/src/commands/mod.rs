//! One file a command.

pub mod bench;
pub mod check;
pub mod compare;
pub mod info;
pub mod render;
pub mod report;
pub mod view;

use crate::cli::{BackendArg, JobArgs};
use std::io::Write;
use std::time::Instant;
use trisect::Error;
use trisect::backend::{self, Selection};
use trisect::limits;
use trisect::render::{Renderer, Settings};
use trisect::scene::{Described, Space};

/// A scene on a backend with the command line's settings.
pub struct Session {
    /// Ready to render.
    pub renderer: Renderer,
    /// What to render.
    pub settings: Settings,
    /// Of the scene.
    pub name: String,
    /// Where it is computed.
    pub space: Space,
    /// Why this backend; empty where the user named it.
    pub choice: String,
    /// Reading and validating the scene.
    pub load_seconds: f64,
    /// Opening the device.
    pub open_seconds: f64,
}

impl Session {
    /// Reads the scene, checks the settings, opens the backend.
    pub fn open(job: &JobArgs) -> Result<Self, Error> {
        let start = Instant::now();
        let described = match &job.scene {
            Some(path) => Described::load(path)?,
            None => Described::hello_world()?,
        };
        let settings = job.settings(described.settings());
        settings.check()?;
        let beyond = limits::warnings(&described, &settings);
        let space = described.space;
        let scene = described.lower(Space::IDENTITY)?;
        let load_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let Selection { backend, why } = open(job.backend, job.device, job.threads)?;
        let open_seconds = start.elapsed().as_secs_f64();
        let quality = job.bvh_quality.map(crate::cli::QualityArg::quality);
        let renderer = Renderer::with_quality(backend, &scene, quality)?;
        let mut warnings = scene.warnings;
        if !settings.light_sampling && !scene.lights.is_empty() {
            warnings.push("--light-sampling off: lights without extent stay dark".to_owned());
        }
        let name = job.scene.as_ref().map_or_else(|| "SCENE".to_owned(), |path| path.display().to_string());
        warnings.extend(beyond.iter().map(|line| format!("{line}; what helps: trisect check {name}")));
        for warning in &warnings {
            eprintln!("warning: {warning}");
        }
        Ok(Self { renderer, settings, name: scene.name, space, choice: why, load_seconds, open_seconds })
    }
}

/// Opens the backend that the command line names.
pub fn open(backend: BackendArg, device: Option<usize>, threads: Option<u32>) -> Result<Selection, Error> {
    if backend == BackendArg::Auto && device.is_some() {
        return Err(trisect::render::SettingsError::DeviceOfWhat.into());
    }
    let threads = threads.map(|threads| threads as usize);
    Ok(backend::open(backend.choice(), device, threads)?)
}

/// Writes a command's data to standard output. A reader that went away wants no more: that is no error.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(trisect::image::ImageError::Io { path: "standard output".into(), source }.into())
        }
        _ => Ok(()),
    }
}
