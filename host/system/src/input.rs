//! Opens and reads the files that a user names, and the files that these name in turn.
//!
//! [`open`] is the only way to an input file. [`open_file`] refuses anything that is not a regular
//! file: devices have no end, and a pipe waits for a writer that may never come.

#[cfg(any(target_family = "wasm", test))]
pub mod in_memory;
mod opened;

pub use opened::{OpenedFiles, record, recorded};

use crate::memory;
use std::fs::{File, Metadata, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Input that is not a regular file.
#[derive(Debug, Error)]
enum InputError {
    /// The path is a folder.
    #[error("this is a folder; name a file in it")]
    Folder,
    /// The path is a pipe, a socket or a device.
    #[error(
        "this is {kind}, and only regular files are read (also as /dev/stdin); write its content to a file first, and name that"
    )]
    NotRegular {
        /// Kind of the file, with its article.
        kind: &'static str,
    },
}

impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        Self::new(ErrorKind::InvalidInput, error)
    }
}

/// Opens an input file as [`open_file`] does.
///
/// # Errors
///
/// Those of [`open_file`].
#[cfg(not(target_family = "wasm"))]
pub fn open(path: &Path) -> Result<File> {
    open_file(path)
}

/// Opens a file that the page [gave](in_memory::put).
///
/// # Errors
///
/// [`ErrorKind::NotFound`] for another one.
#[cfg(target_family = "wasm")]
pub fn open(path: &Path) -> Result<in_memory::MemoryFile> {
    in_memory::open(path)
}

/// Opens a regular file of the file system for reading. Links are followed. It never waits, not
/// even for a pipe's writer.
///
/// # Errors
///
/// Returns the file system's error, or [`ErrorKind::InvalidInput`] for anything that is not a
/// regular file.
pub fn open_file(path: &Path) -> Result<File> {
    opened::note(path);
    // Checked before opening, because opening a device may have effects.
    check(&std::fs::metadata(path)?)?;
    let mut options = OpenOptions::new();
    options.read(true);
    // Another file may have taken the name meanwhile. Without this flag, opening a pipe would wait
    // for its writer.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    let file = options.open(path)?;
    check(&file.metadata()?)?;
    Ok(file)
}

/// Returns the paths of the files and folders in a folder, in no order; none if it cannot be read.
pub fn entries(folder: &Path) -> Box<dyn Iterator<Item = PathBuf>> {
    #[cfg(target_family = "wasm")]
    return Box::new(in_memory::entries(folder).into_iter());
    #[cfg(not(target_family = "wasm"))]
    Box::new(std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())))
}

/// Returns whether there is a folder of this path.
pub fn is_folder(path: &Path) -> bool {
    #[cfg(target_family = "wasm")]
    return in_memory::is_folder(path);
    #[cfg(not(target_family = "wasm"))]
    path.is_dir()
}

fn check(facts: &Metadata) -> Result<()> {
    if facts.is_file() {
        return Ok(());
    }
    if facts.is_dir() {
        return Err(InputError::Folder.into());
    }
    Err(InputError::NotRegular { kind: kind(facts) }.into())
}

/// Returns the kind of a file that is neither a regular file nor a folder, with its article.
#[cfg(unix)]
pub fn kind(facts: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    let kind = facts.file_type();
    match () {
        () if kind.is_fifo() => "a pipe",
        () if kind.is_socket() => "a socket",
        () if kind.is_char_device() => "a device or a terminal",
        () => "a device",
    }
}

/// Returns the kind of a file that is neither a regular file nor a folder, with its article.
#[cfg(not(unix))]
pub fn kind(_: &Metadata) -> &'static str {
    "a device or a pipe"
}

/// Returns the maximum number of bytes that may be read from one file now.
pub fn readable() -> u64 {
    memory::available() / 4
}

/// Returns the content of a regular file of at most `limit` bytes.
///
/// # Errors
///
/// Errors of [`open`], and [`ErrorKind::FileTooLarge`] for a longer file.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = Vec::new();
    if length <= limit {
        file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    }
    if length.max(bytes.len() as u64) > limit {
        let (length, limit) = (memory::display(length), memory::display(limit));
        let message = format!("it has {length}, more than the {limit} that may be read");
        return Err(Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// Returns the text of a regular file, which must be UTF-8.
///
/// # Errors
///
/// Errors of [`read`], and [`ErrorKind::InvalidData`] for text that is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path, readable())?).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        let message = format!("this is not UTF-8 text from byte {byte} on; save it as UTF-8");
        Error::new(ErrorKind::InvalidData, message)
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use std::fs;

    #[test]
    fn regular_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, b"0123").unwrap();
        assert_eq!(read(&path, 4).unwrap(), b"0123");
        assert_eq!(read(&path, 3).unwrap_err().kind(), ErrorKind::FileTooLarge);
        assert_eq!(read_text(&path).unwrap(), "0123");
        fs::write(&path, b"01\xff").unwrap();
        let error = read_text(&path).unwrap_err().to_string();
        assert!(error.contains("UTF-8") && error.contains("byte 2"), "{error}");
        assert_eq!(open(&folder.path().join("none")).unwrap_err().kind(), ErrorKind::NotFound);
    }

    /// Refused at once, also through a link.
    #[cfg(unix)]
    #[test]
    fn nothing_else_is_opened() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let made = std::process::Command::new("mkfifo").arg(at("fifo")).status().unwrap();
        assert!(made.success());
        let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", at("link")).unwrap();
        let said = |path: &Path| {
            let error = open(path).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput, "{}", path.display());
            error.to_string()
        };
        assert!(said(&at("fifo")).contains("a pipe, and only regular files"));
        assert!(said(&at("socket")).contains("a socket"));
        assert!(said(folder.path()).contains("a folder; name a file in it"));
        for device in [at("link"), "/dev/zero".into(), "/dev/full".into()] {
            assert!(said(&device).contains("write its content to a file first"));
        }
        // Negative control: a link to a regular file is opened.
        fs::write(at("a"), b"").unwrap();
        std::os::unix::fs::symlink("a", at("b")).unwrap();
        assert!(open(&at("b")).is_ok());
    }
}
