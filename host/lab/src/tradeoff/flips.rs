//! Computes FLIP of several images, and ends between two of them if the measurement is to end.

use super::supervisor::{Supervisor, check};
use crate::Error;
use crate::accuracy::{Truth, view};
use trisect::image::Image;

/// Returns the mean LDR-FLIP of each of the first `count` images, and the FLIP errors of the first
/// one. Returns [`Error::Cancelled`] if the supervisor ends the measurement between two of them.
pub(super) fn flips(
    images: &[Image],
    truth: &Truth,
    count: usize,
    supervisor: &dyn Supervisor,
) -> Result<(Vec<f64>, Vec<f32>), Error> {
    let (mut means, mut first) = (Vec::new(), Vec::new());
    for image in images.iter().take(count.max(1)) {
        check(supervisor)?;
        let map = truth.seen.flip(&view(image))?;
        if means.is_empty() {
            first = map.errors;
        }
        means.push(map.mean);
    }
    means.truncate(count);
    Ok((means, first))
}
