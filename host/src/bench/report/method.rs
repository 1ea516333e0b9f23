//! Methods: how a closest hit is found, and what a lane works on.

use super::super::{WarmUp, measure};
use super::plan::Effort;
use crate::Error;
use crate::backend::BackendError;
use crate::render::{Renderer, Schedule, Settings, SettingsError, Traversal};
use crate::stats::RenderStats;

/// A combination of settings that does not change the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method {
    /// As charts and data name it.
    pub name: &'static str,
    /// How the closest hit is found.
    pub traversal: Traversal,
    /// What a lane works on.
    pub schedule: Schedule,
}

const fn method(name: &'static str, traversal: Traversal, schedule: Schedule) -> Method {
    Method { name, traversal, schedule }
}

/// All that the report compares, the slowest first.
pub const METHODS: &[Method] = &[
    method("linear, pixel", Traversal::Linear, Schedule::Pixel),
    method("linear, regenerate", Traversal::Linear, Schedule::Regenerate),
    method("stack, pixel", Traversal::Stack, Schedule::Pixel),
    method("stack, regenerate", Traversal::Stack, Schedule::Regenerate),
    method("stack, persistent", Traversal::Stack, Schedule::Persistent),
    method("wide, regenerate", Traversal::Wide, Schedule::Regenerate),
    method("wide, persistent", Traversal::Wide, Schedule::Persistent),
];

impl Method {
    /// Whether its time grows with the number of primitives itself.
    pub(super) fn is_linear(&self) -> bool {
        self.traversal == Traversal::Linear
    }

    /// A scene's settings, by this method.
    pub(super) fn settings(&self, settings: Settings) -> Settings {
        Settings { traversal: Some(self.traversal), schedule: Some(self.schedule), variant: None, ..settings }
    }
}

/// What became of a point.
pub(super) enum Outcome {
    /// The frames that count.
    Measured(Vec<RenderStats>),
    /// Why there is no such method here.
    Missing(String),
}

/// The frames of a point; a method that the backend does not have is no error.
pub(super) fn frames(renderer: &mut Renderer, settings: &Settings, effort: Effort) -> Result<Outcome, Error> {
    match measure(renderer, settings, WarmUp::of(effort.warm_up), effort.frames, &mut ()) {
        Ok(frames) => Ok(Outcome::Measured(frames.counted)),
        Err(Error::Settings(error) | Error::Backend(BackendError::Settings(error))) if is_missing(&error) => {
            Ok(Outcome::Missing("no such kernel".to_owned()))
        }
        Err(error) => Err(error),
    }
}

/// Whether the settings are fine, but for the method.
fn is_missing(error: &SettingsError) -> bool {
    matches!(error, SettingsError::NoVariant { .. })
}
