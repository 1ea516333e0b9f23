//! File of a checkpoint, protected against being overwritten by two processes in turn.
//!
//! [`Saver`](super::Saver) writes through it.

use super::{CheckpointError, Header, write_claimed};
use crate::film::Film;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use trisect_system::atomic_file::Claim;

/// File of a checkpoint as this process read it or wrote it last. Other files are never replaced.
#[derive(Clone, Debug)]
pub struct Place {
    path: PathBuf,
    claim: Arc<Mutex<Claim>>,
}

impl Place {
    /// Returns the place of a file that does not exist yet.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), claim: Arc::default() }
    }

    /// Returns the place of an existing file. Call it before the file is read, so that a file that
    /// another process writes in between is not replaced.
    pub fn of(path: &Path) -> Self {
        Self { path: path.to_owned(), claim: Arc::new(Mutex::new(Claim::of(path))) }
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file. Replaces only the file that this process read or wrote last.
    ///
    /// # Errors
    ///
    /// [`CheckpointError::Taken`] if another process wrote the file, which stays unchanged;
    /// [`CheckpointError::Io`] as [`write`](super::write()).
    pub fn write(&self, header: &Header, film: &Film) -> Result<(), CheckpointError> {
        let mut claim = self.claim.lock().unwrap_or_else(PoisonError::into_inner);
        write_claimed(&self.path, &mut claim, header, film)
    }
}
