//! Input and result of a render over several ranks.

use super::assembler::AssembledImage;
use super::image_part::WireFormat;
use super::plan::{Balance, ClusterPlan, DistributionMode};
use crate::Error;
use std::time::Duration;
use trisect::film::FilmCounts;
use trisect::render::{Renderer, Settings};
use trisect::stats::ClusterReport;
use trisect::stats::RenderStats;

/// Work that all ranks render together.
#[derive(Clone, Debug)]
pub struct Work {
    /// Settings of the image.
    pub settings: Settings,
    /// Assignment of the work to ranks.
    pub plan: ClusterPlan,
    /// Data sent for each pixel.
    pub wire_format: WireFormat,
    /// Reason for the plan, if the program chose it.
    pub choice: String,
}

impl Work {
    /// Returns the work for a film that the root keeps while it grows: blocks of at least
    /// `2^block_shift` rows are handed out on demand, and all sums are sent.
    pub fn for_film(settings: Settings, block_shift: u32) -> Self {
        let plan = ClusterPlan { mode: DistributionMode::Rows, balance: Balance::Dynamic, block_shift };
        let travels = Self::film_format(settings.guides);
        Self { settings, plan, wire_format: travels, choice: String::new() }
    }

    /// Returns the wire format for a film that the root keeps.
    pub(super) fn film_format(guides: bool) -> WireFormat {
        if guides { WireFormat::SumsAndAovs } else { WireFormat::Sums }
    }
}

/// Complete image, with its report and counts.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The image.
    pub picture: AssembledImage,
    /// Times and bytes of the ranks.
    pub report: ClusterReport,
    /// Counts over all pixels.
    pub counts: FilmCounts,
    /// Counts of the samples that the film had at the start; zeros without a film.
    pub before: FilmCounts,
    /// Submissions of all ranks.
    pub submissions: u64,
}

impl Finished {
    /// Returns the statistics of a render: those of the root's device, with the device seconds of
    /// all ranks.
    ///
    /// # Errors
    ///
    /// [`trisect::Error::Settings`] if the root's renderer has no kernel for these settings.
    pub fn stats(&self, renderer: &Renderer, settings: &Settings) -> Result<RenderStats, Error> {
        let mut stats = renderer.statistics(settings)?;
        stats.submissions = self.submissions;
        stats.device_seconds = self.report.ranks.iter().map(|rank| rank.device_seconds).sum();
        let seconds = Duration::from_secs_f64(self.report.seconds);
        stats.finish_from(self.before, self.counts, seconds, (Duration::ZERO, Duration::ZERO));
        stats.cluster = Some(self.report.clone());
        Ok(stats)
    }
}

/// Error of a render over several ranks, with the partial image.
#[derive(Debug)]
pub struct Failure {
    /// The error.
    pub error: Error,
    /// Partial image on the root, if any image part arrived or a film was continued.
    pub partial: Option<Box<AssembledImage>>,
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { error: error.into(), partial: None }
    }
}
