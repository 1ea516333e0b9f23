//! Handlers of SIGINT, which people send, and SIGTERM, which queues and mpirun send.
//!
//! SIGHUP keeps its disposition: `nohup` sets it to be ignored.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Exit code of an interrupted command, as shells report SIGINT.
pub const INTERRUPTED: i32 = 130;

/// Returns a flag that the first signal sets; the second one ends the process.
pub fn interrupts() -> Arc<AtomicBool> {
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order, so that the first signal does not see the flag set. If registering fails,
        // the signal ends the process, which is its default.
        let _ = register_conditional_shutdown(signal, INTERRUPTED, interrupted.clone())
            .and_then(|_| register(signal, interrupted.clone()));
    }
    interrupted
}

/// Returns a flag that every signal sets: a rank gets it twice if both a terminal and mpirun send
/// it, and mpirun ends it in any case. SIGHUP ends a rank, and thereby the job.
#[cfg(feature = "mpi")]
pub fn noted() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        let _ = register(signal, flag.clone());
    }
    flag
}
