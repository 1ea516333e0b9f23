//! Submissions that were started. A device that can do so begins the next one when the last ends,
//! however late the host's thread wakes.

use super::Renderer;
use crate::Error;
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::Duration;
use trisect_device::Started;
use web_time::Instant;

/// Maximum number of submissions that run while the host prepares another.
const MAX_RUNNING: usize = 1;

/// Submission that may still run.
struct Running {
    started: Started,
    samples: u64,
    since: Instant,
}

/// Totals over submissions that have ended.
#[derive(Clone, Copy, Default)]
pub(super) struct Ended {
    /// Time by the device's timer.
    pub device: Duration,
    pub submissions: u64,
    pub samples: u64,
}

/// Submissions in the order in which they were started.
#[derive(Default)]
pub(super) struct SubmissionQueue {
    running: VecDeque<Running>,
    /// Totals of those that have ended since [`Renderer::begin_submissions`].
    ended: Ended,
    /// Time at which the host saw the last one end.
    last_end: Option<Instant>,
}

impl SubmissionQueue {
    /// Takes a submission of `samples` samples that was started at `since`.
    pub fn push(&mut self, started: Started, samples: u64, since: Instant) {
        self.running.push_back(Running { started, samples, since });
    }

    /// Returns the first submission if it has ended, or if more than `most` are running.
    fn next(&mut self, most: usize) -> Option<Running> {
        let more = self.running.len() > most;
        self.running.pop_front_if(|first| more || first.started.has_ended())
    }
}

impl Renderer {
    /// Waits for submissions that others left, and begins to count anew.
    pub(super) fn begin_submissions(&mut self) -> Result<(), Error> {
        // Their times say nothing about the device's speed: they may have ended long ago.
        for Running { started, .. } in self.take_submissions().running {
            self.uploaded.wait(started)?;
        }
        Ok(())
    }

    /// Takes the submissions, to be waited for later, and begins to count anew.
    pub(super) fn take_submissions(&mut self) -> SubmissionQueue {
        std::mem::take(&mut self.pipeline.queue)
    }

    /// Waits for submissions that were taken. Returns their time by the device's timer.
    pub(super) fn finish_taken(&mut self, taken: SubmissionQueue) -> Result<Duration, Error> {
        let mut device = taken.ended.device;
        for Running { started, samples, .. } in taken.running {
            let time: Duration = self.uploaded.wait(started)?.into_iter().sum();
            device += time;
            // The host may have come late.
            self.pipeline.sizer.learn(samples, time);
        }
        Ok(device)
    }

    /// Waits until the device can take another submission. `watch` gets the number of samples of
    /// all that have ended, after each, and may cancel the render.
    pub(super) fn make_room(&mut self, watch: &mut dyn FnMut(u64) -> ControlFlow<()>) -> Result<(), Error> {
        self.wait_for_submissions(MAX_RUNNING, watch)
    }

    /// Waits for all submissions. Returns what has ended since
    /// [`begin_submissions`](Self::begin_submissions).
    pub(super) fn finish_submissions(
        &mut self,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<Ended, Error> {
        self.wait_for_submissions(0, watch)?;
        Ok(self.pipeline.queue.ended)
    }

    fn wait_for_submissions(
        &mut self,
        most: usize,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<(), Error> {
        while let Some(Running { started, samples, since }) = self.pipeline.queue.next(most) {
            let time: Duration = self.uploaded.wait(started)?.into_iter().sum();
            let queue = &mut self.pipeline.queue;
            let end = Instant::now();
            let begin = queue.last_end.replace(end).map_or(since, |last| last.max(since));
            queue.ended.device += time;
            queue.ended.submissions += 1;
            queue.ended.samples += samples;
            let done = queue.ended.samples;
            self.pipeline.sizer.learn(samples, (end - begin).max(time));
            if watch(done).is_break() {
                return Err(Error::Cancelled);
            }
        }
        Ok(())
    }
}
