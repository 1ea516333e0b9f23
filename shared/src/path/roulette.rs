//! Russian roulette.

use super::Path;
use crate::features::{FeatureSet, Features, ROULETTE};
use crate::math::{max_component, min, unit_f32};
use crate::params::RenderParams;

/// Factor between a path's throughput, by its largest channel, and its probability to survive.
///
/// With 1, the expected weight of all paths would stay 1. But a longer path shares the cost of its
/// first segments, and the light that it finds varies more than that of the pixel, so that more
/// paths of less weight are worth their time (docs/notebook/equal-time.md).
const SURVIVAL: f32 = 3.0;

impl Path {
    /// Ends the path at random if it carries little, and weights it for those that end. `word` is
    /// its random word.
    #[inline(always)]
    pub(super) fn play_roulette<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        word: u32,
    ) {
        if features.has::<ROULETTE>() && self.segment >= params.roulette_from {
            let probability = min(SURVIVAL * max_component(self.throughput), 1.0);
            self.continues &= unit_f32(word) < probability;
            self.throughput *= 1.0 / probability;
        }
    }
}
