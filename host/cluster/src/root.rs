//! State of the root during a render: the image parts received, the work left to hand out, and the
//! reports of the ranks.

use super::ClusterError;
use super::assembler::{AssembledImage, Assembler};
use super::image_part::ImagePart;
use super::plan::{Balance, DistributionMode, WorkQueue};
use super::work::{Failure, Work};
use crate::Error;
use std::ops::Range;
use std::time::Instant;
use trisect::film::{Film, FilmCounts, SampleBlock};
use trisect::render::{FilmObserver, check_film};
use trisect::stats::RankReport;

/// Film that the root continues; it may be empty.
pub struct ResumableFilm<'a> {
    /// Film with the samples so far.
    pub film: Film,
    /// Sample indices that the complete film should have.
    pub samples: Range<u32>,
    /// Observer that sees the film grow, and may end the render.
    pub observer: &'a dyn FilmObserver,
}

/// Image parts received, work queue and reports.
pub(super) struct Root<'a> {
    pub assembler: Assembler,
    queue: Option<WorkQueue>,
    pub reports: Vec<Option<RankReport>>,
    pub submissions: u64,
    /// Arrival time of the last image part; `None` before it.
    pub last_arrival: Option<Instant>,
    observer: Option<&'a dyn FilmObserver>,
    width: u32,
    /// Counts of the samples that the film had at the start.
    pub before: FilmCounts,
}

impl<'a> Root<'a> {
    /// Creates the root's state for `ranks` ranks.
    ///
    /// # Errors
    ///
    /// For a film that does not fit the work.
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
                    let what = "a film can only be continued with rows on demand and all sums".to_owned();
                    let remedy = "create the work with Work::for_film".to_owned();
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

    /// Returns the next work item: `None` if work is assigned statically, `Some(None)` if none is
    /// left. `most` limits its samples, over all pixels, as in [`WorkQueue::take`].
    pub fn hand_out(&mut self, most: u64) -> Option<Option<SampleBlock>> {
        let most = most / u64::from(self.width.max(1));
        self.queue.as_mut().map(|dispenser| dispenser.take(most))
    }

    /// Adds the counts of an image part.
    pub fn count(&mut self, piece: &ImagePart) {
        self.assembler.counts = self.assembler.counts + piece.counts;
        self.submissions += u64::from(piece.submissions);
    }

    /// Adds an image part to the image.
    ///
    /// # Errors
    ///
    /// Same as [`Assembler::take`].
    pub fn take(&mut self, from: u32, piece: &ImagePart) -> Result<(), Error> {
        self.assembler.take(from, piece)?;
        if let (Some(keeper), Some(film)) = (self.observer, self.assembler.film()) {
            keeper.part_added(film);
        }
        Ok(())
    }

    /// Stops the work queue if the observer ends the render, and notes when the last image part
    /// arrived.
    pub fn look(&mut self) {
        if let (Some(dispenser), Some(keeper)) = (&mut self.queue, self.observer)
            && !keeper.should_continue()
        {
            dispenser.stop();
        }
        let complete = match &self.queue {
            // Blocks that were handed out before a stop still arrive.
            Some(dispenser) => dispenser
                .total_assigned()
                .is_some_and(|handed| self.assembler.done >= handed * u64::from(self.width)),
            None => self.assembler.is_complete(),
        };
        if complete {
            self.last_arrival.get_or_insert_with(Instant::now);
        }
    }

    /// Returns the counts of all samples; for a film that is continued, with those that it had
    /// before.
    pub fn counts(&self) -> FilmCounts {
        match (self.observer, self.assembler.film()) {
            (Some(_), Some(film)) => film.counts(),
            _ => self.assembler.counts,
        }
    }

    /// Returns the error with the partial image, if any part arrived or a film was continued.
    pub fn failed(self, error: Error) -> Failure {
        let is_any = self.assembler.done > 0 || self.observer.is_some();
        Failure { error, partial: is_any.then(|| Box::new(self.assembler.picture())) }
    }

    /// Returns the image.
    pub fn picture(self) -> AssembledImage {
        self.assembler.picture()
    }
}
