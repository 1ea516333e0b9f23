//! Waiting for a stream: a thread that spins notices at once, one that sleeps leaves its processor to
//! others, who then let it run when it wakes.

use super::driver::failed;
use crate::BackendError;
use cudarc::driver::{CudaEvent, DriverError, sys};
use std::time::{Duration, Instant};

/// Time for which a thread spins: waking a thread that sleeps takes a small part of it.
const SPIN: Duration = Duration::from_millis(2);

/// Gap between two looks of a thread that spins from which another thread had its processor.
const GAP: Duration = Duration::from_micros(500);

/// Time after such a gap for which threads do not spin.
const RESPITE: Duration = Duration::from_secs(1);

/// Way of waiting, by what earlier waits found.
#[derive(Default)]
pub(super) struct Waiter {
    /// Time until which the host counts as loaded.
    loaded_until: Option<Instant>,
}

impl Waiter {
    /// Waits for an event that was created to be waited for asleep.
    pub fn wait(&mut self, event: &CudaEvent) -> Result<(), BackendError> {
        let start = Instant::now();
        if self.loaded_until.is_none_or(|until| until < start) {
            self.spin(start, || is_running(event));
        }
        event.synchronize().map_err(failed("running commands"))
    }

    /// Spins while `is_running`, for at most [`SPIN`] and until another thread takes the processor.
    fn spin(&mut self, start: Instant, is_running: impl Fn() -> bool) {
        let mut last = start;
        while is_running() {
            let now = Instant::now();
            if now - last > GAP {
                self.loaded_until = Some(now + RESPITE);
                return;
            }
            if now - start > SPIN {
                return;
            }
            last = now;
            std::hint::spin_loop();
        }
    }
}

/// Returns whether what comes before the event still runs; false after an error.
fn is_running(event: &CudaEvent) -> bool {
    // SAFETY: the event exists.
    let state = unsafe { sys::cuEventQuery(event.cu_event()) }.result();
    state == Err(DriverError(sys::cudaError_enum::CUDA_ERROR_NOT_READY))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// A thread spins until the end, for a short time, or until it loses its processor; then it does
    /// not spin for a while.
    #[test]
    fn spins_are_short() {
        let mut waiter = Waiter::default();
        let looks = Cell::new(0);
        waiter.spin(Instant::now(), || {
            looks.set(looks.get() + 1);
            looks.get() < 10
        });
        // A loaded machine may have ended the spinning.
        assert!(looks.get() == 10 || waiter.loaded_until.is_some());
        let mut waiter = Waiter::default();
        waiter.spin(Instant::now(), || true);
        let mut waiter = Waiter::default();
        waiter.spin(Instant::now(), || {
            std::thread::sleep(2 * GAP);
            true
        });
        assert!(waiter.loaded_until.is_some_and(|until| until > Instant::now()));
    }
}
