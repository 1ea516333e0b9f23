//! Tests flicker on frames whose errors are known.

use super::*;
use crate::evaluate::Times;
use trisect_shared::math::unit_f32;
use trisect_shared::rng::PathKey;

const SIZE: (u32, u32) = (48, 40);

const FRAMES: u32 = 6;

/// Returns the true value of a pixel in a frame: a slope that moves.
fn true_value(frame: u32, pixel: u32, c: usize) -> f64 {
    0.3 + 0.01 * f64::from((pixel + 3 * frame) % SIZE.0) + 0.1 * c as f64
}

/// Returns frames with an error that a function makes of seed, pixel and channel; `seed` returns
/// the seed of a frame.
fn frames(size: f64, seed: impl Fn(u32) -> u32) -> Vec<Image> {
    let frame = |frame: u32| {
        let value = |pixel: u32, c: usize| {
            let word = PathKey { seed: seed(frame), pixel, sample: c as u32 }.words(3).x;
            true_value(frame, pixel, c) + size * (2.0 * f64::from(unit_f32(word)) - 1.0)
        };
        let pixel = |pixel: u32| std::array::from_fn(|c| value(pixel, c) as f32);
        Image { width: SIZE.0, height: SIZE.1, pixels: (0..SIZE.0 * SIZE.1).map(pixel).collect() }
    };
    (0..FRAMES).map(frame).collect()
}

fn found(images: Vec<Image>) -> Result<FramesRow, EvaluateError> {
    let set = ImageSet::new("set", images, Times::default());
    evaluate_frames(&[set], &frames(0.0, |_| 0)).map(|mut found| found.rows.remove(0))
}

/// Independent noise flickers by the sum of the errors of both frames; errors that stand still do
/// not, although they are as large; errors that turn their sign flicker twice as much.
#[test]
fn flicker_tells_noise_from_what_stands_still() {
    let independent = found(frames(0.1, |frame| frame)).unwrap();
    let still = found(frames(0.1, |_| 7)).unwrap();
    assert!((independent.rel_mse / still.rel_mse - 1.0).abs() < 0.05);
    assert!((independent.flicker_ratio - 1.0).abs() < 0.05, "{independent:?}");
    assert!((independent.flicker / (2.0 * independent.rel_mse) - 1.0).abs() < 0.1, "{independent:?}");
    assert!(still.flicker_ratio < 1e-6, "{still:?}");
    assert_eq!((still.each.len(), still.flicker_each.len()), (FRAMES as usize, FRAMES as usize - 1));
    let mut turned = frames(0.1, |_| 7);
    for (frame, image) in turned.iter_mut().enumerate().filter(|(frame, _)| frame % 2 == 1) {
        for (index, pixel) in image.pixels.iter_mut().enumerate() {
            for (c, value) in pixel.iter_mut().enumerate() {
                *value = 2.0 * true_value(frame as u32, index as u32, c) as f32 - *value;
            }
        }
    }
    assert!((found(turned).unwrap().flicker_ratio - 2.0).abs() < 1e-3);
}

#[test]
fn frames_that_do_not_fit_are_refused() {
    let is = |images: Vec<Image>, words: &str| {
        let message = found(images).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    };
    let good = || frames(0.1, |frame| frame);
    is(good()[..5].to_vec(), "set: 5 frames, but the reference has 6");
    is(frames(0.0, |_| 0), "equal to reference, frame 1");
    let mut bad = good();
    bad[3].pixels[5][1] = f32::NAN;
    is(bad, "set, image 4: NaN or infinite");
    let mut bad = good();
    bad[2] = Image { width: 2, height: 1, pixels: vec![[0.0; 3]; 2] };
    is(bad, "set, image 3: 2x1 pixels");
    let one = frames(0.0, |_| 0).remove(0);
    let message = evaluate_frames(&[], &[one]).unwrap_err().to_string();
    assert!(message.contains("the reference: 1 of at least 2 frames"), "{message}");
    // Negative control.
    assert!(found(good()).is_ok());
}
