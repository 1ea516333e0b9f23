#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::super::chart::{Axis, Point};
use super::*;

fn plot() -> Plot {
    let mut extrapolated = Series::measured("second <&>", 1, [(10.0, 3.0), (1e6, 30.0)]);
    extrapolated.points.push(Point { x: 1e5, y: f64::NAN, hollow: true });
    let more = (3usize..8)
        .map(|index| Series::measured(&format!("series {index}"), index - 1, [(1e3, index as f64)]));
    let first = Series::measured("first", 0, [(10.0, 1.0), (1e3, 200.0)]);
    Plot {
        title: "Speed-up of methods".to_owned(),
        notes: vec!["device".to_owned(), "y = 1 + 2 x, R² = 0.9".to_owned()],
        x: Axis::log("spheres"),
        y: Axis::log("speed-up, ×"),
        series: [first, extrapolated].into_iter().chain(more).collect(),
    }
}

fn bars() -> Bars {
    let bars = vec![("book".to_owned(), 1234.5), ("empty".to_owned(), f64::NAN)];
    Bars { title: "GPU".to_owned(), notes: Vec::new(), label: "times as fast".to_owned(), bars }
}

fn charts() -> [Chart; 3] {
    let nothing = Plot { series: Vec::new(), ..plot() };
    [Chart::Plot(plot()), Chart::Bars(bars()), Chart::Plot(nothing)]
}

/// Returns the share of the pixels that are not white.
fn ink(png: &[u8]) -> f64 {
    let image = image::load_from_memory(png).unwrap().into_rgb8();
    assert_eq!(image.dimensions(), (SIZE.0 * PNG_SCALE, SIZE.1 * PNG_SCALE));
    let dark = image.pixels().filter(|pixel| pixel.0 != [255; 3]).count();
    dark as f64 / f64::from(image.width() * image.height())
}

#[test]
fn the_same_picture_each_time() {
    for chart in charts() {
        assert_eq!(svg(&chart).unwrap(), svg(&chart).unwrap());
        assert_eq!(png(&chart).unwrap(), png(&chart).unwrap());
    }
}

#[test]
fn all_words_and_marks_are_there() {
    let text = svg(&Chart::Plot(plot())).unwrap();
    for words in [
        "Speed-up of methods",
        "R² = 0.9",
        "speed-up, ×",
        "spheres",
        "10⁴",
        "second &lt;&amp;&gt;",
        "series 7",
    ] {
        assert!(text.contains(words), "{words:?} in {text}");
    }
    assert!(!text.contains("NaN"), "{text}");
    for color in &COLORS[..7] {
        let hex = format!("#{:02X}{:02X}{:02X}", color.0, color.1, color.2);
        assert!(text.contains(&hex), "{hex} in {text}");
    }
    let text = svg(&Chart::Bars(bars())).unwrap();
    assert!(text.contains("1234") && text.contains("times as fast"), "{text}");
}

/// A bitmap without text has less ink, so the font draws letters.
#[test]
fn bitmaps_have_letters() {
    let full = plot();
    let silent = Plot { title: String::new(), notes: vec![String::new(); 2], ..plot() };
    assert!(ink(&png(&Chart::Plot(full)).unwrap()) > ink(&png(&Chart::Plot(silent)).unwrap()) + 1e-3);
}
