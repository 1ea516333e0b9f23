//! Computes the Pareto front of time and error, and each configuration's slopes.

use super::point::{Point, Slope};
use crate::bench::Line;

/// Marks the points that no other point beats in time and error.
pub(super) fn mark(points: &mut [Point]) {
    let places: Vec<(f64, f64)> =
        points.iter().map(|point| (point.seconds.all.median, point.relative_error())).collect();
    for (point, &(time, error)) in points.iter_mut().zip(&places) {
        let better = |&(t, e): &(f64, f64)| t <= time && e <= error && (t < time || e < error);
        point.on_front = error.is_finite() && !places.iter().any(better);
    }
}

/// Returns the slopes of each configuration's error over time and over samples.
pub(super) fn slopes(points: &[Point]) -> Vec<Slope> {
    let mut slopes: Vec<Slope> = Vec::new();
    for point in points {
        if slopes.iter().any(|slope| slope.knob == point.knob && slope.level == point.level) {
            continue;
        }
        let own = || points.iter().filter(|other| other.knob == point.knob && other.level == point.level);
        let through = |x: &dyn Fn(&Point) -> f64| {
            let logs: Vec<(f64, f64)> = own().map(|p| (x(p).ln(), p.relative_error().ln())).collect();
            Line::through(&logs).map(|line| line.slope)
        };
        slopes.push(Slope {
            knob: point.knob.clone(),
            level: point.level.clone(),
            over_time: through(&|p| p.seconds.all.median),
            over_samples: through(&|p| f64::from(p.spp)),
        });
    }
    slopes
}
