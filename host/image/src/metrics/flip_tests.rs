//! Tests of LDR-FLIP against values derived by hand, and a check that the feature term matters.

use super::*;

fn flip_uniform(a: [f32; 3], b: [f32; 3]) -> FlipMap {
    let (a, b) = ([a; 35], [b; 35]);
    let a = ImageView::new(7, 5, &a).unwrap();
    let b = ImageView::new(7, 5, &b).unwrap();
    flip(&a, &b).unwrap()
}

/// Returns an image of a vertical step, and one with the step one column further.
fn steps(width: usize, height: usize) -> [Vec<[f32; 3]>; 2] {
    [width / 2, width / 2 + 1].map(|edge| {
        let value = |i: usize| if i % width < edge { 0.1 } else { 0.6 };
        (0..width * height).map(|i| [value(i); 3]).collect()
    })
}

#[test]
fn identical_images_have_no_error() {
    let [pixels, _] = steps(19, 11);
    let view = ImageView::new(19, 11, &pixels).unwrap();
    let map = flip(&view, &view).unwrap();
    assert!(map.errors.iter().all(|&e| e == 0.0));
    assert_eq!((map.width, map.height, map.mean), (19, 11, 0.0));
}

#[test]
fn green_against_blue_is_the_greatest_error() {
    let map = flip_uniform([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    assert!(map.errors.iter().all(|&e| (1.0 - e).abs() < 1e-5), "{}", map.mean);
}

#[test]
fn black_against_white() {
    // Uniform images have no features, and their HyAB distance is 100. The
    // maximum distance is that of green (87.74, -75.61, 72.98) and blue
    // (32.30, 25.58, -34.84), Hunt-adjusted: 203.30.
    let greatest = 203.30_f32.powf(0.7);
    let knee = 0.4 * greatest;
    let expected = 0.95 + 0.05 * (100_f32.powf(0.7) - knee) / (greatest - knee);
    let map = flip_uniform([0.0; 3], [1.0; 3]);
    assert!(map.errors.iter().all(|&e| (e - expected).abs() < 1e-5), "{} {expected}", map.mean);
}

#[test]
fn the_error_is_symmetric() {
    let [a, b] = steps(16, 9);
    let a = ImageView::new(16, 9, &a).unwrap();
    let b = ImageView::new(16, 9, &b).unwrap();
    assert_eq!(flip(&a, &b), flip(&b, &a));
    assert!(flip(&a, &b).unwrap().mean > 0.0);
}

#[test]
fn a_shifted_step_is_worst_where_it_moved() {
    let [a, b] = steps(40, 6);
    let a = ImageView::new(40, 6, &a).unwrap();
    let b = ImageView::new(40, 6, &b).unwrap();
    let map = flip(&a, &b).unwrap();
    // Both filters have a radius below 11 pixels, so nothing differs beyond.
    for row in map.errors.chunks(40) {
        let worst = (0..40).max_by(|&i, &j| row[i].total_cmp(&row[j])).unwrap();
        assert!((19..=21).contains(&worst), "{worst}");
        assert_eq!((row[0], row[39]), (0.0, 0.0));
    }
}

#[test]
fn values_outside_the_display_range_are_clamped() {
    let map = flip_uniform([7.0, -3.0, 1.0], [1.0, 0.0, 1e30]);
    assert_eq!(map.mean, 0.0);
}

#[test]
fn one_pixel() {
    let view = |pixels| ImageView::new(1, 1, pixels).unwrap();
    assert_eq!(flip(&view(&[[0.3; 3]]), &view(&[[0.3; 3]])).unwrap().mean, 0.0);
    let large = flip_uniform([0.0; 3], [1.0; 3]).mean;
    let small = flip(&view(&[[0.0; 3]]), &view(&[[1.0; 3]])).unwrap().mean;
    assert!((large - small).abs() < 1e-5);
}

#[test]
fn a_non_finite_pixel_has_error_one_and_harms_no_neighbour() {
    let good = [[0.4; 3]; 25];
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut bad = good;
        bad[12][1] = value;
        let good = ImageView::new(5, 5, &good).unwrap();
        let bad = ImageView::new(5, 5, &bad).unwrap();
        let map = flip(&bad, &good).unwrap();
        for (i, &e) in map.errors.iter().enumerate() {
            assert_eq!(e, if i == 12 { 1.0 } else { 0.0 });
        }
        assert_eq!(map, flip(&good, &bad).unwrap());
    }
}

#[test]
fn viewing_conditions_outside_the_range_are_errors() {
    let view = ImageView::new(1, 1, &[[0.3; 3]]).unwrap();
    for ppd in [f32::NAN, f32::INFINITY, -67.0, 0.0, 0.99, 1000.1] {
        let error = flip_at(&view, &view, ppd).unwrap_err();
        assert!(matches!(error, MetricsError::PixelsPerDegree(_)));
    }
}

#[test]
fn the_range_ends_give_finite_errors() {
    let [a, b] = steps(8, 3);
    let a = ImageView::new(8, 3, &a).unwrap();
    let b = ImageView::new(8, 3, &b).unwrap();
    for ppd in [1.0, 1000.0] {
        let map = flip_at(&a, &b, ppd).unwrap();
        assert!(map.errors.iter().all(|e| (0.0..=1.0).contains(e)));
    }
}

#[test]
fn kernels_are_normalised() {
    let odd = signed_unit(&sampled(3.0, |x| -x));
    assert!(odd.iter().sum::<f32>().abs() < 1e-6);
    assert!((odd.iter().map(|w| w.abs()).sum::<f32>() - 2.0).abs() < 1e-6);
    let flat = Plane::new(3, vec![0.7; 9]);
    for gaussians in [&CSF_Y[..], &CSF_CX[..], &CSF_CZ[..]] {
        let filtered = csf_filter(&flat, gaussians, 67.0);
        assert!(filtered.samples().iter().all(|s| (s - 0.7).abs() < 1e-6));
    }
}

/// Negative control of the comparison with NVIDIA's code in tests/images/flip.rs: without the
/// feature term the map is far outside its tolerance.
#[test]
fn the_feature_term_counts() {
    let [a, b] = steps(40, 6);
    let a = ImageView::new(40, 6, &a).unwrap();
    let b = ImageView::new(40, 6, &b).unwrap();
    let ppd = f64::from(DEFAULT_PIXELS_PER_DEGREE);
    let colours = [(&a, &b), (&b, &a)].map(|(v, o)| Appearance::new(v, o, ppd).colours);
    let [first, second] = &colours;
    let greatest = greatest_colour_difference();
    let colour_only =
        first.iter().zip(second).map(|(&p, &q)| redistribute(colour_difference(p, q), greatest));
    let map = flip(&a, &b).unwrap();
    let deviation = map.errors.iter().zip(colour_only).map(|(e, c)| (e - c).abs()).fold(0.0, f32::max);
    assert!(deviation > 0.05, "{deviation}");
}
