//! Checkpoints, time limit and interrupts of a render: when it stops, and where its film is kept.
//!
//! A render calls [`RenderSupervisor`] between its parts. Used by `render`, `resume` and their
//! versions over ranks.

use super::display::Display;
use super::fallback_path::write_to_fallback_path;
use super::signals::INTERRUPTED;
use super::{Session, eprint};
use crate::cli::{CheckpointArgs, RenderArgs};
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use trisect::adaptive::GoalProgress;
use trisect::checkpoint::{Checkpoint, CheckpointError, FORMAT, Header, Identity, Place, Saver};
use trisect::film::{Film, SampleCoverage};
use trisect::render::{FilmObserver, RenderObserver};
use trisect_lab::Error;

/// Exit code of a command that `--time-limit` ended.
pub const OUT_OF_TIME: u8 = 7;

/// Reason for which a render ended before it was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// SIGINT, or SIGTERM as queues send it when the time of a job is over.
    Interrupted,
    /// The end of `--time-limit`.
    OutOfTime,
}

impl StopReason {
    /// Returns the exit code if all outputs were written to their requested paths.
    pub fn exit_code(self) -> ExitCode {
        match self {
            Self::Interrupted => ExitCode::from(INTERRUPTED as u8),
            Self::OutOfTime => ExitCode::from(OUT_OF_TIME),
        }
    }
}

/// Ends a render after an interrupt or at its time limit, writes its checkpoints, and shows its
/// film.
pub struct RenderSupervisor {
    interrupted: Arc<AtomicBool>,
    end: Option<Instant>,
    saver: Option<Saver>,
    display: Option<Arc<Display>>,
}

/// Shows a progress bar, and acknowledges an interrupt.
pub struct ProgressObserver<'a, O: RenderObserver> {
    /// Progress bar.
    pub bar: O,
    /// Supervisor that notices the interrupt.
    pub watch: &'a RenderSupervisor,
    /// True if the interrupt was acknowledged, or if it should not be.
    pub announced: bool,
}

impl<O: RenderObserver> RenderObserver for ProgressObserver<'_, O> {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        if !self.announced && self.watch.interrupted.load(Ordering::Relaxed) {
            self.announced = true;
            eprint(
                "interrupted: finishing the current part if that is soon, then writing what was rendered; a second interrupt ends at once",
            );
        }
        self.bar.progress(done, total)
    }

    fn goal_progress(&mut self, state: GoalProgress) {
        self.bar.goal_progress(state);
    }

    fn should_continue(&self) -> bool {
        self.watch.stop_reason().is_none()
    }
}

impl RenderSupervisor {
    /// Returns the supervisor of a command that started at `start` and writes checkpoints by
    /// `saver`. A signal handler sets `interrupted`.
    pub fn new(
        arguments: &RenderArgs,
        saver: Option<Saver>,
        start: Instant,
        interrupted: Arc<AtomicBool>,
    ) -> Self {
        // A limit beyond the range of the clock is no limit.
        let end = arguments.checkpointing.time_limit.and_then(|limit| start.checked_add(limit));
        Self { interrupted, end, saver, display: None }
    }

    /// Shows the film on `display`, if there is one.
    pub fn showing(self, display: Option<&Arc<Display>>) -> Self {
        Self { display: display.cloned(), ..self }
    }

    /// Returns the reason for which the render should end, or `None` while it should continue.
    pub fn stop_reason(&self) -> Option<StopReason> {
        let late = self.end.is_some_and(|end| Instant::now() >= end);
        match self.interrupted.load(Ordering::Relaxed) {
            true => Some(StopReason::Interrupted),
            false => late.then_some(StopReason::OutOfTime),
        }
    }

    /// Records in the checkpoint that a device with this arithmetic continued the film.
    pub fn add_rounding(&self, arithmetic: &str) {
        if let Some(saver) = &self.saver {
            saver.add_rounding(arithmetic);
        }
    }

    /// Writes the checkpoint after an error, which the caller reports later. Writes nothing for an
    /// empty film.
    pub fn rescue(&self, film: &Film, quiet: bool) {
        if !film.coverage.parts().is_empty()
            && let Err(error) = self.finish(film, quiet)
        {
            eprint(&format!("error: {error}"));
        }
    }

    /// Writes the last checkpoint, to a fallback path if its own cannot be written. Returns whether
    /// it was written to its own path; true without checkpoints.
    pub fn finish(&self, film: &Film, quiet: bool) -> Result<bool, Error> {
        let Some(saver) = &self.saver else { return Ok(true) };
        let Err(error) = saver.finish(film) else {
            if !quiet {
                eprint(&format!("wrote {}", saver.path().display()));
            }
            return Ok(true);
        };
        let write = |path: &Path| Ok(trisect::checkpoint::write(path, &saver.header(), film)?);
        let written = write_to_fallback_path(saver.path(), write);
        eprint(&format!("error: {error}"));
        eprint(&format!("wrote the checkpoint to {} instead", written?.display()));
        Ok(false)
    }
}

impl FilmObserver for RenderSupervisor {
    fn should_continue(&self) -> bool {
        self.stop_reason().is_none()
    }

    fn wants_film(&self, coverage: &SampleCoverage) -> bool {
        self.saver.as_ref().is_some_and(|saver| saver.is_due(coverage))
            || self.display.as_deref().is_some_and(Display::is_due)
    }

    fn part_added(&self, film: &Film) {
        if let Some(display) = &self.display {
            display.show_if_due(film);
        }
        let Some(saver) = &self.saver else { return };
        saver.save_if_due(film);
        if let Some(error) = saver.failure() {
            eprint(&format!("warning: {error}; the render continues, and the next checkpoint tries again"));
        }
    }
}

/// Film and samples with which a render starts.
pub struct RenderStart {
    /// Film: empty, or that of the checkpoint to continue.
    pub film: Film,
    /// Samples that the complete film has.
    pub samples: Range<u32>,
    /// Writer of checkpoints, with `--checkpoint` or when resuming.
    pub saver: Option<Saver>,
}

impl RenderStart {
    /// Returns the start of a new render, or of one that continues from the checkpoint `before`.
    ///
    /// # Errors
    ///
    /// Invalid samples, a checkpoint of another image, too little memory, or a command line or
    /// folder that is not Unicode and so cannot be stored in a checkpoint.
    pub fn new(
        arguments: &RenderArgs,
        session: &Session,
        before: Option<(Place, Checkpoint)>,
    ) -> Result<Self, Error> {
        let settings = &session.settings;
        let CheckpointArgs { checkpoint, every, .. } = &arguments.checkpointing;
        let every = every.unwrap_or_default();
        let spp = settings.samples;
        let samples = arguments.checkpointing.samples.as_ref().map_or(0..spp, |samples| samples.0.clone());
        settings
            .check_part(&trisect::film::SampleBlock { rows: 0..settings.height, samples: samples.clone() })?;
        // The saver copies the film before it writes it.
        let copy = if checkpoint.is_some() { Film::bytes_per_pixel(settings.guides) } else { 0 };
        let digest = session.digest.filter(|_| checkpoint.is_some());
        let identity = digest.map(|digest| Identity::new(&digest, settings, &session.renderer));
        if let (Some((place, Checkpoint { mut header, film })), Some(identity)) = (before, &identity) {
            if session.fell_back {
                // The fallback continues the film: its arithmetic is recorded, as during a render.
                header.identity.add_rounding(&identity.arithmetic);
            }
            let path = || place.path().to_owned();
            let differs = |difference| CheckpointError::Differs { path: path(), difference };
            identity.check(&header.identity).map_err(differs)?;
            let saver = Some(Saver::resume(place, header, every, &film));
            return Ok(Self { film, samples, saver });
        }
        settings.check_with(copy)?;
        let header = match identity {
            Some(identity) => Some(Header {
                format: FORMAT,
                identity,
                scene: session.name.clone(),
                command: command()?,
                folder: folder()?,
                spp,
                samples: samples.clone(),
                seconds: 0.0,
                camera: Some(session.camera_metadata()),
            }),
            None => None,
        };
        let new = if settings.guides { Film::with_aovs } else { Film::new };
        let film = new(settings.width, settings.height);
        let saver = checkpoint.as_ref().zip(header);
        let saver = saver.map(|(path, header)| Saver::new(path, header, every));
        Ok(Self { film, samples, saver })
    }
}

/// Returns the arguments of this process without its name, for the header of a checkpoint.
fn command() -> Result<Vec<String>, CheckpointError> {
    let text = |argument: std::ffi::OsString| {
        argument
            .into_string()
            .map_err(|argument| CheckpointError::NoText { what: argument.to_string_lossy().into_owned() })
    };
    std::env::args_os().skip(1).map(text).collect()
}

fn folder() -> Result<PathBuf, CheckpointError> {
    let folder = std::env::current_dir().unwrap_or_default();
    match folder.to_str() {
        Some(_) => Ok(folder),
        None => Err(CheckpointError::NoText { what: folder.display().to_string() }),
    }
}
