//! Speed of memory, measured once.

use rayon::prelude::*;
use std::sync::OnceLock;
use std::time::Instant;

/// Bytes that a measurement copies: more than caches hold for all threads.
const BYTES: usize = 64 << 20;

/// Bytes that a thread copies at a time.
const PART: usize = 1 << 18;

/// Returns the bytes a second that all threads together read and write when they copy memory. The
/// first call measures it, in some milliseconds, along with whatever else loads the memory then.
pub fn bandwidth() -> f64 {
    static MEASURED: OnceLock<f64> = OnceLock::new();
    *MEASURED.get_or_init(|| {
        let from: Vec<u8> = rayon::iter::repeat_n(1, BYTES).with_min_len(PART).collect();
        let mut to: Vec<u8> = rayon::iter::repeat_n(0, BYTES).with_min_len(PART).collect();
        let start = Instant::now();
        to.par_chunks_mut(PART).zip(from.par_chunks(PART)).for_each(|(to, from)| to.copy_from_slice(from));
        let seconds = start.elapsed().as_secs_f64();
        (to.len() + from.len()) as f64 / seconds.max(1e-9)
    })
}

#[cfg(test)]
mod tests {
    /// From 0.1 to 10,000 GB/s: the unit is right.
    #[test]
    fn it_is_that_of_a_computer() {
        let measured = super::bandwidth();
        assert!((1e8..1e13).contains(&measured), "{measured}");
        assert_eq!(super::bandwidth(), measured);
    }
}
