//! Tests of [`compare`] and of the input checks.

use super::*;

fn compare_pixels(width: usize, a: &[[f32; 3]], b: &[[f32; 3]]) -> Comparison {
    let height = a.len() / width;
    let a = ImageView::new(width, height, a).unwrap();
    let b = ImageView::new(width, height, b).unwrap();
    compare(&a, &b).unwrap()
}

fn assert_close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-6 * b.abs().max(1e-3), "{a} != {b}");
}

#[test]
fn identical_images_do_not_differ() {
    let pixels = [[0.1, 0.2, 0.3], [4.0, 0.0, -1.0], [0.5; 3], [1e30; 3]];
    let c = compare_pixels(2, &pixels, &pixels);
    assert_eq!((c.rmse, c.rel_mse, c.flip_mean, c.max_difference), (0.0, 0.0, 0.0, 0.0));
    assert_eq!(c.psnr_db, f64::INFINITY);
    assert_eq!((c.max_pixel, c.non_finite), ((0, 0), 0));
    assert_eq!(c.mean_a, c.mean_b);
}

#[test]
fn figures_by_hand() {
    let a = [[0.5, 0.0, 0.0], [1.0, 1.0, 1.0]];
    let b = [[0.3, 0.0, 0.0], [1.0, 1.0, 0.0]];
    let c = compare_pixels(2, &a, &b);
    // Six samples; two differ: 0.2 against 0.3, and 1 against 0.
    assert_close(c.rmse, ((0.04 + 1.0_f64) / 6.0).sqrt());
    assert_close(c.rel_mse, (0.04 / 0.10 + 1.0 / 0.01) / 6.0);
    assert_eq!((c.max_difference, c.max_pixel), (1.0, (1, 0)));
    assert_close(c.mean_a[0], 0.75);
    assert_close(c.mean_b[0], 0.65);
    assert_close(c.mean_b[2], 0.0);
}

#[test]
fn psnr_of_black_against_white_is_zero() {
    let c = compare_pixels(1, &[[0.0; 3]], &[[1.0; 3]]);
    assert!(c.psnr_db.abs() < 1e-5, "{}", c.psnr_db);
}

#[test]
fn psnr_of_a_known_display_difference() {
    // Encoded values 0.5 and 0.6 give 20 dB below the peak of 1.
    let (a, b) = (srgb::decode(0.5), srgb::decode(0.6));
    let c = compare_pixels(1, &[[a; 3]], &[[b; 3]]);
    assert!((c.psnr_db - 20.0).abs() < 1e-4, "{}", c.psnr_db);
}

#[test]
fn psnr_ignores_what_the_display_clips() {
    let c = compare_pixels(1, &[[3.0, -2.0, 0.5]], &[[5.0, 0.0, 0.5]]);
    assert_eq!(c.psnr_db, f64::INFINITY);
    assert_eq!(c.max_difference, 2.0);
}

#[test]
fn max_pixel_is_the_first_of_equals() {
    let mut a = [[0.0; 3]; 12];
    (a[5][1], a[6][0], a[10][2]) = (2.0, -2.0, 2.0);
    let c = compare_pixels(4, &a, &[[0.0; 3]; 12]);
    assert_eq!((c.max_difference, c.max_pixel), (2.0, (1, 1)));
}

#[test]
fn non_finite_pixels_are_counted_and_left_out() {
    let a = [[f32::NAN, 0.0, 0.0], [0.5; 3], [0.25; 3]];
    let b = [[0.5; 3], [0.5; 3], [0.25, f32::INFINITY, 0.25]];
    let c = compare_pixels(3, &a, &b);
    assert_eq!(c.non_finite, 2);
    assert_eq!((c.rmse, c.rel_mse, c.max_difference), (0.0, 0.0, 0.0));
    assert_eq!((c.mean_a, c.mean_b), ([0.5; 3], [0.5; 3]));
    assert_eq!(c.flip_mean, 2.0 / 3.0);
}

#[test]
fn without_finite_pixels_the_figures_are_null() {
    let c = compare_pixels(1, &[[f32::NAN; 3]], &[[1.0; 3]]);
    assert!(c.rmse.is_nan() && c.psnr_db.is_nan() && c.max_difference.is_nan());
    assert_eq!((c.non_finite, c.flip_mean), (1, 1.0));
    let json = serde_json::to_value(&c).unwrap();
    assert!(json["rmse"].is_null() && json["mean_a"][0].is_null());
}

#[test]
fn infinite_psnr_serialises_as_null() {
    let c = compare_pixels(1, &[[0.5; 3]], &[[0.5; 3]]);
    let json = serde_json::to_value(&c).unwrap();
    assert!(json["psnr_db"].is_null());
    assert_eq!(json["rmse"], 0.0);
    assert_eq!(json["max_pixel"], serde_json::json!([0, 0]));
}

#[test]
fn extreme_finite_values_do_not_overflow() {
    let c = compare_pixels(1, &[[f32::MAX; 3]], &[[f32::MIN; 3]]);
    assert!(c.rmse.is_finite() && c.rel_mse.is_finite() && c.flip_mean.is_finite());
}

#[test]
fn a_wrong_pixel_count_is_an_error() {
    let pixels = [[0.0; 3]; 5];
    let error = ImageView::new(2, 3, &pixels).unwrap_err();
    assert_eq!(error, MetricsError::PixelCount { width: 2, height: 3, actual: 5 });
    assert!(ImageView::new(usize::MAX, 2, &pixels).is_err());
    assert_eq!(ImageView::new(0, 3, &[]).unwrap_err(), MetricsError::Empty { width: 0, height: 3 });
}

#[test]
fn a_view_built_by_hand_is_checked_again() {
    let pixels = [[0.0; 3]; 5];
    let sound = ImageView::new(5, 1, &pixels).unwrap();
    let broken = ImageView { width: 3, height: 2, pixels: &pixels };
    assert!(matches!(compare(&broken, &sound), Err(MetricsError::PixelCount { .. })));
    assert!(matches!(compare(&sound, &broken), Err(MetricsError::PixelCount { .. })));
}

#[test]
fn different_sizes_are_an_error() {
    // The same number of pixels, so that only the shape tells them apart.
    let pixels = [[0.0; 3]; 6];
    let wide = ImageView::new(3, 2, &pixels).unwrap();
    let tall = ImageView::new(2, 3, &pixels).unwrap();
    let expected = MetricsError::SizeMismatch { image: (3, 2), reference: (2, 3) };
    assert_eq!(compare(&wide, &tall), Err(expected.clone()));
    assert_eq!(flip::flip(&wide, &tall), Err(expected));
}
