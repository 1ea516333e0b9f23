//! How much to measure.

use crate::backend::DeviceKind;
use crate::render::{MathMode, Settings};

/// The number of spheres of the book's final scene, about.
pub(super) const BOOK: u32 = 487;

/// Sizes of all experiments.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportPlan {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Which build of the kernels.
    pub math: MathMode,
    /// Samples a pixel of the first experiment.
    pub spp: Vec<u32>,
    /// Spheres of the second.
    pub counts: Vec<u32>,
    /// Samples a pixel of the second and the third.
    pub samples: u32,
    /// Spheres of the third's own scenes.
    pub vs_cpu: Vec<u32>,
    /// Frames of each point that do not count.
    pub warm_up: u32,
    /// Frames of each point that do.
    pub frames: u32,
    /// Seconds that all frames of a point without a tree may take; one that is slower even with the least is left out.
    pub limit: f64,
}

impl ReportPlan {
    /// For a device of this kind: a GPU's image fills it. `quick` is for a machine of two cores, in less than three minutes.
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

    /// The same without scenes of more than so many spheres.
    pub fn up_to(self, greatest: u32) -> Self {
        let cut = |counts: Vec<u32>| counts.into_iter().filter(|&count| count <= greatest).collect();
        Self { counts: cut(self.counts), vs_cpu: cut(self.vs_cpu), ..self }
    }

    /// A scene's settings with this plan's image. Everything else is the scene's: no roulette, as in the report.
    pub(super) fn settings(&self, scene: Settings, samples: u32) -> Settings {
        Settings { width: self.width, height: self.height, samples, math: self.math, ..scene }
    }

    /// What of a point fits the limit, where a sample a pixel takes `seconds` a frame: all frames with as many samples as fit, or one
    /// frame of one sample a pixel without a warm-up; `None` where not even that does.
    pub(super) fn affordable(&self, seconds: f64) -> Option<Effort> {
        let frames = f64::from(self.warm_up + self.frames);
        let most = self.limit / (seconds * frames); // NaN affords nothing
        if most >= 1.0 {
            return Some(Effort { samples: (most as u32).min(self.samples), ..self.effort() });
        }
        (seconds <= self.limit).then_some(Effort { samples: 1, warm_up: 0, frames: 1 })
    }

    /// What a point has that needs no limit.
    pub(super) fn effort(&self) -> Effort {
        Effort { samples: self.samples, warm_up: self.warm_up, frames: self.frames }
    }
}

/// What is rendered of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Effort {
    /// Samples a pixel.
    pub samples: u32,
    /// Frames that do not count.
    pub warm_up: u32,
    /// Frames that do.
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
        // Two seconds a frame for all four, or eight for one.
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
