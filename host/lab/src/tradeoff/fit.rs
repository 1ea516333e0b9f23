//! Chooses numbers of samples, and a size of the images, that fit a measurement into a given time.

use std::time::Duration;

/// Numbers of samples, repetitions and size that approximately fit a given time.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Samples per pixel, ascending.
    pub levels: Vec<u32>,
    /// Repetitions (seeds).
    pub seeds: usize,
    /// Time for the reference.
    pub reference: Duration,
    /// Edges of the whole image over those of the images that fit the time.
    pub reduction: u32,
}

/// Cost of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Number of configurations.
    pub configurations: usize,
    /// Repetitions (seeds).
    pub seeds: usize,
    /// Seconds per sample of each pixel.
    pub each: f64,
    /// Fixed seconds of an image.
    pub fixed: f64,
    /// Seconds that an image takes besides rendering.
    pub analysis: f64,
}

/// Share of the time for the reference.
pub const REFERENCE_SHARE: f64 = 0.35;

/// Minimum and maximum time for rendering a reference.
const REFERENCE_TIMES: (Duration, Duration) = (Duration::from_millis(1), Duration::from_secs(1_000_000));

/// Numbers of samples per pixel for each configuration.
const LEVELS: u32 = 3;

/// Minimum of the highest number of samples per pixel. With fewer, errors are those of noise alone.
const MIN_TOP: f64 = 16.0;

/// Maximum of [`Fit::reduction`].
const MAX_REDUCTION: u32 = 8;

/// Minimum edge of reduced images in pixels.
const MIN_EDGE: u32 = 64;

/// Divides `time`: [`REFERENCE_SHARE`] for the reference, the rest for all configurations with
/// three numbers of samples, each four times the one before. Reduces images of `edge` pixels, the
/// smaller edge, where not even 16 samples fit; `None` for images of a size that must stay.
pub fn fit(time: Duration, cost: Cost, edge: Option<u32>) -> Fit {
    let reference = time.mul_f64(REFERENCE_SHARE).clamp(REFERENCE_TIMES.0, REFERENCE_TIMES.1);
    let rest = time.as_secs_f64() * (1.0 - REFERENCE_SHARE) * 0.8;
    let images = (cost.configurations * cost.seeds) as f64;
    let most = |reduction: u32| {
        let share = f64::from(reduction).powi(-2);
        let overhead = images * f64::from(LEVELS) * (cost.fixed + share * cost.analysis);
        // All levels take 1 + 1/4 + 1/16 times the highest. Some configurations take twice as long
        // as the base.
        ((rest - overhead) / (images * 1.3125 * share * cost.each)).max(1.0)
    };
    let reductions = (0..).map(|power| 1 << power).take_while(|&reduction| {
        reduction == 1 || reduction <= MAX_REDUCTION && edge.is_some_and(|edge| edge / reduction >= MIN_EDGE)
    });
    let mut chosen = 1;
    for reduction in reductions {
        chosen = reduction;
        if most(reduction) >= MIN_TOP {
            break;
        }
    }
    let top = most(chosen).max(MIN_TOP).log2().floor().min(16.0) as i32;
    let levels = (0..LEVELS as i32).rev().map(|k| 1u32 << (top - 2 * k).max(0)).collect();
    Fit { levels, seeds: cost.seeds, reference, reduction: chosen }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COST: Cost = Cost { configurations: 30, seeds: 8, each: 0.1, fixed: 0.0, analysis: 0.0 };

    fn fit_in(seconds: u64, edge: Option<u32>) -> (u32, Vec<u32>) {
        let found = fit(Duration::from_secs(seconds), COST, edge);
        assert_eq!(found.reference, Duration::from_secs(seconds).mul_f64(0.35).max(REFERENCE_TIMES.0));
        (found.reduction, found.levels)
    }

    #[test]
    fn short_measurements_have_small_images() {
        // 16 samples take 30 x 8 x 1.3125 x 0.1 x 16 = 504 s of 0.52 of the time.
        assert_eq!(fit_in(1000, Some(512)), (1, vec![1, 4, 16]));
        assert_eq!(fit_in(900, Some(512)).0, 2);
        assert_eq!(fit_in(60, Some(512)), (8, vec![2, 8, 32]));
        assert_eq!(fit_in(4000, Some(512)), (1, vec![4, 16, 64]));
        // Images do not become smaller than 64 pixels, nor than a user wants them.
        assert_eq!(fit_in(60, Some(200)).0, 2);
        assert_eq!(fit_in(60, Some(100)).0, 1);
        assert_eq!(fit_in(60, None), (1, vec![1, 4, 16]));
        assert_eq!(fit_in(0, Some(512)), (8, vec![1, 4, 16]));
        // Other work than rendering counts, too.
        let busy = Cost { analysis: 10.0, ..COST };
        assert_eq!(fit(Duration::from_secs(1000), busy, Some(512)).reduction, 4);
    }

    #[test]
    fn an_unknown_speed_fits_nothing() {
        let cost = Cost { each: f64::INFINITY, ..COST };
        assert_eq!(fit(Duration::from_secs(60), cost, None).levels, [1, 4, 16]);
    }
}
