//! Sums of an average on their way up the tree of ranks.
//!
//! A rank adds its strips to those of its children and sends each complete strip to its parent.
//! Averages, strips and phases are described in `plan`, the tree in [`plan::parent`].

use super::ClusterError;
use super::image_part::{ImagePart, Strip, WireFormat};
use super::means::MeanSum;
use super::plan;
use trisect::film::FilmCounts;
use trisect::render::Settings;

/// Sums of strips that wait for the sums of the children. Each phase has its own strips.
pub(super) struct Reduce {
    strip: u32,
    height: u32,
    /// Number of strips of the image.
    strips: usize,
    waiting: Vec<Vec<MeanSum>>,
    missing: Vec<u32>,
    /// Counts, submissions and samples per pixel of each strip, summed over its image parts.
    counts: Vec<(FilmCounts, u32, u32)>,
    pub parent: Option<u32>,
    pub children: u32,
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

    /// Returns the index of a strip's sums, or `None` for an image part that is not a strip, or has
    /// an unknown phase or no sums.
    fn index(&self, piece: &ImagePart) -> Option<usize> {
        let own = piece.rows.places();
        let strip = own.start / self.strip;
        let whole = strip * self.strip..(strip + 1).saturating_mul(self.strip).min(self.height);
        let summed = matches!(piece.wire_format, WireFormat::Chunk | WireFormat::Mean | WireFormat::Double);
        let index = (piece.phase as usize).checked_mul(self.strips)?.checked_add(strip as usize)?;
        (own == whole && summed && index < self.missing.len()).then_some(index)
    }

    /// Counts an image part as received. Returns the index of its strip, and how many parts that
    /// strip still lacks.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Protocol`] for a part that is not expected.
    pub fn count(&mut self, from: u32, piece: &ImagePart) -> Result<(usize, u32), ClusterError> {
        let other =
            || ClusterError::Protocol { rank: from, message: "a strip that was not expected".to_owned() };
        let index = self.index(piece).ok_or_else(other)?;
        let missing = self.missing.get_mut(index).filter(|missing| **missing > 0).ok_or_else(other)?;
        *missing -= 1;
        Ok((index, *missing))
    }

    /// Adds an image part. Returns the complete strip with its last part, `None` before.
    ///
    /// # Errors
    ///
    /// Same as [`count`](Self::count).
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
