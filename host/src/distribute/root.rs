//! The root's side of an image: what came, and what there is to render.

use super::DistributeError;
use super::canvas::{Canvas, Picture};
use super::piece::Piece;
use super::plan::{Balance, Dispenser, Mode};
use super::report::RankReport;
use super::work::{Failure, Work};
use crate::Error;
use crate::film::{Film, FilmCounts, Part};
use crate::render::{Keeper, fits};
use std::ops::Range;
use std::time::Instant;

/// A film that the root has and goes on with.
pub struct Kept<'a> {
    /// What there is.
    pub film: Film,
    /// Samples of the settings' frame that should be in it.
    pub samples: Range<u32>,
    /// Who looks at it while it grows, and may end it.
    pub keeper: &'a dyn Keeper,
}

/// Pieces, as far as they came.
pub(super) struct Root<'a> {
    pub canvas: Canvas,
    dispenser: Option<Dispenser>,
    pub reports: Vec<Option<RankReport>>,
    pub submissions: u64,
    /// When the last one came.
    pub came: Option<Instant>,
    keeper: Option<&'a dyn Keeper>,
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
    pub fn new(work: &Work, ranks: u32, kept: Option<Kept<'a>>) -> Result<Self, Error> {
        let Work { settings, plan, travels, .. } = work;
        let block = 1u32 << plan.block_shift.min(16);
        let is_dynamic = plan.mode == Mode::Rows && plan.balance == Balance::Dynamic;
        let (width, reports) = (settings.width, vec![None; ranks as usize]);
        let (canvas, dispenser, keeper, before) = match kept {
            Some(Kept { film, samples, keeper }) => {
                settings.check_part(&Part { rows: 0..settings.height, samples: samples.clone() })?;
                fits(&film, settings)?;
                if !is_dynamic || *travels != Work::kept_as(settings.guides) {
                    let what = "a film that is kept grows by rows on demand, as all sums".to_owned();
                    let remedy = "make the work by Work::kept".to_owned();
                    return Err(DistributeError::Unsupported { what, remedy }.into());
                }
                let dispenser = Dispenser::chunks(film.coverage.missing(&samples), block, ranks);
                let before = film.counts();
                (Canvas::onto(film, &samples), Some(dispenser), Some(keeper), before)
            }
            None => {
                let canvas = Canvas::new(width, settings.height, settings.samples, *travels);
                let dispenser = || Dispenser::rows(settings.height, settings.samples, block, ranks);
                (canvas, is_dynamic.then(dispenser), None, FilmCounts::default())
            }
        };
        Ok(Self { canvas, dispenser, reports, submissions: 0, came: None, keeper, width, before })
    }

    /// What the next who asks renders, who would have no more than so many samples; none if all have what they have from the start.
    pub fn hand_out(&mut self, most: u64) -> Option<Option<Part>> {
        let most = most / u64::from(self.width.max(1));
        self.dispenser.as_mut().map(|dispenser| dispenser.take(most))
    }

    /// Counts a piece.
    pub fn count(&mut self, piece: &Piece) {
        self.canvas.counts = self.canvas.counts + piece.counts;
        self.submissions += u64::from(piece.submissions);
    }

    /// Puts a piece where it belongs.
    ///
    /// # Errors
    ///
    /// As [`Canvas::take`].
    pub fn take(&mut self, from: u32, piece: &Piece) -> Result<(), Error> {
        self.canvas.take(from, piece)?;
        if let (Some(keeper), Some(film)) = (self.keeper, self.canvas.film()) {
            keeper.added(film);
        }
        Ok(())
    }

    /// Ends it where the keeper says so, and notes when the last piece came.
    pub fn look(&mut self) {
        if let (Some(dispenser), Some(keeper)) = (&mut self.dispenser, self.keeper)
            && !keeper.goes_on()
        {
            dispenser.stop();
        }
        let complete = match &self.dispenser {
            // Those that are on their way come.
            Some(dispenser) => dispenser
                .all_handed()
                .is_some_and(|handed| self.canvas.done >= handed * u64::from(self.width)),
            None => self.canvas.is_complete(),
        };
        if complete {
            self.came.get_or_insert_with(Instant::now);
        }
    }

    /// All samples: of a film that was there before, those too.
    pub fn counts(&self) -> FilmCounts {
        match (self.keeper, self.canvas.film()) {
            (Some(_), Some(film)) => film.counts(),
            _ => self.canvas.counts,
        }
    }

    /// What there is, where something is.
    pub fn failed(self, error: Error) -> Failure {
        let is_any = self.canvas.done > 0 || self.keeper.is_some();
        Failure { error, partial: is_any.then(|| Box::new(self.canvas.picture())) }
    }

    /// It.
    pub fn picture(self) -> Picture {
        self.canvas.picture()
    }
}
