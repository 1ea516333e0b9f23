//! What keeps a render from being lost: checkpoints, and an end that was asked for.

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
use trisect::Error;
use trisect::checkpoint::{Checkpoint, CheckpointError, FORMAT, Header, Identity, Place, Saver};
use trisect::film::Film;
use trisect::render::{FilmObserver, RenderObserver};

/// Exit code of what --time-limit ended.
pub const OUT_OF_TIME: u8 = 7;

/// Why a render ended before it was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// By an interrupt, or what a queue sends when time is over.
    Interrupted,
    /// By --time-limit.
    OutOfTime,
}

impl StopReason {
    /// Of the process, where what there is is where it should be.
    pub fn exit_code(self) -> ExitCode {
        match self {
            Self::Interrupted => ExitCode::from(INTERRUPTED as u8),
            Self::OutOfTime => ExitCode::from(OUT_OF_TIME),
        }
    }
}

/// Watches a render.
pub struct RenderSupervisor {
    interrupted: Arc<AtomicBool>,
    end: Option<Instant>,
    saver: Option<Saver>,
}

/// Shows a bar, and says that an interrupt was seen.
pub struct ProgressObserver<'a, O: RenderObserver> {
    /// The bar.
    pub bar: O,
    /// Who sees it.
    pub watch: &'a RenderSupervisor,
    /// Whether it was said.
    pub announced: bool,
}

impl<O: RenderObserver> RenderObserver for ProgressObserver<'_, O> {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        if !self.announced && self.watch.interrupted.load(Ordering::Relaxed) {
            self.announced = true;
            eprint(
                "interrupted: this part is finished if that is soon, and what there is written; once more ends at once",
            );
        }
        self.bar.progress(done, total)
    }

    fn should_continue(&self) -> bool {
        self.watch.stop_reason().is_none()
    }
}

impl RenderSupervisor {
    /// Of a command that began at `start`, and writes such a checkpoint. `interrupted` is set when it should end.
    pub fn new(
        arguments: &RenderArgs,
        saver: Option<Saver>,
        start: Instant,
        interrupted: Arc<AtomicBool>,
    ) -> Self {
        // A limit that no clock reaches is none.
        let end = arguments.checkpointing.time_limit.and_then(|limit| start.checked_add(limit));
        Self { interrupted, end, saver }
    }

    /// Why the render should end, if it should.
    pub fn stop_reason(&self) -> Option<StopReason> {
        let late = self.end.is_some_and(|end| Instant::now() >= end);
        match self.interrupted.load(Ordering::Relaxed) {
            true => Some(StopReason::Interrupted),
            false => late.then_some(StopReason::OutOfTime),
        }
    }

    /// Notes that another device goes on.
    pub fn add_rounding(&self, arithmetic: &str) {
        if let Some(saver) = &self.saver {
            saver.add_rounding(arithmetic);
        }
    }

    /// Keeps what there is after an error, which is said later. What failed at once leaves nothing behind.
    pub fn rescue(&self, film: &Film, quiet: bool) {
        if !film.coverage.parts().is_empty()
            && let Err(error) = self.finish(film, quiet)
        {
            eprint(&format!("error: {error}"));
        }
    }

    /// Writes the last checkpoint, elsewhere if it cannot be where it should; whether it is.
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

    fn part_added(&self, film: &Film) {
        let Some(saver) = &self.saver else { return };
        saver.save_if_due(film);
        if let Some(error) = saver.failure() {
            eprint(&format!("warning: {error}; the render goes on, and the next checkpoint tries again"));
        }
    }
}

/// What a render begins with.
pub struct RenderStart {
    /// Empty, or what was there before.
    pub film: Film,
    /// Those that are to be in it.
    pub samples: Range<u32>,
    /// Of the checkpoint, if there is to be one.
    pub saver: Option<Saver>,
}

impl RenderStart {
    /// Anew, or where a checkpoint ended.
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
        // A copy of the film on its way to the disk.
        let copy = if checkpoint.is_some() { Film::bytes_per_pixel(settings.guides) } else { 0 };
        let quality = arguments.job.bvh_quality.map(crate::cli::QualityArg::quality);
        let identity =
            session.digest.map(|digest| Identity::new(&digest, settings, quality, &session.renderer));
        if let (Some((place, Checkpoint { mut header, film })), Some(identity)) = (before, &identity) {
            if session.fell_back {
                // As in the middle of a render: who goes on is noted.
                header.identity.add_rounding(&identity.arithmetic);
            }
            let path = || place.path().to_owned();
            let differs = |difference| CheckpointError::Differs { path: path(), difference };
            identity.check(&header.identity).map_err(differs)?;
            return Ok(Self { film, samples, saver: Some(Saver::resume(place, header, every)) });
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

/// The arguments of this process.
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
