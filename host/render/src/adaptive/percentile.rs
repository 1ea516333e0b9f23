//! Percentile of many numbers, on all threads.

use crate::film::TASK;
use rayon::prelude::*;

/// Number of leading bits by which numbers are counted first.
const LEADING: u32 = 16;

/// Returns the number that this share of the numbers, none of them negative or NaN, are at most;
/// without numbers 0.
pub(super) fn percentile(numbers: &[f32], share: f64) -> f32 {
    let place = ((numbers.len() as f64 * share) as usize).min(numbers.len().saturating_sub(1));
    // The bits of numbers that are not negative are in their order.
    let leading = |number: &f32| (number.to_bits() >> (32 - LEADING)) as usize;
    let counts = numbers.par_chunks(16 * TASK).fold(Vec::new, |mut counts: Vec<usize>, numbers| {
        counts.resize(1 << LEADING, 0);
        for number in numbers {
            if let Some(count) = counts.get_mut(leading(number)) {
                *count += 1;
            }
        }
        counts
    });
    let add = |mut a: Vec<usize>, b: Vec<usize>| {
        if a.is_empty() {
            return b;
        }
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let (mut before, mut bucket) = (0, 0);
    for (index, count) in counts.reduce(Vec::new, add).into_iter().enumerate() {
        bucket = index;
        if before + count > place {
            break;
        }
        before += count;
    }
    let mut own: Vec<f32> =
        numbers.par_iter().with_min_len(TASK).filter(|&number| leading(number) == bucket).copied().collect();
    if own.is_empty() {
        return 0.0;
    }
    let place = place.saturating_sub(before).min(own.len() - 1);
    *own.select_nth_unstable_by(place, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect_shared::math::unit_f32;
    use trisect_shared::rng::PathKey;

    #[test]
    fn as_by_sorting() {
        for count in [1, 2, 99, 100, 101, 5000, 300_000] {
            let number = |pixel: u32| {
                let words = PathKey { seed: 9, pixel, sample: count }.words(0);
                unit_f32(words.x) * 2.0f32.powi((words.y % 80) as i32 - 60)
            };
            let numbers: Vec<f32> = (0..count).map(number).collect();
            let mut sorted = numbers.clone();
            sorted.sort_by(f32::total_cmp);
            for share in [0.0, 0.5, 0.99, 1.0] {
                let place = ((f64::from(count) * share) as usize).min(sorted.len() - 1);
                assert_eq!(percentile(&numbers, share), sorted[place], "{share} of {count}");
            }
        }
        assert_eq!(percentile(&[], 0.99), 0.0);
        assert_eq!(percentile(&[7.0; 1000], 0.99), 7.0);
    }
}
