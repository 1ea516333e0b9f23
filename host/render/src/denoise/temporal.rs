//! History of live frames: its settings, and the inputs of a frame from earlier ones.

use super::view::FrameView;
use super::{DenoiseError, number_or_inf};
use serde::Serialize;
use trisect_shared::denoise::{PinholeView, STOP_FACTORS};

/// Settings of the use of earlier frames in a live frame. While the camera rests, all samples since
/// it came to rest are summed. Earlier frames, seen from other positions, are the history: it
/// counts as a number of frames, which falls by one with each frame at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TemporalSettings {
    /// Maximum number of frames that the history counts as; with 0 it is discarded when the camera
    /// moves.
    pub frames: u32,
    /// Number of standard deviations from the mean of a pixel's neighbourhood to which the history
    /// is clamped; infinite: no clamp.
    #[serde(serialize_with = "number_or_inf")]
    pub clamp: f32,
}

impl TemporalSettings {
    /// Default settings (docs/notebook/denoising.md).
    pub const DEFAULT: Self = Self { frames: 32, clamp: 2.0 };

    /// Maximum number of frames that the history can count as; longer sums would gain less than
    /// their rounding loses.
    pub const MAX_FRAMES: u32 = 1024;

    /// Checks that the settings are in range.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] names the one that is not.
    pub fn check(&self) -> Result<(), DenoiseError> {
        if self.frames > Self::MAX_FRAMES {
            return Err(DenoiseError::History { frames: self.frames, most: Self::MAX_FRAMES });
        }
        if self.clamp.is_nan() || self.clamp < 0.0 {
            return Err(DenoiseError::Parameter { name: "history_clamp", value: self.clamp.to_string() });
        }
        Ok(())
    }
}

/// Inputs of a frame from earlier frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TemporalInputs {
    /// View that the history was seen from.
    pub previous_view: PinholeView,
    /// Maximum number of samples that the history counts as.
    pub history: f32,
    /// Number of samples by which the history's count is reduced, since the camera came to rest.
    pub spent: f32,
    /// See [`TemporalSettings::clamp`].
    pub clamp: f32,
    /// Use of the history.
    pub history_use: HistoryUse,
    /// History to read, 0 or 1; the other one is written.
    pub past: usize,
    /// Sums that the frame shows.
    pub sums: FrameSums,
}

/// Use of the history by a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HistoryUse {
    /// Frames keep none.
    None,
    /// It is read, and written for the next frame.
    Reproject,
    /// It no longer counts, and the sums suffice for a variance: nothing is read, and
    /// [`history_passes`](super::passes::history_passes) write it when the camera moves.
    Settled,
}

/// Sums that a frame shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameSums {
    /// Sums of its own samples.
    Own,
    /// Sums over frames since the camera came to rest, to which its own samples are added.
    Added,
    /// Sums over frames as they are, because they have as many samples as they can have.
    Kept,
}

impl TemporalInputs {
    /// Returns the inputs of a frame without earlier ones.
    pub fn none(image: &FrameView) -> Self {
        Self {
            previous_view: image.view,
            history: 0.0,
            spent: 0.0,
            clamp: STOP_FACTORS.1,
            history_use: HistoryUse::None,
            past: 0,
            sums: FrameSums::Own,
        }
    }
}
