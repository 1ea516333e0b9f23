//! LDR-FLIP: the difference seen when two images alternate on a display.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP:
//! A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph.
//! Interact. Tech. 3(2), HPG 2020. The colour pipeline filters with contrast
//! sensitivity functions (CSF) and measures HyAB in Hunt-adjusted CIELAB; the
//! feature pipeline compares edges and points; the feature difference then
//! raises the colour difference.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::colour::{hunt_lab_from_linear, hyab, linear_from_ycxcz, ycxcz_from_linear};
use super::convolve::Plane;
use super::{ImageView, MetricsError, check_pair, is_finite_pair};

/// Pixels per degree of visual angle for the paper's viewer: 0.7 m from a
/// display 0.7 m and 3840 pixels wide, about 67.02.
pub const DEFAULT_PIXELS_PER_DEGREE: f32 = (0.7 * (3840.0 / 0.7) * (PI / 180.0)) as f32;

/// Accepted pixels per degree. The bounds keep the filters within a few
/// hundred taps and their weights above underflow.
const PIXELS_PER_DEGREE_RANGE: std::ops::RangeInclusive<f32> = 1.0..=1000.0;

/// CSF of Y, Cx and Cz as sums of Gaussians, each `(a, b)` with b in degrees²
/// (paper, colour pipeline, table of CSF parameters).
const CSF_Y: [(f64, f64); 1] = [(1.0, 0.0047)];
const CSF_CX: [(f64, f64); 1] = [(1.0, 0.0053)];
const CSF_CZ: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];
/// Maximum b of the CSF Gaussians. It sets the radius of all CSF filters.
const CSF_WIDEST: f64 = 0.04;

/// Exponent of the colour difference, q_c.
const COLOUR_EXPONENT: f32 = 0.7;
/// Fraction p_c of the maximum colour difference that maps to the error [`KNEE_ERROR`], p_t. The
/// range above it is compressed.
const KNEE: f32 = 0.4;
const KNEE_ERROR: f32 = 0.95;
/// Width of the feature detectors, w, in degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// A FLIP error map.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Columns of the map.
    pub width: usize,
    /// Rows of the map.
    pub height: usize,
    /// Error of each pixel in [0, 1], row-major, top row first; 0 if no difference is visible.
    pub errors: Vec<f32>,
    /// Mean of `errors`.
    pub mean: f64,
}

/// Computes LDR-FLIP at [`DEFAULT_PIXELS_PER_DEGREE`]; see [`flip_at`].
///
/// # Errors
///
/// Errors of [`flip_at`].
pub fn flip(image: &ImageView, reference: &ImageView) -> Result<FlipMap, MetricsError> {
    flip_at(image, reference, DEFAULT_PIXELS_PER_DEGREE)
}

/// Computes LDR-FLIP of two linear images for a viewer at `pixels_per_degree`.
///
/// The paper takes sRGB input and decodes it first. Here the input is linear already, so that step
/// is left out and values are clamped to [0, 1] instead: tone-map beforehand if highlights matter.
/// The measure is symmetric.
///
/// A pixel with a NaN or infinite value in either image has error 1, and is black in both for the
/// filters of its neighbours.
///
/// # Errors
///
/// [`MetricsError`] if a view is malformed or empty, the sizes differ, or `pixels_per_degree` is
/// outside [1, 1000].
pub fn flip_at(
    image: &ImageView,
    reference: &ImageView,
    pixels_per_degree: f32,
) -> Result<FlipMap, MetricsError> {
    FlipReference::new(reference, pixels_per_degree)?.flip(image)
}

/// A reference that is compared with many images. Its half of the computation is done once.
pub struct FlipReference<'a> {
    view: ImageView<'a>,
    pixels_per_degree: f64,
    /// Filtered reference for images without pixels to blank; `None` if the reference itself has
    /// non-finite pixels.
    appearance: Option<Appearance>,
}

impl<'a> FlipReference<'a> {
    /// Prepares a linear image for a viewer at `pixels_per_degree`.
    ///
    /// # Errors
    ///
    /// Errors of [`flip_at`].
    pub fn new(view: &ImageView<'a>, pixels_per_degree: f32) -> Result<Self, MetricsError> {
        view.check()?;
        if !PIXELS_PER_DEGREE_RANGE.contains(&pixels_per_degree) {
            return Err(MetricsError::PixelsPerDegree(pixels_per_degree));
        }
        let pixels_per_degree = f64::from(pixels_per_degree);
        let appearance = is_finite(view).then(|| Appearance::new(view, view, pixels_per_degree));
        Ok(Self { view: *view, pixels_per_degree, appearance })
    }

    /// Computes [`flip_at`] of `image` and this reference.
    ///
    /// # Errors
    ///
    /// Errors of [`flip_at`].
    pub fn flip(&self, image: &ImageView) -> Result<FlipMap, MetricsError> {
        check_pair(image, &self.view)?;
        let ppd = self.pixels_per_degree;
        let a = Appearance::new(image, &self.view, ppd);
        match &self.appearance {
            Some(b) if is_finite(image) => Ok(compare((image, &a), (&self.view, b))),
            _ => Ok(compare((image, &a), (&self.view, &Appearance::new(&self.view, image, ppd)))),
        }
    }
}

fn is_finite(view: &ImageView) -> bool {
    view.pixels.par_iter().all(|pixel| pixel.iter().all(|v| v.is_finite()))
}

fn compare(image: (&ImageView, &Appearance), reference: (&ImageView, &Appearance)) -> FlipMap {
    let ((image, a), (reference, b)) = (image, reference);
    let greatest = greatest_colour_difference();
    let colours = a.colours.par_iter().zip(&b.colours);
    let features = a.features.par_iter().zip(&b.features);
    let pixels = image.pixels.par_iter().zip(reference.pixels);
    let errors: Vec<f32> = colours
        .zip(features)
        .zip(pixels)
        .map(|(((&c0, &c1), (&f0, &f1)), (p, r))| {
            if !is_finite_pair(p, r) {
                return 1.0;
            }
            let colour = redistribute(colour_difference(c0, c1), greatest);
            // Rounding may exceed the ends of the range.
            colour.powf(1.0 - feature_difference(f0, f1)).clamp(0.0, 1.0)
        })
        .collect();
    // Summed in order, so that the mean does not depend on the thread count.
    let sum: f64 = errors.iter().map(|&e| f64::from(e)).sum();
    let mean = sum / errors.len() as f64;
    FlipMap { width: image.width, height: image.height, errors, mean }
}

/// One image after the filters of the two pipelines, with one entry per pixel.
struct Appearance {
    /// CSF-filtered colours in Hunt-adjusted CIELAB.
    colours: Vec<[f32; 3]>,
    /// Magnitudes of the edge and of the point response.
    features: Vec<[f32; 2]>,
}

impl Appearance {
    /// Filters `view`. `other` only marks the pixels to blank; both views have the same shape.
    fn new(view: &ImageView, other: &ImageView, ppd: f64) -> Self {
        let pixels = view.pixels.par_iter().zip(other.pixels);
        let (y, (cx, cz)): (Vec<f32>, (Vec<f32>, Vec<f32>)) = pixels
            .map(|(p, o)| {
                let linear = if is_finite_pair(p, o) { *p } else { [0.0; 3] };
                let [y, cx, cz] = ycxcz_from_linear(linear.map(|v| v.clamp(0.0, 1.0)));
                (y, (cx, cz))
            })
            .unzip();
        let [y, cx, cz] = [y, cx, cz].map(|samples| Plane::new(view.width, samples));
        Self { colours: perceived_colours([&y, &cx, &cz], ppd), features: features(&y, ppd) }
    }
}

/// Runs the colour pipeline up to the distance: filters the YCxCz planes with the CSF and returns
/// Hunt-adjusted CIELAB.
fn perceived_colours([y, cx, cz]: [&Plane; 3], ppd: f64) -> Vec<[f32; 3]> {
    let y = csf_filter(y, &CSF_Y, ppd);
    let cx = csf_filter(cx, &CSF_CX, ppd);
    let cz = csf_filter(cz, &CSF_CZ, ppd);
    let chroma = cx.samples().par_iter().zip(cz.samples());
    let filtered = y.samples().par_iter().zip(chroma);
    filtered
        .map(|(&y, (&cx, &cz))| {
            // Separate filtering of the channels can leave the display's gamut.
            let displayed = linear_from_ycxcz([y, cx, cz]).map(|v| v.clamp(0.0, 1.0));
            hunt_lab_from_linear(displayed)
        })
        .collect()
}

/// Convolves with the sum of a √(π/b) exp(-π² r² / b), r in degrees, normalised to unit sum over
/// its square window.
///
/// Each Gaussian is separable. Its share of the unit sum is its own sum over the window: the square
/// of the sum of its one-dimensional factor.
fn csf_filter(plane: &Plane, gaussians: &[(f64, f64)], ppd: f64) -> Plane {
    let radius = (3.0 * (CSF_WIDEST / (2.0 * PI * PI)).sqrt() * ppd).ceil();
    let factors = gaussians.iter().map(|&(a, b)| {
        let factor = sampled(radius, |x| (-(PI * x / ppd).powi(2) / b).exp());
        let sum: f64 = factor.iter().sum();
        (a * (PI / b).sqrt() * sum * sum, scaled(&factor, 1.0 / sum))
    });
    let factors: Vec<(f64, Vec<f64>)> = factors.collect();
    let total: f64 = factors.iter().map(|(weight, _)| weight).sum();
    factors
        .iter()
        .map(|(weight, factor)| {
            let columns = narrowed(&scaled(factor, weight / total));
            plane.filter_rows(&narrowed(factor)).filter_columns(&columns)
        })
        .reduce(|sum, term| sum.add(&term))
        .unwrap_or_else(|| plane.clone())
}

/// Runs the feature pipeline up to the difference: returns magnitudes of the first (edges) and
/// second (points) Gaussian derivatives of Y, scaled to [0, 1].
fn features(y: &Plane, ppd: f64) -> Vec<[f32; 2]> {
    let sigma = 0.5 * FEATURE_WIDTH * ppd;
    let radius = (3.0 * sigma).ceil();
    let gaussian = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let smooth = signed_unit(&sampled(radius, gaussian));
    let edge = signed_unit(&sampled(radius, |x| -x * gaussian(x)));
    let curve = |x: f64| (x * x / (sigma * sigma) - 1.0) * gaussian(x);
    let point = signed_unit(&sampled(radius, curve));

    let y = y.map(|v| (v + 16.0) / 116.0);
    let across = y.filter_rows(&smooth);
    let edges_x = y.filter_rows(&edge).filter_columns(&smooth);
    let edges_y = across.filter_columns(&edge);
    let points_x = y.filter_rows(&point).filter_columns(&smooth);
    let points_y = across.filter_columns(&point);

    let edges = edges_x.samples().par_iter().zip(edges_y.samples());
    let points = points_x.samples().par_iter().zip(points_y.samples());
    let magnitude = |x: f32, y: f32| (x * x + y * y).sqrt();
    edges.zip(points).map(|((&ex, &ey), (&px, &py))| [magnitude(ex, ey), magnitude(px, py)]).collect()
}

/// Returns the values of `f` at the integers of [-radius, radius].
fn sampled(radius: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| f(f64::from(x))).collect()
}

/// Scales the positive weights to the sum 1 and the negative ones to the sum -1.
fn signed_unit(kernel: &[f64]) -> Vec<f32> {
    let positive: f64 = kernel.iter().map(|w| w.max(0.0)).sum();
    let negative: f64 = kernel.iter().map(|w| (-w).max(0.0)).sum();
    let unit = |&w: &f64| {
        if w > 0.0 {
            w / positive
        } else if w < 0.0 {
            w / negative
        } else {
            0.0
        }
    };
    kernel.iter().map(|w| unit(w) as f32).collect()
}

fn scaled(kernel: &[f64], factor: f64) -> Vec<f64> {
    kernel.iter().map(|w| w * factor).collect()
}

fn narrowed(kernel: &[f64]) -> Vec<f32> {
    kernel.iter().map(|&w| w as f32).collect()
}

/// Returns the HyAB distance raised to q_c.
fn colour_difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    hyab(a, b).powf(COLOUR_EXPONENT)
}

/// Returns the maximum colour difference in the gamut: pure green against pure blue.
fn greatest_colour_difference() -> f32 {
    let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt_lab_from_linear);
    colour_difference(green, blue)
}

/// Redistributes errors: maps [0, `greatest`] to [0, 1], linear on both sides of the knee.
fn redistribute(difference: f32, greatest: f32) -> f32 {
    let knee = KNEE * greatest;
    if difference < knee {
        difference * (KNEE_ERROR / knee)
    } else {
        KNEE_ERROR + (difference - knee) / (greatest - knee) * (1.0 - KNEE_ERROR)
    }
}

/// Returns the maximum of the edge and point differences, scaled to [0, 1] and raised to q_f = 1/2.
fn feature_difference([edge0, point0]: [f32; 2], [edge1, point1]: [f32; 2]) -> f32 {
    let difference = (edge0 - edge1).abs().max((point0 - point1).abs());
    (difference * std::f32::consts::FRAC_1_SQRT_2).sqrt()
}

#[cfg(test)]
#[path = "flip_tests.rs"]
mod tests;
