//! Files that were opened for reading, and whether they have changed since.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// Time of the last write, and length in bytes; `None` for a file that is missing.
type Stamp = Option<(SystemTime, u64)>;

/// Files opened since [`record`]; `None` before.
static OPENED: Mutex<Option<OpenedFiles>> = Mutex::new(None);

/// Files with their stamps when they were opened.
#[derive(Clone, Debug, Default)]
pub struct OpenedFiles(BTreeMap<PathBuf, Stamp>);

/// Begins to record which files this process opens by [`open`](super::open), and forgets those that
/// were recorded before.
pub fn record() {
    *OPENED.lock().unwrap_or_else(PoisonError::into_inner) = Some(OpenedFiles::default());
}

/// Returns the files opened since [`record`], also those that were missing.
pub fn recorded() -> OpenedFiles {
    OPENED.lock().unwrap_or_else(PoisonError::into_inner).clone().unwrap_or_default()
}

/// Records a file that is about to be opened.
pub(super) fn note(path: &Path) {
    if let Some(opened) = &mut *OPENED.lock().unwrap_or_else(PoisonError::into_inner) {
        opened.0.entry(path.to_owned()).or_insert_with(|| stamp(path));
    }
}

fn stamp(path: &Path) -> Stamp {
    let facts = std::fs::metadata(path).ok()?;
    Some((facts.modified().ok()?, facts.len()))
}

impl OpenedFiles {
    /// Returns the number of files.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether there is no file.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the first file that was written since it was opened, or that was missing and is
    /// there. One that is gone has not changed: editors remove a file before they replace it.
    pub fn first_changed(&self) -> Option<&Path> {
        let changed = |(path, before): &(&PathBuf, &Stamp)| {
            let now = stamp(path);
            now.is_some() && now != **before
        };
        self.0.iter().find(changed).map(|(path, _)| path.as_path())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use std::fs;

    #[test]
    fn changes_are_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let [here, missing] = ["here", "missing"].map(|name| folder.path().join(name));
        fs::write(&here, b"1").unwrap();
        let files = || OpenedFiles([&here, &missing].map(|path| (path.clone(), stamp(path))).into());
        let before = files();
        assert_eq!((before.len(), before.first_changed()), (2, None));
        fs::write(&missing, b"").unwrap();
        assert_eq!(before.first_changed(), Some(missing.as_path()));
        let before = files();
        fs::remove_file(&here).unwrap();
        assert_eq!(before.first_changed(), None);
        fs::write(&here, b"12").unwrap();
        assert_eq!(before.first_changed(), Some(here.as_path()));
    }
}
