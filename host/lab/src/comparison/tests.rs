#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use crate::page::check;
use trisect::metrics::{ImageView, compare_with_map};

const BAD: &str = "<img src=\"http://a\">'&.exr";

fn image(width: u32, height: u32, value: impl Fn(u32) -> f32) -> Image {
    Image { width, height, pixels: (0..width * height).map(|i| [value(i), 0.5, 0.25]).collect() }
}

fn page_of(image: &Image, reference: &Image, is_for_display: bool) -> String {
    let view = |of: &'_ Image| ImageView::new(of.width as usize, of.height as usize, &of.pixels).is_ok();
    assert!(view(image) && view(reference));
    let views = [image, reference].map(|of| ImageView {
        width: of.width as usize,
        height: of.height as usize,
        pixels: &of.pixels,
    });
    let (comparison, flip) = compare_with_map(&views[0], &views[1]).unwrap();
    let named = |image| Named { name: BAD, image, is_for_display };
    let html = page(named(image), named(reference), &comparison, &flip).unwrap();
    check(&html).unwrap_or_else(|fault| panic!("{fault}"));
    html
}

#[test]
fn the_page_has_all_parts() {
    let (a, b) = (image(9, 7, |i| i as f32 / 62.0), image(9, 7, |_| 0.5));
    let html = page_of(&a, &b, false);
    for id in ["image", "reference", "difference", "flip"] {
        assert!(html.contains(&format!("id=\"{id}\" data-name=")), "{id}");
    }
    assert!(html.contains("data-left=\"image\" data-right=\"reference\""));
    assert!(html.contains("differ by a mean FLIP error of 0.") && html.contains("id=\"scale-difference\""));
    assert!(html.contains("9×7 pixels, all of which are shown."));
    assert!(html.contains("Image: &lt;img src=&quot;http://a&quot;&gt;&#39;&amp;.exr"));
    let same = page_of(&a, &a, false);
    assert!(same.contains("are equal in every pixel."));
}

#[test]
fn large_images_are_reduced() {
    let (a, b) = (image(2100, 2, |_| 0.5), image(2100, 2, |i| if i == 5 { 0.75 } else { 0.5 }));
    let html = page_of(&a, &b, true);
    assert!(
        html.contains("2100×2 pixels, shown at 1/3 of the size") && html.contains("width=\"700\""),
        "{html}"
    );
    assert!(html.contains("exposure of 0 EV"));
}

#[test]
fn dark_radiance_is_exposed_and_display_values_are_not() {
    let dark = image(4, 4, |i| 1e-3 * i as f32);
    let dark = Image { pixels: dark.pixels.iter().map(|p| p.map(|c| 0.004 * c)).collect(), ..dark };
    assert!(page_of(&dark, &dark, false).contains("exposure of +"));
    assert!(page_of(&dark, &dark, true).contains("exposure of 0 EV"));
}

#[test]
fn differences_have_signs() {
    let pixel = |r: f32, g: f32| Image { width: 2, height: 1, pixels: vec![[r, g, 0.0], [0.0; 3]] };
    let colors = |a: &Image, b: &Image| Differences::of(a, b, 1).raster.bytes[..3].to_vec();
    let (dark, bright) = (pixel(0.1, 0.1), pixel(0.1, 0.9));
    // Brighter is red, darker is blue, equal is white, NaN is magenta.
    assert_eq!(colors(&bright, &dark), DIVERGING.color(1.0));
    assert_eq!(colors(&dark, &bright), DIVERGING.color(0.0));
    assert_eq!(colors(&dark, &dark), DIVERGING.color(0.5));
    assert_eq!(colors(&pixel(f32::NAN, 0.1), &dark), NOT_FINITE);
    assert_eq!(colors(&pixel(f32::INFINITY, 0.1), &pixel(f32::INFINITY, 0.1)), NOT_FINITE);
    // The greatest difference of a square, not the mean, which one bright pixel would not move.
    let one = Differences::of(&bright, &dark, 2);
    assert_eq!(one.raster.bytes, DIVERGING.color(1.0));
    assert!((one.scale - 0.8).abs() < 1e-6);
}

#[test]
fn pixels_that_are_not_finite_are_said() {
    let (mut a, b) = (image(4, 4, |_| 0.5), image(4, 4, |_| 0.4));
    a.pixels[3][1] = f32::NAN;
    let html = page_of(&a, &b, false);
    assert!(html.contains("One pixel is NaN or infinite in either"), "{html}");
}
