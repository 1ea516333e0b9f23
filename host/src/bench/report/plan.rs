//! How much to measure.

use crate::backend::DeviceKind;
use crate::render::{MathMode, Settings};

/// The number of spheres of the book's final scene, about.
pub(super) const BOOK: u32 = 487;

/// Sizes of all experiments.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
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
    pub against: Vec<u32>,
    /// Frames of each point that do not count.
    pub warm_up: u32,
    /// Frames of each point that do.
    pub frames: u32,
    /// Seconds that all frames of a point without a tree may take; a slower one is left out.
    pub limit: f64,
}

impl Plan {
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
            against: vec![10, BOOK, 100_000],
            warm_up: 1,
            frames: if quick { 3 } else { 5 },
            limit: if quick { 5.0 } else { 15.0 },
        }
    }

    /// The same without scenes of more than so many spheres.
    pub fn up_to(self, greatest: u32) -> Self {
        let cut = |counts: Vec<u32>| counts.into_iter().filter(|&count| count <= greatest).collect();
        Self { counts: cut(self.counts), against: cut(self.against), ..self }
    }

    /// A scene's settings with this plan's image. Everything else is the scene's: no roulette, as in the report.
    pub(super) fn settings(&self, scene: Settings, samples: u32) -> Settings {
        Settings { width: self.width, height: self.height, samples, math: self.math, ..scene }
    }

    /// Samples a pixel, at most [`samples`](Self::samples), that all frames of a point can have within the limit, where a sample a
    /// pixel takes `seconds` a frame; `None` where not even one can.
    pub(super) fn affordable(&self, seconds: f64) -> Option<u32> {
        let frames = f64::from(self.warm_up + self.frames);
        let most = self.limit / (seconds * frames); // NaN affords nothing
        (most >= 1.0).then_some((most as u32).min(self.samples))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_limit_affords() {
        let plan =
            Plan { limit: 8.0, warm_up: 1, frames: 3, samples: 16, ..Plan::new(DeviceKind::Gpu, false) };
        // Two seconds a frame.
        let pairs =
            [(0.0, Some(16)), (0.01, Some(16)), (0.5, Some(4)), (1.9, Some(1)), (2.0, Some(1)), (2.1, None)];
        for (seconds, samples) in pairs {
            assert_eq!(plan.affordable(seconds), samples, "{seconds}");
        }
        assert_eq!(plan.affordable(f64::NAN), None);
    }

    #[test]
    fn fewer_spheres() {
        let plan = Plan::new(DeviceKind::Cpu, true).up_to(1000);
        assert_eq!((plan.counts, plan.against), (vec![10, 100, 1000], vec![10, BOOK]));
    }
}
