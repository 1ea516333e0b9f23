//! Access to the files that a scene or a model names.

use crate::error::SceneError;
use crate::missing_file::{explained, names_in};
use std::io::{Error, ErrorKind, Result};
use std::path::{Component, Path, PathBuf};
use trisect_system::input;

/// A source of buffers, images and material libraries.
pub trait Files {
    /// Returns the content of the file at `path`, which is relative to the scene's folder, has `/`
    /// between folders, and is not percent-encoded.
    ///
    /// # Errors
    ///
    /// The reason why the file cannot be read; [`ErrorKind::FileTooLarge`] if it is longer than
    /// `limit` bytes.
    fn read(&mut self, path: &str, limit: u64) -> Result<Vec<u8>>;

    /// Returns the names of files and folders in a folder, which is named as files are; "" is the
    /// folder that paths start from. None are known to a source that cannot list them.
    fn list(&mut self, folder: &str) -> Vec<String> {
        let _ = folder;
        Vec::new()
    }
}

/// Rule for which files a scene may name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Includes {
    /// Files in the scene's folder and in folders below it. Symbolic links there are followed, also
    /// to other folders.
    #[default]
    Below,
    /// All files (`--allow-outside`).
    Anywhere,
}

/// A name that leads out of the scene's folder.
#[derive(Debug, thiserror::Error)]
#[error("it lies outside the scene's folder")]
pub(super) struct Outside;

/// The folder of a scene, and the files read from it.
#[derive(Clone, Debug)]
pub struct Folder {
    /// Folder of the scene file.
    root: PathBuf,
    /// Folder below `root` that relative paths start from.
    base: PathBuf,
    includes: Includes,
    /// Paths of all files that were read, in order.
    read: Vec<PathBuf>,
}

impl Folder {
    /// Makes a folder of `root`, from which relative paths start.
    pub fn new(root: PathBuf) -> Self {
        Self { root, base: PathBuf::new(), includes: Includes::Below, read: Vec::new() }
    }

    /// Returns the paths of all files that were read, in order.
    pub fn into_read(self) -> Vec<PathBuf> {
        self.read
    }

    /// Returns the paths of all files that were read so far, in order.
    pub fn files_read(&self) -> &[PathBuf] {
        &self.read
    }

    /// Returns the folder of the scene file `scene`.
    pub fn of(scene: &Path) -> Self {
        Self::new(scene.parent().map_or_else(PathBuf::new, Path::to_owned))
    }

    /// Sets the rule for which files may be named.
    pub fn including(self, includes: Includes) -> Self {
        Self { includes, ..self }
    }

    /// Returns this folder for the names in the file `path`, a result of [`locate`](Self::locate):
    /// relative names start from that file's folder.
    pub fn beside(&self, path: &Path) -> Self {
        let relative = path.strip_prefix(&self.root).unwrap_or(path);
        let base = relative.parent().map_or_else(PathBuf::new, Path::to_owned);
        Self { base, ..self.clone() }
    }

    /// Returns the path of the file `name`.
    ///
    /// # Errors
    ///
    /// [`ErrorKind::InvalidInput`] for a name that leads out of the scene's folder, unless
    /// [`Includes::Anywhere`] allows it.
    pub fn locate(&self, name: &Path) -> Result<PathBuf> {
        let relative = self.base.join(name);
        if self.includes == Includes::Below && !is_below(&relative) {
            return Err(Error::new(ErrorKind::InvalidInput, Outside));
        }
        Ok(self.root.join(relative))
    }
}

/// Returns whether a relative path never leaves the folder that it starts from.
fn is_below(path: &Path) -> bool {
    let mut depth = 0_usize;
    path.components().all(|part| match part {
        Component::Normal(_) => {
            depth += 1;
            true
        }
        Component::CurDir => true,
        Component::ParentDir => depth.checked_sub(1).map(|less| depth = less).is_some(),
        Component::Prefix(_) | Component::RootDir => false,
    })
}

impl Files for Folder {
    fn read(&mut self, path: &str, limit: u64) -> Result<Vec<u8>> {
        let path = self.locate(Path::new(path))?;
        let bytes = input::read(&path, limit).map_err(|error| explained(&path, error))?;
        self.read.push(path);
        Ok(bytes)
    }

    fn list(&mut self, folder: &str) -> Vec<String> {
        self.locate(Path::new(folder)).map_or_else(|_| Vec::new(), |path| names_in(&path))
    }
}

/// A source without files, for models that are complete in themselves.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Files for NoFiles {
    fn read(&mut self, _: &str, _: u64) -> Result<Vec<u8>> {
        Err(Error::new(ErrorKind::NotFound, "this scene must not refer to other files"))
    }
}

pub(super) use input::readable;

/// Reads a file that the user names.
pub(super) fn read_whole(path: &Path) -> std::result::Result<Vec<u8>, SceneError> {
    input::read(path, readable()).map_err(|error| SceneError::read(path, error))
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

    #[test]
    fn names_stay_below_the_scene() {
        let folder = Folder::of(Path::new("scenes/a.ron"));
        let locate = |folder: &Folder, name: &str| folder.locate(Path::new(name)).ok();
        let below = |name: &str| Some(Path::new("scenes").join(name));
        for name in ["a.obj", "models/a.obj", "./a", "models/../a", "..a", "a.."] {
            assert_eq!(locate(&folder, name), below(name), "{name}");
        }
        let model = folder.beside(&Path::new("scenes").join("models/a.gltf"));
        assert_eq!(locate(&model, "a.bin"), below("models/a.bin"));
        assert_eq!(locate(&model, "../textures/a.png"), below("models/../textures/a.png"));
        let outside = ["..", "../a", "models/../../a", "../scenes/a", "/etc/passwd"];
        for name in outside {
            assert_eq!(locate(&folder, name), None, "{name}");
        }
        assert_eq!(locate(&model, "../../a"), None);
        // Control: all of them are allowed if the user says so.
        let anywhere = folder.including(Includes::Anywhere);
        assert!(outside.iter().all(|name| locate(&anywhere, name).is_some()));
        assert_eq!(locate(&anywhere, "/etc/passwd"), Some(PathBuf::from("/etc/passwd")));
        let elsewhere = anywhere.beside(Path::new("/models/a.gltf"));
        assert_eq!(locate(&elsewhere, "a.bin"), Some(PathBuf::from("/models/a.bin")));
    }
}
