//! The page of `trisect compare --html`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use trisect::image::Image;
use trisect_lab::page::check;
use trisect_tests::program::{Temporary, trisect};

/// Writes an image of a gradient times `factor`, with one pixel that is `spot`.
fn image(path: &std::path::Path, factor: f32, spot: f32) -> String {
    let (width, height) = (40, 30);
    let mut pixels: Vec<[f32; 3]> =
        (0..width * height).map(|i| [0.2, 0.5, i as f32 / 1200.0].map(|c| factor * c)).collect();
    pixels[99][1] = spot;
    Image { width, height, pixels }.save(path).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Returns the text of a page, which must be well-formed.
fn page(path: &str) -> String {
    let page = fs::read_to_string(path).unwrap();
    check(&page).unwrap_or_else(|fault| panic!("{fault}"));
    page
}

#[test]
fn both_images_their_differences_and_their_figures() {
    let folder = Temporary::new("compare-page", "formats");
    let html = folder.file("page.html");
    let reference = image(&folder.path("reference.exr"), 1.0, 0.5);
    for name in ["a.exr", "a.hdr", "a.pfm", "a.png", "a.jpg"] {
        let file = image(&folder.path(name), 1.1, 0.9);
        let output = trisect(&["compare", &file, &reference, "--html", &html]);
        assert!(output.status.success(), "{name}: {output:?}");
        // The measures are printed as without a page, and the page has them.
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.as_bytes(), trisect(&["compare", &file, &reference]).stdout);
        let page = page(&html);
        assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 4, "{name}");
        for part in ["<th scope=\"row\">relMSE</th>", "image, green", "reference, blue", "magma", "exposure"]
        {
            assert!(page.contains(part), "{name}: {part}");
        }
    }
    // An image far darker than a display shows is exposed.
    let dark = image(&folder.path("dark.exr"), 1e-4, 1e-4);
    assert!(trisect(&["compare", &dark, &dark, "--html", &html]).status.success());
    let dark = page(&html);
    assert!(dark.contains("an exposure of +") && dark.contains("are equal in every pixel."), "{dark}");
}

/// Pixels that are NaN are counted, and the exit code is that of the comparison.
#[test]
fn what_is_not_finite_is_shown() {
    let folder = Temporary::new("compare-page", "nan");
    let html = folder.file("page.html");
    let (file, reference) =
        (image(&folder.path("a.exr"), 1.0, f32::NAN), image(&folder.path("b.exr"), 1.0, 0.5));
    let output = trisect(&["compare", &file, &reference, "--html", &html, "--max-rel-mse", "1"]);
    assert_eq!(output.status.code(), Some(5), "{output:?}");
    assert!(page(&html).contains("One pixel is NaN or infinite"));
}

/// Names are text on the page, whatever they are.
#[test]
#[cfg(unix)]
fn names_are_text() {
    let folder = Temporary::new("compare-page", "names");
    let html = folder.file("page.html");
    let file = image(&folder.path("<script>alert('1')<\"&.exr"), 1.0, 0.5);
    assert!(trisect(&["compare", &file, &file, "--html", &html]).status.success());
    let page = page(&html);
    assert_eq!(page.matches("<script>").count(), 1);
    assert!(page.contains("&lt;script&gt;alert(&#39;1&#39;)&lt;&quot;&amp;.exr"));
}

/// A page does not replace an image that is compared, and a folder that is missing is named before
/// the images are compared.
#[test]
fn the_page_has_a_place_of_its_own() {
    let folder = Temporary::new("compare-page", "conflict");
    let file = image(&folder.path("a.exr"), 1.0, 0.5);
    let other = image(&folder.path("b.exr"), 1.0, 0.6);
    let before = fs::read(&file).unwrap();
    for html in [&file, &other] {
        let output = trisect(&["compare", &file, &other, "--html", html]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("--html") && said.contains("ends in .html"), "{said}");
    }
    assert_eq!(fs::read(&file).unwrap(), before);
    let missing = folder.path("none/page.html");
    let output = trisect(&["compare", &file, &other, "--html", missing.to_str().unwrap()]);
    assert!(output.status.code() == Some(1) && output.stdout.is_empty(), "{output:?}");
}
