//! The passes over an image, one after the other.

use super::temporal::TemporalInputs;
use super::{DenoiseSettings, Filter, stop_factor, view};
use crate::backend::BackendError;
use std::ops::Range;
use trisect_kernels::workgroup;
use trisect_shared::camera::Camera;
use trisect_shared::denoise::{
    DenoiseParams, NEIGHBOURHOOD_RADIUS, PIXELS_PER_THREAD, PinholeView, STOP_FACTORS,
};
use trisect_shared::display::DisplayParams;

/// An image of a frame, and where it is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameView {
    pub view: PinholeView,
    pub width: u32,
    pub height: u32,
}

impl FrameView {
    /// By a camera.
    pub fn by(camera: &Camera, width: u32, height: u32) -> Self {
        Self { view: view::of(camera), width, height }
    }

    /// Without a filter: nothing stops at colours.
    pub(super) fn params(&self) -> DenoiseParams {
        DenoiseParams {
            view: self.view,
            width: self.width,
            height: self.height,
            step: 1,
            first_row: 0,
            color_factor: STOP_FACTORS.0,
            normal_factor: stop_factor(1.0 - f64::from(30.0f32).to_radians().cos()),
            depth_factor: stop_factor(f64::from(0.02f32).powi(2)).sqrt(),
            trusted_samples: MIN_VARIANCE_SAMPLES,
            previous_view: self.view,
            max_history: 0.0,
            expired_history: 0.0,
            clamp_deviations: STOP_FACTORS.1,
            accumulate: 0,
        }
    }
}

/// Samples from which on a pixel's own variance is used, as in SVGF.
const MIN_VARIANCE_SAMPLES: u32 = 4;

/// What a device does, one after the other, with an image and what is known of frames before it; without a filter, the image comes out as it is.
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
    let (past, kept, rows) = (frames.past, frames.accumulated, rows.clone());
    let first = Pass { kernel: Kernel::Demodulate, params, from: 1, to: 0, past, accumulated: kept, rows };
    let next = |passes: &[Pass]| {
        let from = passes.last().map_or(0, |pass| pass.to);
        Pass { from, to: 1 - from, ..first.clone() }
    };
    let mut passes = Vec::new();
    if frames.accumulated {
        let params = DenoiseParams { accumulate: 1, ..params };
        passes.push(Pass { kernel: Kernel::Add, params, accumulated: false, ..first.clone() });
    }
    passes.push(first.clone());
    if frames.reproject {
        passes.push(Pass { kernel: Kernel::Reproject, ..next(&passes) });
    } else if denoise.is_some_and(|denoise| denoise.filter == Filter::Svgf) {
        passes.push(Pass { kernel: Kernel::Estimate, ..next(&passes) });
    }
    for level in 0..denoise.map_or(0, |denoise| denoise.levels) {
        let step = 1 << level;
        let (kernel, color) = match denoise {
            Some(DenoiseSettings { filter: Filter::Atrous, color, .. }) => {
                let color = f64::from(*color) / f64::from(step);
                (Kernel::Atrous, stop_factor(color * color))
            }
            _ => (Kernel::Svgf, params.color_factor),
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

/// Rows around a pixel that it depends on, through all passes: those of the variance, and those of each level.
pub(crate) fn reach(denoise: Option<&DenoiseSettings>, frames: bool) -> u32 {
    let around = u32::from(frames || denoise.is_some()) * NEIGHBOURHOOD_RADIUS.unsigned_abs();
    denoise.map_or(0, |denoise| (0..denoise.levels).map(|level| 2 << level).sum()) + around
}

/// The pass that makes this frame the first of those that are summed.
pub(crate) fn store_pass(image: &FrameView, rows: Range<u32>) -> Pass {
    let params = DenoiseParams { first_row: rows.start, ..image.params() };
    Pass { kernel: Kernel::Add, params, from: 1, to: 0, past: 0, accumulated: false, rows }
}

/// A kernel of the denoiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// The frame to those before it.
    Add,
    /// From sums to an image over its albedo, and edges.
    Demodulate,
    /// Variance from the neighbourhood.
    Estimate,
    /// What the frame before knew, and variance.
    Reproject,
    /// A level with fixed stops.
    Atrous,
    /// A level with stops by variance.
    Svgf,
    /// The albedo again.
    Remodulate,
}

impl Kernel {
    /// Whether it is a level of the filter.
    pub fn is_level(self) -> bool {
        matches!(self, Self::Atrous | Self::Svgf)
    }

    /// Whether it needs what frames keep for those that follow.
    pub fn is_temporal(self) -> bool {
        matches!(self, Self::Add | Self::Reproject)
    }

    /// The entry point.
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

/// A launch over rows of the image: from one of two images to the other. Only a [`Renderer`](crate::render::Renderer) makes them: kernels trust
/// their sizes, and that what they read was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// What.
    pub(crate) kernel: Kernel,
    /// With what.
    pub(crate) params: DenoiseParams,
    /// The image that it reads, 0 or 1.
    pub(crate) from: usize,
    /// The other.
    pub(crate) to: usize,
    /// The past that it reads, 0 or 1; it writes the other.
    pub(crate) past: usize,
    /// Whether the film is the sum over frames, or this frame's; a pass of [`Kernel::Add`] writes the other.
    pub(crate) accumulated: bool,
    /// Those that are written, and for a level some beside them.
    pub(crate) rows: Range<u32>,
}

impl Pass {
    /// Threads across and down.
    pub fn threads(&self) -> (u32, u32) {
        (self.params.width, self.thread_rows().len() as u32)
    }

    /// Rows of threads, of those that the whole image takes.
    fn thread_rows(&self) -> Range<u32> {
        if !self.kernel.is_level() {
            return self.rows.clone();
        }
        let step = self.params.step;
        self.rows.start / (PIXELS_PER_THREAD * step) * step
            ..self.rows.end.div_ceil(PIXELS_PER_THREAD * step) * step
    }

    /// Refuses more work groups than a launch has.
    pub(crate) fn check_groups(&self, backend: &'static str, limit: u32) -> Result<(), BackendError> {
        let (across, down) = self.groups();
        if across.max(down) <= limit {
            return Ok(());
        }
        let (width, rows) = (self.params.width, self.rows.len() as u32);
        Err(BackendError::TooLong { backend, width, rows, limit: u64::from(limit) })
    }

    /// Work groups across and down.
    pub fn groups(&self) -> (u32, u32) {
        let (threads, group) = (self.threads(), workgroup(self.kernel.name()));
        (threads.0.div_ceil(group.0), threads.1.div_ceil(group.1))
    }
}

/// A frame as a screen shows it. Only a [`Renderer`](crate::render::Renderer) makes one: kernels trust its size.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplayLaunch {
    /// With what.
    pub(crate) params: DisplayParams,
    /// The denoised image, 0 or 1; none for the samples' plain mean, which the parameters ask for then in all columns.
    pub(crate) image: Option<usize>,
    /// Whether the samples are the sums over frames, or this frame's.
    pub(crate) accumulated: bool,
}
