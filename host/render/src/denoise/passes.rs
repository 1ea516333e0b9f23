//! Passes of the denoiser over an image: the kernel launches of a filter, in order, with their
//! parameters. A renderer makes them, and a backend runs them.

use super::temporal::TemporalInputs;
use super::view::FrameView;
use super::{DenoiseSettings, Filter, LEVELS, stop_factor};
use std::ops::Range;
use trisect_device::{Kernel, MAX_PASSES, Pass};
use trisect_shared::denoise::{DenoiseParams, NEIGHBOURHOOD_RADIUS};

// Three passes come before the levels, and one after them.
const _: () = assert!(*LEVELS.end() + 4 <= MAX_PASSES);

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

/// Returns the number of rows above and below a pixel that it depends on through all passes: those
/// of the variance, and those of each level.
pub(crate) fn reach(denoise: Option<&DenoiseSettings>, frames: bool) -> u32 {
    let around = u32::from(frames || denoise.is_some()) * NEIGHBOURHOOD_RADIUS.unsigned_abs();
    denoise.map_or(0, |denoise| (0..denoise.levels).map(|level| 2 << level).sum()) + around
}

/// Returns the pass that starts the sums over frames with this frame.
pub(crate) fn store_pass(image: &FrameView, rows: Range<u32>) -> Pass {
    let params = DenoiseParams { first_row: rows.start, ..image.params() };
    Pass { kernel: Kernel::Add, params, from: 1, to: 0, past: 0, accumulated: false, rows }
}
