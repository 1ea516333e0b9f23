//! The files that a scene names.

use crate::input;
use crate::scene::error::SceneError;
use std::io::{Error, ErrorKind, Result};
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
    read: Vec<PathBuf>,
}

impl Folder {
    /// The folder that relative paths start from.
    pub fn new(root: PathBuf) -> Self {
        Self { root, read: Vec::new() }
    }

    /// The paths of all files that were read, in order.
    pub fn into_read(self) -> Vec<PathBuf> {
        self.read
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
        let path = self.root.join(relative);
        let bytes = input::read(&path, limit)?;
        self.read.push(path);
        Ok(bytes)
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

pub(super) use input::readable;

/// The content of a file that is not named by another.
pub(super) fn read_whole(path: &Path) -> std::result::Result<Vec<u8>, SceneError> {
    input::read(path, readable()).map_err(|source| SceneError::Read { path: path.to_owned(), source })
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
        let read = ["sub dir/a", "./sub dir/../sub dir/a"].map(|path| root.join(path));
        assert_eq!(folder.into_read(), read);
        std::fs::remove_dir_all(root).unwrap();
    }
}
