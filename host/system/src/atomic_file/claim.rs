//! File that one process replaces repeatedly, unless another process has put its own in that place.
//! Checkpoints are written so.

use super::write_atomic_by;
use crate::input;
use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind};
use std::path::Path;
use tempfile::NamedTempFile;

/// Claim to one file under a name: the one that existed at first, then the one that this process
/// wrote last. The file is kept open between writes, so that no other file gets its inode number.
#[derive(Debug, Default)]
pub struct Claim {
    file: Option<File>,
}

impl Claim {
    /// Returns a claim to an existing file, or to the name if there is no file.
    pub fn of(path: &Path) -> Self {
        Self { file: input::open_file(path).ok() }
    }

    /// Replaces the file like [`write_atomic`](super::write_atomic), if it is the one of this claim
    /// or if there is no file.
    ///
    /// # Errors
    ///
    /// Returns [`ErrorKind::AlreadyExists`] if another file is there, which stays unchanged;
    /// otherwise the errors of [`write_atomic`](super::write_atomic).
    pub fn replace(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> io::Result<()> {
        // Checked before the content is written; `persist` checks again.
        if fs::metadata(path).is_ok_and(|there| there.is_file() && !self.is(&there)) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        let file = write_atomic_by(path, write, |temporary, path| self.persist(temporary, path))?;
        self.file = Some(file);
        Ok(())
    }

    fn persist(&mut self, temporary: NamedTempFile, path: &Path) -> io::Result<File> {
        let there = match fs::metadata(path) {
            Ok(there) => there,
            Err(error) if error.kind() == ErrorKind::NotFound => return persist_new(temporary, path),
            Err(error) => return Err(error),
        };
        if !self.is(&there) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        // Closed first: NFS would move an open file aside when another one takes its name.
        self.file = None;
        temporary.persist(path).map_err(|error| {
            let reopened = Self::of(path);
            if reopened.is(&there) {
                *self = reopened;
            }
            error.into()
        })
    }

    /// Returns whether a file is the one of this claim.
    fn is(&self, there: &Metadata) -> bool {
        let Some(file) = &self.file else { return false };
        file.metadata().is_ok_and(|own| is_one(&own, there))
    }
}

/// Moves a file to a name that does not exist.
fn persist_new(temporary: NamedTempFile, path: &Path) -> io::Result<File> {
    temporary.persist_noclobber(path).or_else(|refused| match refused.error.kind() {
        ErrorKind::AlreadyExists => Err(refused.error),
        // File systems without hard links, on kernels that cannot rename without replacing.
        _ if !path.exists() => Ok(refused.file.persist(path)?),
        _ => Err(ErrorKind::AlreadyExists.into()),
    })
}

#[cfg(unix)]
fn is_one(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// Files cannot be told apart here: only the first write is checked.
#[cfg(not(unix))]
fn is_one(_: &Metadata, _: &Metadata) -> bool {
    true
}
