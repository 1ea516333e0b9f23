//! Launches of the denoiser's passes and of the display.

use crate::BackendError;
use std::ops::Range;
use trisect_kernels::workgroup;
use trisect_shared::denoise::{DenoiseParams, PIXELS_PER_THREAD};
use trisect_shared::display::DisplayParams;

/// Maximum number of passes in a submission.
pub const MAX_PASSES: u32 = 14;

/// Kernel of the denoiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// Adds the frame's sums to those of earlier frames.
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
    /// reads this frame's and writes the sums over frames.
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

    /// Returns an error if a launch allows fewer work groups along an axis than this pass has.
    pub fn check_groups(&self, backend: &'static str, limit: u32) -> Result<(), BackendError> {
        let (across, down) = self.groups();
        if across.max(down) <= limit {
            return Ok(());
        }
        let (width, rows) = (self.params.width, self.rows.len() as u32);
        Err(BackendError::TooLong { backend, width, rows, limit: u64::from(limit) })
    }

    /// Returns the number of work groups across and down.
    pub fn groups(&self) -> (u32, u32) {
        let (threads, group) = (self.threads(), workgroup(self.kernel.name()));
        (threads.0.div_ceil(group.0), threads.1.div_ceil(group.1))
    }
}

/// Launch that converts a frame for a display.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplayLaunch {
    /// Launch parameters.
    pub params: DisplayParams,
    /// Denoised image, 0 or 1; `None` for the plain mean of the samples, which the parameters then
    /// select for all columns.
    pub image: Option<usize>,
    /// True if the samples are the sums over frames, and not this frame's.
    pub accumulated: bool,
}
