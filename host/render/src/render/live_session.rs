//! Live frames that follow each other: which samples the next one takes, and which history it
//! reads.

use super::Settings;
use crate::denoise::{FrameView, TemporalInputs, TemporalSettings};
use std::ops::Range;
use trisect_kernels::EntryPoint;
use trisect_shared::denoise::{PinholeView, STOP_FACTORS};

/// Live frames that follow each other on the device with the same settings.
pub(super) struct LiveSession {
    pub settings: Settings,
    pub kernel: EntryPoint,
    /// Rows of the image that the frames render.
    pub rows: Range<u32>,
    /// Image of the last frame.
    image: Option<FrameView>,
    /// View that the history to read was seen from.
    previous_view: Option<PinholeView>,
    /// History to read, 0 or 1.
    past: usize,
    /// True if the last frame wrote the other history.
    wrote: bool,
    /// Samples per pixel since the camera came to rest; 0 without temporal settings.
    pub accumulated: u32,
    /// Index of the next frame's first sample.
    sample: u32,
}

impl LiveSession {
    pub fn new(kernel: EntryPoint, settings: Settings, rows: Range<u32>) -> Self {
        Self {
            settings,
            kernel,
            rows,
            image: None,
            previous_view: None,
            past: 0,
            wrote: false,
            accumulated: 0,
            sample: 0,
        }
    }

    /// Returns whether the camera moved since the last frame.
    pub fn moves(&self, image: &FrameView) -> bool {
        self.image.is_some_and(|last| last != *image)
    }

    /// Returns the next frame's inputs from earlier frames, and advances the state.
    pub fn next(&mut self, image: &FrameView, history: Option<&TemporalSettings>) -> TemporalInputs {
        let last = self.image.replace(*image);
        let Some(history) = history else {
            (self.previous_view, self.wrote, self.accumulated, self.sample) = (None, false, 0, 0);
            return TemporalInputs::none(image);
        };
        let samples = self.settings.samples;
        let kept = self.accumulated > 0 && last == Some(*image);
        if !kept {
            // The camera moved, so the history that the last frame wrote is the one to read.
            self.previous_view = last.filter(|_| self.wrote).map(|last| last.view);
            self.past = 1 - self.past;
            self.accumulated = 0;
        }
        let spent = self.accumulated as f32;
        self.accumulated += samples;
        self.wrote = history.frames > 0;
        TemporalInputs {
            previous_view: self.previous_view.unwrap_or(image.view),
            history: if self.previous_view.is_some() { (history.frames * samples) as f32 } else { 0.0 },
            spent,
            clamp: history.clamp.min(STOP_FACTORS.1),
            reproject: self.wrote,
            past: self.past,
            accumulated: kept,
        }
    }

    /// Returns the index of this frame's first sample, and advances the state.
    pub fn first_sample(&mut self) -> u32 {
        let count = self.settings.samples;
        let first = if self.sample.checked_add(count).is_some() { self.sample } else { 0 };
        self.sample = first + count;
        first
    }
}
