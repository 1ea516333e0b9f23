//! What the system's limits do to this process, before it does anything: an error that says so
//! instead of a signal.

/// Bytes of stack that the main thread needs; a new shell has 8 MiB.
#[cfg(unix)]
const MIN_STACK: u64 = 1 << 20;

/// Prepares the process for limits.
///
/// - A stack that is too small (`ulimit -s`) is refused.
/// - Files beyond `ulimit -f` are errors of writing, where the signal would end the process.
/// - Memory that is not there, which aborts a Rust program after a message, ends it with exit code
///   1.
///
/// # Errors
///
/// What to say before the process ends with exit code 1.
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
            "the stack may have {limit}, and the program needs {needed}; allow more: ulimit -s 8192"
        ));
    }
    // Without them the system's own reaction stays, which is no worse than not to start.
    let _ = register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    let _ = register_conditional_shutdown(SIGABRT, 1, Arc::new(AtomicBool::new(true)));
    Ok(())
}

/// Prepares the process for limits; there are none here.
#[cfg(not(unix))]
pub fn prepare() -> Result<(), String> {
    Ok(())
}
