//! Handling of the system's limits before the process does anything else: reports an error instead
//! of ending by a signal.

/// Minimum stack of the main thread in bytes; a new shell has 8 MiB.
#[cfg(unix)]
const MIN_STACK: u64 = 1 << 20;

/// Prepares the process for the system's limits.
///
/// - A stack that is too small (`ulimit -s`) is refused.
/// - Writing a file beyond `ulimit -f` returns an error; without this, a signal would end the
///   process.
/// - Running out of memory aborts a Rust program after a message; here it ends with exit code 1.
///
/// # Errors
///
/// The message to print before the process ends with exit code 1.
#[cfg(unix)]
pub fn prepare() -> Result<(), String> {
    use signal_hook::consts::{SIGABRT, SIGXFSZ};
    use signal_hook::flag::{register, register_conditional_shutdown};
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    let stack = rustix::process::getrlimit(rustix::process::Resource::Stack).current;
    if let Some(limit) = stack.filter(|&limit| limit < MIN_STACK) {
        let (limit, needed) = (trisect::memory::display(limit), trisect::memory::display(MIN_STACK));
        return Err(format!(
            "the stack is limited to {limit}, but the program needs {needed}; raise the limit: ulimit -s 8192"
        ));
    }
    // If a handler cannot be installed, the system's default reaction stays; the program still
    // starts.
    let _ = register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    let _ = register_conditional_shutdown(SIGABRT, 1, Arc::new(AtomicBool::new(true)));
    Ok(())
}

/// Prepares the process for the system's limits; nothing to do on this system.
#[cfg(not(unix))]
pub fn prepare() -> Result<(), String> {
    Ok(())
}
