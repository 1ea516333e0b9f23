//! Division of a chunk into submissions of about 50 ms, so that no driver's watchdog fires and
//! progress is visible.
//!
//! The division does not affect the film's bits: a kernel resumes a pixel's sums where the last
//! submission left them.

use crate::film::RowSet;
use std::time::Duration;
use trisect_device::DeviceKind;

/// Target duration of a submission.
const TARGET_TIME: Duration = Duration::from_millis(50);

/// Sizes submissions by the speed of the device on the current scene.
#[derive(Clone, Debug)]
pub(super) struct SubmissionSizer {
    /// Number of samples for the next submission.
    budget: u64,
    /// Number of pixels that keep the device busy.
    pixels: u64,
    /// Maximum number of samples of a pixel in one submission.
    pixel_samples: u64,
    /// True if the caller has set `budget`, whatever time a submission then takes.
    fixed: bool,
    /// Samples a second of the last submission.
    speed: Option<f64>,
}

impl SubmissionSizer {
    pub(super) fn new(kind: DeviceKind) -> Self {
        // The first budgets are small enough for the slowest device of their kind, and grow up to
        // eightfold a step.
        let (budget, pixels) = match kind {
            DeviceKind::Gpu => (1 << 20, 1 << 20),
            DeviceKind::SoftwareGpu => (1 << 14, 1 << 12),
            DeviceKind::Cpu => (1 << 15, 1 << 13),
        };
        let mut sizer = Self { budget, pixels, pixel_samples: 0, fixed: false, speed: None };
        sizer.set_loop_factor(kind, 1);
        sizer
    }

    /// Divides the samples of a pixel in a submission of a software GPU by `factor`, for kernels
    /// whose paths have longer loops.
    pub(super) fn set_loop_factor(&mut self, kind: DeviceKind, factor: u64) {
        // Mesa's lavapipe ends the loops of a lane after 65,535 iterations, wherever they are.
        self.pixel_samples = match kind {
            DeviceKind::SoftwareGpu => (16 / factor).max(1),
            DeviceKind::Gpu | DeviceKind::Cpu => u64::from(u32::MAX),
        };
    }

    /// Sets the budget, or with `None` lets it follow the device's speed again.
    pub(super) fn limit(&mut self, samples: Option<u64>) {
        self.fixed = samples.is_some();
        self.budget = samples.unwrap_or(self.budget).max(1);
    }

    /// Returns the number of samples for the next submission.
    pub(super) fn budget(&self) -> u64 {
        self.budget
    }

    /// Returns the number of pixels that keep the device busy.
    pub(super) fn pixels(&self) -> u64 {
        self.pixels
    }

    /// Returns the samples a second of the last submission, if there was one.
    pub(super) fn speed(&self) -> Option<f64> {
        self.speed
    }

    /// Adapts the budget to a submission of `samples` samples that took `time`.
    pub(super) fn learn(&mut self, samples: u64, time: Duration) {
        self.speed = Some(samples as f64 / time.as_secs_f64().max(1e-6));
        if self.fixed {
            return;
        }
        let wanted = samples as f64 * TARGET_TIME.as_secs_f64() / time.as_secs_f64().max(1e-6);
        // A small submission says little about a large one, so the budget grows by limited steps.
        let limit = self.budget.max(samples).saturating_mul(8);
        self.budget = (wanted as u64).clamp(1, limit);
    }
}

/// Submission: rows of a share of the image, and samples of the chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Submission {
    /// Share of the image; see [`RowSet::share`].
    pub share: (u32, u32, u32),
    /// First row, by its index in the share.
    pub first_row: u32,
    pub rows: u32,
    /// First sample, from the start of the chunk.
    pub first_sample: u32,
    pub samples: u32,
}

impl Submission {
    /// Returns the number of samples of all its pixels.
    pub(super) fn samples(&self, width: u32) -> u64 {
        u64::from(width) * u64::from(self.rows) * u64::from(self.samples)
    }
}

/// Returns the size of one of the equal parts into which `all` is divided, of about `size`, at most
/// a quarter more. A small rest would leave much of the device idle as its last lanes end.
fn equal_part(all: u64, size: u64) -> u64 {
    let most = size.saturating_add(size / 4).max(1);
    all.div_ceil(all.div_ceil(most).max(1))
}

/// Submissions of one chunk: bands of rows, each finished before the next begins.
pub(super) struct Submissions {
    width: u32,
    share: (u32, u32, u32),
    /// One past the last row, by its index in the share.
    end_row: u32,
    samples: u32,
    first_row: u32,
    rows: u32,
    first_sample: u32,
}

impl Submissions {
    /// Divides `samples` samples of some rows of an image.
    pub(super) fn new(width: u32, rows: impl Into<RowSet>, samples: u32) -> Self {
        let rows = rows.into();
        let (share, own) = (rows.share(), rows.places());
        Self { width, share, end_row: own.end, samples, first_row: own.start, rows: 0, first_sample: 0 }
    }

    pub(super) fn next(&mut self, pace: &SubmissionSizer) -> Option<Submission> {
        if self.first_sample == self.samples {
            self.first_sample = 0;
            self.first_row += self.rows;
        }
        if self.first_row >= self.end_row {
            return None;
        }
        let width = u64::from(self.width);
        let left = self.samples - self.first_sample;
        if self.first_sample == 0 {
            // Enough rows to fill the device; more only if even all samples of those rows are below
            // the budget.
            let least = pace.pixels.div_ceil(width);
            let samples = (pace.budget / (least * width)).clamp(1, u64::from(left));
            let rows = pace.budget / (samples * width);
            self.rows = equal_part(u64::from(self.end_row - self.first_row), rows) as u32;
        }
        let pixels = u64::from(self.rows) * width;
        let samples = equal_part(u64::from(left), (pace.budget / pixels).min(pace.pixel_samples)) as u32;
        let part = Submission {
            share: self.share,
            first_row: self.first_row,
            rows: self.rows,
            first_sample: self.first_sample,
            samples,
        };
        self.first_sample += samples;
        Some(part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Submissions have every sample of every pixel exactly once, in order, however the device's
    /// speed changes.
    #[test]
    fn parts_cover_the_chunk_once() {
        for kind in [DeviceKind::Gpu, DeviceKind::SoftwareGpu, DeviceKind::Cpu] {
            for (width, height, samples) in [(1, 1, 1), (400, 225, 64), (1920, 1080, 256), (7, 1000, 3)] {
                let mut next = vec![0; height as usize];
                let mut pace = SubmissionSizer::new(kind);
                let mut step = 0;
                for rows in [0..height / 3, height / 3..height] {
                    let mut parts = Submissions::new(width, rows, samples);
                    while let Some(part) = parts.next(&pace) {
                        for row in part.first_row..part.first_row + part.rows {
                            assert_eq!(next[row as usize], part.first_sample);
                            next[row as usize] += part.samples;
                        }
                        step += 1;
                        pace.learn(part.samples(width), Duration::from_micros(1 + 77_777 * (step % 3)));
                    }
                }
                assert!(next.iter().all(|&done| done == samples), "{kind:?} {width}x{height}");
            }
        }
    }

    #[test]
    fn a_fast_device_gets_the_whole_chunk_at_once() {
        let mut pace = SubmissionSizer::new(DeviceKind::Gpu);
        for _ in 0..4 {
            pace.learn(pace.budget, Duration::from_micros(pace.budget / 4000));
        }
        let part = Submissions::new(1280, 0..720, 30).next(&pace);
        let share = RowSet::from(0..720).share();
        assert_eq!(part, Some(Submission { share, first_row: 0, rows: 720, first_sample: 0, samples: 30 }));
    }

    /// A chunk that is a little larger than a submission is one, and one that is larger than two is
    /// divided equally.
    #[test]
    fn parts_are_equal() {
        assert_eq!([1, 100, 125, 126, 250, 251].map(|all| equal_part(all, 100)), [1, 100, 125, 63, 125, 84]);
        assert_eq!((equal_part(7, 0), equal_part(0, 5), equal_part(u64::MAX, u64::MAX)), (1, 0, u64::MAX));
        let mut pace = SubmissionSizer::new(DeviceKind::Gpu);
        pace.limit(Some(1920 * 1080 * 110));
        let mut submissions = Submissions::new(1920, 0..1080, 256);
        let sizes: Vec<u64> =
            std::iter::from_fn(|| submissions.next(&pace)).map(|part| part.samples(1920)).collect();
        assert_eq!(sizes, [1920 * 540 * 256; 2]);
    }

    #[test]
    fn a_slow_device_gets_little() {
        let mut pace = SubmissionSizer::new(DeviceKind::SoftwareGpu);
        pace.learn(1000, Duration::from_secs(1));
        let part = Submissions::new(1920, 0..1080, 256).next(&pace).map(|part| part.samples(1920));
        assert_eq!(part, Some(1920)); // a row with one sample
    }
}
