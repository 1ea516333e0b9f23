//! Outputs that are neither regular files nor folders: character devices and pipes.

#[cfg(unix)]
use super::{MAX_LINKS, folder};
use crate::input::kind;
use std::fs::{self, Metadata};
use std::io::{self, ErrorKind};
use std::path::Path;
use thiserror::Error;

/// Output that cannot be written.
#[derive(Debug, Error)]
enum SpecialError {
    /// A socket, a block device, or a named pipe.
    #[error(
        "this is {kind}, and outputs go to regular files, to character devices such as /dev/null, and to pipes that are open already, such as /dev/stdout; name one of these"
    )]
    Unsupported {
        /// Kind of the file, with its article.
        kind: &'static str,
    },
    /// A pipe whose reader has ended, or never began.
    #[cfg(unix)]
    #[error("no one reads this pipe; name a regular file, or start its reader first")]
    NoReader,
}

/// Checks that a special file can be written, without opening it.
pub(super) fn check(path: &Path, facts: &Metadata) -> io::Result<()> {
    if is_writable(path, facts) {
        return Ok(());
    }
    Err(io::Error::new(ErrorKind::InvalidInput, SpecialError::Unsupported { kind: kind(facts) }))
}

#[cfg(unix)]
fn is_writable(path: &Path, facts: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = facts.file_type();
    kind.is_char_device() || kind.is_fifo() && is_descriptor(path)
}

#[cfg(not(unix))]
fn is_writable(_: &Path, _: &Metadata) -> bool {
    true
}

/// Returns whether a path, or a link that it leads through, names a descriptor of this process. A
/// shell's `>(command)` is such a path.
#[cfg(unix)]
fn is_descriptor(path: &Path) -> bool {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        let is_name = ["/dev/stdout", "/dev/stderr"].iter().any(|name| path == Path::new(name));
        let is_number = ["/dev/fd", "/proc/self/fd"].iter().any(|name| folder(&path) == Path::new(name));
        if is_name || is_number {
            return true;
        }
        let Ok(link) = fs::read_link(&path) else { return false };
        path = folder(&path).join(link);
    }
    false
}

/// Writes to a special file. Fails at once for a pipe that no one has open for reading.
#[cfg(unix)]
pub(super) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use std::io::Write;
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
    let mut options = fs::OpenOptions::new();
    options.write(true).custom_flags(libc::O_NONBLOCK);
    let opened = options.open(path);
    let is_pipe = || fs::metadata(path).is_ok_and(|facts| facts.file_type().is_fifo());
    let mut file = match opened {
        Err(error) if error.raw_os_error() == Some(libc::ENXIO) && is_pipe() => {
            return Err(io::Error::new(ErrorKind::BrokenPipe, SpecialError::NoReader));
        }
        opened => opened?,
    };
    // Waits for a slow reader from here on.
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    file.write_all(bytes)
}

#[cfg(not(unix))]
pub(super) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    fs::write(path, bytes)
}
