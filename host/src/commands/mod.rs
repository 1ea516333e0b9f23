//! One file a command.

pub mod bench;
pub mod check;
mod checkpointing;
#[cfg(feature = "mpi")]
pub mod cluster;
pub mod compare;
mod data;
pub mod doctor;
mod fallback_path;
pub mod info;
mod lab;
pub mod render;
pub mod report;
pub mod resume;
pub mod shell;
mod signals;
pub mod tradeoff;
pub mod view;

pub use crate::terminal::{eprint, print};

use crate::cli::{BackendArg, CheckpointArgs, ClusterArgs, FallbackArg, JobArgs};
use std::time::Instant;
use trisect::Error;
use trisect::backend::{self, Selection};
use trisect::cluster::ClusterError;
use trisect::output::Outputs;
use trisect::precision;
use trisect::render::{MathMode, Renderer, Settings};
use trisect::scene::{Rebase, Scene, SceneDocument};
use trisect::threads::start_shared;

/// A scene on a backend with the command line's settings.
pub struct Session {
    /// Ready to render.
    pub renderer: Renderer,
    /// What to render.
    pub settings: Settings,
    /// Of the scene.
    pub name: String,
    /// Of the scene with all that it refers to, where that is asked for.
    pub digest: Option<[u8; 32]>,
    /// Where it is computed.
    pub space: Rebase,
    /// Why this backend; empty where the user named it.
    pub choice: String,
    /// What was decided about a model by itself.
    pub notes: Vec<String>,
    /// Reading and validating the scene.
    pub load_seconds: f64,
    /// Opening the device.
    pub open_seconds: f64,
    /// The scene, for who goes on where the device fails.
    pub fallback_scene: Option<Loaded>,
    /// Whether the device could not be had, and another has its place.
    pub fell_back: bool,
}

/// A scene that was read, with the command line's settings.
pub struct Loaded {
    /// For the device.
    pub scene: Scene,
    /// What to render.
    pub settings: Settings,
    space: Rebase,
    warnings: Vec<String>,
    notes: Vec<String>,
    seconds: f64,
}

impl Loaded {
    /// Reads the scene and checks the settings, and that no output is one of the scene's files.
    pub fn read(job: &JobArgs, outputs: &Outputs) -> Result<Self, Error> {
        let start = Instant::now();
        let described = match &job.scene {
            Some(path) => SceneDocument::load_including(path, job.includes.includes())?,
            None => SceneDocument::hello_world()?,
        };
        outputs.check_inputs("the scene", &job.scene)?;
        outputs.check_inputs("a file of the scene", &described.description.files)?;
        let settings = job.settings(described.settings());
        settings.check()?;
        let beyond = precision::warnings(&described, &settings);
        let (space, notes) = (described.space, described.notes.clone());
        let scene = described.lower(Rebase::IDENTITY)?;
        let mut warnings = scene.warnings.clone();
        if !settings.light_sampling && !scene.lights.is_empty() {
            warnings.push("--light-sampling off: lights without extent stay dark".to_owned());
        }
        if job.roulette_depth.is_some() && !settings.roulette && !job.may_roulette {
            warnings.push("--roulette-depth does nothing without --roulette on; add it".to_owned());
        }
        let name = job.scene.as_ref().map_or_else(|| "SCENE".to_owned(), |path| path.display().to_string());
        warnings.extend(beyond.iter().map(|line| format!("{line}; what helps: trisect check {name}")));
        Ok(Self { scene, settings, space, warnings, notes, seconds: start.elapsed().as_secs_f64() })
    }

    /// Of a scene that was read elsewhere.
    #[cfg(feature = "mpi")]
    pub fn of(scene: Scene, job: &JobArgs) -> Result<Self, Error> {
        let settings = job.settings(scene.settings());
        settings.check()?;
        let (warnings, notes) = (Vec::new(), Vec::new());
        Ok(Self { scene, settings, space: Rebase::IDENTITY, warnings, notes, seconds: 0.0 })
    }

    /// Says what is not as asked for.
    pub fn warn(&self) {
        for warning in &self.warnings {
            eprint(&format!("warning: {warning}"));
        }
    }

    /// Puts it on a backend.
    pub fn on(&self, selection: Selection, open_seconds: f64, job: &JobArgs) -> Result<Session, Error> {
        let Self { ref scene, ref settings, space, seconds: load_seconds, .. } = *self;
        let quality = job.bvh_quality.map(crate::cli::QualityArg::quality);
        let renderer = Renderer::with_quality(selection.backend, scene, quality)?;
        let (settings, name, choice) = (settings.clone(), scene.name.clone(), selection.why);
        let notes = self.notes.clone();
        Ok(Session {
            renderer,
            settings,
            name,
            digest: None,
            space,
            choice,
            notes,
            load_seconds,
            open_seconds,
            fallback_scene: None,
            fell_back: false,
        })
    }

    /// Puts it on this machine's threads, whatever the command line said of a device.
    pub fn on_cpu(&self, job: &JobArgs) -> Result<Session, Error> {
        let start = Instant::now();
        let selection = open(BackendArg::Cpu, None, job.threads)?;
        let mut session = self.on(selection, start.elapsed().as_secs_f64(), job)?;
        fit_to_cpu(&mut session.settings);
        Ok(session)
    }
}

/// Leaves out what is for devices, on none of which the image depends but for its rounding.
pub fn fit_to_cpu(settings: &mut Settings) {
    let Settings { variant, traversal, schedule, tile, math, .. } = settings;
    (*variant, *traversal, *schedule, *tile, *math) = (None, None, None, None, MathMode::Precise);
}

impl Session {
    /// The same for a render that is not to be lost: with the scene's digest for a checkpoint, and on the fallback where the device cannot be had.
    pub fn open_with_checkpoint(
        job: &JobArgs,
        keep: &CheckpointArgs,
        outputs: &Outputs,
    ) -> Result<Self, Error> {
        let loaded = Loaded::read(job, outputs)?;
        loaded.warn();
        let digest = keep.checkpoint.is_some().then(|| loaded.scene.digest());
        let start = Instant::now();
        let opened = open(job.backend, job.device, job.threads)
            .and_then(|selection| loaded.on(selection, start.elapsed().as_secs_f64(), job));
        let session = match (opened, keep.fallback) {
            (Err(Error::Backend(error)), Some(FallbackArg::Cpu)) if error.is_of_device() => {
                eprint(&format!("warning: {error}\n  the CPU renders instead (--fallback)"));
                Self { fell_back: true, ..loaded.on_cpu(job)? }
            }
            (opened, _) => opened?,
        };
        let spare =
            keep.fallback.map(|_| loaded).filter(|_| session.renderer.backend().device().backend != "cpu");
        Ok(Self { digest, fallback_scene: spare, ..session })
    }

    /// Reads the scene, checks the settings, opens the backend. The command is to write these
    /// files.
    pub fn open(job: &JobArgs, outputs: &Outputs) -> Result<Self, Error> {
        Self::open_with_checkpoint(job, &CheckpointArgs::default(), outputs)
    }
}

/// Several processes that render the same image each would write over each other's; and one alone has no use for what ranks do.
pub fn refuse_ranks(cluster: &ClusterArgs) -> Result<(), Error> {
    let remedy = "add --distribute rows, average or auto".to_owned();
    if let Some(name) = cluster.without_ranks() {
        return Err(ClusterError::Unsupported { what: format!("{name} is for several ranks"), remedy }.into());
    }
    let ranks = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].into_iter().find_map(|name| std::env::var(name).ok());
    match ranks.and_then(|ranks| ranks.parse::<u32>().ok()) {
        Some(ranks) if ranks > 1 => {
            let what = format!("mpirun started {ranks} ranks, and each would render the whole image");
            Err(ClusterError::Unsupported { what, remedy }.into())
        }
        _ => Ok(()),
    }
}

/// Opens the backend that the command line names.
pub fn open(backend: BackendArg, device: Option<usize>, threads: Option<u32>) -> Result<Selection, Error> {
    if backend == BackendArg::Auto && device.is_some() {
        return Err(trisect::render::SettingsError::DeviceWithoutBackend.into());
    }
    let threads = threads.map(|threads| threads as usize);
    start_shared(threads)?;
    Ok(backend::open(backend.choice(), device, threads)?)
}
