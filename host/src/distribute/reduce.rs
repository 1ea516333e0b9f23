//! Sums on their way up the tree of ranks.

use super::DistributeError;
use super::piece::{MeanSum, Piece};
use super::plan;
use crate::film::{FilmCounts, Rows};
use crate::render::Settings;
use rayon::prelude::*;

/// Sums of strips that wait for those of other ranks.
pub(super) struct Reduce {
    strip: u32,
    waiting: Vec<Option<Vec<MeanSum>>>,
    missing: Vec<u32>,
    /// Over the pieces of each strip, and their launches.
    counts: Vec<(FilmCounts, u32)>,
    pub parent: Option<u32>,
    pub children: u32,
}

/// A strip that all below have added to.
pub(super) struct Strip {
    pub rows: Rows,
    pub sums: Vec<MeanSum>,
    pub counts: (FilmCounts, u32),
}

impl Reduce {
    pub fn new(settings: &Settings, rank: u32, ranks: u32) -> Self {
        let strip = plan::strip_rows(settings.height);
        let strips = settings.height.div_ceil(strip) as usize;
        let children = plan::children(rank, ranks);
        let missing = vec![1 + children; strips];
        let counts = vec![(FilmCounts::default(), 0); strips];
        Self { strip, waiting: vec![None; strips], missing, counts, parent: plan::parent(rank), children }
    }

    /// Adds a piece; with the last one of its strip returns the sum.
    pub fn add(&mut self, from: u32, piece: Piece) -> Result<Option<Strip>, DistributeError> {
        let other =
            || DistributeError::Protocol { rank: from, message: "a strip that no one waits for".to_owned() };
        let index = (piece.rows.own().start / self.strip) as usize;
        let missing = self.missing.get_mut(index).filter(|missing| **missing > 0).ok_or_else(other)?;
        *missing -= 1;
        let missing = *missing;
        let mut counts = (piece.counts, piece.submissions);
        if let Some(sum) = self.counts.get_mut(index) {
            *sum = (sum.0 + counts.0, sum.1 + counts.1);
            counts = *sum;
        }
        let means = piece.means();
        let sum = match self.waiting.get_mut(index).and_then(Option::take) {
            None => means,
            Some(sum) if sum.len() != means.len() => return Err(other()),
            Some(mut sum) => {
                let pairs = sum.par_iter_mut().zip(&means).with_min_len(4096);
                pairs.for_each(|(sum, mean)| sum.add(mean));
                sum
            }
        };
        if missing == 0 {
            return Ok(Some(Strip { rows: piece.rows, sums: sum, counts }));
        }
        if let Some(place) = self.waiting.get_mut(index) {
            *place = Some(sum);
        }
        Ok(None)
    }

    /// Lets a piece go as it is.
    pub fn pass(&mut self, piece: &Piece) {
        let index = (piece.rows.own().start / self.strip) as usize;
        if let Some(missing) = self.missing.get_mut(index) {
            *missing = missing.saturating_sub(1);
        }
    }

    pub fn is_over(&self) -> bool {
        self.missing.iter().all(|missing| *missing == 0)
    }
}
