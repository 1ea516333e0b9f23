//! The file of a checkpoint, which two processes must not write.

use super::{CheckpointError, Header, write_claimed};
use crate::atomic_file::Claim;
use crate::film::Film;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The file of a checkpoint as this process read it or wrote it last. It replaces no other.
#[derive(Clone, Debug)]
pub struct Place {
    path: PathBuf,
    claim: Arc<Mutex<Claim>>,
}

impl Place {
    /// Returns the place of a file that is not there yet.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), claim: Arc::default() }
    }

    /// Returns the place of the file that is there. Call it before the file is read, so that what
    /// another process writes in between is not replaced.
    pub fn of(path: &Path) -> Self {
        Self { path: path.to_owned(), claim: Arc::new(Mutex::new(Claim::of(path))) }
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file, in place of the one that this process read or wrote last.
    ///
    /// # Errors
    ///
    /// [`CheckpointError::Taken`] if another process wrote the file, which stays as it is;
    /// [`CheckpointError::Io`] as [`write`](super::write()).
    pub fn write(&self, header: &Header, film: &Film) -> Result<(), CheckpointError> {
        let mut claim = self.claim.lock().unwrap_or_else(PoisonError::into_inner);
        write_claimed(&self.path, &mut claim, header, film)
    }
}
