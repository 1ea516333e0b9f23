//! Waiting threads that spin: they notice an event at once, but keep a processor from others. On a
//! loaded host they are worse than threads that sleep, which the scheduler lets run when they wake.

use std::time::Duration;
use web_time::Instant;

/// Gap between two looks of a thread that spins from which another thread had its processor.
pub const GAP: Duration = Duration::from_micros(500);

/// Time after such a gap for which the host counts as loaded.
const RESPITE: Duration = Duration::from_secs(1);

/// Decides whether a thread that waits may spin, by what it saw when it did.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpinGuard {
    loaded_until: Option<Instant>,
}

impl SpinGuard {
    /// Returns whether the thread may spin: the host is not known to be loaded.
    pub fn may_spin(&self) -> bool {
        self.loaded_until.is_none_or(|until| until < Instant::now())
    }

    /// Takes the time between two looks of a thread that spins. Returns whether another thread had
    /// its processor.
    pub fn saw_gap(&mut self, gap: Duration) -> bool {
        let lost = gap > GAP;
        if lost {
            self.loaded_until = Some(Instant::now() + RESPITE);
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_processor_ends_spinning_for_a_while() {
        let mut guard = SpinGuard::default();
        assert!(guard.may_spin() && !guard.saw_gap(GAP) && guard.may_spin());
        assert!(guard.saw_gap(2 * GAP) && !guard.may_spin());
        guard.loaded_until = Some(Instant::now());
        std::thread::sleep(Duration::from_millis(1));
        assert!(guard.may_spin());
    }
}
