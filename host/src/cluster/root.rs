//! The root's side of an image: what came, and what there is to render.

use super::ClusterError;
use super::assembler::{AssembledImage, Assembler};
use super::image_part::ImagePart;
use super::plan::{Balance, DistributionMode, WorkQueue};
use super::report::RankReport;
use super::work::{Failure, Work};
use crate::Error;
use crate::film::{Film, FilmCounts, SampleBlock};
use crate::render::{FilmObserver, check_film};
use std::ops::Range;
use std::time::Instant;

/// A film that the root has and goes on with.
pub struct ResumableFilm<'a> {
    /// What there is.
    pub film: Film,
    /// Samples of the settings' frame that should be in it.
    pub samples: Range<u32>,
    /// Who looks at it while it grows, and may end it.
    pub observer: &'a dyn FilmObserver,
}

/// Pieces, as far as they came.
pub(super) struct Root<'a> {
    pub assembler: Assembler,
    queue: Option<WorkQueue>,
    pub reports: Vec<Option<RankReport>>,
    pub submissions: u64,
    /// When the last one came.
    pub last_arrival: Option<Instant>,
    observer: Option<&'a dyn FilmObserver>,
    width: u32,
    /// In the film from the start.
    pub before: FilmCounts,
}

impl<'a> Root<'a> {
    /// Of so many ranks.
    ///
    /// # Errors
    ///
    /// For a film that is not the work's.
    pub fn new(work: &Work, ranks: u32, kept: Option<ResumableFilm<'a>>) -> Result<Self, Error> {
        let Work { settings, plan, wire_format: travels, .. } = work;
        let block = 1u32 << plan.block_shift.min(16);
        let is_dynamic = plan.mode == DistributionMode::Rows && plan.balance == Balance::Dynamic;
        let (width, reports) = (settings.width, vec![None; ranks as usize]);
        let (canvas, dispenser, keeper, before) = match kept {
            Some(ResumableFilm { film, samples, observer: keeper }) => {
                settings.check_part(&SampleBlock { rows: 0..settings.height, samples: samples.clone() })?;
                check_film(&film, settings)?;
                if !is_dynamic || *travels != Work::film_format(settings.guides) {
                    let what = "a film that is kept grows by rows on demand, as all sums".to_owned();
                    let remedy = "make the work by Work::kept".to_owned();
                    return Err(ClusterError::Unsupported { what, remedy }.into());
                }
                let dispenser = WorkQueue::chunks(film.coverage.missing(&samples), block, ranks);
                let before = film.counts();
                (Assembler::for_film(film, &samples), Some(dispenser), Some(keeper), before)
            }
            None => {
                let canvas = Assembler::new(width, settings.height, settings.samples, *travels);
                let dispenser = || WorkQueue::rows(settings.height, settings.samples, block, ranks);
                (canvas, is_dynamic.then(dispenser), None, FilmCounts::default())
            }
        };
        Ok(Self {
            assembler: canvas,
            queue: dispenser,
            reports,
            submissions: 0,
            last_arrival: None,
            observer: keeper,
            width,
            before,
        })
    }

    /// What the next who asks renders, who would have no more than so many samples; none if all have what they have from the start.
    pub fn hand_out(&mut self, most: u64) -> Option<Option<SampleBlock>> {
        let most = most / u64::from(self.width.max(1));
        self.queue.as_mut().map(|dispenser| dispenser.take(most))
    }

    /// Counts a piece.
    pub fn count(&mut self, piece: &ImagePart) {
        self.assembler.counts = self.assembler.counts + piece.counts;
        self.submissions += u64::from(piece.submissions);
    }

    /// Puts a piece where it belongs.
    ///
    /// # Errors
    ///
    /// As [`Assembler::take`].
    pub fn take(&mut self, from: u32, piece: &ImagePart) -> Result<(), Error> {
        self.assembler.take(from, piece)?;
        if let (Some(keeper), Some(film)) = (self.observer, self.assembler.film()) {
            keeper.part_added(film);
        }
        Ok(())
    }

    /// Ends it where the keeper says so, and notes when the last piece came.
    pub fn look(&mut self) {
        if let (Some(dispenser), Some(keeper)) = (&mut self.queue, self.observer)
            && !keeper.should_continue()
        {
            dispenser.stop();
        }
        let complete = match &self.queue {
            // Those that are on their way come.
            Some(dispenser) => dispenser
                .total_assigned()
                .is_some_and(|handed| self.assembler.done >= handed * u64::from(self.width)),
            None => self.assembler.is_complete(),
        };
        if complete {
            self.last_arrival.get_or_insert_with(Instant::now);
        }
    }

    /// All samples: of a film that was there before, those too.
    pub fn counts(&self) -> FilmCounts {
        match (self.observer, self.assembler.film()) {
            (Some(_), Some(film)) => film.counts(),
            _ => self.assembler.counts,
        }
    }

    /// What there is, where something is.
    pub fn failed(self, error: Error) -> Failure {
        let is_any = self.assembler.done > 0 || self.observer.is_some();
        Failure { error, partial: is_any.then(|| Box::new(self.assembler.picture())) }
    }

    /// It.
    pub fn picture(self) -> AssembledImage {
        self.assembler.picture()
    }
}
