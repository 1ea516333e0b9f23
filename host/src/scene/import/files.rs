//! The files that a scene names.

use crate::memory;
use crate::scene::error::SceneError;
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::{Component, Path, PathBuf};

/// Where a scene's buffers, images and material libraries come from.
pub trait Files {
    /// The content of the file at `path`: relative to the scene's folder, `/` between folders, nothing percent-encoded.
    ///
    /// # Errors
    /// Why there is none; [`ErrorKind::FileTooLarge`] if it is longer than `limit` bytes.
    fn read(&mut self, path: &str, limit: u64) -> Result<Vec<u8>>;
}

/// The files of a folder and of those beside it. Absolute paths are refused.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The folder that relative paths start from.
    pub fn new(root: PathBuf) -> Self {
        Self { root }
    }

    /// The folder of the scene file `scene`.
    pub fn of(scene: &Path) -> Self {
        Self::new(scene.parent().map_or_else(PathBuf::new, Path::to_owned))
    }
}

impl Files for Folder {
    fn read(&mut self, path: &str, limit: u64) -> Result<Vec<u8>> {
        let relative = Path::new(path);
        if relative.components().any(|part| matches!(part, Component::Prefix(_) | Component::RootDir)) {
            return Err(Error::new(ErrorKind::InvalidInput, "the path is absolute"));
        }
        read_file(&self.root.join(relative), limit)
    }
}

/// No files at all: for scenes that are complete in themselves.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Files for NoFiles {
    fn read(&mut self, _: &str, _: u64) -> Result<Vec<u8>> {
        Err(Error::new(ErrorKind::NotFound, "no files go with this scene"))
    }
}

/// The most bytes that are read from one file now.
pub(super) fn readable() -> u64 {
    memory::available() / 4
}

/// The content of a file that is not named by another.
pub(super) fn read_whole(path: &Path) -> std::result::Result<Vec<u8>, SceneError> {
    read_file(path, readable()).map_err(|source| SceneError::Read { path: path.to_owned(), source })
}

fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>> {
    // Asked before it is opened: opening a pipe waits for a writer.
    if !std::fs::metadata(path)?.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "this is not a file"));
    }
    let file = File::open(path)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_relative_and_bounded() {
        let root = std::env::temp_dir().join(format!("trisect-files-{}", std::process::id()));
        std::fs::create_dir_all(root.join("sub dir")).unwrap();
        std::fs::write(root.join("sub dir/a"), b"0123").unwrap();
        let mut folder = Folder::of(&root.join("scene.gltf"));
        assert_eq!(folder.read("sub dir/a", 4).unwrap(), b"0123");
        assert_eq!(folder.read("./sub dir/../sub dir/a", 4).unwrap(), b"0123");
        assert_eq!(folder.read("sub dir/a", 3).unwrap_err().kind(), ErrorKind::FileTooLarge);
        assert_eq!(folder.read("none", 3).unwrap_err().kind(), ErrorKind::NotFound);
        assert_eq!(folder.read("/etc/hostname", 1000).unwrap_err().kind(), ErrorKind::InvalidInput);
        assert_eq!(folder.read("sub dir", 1000).unwrap_err().kind(), ErrorKind::InvalidInput);
        assert!(folder.read("a\0b", 1000).is_err());
        std::fs::remove_dir_all(root).unwrap();
    }
}
