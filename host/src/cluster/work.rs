//! What ranks render together, and what becomes of it.

use super::assembler::AssembledImage;
use super::image_part::WireFormat;
use super::plan::{Balance, ClusterPlan, DistributionMode};
use super::report::ClusterReport;
use crate::Error;
use crate::backend::Device;
use crate::film::FilmCounts;
use crate::render::Settings;
use crate::stats::{Phases, RenderStats};
use std::time::Duration;
use trisect_kernels::{VARIANTS, variant_by_name};

/// What all ranks render together.
#[derive(Clone, Debug)]
pub struct Work {
    /// The image.
    pub settings: Settings,
    /// Who renders what.
    pub plan: ClusterPlan,
    /// What travels of it.
    pub wire_format: WireFormat,
    /// Why that plan, where the program chose.
    pub choice: String,
}

impl Work {
    /// That of a film which the root keeps while it grows: rows on demand, so many of them a block as a power of two, and all sums travel.
    pub fn for_film(settings: Settings, block_shift: u32) -> Self {
        let plan = ClusterPlan { mode: DistributionMode::Rows, balance: Balance::Dynamic, block_shift };
        let travels = Self::film_format(settings.guides);
        Self { settings, plan, wire_format: travels, choice: String::new() }
    }

    /// What travels where the root keeps the film.
    pub(super) fn film_format(guides: bool) -> WireFormat {
        if guides { WireFormat::SumsAndAovs } else { WireFormat::Sums }
    }
}

/// An image that came.
#[derive(Clone, Debug)]
pub struct Finished {
    /// It.
    pub picture: AssembledImage,
    /// What it took.
    pub report: ClusterReport,
    /// Over all pixels.
    pub counts: FilmCounts,
    /// What of them was there before.
    pub before: FilmCounts,
    /// Of all ranks.
    pub submissions: u64,
    /// The root's kernel.
    pub kernel: &'static str,
}

impl Finished {
    /// The same as of a render by one process: on the root's device, with the device's seconds of all.
    pub fn stats(&self, device: &Device, settings: &Settings) -> RenderStats {
        let variant = variant_by_name(self.kernel).unwrap_or(VARIANTS[0]);
        let mut stats = RenderStats::new(device, settings, variant, Phases::default());
        stats.submissions = self.submissions;
        stats.device_seconds = self.report.ranks.iter().map(|rank| rank.device_seconds).sum();
        let seconds = Duration::from_secs_f64(self.report.seconds);
        stats.finish_from(self.before, self.counts, seconds, (Duration::ZERO, Duration::ZERO));
        stats.cluster = Some(self.report.clone());
        stats
    }
}

/// Why an image did not come, and what there is of it.
#[derive(Debug)]
pub struct Failure {
    /// Why.
    pub error: Error,
    /// On the root, if any piece came.
    pub partial: Option<Box<AssembledImage>>,
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { error: error.into(), partial: None }
    }
}
