//! Live frames that follow each other: which samples the next one takes, and which history it
//! reads.

use super::Settings;
use crate::denoise::{
    FrameSums, FrameView, HistoryUse, MIN_VARIANCE_SAMPLES, TemporalInputs, TemporalSettings,
};
use std::fmt;
use std::ops::Range;
use trisect_kernels::EntryPoint;
use trisect_shared::denoise::{PinholeView, STOP_FACTORS};

/// Maximum number of samples per pixel that frames are summed to while the camera rests. The
/// rounding of these sums, relative 1e-5, stays well below the noise that is left.
pub const MAX_ACCUMULATED_SAMPLES: u32 = 1 << 16;

/// Event since which live frames accumulate samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restart {
    /// The first frame of this renderer, or the first after an error or another kind of render.
    First,
    /// The camera moved.
    Camera,
    /// A setting changed; its name.
    Setting(&'static str),
    /// Frames do not accumulate: they have no temporal settings.
    EachFrame,
}

impl fmt::Display for Restart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::First => write!(f, "the first frame"),
            Self::Camera => write!(f, "the camera moved"),
            Self::Setting(name) => write!(f, "{name} changed"),
            Self::EachFrame => write!(f, "this frame began"),
        }
    }
}

impl Restart {
    /// Returns the event of a change from one frame's settings and rows to the next one's.
    fn of_change(from: (&Settings, &Range<u32>), to: (&Settings, &Range<u32>)) -> Self {
        let (a, b) = (from.0, to.0);
        let name = match () {
            () if (a.width, a.height) != (b.width, b.height) => "the resolution",
            () if a.samples != b.samples => "the samples of a frame",
            () if a.depth != b.depth => "the depth",
            () if a.seed != b.seed => "the seed",
            () if a.sampler != b.sampler => "the sampler",
            () if (a.roulette, a.roulette_depth) != (b.roulette, b.roulette_depth) => "the roulette",
            () if a.light_sampling != b.light_sampling => "light sampling",
            () if a.clamp != b.clamp => "the clamp",
            () if a.math != b.math => "the math",
            () if from.1 != to.1 => "the rows",
            () => "the kernel's settings",
        };
        Self::Setting(name)
    }
}

/// Live frames that follow each other on the device with the same settings.
pub(super) struct LiveSession {
    pub settings: Settings,
    pub kernel: EntryPoint,
    /// Rows of the image that the frames show.
    pub rows: Range<u32>,
    /// Rows that they render, because the filter of the first one reached so far.
    pub around: Range<u32>,
    /// Image of the last frame.
    image: Option<FrameView>,
    /// View that the history to read was seen from.
    previous_view: Option<PinholeView>,
    /// History to read, 0 or 1.
    past: usize,
    /// True if the last frame wrote the other history, or left that for later.
    wrote: bool,
    /// True if the last frame left the other history to be written.
    unwritten: bool,
    /// Samples per pixel since the camera came to rest; 0 without temporal settings.
    pub accumulated: u32,
    /// Event since which samples are accumulated.
    pub since: Restart,
    /// Index of the next frame's first sample.
    sample: u32,
}

impl LiveSession {
    /// Begins a session after `before`, which had other settings or rows.
    pub fn new(
        kernel: EntryPoint,
        settings: Settings,
        (rows, around): (Range<u32>, Range<u32>),
        before: Option<&Self>,
    ) -> Self {
        let since = before.map_or(Restart::First, |before| {
            Restart::of_change((&before.settings, &before.rows), (&settings, &rows))
        });
        Self {
            settings,
            kernel,
            rows,
            around,
            image: None,
            previous_view: None,
            past: 0,
            wrote: false,
            unwritten: false,
            accumulated: 0,
            since,
            sample: 0,
        }
    }

    /// Returns whether the frames render all these rows.
    pub fn has_rows(&self, rows: &Range<u32>) -> bool {
        self.around.start <= rows.start && rows.end <= self.around.end
    }

    /// Returns whether the camera moved since the last frame.
    pub fn moves(&self, image: &FrameView) -> bool {
        self.image.is_some_and(|last| last != *image)
    }

    /// Returns the next frame's inputs from earlier frames, and advances the state. Returns also
    /// the view of earlier frames if their history is to be written first.
    pub fn next(
        &mut self,
        image: &FrameView,
        history: Option<&TemporalSettings>,
    ) -> (TemporalInputs, Option<FrameView>) {
        let last = self.image.replace(*image);
        let Some(history) = history else {
            (self.previous_view, self.accumulated, self.sample) = (None, 0, 0);
            (self.wrote, self.unwritten) = (false, false);
            self.since = Restart::EachFrame;
            return (TemporalInputs::none(image), None);
        };
        let samples = self.settings.samples;
        let kept = self.accumulated > 0 && last == Some(*image);
        if last.is_some_and(|last| last != *image) {
            self.since = Restart::Camera;
        }
        let mut unwritten = None;
        if !kept {
            // The camera moved, so the history that the last frame wrote is the one to read.
            unwritten = last.filter(|_| self.wrote && self.unwritten);
            let seen = last.filter(|last| self.wrote && last.reprojects && image.reprojects);
            self.previous_view = seen.map(|last| last.view);
            self.past = 1 - self.past;
            self.accumulated = 0;
        }
        let spent = self.accumulated;
        let counts = if self.previous_view.is_some() { history.frames * samples } else { 0 };
        let sums = match () {
            () if !kept => FrameSums::Own,
            () if spent + samples <= MAX_ACCUMULATED_SAMPLES => FrameSums::Added,
            () => FrameSums::Kept,
        };
        if sums != FrameSums::Kept {
            self.accumulated += samples;
        }
        let settled = kept && counts <= spent && self.accumulated >= MIN_VARIANCE_SAMPLES;
        self.wrote = history.frames > 0;
        self.unwritten = settled;
        let inputs = TemporalInputs {
            previous_view: self.previous_view.unwrap_or(image.view),
            history: counts as f32,
            spent: spent as f32,
            clamp: history.clamp.min(STOP_FACTORS.1),
            history_use: match () {
                () if !self.wrote => HistoryUse::None,
                () if settled => HistoryUse::Settled,
                () => HistoryUse::Reproject,
            },
            past: self.past,
            sums,
        };
        (inputs, unwritten)
    }

    /// Returns the index of this frame's first sample, and advances the state.
    pub fn first_sample(&mut self) -> u32 {
        let count = self.settings.samples;
        let first = if self.sample.checked_add(count).is_some() { self.sample } else { 0 };
        self.sample = first + count;
        first
    }
}
