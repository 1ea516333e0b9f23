//! Memory that a control group has left of its limit (Linux, versions 1 and 2).

use std::fs;
use std::path::{Path, PathBuf};

/// Value from which on a limit of version 1 means unlimited.
const NO_LIMIT: u64 = 1 << 62;

/// File names of a version.
struct Version {
    /// Folder of the control groups, below the system's root.
    mount: &'static str,
    limit: &'static str,
    usage: &'static str,
    /// Keys of cached files in `memory.stat`, which include those of groups within the group.
    cached: [&'static str; 2],
}

const VERSIONS: [Version; 2] = [
    Version {
        mount: "sys/fs/cgroup/memory",
        limit: "memory.limit_in_bytes",
        usage: "memory.usage_in_bytes",
        cached: ["total_inactive_file", "total_active_file"],
    },
    Version {
        mount: "sys/fs/cgroup",
        limit: "memory.max",
        usage: "memory.current",
        cached: ["inactive_file", "active_file"],
    },
];

/// Returns the bytes that this process's control group and the groups around it have left: the
/// minimum of them, or `None` without a limit. `root` is `/` except in tests.
///
/// Cached files count as free, because the kernel drops them when the group needs memory.
pub(super) fn available(root: &Path) -> Option<u64> {
    let groups = fs::read_to_string(root.join("proc/self/cgroup")).unwrap_or_default();
    let [first, second] = VERSIONS;
    let of = |version: &Version, group: Option<&str>| least(version, root, group.unwrap_or("/"));
    let groups: Vec<(&str, &str)> = groups.lines().filter_map(group_of).collect();
    let with = |has: fn(&str) -> bool| groups.iter().find(|group| has(group.0)).map(|group| group.1);
    let by_first = of(&first, with(|controllers| controllers.split(',').any(|name| name == "memory")));
    let by_second = of(&second, with(str::is_empty));
    by_first.into_iter().chain(by_second).min()
}

/// Returns the controllers and the path in a line of `/proc/self/cgroup`.
fn group_of(line: &str) -> Option<(&str, &str)> {
    let (_, rest) = line.split_once(':')?;
    rest.split_once(':')
}

/// Returns the minimum that `group` and the groups around it have left. In a container the path may
/// be the host's, of which only the mount itself exists.
fn least(version: &Version, root: &Path, group: &str) -> Option<u64> {
    let mount = root.join(version.mount);
    let mut folder = mount.join(group.trim_start_matches('/'));
    let mut least = None;
    loop {
        least = left(version, &folder).into_iter().chain(least).min();
        if folder == mount || !folder.pop() {
            return least;
        }
    }
}

/// Returns the bytes that one group has left.
fn left(version: &Version, folder: &Path) -> Option<u64> {
    let limit = number(folder.join(version.limit)).filter(|&limit| limit < NO_LIMIT)?;
    let usage = number(folder.join(version.usage))?;
    let facts = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let fact = |key: &str| {
        let mut pairs = facts.lines().filter_map(|line| line.split_once(' '));
        pairs.find(|pair| pair.0 == key).and_then(|pair| pair.1.trim().parse::<u64>().ok()).unwrap_or(0)
    };
    let cached = version.cached.into_iter().map(fact).fold(0, u64::saturating_add);
    Some(limit.saturating_sub(usage.saturating_sub(cached)))
}

/// Returns the number in a file; `max` is not a number and means unlimited.
fn number(file: PathBuf) -> Option<u64> {
    fs::read_to_string(file).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIB: u64 = 1 << 30;

    /// Creates a root folder with these files.
    fn root(name: &str, files: &[(&str, String)]) -> PathBuf {
        let root = std::env::temp_dir().join(format!("trisect-cgroup-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&root);
        for (path, text) in files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root
    }

    fn left_of(name: &str, files: &[(&str, String)]) -> Option<u64> {
        let root = root(name, files);
        let left = available(&root);
        fs::remove_dir_all(root).unwrap();
        left
    }

    fn first_version(group: &str, cached: u64) -> Vec<(&'static str, String)> {
        vec![
            ("proc/self/cgroup", format!("9:name=systemd:/\n4:cpu,memory:{group}\n0::/\n")),
            ("sys/fs/cgroup/memory/a/memory.limit_in_bytes", format!("{}\n", 24 * GIB)),
            ("sys/fs/cgroup/memory/a/memory.usage_in_bytes", format!("{}\n", 15 * GIB)),
            (
                "sys/fs/cgroup/memory/a/memory.stat",
                format!(
                    "cache 1\ninactive_file 5\ntotal_inactive_file {}\ntotal_active_file {}\n",
                    cached / 2,
                    cached / 2
                ),
            ),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n".to_owned()),
            ("sys/fs/cgroup/memory/memory.usage_in_bytes", format!("{}\n", 30 * GIB)),
        ]
    }

    #[test]
    fn cached_files_are_free_in_version_1() {
        assert_eq!(left_of("cached", &first_version("/a", 12 * GIB)), Some(21 * GIB));
        // Negative control: memory that is in use does not count as free.
        assert_eq!(left_of("used", &first_version("/a", 0)), Some(9 * GIB));
        // A group around it counts, and one that does not exist is ignored.
        assert_eq!(left_of("inner", &first_version("/a/b/c", 12 * GIB)), Some(21 * GIB));
        assert_eq!(left_of("elsewhere", &first_version("/docker/0", 12 * GIB)), None);
    }

    #[test]
    fn cached_files_are_free_in_version_2() {
        let files = |limit: &str| {
            vec![
                ("proc/self/cgroup", "0::/user/job\n".to_owned()),
                ("sys/fs/cgroup/user/memory.max", limit.to_owned()),
                ("sys/fs/cgroup/user/memory.current", format!("{}\n", 3 * GIB)),
                (
                    "sys/fs/cgroup/user/memory.stat",
                    format!("anon 7\ninactive_file {GIB}\nactive_file {GIB}\n"),
                ),
                ("sys/fs/cgroup/user/job/memory.max", "max\n".to_owned()),
                ("sys/fs/cgroup/user/job/memory.current", format!("{GIB}\n")),
            ]
        };
        assert_eq!(left_of("second", &files(&(4 * GIB).to_string())), Some(3 * GIB));
        assert_eq!(left_of("no limit", &files("max\n")), None);
        // If more is in use than allowed, nothing is left; without groups there is no limit.
        assert_eq!(left_of("over", &files("1000")), Some(0));
        assert_eq!(left_of("none", &[("proc/self/cgroup", "not a line\n".to_owned())]), None);
    }
}
