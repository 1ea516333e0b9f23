//! Speed at which the host adds chunks, with its processors, its memory and whatever else loads
//! them.

use crate::film::{ExactSum, RadianceTotals, TASK};
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::sync::OnceLock;
use trisect_shared::film::PixelSums;
use web_time::Instant;

/// Number of pixels that a measurement adds: more than caches hold.
const PIXELS: usize = 1 << 19;

/// Number of chunks that a measurement adds, after the first touch of the memory.
const CHUNKS: u32 = 2;

/// Returns the pixels of a chunk that all threads add in a second. The first call measures it.
pub(super) fn adding_speed() -> f64 {
    static MEASURED: OnceLock<f64> = OnceLock::new();
    *MEASURED.get_or_init(|| {
        let chunk = vec![PixelSums::zeroed(); PIXELS];
        let mut totals = vec![RadianceTotals::zeroed(); PIXELS];
        let mut add = || {
            totals.par_iter_mut().zip(&chunk).with_min_len(TASK).for_each(|(totals, sums)| {
                let sums = <[f32; 3]>::from(sums.radiance);
                for (total, sum) in totals.radiance.iter_mut().zip(sums) {
                    total.merge(ExactSum::of_parts(f64::from(sum), 0.0));
                }
                totals.samples += 1;
            });
        };
        add();
        let start = Instant::now();
        (0..CHUNKS).for_each(|_| add());
        PIXELS as f64 * f64::from(CHUNKS) / start.elapsed().as_secs_f64().max(1e-9)
    })
}

#[cfg(test)]
mod tests {
    use super::adding_speed;

    /// From 0.1 million to 100,000 million pixels a second: the unit is right.
    #[test]
    fn it_is_that_of_a_computer() {
        let measured = adding_speed();
        assert!((1e5..1e11).contains(&measured), "{measured}");
        assert_eq!(adding_speed(), measured);
    }
}
