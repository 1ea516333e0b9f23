//! Straight line through measurements, by least squares.

use serde::{Deserialize, Serialize};

/// A line `y = intercept + slope x`, fitted by least squares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Line {
    /// y at x = 0.
    pub intercept: f64,
    /// Change of y per unit of x.
    pub slope: f64,
    /// Coefficient of determination R²: the share of the variance of y that the line explains; 1
    /// for points on a line.
    pub r_squared: f64,
}

impl Line {
    /// Fits a line through the points (x, y). `None` if they do not define a slope and a variance:
    /// fewer than two different x, all y equal, or a value that is not finite.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let count = points.len() as f64;
        let mean = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / count;
        let (mean_x, mean_y) = (mean(|point| point.0), mean(|point| point.1));
        // Sums are taken about the means: sums of the squares themselves would cancel.
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for &(x, y) in points {
            let (x, y) = (x - mean_x, y - mean_y);
            xx += x * x;
            xy += x * y;
            yy += y * y;
        }
        let slope = xy / xx;
        let line = Self { intercept: mean_y - slope * mean_x, slope, r_squared: 1.0 };
        let residual: f64 = points.iter().map(|&(x, y)| (y - line.at(x)).powi(2)).sum();
        let line = Self { r_squared: 1.0 - residual / yy, ..line };
        [line.intercept, line.slope, line.r_squared].iter().all(|value| value.is_finite()).then_some(line)
    }

    /// Returns y at x.
    pub fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    /// First set of Anscombe, "Graphs in Statistical Analysis", 1973: intercept 3.0001, slope
    /// 0.5001, R² 0.6665 (as R prints them).
    const ANSCOMBE: [(f64, f64); 11] = [
        (10.0, 8.04),
        (8.0, 6.95),
        (13.0, 7.58),
        (9.0, 8.81),
        (11.0, 8.33),
        (14.0, 9.96),
        (6.0, 7.24),
        (4.0, 4.26),
        (12.0, 10.84),
        (7.0, 4.82),
        (5.0, 5.68),
    ];

    /// Half of the last digit that R printed.
    const TOLERANCE: f64 = 0.5e-4;

    fn is_anscombes(line: &Line) -> bool {
        let close = |value: f64, want: f64| (value - want).abs() <= TOLERANCE;
        close(line.intercept, 3.0001) && close(line.slope, 0.5001) && close(line.r_squared, 0.6665)
    }

    #[test]
    fn a_known_fit() {
        assert!(is_anscombes(&Line::through(&ANSCOMBE).unwrap()));
        // Negative control: one y off by its last digit, x and y exchanged, R for R².
        let mut wrong = ANSCOMBE;
        wrong[8].1 += 0.01;
        assert!(!is_anscombes(&Line::through(&wrong).unwrap()));
        let turned = ANSCOMBE.map(|(x, y)| (y, x));
        assert!(!is_anscombes(&Line::through(&turned).unwrap()));
        let line = Line::through(&ANSCOMBE).unwrap();
        assert!(!is_anscombes(&Line { r_squared: line.r_squared.sqrt(), ..line }));
    }

    #[test]
    fn points_on_a_line() {
        let points: Vec<(f64, f64)> = (0..5).map(f64::from).map(|x| (x, 2.0 - 0.5 * x)).collect();
        // The sums are exact in binary.
        let line = Line::through(&points).unwrap();
        assert_eq!(line, Line { intercept: 2.0, slope: -0.5, r_squared: 1.0 });
        assert_eq!(line.at(10.0), -3.0);
    }

    #[test]
    fn no_line() {
        let none: [&[(f64, f64)]; 5] = [
            &[],
            &[(1.0, 1.0)],
            &[(1.0, 1.0), (1.0, 2.0)],
            &[(1.0, 3.0), (2.0, 3.0)],
            &[(1.0, 1.0), (2.0, f64::NAN)],
        ];
        for points in none {
            assert_eq!(Line::through(points), None, "{points:?}");
        }
    }
}
