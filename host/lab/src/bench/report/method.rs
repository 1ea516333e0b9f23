//! Methods: combinations of traversal and schedule.

use super::super::{WarmUp, measure};
use super::plan::Effort;
use crate::Error;
use trisect::device::BackendError;
use trisect::render::{KernelFeatures, Renderer, Schedule, Settings, SettingsError, Traversal};
use trisect::stats::RenderStats;

/// A combination of traversal and schedule. The image does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method {
    /// Name in charts and data.
    pub name: &'static str,
    /// Method of finding the closest hit.
    pub traversal: Traversal,
    /// Assignment of work to lanes.
    pub schedule: Schedule,
}

const fn method(name: &'static str, traversal: Traversal, schedule: Schedule) -> Method {
    Method { name, traversal, schedule }
}

/// All methods that the report compares, the slowest first.
pub const METHODS: &[Method] = &[
    method("linear, pixel", Traversal::Linear, Schedule::Pixel),
    method("linear, regenerate", Traversal::Linear, Schedule::Regenerate),
    method("stack, pixel", Traversal::Stack, Schedule::Pixel),
    method("stack, regenerate", Traversal::Stack, Schedule::Regenerate),
    method("stack, persistent", Traversal::Stack, Schedule::Persistent),
    method("stack, interleaved", Traversal::Stack, Schedule::Interleaved),
    method("wide, regenerate", Traversal::Wide, Schedule::Regenerate),
    method("wide, persistent", Traversal::Wide, Schedule::Persistent),
];

impl Method {
    /// Returns whether the time grows in proportion to the number of primitives.
    pub(super) fn is_linear(&self) -> bool {
        self.traversal == Traversal::Linear
    }

    /// Returns a scene's settings with this method.
    pub(super) fn settings(&self, settings: Settings) -> Settings {
        Settings {
            traversal: Some(self.traversal),
            schedule: Some(self.schedule),
            features: KernelFeatures::Needed,
            ..settings
        }
    }
}

/// Outcome of measuring a point.
pub(super) enum Outcome {
    /// Statistics of the frames that count.
    Measured(Vec<RenderStats>),
    /// Reason why the method is not available here.
    Missing(String),
}

/// Measures the frames of a point. A method that the backend does not have is not an error.
pub(super) fn frames(renderer: &mut Renderer, settings: &Settings, effort: Effort) -> Result<Outcome, Error> {
    match measure(renderer, settings, WarmUp::of(effort.warm_up), effort.frames, &mut ()) {
        Ok(frames) => Ok(Outcome::Measured(frames.counted)),
        Err(Error::Render(error)) if is_missing(&error) => Ok(Outcome::Missing("no such kernel".to_owned())),
        Err(error) => Err(error),
    }
}

/// Returns whether the error means only that the backend lacks the method.
fn is_missing(error: &trisect::Error) -> bool {
    use trisect::Error::{Backend, Settings};
    matches!(error, Settings(SettingsError::NoWideTree) | Backend(BackendError::NoQueue { .. }))
}
