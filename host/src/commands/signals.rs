//! SIGINT, by people, and SIGTERM, by queues and mpirun. SIGHUP stays as it is: `nohup` has it ignored.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Exit code of what the user ended, as shells give it for an interrupt.
pub const INTERRUPTED: i32 = 130;

/// Sets a flag at the first, and ends the process at the second.
pub fn interrupts() -> Arc<AtomicBool> {
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds no flag yet. What cannot be registered ends the process, as it does without.
        let _ = register_conditional_shutdown(signal, INTERRUPTED, interrupted.clone())
            .and_then(|_| register(signal, interrupted.clone()));
    }
    interrupted
}

/// Sets a flag. SIGHUP ends a rank, and by that the job. A rank gets a second one where a terminal and mpirun both send it, and is ended by mpirun anyway.
#[cfg(feature = "mpi")]
pub fn noted() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        let _ = register(signal, flag.clone());
    }
    flag
}
