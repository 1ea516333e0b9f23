//! The copy of the workspace in which mutants are planted.

use crate::error::Error;
use std::collections::HashSet;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Folder that Git ignores and tests read; without it they would skip scenes.
const GENERATED: &str = "scenes/generated";

/// A copy of the files that Git tracks or would add.
pub struct Copy {
    root: PathBuf,
    folder: PathBuf,
    /// Locked as long as the copy is in use.
    _lock: File,
}

impl Copy {
    /// Copies the workspace at `root` to `folder`, and locks it.
    ///
    /// # Errors
    ///
    /// If the folder is in use or cannot be written, or `root` is no Git working tree.
    pub fn new(root: &Path, folder: &Path) -> Result<Self, Error> {
        fs::create_dir_all(folder).map_err(Error::io(folder))?;
        let path = folder.with_extension("lock");
        let lock = File::create(&path).map_err(Error::io(&path))?;
        // A child process that is about to run another program may still hold the lock of an
        // earlier copy for a moment.
        let mut left = 20;
        while let Err(error) = lock.try_lock() {
            match error {
                TryLockError::WouldBlock if left > 0 => left -= 1,
                TryLockError::WouldBlock => return Err(Error::Busy { path: folder.to_owned() }),
                TryLockError::Error(source) => return Err(Error::Io { path, source }),
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let copy = Self { root: root.to_owned(), folder: folder.to_owned(), _lock: lock };
        copy.fill()?;
        Ok(copy)
    }

    /// Returns the folder of the copy.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Makes the copy equal to the workspace. It writes only files that differ, so that Cargo
    /// compiles no more than it must.
    fn fill(&self) -> Result<(), Error> {
        let wanted = self.files()?;
        for file in &wanted {
            let (from, to) = (self.root.join(file), self.folder.join(file));
            let content = fs::read(&from).map_err(Error::io(&from))?;
            if fs::read(&to).is_ok_and(|old| old == content) {
                continue;
            }
            if let Some(parent) = to.parent() {
                fs::create_dir_all(parent).map_err(Error::io(parent))?;
            }
            fs::write(&to, content).map_err(Error::io(&to))?;
        }
        // Files of an earlier commit are removed, because they might be tests.
        let wanted: HashSet<PathBuf> = wanted.into_iter().collect();
        let mut folders = vec![self.folder.clone()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(&folder).map_err(Error::io(&folder))? {
                let path = entry.map_err(Error::io(&folder))?.path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.strip_prefix(&self.folder).is_ok_and(|file| !wanted.contains(file)) {
                    fs::remove_file(&path).map_err(Error::io(&path))?;
                }
            }
        }
        Ok(())
    }

    /// Reads a file of the copy.
    ///
    /// # Errors
    ///
    /// If it cannot be read.
    pub fn read(&self, file: &Path) -> Result<Vec<u8>, Error> {
        let path = self.folder.join(file);
        fs::read(&path).map_err(Error::io(&path))
    }

    /// Overwrites a file of the copy.
    ///
    /// # Errors
    ///
    /// If it cannot be written.
    pub fn write(&self, file: &Path, content: &[u8]) -> Result<(), Error> {
        let path = self.folder.join(file);
        fs::write(&path, content).map_err(Error::io(&path))
    }

    /// Returns paths from the root: tracked files, new files that are not ignored, and generated
    /// scenes.
    fn files(&self) -> Result<Vec<PathBuf>, Error> {
        let listed = git(&self.root, &["ls-files", "-z", "--cached", "--others", "--exclude-standard"])?;
        let mut files: Vec<PathBuf> =
            listed.split('\0').filter(|name| !name.is_empty()).map(PathBuf::from).collect();
        if let Ok(entries) = fs::read_dir(self.root.join(GENERATED)) {
            files.extend(entries.flatten().map(|entry| Path::new(GENERATED).join(entry.file_name())));
        }
        // Git lists deleted files until the deletion is committed, and submodules as folders.
        files.retain(|file| self.root.join(file).is_file());
        Ok(files)
    }
}

/// Runs Git and returns what it prints.
///
/// # Errors
///
/// If Git fails.
pub fn git(root: &Path, arguments: &[&str]) -> Result<String, Error> {
    let failed = |output: String| Error::Tool {
        action: format!("git {} (the gate copies what Git tracks)", arguments.join(" ")),
        output,
    };
    let output = Command::new("git").arg("-C").arg(root).args(arguments).output();
    let output = output.map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
