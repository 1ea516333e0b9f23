//! Sums on their way up the tree of ranks.

use super::ClusterError;
use super::image_part::{ImagePart, WireFormat};
use super::means::MeanSum;
use super::plan;
use crate::film::{FilmCounts, RowSet};
use crate::render::Settings;

/// Sums of strips that wait for those of other ranks. Each phase has its own.
pub(super) struct Reduce {
    strip: u32,
    height: u32,
    /// Of the image.
    strips: usize,
    waiting: Vec<Vec<MeanSum>>,
    missing: Vec<u32>,
    /// Over the pieces of each strip, their launches, and their samples.
    counts: Vec<(FilmCounts, u32, u32)>,
    pub parent: Option<u32>,
    pub children: u32,
}

/// A strip that all below have added to.
pub(super) struct Strip {
    pub rows: RowSet,
    pub phase: u32,
    /// Of each pixel.
    pub samples: u32,
    pub sums: Vec<MeanSum>,
    pub counts: (FilmCounts, u32),
}

impl Reduce {
    pub fn new(settings: &Settings, rank: u32, ranks: u32) -> Self {
        let strip = plan::strip_rows(settings.height);
        let strips = settings.height.div_ceil(strip) as usize;
        let all = strips * plan::phases(settings.samples, ranks) as usize;
        let children = plan::children(rank, ranks);
        let missing = vec![1 + children; all];
        let counts = vec![(FilmCounts::default(), 0, 0); all];
        Self {
            strip,
            height: settings.height,
            strips,
            waiting: vec![Vec::new(); all],
            missing,
            counts,
            parent: plan::parent(rank),
            children,
        }
    }

    /// Where a piece's sums wait; none for one that is no strip, of no phase or of no sums.
    fn index(&self, piece: &ImagePart) -> Option<usize> {
        let own = piece.rows.places();
        let strip = own.start / self.strip;
        let whole = strip * self.strip..(strip + 1).saturating_mul(self.strip).min(self.height);
        let summed = matches!(piece.wire_format, WireFormat::Chunk | WireFormat::Mean | WireFormat::Double);
        let index = (piece.phase as usize).checked_mul(self.strips)?.checked_add(strip as usize)?;
        (own == whole && summed && index < self.missing.len()).then_some(index)
    }

    /// Counts a piece as come. Returns its strip, and how many are still missing there.
    ///
    /// # Errors
    ///
    /// For one that no one waits for.
    pub fn count(&mut self, from: u32, piece: &ImagePart) -> Result<(usize, u32), ClusterError> {
        let other =
            || ClusterError::Protocol { rank: from, message: "a strip that no one waits for".to_owned() };
        let index = self.index(piece).ok_or_else(other)?;
        let missing = self.missing.get_mut(index).filter(|missing| **missing > 0).ok_or_else(other)?;
        *missing -= 1;
        Ok((index, *missing))
    }

    /// Adds a piece; with the last one of its strip returns the sum.
    ///
    /// # Errors
    ///
    /// As [`count`](Self::count).
    pub fn add(&mut self, from: u32, piece: ImagePart) -> Result<Option<Strip>, ClusterError> {
        let (index, missing) = self.count(from, &piece)?;
        let mut counts = (piece.counts, piece.submissions, piece.samples.len() as u32);
        if let Some(sum) = self.counts.get_mut(index) {
            *sum = (sum.0 + counts.0, sum.1.saturating_add(counts.1), sum.2.saturating_add(counts.2));
            counts = *sum;
        }
        let mut sums = self.waiting.get_mut(index).map(std::mem::take).unwrap_or_default();
        if sums.is_empty() {
            sums = piece.means();
        } else {
            piece.add_to(&mut sums);
        }
        if missing == 0 {
            let (counts, samples) = ((counts.0, counts.1), counts.2);
            return Ok(Some(Strip { rows: piece.rows, phase: piece.phase, samples, sums, counts }));
        }
        if let Some(place) = self.waiting.get_mut(index) {
            *place = sums;
        }
        Ok(None)
    }

    pub fn is_over(&self) -> bool {
        self.missing.iter().all(|missing| *missing == 0)
    }
}
