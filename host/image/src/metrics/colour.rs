//! Colour spaces of the FLIP colour pipeline: linear Rec. 709, YCxCz and Hunt-adjusted CIELAB, with
//! the HyAB distance.
//!
//! All conversions work on XYZ relative to the white point, so that a neutral colour has X = Y = Z
//! and no separate illuminant is needed.

type Matrix<T> = [[T; 3]; 3];

/// Matrix from linear Rec. 709 to white-relative XYZ. Each row sums to 1.
///
/// The numerators are those of the rational sRGB matrix that defines FLIP. Its white, the image of
/// (1, 1, 1), is (0.950429, 1, 1.088900).
const RGB_TO_XYZ: Matrix<f64> = rows_to_unit_sum([
    [10_135_552.0, 8_788_810.0, 4_435_075.0],
    [2_613_072.0, 8_788_810.0, 887_015.0],
    [1_425_312.0, 8_788_810.0, 70_074_185.0],
]);

const RGB_TO_XYZ_F32: Matrix<f32> = narrow(RGB_TO_XYZ);
const XYZ_TO_RGB_F32: Matrix<f32> = narrow(invert(RGB_TO_XYZ));

const fn rows_to_unit_sum(m: Matrix<f64>) -> Matrix<f64> {
    let [a, b, c] = m;
    const fn row([x, y, z]: [f64; 3]) -> [f64; 3] {
        let sum = x + y + z;
        [x / sum, y / sum, z / sum]
    }
    [row(a), row(b), row(c)]
}

/// Returns the inverse by cofactors. The matrix must not be singular.
const fn invert(m: Matrix<f64>) -> Matrix<f64> {
    let [[a, b, c], [d, e, f], [g, h, i]] = m;
    let (p, q, r) = (e * i - f * h, f * g - d * i, d * h - e * g);
    let det = a * p + b * q + c * r;
    [
        [p / det, (c * h - b * i) / det, (b * f - c * e) / det],
        [q / det, (a * i - c * g) / det, (c * d - a * f) / det],
        [r / det, (b * g - a * h) / det, (a * e - b * d) / det],
    ]
}

const fn narrow(m: Matrix<f64>) -> Matrix<f32> {
    const fn row([x, y, z]: [f64; 3]) -> [f32; 3] {
        [x as f32, y as f32, z as f32]
    }
    let [a, b, c] = m;
    [row(a), row(b), row(c)]
}

fn apply(m: &Matrix<f32>, [x, y, z]: [f32; 3]) -> [f32; 3] {
    m.map(|[a, b, c]| a * x + b * y + c * z)
}

/// Converts linear Rec. 709 to YCxCz, the linear opponent space that shares axes and scales with
/// CIELAB: Y in [-16, 100], Cx red-green, Cz blue-yellow.
pub(super) fn ycxcz_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    opponent(apply(&RGB_TO_XYZ_F32, rgb))
}

/// Converts YCxCz to linear Rec. 709. The result may leave [0, 1] for filtered input.
pub(super) fn linear_from_ycxcz([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    apply(&XYZ_TO_RGB_F32, [y + cx / 500.0, y, y - cz / 200.0])
}

/// Converts linear Rec. 709 to CIELAB with a\* and b\* scaled by L\*/100 (the Hunt effect:
/// colourfulness grows with luminance).
pub(super) fn hunt_lab_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    let [l, a, b] = opponent(apply(&RGB_TO_XYZ_F32, rgb).map(lab_compress));
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// Returns the HyAB distance: city-block in lightness plus Euclidean in the chroma plane, which
/// suits large differences better than Euclidean CIELAB.
pub(super) fn hyab([l0, a0, b0]: [f32; 3], [l1, a1, b1]: [f32; 3]) -> f32 {
    (l0 - l1).abs() + ((a0 - a1).powi(2) + (b0 - b1).powi(2)).sqrt()
}

/// Maps XYZ to the axes of YCxCz, or compressed XYZ to those of CIELAB.
fn opponent([x, y, z]: [f32; 3]) -> [f32; 3] {
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Returns the CIELAB compression: a cube root, with a linear toe below (6/29)³.
fn lab_compress(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(a: [f32; 3], b: [f32; 3], tolerance: f32) {
        for (x, y) in a.into_iter().zip(b) {
            assert!((x - y).abs() <= tolerance, "{a:?} != {b:?}");
        }
    }

    #[test]
    fn the_neutral_axis_has_no_chroma() {
        assert_close(ycxcz_from_linear([0.0; 3]), [-16.0, 0.0, 0.0], 1e-4);
        assert_close(ycxcz_from_linear([1.0; 3]), [100.0, 0.0, 0.0], 1e-4);
        assert_close(hunt_lab_from_linear([0.0; 3]), [0.0; 3], 1e-4);
        assert_close(hunt_lab_from_linear([1.0; 3]), [100.0, 0.0, 0.0], 1e-4);
    }

    #[test]
    fn ycxcz_round_trip() {
        for rgb in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.5, 0.9]] {
            assert_close(linear_from_ycxcz(ycxcz_from_linear(rgb)), rgb, 1e-5);
        }
    }

    #[test]
    fn lab_of_the_green_primary() {
        // CIELAB of sRGB green is (87.74, -86.18, 83.18); Hunt scales the
        // chroma by 0.8774.
        let lab = hunt_lab_from_linear([0.0, 1.0, 0.0]);
        assert_close(lab, [87.74, -75.61, 72.98], 0.05);
    }

    #[test]
    fn hyab_is_city_block_then_euclidean() {
        assert_eq!(hyab([10.0, 3.0, 0.0], [8.0, 0.0, 4.0]), 7.0);
    }
}
