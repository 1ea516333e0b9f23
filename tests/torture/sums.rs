//! A pixel's sums within a chunk, on the device, and over chunks, on the host: 21 (also in `films`)
//! and 22.

use glam::UVec4;
use trisect::film::Film;
use trisect::render::SampleBlock;
use trisect_probes::record::{Input, Output, row4, vector};
use trisect_probes::sums::*;
use trisect_shared::film::{CHUNK_SAMPLES, PixelSums};
use trisect_tests::probe::Prober;
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Number of chunks of 2²⁵ samples.
const CHUNKS: u32 = (1 << 25) / CHUNK_SAMPLES;

fn mean(outputs: &[Output], samples: u32) -> f64 {
    let mut film = Film::new(1, 1);
    for (first, output) in (0..).step_by(samples as usize).zip(outputs) {
        let radiance = vector(output.a);
        let part = SampleBlock { rows: 0..1, samples: first..first + samples };
        film.merge(&part, &[PixelSums { radiance, samples, squares: radiance, segments: 0 }]).unwrap();
    }
    film.pixels.exact()[0].mean()[0]
}

/// The mean of 2²⁵ samples of 0.1 is off by at most 1e-6. Each chunk rounds once, by at most 2⁻²⁴
/// relative, and 0.1 as an f32 is off by 1.5e-8.
fn t21_carried_chunks(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let question = Input { a: UVec4::new(0.1f32.to_bits(), CHUNK_SAMPLES, 0, 0), ..Input::default() };
    let questions = vec![question; CHUNKS as usize];
    let outputs = prober.ask("probe_sums", CONSTANT, &questions);
    assert!(outputs.iter().all(|output| output.a.w == CHUNK_SAMPLES));
    let off = (mean(&outputs, CHUNK_SAMPLES) / 0.1 - 1.0).abs();
    assert!(off <= 1e-6, "{off}");
    // Negative control: chunks that are summed in f32 without compensation.
    let plain = prober.ask("probe_sums", PLAIN, &questions[..256]);
    let plain = (mean(&plain, CHUNK_SAMPLES) / 0.1 - 1.0).abs();
    assert!(plain > 1e-6, "negative control not detected: {plain}");
    report(
        21,
        subject,
        Outcome::Passed,
        format!("relative error {off:.1e}; chunks without carry: {plain:.1e}"),
    );
}

/// A large term, 1, and the negative of the large term leave the 1.
fn t22_cancellation(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let large = 16_777_216.0;
    let question = Input { a: row4(large, 1.0, -large, 0.0), b: UVec4::new(3, 0, 0, 0), ..Input::default() };
    let within = mean(&prober.ask("probe_sums", LIST, &[question]), 3);
    assert_eq!(within as f32, 1.0 / 3.0);
    // Three chunks of one term each, in each order.
    let singles = [large, 1.0, -large].map(|x| Input { a: row4(x, 0.0, 0.0, 0.0), b: UVec4::X, ..question });
    let outputs = prober.ask("probe_sums", LIST, &singles);
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        assert_eq!(mean(&order.map(|i| outputs[i]), 1) as f32, 1.0 / 3.0, "{order:?}");
    }
    let plain = mean(&prober.ask("probe_sums", PLAIN_LIST, &[question]), 3);
    assert_ne!(plain as f32, 1.0 / 3.0, "negative control not detected");
    report(22, subject, Outcome::Passed, "mean 0.33333334 within a chunk and over chunks in each order");
}

for_each_route!(t21_carried_chunks, t22_cancellation);
