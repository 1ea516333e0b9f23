//! Waiting for a stream: a thread spins for a short time, if the host lets it, and then sleeps.

use super::driver::failed;
use crate::BackendError;
use cudarc::driver::{CudaEvent, DriverError, sys};
use std::time::Duration;
use trisect_system::spin::SpinGuard;
use web_time::Instant;

/// Time for which a thread spins: waking a thread that sleeps takes a small part of it.
const SPIN: Duration = Duration::from_millis(2);

/// Way of waiting, by what earlier waits found.
#[derive(Default)]
pub(super) struct Waiter {
    guard: SpinGuard,
}

impl Waiter {
    /// Waits for an event that was created to be waited for asleep.
    pub fn wait(&mut self, event: &CudaEvent) -> Result<(), BackendError> {
        if self.guard.may_spin() {
            self.spin(|| is_running(event));
        }
        event.synchronize().map_err(failed("running commands"))
    }

    /// Spins while `is_running`, for at most [`SPIN`] and until another thread takes the processor.
    fn spin(&mut self, is_running: impl Fn() -> bool) {
        let start = Instant::now();
        let mut last = start;
        while is_running() {
            let now = Instant::now();
            if self.guard.saw_gap(now - last) || now - start > SPIN {
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
    use trisect_system::spin::GAP;

    /// A thread spins until the end, for a short time, or until it loses its processor; then it
    /// does not spin for a while.
    #[test]
    fn spins_are_short() {
        let mut waiter = Waiter::default();
        let looks = Cell::new(0);
        waiter.spin(|| {
            looks.set(looks.get() + 1);
            looks.get() < 10
        });
        // A loaded machine may have ended the spinning.
        assert!(looks.get() == 10 || !waiter.guard.may_spin());
        Waiter::default().spin(|| true);
        let mut waiter = Waiter::default();
        waiter.spin(|| {
            std::thread::sleep(2 * GAP);
            true
        });
        assert!(!waiter.guard.may_spin());
    }
}
