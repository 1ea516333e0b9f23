//! Sizes of the report's experiments.

use trisect::device::DeviceKind;
use trisect::render::{MathMode, Settings};

/// Approximate number of spheres of the book's final scene.
pub(super) const BOOK: u32 = 487;

/// Sizes of all experiments.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportPlan {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Build of the kernels.
    pub math: MathMode,
    /// Samples per pixel of the first experiment ([`Spp`](super::Spp)).
    pub spp: Vec<u32>,
    /// Numbers of spheres of the second experiment ([`Complexity`](super::Complexity)).
    pub counts: Vec<u32>,
    /// Samples per pixel of the second and the third experiment.
    pub samples: u32,
    /// Numbers of spheres of the generated scenes of the third experiment
    /// ([`VsCpu`](super::VsCpu)).
    pub vs_cpu: Vec<u32>,
    /// Warm-up frames of each point, which do not count.
    pub warm_up: u32,
    /// Frames of each point that count.
    pub frames: u32,
    /// Maximum seconds for all frames of a point without a BVH. A point that takes longer even with
    /// one frame of one sample is left out.
    pub limit: f64,
}

impl ReportPlan {
    /// Returns the plan for a device of this kind: for a GPU, with an image large enough to fill
    /// it. `quick` is meant for a machine of two cores, and takes less than three minutes there.
    pub fn new(kind: DeviceKind, quick: bool) -> Self {
        let gpu = kind == DeviceKind::Gpu;
        let (width, height) = match (gpu, quick) {
            (true, _) => (1280, 720),
            (false, false) => (640, 360),
            (false, true) => (160, 90),
        };
        let step = match (gpu, quick) {
            (true, _) => 64,
            (false, false) => 4,
            (false, true) => 16,
        };
        Self {
            width,
            height,
            math: MathMode::Precise,
            spp: (1..=if quick { 6 } else { 8 }).map(|index| index * step).collect(),
            counts: (1..=6).map(|power| 10u32.pow(power)).collect(),
            samples: if gpu { 16 } else { 4 },
            vs_cpu: vec![10, BOOK, 100_000],
            warm_up: 1,
            frames: if quick { 3 } else { 5 },
            limit: if quick { 5.0 } else { 10.0 },
        }
    }

    /// Returns the plan without scenes of more than `greatest` spheres.
    pub fn up_to(self, greatest: u32) -> Self {
        let cut = |counts: Vec<u32>| counts.into_iter().filter(|&count| count <= greatest).collect();
        Self { counts: cut(self.counts), vs_cpu: cut(self.vs_cpu), ..self }
    }

    /// Returns a scene's settings with this plan's image size, samples and math. Everything else is
    /// the scene's: no roulette, as in the report.
    pub(super) fn settings(&self, scene: Settings, samples: u32) -> Settings {
        Settings { width: self.width, height: self.height, samples, math: self.math, ..scene }
    }

    /// Returns the effort that fits the limit if a frame of one sample per pixel takes `seconds`:
    /// all frames with as many samples as fit, or one frame of one sample without a warm-up. `None`
    /// if not even that fits.
    pub(super) fn affordable(&self, seconds: f64) -> Option<Effort> {
        let frames = f64::from(self.warm_up + self.frames);
        let most = self.limit / (seconds * frames); // NaN affords nothing
        if most >= 1.0 {
            return Some(Effort { samples: (most as u32).min(self.samples), ..self.effort() });
        }
        (seconds <= self.limit).then_some(Effort { samples: 1, warm_up: 0, frames: 1 })
    }

    /// Returns the effort of a point without a limit.
    pub(super) fn effort(&self) -> Effort {
        Effort { samples: self.samples, warm_up: self.warm_up, frames: self.frames }
    }
}

/// Samples and frames that are rendered for a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Effort {
    /// Samples per pixel.
    pub samples: u32,
    /// Warm-up frames, which do not count.
    pub warm_up: u32,
    /// Frames that count.
    pub frames: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_limit_affords() {
        let plan = ReportPlan {
            limit: 8.0,
            warm_up: 1,
            frames: 3,
            samples: 16,
            ..ReportPlan::new(DeviceKind::Gpu, false)
        };
        let all = |samples| Some(Effort { samples, warm_up: 1, frames: 3 });
        let one = Some(Effort { samples: 1, warm_up: 0, frames: 1 });
        // Two seconds a frame for all four, or eight seconds for one.
        let pairs =
            [(0.0, all(16)), (0.01, all(16)), (0.5, all(4)), (1.9, all(1)), (2.0, all(1)), (2.1, one)];
        for (seconds, effort) in pairs.into_iter().chain([(8.0, one), (8.1, None), (f64::NAN, None)]) {
            assert_eq!(plan.affordable(seconds), effort, "{seconds}");
        }
    }

    #[test]
    fn fewer_spheres() {
        let plan = ReportPlan::new(DeviceKind::Cpu, true).up_to(1000);
        assert_eq!((plan.counts, plan.vs_cpu), (vec![10, 100, 1000], vec![10, BOOK]));
    }
}
