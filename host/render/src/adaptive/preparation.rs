//! Preparation of a render within a time budget, before the time begins: compiles kernels,
//! allocates buffers, and measures the filter and the passes.

use super::filter::Filter;
use super::pass_cost::{Calibration, calibrate};
use super::renderer::of_half;
use super::strategy::{candidates, warm_up};
use super::{Adaptive, DualBuffers, Free};
use crate::Error;
use crate::denoise::Denoiser;
use crate::render::{RenderObserver, Renderer, Settings, SettingsError};
use std::time::{Duration, Instant};
use trisect_device::BackendError;

/// Budget, and what may be chosen.
#[derive(Clone, Copy)]
pub(super) struct BudgetPlan<'a> {
    pub time: Duration,
    pub adaptive: Adaptive,
    pub free: Free,
    /// Filter, or the one that may be chosen.
    pub denoise: Option<&'a Denoiser>,
}

/// Settings, buffers and measurements from before the time begins.
pub(super) struct Preparation<'p> {
    /// Settings without AOVs.
    pub plain: Settings,
    /// Strategies whose kernels are compiled.
    pub known: Vec<Settings>,
    pub halves: DualBuffers,
    /// Filter that may fit the time.
    pub filter: Option<Filter<'p>>,
    pub calibration: Option<Calibration>,
}

/// Compiles kernels, allocates buffers, and measures the filter and the passes.
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
    let mut filter = None;
    if let Some(denoise) = plan.denoise {
        halves = DualBuffers::new(settings.width, settings.height);
        let ways = std::iter::once(&plain).chain(&known);
        let guided = ways.map(|way| Settings { guides: true, ..way.clone() }).collect::<Vec<_>>();
        halves.allocate_aovs();
        filter = match Filter::try_out(renderer, settings, denoise, &halves) {
            // If the filter was only an option, the image goes without it.
            Err(error) if plan.free.denoise && is_too_large(&error) => None,
            ready => Some(ready?),
        };
        filter = filter.filter(|filter| filter.may_fit(plan.time.as_secs_f64(), plan.free.denoise));
        if filter.is_some() {
            guided.iter().try_for_each(|way| warm_up(renderer, way, observer))?;
        }
    }
    let with_guides = Settings { guides: settings.guides || filter.is_some(), ..plain.clone() };
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
    Ok(Preparation { plain, known, halves, filter, calibration })
}

fn is_too_large(error: &Error) -> bool {
    matches!(
        error,
        Error::Settings(SettingsError::TooLarge { .. }) | Error::Backend(BackendError::TooLarge { .. })
    )
}
