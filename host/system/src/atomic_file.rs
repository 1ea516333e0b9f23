//! Files that are replaced as a whole: an earlier file stays unchanged until the new one is
//! complete.
//!
//! The new content goes to a temporary file in the same folder, `.NAME.RANDOM.part`. It is created
//! with `O_EXCL`: no link is followed, and no two writers share it, even if containers on one file
//! system give them the same process id. A killed process leaves its temporary file behind; a write
//! of the same file removes it once it is more than an hour old.

mod claim;
mod special;

pub use claim::Claim;

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::NamedTempFile;

/// Number of random characters in a temporary file's name.
const RANDOM_CHARS: usize = 16;

/// Age from which a temporary file counts as left behind.
const MAX_AGE: Duration = Duration::from_secs(3600);

/// Maximum number of links followed in a row: Linux's own limit.
const MAX_LINKS: u32 = 40;

/// Writes a temporary file beside `path`, syncs it, and renames it to `path`. The new file has the
/// mode of an earlier one. Links are followed.
///
/// # Errors
///
/// Returns the file system's error, or [`ErrorKind::InvalidInput`] if `path` exists and is not a
/// regular file. Nothing is left behind then.
pub fn write_atomic(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    write_atomic_by(path, write, |temporary, path| Ok(temporary.persist(path)?)).map(drop)
}

/// Writes a file like [`write_atomic`]; `persist` moves the temporary file to its name. Returns the
/// new file.
fn write_atomic_by(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
    persist: impl FnOnce(NamedTempFile, &Path) -> io::Result<File>,
) -> io::Result<File> {
    let path = &target(path);
    let earlier = existing_file(path)?;
    let mut temporary = beside(path, earlier.is_some())?;
    write(temporary.as_file_mut())?;
    if let Some(earlier) = earlier {
        let _ = temporary.as_file().set_permissions(earlier.permissions());
    }
    temporary.as_file().sync_all()?;
    let file = persist(temporary, path)?;
    sweep(path);
    // Also syncs the new name, where folders can be opened.
    if let Ok(folder) = File::open(folder(path)) {
        let _ = folder.sync_all();
    }
    Ok(file)
}

/// Writes `bytes` to `path`. Replaces an earlier file, or writes into it if it cannot be replaced:
/// because it is a pipe or a device, because its folder takes no new files, or because a new file
/// would have other owners or lack the earlier one's other names (hard links).
///
/// # Errors
///
/// Returns the file system's error, also for a pipe that no one reads.
pub fn write_atomic_or_in_place(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let earlier = fs::metadata(path).ok();
    if earlier.as_ref().is_some_and(|facts| !facts.is_file()) {
        return special::write(path, bytes);
    }
    let replaced = write_atomic(path, |file| {
        if let Some(earlier) = &earlier
            && !is_alike(earlier, &file.metadata()?)
        {
            return Err(ErrorKind::PermissionDenied.into());
        }
        file.write_all(bytes)
    });
    match replaced {
        Err(error) if is_for_want_of_a_new_file(error.kind()) => fs::write(path, bytes),
        done => done,
    }
}

/// Checks that [`write_atomic_or_in_place`] can write `path`. Creates nothing under that name, and
/// leaves an existing file unchanged.
///
/// # Errors
///
/// Returns the error that writing would meet, and [`ErrorKind::InvalidInput`] for a socket, a block
/// device, and a pipe that this process has not opened yet.
pub fn probe(path: &Path) -> io::Result<()> {
    let opened = match fs::metadata(path) {
        Ok(facts) if facts.is_dir() => Err(ErrorKind::IsADirectory.into()),
        // Opening a pipe would wait for its reader, and closing it would end the reader's input.
        Ok(facts) if !facts.is_file() => special::check(path, &facts),
        Ok(_) => OpenOptions::new().append(true).open(path).map(drop),
        Err(error) => Err(error),
    };
    match opened {
        Err(error) if error.kind() == ErrorKind::NotFound => beside(&target(path), false).map(drop),
        opened => opened,
    }
}

/// Checks that [`write_atomic`] can write `path`. Creates nothing under that name, and leaves an
/// existing file unchanged.
///
/// # Errors
///
/// Returns the error that writing would meet.
pub fn probe_atomic(path: &Path) -> io::Result<()> {
    if !path.is_dir() {
        existing_file(&target(path))?;
    }
    probe(path)?;
    let path = &target(path);
    beside(path, false).map(drop)
}

/// Returns whether two paths name the same file: through links, relative parts and hard links.
/// Neither needs to exist.
pub fn is_same(a: &Path, b: &Path) -> bool {
    canonical_path(a) == canonical_path(b) || is_same_data(a, b)
}

/// Returns the path of a file without links, equal for all paths of the file except hard links.
pub fn canonical_path(path: &Path) -> PathBuf {
    let target = target(path);
    let folder = folder(&target);
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    target.file_name().map_or_else(|| target.clone(), |name| folder.join(name))
}

#[cfg(unix)]
fn is_same_data(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (fs::metadata(a), fs::metadata(b)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_same_data(_: &Path, _: &Path) -> bool {
    false
}

/// Returns the metadata of an earlier file, or an error if it cannot be replaced.
fn existing_file(path: &Path) -> io::Result<Option<Metadata>> {
    match fs::metadata(path) {
        Ok(facts) if facts.is_file() => Ok(Some(facts)),
        Ok(_) => Err(io::Error::new(ErrorKind::InvalidInput, "it exists and is not a regular file")),
        Err(_) => Ok(None),
    }
}

/// Returns whether a new file may replace an earlier one: it has the same owners, and the earlier
/// one has no other names.
#[cfg(unix)]
fn is_alike(earlier: &Metadata, new: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    earlier.nlink() == 1 && (earlier.uid(), earlier.gid()) == (new.uid(), new.gid())
}

#[cfg(not(unix))]
fn is_alike(_: &Metadata, _: &Metadata) -> bool {
    true
}

/// Returns whether a file may be written in place after this error of replacing it.
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

/// Follows links, also to a file that does not exist yet.
fn target(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match (fs::canonicalize(&path), fs::read_link(&path)) {
            (Ok(target), _) => return target,
            (Err(_), Ok(link)) => path = folder(&path).join(link),
            _ => return path,
        }
    }
    path
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Creates a temporary file in the folder of `path`: readable only by its owner if it `is_private`,
/// else with the mode of the umask.
fn beside(path: &Path, is_private: bool) -> io::Result<NamedTempFile> {
    tempfile::Builder::new().prefix(&prefix(path)).suffix(SUFFIX).rand_bytes(RANDOM_CHARS).make_in(
        folder(path),
        |temporary| {
            let mut options = OpenOptions::new();
            options.write(true).create_new(true);
            #[cfg(unix)]
            std::os::unix::fs::OpenOptionsExt::mode(&mut options, if is_private { 0o600 } else { 0o666 });
            let _ = is_private;
            options.open(temporary)
        },
    )
}

const SUFFIX: &str = ".part";

/// Returns the beginning of the names of a file's temporary files. It is shortened, so that they
/// are valid if the file's own name has the maximum length.
fn prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".{}.", name.chars().take(40).collect::<String>())
}

/// Removes temporary files that killed processes left behind.
fn sweep(path: &Path) {
    let prefix = prefix(path);
    for entry in fs::read_dir(folder(path)).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let random = name.to_str().and_then(|name| name.strip_prefix(&prefix)?.strip_suffix(SUFFIX));
        let is_random =
            |text: &str| text.len() == RANDOM_CHARS && text.bytes().all(|b| b.is_ascii_alphanumeric());
        if !random.is_some_and(is_random) {
            continue;
        }
        let time = entry.metadata().ok().filter(Metadata::is_file).and_then(|facts| facts.modified().ok());
        if time.and_then(|time| time.elapsed().ok()).is_some_and(|age| age > MAX_AGE) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(all(test, unix))]
mod tests;
