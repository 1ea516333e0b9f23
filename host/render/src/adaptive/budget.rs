//! Rendering of the best image within a time budget, for [`Goal::Time`](super::Goal::Time): chooses
//! the sampling strategy by trials, takes samples in passes, and filters the image if that helps.

use super::budget_run::{BudgetResult, BudgetRun};
use super::preparation::{BudgetPlan, prepare};
use crate::Error;
use crate::render::{RenderObserver, Renderer, Settings};
use web_time::Instant;

/// Maximum number of passes; each ends closer to the end of the time.
const MAX_PASSES: usize = 32;

/// Takes samples, and filters the image if that helps, within the given time. The time begins when
/// the kernels are compiled and the passes are calibrated.
///
/// # Errors
///
/// Errors of rendering.
pub(super) fn render_within<'a>(
    renderer: &'a mut Renderer,
    settings: &Settings,
    plan: BudgetPlan,
    observer: &'a mut dyn RenderObserver,
) -> Result<BudgetResult<'a>, Error> {
    let preparing = Instant::now();
    let prepared = prepare(renderer, settings, plan, observer)?;
    let preparing = preparing.elapsed();
    let start = Instant::now();
    let (mut run, trials) = BudgetRun::begin(renderer, settings, plan, prepared, (start, observer))?;
    run.first_samples()?;
    for index in 0..MAX_PASSES {
        if !run.renderer.should_continue() || !run.pass(index)? {
            break;
        }
    }
    run.finish(trials, preparing)
}
