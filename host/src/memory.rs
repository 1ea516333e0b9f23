//! How much memory there is.

use sysinfo::{MemoryRefreshKind, RefreshKind, System};

/// Bytes that can be allocated now without swapping, within the control group's limit if there is one.
///
/// A group's use counts cached files, which the system drops when memory is wanted: so a sixteenth of the limit counts as free
/// even where nothing seems to be.
pub fn available() -> u64 {
    let system = System::new_with_specifics(
        RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram()),
    );
    let free = system.available_memory();
    system.cgroup_limits().map_or(free, |limits| free.min(limits.free_memory.max(limits.total_memory / 16)))
}

/// `bytes` as people read it: `1.5 GiB`.
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
