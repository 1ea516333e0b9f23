//! Files in memory, in place of a file system: what a page of a browser was given.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Error, ErrorKind, Read, Result, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Contents of the files by their paths.
static FILES: Mutex<BTreeMap<PathBuf, Arc<Vec<u8>>>> = Mutex::new(BTreeMap::new());

fn files() -> MutexGuard<'static, BTreeMap<PathBuf, Arc<Vec<u8>>>> {
    FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns a path without `.`, and without folders that `..` leaves again.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => plain.push(name),
            Component::ParentDir => drop(plain.pop()),
            Component::Prefix(_) | Component::RootDir | Component::CurDir => {}
        }
    }
    plain
}

/// Gives a file its content, also in place of an earlier one.
pub fn put(path: &Path, content: Vec<u8>) {
    files().insert(plain(path), Arc::new(content));
}

/// Forgets all files.
pub fn clear() {
    files().clear();
}

/// Returns the number of bytes of all files.
pub fn bytes() -> u64 {
    files().values().map(|content| content.len() as u64).sum()
}

/// Opened file.
#[derive(Debug)]
pub struct MemoryFile(Cursor<Shared>);

/// Content that others may hold, too.
#[derive(Debug)]
struct Shared(Arc<Vec<u8>>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

/// Facts of a file.
#[derive(Clone, Copy, Debug)]
pub struct Facts(u64);

impl Facts {
    /// Returns the number of bytes.
    #[allow(clippy::len_without_is_empty, reason = "as std::fs::Metadata")]
    pub fn len(&self) -> u64 {
        self.0
    }
}

impl MemoryFile {
    /// Returns the file's facts.
    ///
    /// # Errors
    ///
    /// None; as for a file of a system.
    pub fn metadata(&self) -> Result<Facts> {
        Ok(Facts(self.0.get_ref().0.len() as u64))
    }
}

impl Read for MemoryFile {
    fn read(&mut self, to: &mut [u8]) -> Result<usize> {
        self.0.read(to)
    }
}

impl Seek for MemoryFile {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        self.0.seek(to)
    }
}

/// Opens a file that was [put](put).
///
/// # Errors
///
/// [`ErrorKind::NotFound`] for another one.
pub fn open(path: &Path) -> Result<MemoryFile> {
    let content = files().get(&plain(path)).cloned();
    let content = content.ok_or_else(|| {
        Error::new(ErrorKind::NotFound, "the page was not given this file; drop it together with the scene")
    })?;
    Ok(MemoryFile(Cursor::new(Shared(content))))
}

/// Returns the paths of the files and folders in a folder.
pub fn entries(folder: &Path) -> BTreeSet<PathBuf> {
    let folder = plain(folder);
    let within = |path: &PathBuf| {
        let first = path.strip_prefix(&folder).ok()?.components().next()?;
        Some(folder.join(first))
    };
    files().keys().filter_map(within).collect()
}

/// Returns whether there is a folder of this path: that of all files, or one that has some.
pub fn is_folder(path: &Path) -> bool {
    let path = plain(path);
    path.as_os_str().is_empty() || files().keys().any(|file| file != &path && file.starts_with(&path))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn files_have_the_content_that_was_put() {
        put(Path::new("a/b.txt"), b"first".to_vec());
        put(Path::new("./a/x/../b.txt"), b"second".to_vec());
        put(Path::new("a/c/d"), Vec::new());
        let mut file = open(Path::new("/a/./b.txt")).unwrap();
        assert_eq!((file.metadata().unwrap().len(), bytes()), (6, 6));
        let mut text = String::new();
        file.seek(SeekFrom::Start(3)).unwrap();
        file.read_to_string(&mut text).unwrap();
        assert_eq!(text, "ond");
        let names = |folder: &str| entries(Path::new(folder)).into_iter().collect::<Vec<_>>();
        assert_eq!(names("a"), [PathBuf::from("a/b.txt"), PathBuf::from("a/c")]);
        assert_eq!(names("."), [PathBuf::from("a")]);
        let folders = ["", ".", "a", "a/c", "a/b.txt", "b"].map(|path| is_folder(Path::new(path)));
        assert_eq!(folders, [true, true, true, true, false, false]);
        assert_eq!(open(Path::new("b.txt")).unwrap_err().kind(), ErrorKind::NotFound);
        clear();
        assert!(open(Path::new("a/b.txt")).is_err() && bytes() == 0 && names("a").is_empty());
    }
}
