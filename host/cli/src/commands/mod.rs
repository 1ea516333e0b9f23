//! Implementation of the commands, one module per command, and the code that several of them share.
//!
//! `main` calls a command with its parsed arguments and gets an exit code or an error.
//! [`Loaded`] is a scene with its settings, [`Session`] the same on an open backend.

mod background;
mod bench;
pub mod check;
mod checkpointing;
#[cfg(feature = "mpi")]
mod cluster;
pub mod compare;
mod data;
pub mod dispatch;
mod display;
pub mod doctor;
pub mod evaluate;
mod fallback_path;
mod frames;
mod given_options;
pub mod info;
mod lab;
mod render;
mod report;
pub mod resume;
pub mod scenes;
pub mod shell;
mod signals;
pub mod tradeoff;
mod view;
pub mod watch;

pub use crate::terminal::{eprint, print};

use crate::cli::{CheckpointArgs, ClusterArgs, FallbackArg, JobArgs, MetadataArg, RenderArgs};
use display::Display;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Instant;
use trisect::device::{self, Choice, Selection};
use trisect::image::ImageError;
use trisect::metadata;
use trisect::output::{CameraMetadata, Format, Outputs};
use trisect::precision;
use trisect::render::{KernelFeatures, MathMode, PreparedScene, Renderer, Settings, Summation};
use trisect::scene::{PartName, Rebase, Scene, SceneDocument, SceneError};
use trisect::surfaces::SurfaceScenes;
use trisect::threads::start_shared;
use trisect_cluster::ClusterError;
use trisect_lab::Error;

/// Scene on a backend, with the settings of the command line.
pub struct Session {
    /// Renderer with the scene on the backend.
    pub renderer: Renderer,
    /// Settings of the render.
    pub settings: Settings,
    /// Name of the scene.
    pub name: String,
    /// SHA-256 of the scene with all that it refers to; `None` if nothing
    /// needs it.
    pub digest: Option<[u8; 32]>,
    /// Space in which the scene is computed.
    pub space: Rebase,
    /// Reason for this backend; empty if the user named it.
    pub choice: String,
    /// Choices made for a model without a scene file, as lines to print.
    pub notes: Vec<String>,
    /// Names of the objects; empty unless the job needs them.
    pub names: Vec<PartName>,
    /// Scene of the image, and of the frames beside it; `None` unless the job needs them.
    pub surfaces: Option<SurfaceScenes>,
    /// Seconds of reading and validating the scene.
    pub load_seconds: f64,
    /// Seconds of opening the device.
    pub open_seconds: f64,
    /// Scene for the fallback device, with `--fallback`.
    pub fallback_scene: Option<Loaded>,
    /// Viewer that shows the image, with `--display`.
    pub display: Option<Arc<Display>>,
    /// True if the device could not be opened and the fallback replaces it.
    pub fell_back: bool,
}

/// Scene that was read, with the settings of the command line.
pub struct Loaded {
    /// Scene in the form that a backend takes.
    pub scene: Scene,
    /// Settings of the render.
    pub settings: Settings,
    space: Rebase,
    warnings: Vec<String>,
    notes: Vec<String>,
    names: Vec<PartName>,
    needs_surfaces: bool,
    seconds: f64,
}

impl Loaded {
    /// Reads the scene, and checks its settings and that no output is one of its files.
    pub fn read(job: &JobArgs, outputs: &Outputs) -> Result<Self, Error> {
        let start = Instant::now();
        let mut described = match &job.scene {
            Some(path) => SceneDocument::load_with(path, &job.load.options())?,
            None => SceneDocument::hello_world_with(&job.load.options())?,
        };
        described.sharing = job.instances.into();
        described.choose_camera(&job.camera.choice())?;
        Self::of_document(job, outputs, described, start, |described| described.lower(Rebase::IDENTITY))
    }

    /// Makes the scene of a document, the reading of which began at `start`, with the checks of
    /// [`read`](Self::read).
    pub fn of_document(
        job: &JobArgs,
        outputs: &Outputs,
        described: SceneDocument,
        start: Instant,
        lower: impl FnOnce(SceneDocument) -> Result<Scene, SceneError>,
    ) -> Result<Self, Error> {
        outputs.check_inputs("the scene", &job.scene)?;
        outputs.check_inputs("a file of the scene", &described.description.files)?;
        let whole = job.settings(described.image.into());
        let beyond = precision::warnings(&described, &whole.image());
        let settings = job.cropped(whole)?;
        settings.check()?;
        let (space, notes) = (described.space, described.notes.clone());
        let is_gltf = |path: &PathBuf| {
            path.extension()
                .is_some_and(|of| of.eq_ignore_ascii_case("gltf") || of.eq_ignore_ascii_case("glb"))
        };
        let has_gltf = job.scene.iter().chain(&described.description.files).any(is_gltf);
        let names = if job.needs_names { described.part_names() } else { Vec::new() };
        let scene = lower(described)?;
        let mut warnings = scene.warnings.clone();
        if !settings.light_sampling && !scene.lights.is_empty() {
            warnings.push("--light-sampling off: lights without extent stay dark".to_owned());
        }
        if job.roulette_depth.is_some() && !settings.roulette && !job.may_roulette {
            warnings.push("--roulette-depth has no effect with --roulette off; leave one out".to_owned());
        }
        if !has_gltf {
            let none = "has no effect: the scene has no glTF model";
            warnings.extend(job.load.model.given().into_iter().map(|name| format!("{name} {none}")));
        }
        let name = job.scene.as_ref().map_or_else(|| "SCENE".to_owned(), |path| path.display().to_string());
        warnings.extend(beyond.iter().map(|line| format!("{line}; for remedies: trisect check {name}")));
        let seconds = start.elapsed().as_secs_f64();
        let needs_surfaces = job.needs_surfaces;
        Ok(Self { scene, settings, space, warnings, notes, names, needs_surfaces, seconds })
    }

    /// Returns a scene that another rank has read, with the settings of `job`.
    #[cfg(feature = "mpi")]
    pub fn of(scene: Scene, job: &JobArgs) -> Result<Self, Error> {
        let settings = job.cropped(job.settings(Settings::of(&scene)))?;
        settings.check()?;
        let (space, warnings, notes, names) = (Rebase::IDENTITY, Vec::new(), Vec::new(), Vec::new());
        let needs_surfaces = job.needs_surfaces;
        Ok(Self { scene, settings, space, warnings, notes, names, needs_surfaces, seconds: 0.0 })
    }

    /// Prints the warnings.
    ///
    /// # Errors
    ///
    /// [`SceneError::Denied`] if there are some, and `job` denies them.
    pub fn warn(&self, job: &JobArgs) -> Result<(), Error> {
        warn(&self.warnings, &self.scene.name, job.deny_warnings)
    }

    /// Uploads the scene to a backend.
    pub fn on(
        &self,
        selection: Selection,
        open_seconds: f64,
        job: &JobArgs,
    ) -> Result<Session, trisect::Error> {
        let mut prepared = PreparedScene::new(&self.scene, job.bvh_quality)?;
        self.prepared_on(&mut prepared, selection, open_seconds)
    }

    /// Uploads the scene, which was prepared, to a backend.
    fn prepared_on(
        &self,
        prepared: &mut PreparedScene<'_>,
        selection: Selection,
        open_seconds: f64,
    ) -> Result<Session, trisect::Error> {
        let Self { ref scene, ref settings, space, seconds: load_seconds, .. } = *self;
        let renderer = Renderer::upload(selection.device, prepared)?;
        let (settings, name, choice) = (settings.clone(), scene.name.clone(), selection.why);
        let (notes, names) = (self.notes.clone(), self.names.clone());
        let still = || SurfaceScenes { scene: Arc::new(scene.clone()), neighbours: None };
        let surfaces = self.needs_surfaces.then(still);
        Ok(Session {
            renderer,
            settings,
            name,
            digest: None,
            space,
            choice,
            notes,
            names,
            surfaces,
            load_seconds,
            open_seconds,
            fallback_scene: None,
            display: None,
            fell_back: false,
        })
    }

    /// Uploads the scene to the CPU backend; options of `job` for another device are ignored.
    pub fn on_cpu(&self, job: &JobArgs) -> Result<Session, trisect::Error> {
        let start = Instant::now();
        let selection = open(Choice::Cpu, None, job.threads)?;
        let mut session = self.on(selection, start.elapsed().as_secs_f64(), job)?;
        fit_to_cpu(&mut session.settings);
        Ok(session)
    }
}

/// Resets the settings that are for other devices. They affect the image by rounding only.
pub fn fit_to_cpu(settings: &mut Settings) {
    let Settings { features, traversal, schedule, tile, sums, math, .. } = settings;
    (*traversal, *schedule, *tile, *sums) = (None, None, None, Summation::Auto);
    (*features, *math) = (KernelFeatures::Needed, MathMode::Precise);
}

impl Session {
    /// Reads the scene, checks the settings and opens the backend, as [`Session::open`] does. With
    /// `--checkpoint` and for metadata it also computes the scene's digest, in the meantime; with
    /// `--fallback` it opens the fallback if the device cannot be opened.
    pub fn open_to_render(job: &JobArgs, arguments: &RenderArgs, outputs: &Outputs) -> Result<Self, Error> {
        let keep = &arguments.checkpointing;
        let loaded = Loaded::read(job, outputs)?;
        check_size(&arguments.output, &loaded.settings)?;
        loaded.warn(job)?;
        let start = Instant::now();
        let open = || {
            open(job.backend, job.device, job.threads)
                .and_then(|selection| loaded.on(selection, start.elapsed().as_secs_f64(), job))
        };
        let needs_digest = keep.checkpoint.is_some() || arguments.file.metadata() != MetadataArg::None;
        let (opened, digest) = match needs_digest {
            true => with_digest(&loaded.scene, open),
            false => (open(), None),
        };
        let session = Self::or_on_cpu(opened, &loaded, job, keep)?;
        let spare =
            keep.fallback.map(|_| loaded).filter(|_| session.renderer.device().info().backend != "cpu");
        Ok(Self { digest, fallback_scene: spare, ..session })
    }

    /// Returns the camera of the image, for its file.
    pub fn camera_metadata(&self) -> CameraMetadata {
        let whole = self.settings.clone().uncropped();
        metadata::camera(&self.renderer.camera(&whole), self.space, (whole.width, whole.height))
    }

    /// Returns the opened session, or with `--fallback` one on the CPU if the device cannot be
    /// opened.
    fn or_on_cpu(
        opened: Result<Self, trisect::Error>,
        loaded: &Loaded,
        job: &JobArgs,
        keep: &CheckpointArgs,
    ) -> Result<Self, Error> {
        match (opened, keep.fallback) {
            (Err(trisect::Error::Backend(error)), Some(FallbackArg::Cpu)) if error.is_of_device() => {
                eprint(&format!("warning: {error}\n  the CPU renders instead (--fallback)"));
                Ok(Self { fell_back: true, ..loaded.on_cpu(job)? })
            }
            (opened, _) => Ok(opened?),
        }
    }

    /// Reads the scene, checks the settings and opens the backend. `outputs` are the files that the
    /// command will write.
    pub fn open(job: &JobArgs, outputs: &Outputs) -> Result<Self, Error> {
        let loaded = Loaded::read(job, outputs)?;
        loaded.warn(job)?;
        let start = Instant::now();
        let selection = open(job.backend, job.device, job.threads)?;
        Ok(loaded.on(selection, start.elapsed().as_secs_f64(), job)?)
    }
}

/// Checks that the format of an image file has room for the image.
fn check_size(path: &Path, settings: &Settings) -> Result<(), ImageError> {
    let side = settings.width.max(settings.height);
    match Format::of(path)?.max_side() {
        Some(most) if side > most => {
            let message = format!(
                "the image is {side} pixels long, and the format has at most {most}; use .png or .tif"
            );
            Err(ImageError::Codec { path: path.to_owned(), message })
        }
        _ => Ok(()),
    }
}

/// Calls `open`, and computes the digest of the scene in the meantime.
fn with_digest<T>(scene: &Scene, open: impl FnOnce() -> T) -> (T, Option<[u8; 32]>) {
    thread::scope(|scope| {
        let digest = thread::Builder::new().spawn_scoped(scope, || scene.digest());
        let opened = open();
        let digest = digest.ok().and_then(|digest| digest.join().ok());
        (opened, Some(digest.unwrap_or_else(|| scene.digest())))
    })
}

/// Prints warnings.
///
/// # Errors
///
/// [`SceneError::Denied`] of the scene `name` if there are some, and the user denies them.
pub fn warn(warnings: &[impl std::fmt::Display], name: &str, deny: bool) -> Result<(), Error> {
    for warning in warnings {
        eprint(&format!("warning: {warning}"));
    }
    match warnings.len() {
        count @ 1.. if deny => Err(SceneError::Denied { file: name.to_owned(), count }.into()),
        _ => Ok(()),
    }
}

/// Refuses options of ranks without `--distribute`, and several processes of mpirun without it:
/// each would render the whole image and overwrite the file of the others.
pub fn refuse_ranks(cluster: &ClusterArgs) -> Result<(), Error> {
    let remedy = "add --distribute rows, average or auto".to_owned();
    if let Some(name) = cluster.without_ranks() {
        return Err(ClusterError::Unsupported { what: format!("{name} is for several ranks"), remedy }.into());
    }
    match several_ranks() {
        Some(ranks) => {
            let what = format!("mpirun started {ranks} ranks, and each would render the whole image");
            Err(ClusterError::Unsupported { what, remedy }.into())
        }
        None => Ok(()),
    }
}

/// Refuses several processes of mpirun for a command that measures times: they would disturb each
/// other and write the same files.
pub fn refuse_ranks_that_measure() -> Result<(), Error> {
    match several_ranks() {
        Some(ranks) => {
            let what = format!("mpirun started {ranks} ranks, and each would measure while the others run");
            let remedy = "start one process, or measure the ranks with trisect bench cluster".to_owned();
            Err(ClusterError::Unsupported { what, remedy }.into())
        }
        None => Ok(()),
    }
}

/// Returns the number of ranks that mpirun started, if there are several.
fn several_ranks() -> Option<u32> {
    let ranks = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].into_iter().find_map(|name| std::env::var(name).ok());
    ranks.and_then(|ranks| ranks.parse::<u32>().ok()).filter(|ranks| *ranks > 1)
}

/// Opens the backend that the command line names, and starts the shared thread pool.
pub fn open(
    backend: Choice,
    device: Option<usize>,
    threads: Option<u32>,
) -> Result<Selection, trisect::Error> {
    if backend == Choice::Auto && device.is_some() {
        return Err(trisect::render::SettingsError::DeviceWithoutBackend.into());
    }
    let threads = threads.map(|threads| threads as usize);
    start_shared(threads)?;
    Ok(device::open(backend, device, threads)?)
}
