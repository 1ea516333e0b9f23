//! Gauss-Legendre quadrature.

use std::f64::consts::PI;

/// Points and weights of an integral from 0 to 1.
#[derive(Clone, Debug)]
pub(super) struct Gauss<const N: usize> {
    points: [f64; N],
    weights: [f64; N],
}

impl<const N: usize> Gauss<N> {
    /// Computes the roots of the Legendre polynomial of degree `N` by Newton's method.
    pub fn new() -> Self {
        let (mut points, mut weights) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let mut x = -libm::cos(PI * (i as f64 + 0.75) / (N as f64 + 0.5));
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut p, mut before) = (1.0, 0.0);
                for n in 0..N {
                    let n = n as f64;
                    (p, before) = (((2.0 * n + 1.0) * x * p - n * before) / (n + 1.0), p);
                }
                slope = N as f64 * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            points[i] = 0.5 * (x + 1.0);
            weights[i] = 1.0 / ((1.0 - x * x) * slope * slope);
        }
        Self { points, weights }
    }

    /// Returns the points, in ascending order, with their weights.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.points.iter().copied().zip(self.weights.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        let gauss = Gauss::<5>::new();
        for power in 0..10 {
            let sum: f64 = gauss.points().map(|(x, weight)| weight * x.powi(power)).sum();
            assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-13, "{power}: {sum}");
        }
        // Negative control: the next power is not.
        let sum: f64 = gauss.points().map(|(x, weight)| weight * x.powi(10)).sum();
        assert!((sum * 11.0 - 1.0).abs() > 1e-6, "{sum}");
    }
}
