//! Files that are replaced whole: an earlier one stays as it was until the new one is complete.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Writes a file beside `path`, on the disk when this returns, and gives it that name and, where it may, the mode of an earlier one. Links are followed.
///
/// # Errors
///
/// What the file system says, or that something is there which is no regular file; then nothing is left of it.
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let target = target(path);
    let earlier = fs::metadata(&target).ok();
    if earlier.as_ref().is_some_and(|facts| !facts.is_file()) {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is there, and no regular file"));
    }
    let path = &target;
    let temporary = beside(path);
    let written = write(&temporary).and_then(|()| {
        if let Some(earlier) = earlier {
            let _ = fs::set_permissions(&temporary, earlier.permissions());
        }
        fs::rename(&temporary, path)
    });
    if written.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    written?;
    sweep(path);
    // The name, too, is on the disk then. Where folders cannot be opened, it is not asked for.
    match File::open(folder(path)) {
        Ok(folder) => folder.sync_all().or(Ok(())),
        Err(_) => Ok(()),
    }
}

/// Writes these bytes as `path`: in place of an earlier file, or where that cannot be, as with a pipe, in a folder that takes no new files or where a new file would
/// not be everyone's whose the earlier one is, into what is there.
///
/// # Errors
///
/// What the file system says.
pub fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let earlier = fs::metadata(path).ok();
    if earlier.as_ref().is_some_and(|facts| !facts.is_file()) {
        return fs::write(path, bytes);
    }
    let replaced = replace(path, |temporary| {
        let mut file = File::create(temporary)?;
        if let Some(earlier) = &earlier
            && !is_alike(earlier, &file.metadata()?)
        {
            return Err(ErrorKind::PermissionDenied.into());
        }
        file.write_all(bytes)?;
        file.sync_all()
    });
    match replaced {
        Err(error) if is_for_want_of_a_new_file(error.kind()) => fs::write(path, bytes),
        done => done,
    }
}

/// Whether a file may be there in place of another: of the same owners, and under no other name.
#[cfg(unix)]
fn is_alike(earlier: &Metadata, new: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    earlier.nlink() == 1 && (earlier.uid(), earlier.gid()) == (new.uid(), new.gid())
}

#[cfg(not(unix))]
fn is_alike(_: &Metadata, _: &Metadata) -> bool {
    true
}

/// Whether what is there may be written to though nothing can be put beside it.
fn is_for_want_of_a_new_file(error: ErrorKind) -> bool {
    matches!(
        error,
        ErrorKind::PermissionDenied
            | ErrorKind::ReadOnlyFilesystem
            | ErrorKind::ResourceBusy
            | ErrorKind::CrossesDevices
            | ErrorKind::InvalidFilename
    )
}

/// Where links lead, also to what is not there yet.
fn target(path: &Path) -> PathBuf {
    match (fs::canonicalize(path), fs::read_link(path)) {
        (Ok(target), _) => target,
        (Err(_), Ok(link)) => folder(path).join(link),
        _ => path.to_owned(),
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// In the same folder, so that it can be moved; of this process alone, as two may write the same file.
fn beside(path: &Path) -> PathBuf {
    folder(path).join(format!("{}{}.part", prefix(path), std::process::id()))
}

/// Short enough for a name that is as long as it may be.
fn prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".{}.", name.chars().take(40).collect::<String>())
}

/// What no one has written to for so long was left by a process that was killed.
const LEFT: Duration = Duration::from_secs(3600);

/// Removes what killed processes left.
fn sweep(path: &Path) {
    for entry in fs::read_dir(folder(path)).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let process = name.to_str().and_then(|name| name.strip_prefix(&prefix(path))?.strip_suffix(".part"));
        let is_one = process.is_some_and(|process| process.parse::<u32>().is_ok());
        if !is_one {
            continue;
        }
        let time = entry.metadata().and_then(|facts| facts.modified()).ok();
        if time.and_then(|time| time.elapsed().ok()).is_some_and(|age| age > LEFT) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    /// EACCES, EROFS and ENOSPC by their numbers.
    fn libc_error(number: i32) -> ErrorKind {
        io::Error::from_raw_os_error(number).kind()
    }

    fn folder_of(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("trisect-replace-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    /// The earlier file stays whole until the new one is, and nothing else is left.
    #[test]
    fn whole_or_not_at_all() {
        let folder = folder_of("whole");
        let path = folder.join("a.png");
        put(&path, b"first").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        let failed = replace(&path, |temporary| {
            fs::write(temporary, b"sec")?;
            assert_eq!(fs::read(&path)?, b"first");
            Err(io::Error::other("the disk is full"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"first");
        put(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        // The twin: written in place, half of it would be there.
        fs::write(&path, b"sec").unwrap();
        assert_ne!(fs::read(&path).unwrap(), b"second");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_cannot_be_replaced_is_written_to() {
        let folder = folder_of("link");
        let (path, link) = (folder.join("a.png"), folder.join("link.png"));
        fs::write(&path, b"first").unwrap();
        symlink(&path, &link).unwrap();
        put(&link, b"second").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&path).unwrap(), b"second");
        fs::remove_file(&path).unwrap();
        put(&link, b"again").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&path).unwrap(), b"again");
        // One file of two names stays one.
        let other = folder.join("other.png");
        fs::hard_link(&path, &other).unwrap();
        put(&path, b"both").unwrap();
        assert_eq!(fs::read(&other).unwrap(), b"both");
        // The longest name.
        let long = folder.join("a".repeat(251) + ".png");
        put(&long, b"long").unwrap();
        put(&long, b"longer").unwrap();
        assert_eq!(fs::read(&long).unwrap(), b"longer");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 4);
        for (error, in_place) in [(libc_error(13), true), (libc_error(30), true), (libc_error(28), false)] {
            assert_eq!(is_for_want_of_a_new_file(error), in_place, "{error}");
        }
        put(Path::new("/dev/null"), b"third").unwrap();
        assert!(replace(Path::new("/dev/null"), |_| Ok(())).is_err());
        assert!(put(&folder.join("none/a.png"), b"").is_err());
        fs::remove_dir_all(folder).unwrap();
    }
}
