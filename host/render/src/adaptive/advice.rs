//! Choice of the sampling strategy for [`Goal::Error`](super::Goal::Error), by trials whose length
//! follows from the time that the render should take.

use super::strategy::{candidates, choose_strategy, warm_up};
use super::{Free, Trial};
use crate::Error;
use crate::render::{RenderObserver, Renderer, Settings};
use std::time::Duration;
use web_time::Instant;

/// Time of the trial that tells how long the render should take, for each half.
const FIRST_TRIAL: Duration = Duration::from_millis(2);

/// Time of the trial of each strategy, for each half, as a share of the expected time.
const TRIAL_SHARE: f64 = 0.004;

/// Maximum time of the trial of each strategy, for each half.
const MAX_TRIAL: Duration = Duration::from_millis(100);

/// Minimum expected time for which strategies are tried: below, the trials cost as much as they
/// gain.
const MIN_TIME: Duration = Duration::from_millis(200);

/// Maximum expected time that is distinguished from longer ones.
const MAX_TIME: Duration = Duration::from_secs(3600);

/// Returns the settings with the best strategy for a render to the error `target`, and the trials,
/// if there were any. The choice depends on measured times.
///
/// # Errors
///
/// Errors of rendering.
pub(super) fn choose(
    renderer: &mut Renderer,
    settings: &Settings,
    (target, free): (f64, Free),
    observer: &mut dyn RenderObserver,
) -> Result<(Settings, Vec<Trial>), Error> {
    let plain = Settings { guides: false, ..settings.clone() };
    let others = candidates(&plain, free);
    if others.is_empty() {
        return Ok((settings.clone(), Vec::new()));
    }
    let start = Instant::now();
    warm_up(renderer, &plain, observer)?;
    let second = Duration::from_secs(1);
    let (_, _, error) = choose_strategy(renderer, (&plain, &[]), (FIRST_TRIAL, second), observer)?;
    let expected = expected_time(error, target);
    if expected < MIN_TIME {
        return Ok((settings.clone(), Vec::new()));
    }
    let mut known = Vec::new();
    for way in others {
        // Compiling must not take longer than the image, or a second.
        if start.elapsed() > expected.max(second) || !observer.should_continue() {
            break;
        }
        warm_up(renderer, &way, observer)?;
        known.push(way);
    }
    let slice = expected.mul_f64(TRIAL_SHARE).clamp(FIRST_TRIAL, MAX_TRIAL);
    let (best, trials, _) = choose_strategy(renderer, (&plain, &known), (slice, expected), observer)?;
    Ok((Settings { guides: settings.guides, ..best }, trials))
}

/// Returns the time until the error is `target`, if it is `error` after a second and falls as that
/// of independent samples.
fn expected_time(error: f64, target: f64) -> Duration {
    let seconds = (error / target).powi(2);
    Duration::try_from_secs_f64(seconds).unwrap_or_default().min(MAX_TIME)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_of_the_error_takes_a_hundred_times_as_long() {
        assert_eq!(expected_time(0.1, 0.1), Duration::from_secs(1));
        assert_eq!(expected_time(0.1, 0.01).as_secs_f64().round(), 100.0);
        assert_eq!(expected_time(0.5, 1e-6), MAX_TIME);
        // A black trial says nothing, and is not tried again.
        assert_eq!(expected_time(f64::NAN, 0.1), Duration::ZERO);
        assert_eq!(expected_time(0.0, 0.1), Duration::ZERO);
    }
}
