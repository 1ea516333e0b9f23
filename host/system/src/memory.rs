//! Available memory, by which renders, scenes and images are refused before they are allocated.

#[cfg(target_os = "linux")]
mod cgroup;
mod grants;

pub use self::grants::{SMALL, lacking};
#[cfg(target_os = "linux")]
use std::path::Path;

/// Returns the bytes that can be allocated now without swapping: what the system has, within the
/// limits of the control group and of the process (`ulimit -v`, `ulimit -d`). Cached files count as
/// available.
#[cfg(target_os = "linux")]
pub fn available() -> u64 {
    let root = Path::new("/");
    let limits = [cgroup::available(root), of_process(root)];
    limits.into_iter().flatten().fold(system(root), u64::min)
}

/// Bytes that are allocated, in a browser: its module counts them, as WebAssembly's memory never
/// shrinks.
#[cfg(target_family = "wasm")]
pub static ALLOCATED: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);

/// Returns the bytes that can be allocated now: what is left of three quarters of the address
/// space. Memory is fragmented, and browsers may refuse the rest.
#[cfg(target_family = "wasm")]
pub fn available() -> u64 {
    (3_u64 << 30).saturating_sub(ALLOCATED.load(std::sync::atomic::Ordering::Relaxed) as u64)
}

/// Returns the bytes that can be allocated now without swapping.
#[cfg(not(any(target_os = "linux", target_family = "wasm")))]
pub fn available() -> u64 {
    use sysinfo::{MemoryRefreshKind, RefreshKind, System};
    let memory = MemoryRefreshKind::nothing().with_ram();
    System::new_with_specifics(RefreshKind::nothing().with_memory(memory)).available_memory()
}

/// Returns freed memory to the system, where the allocator keeps it for later requests.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "the C library has no safe call")]
pub fn release() {
    // SAFETY: any thread may call it at any time.
    unsafe { libc::malloc_trim(0) };
}

/// Returns freed memory to the system, where the allocator keeps it for later requests.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn release() {}

/// Returns the bytes that the system has for a new process; without `/proc`, the free memory,
/// excluding cached files.
#[cfg(target_os = "linux")]
#[allow(clippy::unnecessary_cast, reason = "these are 32 bits wide on some systems")]
fn system(root: &Path) -> u64 {
    fact(&root.join("proc/meminfo"), "MemAvailable:").unwrap_or_else(|| {
        let facts = rustix::system::sysinfo();
        (facts.freeram as u64 + facts.bufferram as u64).saturating_mul(facts.mem_unit as u64)
    })
}

/// Returns the bytes in a line of `/proc`, such as `MemAvailable:  1024 kB`.
#[cfg(target_os = "linux")]
fn fact(file: &Path, key: &str) -> Option<u64> {
    let facts = std::fs::read_to_string(file).ok()?;
    let fact = facts.lines().find_map(|line| line.strip_prefix(key))?;
    Some(fact.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.saturating_mul(1024))
}

/// Returns the bytes that the process's own limits leave; `None` without a limit.
#[cfg(target_os = "linux")]
fn of_process(root: &Path) -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    left(root, [Resource::As, Resource::Data].map(|resource| getrlimit(resource).current))
}

/// Returns the bytes left of the limits of the address space and of data. If `/proc` does not state
/// how much is in use, half of the limit counts as used.
#[cfg(target_os = "linux")]
fn left(root: &Path, limits: [Option<u64>; 2]) -> Option<u64> {
    let used = |key| fact(&root.join("proc/self/status"), key);
    let left = |(limit, key): (Option<u64>, _)| {
        let limit = limit?;
        Some(limit.saturating_sub(used(key).unwrap_or(limit / 2)))
    };
    limits.into_iter().zip(["VmSize:", "VmData:"]).filter_map(left).min()
}

/// Formats `bytes` for people, as in `1.5 GiB`.
pub fn display(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "KiB", "MiB"] {
        if value < 1024.0 {
            return format!("{value:.3} {unit}").replace(".000", "");
        }
        value /= 1024.0;
    }
    format!("{value:.1} GiB")
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// Without `/proc`, the system still has memory, and half of each limit counts as left.
    #[test]
    fn nothing_depends_on_proc() {
        let nowhere = Path::new("/nonexistent");
        assert!(system(nowhere) > 1 << 20);
        assert_eq!(left(nowhere, [Some(1000), None]), Some(500));
        assert_eq!(left(nowhere, [None, None]), None);
        assert_eq!(cgroup::available(nowhere), None);
        assert!(available() > 1 << 20);
    }

    #[test]
    fn limits_leave_what_is_not_in_use() {
        let root = std::env::temp_dir().join(format!("trisect-memory-{}", std::process::id()));
        std::fs::create_dir_all(root.join("proc/self")).unwrap();
        std::fs::write(root.join("proc/self/status"), "VmSize:\t400 kB\nVmData:\t160 kB\n").unwrap();
        std::fs::write(root.join("proc/meminfo"), "MemTotal: 9 kB\nMemAvailable:   2048 kB\n").unwrap();
        assert_eq!(system(&root), 2 << 20);
        let kib = |limit: u64| Some(limit * 1024);
        assert_eq!(left(&root, [kib(1000), None]), kib(600));
        assert_eq!(left(&root, [kib(1000), kib(200)]), kib(40));
        assert_eq!(left(&root, [kib(100), None]), Some(0));
        std::fs::remove_dir_all(root).unwrap();
    }
}
