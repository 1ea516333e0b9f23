//! Times the merge of a chunk into a film of 1920x1080 pixels: once for the first chunk, which is
//! copied into the empty film, and as median and minimum for 39 further chunks.
//!
//! ```text
//! cargo run --release -p trisect --example film_merge
//! ```

use std::time::Instant;
use trisect::film::{Film, FilmError, SampleBlock};
use trisect_shared::film::{Compensation, PixelSums};

fn main() -> Result<(), FilmError> {
    let (width, height) = (1920, 1080);
    let mut chunk = vec![PixelSums::ZERO; width as usize * height as usize];
    for (i, sums) in chunk.iter_mut().enumerate() {
        (0..4).for_each(|s| {
            sums.add(
                glam::Vec3::new(0.1, 0.7, 1e-3) * (i % 97 + s) as f32,
                &mut Compensation::ZERO.clone(),
                0,
            )
        });
    }
    let mut film = Film::new(width, height);
    let mut times = Vec::new();
    for first in (0..160).step_by(4) {
        let start = Instant::now();
        film.merge(&SampleBlock { rows: 0..height, samples: first..first + 4 }, &chunk)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let first = times.remove(0);
    times.sort_by(f64::total_cmp);
    println!(
        "first {first:.2} ms, others median {:.2} ms, least {:.2} ms; {} bytes a pixel; mean {:?}",
        times[times.len() / 2],
        times[0],
        Film::BYTES_PER_PIXEL,
        film.pixels.get(1234).map(|pixel| pixel.mean()),
    );
    Ok(())
}
