//! Passes of the denoiser over an image: the kernel launches of a filter, in order, with their
//! parameters. A renderer makes them, and a device runs them.

use super::temporal::{FrameSums, HistoryUse, TemporalInputs};
use super::view::FrameView;
use super::{DenoiseSettings, Filter, stop_factor};
use std::ops::Range;
use trisect_shared::denoise::{DenoiseParams, NEIGHBOURHOOD_RADIUS, PIXELS_PER_THREAD};

/// Kernel of the denoiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// Adds the frame's sums to those of earlier frames, and does with them what
    /// [`Demodulate`](Self::Demodulate) does.
    Add,
    /// Divides the mean radiance by the albedo, and writes the G-buffer.
    Demodulate,
    /// Estimates the variance from the neighbourhood.
    Estimate,
    /// Reprojects the history of earlier frames, and estimates the variance.
    Reproject,
    /// Filters one level with fixed edge stopping.
    Atrous,
    /// Filters one level with edge stopping by variance.
    Svgf,
    /// Multiplies by the albedo.
    Remodulate,
}

impl Kernel {
    /// Returns whether the kernel filters a level.
    pub fn is_level(self) -> bool {
        matches!(self, Self::Atrous | Self::Svgf)
    }

    /// Returns whether the kernel needs the buffers that frames keep for later ones.
    pub fn is_temporal(self) -> bool {
        matches!(self, Self::Add | Self::Reproject)
    }

    /// Returns the name of the entry point.
    pub fn name(self) -> &'static str {
        match self {
            Self::Add => "denoise_add",
            Self::Demodulate => "denoise_gather",
            Self::Estimate => "denoise_estimate",
            Self::Reproject => "denoise_reproject",
            Self::Atrous => "denoise_atrous",
            Self::Svgf => "denoise_svgf",
            Self::Remodulate => "denoise_finish",
        }
    }

    /// Returns its name in tables of times.
    pub fn title(self) -> &'static str {
        match self {
            Self::Estimate => "estimate the variance",
            _ => self.name().trim_start_matches("denoise_"),
        }
    }
}

/// Launch over rows of the image, from one of the denoiser's two images to the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// Kernel.
    pub kernel: Kernel,
    /// Launch parameters.
    pub params: DenoiseParams,
    /// Image to read, 0 or 1.
    pub from: usize,
    /// Image to write, the other one.
    pub to: usize,
    /// History to read, 0 or 1; the other one is written.
    pub past: usize,
    /// True if the pass reads the sums over frames, and not those of this frame; [`Kernel::Add`]
    /// reads both.
    pub accumulated: bool,
    /// Rows to write; a level also writes some rows beside them.
    pub rows: Range<u32>,
}

impl Pass {
    /// Returns the number of threads across and down.
    pub fn threads(&self) -> (u32, u32) {
        (self.params.width, self.thread_rows().len() as u32)
    }

    /// Returns the rows of threads, among those of the whole image.
    pub fn thread_rows(&self) -> Range<u32> {
        if !self.kernel.is_level() {
            return self.rows.clone();
        }
        let step = self.params.step;
        self.rows.start / (PIXELS_PER_THREAD * step) * step
            ..self.rows.end.div_ceil(PIXELS_PER_THREAD * step) * step
    }
}

/// Returns the passes over rows of an image, in order, with inputs from earlier frames. Without a
/// filter, the image is not smoothed.
pub(crate) fn passes(
    denoise: Option<&DenoiseSettings>,
    image: &FrameView,
    frames: &TemporalInputs,
    rows: &Range<u32>,
) -> Vec<Pass> {
    let base = denoise.map_or_else(|| image.params(), |denoise| denoise.params(image));
    let params = DenoiseParams {
        previous_view: frames.previous_view,
        max_history: frames.history,
        expired_history: frames.spent,
        clamp_deviations: frames.clamp,
        ..base
    };
    let (past, accumulated, rows) = (frames.past, frames.sums != FrameSums::Own, rows.clone());
    let first = Pass { kernel: Kernel::Demodulate, params, from: 1, to: 0, past, accumulated, rows };
    let next = |passes: &[Pass]| {
        let from = passes.last().map_or(0, |pass| pass.to);
        Pass { from, to: 1 - from, ..first.clone() }
    };
    let mut passes = vec![match frames.sums {
        FrameSums::Added => {
            let params = DenoiseParams { accumulate: 1, ..params };
            Pass { kernel: Kernel::Add, params, ..first.clone() }
        }
        FrameSums::Own | FrameSums::Kept => first.clone(),
    }];
    let variance = match frames.history_use {
        HistoryUse::Reproject => Some(Kernel::Reproject),
        HistoryUse::None => {
            denoise.filter(|denoise| denoise.filter == Filter::Svgf).map(|_| Kernel::Estimate)
        }
        HistoryUse::Settled => None,
    };
    if let Some(kernel) = variance {
        passes.push(Pass { kernel, ..next(&passes) });
    }
    for level in 0..denoise.map_or(0, |denoise| denoise.levels) {
        let step = 1 << level;
        let (kernel, color) = match denoise {
            Some(DenoiseSettings { filter: Filter::Atrous, color, .. }) => {
                let color = f64::from(*color) / f64::from(step);
                (Kernel::Atrous, stop_factor(color * color))
            }
            Some(DenoiseSettings { filter: Filter::Svgf, .. }) | None => (Kernel::Svgf, params.color_factor),
        };
        passes.push(Pass {
            kernel,
            params: DenoiseParams { step, color_factor: color, ..params },
            ..next(&passes)
        });
    }
    passes.push(Pass { kernel: Kernel::Remodulate, ..next(&passes) });
    passes.iter_mut().for_each(|pass| pass.params.first_row = pass.thread_rows().start);
    passes
}

/// Returns the number of rows above and below a pixel that it depends on through all passes: those
/// of the variance, and those of each level.
pub(crate) fn reach(denoise: Option<&DenoiseSettings>, frames: bool) -> u32 {
    let around = u32::from(frames || denoise.is_some()) * NEIGHBOURHOOD_RADIUS.unsigned_abs();
    denoise.map_or(0, |denoise| (0..denoise.levels).map(|level| 2 << level).sum()) + around
}

/// Returns the pass that starts the sums over frames with this frame.
pub(crate) fn store_pass(image: &FrameView, rows: Range<u32>) -> Pass {
    let params = DenoiseParams { first_row: rows.start, ..image.params() };
    Pass { kernel: Kernel::Add, params, from: 1, to: 0, past: 0, accumulated: true, rows }
}

/// Returns the passes that write the history of frames that were [`HistoryUse::Settled`], seen as
/// `image`, from their sums. `past` is the history that they would have read.
pub(crate) fn history_passes(image: &FrameView, past: usize, rows: &Range<u32>) -> Vec<Pass> {
    let history_use = HistoryUse::Reproject;
    let frames = TemporalInputs { history_use, sums: FrameSums::Kept, past, ..TemporalInputs::none(image) };
    let mut passes = passes(None, image, &frames, rows);
    passes.retain(|pass| pass.kernel != Kernel::Remodulate);
    passes
}
