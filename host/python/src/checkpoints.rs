//! Checkpoints of a render: the film with which it starts, and the file that keeps it.

use crate::checkpoint_options::CheckpointOptions;
use crate::header::LazyHeader;
use crate::options::RenderOptions;
use trisect::checkpoint::{self, Checkpoint, CheckpointError, Place, Saver};
use trisect::error::Error;
use trisect::film::{Film, SampleBlock, SampleCoverage};
use trisect::render::FilmObserver;

/// Film with which a render starts.
pub struct FilmStart {
    /// Film: empty, or that of the checkpoint to continue.
    pub film: Film,
    /// Writer of the checkpoint, if there is one.
    pub saver: Option<Saver>,
}

impl FilmStart {
    /// Returns the start of a render, whose film has this header.
    ///
    /// # Errors
    ///
    /// [`CheckpointError`] for a file that cannot be written, that exists although the render does
    /// not resume it, or that is not of this image; [`Error::Settings`] for settings out of range.
    pub fn new(options: &RenderOptions, header: &LazyHeader) -> Result<Self, Error> {
        let RenderOptions { settings, samples, checkpoint, .. } = options;
        settings.check()?;
        settings.check_part(&SampleBlock { rows: 0..settings.height, samples: samples.clone() })?;
        let new = if settings.guides { Film::with_aovs } else { Film::new };
        let Some(CheckpointOptions { path, every, resumes }) = checkpoint else {
            return Ok(Self { film: new(settings.width, settings.height), saver: None });
        };
        if !path.exists() {
            checkpoint::probe(path)?;
            // The saver copies the film before it writes it.
            settings.check_with(Film::bytes_per_pixel(settings.guides))?;
            let saver = Saver::new(path, header.get(), *every);
            return Ok(Self { film: new(settings.width, settings.height), saver: Some(saver) });
        }
        if !resumes {
            return Err(CheckpointError::Exists { path: path.clone() }.into());
        }
        let place = Place::of(path);
        let Checkpoint { header: mut before, film } = Checkpoint::read(path)?;
        let differs = |difference| CheckpointError::Differs { path: path.clone(), difference };
        header.get().identity.check(&before.identity).map_err(differs)?;
        checkpoint::probe(path)?;
        before.samples = before.samples.start.min(samples.start)..before.samples.end.max(samples.end);
        let saver = Saver::resume(place, before, *every, &film);
        Ok(Self { film, saver: Some(saver) })
    }
}

/// Observer of a film, which it saves if there is a saver.
pub struct Keeper<'a>(pub Option<&'a Saver>);

impl FilmObserver for Keeper<'_> {
    fn wants_film(&self, coverage: &SampleCoverage) -> bool {
        self.0.is_some_and(|saver| saver.is_due(coverage))
    }

    fn part_added(&self, film: &Film) {
        if let Some(saver) = self.0 {
            saver.save_if_due(film);
        }
    }
}
