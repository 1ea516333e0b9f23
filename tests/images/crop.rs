//! A part of an image shows what the whole shows there.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use glam::DVec3;
use trisect::film::Film;
use trisect::render::{Renderer, Settings};
use trisect::scene::CameraPose;
use trisect_tests::renders::film;
use trisect_tests::{BackendUnderTest, for_each_backend, scene};

for_each_backend!(a_part_shows_its_place);

/// Columns and rows of the part.
const PART: (std::ops::Range<u32>, std::ops::Range<u32>) = (13..45, 20..52);

/// Returns the mean positions that the pixels of a part see, row by row; the part begins at a pixel
/// of the film.
fn positions(film: &Film, (x, y): (u32, u32)) -> Vec<DVec3> {
    let all: Vec<DVec3> = film.aovs.iter().map(|aov| DVec3::from(aov.position())).collect();
    let (width, height) = (PART.0.len() as u32, PART.1.len() as u32);
    let place = |(row, column): (u32, u32)| ((y + row) * film.width + x + column) as usize;
    (0..height).flat_map(|row| (0..width).map(move |column| (row, column))).map(|at| all[place(at)]).collect()
}

/// Returns the mean distance of positions, in units of the distance between neighbours. Pixels
/// that see an edge or no surface are far from their neighbours in both, so medians are compared.
fn offset(part: &[DVec3], of_whole: &[DVec3]) -> f64 {
    let median = |mut values: Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let apart = part.iter().zip(of_whole).map(|(a, b)| a.distance(*b)).collect();
    let step = of_whole.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
    median(apart) / median(step)
}

fn check(renderer: &mut Renderer, whole: &Settings) {
    let part = whole.clone().cropped(PART.0, PART.1).unwrap();
    let (film_of_whole, film_of_part) = (film(renderer, whole), film(renderer, &part));
    assert_eq!((film_of_part.width, film_of_part.height), (32, 32));
    let seen = positions(&film_of_part, (0, 0));
    // A mean of 64 places in a pixel is off by a twentieth of a pixel.
    let off = offset(&seen, &positions(&film_of_whole, (13, 20)));
    assert!(off < 0.2, "{off} pixels");
    // Negative control: the part beside it.
    let off = offset(&seen, &positions(&film_of_whole, (14, 20)));
    assert!(off > 0.8, "negative control not detected: {off} pixels");
}

fn a_part_shows_its_place(subject: BackendUnderTest) {
    let scene = scene("cornell_box.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let of_scene = Settings::of(&scene);
    let whole =
        Settings { width: 64, height: 64, samples: 64, depth: 1, guides: true, tile: Some(8), ..of_scene };
    check(&mut renderer, &whole);
    renderer.set_camera(CameraPose { parallel_height: 500.0, ..scene.camera }).unwrap();
    check(&mut renderer, &whole);
}
