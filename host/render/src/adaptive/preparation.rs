//! Preparation of a render within a time budget, before the time begins: compiles kernels,
//! allocates buffers, and measures the filters and the passes.

use super::filter::Filter;
use super::pass_cost::{Calibration, calibrate};
use super::renderer::of_half;
use super::strategy::{candidates, warm_up};
use super::{Adaptive, DualBuffers, Free};
use crate::Error;
use crate::denoise::oidn::OidnError;
use crate::denoise::{DenoiseError, Denoiser};
use crate::render::{RenderObserver, Renderer, Settings, SettingsError};
use std::time::Duration;
use trisect_device::BackendError;
use web_time::Instant;

/// Budget, and what may be chosen.
#[derive(Clone, Copy)]
pub(super) struct BudgetPlan<'a> {
    pub time: Duration,
    pub adaptive: Adaptive,
    pub free: Free,
    /// Filter, or those of which the first that fits the time is tried.
    pub denoisers: &'a [Denoiser],
}

/// Settings, buffers and measurements from before the time begins.
pub(super) struct Preparation<'p> {
    /// Settings without AOVs.
    pub plain: Settings,
    /// Strategies whose kernels are compiled.
    pub known: Vec<Settings>,
    pub halves: DualBuffers,
    /// Filters that may fit the time.
    pub filters: Vec<Filter<'p>>,
    /// Error of the first denoiser that failed, and was only an option.
    pub denoiser_error: Option<String>,
    pub calibration: Option<Calibration>,
}

/// Compiles kernels, allocates buffers, and measures the filters and the passes.
pub(super) fn prepare<'p>(
    renderer: &mut Renderer,
    settings: &Settings,
    plan: BudgetPlan<'p>,
    observer: &mut dyn RenderObserver,
) -> Result<Preparation<'p>, Error> {
    let start = Instant::now();
    let plain = Settings { guides: false, ..settings.clone() };
    let mut known = Vec::new();
    warm_up(renderer, &plain, observer)?;
    for way in candidates(&plain, plan.free) {
        // Compiling alternatives must not take longer than the image, or a second.
        if start.elapsed() > plan.time.max(Duration::from_secs(1)) {
            break;
        }
        warm_up(renderer, &way, observer)?;
        known.push(way);
    }
    let mut halves = DualBuffers::on_device(settings.width, settings.height);
    let (mut filters, mut denoiser_error) = (Vec::new(), None);
    if !plan.denoisers.is_empty() {
        halves = DualBuffers::new(settings.width, settings.height);
        let ways = std::iter::once(&plain).chain(&known);
        let guided = ways.map(|way| Settings { guides: true, ..way.clone() }).collect::<Vec<_>>();
        halves.allocate_aovs();
        for denoise in plan.denoisers {
            match try_out(renderer, settings, denoise, &halves, plan) {
                // If the filter was only an option, the image goes without it.
                Err(error) if plan.free.denoise && is_of_filter(&error) => {
                    denoiser_error.get_or_insert_with(|| error.to_string());
                }
                ready => filters.extend(ready?),
            }
        }
        filters.retain(|filter| filter.may_fit(plan.time.as_secs_f64(), plan.free.denoise));
        if !filters.is_empty() {
            guided.iter().try_for_each(|way| warm_up(renderer, way, observer))?;
        }
    }
    let with_guides = Settings { guides: settings.guides || !filters.is_empty(), ..plain.clone() };
    if !with_guides.guides {
        halves.drop_aovs();
    }
    if renderer.begin_halves(&of_half(&with_guides, 0))? {
        halves = DualBuffers::on_device(settings.width, settings.height);
    } else if halves.is_on_device() {
        halves = DualBuffers::new(settings.width, settings.height);
        if settings.guides {
            halves.allocate_aovs();
        }
    }
    let (halves, calibration) = calibrate(renderer, &plain, &with_guides, halves, observer)?;
    Ok(Preparation { plain, known, halves, filters, denoiser_error, calibration })
}

/// Measures a filter; `None` if it is an option that is far too slow for the time.
fn try_out<'p>(
    renderer: &mut Renderer,
    settings: &Settings,
    denoise: &'p Denoiser,
    halves: &DualBuffers,
    plan: BudgetPlan,
) -> Result<Option<Filter<'p>>, Error> {
    let whole = plan.time.as_secs_f64();
    if plan.free.denoise && !Filter::is_worth_a_trial(renderer, settings, denoise, whole)? {
        return Ok(None);
    }
    Filter::try_out(renderer, settings, denoise, halves).map(Some)
}

/// Returns whether the error is that of a filter that cannot denoise such an image.
fn is_of_filter(error: &Error) -> bool {
    matches!(
        error,
        Error::Denoise(DenoiseError::Oidn(OidnError::Failed { .. }))
            | Error::Settings(SettingsError::TooLarge { .. })
            | Error::Backend(BackendError::TooLarge { .. })
    )
}
