//! What frames that follow each other share.

use super::passes::FrameView;
use super::{DenoiseError, number_or_inf};
use serde::Serialize;
use trisect_shared::denoise::{PinholeView, STOP_FACTORS};

/// Whether and how the frames before count in a live frame. While the camera rests, all samples since it came to rest are summed; what was seen
/// before it did, from elsewhere, counts as some frames, and less with each that follows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TemporalSettings {
    /// For how many frames the past counts, at most; 0 forgets it when the camera moves.
    pub frames: u32,
    /// Standard deviations of a pixel's neighbourhood within which the past is taken; infinite: as it is.
    #[serde(serialize_with = "number_or_inf")]
    pub clamp: f32,
}

impl TemporalSettings {
    /// With the parameters that docs/performance.md shows to be good.
    pub const DEFAULT: Self = Self { frames: 32, clamp: 2.0 };

    /// Most frames that the past can count for: sums of more would be no better than their rounding.
    pub const MAX_FRAMES: u32 = 1024;

    /// Refuses what is no parameter.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] names it.
    pub fn check(&self) -> Result<(), DenoiseError> {
        if self.frames > Self::MAX_FRAMES {
            return Err(DenoiseError::History { frames: self.frames, most: Self::MAX_FRAMES });
        }
        if self.clamp.is_nan() || self.clamp < 0.0 {
            return Err(DenoiseError::Parameter { name: "clamp", value: self.clamp.to_string() });
        }
        Ok(())
    }
}

/// What is known of the frames before one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TemporalInputs {
    /// Where they were seen from.
    pub previous_view: PinholeView,
    /// Samples that they count for, at most.
    pub history: f32,
    /// Of them, those that they no longer count for.
    pub spent: f32,
    pub clamp: f32,
    /// Whether the past is asked, and kept for the next frame.
    pub reproject: bool,
    /// The past that is read; the other is written.
    pub past: usize,
    /// Whether the camera rests: the frame is one of those that are summed.
    pub accumulated: bool,
}

impl TemporalInputs {
    /// Nothing.
    pub fn none(image: &FrameView) -> Self {
        Self {
            previous_view: image.view,
            history: 0.0,
            spent: 0.0,
            clamp: STOP_FACTORS.1,
            reproject: false,
            past: 0,
            accumulated: false,
        }
    }
}
