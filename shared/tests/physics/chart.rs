//! A grid over directions, to count samples in and to integrate pdfs over.

use glam::{DVec3, Vec3};
use trisect_shared::math::basis;

const ROWS: usize = 32;
const COLUMNS: usize = 32;
/// Number of cells of a chart.
pub const CELLS: usize = ROWS * COLUMNS;
/// Grid over all directions, fine around its axis. Row a, column b of the unit square is the
/// direction with sin²(θ/2) = a⁴ and φ = 2πb.
pub struct Chart {
    axis: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Chart {
    pub fn new(axis: Vec3) -> Self {
        let (x, y) = basis(axis);
        Self { axis: axis.as_dvec3(), x: x.as_dvec3(), y: y.as_dvec3() }
    }

    /// Returns the cell of a direction, below [`CELLS`].
    pub fn cell(&self, d: Vec3) -> usize {
        let d = d.as_dvec3();
        let a = ((d - self.axis).length_squared() / 4.0).sqrt().sqrt();
        let b = d.dot(self.y).atan2(d.dot(self.x)) / core::f64::consts::TAU + 0.5;
        let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        index(a, ROWS) * COLUMNS + index(b, COLUMNS)
    }

    /// Returns the direction at (`a`, `b`) of the unit square, and the solid angle per unit of area
    /// there.
    fn place(&self, a: f64, b: f64) -> (Vec3, f64) {
        let half2 = a.powi(4);
        let sine = 2.0 * (half2 * (1.0 - half2)).sqrt();
        let (s, c) = ((b - 0.5) * core::f64::consts::TAU).sin_cos();
        let d = (self.x * c + self.y * s) * sine + self.axis * (1.0 - 2.0 * half2);
        (d.normalize().as_vec3(), 8.0 * a.powi(3) * core::f64::consts::TAU)
    }

    /// Returns the integral of `pdf` over a cell, by `points` points in each direction; by four
    /// times as many if the cell contains an edge of the pdf.
    pub fn integral(&self, cell: usize, points: usize, pdf: impl Fn(Vec3) -> f64) -> f64 {
        let (row, column) = ((cell / COLUMNS) as f64, (cell % COLUMNS) as f64);
        let sum = |n: usize| {
            let (mut sum, mut zeros) = (0.0, 0);
            for i in 0..n * n {
                let a = (row + ((i / n) as f64 + 0.5) / n as f64) / ROWS as f64;
                let b = (column + ((i % n) as f64 + 0.5) / n as f64) / COLUMNS as f64;
                let (d, solid_angle) = self.place(a, b);
                let value = pdf(d) * solid_angle;
                zeros += usize::from(value == 0.0);
                sum += value;
            }
            (sum / (n * n * ROWS * COLUMNS) as f64, zeros > 0 && zeros < n * n)
        };
        match sum(points) {
            (_, true) => sum(4 * points).0,
            (whole, false) => whole,
        }
    }
}
