//! The supported ranges: a scene in another space shows the same image, and each limit of
//! `trisect check` is where the error begins.
//!
//! Each limit is tested on both sides. Beyond it, the predicted error is compared with one that is
//! measured against f64 or in a render. A scene within the limit is the negative control: it has no
//! finding, and no such error.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

mod camera;
mod ends;
mod geometry;
mod light;
mod notes;
mod optics;
mod program;
mod scenes;
mod spaces;

use glam::DVec3;
use trisect::precision::{Finding, Limit, RELATIVE, check};
use trisect::scene::SceneDocument;
use trisect_shared::math::unit_f32;
use trisect_shared::rng::PathKey;

/// Parses a scene of these fields, with a camera if they have none.
fn described(rest: &str) -> SceneDocument {
    let camera = "camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40)";
    let camera = if rest.contains("camera:") { "" } else { camera };
    let text = format!("Scene(version: 1, image: (width: 8, height: 8, samples: 4), {camera}, {rest})");
    SceneDocument::parse(&text.replace(", ,", ","), "test.ron").unwrap()
}

/// Parses a scene of objects of one grey material.
fn grey(objects: &str) -> SceneDocument {
    described(&format!(
        "materials: {{ \"grey\": Lambertian(albedo: (0.5, 0.5, 0.5)) }}, objects: [{objects}]"
    ))
}

/// Returns the findings of one kind.
fn found(scene: &SceneDocument, limit: Limit) -> Vec<Finding> {
    let report = check(scene, &scene.image);
    report.findings.into_iter().filter(|finding| finding.limit == limit).collect()
}

/// Returns an error unless the only finding of a kind predicts the measured error within the factor
/// of 4 that `trisect::precision::Predicted` promises. Without a finding, the error must be within
/// the tolerance.
fn agrees(scene: &SceneDocument, limit: Limit, measured: f64) -> Result<(), String> {
    match &found(scene, limit)[..] {
        [] if measured < RELATIVE => Ok(()),
        [one] => {
            let ratio = measured / one.predicted.value;
            if (0.25..=4.0).contains(&ratio) { Ok(()) } else { Err(format!("{measured:e} for {one}")) }
        }
        other => Err(format!("{measured:e}: {other:?}")),
    }
}

/// Generator of uniform random numbers from 0 to 1 in f64, of 48 bits.
struct Random(u32);

impl Random {
    fn number(&mut self) -> f64 {
        self.0 += 1;
        let words = PathKey { seed: 11, pixel: self.0, sample: 0 }.words(0);
        f64::from(unit_f32(words.x)) + f64::from(unit_f32(words.y)) / f64::from(1 << 24)
    }

    /// Returns a point in the unit cube.
    fn point(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.point() * 2.0 - 1.0;
            if (0.01..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

/// Returns the root mean square and the maximum of errors.
fn spread(errors: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (mut squares, mut greatest, mut count) = (0.0, 0.0f64, 0);
    for error in errors {
        squares += error * error;
        greatest = greatest.max(error.abs());
        count += 1;
    }
    assert!(count > 100, "{count} measurements");
    ((squares / f64::from(count)).sqrt(), greatest)
}

/// Negative control of all comparisons with a prediction: an error 16 times as large or small, an
/// error without a finding, and a finding without an error.
#[test]
fn predictions_can_be_wrong() {
    let far = grey("Sphere(center: (1e6, 1e6, 1e6), radius: 1, material: \"grey\")");
    let predicted = found(&far, Limit::FarFromOrigin)[0].predicted.value;
    let agrees = |scene: &SceneDocument, measured| agrees(scene, Limit::FarFromOrigin, measured);
    assert!(agrees(&far, predicted).is_ok() && agrees(&grey(""), 0.5 * RELATIVE).is_ok());
    assert!(agrees(&far, 16.0 * predicted).is_err() && agrees(&far, predicted / 16.0).is_err());
    assert!(agrees(&grey(""), 2.0 * RELATIVE).is_err());
}
